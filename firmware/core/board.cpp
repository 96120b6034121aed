#include "board.h"

namespace chefbot {

namespace {

const uint8_t COMMAND_STEPS = 15;  // a speed is valid for 150 ms; it arrived after the step from which this is counted
const uint8_t BRAKE_STEPS = 100;    // then the wheels turn freely, unless they are to hold
const uint8_t REST_STEPS = 50;     // without a tick or duty: at rest
const uint8_t MOST_UNPOLLED = 2;    // steps without main loop before the hardware watchdog is no longer fed

}  // namespace

void Board::start(const RobotConstants &robot, void *port, const char *name, bool after_watchdog) {
    robot_ = &robot;
    port_ = port;
    name_ = name;
    after_watchdog_ = after_watchdog;
    neutral_first_ = true;
    rest_steps_ = REST_STEPS;
    inertia_age_ = 1;  // so that `i` falls between two `e`
    ramp_.start(robot);
    wheels_[LEFT].start(robot);
    wheels_[RIGHT].start(robot);
    safety_.start(robot);
    hal_battery_mv(port);  // begins the first conversion
    sonar_.start(robot.sonar_period);
    cliff_inputs_ = static_cast<uint8_t>((1 << robot.cliff_sensors) - 1);
    apply(0, 0);
    hal_drivers(port, false);
}

void Board::step() {
    ++now_.step;
    if (rest_steps_ < REST_STEPS) ++rest_steps_;
    count_wheel(LEFT);
    count_wheel(RIGHT);
    session_.watch();
    watch();
    if (fresh_) {
        drive();
    } else {
        hold_still();
    }
    if (sonar_.step()) hal_ping(port_);
    finish_snapshot();
    if (unpolled_ < MOST_UNPOLLED) {
        ++unpolled_;
        hal_feed_watchdog(port_);
    }
}

void Board::count_wheel(uint8_t wheel) {
    const uint8_t before = hal_lock(port_);
    const uint32_t count = encoders_[wheel].count();
    now_.illegal[wheel] = encoders_[wheel].illegal();
    hal_unlock(port_, before);
    const int32_t moved = static_cast<int32_t>(count - now_.ticks[wheel]);
    now_.ticks[wheel] = count;
    wheels_[wheel].observe(moved);
    if (moved != 0 || now_.duty[wheel] != 0) rest_steps_ = 0;
}

void Board::watch() {
    if (command_age_ < COMMAND_STEPS) ++command_age_;
    if (!session_.is_open() || command_age_ == COMMAND_STEPS) fresh_ = false;
    const SafetyInputs in = {hal_estop(port_),
                             hal_driver_fault(port_),
                             hal_battery_mv(port_),
                             {now_.duty[LEFT], now_.duty[RIGHT]},
                             {wheels_[LEFT].speed(), wheels_[RIGHT].speed()}};
    safety_.update(in);
    const uint8_t cliffs = hal_cliffs(port_) & cliff_inputs_;
    // Stops at once, without the ramp; the computer knows which direction is safe.
    if (safety_.at_once() || (cliffs & ~now_.cliffs)) fresh_ = false;
    now_.cliffs = cliffs;
    if (safety_.latched()) target_.left = target_.right = 0;
}

void Board::drive() {
    ramp_.step(target_);
    brake_ = BRAKE_STEPS;
    hal_drivers(port_, true);
    const Pair set = ramp_.set();
    const int16_t left = wheels_[LEFT].control(set.left);
    apply(left, wheels_[RIGHT].control(set.right));
}

void Board::hold_still() {
    ramp_.stop();
    limited_ = false;
    wheels_[LEFT].release();
    wheels_[RIGHT].release();
    apply(0, 0);
    const bool lets_go = !static_cast<uint8_t>(robot_->hold);
    if (lets_go && brake_ > 0 && --brake_ == 0) hal_drivers(port_, false);
    if (safety_.driver_fault()) hal_drivers(port_, false);  // at once, which also takes the fault back
}

void Board::apply(int16_t left, int16_t right) {
    now_.duty[LEFT] = left;
    now_.duty[RIGHT] = right;
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

void Board::finish_snapshot() {
    now_.set = ramp_.set();
    now_.battery_mv = safety_.battery_mv();
    now_.flags = flags();
    now_.state = state();
    now_.resting = rest_steps_ == REST_STEPS;
}

}  // namespace chefbot
