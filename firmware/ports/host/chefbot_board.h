// C interface of the board on a computer, for simulators and tests: the firmware's core, fed by hand, its time advanced
// by hand. Any number of boards in one process; a board is not thread-safe. Compiled to a shared library by
// `make -C firmware host`; see firmware/README.md.
#pragma once

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct chefbot_board chefbot_board;

enum { CHEFBOT_LEFT = 0, CHEFBOT_RIGHT = 1 };
enum { CHEFBOT_NO_SENSOR = -1, CHEFBOT_NO_ECHO = 0 };

// What the board puts out now.
typedef struct {
    uint64_t time_us;    // since creation; the board's own time starts at each power-on
    int32_t duty[2];     // -1000..1000, 0 is a brake; positive drives forward
    int32_t drivers;     // 0: motors turn freely whatever duty says
    int32_t state;       // 0 waiting, 1 ready, 2 driving, 3 stopped
    uint32_t flags;      // bits of docs/protocol.md
    int32_t set[2];      // ticks/s the wheels are held to
    uint32_t ticks[2];   // counted, modulo 2^32
    uint32_t illegal[2]; // encoder transitions that cannot be
    uint32_t refused;    // lines from the computer, modulo 2^16
    int32_t refusal;     // why, the last time
    uint32_t restarts;   // by command or hardware watchdog
} chefbot_board_state;

// `constants` in the order of core/robot.h (firmware_constants(robot) in Python). Null: count or values are wrong.
// Powered on at time 0 with 12 V, no e-stop pressed, IMU level and at rest, no echo.
chefbot_board *chefbot_board_create(const int32_t *constants, uint32_t count);
void chefbot_board_destroy(chefbot_board *board);
// Power off and on: counters, session and faults are gone, the surroundings stay.
void chefbot_board_power_cycle(chefbot_board *board);

// Computer to board: obeyed within the next `advance`. Returns how many were taken (the line holds 4096).
uint32_t chefbot_board_write(chefbot_board *board, const uint8_t *bytes, uint32_t count);
// Board to computer: at most `room` bytes; returns how many. Holds 65536; whole lines are dropped beyond.
uint32_t chefbot_board_read(chefbot_board *board, uint8_t *bytes, uint32_t room);

// Quarter steps of the quadrature encoder since the last call, positive forward; each goes through the decoder.
void chefbot_board_turn(chefbot_board *board, int32_t wheel, int32_t quarter_steps);
// The encoder's two lines as they are (A in bit 1, B in bit 0), for tests of broken encoders.
void chefbot_board_encoder_lines(chefbot_board *board, int32_t wheel, int32_t lines);
// What the MPU-6050's registers hold until the next call: ax ay az temperature gx gy gz. A real sensor is never still:
// eight equal samples in a row (80 ms) count as a stuck sensor, so add its noise.
void chefbot_board_imu(chefbot_board *board, const int16_t raw[7]);
// What the registers count in: LSB per g of the first three, LSB per deg/s of the last three.
double chefbot_board_lsb_per_g(void);
double chefbot_board_lsb_per_degree(void);
// 0: the IMU does not answer on the bus.
void chefbot_board_imu_answers(chefbot_board *board, int32_t answers);
// What the IMU answers to WHO_AM_I; 0x68, an MPU-6050, at first.
void chefbot_board_imu_id(chefbot_board *board, int32_t id);
// The IMU holds SDA low, as after a reset of the board in the middle of a read, until the bus is cleared.
void chefbot_board_imu_holds_bus(chefbot_board *board);
void chefbot_board_battery(chefbot_board *board, int32_t millivolts);
// What the next pings hear: round trip in us, CHEFBOT_NO_ECHO, or CHEFBOT_NO_SENSOR.
void chefbot_board_echo(chefbot_board *board, int32_t us);
// Bit i: cliff sensor i sees no floor.
void chefbot_board_cliffs(chefbot_board *board, int32_t bits);
void chefbot_board_estop(chefbot_board *board, int32_t pressed);
// A motor driver holds its line EN/DIAG low, which is seen while the drivers are on, if the robot has such drivers.
void chefbot_board_driver_fault(chefbot_board *board, int32_t fault);
// The main loop hangs from now on, as in an endless wait: the hardware watchdog will restart the board.
void chefbot_board_hang(chefbot_board *board);
// 1: a restart by command ever began with the motors not off.
int32_t chefbot_board_restarted_driving(const chefbot_board *board);

// Time goes on. Control steps fall on whole multiples of 10 ms since power-on. What was written is obeyed first.
void chefbot_board_advance(chefbot_board *board, uint32_t us);
void chefbot_board_get(const chefbot_board *board, chefbot_board_state *state);

// A board of its own on a pty, in real time, with motors, battery and sensors modelled (pty.cpp): linked at `link_path`
// unless that is null, for `seconds` or, if 0, until SIGINT or SIGTERM. Exit code of a program.
int32_t chefbot_board_serve(const int32_t *constants, uint32_t count, const char *link_path, double seconds);

#ifdef __cplusplus
}
#endif
