// The session: one computer may command, from its handshake until a timeout, with increasing sequence numbers.
#pragma once

#include <stdint.h>

namespace chefbot {

class Session {
  public:
    // A handshake at `step`: returns the sequence from which the computer continues. It jumps by more than the window,
    // so no line of an earlier session is accepted in this one.
    uint16_t open(uint32_t step);
    // True: `sequence` is newer than all before (at most WINDOW ahead) and the session is open.
    bool accept(uint16_t sequence);
    // Call every step; closes the session after SILENCE without an accepted line.
    void watch();

    bool is_open() const { return patience_ > 0; }
    uint16_t last() const { return last_; }

    static const uint16_t WINDOW = 256;
    static const uint8_t SILENCE = 100;  // steps: 1 s

  private:
    uint16_t last_ = 0;
    uint8_t patience_ = 0;  // steps until the session closes
};

}  // namespace chefbot
