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

WheelWatch::Fault WheelWatch::update(int16_t duty, int16_t speed, int16_t no_load) {
    const uint16_t effort = magnitude(duty), pace = magnitude(speed);
    const bool slow = pace < static_cast<uint16_t>(no_load / SLOW_PART);
    const bool against = (duty < 0) != (speed < 0) && !slow;
    // A wheel that brakes counts against its motor, too, but slows down; with exchanged wires it gets faster.
    if (!against) pace_before_ = pace;
    const bool reversed = lasts(effort >= ENCODER_DUTY && pace > pace_before_, REVERSE_STEPS, &reversed_);
    const bool silent = lasts(effort >= ENCODER_DUTY && pace == 0, SILENT_STEPS, &silent_);
    const bool stalled = lasts(effort >= STALL_DUTY && slow, STALL_STEPS, &stalled_);
    return reversed || silent ? ENCODER : stalled ? STALL : NONE;
}

void BatteryWatch::start(const RobotConstants &robot) {
    mv_ = 0;
    stop_ = static_cast<uint16_t>(robot.battery_stop);
    low_ = static_cast<uint16_t>(robot.battery_low);
    charged_ = static_cast<uint16_t>(low_ + (low_ - stop_) / 2);
}

void BatteryWatch::update(uint16_t mv, Flags *flags) {
    // Until the first conversion has finished the reading is 0, and the filter begins with the one after it.
    if (!mv_) {
        mv_ = mv;
        filtered_q6_ = static_cast<uint32_t>(mv) << 6;
    }
    filtered_q6_ += mv;
    filtered_q6_ -= mv_;
    mv_ = static_cast<uint16_t>(filtered_q6_ >> 6);
    if (lasts(mv_ < stop_, EMPTY_STEPS, &empty_)) *flags |= BATTERY_EMPTY;
    if (mv_ < low_) *flags |= BATTERY_LOW;
    if (recovered()) *flags &= static_cast<Flags>(~BATTERY_LOW);
}

void Safety::start(const RobotConstants &robot) {
    no_load_ = static_cast<int16_t>(robot.no_load);
    battery_.start(robot);
    flags_ = 0;
}

void Safety::update(const SafetyInputs &in) {
    pressed_ = in.estop;
    if (pressed_) flags_ |= ESTOP_INPUT;
    const bool low = in.driver_fault;
    if (low & driver_low_) flags_ |= DRIVER_FAULT;  // a spike is shorter than a step
    driver_low_ = low;
    battery_.update(in.battery_mv, &flags_);
    watch_wheel(LEFT, in);
    watch_wheel(RIGHT, in);
}

void Safety::watch_wheel(uint8_t wheel, const SafetyInputs &in) {
    const WheelWatch::Fault fault = wheels_[wheel].update(in.duty[wheel], in.speed[wheel], no_load_);
    if (fault == WheelWatch::STALL) flags_ |= wheel == LEFT ? STALL_LEFT : STALL_RIGHT;
    if (fault == WheelWatch::ENCODER) flags_ |= wheel == LEFT ? ENCODER_LEFT : ENCODER_RIGHT;
}

bool Safety::clear() {
    Flags stays = BATTERY_LOW;
    if (pressed_) stays |= ESTOP_INPUT;
    if (!battery_.recovered()) stays |= BATTERY_EMPTY;
    flags_ &= stays;
    return !latched();
}

}  // namespace chefbot
