// Integer arithmetic, in 16 bits where possible: on an 8-bit processor every byte costs time. A name that ends in _q4
// counts 1/16 of its unit, _q12 1/4096, _q16 1/65536.
#pragma once

#include <stdint.h>

namespace chefbot {

// Of both wheels, ticks/s.
struct Pair {
    int16_t left, right;
};

const int16_t MOST_16 = 32767;

// -32768 counts as -32767.
inline uint16_t magnitude(int16_t x) {
    return static_cast<uint16_t>(x >= 0 ? x : x < -MOST_16 ? MOST_16 : -x);
}

#define CHEFBOT_OUT_OF_LINE __attribute__((noinline))  // called often, and large on 8 bits

CHEFBOT_OUT_OF_LINE inline int32_t clamp(int32_t x, int32_t bound) { return x > bound ? bound : x < -bound ? -bound : x; }

inline int16_t clip(int32_t x) { return static_cast<int16_t>(clamp(x, MOST_16)); }

// Towards minus infinity, as every compiler used here shifts a negative number; the one place that relies on it.
inline int32_t shift_down(int32_t x, uint8_t bits) { return x >> bits; }

}  // namespace chefbot
