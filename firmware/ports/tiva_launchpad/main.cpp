// Tiva C Launchpad EK-TM4C123GXL at 80 MHz, bare registers (TM4C123GH6PM data sheet, SPMS376). The chip's two QEI blocks
// count the encoders, so the encoders are on their pins and not on those of the chapter.
#include "../arm/cortex.h"
#include "../i2c_clear.h"
#include "board.h"
#define BOARD_MARK "chefbot-tiva-2"
#include "../robot_block.h"

using namespace chefbot;

namespace {

const uint32_t CLOCK = 80000000;

// System control.
const uint32_t RESC = 0x400FE05C, RCC = 0x400FE060, RCC2 = 0x400FE070, RIS = 0x400FE050, CLOCK_GATES = 0x400FE600;
const uint32_t GATE_WATCHDOG = 0x00, GATE_TIMER = 0x04, GATE_GPIO = 0x08, GATE_UART = 0x18, GATE_I2C = 0x20, GATE_ADC = 0x38,
               GATE_PWM = 0x40, GATE_QEI = 0x44;

// GPIO ports and offsets.
const uint32_t PORT_A = 0x40004000, PORT_B = 0x40005000, PORT_C = 0x40006000, PORT_D = 0x40007000, PORT_E = 0x40024000;
const uint32_t DATA = 0x3FC, DIR = 0x400, IBE = 0x408, IM = 0x410, ICR = 0x41C, AFSEL = 0x420, ODR = 0x50C, PUR = 0x510, DEN = 0x51C,
               LOCK = 0x520, COMMIT = 0x524, AMSEL = 0x528, PCTL = 0x52C;

// Pin assignment; src/chefbot/design/wiring/board_pins.py has the same table. Encoders are QEI0 and QEI1, PWM is M0PWM2 and M0PWM3, the battery AIN0.
// Drivers with two PWM inputs: those of the left motor are PWM_LEFT and PWM_RIGHT, of the right one RIGHT_IN_A and RIGHT_IN_B
// (M0PWM4 and M0PWM5).
const uint32_t A = 0, B = 8, C = 16, D = 24, E = 32;
enum Pin : uint32_t {
    RX = A + 0, TX = A + 1, LEFT_A = D + 6, LEFT_B = D + 7, RIGHT_A = C + 5, RIGHT_B = C + 6, SDA = B + 3, SCL = B + 2,
    LEFT_IN_A = A + 3, LEFT_IN_B = A + 4, RIGHT_IN_A = E + 4, RIGHT_IN_B = E + 5, PWM_LEFT = B + 4, PWM_RIGHT = B + 5,
    ENABLE = E + 1, ESTOP = A + 5, TRIGGER = A + 7, ECHO = A + 6, BATTERY = E + 3, CLIFF_0 = D + 0
};
constexpr uint32_t bit(Pin pin) { return 1u << pin % 8; }  // within its port
const uint32_t CLIFFS = 0xF << CLIFF_0 % 8;
const uint32_t DIRECTION_PORT[2] = {PORT_A, PORT_E};
const uint32_t IN_A[2] = {bit(LEFT_IN_A), bit(RIGHT_IN_A)}, IN_B[2] = {bit(LEFT_IN_B), bit(RIGHT_IN_B)};

const uint32_t PWM0 = 0x40028000, PWM_ENABLE = 0x08, PWM_GENERATOR[2] = {PWM0 + 0x80, PWM0 + 0xC0};
const uint32_t GEN_CTL = 0x00, GEN_LOAD = 0x10, GEN_CMPA = 0x18, GEN_CMPB = 0x1C, GEN_GENA = 0x20, GEN_GENB = 0x24;
const uint32_t PWM_PERIOD = CLOCK / 20000;  // 20 kHz, above hearing
const uint32_t QEI[2] = {0x4002C000, 0x4002D000}, QEI_CTL = 0x00, QEI_POS = 0x08, QEI_MAXPOS = 0x0C, QEI_RIS = 0x24, QEI_ISC = 0x28;
const uint32_t QEI_ERROR = 1 << 3;
const uint32_t TIMER0 = 0x40030000, TIMER_CFG = 0x00, TIMER_TAMR = 0x04, TIMER_CTL = 0x0C, TIMER_TAILR = 0x28, TIMER_TAPR = 0x38,
               TIMER_TAV = 0x50;
const uint32_t ADC0 = 0x40038000, ADC_ACTSS = 0x00, ADC_RIS = 0x04, ADC_ISC = 0x0C, ADC_PSSI = 0x28, ADC_SSMUX3 = 0xA0,
               ADC_SSCTL3 = 0xA4, ADC_SSFIFO3 = 0xA8;
const uint32_t I2C0 = 0x40020000, I2C_MSA = 0x00, I2C_MCS = 0x04, I2C_MDR = 0x08, I2C_MTPR = 0x0C, I2C_MCR = 0x20;
const uint32_t RUN = 1, START = 2, STOP = 4, ACK = 8, BUSY = 1, ERROR = 2;
const uint32_t WATCHDOG0 = 0x40000000, WDT_LOAD = 0x00, WDT_CTL = 0x08, WDT_ICR = 0x0C;
const uint32_t UART0_BASE = 0x4000C000, UART0_IRQ = 5, GPIO_A_IRQ = 0;

Board board;
Uart uart(UART0_BASE);
uint16_t battery_mv;
bool drivers_on;
uint16_t illegal[2];

uint16_t microseconds() { return static_cast<uint16_t>(0xFFFFu - (reg(TIMER0 + TIMER_TAV) & 0xFFFFu)); }

bool enable_diag() { return robot_block().constants.enable_diag != 0; }

// EN/DIAG is never driven high, as a driver may hold it low: an input with pull-up, or an output that is low.
void release_enable(bool on) {
    reg(PORT_E + (bit(ENABLE) << 2)) = 0;
    if (on) clear_bits(PORT_E + DIR, bit(ENABLE));
    else set_bits(PORT_E + DIR, bit(ENABLE));
}

// One bus action; false after an error or 1 ms.
bool i2c(uint32_t command) {
    reg(I2C0 + I2C_MCS) = command;
    // BUSY rises some clocks after the command (TivaWare waits for it in a loop of its own)
    for (uint32_t i = 0; i < 8; ++i) {
        const uint32_t status = reg(I2C0 + I2C_MCS);
        (void)status;
    }
    for (uint32_t i = 0; i < CLOCK / 1000 / 8; ++i) {
        if (!(reg(I2C0 + I2C_MCS) & BUSY)) return !(reg(I2C0 + I2C_MCS) & ERROR);
    }
    return false;
}

bool i2c_release() {
    reg(I2C0 + I2C_MCS) = STOP;
    return false;
}

void alternate(uint32_t port, uint32_t pins, uint32_t function) {
    for (uint32_t pin = 0; pin < 8; ++pin) {
        if (!(pins >> pin & 1)) continue;
        reg(port + PCTL) = (reg(port + PCTL) & ~(0xFu << (4 * pin))) | function << (4 * pin);
    }
    set_bits(port + AFSEL, pins);
    set_bits(port + DEN, pins);
}

// M0PWM2 to 5 by its number, high for a number of clocks of the period. A comparator above the load value never matches,
// and none at all is what low means.
void set_pwm(uint32_t number, uint32_t high) {
    const uint32_t compare = high >= PWM_PERIOD ? PWM_PERIOD : PWM_PERIOD - 1 - high;
    reg(PWM_GENERATOR[number / 2 - 1] + (number % 2 == 0 ? GEN_CMPA : GEN_CMPB)) = compare;
    if (high == 0) clear_bits(PWM0 + PWM_ENABLE, 1u << number);
    else set_bits(PWM0 + PWM_ENABLE, 1u << number);
}

// The bus by hand, both lines as open drains.
struct BusLines {
    void scl(bool high) const { set(bit(SCL), high); }
    void sda(bool high) const { set(bit(SDA), high); }
    void set(uint32_t pin, bool high) const {
        reg(PORT_B + (pin << 2)) = high ? pin : 0;
        const uint16_t start = microseconds();
        while (static_cast<uint16_t>(microseconds() - start) < 6) {}
    }
};

}  // namespace

