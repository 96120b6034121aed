#include "board.h"

namespace chefbot {

namespace {

const uint32_t COMMAND_STEPS = 20;  // a speed is good for 200 ms; it came after the step it is counted from
const uint8_t BRAKE_STEPS = 100;    // then the wheels may be pushed
const uint16_t REST_STEPS = 50;     // without a tick or duty: at rest
const uint8_t MOST_UNPOLLED = 2;    // steps without main loop before the hardware watchdog goes hungry

}  // namespace

void Board::start(const RobotConstants &robot, void *port, const char *name, bool after_watchdog) {
    robot_ = &robot;
    port_ = port;
    name_ = name;
    after_watchdog_ = after_watchdog;
    rest_steps_ = REST_STEPS;
    ramp_step_q6_ = ramp_step_q6(robot);
    wheels_[LEFT].start(robot);
    wheels_[RIGHT].start(robot);
    safety_.start(robot, hal_battery_mv(port));
    sonar_.start(robot.sonar_period);
    apply(0, 0);
    hal_drivers(port, false);
}

void Board::step() {
    ++step_;
    count_wheels();
    session_.watch(step_);
    watch();
    if (fresh_) {
        drive();
    } else {
        hold_still();
    }
    if (sonar_.step()) hal_ping(port_);
    take_snapshot();
    if (unpolled_ < MOST_UNPOLLED) {
        ++unpolled_;
        hal_feed_watchdog(port_);
    }
}

void Board::count_wheels() {
    const uint8_t before = hal_lock(port_);
    const uint32_t left = encoders_[LEFT].count(), right = encoders_[RIGHT].count();
    hal_unlock(port_, before);
    wheels_[LEFT].observe(static_cast<int32_t>(left - counted_[LEFT]));
    wheels_[RIGHT].observe(static_cast<int32_t>(right - counted_[RIGHT]));
    const bool still = left == counted_[LEFT] && right == counted_[RIGHT] && duty_[LEFT] == 0 && duty_[RIGHT] == 0;
    if (!still) rest_steps_ = 0;
    if (still && rest_steps_ < REST_STEPS) ++rest_steps_;
    counted_[LEFT] = left;
    counted_[RIGHT] = right;
}

void Board::watch() {
    if (!session_.is_open() || step_ - commanded_ >= COMMAND_STEPS) fresh_ = false;
    const SafetyInputs in = {hal_estop(port_),
                             hal_battery_mv(port_),
                             {duty_[LEFT], duty_[RIGHT]},
                             {wheels_[LEFT].speed(), wheels_[RIGHT].speed()}};
    safety_.update(in);
    if (safety_.at_once()) fresh_ = false;
    if (!safety_.latched()) return;
    target_.left = target_.right = 0;
    neutral_first_ = true;
}

void Board::drive() {
    ramp(target_, ramp_step_q6_, &set_q6_);
    brake_ = BRAKE_STEPS;
    hal_drivers(port_, true);
    const int16_t left = wheels_[LEFT].control(set_q6_.left);
    apply(left, wheels_[RIGHT].control(set_q6_.right));
}

void Board::hold_still() {
    target_.left = target_.right = 0;
    set_q6_ = target_;
    limited_ = false;
    wheels_[LEFT].release();
    wheels_[RIGHT].release();
    apply(0, 0);
    if (brake_ > 0 && --brake_ == 0) hal_drivers(port_, false);
}

void Board::apply(int16_t left, int16_t right) {
    duty_[LEFT] = left;
    duty_[RIGHT] = right;
    hal_motor(port_, LEFT, left);
    hal_motor(port_, RIGHT, right);
}

Flags Board::flags() const {
    Flags flags = static_cast<Flags>(safety_.flags() | sensors_);
    if (!session_.is_open()) flags |= NO_SESSION;
    if (!fresh_) flags |= NO_COMMAND;
    if (neutral_first_) flags |= NEUTRAL_FIRST;
    if (limited_) flags |= LIMITED;
    if (sonar_.bad()) flags |= SONAR_BAD;
    if (after_watchdog_) flags |= WATCHDOG_RESET;
    return flags;
}

State Board::state() const {
    if (safety_.latched()) return State::STOPPED;
    if (!session_.is_open()) return State::WAITING;
    return fresh_ ? State::DRIVING : State::READY;
}

void Board::take_snapshot() {
    now_.step = step_;
    for (uint8_t wheel = 0; wheel < 2; ++wheel) {
        now_.ticks[wheel] = counted_[wheel];
        now_.illegal[wheel] = encoders_[wheel].illegal();
        now_.duty[wheel] = duty_[wheel];
    }
    now_.set[LEFT] = set_q6_.left / 64;
    now_.set[RIGHT] = set_q6_.right / 64;
    now_.battery_mv = safety_.battery_mv();
    now_.obeyed = obeyed_;
    now_.flags = flags();
    now_.state = state();
    now_.resting = rest_steps_ == REST_STEPS;
}

}  // namespace chefbot
