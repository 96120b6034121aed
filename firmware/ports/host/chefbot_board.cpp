// The board on a computer: the HAL of core/hal.h over plain memory.
#include "chefbot_board.h"

#include <stdlib.h>
#include <string.h>

#include <deque>
#include <new>

#include "board.h"

using chefbot::Board;
using chefbot::RobotConstants;

namespace {

const size_t LINE_IN = 4096, LINE_OUT = 65536;
const uint64_t ECHO_DELAY_US = 460;  // ping to rise, HC-SR04
const uint64_t ECHO_HELD_US = 38000;  // how long the line stays high without an echo
const uint64_t NEVER = UINT64_MAX;
const int WATCHDOG_STEPS = 3;  // 30 ms since the last feed
const uint8_t IMU_ADDRESS = 0x68, IMU_WHO = 0x75, IMU_POWER = 0x6B, IMU_DATA = 0x3B;

}  // namespace

struct chefbot_board {
    RobotConstants robot;
    Board core;
    uint64_t time_us = 0;
    uint64_t boot_us = 0;

    std::deque<uint8_t> in, out;
    int32_t duty[2] = {0, 0};
    bool drivers = false;
    bool restart = false;
    bool hangs = false;
    bool restarted_driving = false;
    uint8_t locked = 0;  // interrupts are off
    int hungry_steps = 0;
    uint32_t restarts = 0;

    uint8_t lines[2] = {0, 0};
    bool estop = false;
    bool driver_fault = false;
    uint8_t cliffs = 0;
    uint16_t battery_mv = 12000;
    int32_t echo_us = CHEFBOT_NO_ECHO;
    uint64_t echo_rise = NEVER, echo_fall = NEVER;
    bool imu_answers = true, imu_holds_bus = false;
    uint8_t imu[128];

    void power_on(bool after_watchdog);
    void run_until(uint64_t end_us);
    void main_loop();
    void step();
    void play_echo();
};

// ---- the HAL -------------------------------------------------------------------------------------------------------

namespace chefbot {

static chefbot_board &of(void *port) { return *static_cast<chefbot_board *>(port); }

uint8_t hal_lock(void *port) {
    const uint8_t before = of(port).locked;
    of(port).locked = 1;
    return before;
}
void hal_unlock(void *port, uint8_t before) { of(port).locked = before; }

void hal_motor(void *port, uint8_t wheel, int16_t duty) { of(port).duty[wheel] = duty; }
void hal_drivers(void *port, bool on) { of(port).drivers = on; }
bool hal_driver_fault(void *port) {
    const chefbot_board &board = of(port);
    return board.robot.enable_diag && board.drivers && board.driver_fault;
}
bool hal_estop(void *port) { return of(port).estop; }
uint8_t hal_cliffs(void *port) { return of(port).cliffs; }
uint16_t hal_battery_mv(void *port) { return of(port).battery_mv; }

void hal_ping(void *port) {
    chefbot_board &board = of(port);
    if (board.echo_us == CHEFBOT_NO_SENSOR) return;
    const uint64_t width = board.echo_us == CHEFBOT_NO_ECHO ? ECHO_HELD_US : static_cast<uint64_t>(board.echo_us);
    board.echo_rise = board.time_us + ECHO_DELAY_US;
    board.echo_fall = board.echo_rise + width;
}

bool hal_i2c_write(void *port, uint8_t address, uint8_t reg, uint8_t value) {
    chefbot_board &board = of(port);
    if (address != IMU_ADDRESS || !board.imu_answers || board.imu_holds_bus) return false;
    const bool reset = reg == IMU_POWER && (value & 0x80);
    board.imu[reg & 127] = reset ? 0x40 : value;
    return true;
}

bool hal_i2c_read(void *port, uint8_t address, uint8_t reg, uint8_t *bytes, uint8_t count) {
    const chefbot_board &board = of(port);
    if (address != IMU_ADDRESS || !board.imu_answers || board.imu_holds_bus) return false;
    for (uint8_t i = 0; i < count; ++i) bytes[i] = board.imu[(reg + i) & 127];
    return true;
}

void hal_i2c_clear(void *port) { of(port).imu_holds_bus = false; }

bool hal_send(void *port, const char *bytes, uint8_t count) {
    chefbot_board &board = of(port);
    if (board.out.size() + count > LINE_OUT) return false;
    board.out.insert(board.out.end(), bytes, bytes + count);
    return true;
}

void hal_feed_watchdog(void *port) { of(port).hungry_steps = 0; }

void hal_restart(void *port) {
    chefbot_board &board = of(port);
    board.restart = true;
    board.restarted_driving |= board.drivers || board.duty[LEFT] != 0 || board.duty[RIGHT] != 0;
}

}  // namespace chefbot

