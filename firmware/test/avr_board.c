// The Mega's program in simavr, with encoders, IMU, ultrasonic, battery and e-stop button.
//
// A test tool by itself: it links simavr, which is under the GPL version 3; nothing of the project links this file.
//
//   avr_board FIRMWARE.elf [BOOT_LOADER.hex]     lockstep: commands on stdin, one answer each on stdout
//
// With a boot loader every reset begins there, as the fuses of a Mega are set, and time starts at power-on.
// Commands: `tx HEX`, `turn WHEEL N` (quarter steps, spread over the next 6 ms), `imu AX AY AZ T
// GX GY GZ`, `imu_answers 0|1`, `battery MV`, `echo US` (-1 no sensor, 0 no echo), `estop 0|1`, `driver_fault 0|1`, `reset`,
// `run US`.
// `run` answers `DUTY_LEFT DUTY_RIGHT DRIVERS STEPS LONGEST_STEP_CYCLES RESETS HEX`, where HEX are the bytes that the board sent (or -).
// All others answer `ok`. Time starts 3 ms after the first control step, or at power-on.
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "avr_adc.h"
#include "avr_ioport.h"
#include "avr_twi.h"
#include "avr_uart.h"
#include "avr_watchdog.h"
#include "sim_avr.h"
#include "sim_elf.h"
#include "sim_hex.h"
#include "sim_irq.h"
#include "sim_time.h"

enum { HZ = 16000000, PER_US = 16, BYTE_CYCLES = 1389, OUT_ROOM = 1 << 20, IN_ROOM = 4096 };
enum { IMU = 0x68, WHO_AM_I = 0x75, POWER = 0x6B, SAMPLE = 0x3B };

static avr_t *avr;

// ---- serial line ---------------------------------------------------------------------------------------------------

static uint8_t out[OUT_ROOM], in[IN_ROOM];
static size_t out_count, in_head, in_tail;
static avr_cycle_count_t in_next;

static void on_byte_out(struct avr_irq_t *irq, uint32_t value, void *param) {
    (void)irq;
    (void)param;
    if (out_count < OUT_ROOM) out[out_count++] = (uint8_t)value;
}

static void send_due_byte(void) {
    if (in_head == in_tail || avr->cycle < in_next) return;
    avr_raise_irq(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_INPUT), in[in_tail]);
    in_tail = (in_tail + 1) % IN_ROOM;
    in_next = avr->cycle + BYTE_CYCLES;
}

static void queue_byte(uint8_t byte) {
    if (in_head == in_tail && in_next < avr->cycle) in_next = avr->cycle;
    if ((in_head + 1) % IN_ROOM == in_tail) return;
    in[in_head] = byte;
    in_head = (in_head + 1) % IN_ROOM;
}

// ---- IMU -----------------------------------------------------------------------------------------------------------

static uint8_t imu[128];
static int imu_answers = 1, imu_selected, imu_index, imu_written;
static avr_irq_t *twi_in;

static void imu_put(const int *raw) {
    for (int i = 0; i < 7; ++i) {
        imu[SAMPLE + 2 * i] = (uint8_t)((uint16_t)raw[i] >> 8);
        imu[SAMPLE + 2 * i + 1] = (uint8_t)raw[i];
    }
}

static void on_twi(struct avr_irq_t *irq, uint32_t value, void *param) {
    (void)irq;
    (void)param;
    avr_twi_msg_irq_t m;
    m.u.v = value;
    if (m.u.twi.msg & TWI_COND_STOP) imu_selected = 0;
    if (m.u.twi.msg & TWI_COND_START) {
        imu_selected = imu_answers && (m.u.twi.addr >> 1) == IMU;
        imu_written = 0;
        if (imu_selected) avr_raise_irq(twi_in, avr_twi_irq_msg(TWI_COND_ACK, m.u.twi.addr, 1));
    }
    if (!imu_selected) return;
    if (m.u.twi.msg & TWI_COND_WRITE) {
        avr_raise_irq(twi_in, avr_twi_irq_msg(TWI_COND_ACK, m.u.twi.addr, 1));
        if (imu_written++ == 0) imu_index = m.u.twi.data & 127;
        else {
            imu[imu_index] = imu_index == POWER && (m.u.twi.data & 0x80) ? 0x40 : m.u.twi.data;
            imu_index = (imu_index + 1) & 127;
        }
    }
    if (m.u.twi.msg & TWI_COND_READ) {
        avr_raise_irq(twi_in, avr_twi_irq_msg(TWI_COND_READ, m.u.twi.addr, imu[imu_index]));
        imu_index = (imu_index + 1) & 127;
    }
}

