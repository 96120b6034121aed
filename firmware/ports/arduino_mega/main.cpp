// ATmega2560 at 16 MHz (Arduino Mega 2560), bare registers.
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/wdt.h>
#include <util/delay.h>

#include "../i2c_clear.h"
#include "../ring.h"
#include "board.h"
#define BOARD_MARK "chefbot-mega-2"
#include "../robot_block.h"

using namespace chefbot;

namespace {

// Pin assignment; src/chefbot/design/wiring/board_pins.py has the same table. PWM is timer 1's OC1A and OC1B, that of BACK timer 5's OC5A and OC5B
// (for drivers with two PWM inputs), echo ICP4; encoders are INT4, INT5, INT3, INT2. A pull-down keeps ENABLE low in
// reset, unless it is EN/DIAG; ESTOP is normally closed to ground.
enum Pin : uint8_t {
    RX = PE0, TX = PE1, LEFT_A = PE4, LEFT_B = PE5, RIGHT_A = PD3, RIGHT_B = PD2, SDA = PD1, SCL = PD0,
    LEFT_IN_A = PA0, LEFT_IN_B = PA1, RIGHT_IN_A = PA2, RIGHT_IN_B = PA3, PWM_LEFT = PB5, PWM_RIGHT = PB6,
    ENABLE = PA4, ESTOP = PA6, TRIGGER = PC7, ECHO = PL0, BACK_LEFT = PL3, BACK_RIGHT = PL4, BATTERY = PF0, BUSY = PB7, CLIFF_0 = PC0
};
const uint8_t IN_A[2] = {1 << LEFT_IN_A, 1 << RIGHT_IN_A}, IN_B[2] = {1 << LEFT_IN_B, 1 << RIGHT_IN_B};

const uint16_t PWM_TOP = 800;                     // 16 MHz / 800 = 20 kHz, above hearing
const uint32_t COMPARE_PER_DUTY = PWM_TOP * 65536UL / DUTY_FULL + 1;  // in 1/65536, as a division takes 200 cycles
const uint16_t STEP_TOP = 16000000UL / 8 / 100 - 1;
const uint8_t BAUD_115200 = 16;                   // with U2X: 117647, +2.1 %, as the board's USB chip has it too
const uint8_t TWI_400K = 12;
const uint16_t TWI_PATIENCE = 1500;               // polls of about 0.6 us: 1 ms

// These survive a reset.
uint8_t reset_cause __attribute__((section(".noinit")));
uint16_t restart_asked __attribute__((section(".noinit")));
const uint16_t ASKED = 0xC4EF;

Board board;
volatile uint16_t battery_mv;
bool drivers_on;
bool two_pwm_inputs, enable_diag;
volatile bool twi_done;

Ring<7> received;
Ring<8> waiting;

uint8_t left_lines() { return static_cast<uint8_t>((PINE >> (LEFT_A - 1) & 2) | (PINE >> LEFT_B & 1)); }
uint8_t right_lines() { return static_cast<uint8_t>((PIND >> (RIGHT_A - 1) & 2) | (PIND >> RIGHT_B & 1)); }

// The next action of the bus. Its end is signalled by interrupt, not read from TWINT: simavr 1.6 leaves that flag set.
bool twi(uint8_t control) {
    twi_done = false;
    TWCR = static_cast<uint8_t>(control | 1 << TWINT | 1 << TWEN | 1 << TWIE);
    for (uint16_t i = 0; i < TWI_PATIENCE; ++i) {
        if (twi_done) return true;
    }
    return false;
}

uint8_t twi_status() { return TWSR & 0xF8; }

// Address or data, acknowledged: 0x18 after an address, 0x28 after data (which simavr 1.6 says after both).
bool twi_send(uint8_t byte) {
    TWDR = byte;
    return twi(0) && (twi_status() == 0x18 || twi_status() == 0x28);
}

// Ends the action of the bus, or gives it up.
bool twi_stop(bool result) {
    TWCR = 1 << TWINT | 1 << TWEN | 1 << TWSTO;
    for (uint16_t i = 0; TWCR & 1 << TWSTO; ++i) {
        if (i < TWI_PATIENCE) continue;
        TWCR = 0;
        return false;
    }
    return result;
}

bool twi_address(uint8_t address, uint8_t reg) {
    return twi(1 << TWSTA) && twi_status() == 0x08 && twi_send(static_cast<uint8_t>(address << 1)) && twi_send(reg);
}

bool twi_receive(uint8_t address, uint8_t *bytes, uint8_t count) {
    if (!twi(1 << TWSTA) || twi_status() != 0x10) return false;
    TWDR = static_cast<uint8_t>(address << 1 | 1);
    if (!twi(0) || twi_status() != 0x40) return false;
    while (count-- > 0) {
        if (!twi(count > 0 ? 1 << TWEA : 0)) return false;
        *bytes++ = TWDR;
    }
    return true;
}

void set_pwm(uint8_t wheel, uint16_t compare) {
    if (wheel == LEFT) OCR1A = compare;
    else OCR1B = compare;
}

// A function of its own, so that the other drivers do not save its registers.
__attribute__((noinline)) void set_two_pwm(uint8_t wheel, int16_t duty, uint16_t compare) {
    const TwoPwm high = two_pwm(drivers_on, duty, compare, PWM_TOP);
    set_pwm(wheel, high.ahead);
    if (wheel == LEFT) OCR5A = high.back;
    else OCR5B = high.back;
}

// EN/DIAG is never driven high, as a driver may hold it low: an input with pull-up, or an output that is low.
void release_enable(bool on) {
    if (on) {
        DDRA &= static_cast<uint8_t>(~(1 << ENABLE));
        PORTA |= 1 << ENABLE;
    } else {
        PORTA &= static_cast<uint8_t>(~(1 << ENABLE));
        DDRA |= 1 << ENABLE;
    }
}

// The bus by hand: a line is low as an output, and high through its pull-up as an input.
struct BusLines {
    void scl(bool high) const { set(1 << SCL, high); }
    void sda(bool high) const { set(1 << SDA, high); }
    void set(uint8_t pin, bool high) const {
        DDRD = static_cast<uint8_t>(high ? DDRD & ~pin : DDRD | pin);
        _delay_us(5);
    }
};

}  // namespace

