#include "encoder.h"

namespace chefbot {

void Encoder::start(uint8_t lines) {
    count_ = 0;
    illegal_ = 0;
    lines_ = lines & 3u;
}

// Decoded from Gray code the lines are a number that forward motion counts down: 0 3 2 1. The difference modulo 4 is
// the step: 1 forward, 3 backward; one edge cannot give 2.
void Encoder::edge(uint8_t lines) {
    lines &= 3u;
    const uint8_t now = static_cast<uint8_t>(lines ^ (lines >> 1));
    const uint8_t before = static_cast<uint8_t>(lines_ ^ (lines_ >> 1));
    lines_ = lines;
    switch ((before - now) & 3u) {
        case 0: break;
        case 1: ++count_; break;
        case 3: --count_; break;
        default: ++illegal_;
    }
}

void Encoder::set(uint32_t count, uint16_t illegal) {
    count_ = count;
    illegal_ = illegal;
}

}  // namespace chefbot
