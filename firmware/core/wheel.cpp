#include "wheel.h"

#include "fixed.h"

namespace chefbot {

namespace {

const int32_t FULL_Q12 = static_cast<int32_t>(DUTY_FULL) * 4096;
const int16_t MOST_TICKS = SPEED_BOUND / CONTROL_HZ;  // in one step; more is impossible

}  // namespace

void Wheel::start(const RobotConstants &robot) {
    gain_q12_ = static_cast<int16_t>((FULL_Q12 + robot.no_load / 2) / robot.no_load);
    lag_steps_ = static_cast<int16_t>(robot.lag * CONTROL_HZ / 1000);
}

void Wheel::observe(int32_t ticks) {
    const int16_t now = static_cast<int16_t>(clamp(ticks, MOST_TICKS));
    sum_ = static_cast<int16_t>(sum_ + now - ticks_[oldest_]);
    ticks_[oldest_] = now;
    oldest_ = static_cast<uint8_t>(oldest_ + 1 == WINDOW ? 0 : oldest_ + 1);
}

// Proportional gain 1/no_load (full error = full duty), reset time 0.16 s, about the motor's lag (Astrom & Hagglund,
// PID Controllers, 1995, section 3.2); 0.16 s = 16 steps makes the integral a shift. Conditional integration against
// windup: while the output saturates the integral only moves back. While the set speed changes, the duty leads it to
// compensate for the lag, and the measured speed is expected half a window late; without both, the integral winds up
// during the acceleration and overshoots by 10 %.
int16_t Wheel::control(int16_t set) {
    const int32_t change = static_cast<int32_t>(set) - set_;
    if (set == 0 && sum_ == 0) {
        release();
        return 0;
    }
    set_ = set;
    const int16_t error = clip(set - change * (WINDOW / 2) - speed());
    const int16_t push = clip(set + change * lag_steps_ + error);
    const int32_t wanted_q12 = static_cast<int32_t>(push) * gain_q12_ + integral_q12_;
    const int32_t given_q12 = clamp(wanted_q12, FULL_Q12);
    if (given_q12 == wanted_q12 || (wanted_q12 < 0) != (error < 0)) {
        integral_q12_ = clamp(integral_q12_ + shift_down(static_cast<int32_t>(error) * gain_q12_, 4), FULL_Q12);
    }
    return static_cast<int16_t>(shift_down(given_q12 + 2048, 12));
}

}  // namespace chefbot
