// The faults that stop the robot. Pure logic, one call per control step.
#pragma once

#include <stdint.h>

#include "flags.h"
#include "hal.h"
#include "robot.h"

namespace chefbot {

// Detects a wheel that does not follow its duty.
class WheelWatch {
  public:
    enum Fault : uint8_t { NONE, STALL, ENCODER };

    // duty of the last step, speed in ticks/s.
    Fault update(int16_t duty, int16_t speed, int16_t no_load);

    static const uint8_t STALL_STEPS = 25;    // hard driven, hardly moving: 0.25 s
    static const uint8_t SILENT_STEPS = 20;   // driven, not one tick: 0.2 s
    static const uint8_t REVERSE_STEPS = 10;  // driven one way, counting the other, faster: 0.1 s
    static const uint16_t STALL_DUTY = 600, ENCODER_DUTY = 300;
    static const int16_t SLOW_PART = 16;      // of the no-load speed

  private:
    uint8_t stalled_ = 0, silent_ = 0, reversed_ = 0;
    uint16_t pace_before_ = 0;  // ticks/s when it last counted with the motor
};

// Filtered voltage: motors cause short dips, an empty pack a permanently low voltage.
class BatteryWatch {
  public:
    void start(const RobotConstants &robot);
    // One reading; sets and clears BATTERY_LOW, sets BATTERY_EMPTY.
    void update(uint16_t mv, Flags *flags);
    // Above the warning by half of what lies between warning and stop.
    bool recovered() const { return mv_ >= charged_; }
    // Smoothed over 0.64 s, mV.
    uint16_t mv() const { return mv_; }

    static const uint8_t EMPTY_STEPS = 200;  // 2 s

  private:
    uint32_t filtered_q6_ = 0;                   // mV
    uint16_t mv_ = 0;
    uint16_t stop_ = 0, low_ = 0, charged_ = 0;  // mV
    uint8_t empty_ = 0;
};

struct SafetyInputs {
    bool estop, driver_fault;
    uint16_t battery_mv;
    int16_t duty[2];
    int16_t speed[2];  // ticks/s
};

class Safety {
  public:
    void start(const RobotConstants &robot);
    void update(const SafetyInputs &in);
    void estop() { flags_ |= ESTOP_COMMAND; }
    // Clears every latched fault whose cause has ended; true if none is left.
    bool clear();

    Flags flags() const { return flags_; }
    bool latched() const { return flags_ & LATCHED; }
    bool driver_fault() const { return flags_ & DRIVER_FAULT; }
    bool at_once() const { return flags_ & AT_ONCE; }
    uint16_t battery_mv() const { return battery_.mv(); }

  private:
    void watch_wheel(uint8_t wheel, const SafetyInputs &in);

    WheelWatch wheels_[2];
    BatteryWatch battery_;
    int16_t no_load_ = 0;
    Flags flags_ = 0;
    bool pressed_ = false;
    bool driver_low_ = false;  // in the last step
};

}  // namespace chefbot
