#include "limits.h"

namespace chefbot {

namespace {

const uint32_t STEP_Q22 = (1UL << 22) / CONTROL_HZ;  // control period, s

CHEFBOT_OUT_OF_LINE int16_t scaled(int16_t speed, uint16_t most, uint16_t value) {
    const uint32_t size = static_cast<uint32_t>(magnitude(speed)) * most / value;
    return static_cast<int16_t>(speed < 0 ? -static_cast<int32_t>(size) : static_cast<int32_t>(size));
}

// Shrinks the pair by most / value where value is larger.
void shrink(uint16_t value, int32_t limit, Pair *speed) {
    const uint16_t most = static_cast<uint16_t>(limit);
    if (value <= most) return;
    speed->left = scaled(speed->left, most, value);
    speed->right = scaled(speed->right, most, value);
}

// |b - a| needs 16 bits and no sign.
CHEFBOT_OUT_OF_LINE uint16_t distance(int16_t a, int16_t b) {
    return static_cast<uint16_t>(a < b ? static_cast<uint16_t>(b) - static_cast<uint16_t>(a)
                                       : static_cast<uint16_t>(a) - static_cast<uint16_t>(b));
}

int16_t whole(int32_t q16) { return static_cast<int16_t>(shift_down(q16, 16)); }

int32_t q16(int16_t whole) { return static_cast<int32_t>(whole) * 65536; }

// The computer rounds each wheel to whole ticks/s, so a speed at a limit may exceed it by one: that is no excess.
bool reduced(int32_t requested, int16_t allowed) {
    const int32_t change = requested - allowed;
    return change > 1 || change < -1;
}

// Moves one wheel by its part; ratio_q16 of a step per tick/s still to go, at most one.
CHEFBOT_OUT_OF_LINE void approach(int16_t target, uint32_t ratio_q16, int32_t *set_q16) {
    const int16_t now = whole(*set_q16);
    const int32_t change = static_cast<int32_t>(distance(now, target) * ratio_q16);
    *set_q16 += now < target ? change : -change;
}

}  // namespace

bool limit_speed(const RobotConstants &robot, int32_t left, int32_t right, Pair *speed) {
    speed->left = clip(left);
    speed->right = clip(right);
    shrink(magnitude(speed->left), robot.max_wheel, speed);
    shrink(magnitude(speed->right), robot.max_wheel, speed);
    shrink(distance(speed->left, static_cast<int16_t>(-speed->right)) / 2, robot.max_forward, speed);
    shrink(distance(speed->left, speed->right), robot.max_turn, speed);
    return reduced(left, speed->left) || reduced(right, speed->right);
}

void Ramp::step(Pair target) {
    const Pair now = set();
    const uint16_t left = distance(now.left, target.left), right = distance(now.right, target.right);
    const uint16_t most = left > right ? left : right;
    // Towards zero and not beyond it, the magnitude falls by all of the change.
    const uint16_t before = magnitude(left > right ? now.left : now.right);
    const uint16_t after = magnitude(left > right ? target.left : target.right);
    const int32_t rate = before - after == most ? robot_->deceleration : robot_->acceleration;
    // rate * 65536 / CONTROL_HZ without the division, which takes long on 8 bits; plausible() keeps it in 32 bits
    const uint32_t step_q16 = static_cast<uint32_t>(rate) * STEP_Q22 >> 6;
    if (most <= step_q16 >> 16) {
        left_q16_ = q16(target.left);
        right_q16_ = q16(target.right);
        return;
    }
    const uint32_t ratio_q16 = step_q16 / most;
    approach(target.left, ratio_q16, &left_q16_);
    approach(target.right, ratio_q16, &right_q16_);
}

Pair Ramp::set() const {
    const Pair set = {whole(left_q16_), whole(right_q16_)};
    return set;
}

}  // namespace chefbot
