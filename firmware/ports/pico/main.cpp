// Raspberry Pi Pico (RP2040), bare registers (RP2040 data sheet). Its computer is at the USB connector, or at a USB-serial
// cable on the UART; whichever a program has opened. All runs from the USB PLL at 48 MHz, the slowest at which the USB
// controller works; when the PLL fails, the watchdog, which counts the crystal, ends it.
#include "../arm/cortex.h"
#include "../i2c_clear.h"
#include "board.h"
#define BOARD_MARK "chefbot-pico-2"
#include "../robot_block.h"
#include "usb_serial.h"

using namespace chefbot;

namespace {

const uint32_t CRYSTAL = 12000000, CLOCK = 48000000;

const uint32_t PLL = 0x4002C000, PLL_POWER = 0x04, PLL_FEEDBACK = 0x08, PLL_DIVIDERS = 0x0C, PLL_RESET = 1u << 13;
const uint32_t RESETS = 0x4000C000, RESET_DONE = RESETS + 8;
const uint32_t USB = 1u << 24;
const uint32_t NEEDED = USB | 1u << 0 | 1u << 3 | 1u << 5 | 1u << 8 | 1u << 14 | 1u << 21 | 1u << 22;  // adc i2c0 io pads pwm timer uart0
const uint32_t XOSC = 0x40024000, XOSC_STATUS = 0x04, XOSC_STARTUP = 0x0C;
const uint32_t CLOCKS = 0x40008000, REF_CTRL = 0x30, REF_SELECTED = 0x38, SYS_CTRL = 0x3C, SYS_SELECTED = 0x44, PERI_CTRL = 0x48, USB_CTRL = 0x54,
               ADC_CTRL = 0x60;
const uint32_t IO_BANK0 = 0x40014000, INTR = 0xF0, PROC0_INTE = 0x100, PADS = 0x4001C004;
const uint32_t SIO_IN = 0xD0000004, SIO_SET = 0xD0000014, SIO_CLR = 0xD0000018, SIO_OE_SET = 0xD0000024, SIO_OE_CLR = 0xD0000028;
const uint32_t PWM = 0x40050000, PWM_SLICE = 0x14, PWM_CC = 0x0C, PWM_TOP = 0x10;
const uint32_t TIMER_RAW = 0x40054028;
const uint32_t ADC = 0x4004C000, ADC_RESULT = 0x04;
const uint32_t I2C0 = 0x40044000, IC_TAR = 0x04, IC_DATA_CMD = 0x10, IC_HCNT = 0x1C, IC_LCNT = 0x20, IC_RAW = 0x34,
               IC_CLR_ABORT = 0x54, IC_ENABLE = 0x6C, IC_STATUS = 0x70, IC_RXFLR = 0x78, IC_SDA_HOLD = 0x7C, IC_SPKLEN = 0xA0;
const uint32_t WATCHDOG = 0x40058000, WD_LOAD = 0x04, WD_REASON = 0x08, WD_TICK = 0x2C, PSM_WDSEL = 0x40010008;
const uint32_t UART0_BASE = 0x40034000, UART0_IRQ = 20, IO_IRQ = 13, USB_IRQ = 5;

// Pins (GP numbers) that stay where they are; those of the other signals are `board.pins` of the robot file.
enum Pin : uint32_t { TX = 0, RX = 1, SDA = 4, SCL = 5, BATTERY = 26 };
const uint32_t FUNCTION_UART = 2, FUNCTION_I2C = 3, FUNCTION_PWM = 4, FUNCTION_SIO = 5;
const uint32_t PULLED_UP = 0x5A, PLAIN = 0x52;  // pad: input enabled, Schmitt trigger, 4 mA
const uint32_t PWM_PERIOD = CLOCK / 20000;      // 20 kHz, above hearing

Board board;
Uart uart(UART0_BASE);
UsbSerial usb;
uint16_t battery_mv;
bool drivers_on;

const PicoPins &gp() { return robot_block().pins; }

bool enable_diag() { return robot_block().constants.enable_diag != 0; }

uint32_t in_a(uint8_t wheel) { return 1u << (wheel == LEFT ? gp().left_in_a : gp().right_in_a); }
uint32_t in_b(uint8_t wheel) { return 1u << (wheel == LEFT ? gp().left_in_b : gp().right_in_b); }

uint32_t lines(uint32_t pins, uint32_t first) { return (pins >> first & 1) << 1 | (pins >> (first + 1) & 1); }

void connect(uint32_t pin, uint32_t function, uint32_t pad) {
    reg(PADS + 4 * pin) = pad;
    reg(IO_BANK0 + 8 * pin + 4) = function;
}

// The slice of the PWM that a pin belongs to; even pins are its channel A.
uint32_t slice(uint32_t pin) { return PWM + pin / 2 % 8 * PWM_SLICE; }

void set_pwm(uint32_t pin, uint32_t level) {
    const uint32_t now = reg(slice(pin) + PWM_CC);
    reg(slice(pin) + PWM_CC) = pin % 2 == 0 ? (now & 0xFFFF0000u) | level : (now & 0xFFFFu) | level << 16;
}

void start_pwm(uint32_t pin) {
    reg(slice(pin) + PWM_TOP) = PWM_PERIOD - 1;
    reg(slice(pin)) = 1;
    connect(pin, FUNCTION_PWM, PLAIN);
}

// Both edges of a pin: bits 2 and 3 of its four.
void interrupt_on(uint32_t pin) { set_bits(IO_BANK0 + PROC0_INTE + 4 * (pin / 8), 0xCu << (4 * (pin % 8))); }

bool wait_for(uint32_t address, uint32_t bits, bool set) {
    const uint32_t start = reg(TIMER_RAW);
    while (((reg(address) & bits) != 0) != set) {
        if (reg(IC_RAW + I2C0) & 1u << 6 || reg(TIMER_RAW) - start > 1000) return false;  // refused, or 1 ms
    }
    return true;
}

void i2c_to(uint8_t address) {
    reg(I2C0 + IC_ENABLE) = 0;
    reg(I2C0 + IC_TAR) = address;
    reg(I2C0 + IC_ENABLE) = 1;
    const uint32_t reason = reg(I2C0 + IC_CLR_ABORT);  // reading forgets it
    (void)reason;
}

// The bus by hand: a line is low as an output, and high through its pull-up as an input.
struct BusLines {
    void scl(bool high) const { set(1u << SCL, high); }
    void sda(bool high) const { set(1u << SDA, high); }
    void set(uint32_t pin, bool high) const {
        reg(high ? SIO_OE_CLR : SIO_OE_SET) = pin;
        const uint32_t start = reg(TIMER_RAW);
        while (reg(TIMER_RAW) - start < 6) {}
    }
};

const uint32_t READ = 1u << 8, STOP = 1u << 9, RESTART = 1u << 10;
const uint32_t ROOM = 1u << 1, ALL_SENT = 1u << 2, ACTIVE = 1u << 5;

bool i2c_put(uint32_t command) {
    if (!wait_for(I2C0 + IC_STATUS, ROOM, true)) return false;
    reg(I2C0 + IC_DATA_CMD) = command;
    return true;
}

}  // namespace

