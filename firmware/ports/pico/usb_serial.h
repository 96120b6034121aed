// The Pico's USB connector as a serial port: a CDC device on the RP2040's USB controller (RP2040 data sheet, 4.1).
#pragma once

#include "../arm/cortex.h"
#include "usb_descriptors.h"

namespace chefbot {

class UsbSerial {
  public:
    constexpr UsbSerial() {}

    // serial_number: what the computer recognizes this board by.
    void start(uint32_t serial_number) {
        serial_number_ = serial_number;
        for (uint32_t at = MEMORY; at < MEMORY + BUFFERS; at += 4) reg(at) = 0;
        reg(REGISTERS + MUXING) = 1u << 3 | 1u << 0;  // to the chip's transceiver
        reg(REGISTERS + POWER) = 1u << 3 | 1u << 2;   // the connector's voltage is taken for present
        reg(REGISTERS + MAIN_CTRL) = 1;
        reg(REGISTERS + SIE_CTRL) = 1u << 29;         // a buffer of endpoint 0 interrupts
        reg(REGISTERS + INTERRUPTS_ENABLED) = BUFFER | BUS_RESET | SETUP;
        set_bits(REGISTERS + SIE_CTRL, 1u << 16);     // pull-up: the computer sees a device
    }

    // From the interrupt.
    void serve() {
        const uint32_t causes = reg(REGISTERS + INTERRUPTS);
        if (causes & BUFFER) finish_buffers();
        if (causes & SETUP) {
            reg(REGISTERS + SIE_STATUS) = 1u << 17;  // writing clears it
            answer_request();
        }
        if (causes & BUS_RESET) {
            reg(REGISTERS + ADDRESS) = 0;
            configured_ = listening_ = false;
            reg(control(2, IN)) = 0;
            reg(control(2, OUT)) = 0;
            reg(REGISTERS + SIE_STATUS) = 1u << 19;
        }
    }

    // Whether a program on the computer has opened the port; an unplugged cable leaves the bus suspended.
    bool open() const { return configured_ && listening_ && !(reg(REGISTERS + SIE_STATUS) & 1u << 4); }

    bool send(const char *bytes, uint8_t count) {
        return enqueue(waiting_, bytes, count, [this] { fill(); });
    }

    Ring<8> &received() { return received_; }

    // From the main loop: the next packet is taken where there is room for it; until then the computer waits.
    void accept() {
        if (!configured_ || accepting_ || received_.room() < PACKET) return;
        const uint8_t before = lock();
        accepting_ = true;
        arm(2, OUT, PACKET, out_pid_);
        out_pid_ = !out_pid_;
        unlock(before);
    }

  private:
    static const uint32_t MEMORY = 0x50100000, REGISTERS = 0x50110000;
    static const uint32_t ENDPOINT_CTRL = 0x08, BUFFER_CTRL = 0x80, BUFFERS = 0x100;
    static const uint32_t ADDRESS = 0x00, MAIN_CTRL = 0x40, SIE_CTRL = 0x4C, SIE_STATUS = 0x50, BUFFER_STATUS = 0x58,
                          STALL_ARM = 0x68, MUXING = 0x74, POWER = 0x78, INTERRUPTS_ENABLED = 0x90, INTERRUPTS = 0x98;
    static const uint32_t BUFFER = 1u << 4, BUS_RESET = 1u << 12, SETUP = 1u << 16;
    static const uint32_t FULL = 1u << 15, DATA1 = 1u << 13, STALL = 1u << 11, AVAILABLE = 1u << 10, LENGTH = 0x3FF;
    static const uint32_t BULK = 2, INTERRUPT = 3;
    enum Direction : uint32_t { IN = 0, OUT = 4 };
    enum Stage : uint8_t { IDLE, ANSWERING, TAKING };  // of the control transfer on endpoint 0

    // Endpoint 0 has one buffer for both directions.
    static uint32_t buffer(uint32_t endpoint, Direction direction) {
        return endpoint == 0 ? BUFFERS : BUFFERS + 0x40 + endpoint * 0x80 + (direction == OUT ? 0x40 : 0);
    }
    static volatile uint8_t *bytes_of(uint32_t endpoint, Direction direction) {
        return reinterpret_cast<volatile uint8_t *>(MEMORY + buffer(endpoint, direction));
    }
    static uint32_t control(uint32_t endpoint, Direction direction) { return MEMORY + BUFFER_CTRL + 8 * endpoint + direction; }

    // The controller looks at AVAILABLE on another clock: it follows the other bits (data sheet, 4.1.2.5.1).
    static void arm(uint32_t endpoint, Direction direction, uint32_t length, bool data1) {
        const uint32_t bits = (direction == IN ? FULL : 0) | (data1 ? DATA1 : 0) | length;
        reg(control(endpoint, direction)) = bits;
        for (uint32_t i = 0; i < 3; ++i) __asm volatile("nop\n\tnop\n\tnop\n\tnop");
        reg(control(endpoint, direction)) = bits | AVAILABLE;
    }

    static void enable(uint32_t endpoint, Direction direction, uint32_t type) {
        reg(MEMORY + ENDPOINT_CTRL + 8 * (endpoint - 1) + direction) =
            1u << 31 | 1u << 29 | type << 26 | buffer(endpoint, direction);
    }

    // ---- data

    // Less than a whole packet, so that no transfer is open-ended.
    void fill() {
        if (!configured_ || sending_ || waiting_.empty()) return;
        volatile uint8_t *to = bytes_of(2, IN);
        uint32_t length = 0;
        while (length < PACKET - 1u && !waiting_.empty()) to[length++] = waiting_.pop();
        sending_ = true;
        arm(2, IN, length, in_pid_);
        in_pid_ = !in_pid_;
    }

