// Speed and acceleration limits of both wheels together, which keep the curvature.
#pragma once

#include "fixed.h"
#include "robot.h"

namespace chefbot {

// Scale left, right (ticks/s, any number) down to the robot's limits. True if that reduces one by more than 1 tick/s.
bool limit_speed(const RobotConstants &robot, int32_t left, int32_t right, Pair *speed);

// The set speed on its way to the target.
class Ramp {
  public:
    void start(const RobotConstants &robot) { robot_ = &robot; }
    // One control step towards `target`: the wheel with more to go takes a full step, the other in proportion.
    void step(Pair target);
    void stop() { left_q16_ = right_q16_ = 0; }
    Pair set() const;

  private:
    const RobotConstants *robot_ = nullptr;
    int32_t left_q16_ = 0, right_q16_ = 0;
};

}  // namespace chefbot
