// Who may command: one computer that shook hands, as long as it is heard, with ever newer sequence numbers.
#pragma once

#include <stdint.h>

namespace chefbot {

class Session {
  public:
    // A handshake at `step`: returns the sequence that the computer counts on from. It jumps by more than the window,
    // so nothing said in an earlier session is ever new in this one.
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
