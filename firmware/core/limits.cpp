#include "limits.h"

namespace chefbot {

namespace {

const int32_t ABSURD = 65535;  // ticks/s; times SPEED_BOUND still 32 bits

// Shrinks the pair by `most / value` if |value| exceeds it.
bool shrink(int32_t value, int32_t most, Pair *speed) {
    value = magnitude(value);
    if (value <= most) return false;
    speed->left = speed->left * most / value;
    speed->right = speed->right * most / value;
    return true;
}

// `change` of the one wheel when the faster-changing one has `most` to go (both ticks/s, |change| <= most > 0).
int32_t share_q6(int32_t change, int32_t most, int32_t step_q6) {
    const uint32_t part = static_cast<uint32_t>(magnitude(change)) * static_cast<uint32_t>(step_q6);
    const int32_t share = static_cast<int32_t>(part / static_cast<uint32_t>(most));
    return change < 0 ? -share : share;
}

}  // namespace

bool limit_speed(const RobotConstants &robot, Pair *speed) {
    const Pair asked = *speed;
    speed->left = clamp(asked.left, ABSURD);
    speed->right = clamp(asked.right, ABSURD);
    shrink(speed->left, robot.max_wheel, speed);
    shrink(speed->right, robot.max_wheel, speed);
    shrink((speed->left + speed->right) / 2, robot.max_forward, speed);
    shrink(speed->right - speed->left, robot.max_turn, speed);
    return speed->left != asked.left || speed->right != asked.right;
}

int32_t ramp_step_q6(const RobotConstants &robot) { return robot.acceleration * 64 / CONTROL_HZ; }

void ramp(Pair target, int32_t step_q6, Pair *set_q6) {
    const int32_t left = target.left * 64 - set_q6->left, right = target.right * 64 - set_q6->right;
    const int32_t most_q6 = magnitude(left) > magnitude(right) ? magnitude(left) : magnitude(right);
    if (most_q6 <= step_q6) {
        set_q6->left = target.left * 64;
        set_q6->right = target.right * 64;
        return;
    }
    const int32_t most = most_q6 / 64 + 1;  // rounded up: never a larger step than allowed
    set_q6->left += share_q6(left / 64, most, step_q6);
    set_q6->right += share_q6(right / 64, most, step_q6);
}

}  // namespace chefbot
