// The robot in a program: empty as compiled, filled in by `chefbot board flash` and `chefbot board image`
// (src/chefbot/board/firmware_image.py), which find it by its mark, BOARD_MARK of the port. So one program of each board serves every robot.
#pragma once

#include "driver_inputs.h"
#include "robot.h"

namespace chefbot {

// GP numbers, `board.pins` of the robot file; the other boards have fixed pins.
struct PicoPins {
    uint8_t left_a, left_b, right_a, right_b, left_in_a, left_in_b, right_in_a, right_in_b, enable, estop, pwm_left, pwm_right,
        trigger, echo, cliff_0;
};

// Little-endian and without gaps on every board.
struct RobotBlock {
    char mark[16];  // the board, and the version of this layout
    RobotConstants constants;
    PicoPins pins;
    uint8_t driver_inputs;  // DriverInputs
    uint32_t name_crc;      // CRC-32 of the robot's name
};
static_assert(sizeof(RobotBlock) == 16 + 4 * ROBOT_CONSTANTS + 16 + 4, "the block has a gap");

const RobotBlock ROBOT_BLOCK __attribute__((used, aligned(4))) = {
    BOARD_MARK, {}, {}, 0, 0};

// Through assembler, as the compiler would take the robot for empty.
inline const RobotBlock &robot_block() {
    const RobotBlock *block = &ROBOT_BLOCK;
    asm("" : "+r"(block));
    return *block;
}

// Never returns where no robot was filled in: the motors are off and no line is sent.
inline void require_robot() {
    if (plausible(robot_block().constants)) return;
    for (;;) {}
}

}  // namespace chefbot
