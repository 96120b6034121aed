// Common code of the Cortex-M ports: registers by address, SysTick, interrupts, a PL011 UART with ring buffers.
// Register names and offsets: ARMv6-M and ARMv7-M reference manuals, ARM DDI 0183 (PL011).
#pragma once

#include <stdint.h>

#include "../ring.h"

namespace chefbot {

inline volatile uint32_t &reg(uint32_t address) { return *reinterpret_cast<volatile uint32_t *>(address); }

inline void set_bits(uint32_t address, uint32_t bits) { reg(address) = reg(address) | bits; }
inline void clear_bits(uint32_t address, uint32_t bits) { reg(address) = reg(address) & ~bits; }

const uint32_t SYST_CSR = 0xE000E010, SYST_RVR = 0xE000E014, SYST_CVR = 0xE000E018;
const uint32_t NVIC_ISER = 0xE000E100, NVIC_IPR = 0xE000E400, SHPR3 = 0xE000ED20, AIRCR = 0xE000ED0C;

// SysTick at the lowest priority: edges and bytes interrupt a control step.
inline void start_steps(uint32_t cycles) {
    set_bits(SHPR3, 0xC0000000u);
    reg(SYST_RVR) = cycles - 1;
    reg(SYST_CVR) = 0;
    reg(SYST_CSR) = 7;
}

inline void enable_interrupt(uint32_t number) { reg(NVIC_ISER + 4 * (number / 32)) = 1u << (number % 32); }

inline uint8_t lock() {
    uint32_t before;
    __asm volatile("mrs %0, primask\n\tcpsid i" : "=r"(before)::"memory");
    return static_cast<uint8_t>(before);
}

inline void unlock(uint8_t before) { __asm volatile("msr primask, %0" ::"r"(static_cast<uint32_t>(before)) : "memory"); }

inline void reset_processor() {
    reg(AIRCR) = 0x05FA0004;
    for (;;) {}
}

// Puts bytes for an interrupt into a ring, all or nothing, and has them passed on; false: no room.
template <class Fill>
bool enqueue(Ring<8> &waiting, const char *bytes, uint8_t count, Fill fill) {
    if (waiting.room() < count) return false;
    while (count-- > 0) waiting.push(static_cast<uint8_t>(*bytes++));
    const uint8_t before = lock();
    fill();
    unlock(before);
    return true;
}

class Uart {
  public:
    explicit constexpr Uart(uint32_t base) : base_(base) {}

    void start(uint32_t whole, uint32_t fraction_64) {
        reg(base_ + IBRD) = whole;
        reg(base_ + FBRD) = fraction_64;
        reg(base_ + LCRH) = 0x70;  // 8N1, FIFOs
        reg(base_ + CR) = 0x301;
        reg(base_ + IM) = RECEIVE;
    }
    // From the interrupt.
    void serve() {
        while (!(reg(base_ + FR) & RX_EMPTY)) {
            const uint8_t byte = static_cast<uint8_t>(reg(base_ + DR));
            if (received_.room() > 0) received_.push(byte);  // else the line fails its CRC
        }
        reg(base_ + ICR) = RECEIVE;
        fill();
    }
    bool send(const char *bytes, uint8_t count) {
        return enqueue(waiting_, bytes, count, [this] { fill(); });
    }
    Ring<7> &received() { return received_; }

  private:
    static const uint32_t DR = 0x00, FR = 0x18, IBRD = 0x24, FBRD = 0x28, LCRH = 0x2C, CR = 0x30, IM = 0x38, ICR = 0x44;
    static const uint32_t RX_EMPTY = 1 << 4, TX_FULL = 1 << 5, RECEIVE = 0x50, SEND = 0x20;

    // As much as the FIFO takes; the rest when it is half empty.
    void fill() {
        while (!waiting_.empty() && !(reg(base_ + FR) & TX_FULL)) reg(base_ + DR) = waiting_.pop();
        reg(base_ + IM) = waiting_.empty() ? RECEIVE : RECEIVE | SEND;
    }

    const uint32_t base_;
    Ring<7> received_;
    Ring<8> waiting_;
};

}  // namespace chefbot
