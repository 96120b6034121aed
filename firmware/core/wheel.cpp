#include "wheel.h"

#include "fixed.h"

namespace chefbot {

namespace {

const int32_t FULL_Q8 = static_cast<int32_t>(DUTY_FULL) * 256;
const int32_t FULL_Q12 = FULL_Q8 * 16;
const int32_t MOST_TICKS = 3000;  // in one step; more is no wheel

}  // namespace

void Wheel::start(const RobotConstants &robot) {
    gain_q4_ = (FULL_Q8 * 16 + robot.no_load / 2) / robot.no_load;
    worst_q6_ = robot.no_load * 2 * 64;
    lag_steps_ = robot.lag * CONTROL_HZ / 1000;
    release();
}

void Wheel::observe(int32_t ticks) {
    const int16_t now = static_cast<int16_t>(clamp(ticks, MOST_TICKS));
    sum_ += now - ticks_[oldest_];
    ticks_[oldest_] = now;
    oldest_ = static_cast<uint8_t>(oldest_ + 1 == WINDOW ? 0 : oldest_ + 1);
}

// Proportional gain 1/no_load (full error = full duty), reset time 0.16 s, about the motor's lag (Astrom & Hagglund,
// PID Controllers, 1995, section 3.2); 0.16 s = 16 steps makes the integral a shift. Conditional integration against
// windup: while the output saturates the integral only moves back. While the set speed changes, the duty leads it by
// what the lag eats and the measured speed is expected half a window late; without both, the integral learns the
// acceleration and overshoots by a tenth.
int16_t Wheel::control(int32_t set_q6) {
    const int32_t change_q6 = set_q6 - set_q6_;
    if (set_q6 == 0 && sum_ == 0) {
        release();
        return 0;
    }
    set_q6_ = set_q6;
    const int32_t ahead_q6 = clamp(set_q6 + change_q6 * lag_steps_, worst_q6_);
    const int32_t expected_q6 = set_q6 - change_q6 * (WINDOW / 2);
    const int32_t error_q6 = clamp(expected_q6 - speed() * 64, worst_q6_);
    const int32_t push_q8 = shift_down(error_q6 * gain_q4_, 10);
    const int32_t wanted_q8 = shift_down(ahead_q6 * gain_q4_, 10) + push_q8 + shift_down(integral_, 4);
    if (magnitude(wanted_q8) < FULL_Q8 || (wanted_q8 < 0) != (push_q8 < 0)) {
        integral_ = clamp(integral_ + push_q8, FULL_Q12);
    }
    return static_cast<int16_t>(shift_down(clamp(wanted_q8, FULL_Q8) + 128, 8));
}

}  // namespace chefbot