// ---- encoders ------------------------------------------------------------------------------------------------------

static const int LINES[4] = {0, 2, 3, 1};  // forward: A before B
static int phase[2];
static long turns[2];  // quarter steps still to come
static double turn_every[2], turn_next[2];

// What drives a pin from outside; without it simavr's pull-ups win whenever the program writes the port.
static void hold(char port, int mask, int value) {
    avr_ioport_external_t outside = {.name = (unsigned)port, .mask = (unsigned)mask, .value = (unsigned)value};
    avr_ioctl(avr, AVR_IOCTL_IOPORT_SET_EXTERNAL(port), &outside);
}

static void pin(char port, int bit, int value) {
    avr_raise_irq(avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ(port), bit), (uint32_t)value);
}

static void show_lines(int wheel) {
    static const struct { char port; int a, b; } PINS[2] = {{'E', 4, 5}, {'D', 3, 2}};
    const int lines = LINES[phase[wheel] & 3];
    pin(PINS[wheel].port, PINS[wheel].a, lines >> 1);
    pin(PINS[wheel].port, PINS[wheel].b, lines & 1);
}

static void turn_due(int wheel) {
    if (!turns[wheel] || (double)avr->cycle < turn_next[wheel]) return;
    const int way = turns[wheel] > 0 ? 1 : -1;
    phase[wheel] += way;
    turns[wheel] -= way;
    turn_next[wheel] += turn_every[wheel];
    show_lines(wheel);
}

static void turn(int wheel, long quarter_steps) {
    turns[wheel] += quarter_steps;
    if (!turns[wheel]) return;
    turn_every[wheel] = 6000.0 * PER_US / labs(turns[wheel]);
    turn_next[wheel] = (double)avr->cycle + turn_every[wheel] * (wheel ? 0.75 : 0.25);
}

// ---- ultrasonic ----------------------------------------------------------------------------------------------------

static int echo_us;

static avr_cycle_count_t echo_fall(avr_t *a, avr_cycle_count_t when, void *param) {
    (void)a, (void)when, (void)param;
    pin('L', 0, 0);
    return 0;
}

static avr_cycle_count_t echo_rise(avr_t *a, avr_cycle_count_t when, void *param) {
    (void)when, (void)param;
    pin('L', 0, 1);
    avr_cycle_timer_register_usec(a, echo_us > 0 ? (uint32_t)echo_us : 38000, echo_fall, NULL);
    return 0;
}

static void on_trigger(struct avr_irq_t *irq, uint32_t value, void *param) {
    (void)irq, (void)param;
    if (value && echo_us >= 0) avr_cycle_timer_register_usec(avr, 460, echo_rise, NULL);
}

// ---- battery, duty, busy pin ---------------------------------------------------------------------------------------

static int battery_mv = 12000;
static uint64_t steps, longest_step, resets;
static avr_cycle_count_t step_began;

static void on_adc(struct avr_irq_t *irq, uint32_t value, void *param) {
    (void)irq, (void)value, (void)param;
    avr_raise_irq(avr_io_getirq(avr, AVR_IOCTL_ADC_GETIRQ, ADC_IRQ_ADC0), (uint32_t)(battery_mv / 4));
}

static void on_busy(struct avr_irq_t *irq, uint32_t value, void *param) {
    (void)irq, (void)param;
    if (value) {
        step_began = avr->cycle;
        ++steps;
    } else if (step_began && avr->cycle - step_began > longest_step) {
        longest_step = avr->cycle - step_began;
    }
}

enum { INA_INB_PWM, DIR_PWM, TWO_PWM };
static int inputs;  // of the motor drivers
static int enable_diag, driver_fault;

