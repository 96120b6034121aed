// A HAL that does nothing, to measure the size of the core alone: every call of the core is kept, no peripheral code is added.
#include "board.h"

using namespace chefbot;

static volatile uint8_t world;

namespace chefbot {
uint8_t hal_lock(void *) { return world; }
void hal_unlock(void *, uint8_t before) { world = before; }
void hal_motor(void *, uint8_t, int16_t) {}
void hal_drivers(void *, bool) {}
bool hal_driver_fault(void *) { return world; }
bool hal_estop(void *) { return world; }
uint8_t hal_cliffs(void *) { return world; }
uint16_t hal_battery_mv(void *) { return world; }
void hal_ping(void *) {}
bool hal_i2c_write(void *, uint8_t, uint8_t, uint8_t) { return world; }
void hal_i2c_clear(void *) {}
bool hal_i2c_read(void *, uint8_t, uint8_t, uint8_t *bytes, uint8_t) {
    *bytes = world;
    return world;
}
bool hal_send(void *, const char *bytes, uint8_t) {
    world = static_cast<uint8_t>(*bytes);
    return true;
}
void hal_feed_watchdog(void *) {}
void hal_restart(void *) {}
}  // namespace chefbot

static Board board;
static RobotConstants robot;

int main() {
    board.start(robot, nullptr, "empty", world);
    board.encoder_start(LEFT, world);
    for (;;) {
        board.encoder_edge(world & 1, world);
        board.echo_edge(world, world);
        board.receive(world);
        board.poll();
        board.step();
    }
}