// ---- the HAL -------------------------------------------------------------------------------------------------------

namespace chefbot {

uint8_t hal_lock(void *) { return lock(); }
void hal_unlock(void *, uint8_t before) { unlock(before); }

void hal_motor(void *, uint8_t wheel, int16_t duty) {
    const uint32_t size = static_cast<uint32_t>(duty < 0 ? -duty : duty) * (PWM_PERIOD / DUTY_FULL);
    if (robot_block().driver_inputs == TWO_PWM) {
        const TwoPwm high = two_pwm(drivers_on, duty, static_cast<uint16_t>(size), PWM_PERIOD);
        set_pwm(2u + 2u * wheel, high.ahead);
        set_pwm(3u + 2u * wheel, high.back);
        return;
    }
    set_pwm(2u + wheel, size);
    // Both inputs high shorts the motor through the upper switches (VNH2SP30: brake to VCC), as on the chapter's board
    const uint32_t both = IN_A[wheel] | IN_B[wheel], brake = robot_block().driver_inputs == DIR_PWM ? IN_A[wheel] : both;
    const uint32_t high = duty > 0 ? IN_A[wheel] : duty < 0 ? IN_B[wheel] : brake;
    // the address masks the pins
    reg(DIRECTION_PORT[wheel] + (both << 2)) = robot_block().driver_inputs == DIR_PWM ? high & IN_A[wheel] : high;
}

void hal_drivers(void *, bool on) {
    drivers_on = on;
    if (enable_diag()) return release_enable(on);
    reg(PORT_E + (bit(ENABLE) << 2)) = on ? bit(ENABLE) : 0;
}

bool hal_driver_fault(void *) { return enable_diag() && drivers_on && !reg(PORT_E + (bit(ENABLE) << 2)); }

bool hal_estop(void *) { return reg(PORT_A + (bit(ESTOP) << 2)) != 0; }

uint8_t hal_cliffs(void *) { return static_cast<uint8_t>(reg(PORT_D + (CLIFFS << 2))); }

uint16_t hal_battery_mv(void *) {
    if (reg(ADC0 + ADC_RIS) & 8) {
        battery_mv = static_cast<uint16_t>(reg(ADC0 + ADC_SSFIFO3) * 4703 >> 10);  // 3300 mV / 4096, through 47k/10k
        reg(ADC0 + ADC_ISC) = 8;
        reg(ADC0 + ADC_PSSI) = 8;
    }
    return battery_mv;
}

void hal_ping(void *) {
    const uint16_t start = microseconds();
    reg(PORT_A + (bit(TRIGGER) << 2)) = bit(TRIGGER);
    while (static_cast<uint16_t>(microseconds() - start) < 11) {}
    reg(PORT_A + (bit(TRIGGER) << 2)) = 0;
}

bool hal_i2c_write(void *, uint8_t address, uint8_t reg_number, uint8_t value) {
    reg(I2C0 + I2C_MSA) = static_cast<uint32_t>(address) << 1;
    reg(I2C0 + I2C_MDR) = reg_number;
    if (!i2c(START | RUN)) return i2c_release();
    reg(I2C0 + I2C_MDR) = value;
    return i2c(RUN | STOP) || i2c_release();
}

bool hal_i2c_read(void *, uint8_t address, uint8_t reg_number, uint8_t *bytes, uint8_t count) {
    reg(I2C0 + I2C_MSA) = static_cast<uint32_t>(address) << 1;
    reg(I2C0 + I2C_MDR) = reg_number;
    if (!i2c(START | RUN)) return i2c_release();
    reg(I2C0 + I2C_MSA) = static_cast<uint32_t>(address) << 1 | 1;
    for (uint8_t i = 0; i < count; ++i) {
        const uint32_t first = i == 0 ? START : 0, last = i + 1 == count ? STOP : ACK;
        if (!i2c(RUN | first | last)) return i2c_release();
        bytes[i] = static_cast<uint8_t>(reg(I2C0 + I2C_MDR));
    }
    return true;
}

void hal_i2c_clear(void *) {
    const uint32_t pins = bit(SCL) | bit(SDA);
    reg(PORT_B + (pins << 2)) = pins;
    set_bits(PORT_B + ODR, pins);
    set_bits(PORT_B + DIR, pins);
    clear_bits(PORT_B + AFSEL, pins);
    clear_bus(BusLines());
    set_bits(PORT_B + AFSEL, pins);
    clear_bits(PORT_B + DIR, pins);
    clear_bits(PORT_B + ODR, bit(SCL));
}

bool hal_send(void *, const char *bytes, uint8_t count) { return uart.send(bytes, count); }

void hal_feed_watchdog(void *) { reg(WATCHDOG0 + WDT_ICR) = 1; }

void hal_restart(void *) { reset_processor(); }

}  // namespace chefbot