// ---- time ----------------------------------------------------------------------------------------------------------

void chefbot_board::power_on(bool after_watchdog) {
    core = Board();
    boot_us = time_us;
    in.clear();
    restart = hangs = false;
    locked = 0;
    hungry_steps = 0;
    drivers = true;  // whatever the pins did before
    duty[0] = duty[1] = chefbot::DUTY_FULL;
    echo_rise = echo_fall = NEVER;
    core.start(robot, this, "host", after_watchdog);
    core.encoder_start(chefbot::LEFT, lines[0]);
    core.encoder_start(chefbot::RIGHT, lines[1]);
}

void chefbot_board::play_echo() {
    if (echo_rise <= time_us) {
        core.echo_edge(true, static_cast<uint16_t>(echo_rise));
        echo_rise = NEVER;
    }
    if (echo_fall <= time_us) {
        core.echo_edge(false, static_cast<uint16_t>(echo_fall));
        echo_fall = NEVER;
    }
}

void chefbot_board::main_loop() {
    if (hangs) return;
    while (!in.empty() && !restart) {
        core.receive(in.front());
        in.pop_front();
    }
    core.poll();
    if (!restart) return;
    ++restarts;
    power_on(false);
}

void chefbot_board::step() {
    play_echo();
    if (!locked) core.step();
    if (++hungry_steps <= WATCHDOG_STEPS) return;
    ++restarts;
    power_on(true);
}

void chefbot_board::run_until(uint64_t end_us) {
    const uint64_t period = chefbot::STEP_US;
    main_loop();
    for (;;) {
        const uint64_t next = boot_us + ((time_us - boot_us) / period + 1) * period;
        if (next > end_us) break;
        time_us = next;
        step();
        main_loop();
    }
    time_us = end_us;
}

// ---- the C interface -----------------------------------------------------------------------------------------------

