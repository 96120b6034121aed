// The functions that a port provides. Plain functions bound by the linker: no table in RAM, no indirect call, and the
// smallest code on an 8-bit machine. `port` is the value that the port passed to Board::start; a microcontroller
// ignores it, the host port finds its instance by it. None may wait longer than a few hundred us (I2C: a byte that does
// not arrive within 1 ms is an error).
#pragma once

#include <stdint.h>

namespace chefbot {

const uint8_t LEFT = 0, RIGHT = 1;

extern "C" {

// Atomic sections: disable interrupts, and restore their previous state.
uint8_t hal_lock(void *port);
void hal_unlock(void *port, uint8_t before);

// -DUTY_FULL..DUTY_FULL; 0 shorts the motor (brake). Positive drives the robot forward.
void hal_motor(void *port, uint8_t wheel, int16_t duty);
// False: the driver lets the motors turn freely. Must be false from reset on.
void hal_drivers(void *port, bool on);
// True while a driver holds the enable line low that hal_drivers(true) has released; false for drivers without EN/DIAG.
bool hal_driver_fault(void *port);

// True while the normally closed circuit is open.
bool hal_estop(void *port);
// Bit i: cliff sensor i sees no floor; an input that nothing is connected to does so, too.
uint8_t hal_cliffs(void *port);
// The newest finished conversion, at the battery's terminals.
uint16_t hal_battery_mv(void *port);
// Ten microseconds high on the HC-SR04's trigger. The port reports the echo's edges with Board::echo_edge.
void hal_ping(void *port);

// False: no acknowledge, or time-out.
bool hal_i2c_write(void *port, uint8_t address, uint8_t reg, uint8_t value);
bool hal_i2c_read(void *port, uint8_t address, uint8_t reg, uint8_t *bytes, uint8_t count);
// Nine clock pulses and a stop condition: they free a chip that holds SDA low since a reset in the middle of a read
// (I2C-bus specification UM10204, 3.1.16).
void hal_i2c_clear(void *port);

// All or nothing; false: no room.
bool hal_send(void *port, const char *bytes, uint8_t count);

// Restart the countdown of the hardware watchdog (50 ms at most).
void hal_feed_watchdog(void *port);
// Restart the processor; may return on a port that cannot.
void hal_restart(void *port);
}

}  // namespace chefbot