// ---- interrupts ----------------------------------------------------------------------------------------------------

extern "C" {

void reset_handler();
void hang();
extern uint32_t stack_top;

void step_handler() {
    for (uint8_t wheel = LEFT; wheel <= RIGHT; ++wheel) {
        if (reg(QEI[wheel] + QEI_RIS) & QEI_ERROR) {
            reg(QEI[wheel] + QEI_ISC) = QEI_ERROR;
            ++illegal[wheel];
        }
        board.encoder_count(wheel, reg(QEI[wheel] + QEI_POS), illegal[wheel]);
    }
    board.step();
}

void echo_handler() {
    reg(PORT_A + ICR) = bit(ECHO);
    board.echo_edge(reg(PORT_A + (bit(ECHO) << 2)) != 0, microseconds());
}

void uart_handler() { uart.serve(); }

typedef void (*Handler)();
__attribute__((section(".vectors"), used)) const Handler VECTORS[16 + 6] = {
    reinterpret_cast<Handler>(&stack_top), reset_handler, hang, hang, hang, hang, hang, nullptr, nullptr, nullptr, nullptr, hang, hang,
    nullptr, hang, step_handler,
    echo_handler, hang, hang, hang, hang, uart_handler};
}

// ---- start ---------------------------------------------------------------------------------------------------------