// ---- the HAL -------------------------------------------------------------------------------------------------------

namespace chefbot {

uint8_t hal_lock(void *) { return lock(); }
void hal_unlock(void *, uint8_t before) { unlock(before); }

void hal_motor(void *, uint8_t wheel, int16_t duty) {
    const uint32_t level = static_cast<uint32_t>(duty < 0 ? -duty : duty) * (PWM_PERIOD / 200) / (DUTY_FULL / 200);
    if (robot_block().driver_inputs == TWO_PWM) {
        const TwoPwm high = two_pwm(drivers_on, duty, static_cast<uint16_t>(level), PWM_PERIOD);
        set_pwm(wheel == LEFT ? gp().left_in_a : gp().right_in_a, high.ahead);
        set_pwm(wheel == LEFT ? gp().left_in_b : gp().right_in_b, high.back);
        return;
    }
    set_pwm(wheel == LEFT ? gp().pwm_left : gp().pwm_right, level);
    // Both inputs high shorts the motor through the upper switches (VNH2SP30, VNH5019: brake to VCC)
    const uint32_t both = robot_block().driver_inputs == DIR_PWM ? in_a(wheel) : in_a(wheel) | in_b(wheel);
    const uint32_t low = duty > 0 ? in_b(wheel) : duty < 0 ? in_a(wheel) : 0;
    reg(SIO_CLR) = low;
    reg(SIO_SET) = both & ~low;
}

void hal_drivers(void *, bool on) {
    drivers_on = on;
    const uint32_t enable = 1u << gp().enable;
    // EN/DIAG is never driven high, as a driver may hold it low: an input with pull-up, or an output that is low
    if (enable_diag()) reg(on ? SIO_OE_CLR : SIO_OE_SET) = enable;
    else reg(on ? SIO_SET : SIO_CLR) = enable;
}

bool hal_driver_fault(void *) { return enable_diag() && drivers_on && !(reg(SIO_IN) >> gp().enable & 1); }

bool hal_estop(void *) { return reg(SIO_IN) >> gp().estop & 1; }

uint8_t hal_cliffs(void *) { return static_cast<uint8_t>(reg(SIO_IN) >> gp().cliff_0 & 0xF); }

uint16_t hal_battery_mv(void *) {
    if (reg(ADC) & 1u << 8) {
        battery_mv = static_cast<uint16_t>(reg(ADC + ADC_RESULT) * 4703 >> 10);  // 3300 mV / 4096, through 47k/10k
        reg(ADC) = 5;
    }
    return battery_mv;
}

void hal_ping(void *) {
    const uint32_t start = reg(TIMER_RAW);
    reg(SIO_SET) = 1u << gp().trigger;
    while (reg(TIMER_RAW) - start < 11) {}
    reg(SIO_CLR) = 1u << gp().trigger;
}

bool hal_i2c_write(void *, uint8_t address, uint8_t reg_number, uint8_t value) {
    i2c_to(address);
    if (!i2c_put(reg_number) || !i2c_put(value | STOP)) return false;
    return wait_for(I2C0 + IC_STATUS, ALL_SENT, true) && wait_for(I2C0 + IC_STATUS, ACTIVE, false);
}

bool hal_i2c_read(void *, uint8_t address, uint8_t reg_number, uint8_t *bytes, uint8_t count) {
    i2c_to(address);
    if (!i2c_put(reg_number)) return false;
    for (uint8_t i = 0; i < count; ++i) {
        if (!i2c_put(READ | (i == 0 ? RESTART : 0) | (i + 1 == count ? STOP : 0))) return false;
        if (!wait_for(I2C0 + IC_RXFLR, 0x1F, true)) return false;
        bytes[i] = static_cast<uint8_t>(reg(I2C0 + IC_DATA_CMD));
    }
    return true;
}

void hal_i2c_clear(void *) {
    reg(I2C0 + IC_ENABLE) = 0;
    reg(SIO_CLR) = 1u << SCL | 1u << SDA;
    connect(SCL, FUNCTION_SIO, PULLED_UP);
    connect(SDA, FUNCTION_SIO, PULLED_UP);
    clear_bus(BusLines());
    connect(SDA, FUNCTION_I2C, PULLED_UP);
    connect(SCL, FUNCTION_I2C, PULLED_UP);
}

bool hal_send(void *, const char *bytes, uint8_t count) { return usb.open() ? usb.send(bytes, count) : uart.send(bytes, count); }

// 30 ms; the counter of this chip runs twice as fast as documented (erratum RP2040-E1).
void hal_feed_watchdog(void *) { reg(WATCHDOG + WD_LOAD) = 2 * 30000; }

void hal_restart(void *) { reset_processor(); }

}  // namespace chefbot

