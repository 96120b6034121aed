// The robot's constants in the firmware: integers, made from its YAML file by `firmware_constants(robot)`
// (src/chefbot/board/firmware_constants.py). The order is part of the C interface of the host port and of the block in a
// program. Wheel radius and separation are deliberately absent: the board counts ticks, only the computer uses metres, so
// a calibration needs no new firmware.
#pragma once

#include <stdint.h>

namespace chefbot {

struct RobotConstants {
    int32_t hash;                  // CRC-32 of all that follows
    int32_t ticks_per_turn_milli;  // 1/1000 tick per turn of the wheel, all four edges counted
    int32_t max_wheel;             // ticks/s, either wheel
    int32_t max_forward;           // ticks/s, mean of both wheels
    int32_t max_turn;              // ticks/s, right minus left
    int32_t acceleration;          // ticks/s^2, of a wheel that speeds up
    int32_t deceleration;          // ticks/s^2, of a wheel that slows down
    int32_t no_load;               // ticks/s at full duty without load
    int32_t lag;                   // ms; time constant of the loaded robot on its motors
    int32_t battery_stop;          // mV
    int32_t battery_low;           // mV
    int32_t imu_period;            // control steps between two `i` lines
    int32_t sonar_period;          // control steps between two pings; 0: no sensor
    int32_t cliff_sensors;         // connected to the first inputs; 0: none
    int32_t hold;                  // 1: the motors stay shorted at rest; 0: after a second the wheels turn freely
    int32_t enable_diag;           // 1: the drivers' enable is pulled up, and low while one of them has a fault (EN/DIAG)
};

const uint8_t ROBOT_CONSTANTS = sizeof(RobotConstants) / sizeof(int32_t);

const int32_t CONTROL_HZ = 100;
const int32_t STEP_US = 1000000 / CONTROL_HZ;
const int16_t DUTY_FULL = 1000;     // duty is per mille
const int32_t CLIFF_INPUTS = 4;
const int32_t SPEED_BOUND = 32767;  // ticks/s; speeds fit 16 bits, their products 32

// False: a number is outside the range of the fixed-point arithmetic.
inline bool plausible(const RobotConstants &r) {
    return r.ticks_per_turn_milli > 0 && r.max_wheel > 0 && r.max_wheel <= r.no_load && r.max_forward > 0 &&
           r.max_forward <= SPEED_BOUND && r.max_turn > 0 && r.max_turn <= 2 * SPEED_BOUND && r.acceleration >= 128 &&
           r.deceleration >= r.acceleration && r.deceleration <= 102000 && r.no_load >= 126 &&
           r.no_load <= SPEED_BOUND && r.lag >= 0 && r.lag <= 2000 && r.battery_stop >= 0 &&
           r.battery_low >= r.battery_stop && r.battery_low <= 40000 && r.imu_period >= 1 && r.imu_period <= 100 &&
           r.sonar_period >= 0 && r.sonar_period <= 1000 && r.cliff_sensors >= 0 && r.cliff_sensors <= CLIFF_INPUTS &&
           (r.hold == 0 || r.hold == 1) && (r.enable_diag == 0 || r.enable_diag == 1);
}

}  // namespace chefbot
