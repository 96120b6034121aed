// Quadrature decoding, all four edges (x4).
#pragma once

#include <stdint.h>

namespace chefbot {

class Encoder {
  public:
    // `lines` is A in bit 1, B in bit 0: the present levels of the pins.
    void start(uint8_t lines);
    // Call at every change of A or B, from the pin interrupt. A before B counts up.
    void edge(uint8_t lines);
    // For ports with hardware counters.
    void set(uint32_t count, uint16_t illegal);

    // Modulo 2^32: only differences are meaningful.
    uint32_t count() const { return count_; }
    // Both lines changed at once: an edge was lost. Modulo 2^16.
    uint16_t illegal() const { return illegal_; }

  private:
    uint32_t count_ = 0;
    uint16_t illegal_ = 0;
    uint8_t lines_ = 0;
};

}  // namespace chefbot