// ---- interrupts ----------------------------------------------------------------------------------------------------

extern "C" {

void reset_handler();
void hang();
extern uint32_t stack_top;

void step_handler() { board.step(); }

// Acknowledge first, so that an edge meanwhile causes another interrupt.
void pin_handler() {
    uint32_t edges[3];
    for (uint32_t i = 0; i < 3; ++i) {
        edges[i] = reg(IO_BANK0 + INTR + 4 * i);
        reg(IO_BANK0 + INTR + 4 * i) = edges[i];
    }
    const uint32_t pins = reg(SIO_IN), echo = gp().echo;
    board.encoder_edge(LEFT, static_cast<uint8_t>(lines(pins, gp().left_a)));
    board.encoder_edge(RIGHT, static_cast<uint8_t>(lines(pins, gp().right_a)));
    if (edges[echo / 8] >> (4 * (echo % 8)) & 0xC) board.echo_edge(pins >> echo & 1, static_cast<uint16_t>(reg(TIMER_RAW)));
}

void uart_handler() { uart.serve(); }

void usb_handler() { usb.serve(); }

typedef void (*Handler)();
__attribute__((section(".vectors"), used)) const Handler VECTORS[16 + 21] = {
    reinterpret_cast<Handler>(&stack_top), reset_handler, hang, hang, nullptr, nullptr, nullptr, nullptr, nullptr, nullptr, nullptr, hang,
    nullptr, nullptr, hang, step_handler,
    hang, hang, hang, hang, hang, usb_handler, hang, hang, hang, hang, hang, hang, hang, pin_handler, hang, hang, hang, hang, hang, hang, uart_handler};
}

