// Frees an I2C bus on which a chip holds SDA low, waiting for the clock pulses of a read that was interrupted (I2C-bus
// specification UM10204, 3.1.16). `Bus` drives its lines as open drains and waits half a clock period after each change.
#pragma once

#include <stdint.h>

namespace chefbot {

template <class Bus>
void clear_bus(const Bus &bus) {
    bus.sda(true);
    for (uint8_t pulse = 0; pulse < 9; ++pulse) {
        bus.scl(false);
        bus.scl(true);
    }
    // A stop condition: SDA rises while SCL is high.
    bus.scl(false);
    bus.sda(false);
    bus.scl(true);
    bus.sda(true);
}

}  // namespace chefbot