// ---- the HAL -------------------------------------------------------------------------------------------------------

namespace chefbot {

uint8_t hal_lock(void *) {
    const uint8_t before = SREG;
    cli();
    return before;
}

void hal_unlock(void *, uint8_t before) { SREG = before; }

void hal_motor(void *, uint8_t wheel, int16_t duty) {
    const uint16_t size = static_cast<uint16_t>(duty < 0 ? -duty : duty);
    const uint16_t compare = static_cast<uint16_t>(size * COMPARE_PER_DUTY >> 16);
    if (two_pwm_inputs) return set_two_pwm(wheel, duty, compare);
    set_pwm(wheel, compare);
    // Both inputs high shorts the motor through the upper switches (VNH2SP30, VNH5019: brake to VCC); with DIR_PWM
    // nothing is connected to the second
    uint8_t pins = static_cast<uint8_t>(PORTA | IN_A[wheel] | IN_B[wheel]);
    if (duty > 0) pins &= static_cast<uint8_t>(~IN_B[wheel]);
    if (duty < 0) pins &= static_cast<uint8_t>(~IN_A[wheel]);
    PORTA = pins;
}

void hal_drivers(void *, bool on) {
    drivers_on = on;
    if (enable_diag) return release_enable(on);
    if (on) PORTA |= 1 << ENABLE;
    else PORTA &= static_cast<uint8_t>(~(1 << ENABLE));
}

bool hal_driver_fault(void *) { return enable_diag && drivers_on && !(PINA & 1 << ENABLE); }

bool hal_estop(void *) { return PINA & 1 << ESTOP; }

uint8_t hal_cliffs(void *) { return static_cast<uint8_t>(PINC >> CLIFF_0 & 0xF); }

uint16_t hal_battery_mv(void *) {
    if (!(ADCSRA & 1 << ADSC)) {
        battery_mv = static_cast<uint16_t>(ADC * 625UL / 32);  // 5000 mV / 1024, through 30k/10k
        ADCSRA |= 1 << ADSC;
    }
    return battery_mv;
}

void hal_ping(void *) {
    TCCR4B |= 1 << ICES4;  // rising edge first
    TIFR4 = 1 << ICF4;
    PORTC |= 1 << TRIGGER;
    _delay_us(10);
    PORTC &= static_cast<uint8_t>(~(1 << TRIGGER));
}

bool hal_i2c_write(void *, uint8_t address, uint8_t reg, uint8_t value) {
    return twi_stop(twi_address(address, reg) && twi_send(value));
}

bool hal_i2c_read(void *, uint8_t address, uint8_t reg, uint8_t *bytes, uint8_t count) {
    return twi_stop(twi_address(address, reg) && twi_receive(address, bytes, count));
}

void hal_i2c_clear(void *) {
    TWCR = 0;  // the pins are inputs without pull-ups again; those of the bus are on the board
    clear_bus(BusLines());
    TWCR = 1 << TWEN;
}

bool hal_send(void *, const char *bytes, uint8_t count) {
    if (waiting.room() < count) return false;
    while (count-- > 0) waiting.push(static_cast<uint8_t>(*bytes++));
    UCSR0B |= 1 << UDRIE0;
    return true;
}

void hal_feed_watchdog(void *) { wdt_reset(); }

void hal_restart(void *) {
    restart_asked = ASKED;
    cli();
    for (;;) {}  // the watchdog ends it
}

}  // namespace chefbot

// ---- interrupts ----------------------------------------------------------------------------------------------------