    void take() {
        const volatile uint8_t *from = bytes_of(2, OUT);
        const uint32_t length = reg(control(2, OUT)) & LENGTH;
        for (uint32_t i = 0; i < length; ++i) received_.push(from[i]);
        accepting_ = false;
    }

    // ---- control transfers

    void finish_buffers() {
        const uint32_t finished = reg(REGISTERS + BUFFER_STATUS);
        reg(REGISTERS + BUFFER_STATUS) = finished;  // writing clears it
        if (finished & 1u << 0) finish_answer();
        if (finished & 1u << 1 && stage_ == TAKING) acknowledge();
        if (finished & 1u << 4) {
            sending_ = false;
            fill();
        }
        if (finished & 1u << 5) take();
    }

    // A part of an answer was sent, or an acknowledgement.
    void finish_answer() {
        if (new_address_ != 0) reg(REGISTERS + ADDRESS) = new_address_;
        new_address_ = 0;
        if (stage_ != ANSWERING) return;
        if (left_ > 0) return send_part();
        stage_ = IDLE;
        arm(0, OUT, 0, true);  // the computer's acknowledgement
    }

    void answer_request() {
        const uint32_t first = reg(MEMORY), second = reg(MEMORY + 4);
        const uint32_t request = (first & 0xE0) << 8 | (first >> 8 & 0xFF), value = first >> 16, length = second >> 16;
        stage_ = IDLE;
        control_pid_ = true;
        switch (request) {
            case 0x8006: return describe(value, length);
            case 0x0005:  // set address: after the acknowledgement
                new_address_ = value & 0x7F;
                return acknowledge();
            case 0x0009:
                configure(value != 0);
                return acknowledge();
            case 0x8000: return answer(NO_STATUS, sizeof NO_STATUS, length);
            case 0x8008: return answer(&configuration_, 1, length);
            case 0x000B: return acknowledge();  // set interface
            case 0x2020:                        // set line coding: 7 bytes, ignored
                stage_ = TAKING;
                return arm(0, OUT, PACKET, true);
            case 0xA021: return answer(LINE_CODING, sizeof LINE_CODING, length);
            case 0x2022: return set_lines(value & 1);
            default: refuse();
        }
    }

    void configure(bool on) {
        configuration_ = on;
        enable(1, IN, INTERRUPT);
        enable(2, IN, BULK);
        enable(2, OUT, BULK);
        in_pid_ = out_pid_ = sending_ = accepting_ = listening_ = false;
        configured_ = on;
    }

    // DTR: a program opens the port; what an earlier one did not read is dropped.
    void set_lines(bool dtr) {
        while (!waiting_.empty()) waiting_.pop();
        listening_ = dtr;
        acknowledge();
    }

    void describe(uint32_t value, uint32_t length) {
        switch (value) {
            case 0x100: return answer(DEVICE_DESCRIPTOR, sizeof DEVICE_DESCRIPTOR, length);
            case 0x200: return answer(CONFIGURATION_DESCRIPTOR, sizeof CONFIGURATION_DESCRIPTOR, length);
            case 0x300: return answer(LANGUAGES, sizeof LANGUAGES, length);
            case 0x301: return answer_text(MAKER, length);
            case 0x302: return answer_text(PRODUCT, length);
            case 0x303: return answer_text(serial_text(), length);
            default: refuse();
        }
    }

    const char *serial_text() {
        for (uint32_t i = 0; i < 8; ++i) text_[i] = "0123456789abcdef"[serial_number_ >> (28 - 4 * i) & 15];
        return text_;
    }

    // UTF-16, as USB has it.
    void answer_text(const char *text, uint32_t requested) {
        uint8_t length = 2;
        for (; *text && length < sizeof string_; length = static_cast<uint8_t>(length + 2)) {
            string_[length] = static_cast<uint8_t>(*text++);
            string_[length + 1] = 0;
        }
        string_[0] = length;
        string_[1] = 3;
        answer(string_, length, requested);
    }

    // None is a multiple of a packet long, so each ends with a shorter one.
    void answer(const uint8_t *bytes, uint32_t length, uint32_t requested) {
        stage_ = ANSWERING;
        answer_ = bytes;
        left_ = length < requested ? length : requested;
        send_part();
    }

    void send_part() {
        const uint32_t length = left_ < PACKET ? left_ : PACKET;
        volatile uint8_t *to = bytes_of(0, IN);
        for (uint32_t i = 0; i < length; ++i) to[i] = *answer_++;
        left_ -= length;
        arm(0, IN, length, control_pid_);
        control_pid_ = !control_pid_;
    }

    void acknowledge() {
        stage_ = IDLE;
        arm(0, IN, 0, true);
    }

    void refuse() {
        reg(REGISTERS + STALL_ARM) = 3;  // the next request ends it
        reg(control(0, IN)) = STALL;
        reg(control(0, OUT)) = STALL;
    }

    Ring<8> received_, waiting_;
    const uint8_t *answer_ = nullptr;
    uint32_t left_ = 0, new_address_ = 0, serial_number_ = 0;
    Stage stage_ = IDLE;
    uint8_t configuration_ = 0, string_[2 + 2 * sizeof PRODUCT] = {0};
    char text_[9] = {0};
    bool control_pid_ = false, in_pid_ = false, out_pid_ = false;
    volatile bool configured_ = false, listening_ = false, sending_ = false, accepting_ = false;
};

}  // namespace chefbot
