// HC-SR04 without waiting: a ping every so many steps, edges by interrupt, verdict three steps later.
#pragma once

#include <stdint.h>

namespace chefbot {

class Sonar {
  public:
    static const int32_t NO_SENSOR = -1;  // the echo line never moved, or never came back
    static const int32_t NOTHING = 0;     // no echo within TIMEOUT_US

    void start(int32_t period) { period_ = static_cast<uint16_t>(period); }
    // From the pin's interrupt; any free-running microseconds that wrap at 2^16.
    void edge(bool high, uint16_t us);
    // True when a ping is due: the port must send it.
    bool step();
    // True once per ping: `echo_us()` is new.
    bool take_result();

    // Round trip of sound in us, or one of the above.
    int32_t echo_us() const { return echo_us_; }
    bool bad() const { return echo_us_ == NO_SENSOR; }

    static const uint16_t TIMEOUT_US = 25000;
    static const uint8_t VERDICT_STEPS = 3;

  private:
    enum State : uint8_t { IDLE, SENT, RISEN, FALLEN };

    void judge();

    int32_t echo_us_ = NOTHING;
    uint16_t period_ = 0;
    uint16_t since_ = 0;  // steps since the ping
    volatile uint16_t rose_us_ = 0;
    volatile uint16_t width_us_ = 0;
    volatile State state_ = IDLE;
    bool new_ = false;
};

}  // namespace chefbot