// 16 MHz crystal, PLL at 400 MHz, divided by 5.
static void start_clock() {
    set_bits(RCC2, 1u << 31 | 1u << 11);                                       // RCC2 rules, PLL bypassed
    reg(RCC) = (reg(RCC) & ~(0x1Fu << 6 | 1u << 22 | 1u)) | 0x15u << 6;        // crystal 16 MHz, main oscillator on
    reg(RCC2) = (reg(RCC2) & ~(7u << 4 | 1u << 13));                           // from it; PLL powered
    reg(RCC2) = (reg(RCC2) & ~(0x7Fu << 22)) | 1u << 30 | 4u << 22;            // 400 MHz / (4 + 1)
    set_bits(RCC, 1u << 22);
    while (!(reg(RIS) & 1u << 6)) {}
    clear_bits(RCC2, 1u << 11);
}

static void open_gates() {
    reg(CLOCK_GATES + GATE_GPIO) = 0x1F;
    const uint32_t one[] = {GATE_WATCHDOG, GATE_TIMER, GATE_UART, GATE_I2C, GATE_ADC, GATE_PWM};
    for (uint32_t gate : one) set_bits(CLOCK_GATES + gate, 1);
    reg(CLOCK_GATES + GATE_QEI) = 3;
    while ((reg(0x400FEA08) & 0x1F) != 0x1F) {}  // GPIO ready
    while ((reg(0x400FEA44) & 3) != 3) {}        // QEI, the last that was asked for
}

