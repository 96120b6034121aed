// Speed and acceleration limits of both wheels together: what is limited keeps its curvature.
#pragma once

#include "fixed.h"
#include "robot.h"

namespace chefbot {

// Scales `speed` (ticks/s) down to what the robot may; true if it had to.
bool limit_speed(const RobotConstants &robot, Pair *speed);

// ticks/s in 1/64 that the faster-changing wheel may change in one control step.
int32_t ramp_step_q6(const RobotConstants &robot);

// Moves `set_q6` (1/64 ticks/s) towards `target` (ticks/s) by one step, both wheels in proportion.
void ramp(Pair target, int32_t step_q6, Pair *set_q6);

}  // namespace chefbot