extern "C" {

chefbot_board *chefbot_board_create(const int32_t *constants, uint32_t count) {
    if (count != chefbot::ROBOT_CONSTANTS) return nullptr;
    chefbot_board *board = new (std::nothrow) chefbot_board();
    if (!board) return nullptr;
    memcpy(&board->robot, constants, sizeof board->robot);
    if (!chefbot::plausible(board->robot)) {
        delete board;
        return nullptr;
    }
    memset(board->imu, 0, sizeof board->imu);
    board->imu[IMU_WHO] = IMU_ADDRESS;
    const int16_t level[7] = {0, 0, chefbot::Imu::LSB_PER_G, -3920, 0, 0, 0};
    chefbot_board_imu(board, level);
    board->power_on(false);
    return board;
}

void chefbot_board_destroy(chefbot_board *board) { delete board; }

void chefbot_board_power_cycle(chefbot_board *board) { board->power_on(false); }

uint32_t chefbot_board_write(chefbot_board *board, const uint8_t *bytes, uint32_t count) {
    uint32_t taken = 0;
    while (taken < count && board->in.size() < LINE_IN) board->in.push_back(bytes[taken++]);
    return taken;
}

uint32_t chefbot_board_read(chefbot_board *board, uint8_t *bytes, uint32_t room) {
    uint32_t taken = 0;
    while (taken < room && !board->out.empty()) {
        bytes[taken++] = board->out.front();
        board->out.pop_front();
    }
    return taken;
}

void chefbot_board_turn(chefbot_board *board, int32_t wheel, int32_t quarter_steps) {
    static const uint8_t FORWARD[4] = {2, 0, 3, 1};   // next lines after 00 01 10 11
    static const uint8_t BACKWARD[4] = {1, 3, 0, 2};
    const uint8_t *next = quarter_steps < 0 ? BACKWARD : FORWARD;
    for (int32_t n = labs(quarter_steps); n > 0; --n) {
        chefbot_board_encoder_lines(board, wheel, next[board->lines[wheel & 1]]);
    }
}

void chefbot_board_encoder_lines(chefbot_board *board, int32_t wheel, int32_t lines) {
    board->lines[wheel & 1] = lines & 3;
    board->core.encoder_edge(wheel & 1, lines & 3);
}

void chefbot_board_imu(chefbot_board *board, const int16_t raw[7]) {
    for (int i = 0; i < 7; ++i) {
        board->imu[IMU_DATA + 2 * i] = static_cast<uint8_t>(static_cast<uint16_t>(raw[i]) >> 8);
        board->imu[IMU_DATA + 2 * i + 1] = static_cast<uint8_t>(raw[i] & 255);
    }
}

double chefbot_board_lsb_per_g(void) { return chefbot::Imu::LSB_PER_G; }
double chefbot_board_lsb_per_degree(void) { return chefbot::Imu::LSB_PER_10_DEGREES / 10.0; }

void chefbot_board_imu_answers(chefbot_board *board, int32_t answers) { board->imu_answers = answers != 0; }

void chefbot_board_imu_id(chefbot_board *board, int32_t id) { board->imu[IMU_WHO] = static_cast<uint8_t>(id); }

void chefbot_board_imu_holds_bus(chefbot_board *board) { board->imu_holds_bus = true; }

void chefbot_board_battery(chefbot_board *board, int32_t millivolts) {
    board->battery_mv = static_cast<uint16_t>(millivolts < 0 ? 0 : millivolts > 65535 ? 65535 : millivolts);
}

void chefbot_board_echo(chefbot_board *board, int32_t us) { board->echo_us = us < 0 ? CHEFBOT_NO_SENSOR : us; }

void chefbot_board_cliffs(chefbot_board *board, int32_t bits) { board->cliffs = static_cast<uint8_t>(bits); }

void chefbot_board_estop(chefbot_board *board, int32_t pressed) { board->estop = pressed != 0; }

void chefbot_board_driver_fault(chefbot_board *board, int32_t fault) { board->driver_fault = fault != 0; }

void chefbot_board_hang(chefbot_board *board) { board->hangs = true; }

int32_t chefbot_board_restarted_driving(const chefbot_board *board) { return board->restarted_driving; }

void chefbot_board_advance(chefbot_board *board, uint32_t us) { board->run_until(board->time_us + us); }

void chefbot_board_get(const chefbot_board *board, chefbot_board_state *state) {
    const chefbot::Snapshot &at = board->core.snapshot();
    state->time_us = board->time_us;
    state->drivers = board->drivers;
    state->state = static_cast<int32_t>(at.state);
    state->flags = at.flags;
    state->refused = board->core.refused();
    state->refusal = static_cast<int32_t>(board->core.refusal());
    state->restarts = board->restarts;
    state->set[CHEFBOT_LEFT] = at.set.left;
    state->set[CHEFBOT_RIGHT] = at.set.right;
    for (int wheel = 0; wheel < 2; ++wheel) {
        state->duty[wheel] = board->duty[wheel];
        state->ticks[wheel] = at.ticks[wheel];
        state->illegal[wheel] = at.illegal[wheel];
    }
}

}  // extern "C"