// EN/DIAG is released as an input, and must never be an output that is high.
static int drivers(void) {
    const int high = avr->data[0x22] >> 4 & 1, is_output = avr->data[0x21] >> 4 & 1;
    if (!enable_diag) return is_output && high;
    if (is_output && high) {
        fprintf(stderr, "avr_board: EN/DIAG is driven high\n");
        exit(4);
    }
    return !is_output && !driver_fault;
}
static const int PWM_TOP = 800, NEITHER = 9999;

static int compare(int address) { return avr->data[address] | avr->data[address + 1] << 8; }

// What a driver with two PWM inputs does: shorts the motor while both are high, drives it while one of them is low. Both
// low while it is off, and nothing else.
static int duty_of_two(int ahead, int back) {
    if (!drivers()) return ahead || back ? NEITHER : 0;
    if (ahead != PWM_TOP && back != PWM_TOP) return NEITHER;
    return (ahead - back) * 5 / 4;
}

// Per mille from the compare registers of timers 1 and 5 and the direction pins.
static int duty(int wheel) {
    const int ahead = compare(wheel ? 0x8A : 0x88), bits = avr->data[0x22] >> (2 * wheel) & 3;
    if (inputs == TWO_PWM) return duty_of_two(ahead, compare(wheel ? 0x12A : 0x128));
    const int size = ahead * 5 / 4;
    if (inputs == DIR_PWM) return bits & 1 ? size : -size;
    return bits == 1 ? size : bits == 2 ? -size : 0;
}

// From the environment, `driver.inputs` of the robot file.
static void read_inputs(void) {
    const char *name = getenv("CHEFBOT_DRIVER_INPUTS"), *diag = getenv("CHEFBOT_ENABLE_DIAG");
    enable_diag = diag && *diag == '1';
    if (!name) return;
    inputs = !strcmp(name, "dir_pwm") ? DIR_PWM : !strcmp(name, "two_pwm") ? TWO_PWM : INA_INB_PWM;
}

// ---- the machine ---------------------------------------------------------------------------------------------------

static void be_quiet(avr_t *a, const int level, const char *format, va_list list) {
    (void)a;
    if (level <= LOG_ERROR) vfprintf(stderr, format, list);
}

static void connect(void) {
    uint32_t flags = 0;
    avr_ioctl(avr, AVR_IOCTL_UART_GET_FLAGS('0'), &flags);
    flags &= ~(uint32_t)(AVR_UART_FLAG_STDIO | AVR_UART_FLAG_POLL_SLEEP);
    avr_ioctl(avr, AVR_IOCTL_UART_SET_FLAGS('0'), &flags);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUTPUT), on_byte_out, NULL);
    twi_in = avr_io_getirq(avr, AVR_IOCTL_TWI_GETIRQ(0), TWI_IRQ_INPUT);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_TWI_GETIRQ(0), TWI_IRQ_OUTPUT), on_twi, NULL);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ('C'), 7), on_trigger, NULL);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ('B'), 7), on_busy, NULL);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_ADC_GETIRQ, ADC_IRQ_OUT_TRIGGER), on_adc, NULL);
}

static int estop;

static void hold_port_a(void) {
    hold('A', enable_diag << 4 | 1 << 6, !driver_fault << 4 | estop << 6);
    if (enable_diag) pin('A', 4, !driver_fault);
    pin('A', 6, estop);
}

static void press_estop(int pressed) {
    estop = pressed;
    hold_port_a();
}

static void fail_driver(int fault) {
    driver_fault = fault;
    hold_port_a();
}

static void surroundings(void) {
    estop = driver_fault = 0;
    hold_port_a();
    hold('E', 3 << 4, 0);
    hold('D', 3 << 2, 0);
    pin('L', 0, 0);
}

// A raw program, which starts at address 0.
static void read_program(const char *path) {
    FILE *file = fopen(path, "rb");
    const size_t size = file ? fread(avr->flash, 1, avr->flashend + 1, file) : 0;
    if (size == 0) {
        fprintf(stderr, "avr_board: cannot read %s\n", path);
        exit(2);
    }
    fclose(file);
    avr->codeend = (uint32_t)size;
}