// ---- start ---------------------------------------------------------------------------------------------------------

static void start_clocks() {
    reg(XOSC + XOSC_STARTUP) = 47;  // 1 ms
    reg(XOSC) = 0xFABAA0;
    while (!(reg(XOSC + XOSC_STATUS) & 1u << 31)) {}
    reg(CLOCKS + REF_CTRL) = 2;
    while (!(reg(CLOCKS + REF_SELECTED) & 1u << 2)) {}
    clear_bits(RESETS, PLL_RESET);
    while (!(reg(RESET_DONE) & PLL_RESET)) {}
    reg(PLL) = 1;
    reg(PLL + PLL_FEEDBACK) = 100;                     // the oscillator runs at 1200 MHz
    clear_bits(PLL + PLL_POWER, 1u << 5 | 1u << 0);    // on
    while (!(reg(PLL) & 1u << 31)) {}
    reg(PLL + PLL_DIVIDERS) = 5u << 16 | 5u << 12;     // 48 MHz
    clear_bits(PLL + PLL_POWER, 1u << 3);
    reg(CLOCKS + SYS_CTRL) = 1u << 5;                  // first its source, then the switch to it
    reg(CLOCKS + SYS_CTRL) = 1u << 5 | 1;
    while (!(reg(CLOCKS + SYS_SELECTED) & 2)) {}
    reg(CLOCKS + PERI_CTRL) = 1u << 11;
    reg(CLOCKS + USB_CTRL) = 1u << 11;
    reg(CLOCKS + ADC_CTRL) = 1u << 11 | 3u << 5;
    reg(WATCHDOG + WD_TICK) = 1u << 9 | CRYSTAL / 1000000;  // also the microseconds of the timer
}

