// The whole motor board: a port owns one of these, calls `step` from a 100 Hz timer interrupt, `poll` from its main
// loop, `receive` for every byte from the computer, and the two edge functions from pin interrupts.
#pragma once

#include <stdint.h>

#include "encoder.h"
#include "fixed.h"
#include "frame.h"
#include "hal.h"
#include "imu.h"
#include "limits.h"
#include "line.h"
#include "robot.h"
#include "safety.h"
#include "session.h"
#include "sonar.h"
#include "wheel.h"

namespace chefbot {

const int32_t PROTOCOL = 1;

// Why a line from the computer was rejected; every `s` line contains the last reason.
enum class Refusal : uint8_t {
    NONE = 0,
    CRC = 1,       // damaged
    FORM = 2,      // not a line of this protocol
    SEQUENCE = 3,  // old, repeated, too far ahead, or no session
    LETTER = 4,    // unknown command or wrong count of numbers
    VERSION = 5,   // handshake for another protocol
    STOPPED = 6,   // a fault is latched
    NEUTRAL = 7,   // after a handshake or a clear, `s 0 0` comes first
    CAUSE = 8,     // clear: the cause of a fault persists
};

enum class State : uint8_t {
    WAITING = 0,  // no session
    READY = 1,    // session, no fresh speed
    DRIVING = 2,  // follows the commanded speeds
    STOPPED = 3,  // a fault is latched
};

// State at one control step; written in the interrupt, sent by the main loop.
struct Snapshot {
    uint32_t step;
    uint32_t ticks[2];
    uint16_t illegal[2];
    Pair set;  // set speeds of the wheels, ticks/s
    int16_t duty[2];
    uint16_t battery_mv;
    uint16_t obeyed;  // sequence of the last accepted speed
    Flags flags;
    State state;
    uint8_t cliffs;  // bit i: sensor i sees no floor
    bool resting;
};

class Board {
  public:
    // `name` of the port: letters and digits. Leaves motors off.
    void start(const RobotConstants &robot, void *port, const char *name, bool after_watchdog);

    // Timer interrupt, every STEP_US; may be interrupted by the edges.
    void step();
    // Main loop, as often as possible; at least once between two steps.
    void poll();
    // Main loop: a byte from the computer.
    void receive(uint8_t byte);

    // Pin interrupts.
    void encoder_edge(uint8_t wheel, uint8_t lines) { encoders_[wheel].edge(lines); }
    void echo_edge(bool high, uint16_t us) { sonar_.edge(high, us); }
    // Instead of edges, for ports with hardware counters; call just before `step`.
    void encoder_count(uint8_t wheel, uint32_t count, uint16_t illegal) { encoders_[wheel].set(count, illegal); }
    // Levels of the encoder's pins before the first edge.
    void encoder_start(uint8_t wheel, uint8_t lines) { encoders_[wheel].start(lines); }

    const Snapshot &snapshot() const { return now_; }
    uint16_t refused() const { return refused_; }
    Refusal refusal() const { return refusal_; }

  private:
    // step, in this order
    void count_wheels();
    void watch();
    void drive();
    void hold_still();
    void apply(int16_t left, int16_t right);
    void finish_snapshot();

    // lines from the computer
    Refusal obey(const Frame &frame);
    Refusal obey_in_session(const Frame &frame);
    Refusal shake_hands(const Frame &frame);
    Refusal set_speed(int32_t left, int32_t right);
    Refusal clear_faults();
    Refusal restart();
    void emergency_stop();
    void refuse(Refusal why);

    // lines to the computer
    Line begin(char letter, const Snapshot &at);
    void send(Line *line);
    void tell_version(int32_t token);
    void tell_motion(const Snapshot &at);
    void tell_status(const Snapshot &at);
    void tell_inertia(const Snapshot &at);
    void tell_echo(const Snapshot &at);
    void tell_cliffs(const Snapshot &at);
    void tell_battery(const Snapshot &at);
    void tell_time(const Snapshot &at);
    void tell_due(const Snapshot &at);

    Flags flags() const;
    State state() const;
    void count_wheel(uint8_t wheel);

    const RobotConstants *robot_ = nullptr;
    void *port_ = nullptr;
    const char *name_ = nullptr;

    Encoder encoders_[2];
    Wheel wheels_[2];
    Safety safety_;
    Session session_;
    Sonar sonar_;
    Imu imu_;
    FrameReader reader_;

    // Written by the interrupt, or by the main loop under lock.
    Snapshot now_ = Snapshot();
    Pair target_ = {0, 0};
    Ramp ramp_;
    uint8_t command_age_ = 0;  // steps since the last received speed
    uint8_t rest_steps_ = 0;
    uint8_t brake_ = 0;     // steps until the drivers are switched off
    uint8_t cliff_inputs_ = 0;  // bits of those connected
    uint8_t unpolled_ = 0;  // steps since the main loop ran
    bool fresh_ = false;
    bool neutral_first_ = false;
    bool limited_ = false;
    bool after_watchdog_ = false;
    Flags sensors_ = 0;

    // Main loop only.
    uint32_t told_ = 0;
    uint16_t line_ = 0;
    uint8_t inertia_age_ = 0;  // steps since the last `i` line
    uint16_t dropped_ = 0;  // lines dropped because the buffer was full
    uint16_t missed_ = 0;   // steps that the main loop missed
    uint16_t refused_ = 0;
    Refusal refusal_ = Refusal::NONE;
};

}  // namespace chefbot
