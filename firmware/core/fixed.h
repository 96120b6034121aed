// Whole-number arithmetic. A name that ends in _q6 counts 1/64 of its unit.
#pragma once

#include <stdint.h>

namespace chefbot {

struct Pair {
    int32_t left, right;
};

inline int32_t magnitude(int32_t x) { return x < 0 ? -x : x; }

inline int32_t clamp(int32_t x, int32_t bound) { return x > bound ? bound : x < -bound ? -bound : x; }

// Towards minus infinity, as every compiler used here shifts a negative number; the one place that relies on it.
inline int32_t shift_down(int32_t x, uint8_t bits) { return x >> bits; }

}  // namespace chefbot