static void start_pins() {
    const uint32_t outputs = in_a(LEFT) | in_b(LEFT) | in_a(RIGHT) | in_b(RIGHT) | 1u << gp().enable | 1u << gp().trigger;
    reg(SIO_CLR) = outputs;
    reg(SIO_OE_SET) = outputs;
    const uint32_t plain[] = {gp().left_in_a, gp().left_in_b, gp().right_in_a, gp().right_in_b, gp().trigger, gp().echo};
    for (uint32_t pin : plain) connect(pin, FUNCTION_SIO, PLAIN);
    connect(gp().enable, FUNCTION_SIO, enable_diag() ? PULLED_UP : PLAIN);
    connect(gp().estop, FUNCTION_SIO, PULLED_UP);  // a broken wire is a pressed button
    const uint32_t cliffs = static_cast<uint32_t>(robot_block().constants.cliff_sensors);
    for (uint32_t i = 0; i < cliffs; ++i) connect(gp().cliff_0 + i, FUNCTION_SIO, PULLED_UP);
    const uint32_t encoders[] = {gp().left_a, gp().left_b, gp().right_a, gp().right_b};
    for (uint32_t pin : encoders) connect(pin, FUNCTION_SIO, PULLED_UP);
    connect(TX, FUNCTION_UART, PLAIN);
    connect(RX, FUNCTION_UART, PULLED_UP);
    connect(SDA, FUNCTION_I2C, PULLED_UP);
    connect(SCL, FUNCTION_I2C, PULLED_UP);
    reg(PADS + 4 * BATTERY) = 0x80;  // analogue: no input, no output, no pull
}

static void start_blocks() {
    const uint32_t single[] = {gp().pwm_left, gp().pwm_right};
    const uint32_t twin[] = {gp().left_in_a, gp().left_in_b, gp().right_in_a, gp().right_in_b};
    if (robot_block().driver_inputs == TWO_PWM) {
        for (uint32_t pin : twin) start_pwm(pin);
    } else {
        for (uint32_t pin : single) start_pwm(pin);
    }
    reg(ADC) = 1;
    while (!(reg(ADC) & 1u << 8)) {}
    reg(ADC) = 5;
    while (!(reg(ADC) & 1u << 8)) {}
    reg(I2C0 + IC_ENABLE) = 0;
    reg(I2C0) = 1u << 6 | 1u << 5 | 2u << 1 | 1;  // master, 400 kHz, restarts
    reg(I2C0 + IC_HCNT) = 48;
    reg(I2C0 + IC_LCNT) = 72;
    reg(I2C0 + IC_SPKLEN) = 4;
    reg(I2C0 + IC_SDA_HOLD) = 15;  // 300 ns
    uart.start(26, 3);             // 48 MHz / 16 / 115200
    usb.start(robot_block().name_crc);
}

static void start_watchdog() {
    reg(PSM_WDSEL) = 0x1FFFC;  // all but the oscillators
    hal_feed_watchdog(nullptr);
    reg(WATCHDOG) = 1u << 30;
}

int main() {
    require_robot();
    const bool after_watchdog = reg(WATCHDOG + WD_REASON) & 1;
    start_clocks();
    set_bits(RESETS, USB);  // after a restart of the processor alone, the computer has to find the device again
    clear_bits(RESETS, NEEDED);
    while ((reg(RESET_DONE) & NEEDED) != NEEDED) {}
    start_pins();
    start_blocks();
    board.start(robot_block().constants, nullptr, "rp2040", after_watchdog);
    board.encoder_start(LEFT, static_cast<uint8_t>(lines(reg(SIO_IN), gp().left_a)));
    board.encoder_start(RIGHT, static_cast<uint8_t>(lines(reg(SIO_IN), gp().right_a)));
    const uint32_t edges[] = {gp().left_a, gp().left_b, gp().right_a, gp().right_b, gp().echo};
    for (uint32_t pin : edges) interrupt_on(pin);
    enable_interrupt(IO_IRQ);
    enable_interrupt(UART0_IRQ);
    enable_interrupt(USB_IRQ);
    start_watchdog();
    start_steps(CLOCK / CONTROL_HZ);
    for (;;) {
        usb.accept();
        while (!usb.received().empty()) board.receive(usb.received().pop());
        while (!uart.received().empty()) {
            const uint8_t byte = uart.received().pop();
            if (!usb.open()) board.receive(byte);
        }
        board.poll();
    }
}