ISR(INT4_vect) { board.encoder_edge(LEFT, left_lines()); }
ISR(INT5_vect, ISR_ALIASOF(INT4_vect));
ISR(INT3_vect) { board.encoder_edge(RIGHT, right_lines()); }
ISR(INT2_vect, ISR_ALIASOF(INT3_vect));

// Other interrupts remain enabled: an encoder edge must not wait for a control step.
ISR(TIMER3_COMPA_vect, ISR_NOBLOCK) {
    PORTB |= 1 << BUSY;
    board.step();
    PORTB &= static_cast<uint8_t>(~(1 << BUSY));
}

// Four microseconds per count.
ISR(TIMER4_CAPT_vect) {
    const bool high = TCCR4B & 1 << ICES4;
    board.echo_edge(high, static_cast<uint16_t>(ICR4 * 4u));
    TCCR4B ^= 1 << ICES4;
    TIFR4 = 1 << ICF4;
}

ISR(TWI_vect) {
    TWCR = 1 << TWEN;  // keeps TWINT, so the bus waits
    twi_done = true;
}

ISR(USART0_RX_vect) {
    const uint8_t byte = UDR0;
    if (received.room() > 0) received.push(byte);  // else the line fails its CRC
}

ISR(USART0_UDRE_vect) {
    if (waiting.empty()) UCSR0B &= static_cast<uint8_t>(~(1 << UDRIE0));
    else UDR0 = waiting.pop();
}

// ---- start ---------------------------------------------------------------------------------------------------------

// Before main: a watchdog that has fired remains on with its shortest time.
extern "C" void before_main() __attribute__((naked, used, section(".init3")));
void before_main() {
    reset_cause = MCUSR;
    MCUSR = 0;
    wdt_disable();
}

static void start_pins() {
    EICRA = 1 << ISC20 | 1 << ISC30;  // any edge; before the pins, for a low pin is an interrupt by default
    EICRB = 1 << ISC40 | 1 << ISC50;
    PORTA = 1 << ESTOP;  // pull-up: a broken wire is a pressed button
    PORTC = 0xF << CLIFF_0;  // likewise: a broken wire is a cliff
    DDRA = IN_A[LEFT] | IN_B[LEFT] | IN_A[RIGHT] | IN_B[RIGHT] | 1 << ENABLE;
    DDRB = 1 << PWM_LEFT | 1 << PWM_RIGHT | 1 << BUSY;
    DDRC = 1 << TRIGGER;
    if (two_pwm_inputs) DDRL = 1 << BACK_LEFT | 1 << BACK_RIGHT;
    PORTE |= 1 << LEFT_A | 1 << LEFT_B;
    PORTD |= 1 << RIGHT_A | 1 << RIGHT_B;
}

static void start_timers() {
    ICR1 = PWM_TOP - 1;
    TCCR1A = 1 << COM1A1 | 1 << COM1B1 | 1 << WGM11;
    TCCR1B = 1 << WGM13 | 1 << WGM12 | 1 << CS10;
    if (two_pwm_inputs) {
        ICR5 = PWM_TOP - 1;
        TCCR5A = 1 << COM5A1 | 1 << COM5B1 | 1 << WGM51;
        TCCR5B = 1 << WGM53 | 1 << WGM52 | 1 << CS50;
    }
    OCR3A = STEP_TOP;
    TCCR3B = 1 << WGM32 | 1 << CS31;
    TIMSK3 = 1 << OCIE3A;
    TCCR4B = 1 << ICNC4 | 1 << ICES4 | 1 << CS41 | 1 << CS40;
    TIMSK4 = 1 << ICIE4;
}

static void start_buses() {
    UCSR0A = 1 << U2X0;
    UBRR0 = BAUD_115200;
    UCSR0C = 1 << UCSZ01 | 1 << UCSZ00;
    UCSR0B = 1 << RXEN0 | 1 << TXEN0 | 1 << RXCIE0;
    TWBR = TWI_400K;
    ADMUX = 1 << REFS0 | BATTERY;
    ADCSRA = 1 << ADEN | 1 << ADSC | 1 << ADPS2 | 1 << ADPS1 | 1 << ADPS0;
    while (ADCSRA & 1 << ADSC) {}
    EIFR = 1 << INTF2 | 1 << INTF3 | 1 << INTF4 | 1 << INTF5;
    EIMSK = 1 << INT2 | 1 << INT3 | 1 << INT4 | 1 << INT5;
}

int main() {
    require_robot();
    two_pwm_inputs = robot_block().driver_inputs == TWO_PWM;
    enable_diag = robot_block().constants.enable_diag != 0;
    start_pins();
    start_buses();
    board.start(robot_block().constants, nullptr, "mega2560", (reset_cause & 1 << WDRF) && restart_asked != ASKED);
    restart_asked = 0;
    board.encoder_start(LEFT, left_lines());
    board.encoder_start(RIGHT, right_lines());
    start_timers();
    wdt_enable(WDTO_30MS);
    sei();
    for (;;) {
        while (!received.empty()) board.receive(received.pop());
        board.poll();
    }
}
