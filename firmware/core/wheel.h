// Speed control of one wheel, 100 times a second: feed-forward from the motor's data, PI on the encoder.
#pragma once

#include <stdint.h>

#include "robot.h"

namespace chefbot {

class Wheel {
  public:
    void start(const RobotConstants &robot);

    // Call once per step, controlled or not: ticks since the step before.
    void observe(int32_t ticks);
    // Duty for `set` (ticks/s).
    int16_t control(int16_t set);
    // Reset the integral; the ramp starts from rest.
    void release() { integral_q12_ = set_ = 0; }

    // ticks/s over the last WINDOW steps; 0 only if the ticks cancel out.
    int16_t speed() const { return static_cast<int16_t>(sum_ * (CONTROL_HZ / WINDOW)); }

  private:
    static const uint8_t WINDOW = 5;

    int32_t integral_q12_ = 0;     // of duty
    int16_t gain_q12_ = 0;         // duty per ticks/s
    int16_t lag_steps_ = 0;
    int16_t set_ = 0;              // of the step before
    int16_t sum_ = 0;              // ticks in the window
    int16_t ticks_[WINDOW] = {0};
    uint8_t oldest_ = 0;
};

}  // namespace chefbot
