// Lines to the computer, each at its fixed rate; docs/protocol.md names the fields.
#include "board.h"

namespace chefbot {

namespace {

// Steps between two lines, and the phase of each in its period, so that the lines are spread over time.
const uint8_t MOTION_PERIOD = 2;  // of cliffs as well, in the steps between
const uint8_t STATUS_PERIOD = 10, STATUS_PHASE = 3;
const uint8_t BATTERY_PERIOD = 50, BATTERY_PHASE = 5;
const uint8_t ROUND = 100, TIME_PHASE = 7;  // all of the above divide it

const uint8_t HAS_IMU = 1, HAS_SONAR = 2, HAS_CLIFFS = 4;

}  // namespace

void Board::poll() {
    const uint8_t before = hal_lock(port_);
    unpolled_ = 0;
    const Snapshot at = now_;
    hal_unlock(port_, before);
    if (at.step == told_) return;
    missed_ = static_cast<uint16_t>(missed_ + (at.step - told_ - 1));
    told_ = at.step;
    imu_.rest(at.resting);
    imu_.step(port_);
    const Flags sensors = imu_.good() ? 0 : IMU_BAD;
    const uint8_t again = hal_lock(port_);
    sensors_ = sensors;
    hal_unlock(port_, again);
    tell_due(at);
}

void Board::tell_due(const Snapshot &at) {
    const uint8_t beat = static_cast<uint8_t>(at.step % ROUND);
    if (beat % MOTION_PERIOD == 0) {
        tell_motion(at);
    } else if (cliff_inputs_) {
        tell_cliffs(at);
    }
    if (++inertia_age_ >= robot_->imu_period) tell_inertia(at);
    if (beat % STATUS_PERIOD == STATUS_PHASE) tell_status(at);
    if (beat % BATTERY_PERIOD == BATTERY_PHASE) tell_battery(at);
    if (beat == TIME_PHASE) tell_time(at);
    const uint8_t before = hal_lock(port_);
    const bool echo = sonar_.take_result();
    hal_unlock(port_, before);
    if (echo) tell_echo(at);
}

Line Board::begin(char letter, const Snapshot &at) {
    Line line(letter, line_);
    line.count(at.step * static_cast<uint32_t>(STEP_US));
    return line;
}

void Board::send(Line *line) {
    line->finish();
    ++line_;
    if (!hal_send(port_, line->text(), line->length())) ++dropped_;
}

void Board::tell_motion(const Snapshot &at) {
    Line line = begin('e', at);
    line.number(static_cast<int32_t>(at.ticks[LEFT])).number(static_cast<int32_t>(at.ticks[RIGHT]));
    line.number(static_cast<int32_t>(imu_.angle())).count(imu_.samples()).hex(at.flags, 4);
    send(&line);
}

void Board::tell_inertia(const Snapshot &at) {
    inertia_age_ = 0;
    if (!imu_.good()) return;
    Line line = begin('i', at);
    for (uint8_t axis = 0; axis < 3; ++axis) line.number(imu_.rate(axis));
    for (uint8_t axis = 0; axis < 3; ++axis) line.number(imu_.acceleration(axis));
    line.number(imu_.temperature()).number(imu_.bias());
    send(&line);
}

void Board::tell_status(const Snapshot &at) {
    Line line = begin('s', at);
    line.count(static_cast<uint8_t>(at.state)).hex(at.flags, 4).count(at.obeyed);
    line.number(at.set.left).number(at.set.right).number(at.duty[LEFT]).number(at.duty[RIGHT]);
    line.count(refused_).count(static_cast<uint8_t>(refusal_)).count(at.illegal[LEFT]).count(at.illegal[RIGHT]);
    send(&line);
}

void Board::tell_echo(const Snapshot &at) {
    Line line = begin('u', at);
    line.number(sonar_.echo_us());
    send(&line);
}

void Board::tell_cliffs(const Snapshot &at) {
    Line line = begin('d', at);
    line.hex(at.cliffs, 2);
    send(&line);
}

void Board::tell_battery(const Snapshot &at) {
    Line line = begin('b', at);
    line.count(at.battery_mv);
    send(&line);
}

void Board::tell_time(const Snapshot &at) {
    Line line = begin('t', at);
    line.count(at.step / CONTROL_HZ).count(dropped_).count(missed_).hex(imu_.id(), 2);
    send(&line);
}

void Board::tell_version(int32_t token) {
    Line line('v', line_);
    line.number(token).word("chefbot").number(PROTOCOL).word(name_).hex(static_cast<uint32_t>(robot_->hash), 8);
    line.number(robot_->ticks_per_turn_milli).number(CONTROL_HZ).number(DUTY_FULL);
    for (const int32_t *limit = &robot_->max_wheel; limit <= &robot_->acceleration; ++limit) line.number(*limit);
    const uint8_t sonar = robot_->sonar_period > 0 ? HAS_SONAR : 0, cliffs = cliff_inputs_ ? HAS_CLIFFS : 0;
    line.count(session_.last()).hex(static_cast<uint8_t>(HAS_IMU | sonar | cliffs), 2);
    send(&line);
}

}  // namespace chefbot