static void load(const char *path) {
    avr = avr_make_mcu_by_name("atmega2560");
    avr_init(avr);
    avr->frequency = HZ;
    read_program(path);
    avr->vcc = avr->avcc = avr->aref = 5000;
    const int level[7] = {0, 0, 8192, -3920, 0, 0, 0};
    imu[WHO_AM_I] = IMU;
    imu_put(level);
    connect();
    surroundings();
}

// The boot loader lies at the end of the flash.
static void load_boot(const char *path) {
    uint32_t size = 0, start = 0;
    uint8_t *code = read_ihex_file(path, &size, &start);
    if (!code || start + size > avr->flashend + 1) {
        fprintf(stderr, "avr_board: cannot read %s\n", path);
        exit(2);
    }
    memcpy(avr->flash + start, code, size);
    free(code);
    avr->codeend = start + size;
    avr->reset_pc = avr->pc = start;
}

static void run_to(avr_cycle_count_t end) {
    while (avr->cycle < end) {
        send_due_byte();
        turn_due(0);
        turn_due(1);
        const int state = avr_run(avr);
        if (state == cpu_Done || state == cpu_Crashed) {
            fprintf(stderr, "avr_board: the program crashed at pc 0x%x\n", avr->pc);
            exit(3);
        }
    }
}

static void run_to_first_step(void) {
    const uint64_t before = steps;
    while (steps == before) run_to(avr->cycle + 1);
    run_to(avr->cycle + 3000 * PER_US);
}

// ---- lockstep ------------------------------------------------------------------------------------------------------

// The reset button: what the line held is gone, the surroundings stay.
static void restart(void) {
    in_head = in_tail;
    avr_reset(avr);
    surroundings();
    for (int wheel = 0; wheel < 2; ++wheel) show_lines(wheel);
    ++resets;
}

static void take_hex(const char *hex) {
    unsigned byte;
    for (; sscanf(hex, "%2x", &byte) == 1; hex += 2) queue_byte((uint8_t)byte);
}

static void answer_run(long us) {
    const avr_cycle_count_t start = avr->cycle;
    run_to(start + (avr_cycle_count_t)us * PER_US);
    printf("%d %d %d %llu %llu %llu ", duty(0), duty(1), drivers(), (unsigned long long)steps,
           (unsigned long long)longest_step, (unsigned long long)resets);
    for (size_t i = 0; i < out_count; ++i) printf("%02x", out[i]);
    printf("%s\n", out_count ? "" : "-");
    out_count = 0;
}

static void obey(char *line) {
    static char hex[2 * IN_ROOM + 2];
    long a, b;
    int raw[7];
    if (sscanf(line, "run %ld", &a) == 1) {
        answer_run(a);
        return;
    }
    if (sscanf(line, "tx %8190s", hex) == 1) take_hex(hex);
    else if (sscanf(line, "turn %ld %ld", &a, &b) == 2) turn(a & 1, b);
    else if (sscanf(line, "imu_answers %ld", &a) == 1) imu_answers = (int)a;
    else if (sscanf(line, "imu %d %d %d %d %d %d %d", raw, raw + 1, raw + 2, raw + 3, raw + 4, raw + 5, raw + 6) == 7) imu_put(raw);
    else if (sscanf(line, "battery %ld", &a) == 1) battery_mv = (int)a;
    else if (sscanf(line, "echo %ld", &a) == 1) echo_us = (int)a;
    else if (sscanf(line, "estop %ld", &a) == 1) press_estop(a != 0);
    else if (sscanf(line, "driver_fault %ld", &a) == 1) fail_driver(a != 0);
    else if (!strcmp(line, "reset\n")) restart();
    else {
        fprintf(stderr, "avr_board: unknown command: %s", line);
        exit(2);
    }
    puts("ok");
}

static void lockstep(void) {
    static char line[3 * IN_ROOM];
    while (fgets(line, sizeof line, stdin)) {
        obey(line);
        fflush(stdout);
    }
}

int main(int count, char **arguments) {
    if (count != 2 && count != 3) {
        fprintf(stderr, "usage: avr_board FIRMWARE.elf [BOOT_LOADER.hex]\n");
        return 2;
    }
    avr_global_logger_set(be_quiet);
    read_inputs();
    load(arguments[1]);
    if (count == 3) load_boot(arguments[2]);
    else run_to_first_step();
    lockstep();
    return 0;
}
