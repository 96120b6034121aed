#include "safety.h"

#include "fixed.h"

namespace chefbot {

namespace {

// True when `holds` has been true `steps` times running; counts in `counter`.
bool lasts(bool holds, uint8_t steps, uint8_t *counter) {
    if (!holds) {
        *counter = 0;
        return false;
    }
    if (*counter < steps) ++*counter;
    return *counter == steps;
}

}  // namespace

WheelWatch::Fault WheelWatch::update(int16_t duty, int32_t speed, int32_t no_load) {
    const int32_t effort = magnitude(duty), pace = magnitude(speed);
    const bool slow = pace < no_load / SLOW_PART;
    const bool against = (duty < 0) != (speed < 0) && !slow;
    const bool reversed = lasts(effort >= ENCODER_DUTY && against, REVERSE_STEPS, &reversed_);
    const bool silent = lasts(effort >= ENCODER_DUTY && pace == 0, SILENT_STEPS, &silent_);
    const bool stalled = lasts(effort >= STALL_DUTY && slow, STALL_STEPS, &stalled_);
    return reversed || silent ? ENCODER : stalled ? STALL : NONE;
}

void BatteryWatch::update(uint16_t mv, const RobotConstants &robot, Flags *flags) {
    filtered_ += mv - filtered_ / 64;
    if (lasts(this->mv() < robot.battery_stop, EMPTY_STEPS, &empty_)) *flags |= BATTERY_EMPTY;
    if (this->mv() < robot.battery_low) *flags |= BATTERY_LOW;
    if (recovered(robot)) *flags &= static_cast<Flags>(~BATTERY_LOW);
}

bool BatteryWatch::recovered(const RobotConstants &robot) const {
    return mv() >= robot.battery_low + (robot.battery_low - robot.battery_stop) / 2;
}

void Safety::start(const RobotConstants &robot, uint16_t battery_mv) {
    robot_ = &robot;
    battery_.start(battery_mv);
    flags_ = 0;
}

void Safety::update(const SafetyInputs &in) {
    pressed_ = in.estop;
    if (pressed_) flags_ |= ESTOP_INPUT;
    battery_.update(in.battery_mv, *robot_, &flags_);
    watch_wheel(LEFT, in);
    watch_wheel(RIGHT, in);
}

void Safety::watch_wheel(uint8_t wheel, const SafetyInputs &in) {
    const WheelWatch::Fault fault = wheels_[wheel].update(in.duty[wheel], in.speed[wheel], robot_->no_load);
    if (fault == WheelWatch::STALL) flags_ |= wheel == LEFT ? STALL_LEFT : STALL_RIGHT;
    if (fault == WheelWatch::ENCODER) flags_ |= wheel == LEFT ? ENCODER_LEFT : ENCODER_RIGHT;
}

bool Safety::clear() {
    Flags stays = BATTERY_LOW;
    if (pressed_) stays |= ESTOP_INPUT;
    if (!battery_.recovered(*robot_)) stays |= BATTERY_EMPTY;
    flags_ &= stays;
    return !latched();
}

}  // namespace chefbot
