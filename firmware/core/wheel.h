// Speed control of one wheel, 100 times a second: feed-forward from the motor's no-load speed, PI on the encoder.
#pragma once

#include <stdint.h>

#include "robot.h"

namespace chefbot {

class Wheel {
  public:
    void start(const RobotConstants &robot);

    // Call once per step, controlled or not: ticks since the step before.
    void observe(int32_t ticks);
    // Duty for `set_q6` (1/64 ticks/s).
    int16_t control(int32_t set_q6);
    // Forget what the integral learnt; the ramp starts from rest.
    void release() { integral_ = set_q6_ = 0; }

    // ticks/s over the last WINDOW steps; 0 only if the ticks cancel out.
    int32_t speed() const { return sum_ * (CONTROL_HZ / WINDOW); }

  private:
    static const uint8_t WINDOW = 5;

    int32_t gain_q4_ = 0;   // duty_q8 per ticks/s
    int32_t worst_q6_ = 0;  // a larger error saturates anyway, and its product would not
    int32_t integral_ = 0;  // duty in 1/4096 per mille
    int32_t lag_steps_ = 0;
    int32_t set_q6_ = 0;    // of the step before
    int32_t sum_ = 0;       // ticks in the window
    int16_t ticks_[WINDOW] = {0};
    uint8_t oldest_ = 0;
};

}  // namespace chefbot
