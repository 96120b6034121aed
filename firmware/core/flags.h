// State of the board: one bit each in the four-digit hexadecimal field of `e` and `s` lines.
#pragma once

#include <stdint.h>

namespace chefbot {

typedef uint16_t Flags;

// Latched: stay until a clear command after their cause has ended.
const Flags ESTOP_INPUT = 1u << 0;
const Flags ESTOP_COMMAND = 1u << 1;
const Flags STALL_LEFT = 1u << 2;
const Flags STALL_RIGHT = 1u << 3;
const Flags ENCODER_LEFT = 1u << 4;
const Flags ENCODER_RIGHT = 1u << 5;
const Flags BATTERY_EMPTY = 1u << 6;
const Flags DRIVER_FAULT = 1u << 7;  // reported by a motor driver
const Flags LATCHED = 0x00FF;
const Flags AT_ONCE = 0x00BF;  // motors off at once; an empty battery slows down first

// Not latched: present state.
const Flags NO_COMMAND = 1u << 8;     // the last accepted speed is too old
const Flags NEUTRAL_FIRST = 1u << 9;  // only `s 0 0` will be accepted
const Flags LIMITED = 1u << 10;       // the commanded speed exceeded the robot's limits
const Flags BATTERY_LOW = 1u << 11;
const Flags IMU_BAD = 1u << 12;
const Flags SONAR_BAD = 1u << 13;
const Flags WATCHDOG_RESET = 1u << 14;  // the hardware watchdog restarted the board; until a clear command
const Flags NO_SESSION = 1u << 15;

}  // namespace chefbot