static void start_pins() {
    reg(PORT_E + (bit(ENABLE) << 2)) = 0;
    set_bits(PORT_A + DIR, IN_A[LEFT] | IN_B[LEFT] | bit(TRIGGER));
    set_bits(PORT_E + DIR, IN_A[RIGHT] | IN_B[RIGHT] | bit(ENABLE));
    set_bits(PORT_A + PUR, bit(ESTOP));  // a broken wire is a pressed button
    if (enable_diag()) set_bits(PORT_E + PUR, bit(ENABLE));
    set_bits(PORT_A + DEN, IN_A[LEFT] | IN_B[LEFT] | bit(TRIGGER) | bit(ECHO) | bit(ESTOP));
    set_bits(PORT_D + PUR, CLIFFS);      // likewise: a broken wire is a cliff
    set_bits(PORT_D + DEN, CLIFFS);
    set_bits(PORT_E + DEN, IN_A[RIGHT] | IN_B[RIGHT] | bit(ENABLE));
    reg(PORT_D + LOCK) = 0x4C4F434B;  // PD7 is guarded as an NMI input
    set_bits(PORT_D + COMMIT, bit(LEFT_B));
    alternate(PORT_A, bit(RX) | bit(TX), 1);
    alternate(PORT_B, bit(SCL) | bit(SDA), 3);
    set_bits(PORT_B + ODR, bit(SDA));
    alternate(PORT_B, bit(PWM_LEFT) | bit(PWM_RIGHT), 4);
    if (robot_block().driver_inputs == TWO_PWM) alternate(PORT_E, IN_A[RIGHT] | IN_B[RIGHT], 4);
    alternate(PORT_D, bit(LEFT_A) | bit(LEFT_B), 6);
    alternate(PORT_C, bit(RIGHT_A) | bit(RIGHT_B), 6);
    clear_bits(PORT_E + DEN, bit(BATTERY));
    set_bits(PORT_E + AFSEL, bit(BATTERY));
    set_bits(PORT_E + AMSEL, bit(BATTERY));
    set_bits(PORT_A + IBE, bit(ECHO));
    reg(PORT_A + ICR) = bit(ECHO);
    set_bits(PORT_A + IM, bit(ECHO));
}

static void start_blocks() {
    for (uint32_t qei : QEI) {
        reg(qei + QEI_MAXPOS) = 0xFFFFFFFF;
        reg(qei + QEI_CTL) = 1u << 13 | 1u << 3 | 1;  // input filter, all four edges, on
    }
    for (uint32_t generator : PWM_GENERATOR) {
        reg(generator + GEN_GENA) = 0x08C;
        reg(generator + GEN_GENB) = 0x80C;
        reg(generator + GEN_LOAD) = PWM_PERIOD - 1;
        reg(generator + GEN_CTL) = 1;
    }
    reg(TIMER0 + TIMER_CFG) = 4;
    reg(TIMER0 + TIMER_TAMR) = 2;
    reg(TIMER0 + TIMER_TAPR) = CLOCK / 1000000 - 1;
    reg(TIMER0 + TIMER_TAILR) = 0xFFFF;
    reg(TIMER0 + TIMER_CTL) = 1;
    reg(ADC0 + ADC_SSMUX3) = 0;
    reg(ADC0 + ADC_SSCTL3) = 6;
    reg(ADC0 + ADC_ACTSS) = 8;
    reg(ADC0 + ADC_PSSI) = 8;
    while (!(reg(ADC0 + ADC_RIS) & 8)) {}
    reg(I2C0 + I2C_MCR) = 0x10;
    reg(I2C0 + I2C_MTPR) = CLOCK / (20 * 400000) - 1;
    uart.start(43, 26);  // 80 MHz / 16 / 115200
}

// 15 ms to the interrupt, which is not handled, and 15 ms more to the reset.
static void start_watchdog() {
    reg(WATCHDOG0 + WDT_LOAD) = CLOCK / 1000 * 15;
    reg(WATCHDOG0 + WDT_CTL) = 3;
}

int main() {
    require_robot();
    const bool after_watchdog = reg(RESC) & 1 << 3;
    reg(RESC) = 0;
    start_clock();
    open_gates();
    start_pins();
    start_blocks();
    board.start(robot_block().constants, nullptr, "tm4c123", after_watchdog);
    enable_interrupt(GPIO_A_IRQ);
    enable_interrupt(UART0_IRQ);
    start_watchdog();
    start_steps(CLOCK / CONTROL_HZ);
    for (;;) {
        while (!uart.received().empty()) board.receive(uart.received().pop());
        board.poll();
    }
}
