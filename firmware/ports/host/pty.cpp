// The board on a pty, in real time, with motors, battery, IMU and ultrasonic modelled.
// Faults are read from stdin, one per line: `estop 0|1`, `block WHEEL 0|1`, `cable WHEEL 0|1`, `battery MV`,
// `echo US`, `cliffs BITS`, `imu 0|1`, `hang`, `power`. It prints the path of its pty on stdout.
#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

#include <string>

#include "chefbot_board.h"
#include "imu.h"
#include "robot.h"

namespace {

const double STEP = 0.001;            // s
const double FRICTION = 0.05;         // of stall torque
const double SAG = 0.06;              // of the voltage, both motors stalled
const double DRAIN = 0.4 / 3600;      // V/s at full effort of both motors: empty in hours, not in minutes
const double GYRO_LSB = chefbot::Imu::LSB_PER_10_DEGREES / 10.0 * 180 / M_PI;  // per rad/s
const double TRACK_PER_TURN = 1.06;   // wheel circumference / separation, of the Chefbot; only the modelled gyro needs it

volatile sig_atomic_t ended;

void end(int) { ended = 1; }

// Two gear motors and what carries them.
class Plant {
  public:
    Plant(chefbot_board *board, const chefbot::RobotConstants &robot)
        : board_(board), robot_(robot), volts_(robot.battery_low * 1.08e-3) {}

    void step() {
        chefbot_board_state now;
        chefbot_board_get(board_, &now);
        for (int wheel = 0; wheel < 2; ++wheel) turn(wheel, now.drivers ? now.duty[wheel] * 1e-3 : speed_[wheel] / robot_.no_load);
        volts_ -= DRAIN * STEP * (fabs(effort_[0]) + fabs(effort_[1])) / 2;
        const double sag = 1 - SAG * (fabs(effort_[0]) + fabs(effort_[1])) / 2;
        chefbot_board_battery(board_, static_cast<int32_t>(volts_ * 1e3 * sag));
        feel();
    }
    void charge(double volts) { volts_ = volts; }

    bool blocked[2] = {false, false}, cable_off[2] = {false, false}, imu_moves = true;

  private:
    // First-order: the duty's speed is reached with the robot's time constant, friction takes its part.
    void turn(int wheel, double duty) {
        double &speed = speed_[wheel];
        effort_[wheel] = duty - speed / robot_.no_load;
        const bool moves = fabs(speed) > 1;
        const double drag = moves ? copysign(FRICTION, speed) : fabs(duty) < FRICTION ? duty : copysign(FRICTION, duty);
        const double next = speed + ((duty - drag) * robot_.no_load - speed) * STEP / (robot_.lag * 1e-3);
        speed = blocked[wheel] || (moves && next * speed < 0 && fabs(duty) < FRICTION) ? 0 : next;
        place_[wheel] += speed * STEP;
        const double whole = floor(place_[wheel]);
        place_[wheel] -= whole;
        if (!cable_off[wheel]) chefbot_board_turn(board_, wheel, static_cast<int32_t>(whole));
    }
    // Level, turning as the wheels say, with the noise that a living sensor has.
    void feel() {
        if (!imu_moves) return;
        const double turns = (speed_[1] - speed_[0]) * 1e3 / robot_.ticks_per_turn_milli;
        const double rate = turns * TRACK_PER_TURN;
        int16_t raw[7] = {noise(), noise(), static_cast<int16_t>(chefbot::Imu::LSB_PER_G + noise()), -3920, noise(), noise(), noise()};
        raw[6] = static_cast<int16_t>(raw[6] + fmax(-32000, fmin(32000, rate * GYRO_LSB)));
        chefbot_board_imu(board_, raw);
    }
    int16_t noise() {
        random_ = random_ * 1664525u + 1013904223u;
        return static_cast<int16_t>(static_cast<int>(random_ >> 29) - 3);
    }

    chefbot_board *board_;
    const chefbot::RobotConstants &robot_;
    double volts_;
    double speed_[2] = {0, 0}, place_[2] = {0, 0}, effort_[2] = {0, 0};
    uint32_t random_ = 1;
};

// The computer's end is a terminal device; ours is what comes back, or -1 with errno.
int open_line(const char *link_path) {
    const int ours = posix_openpt(O_RDWR | O_NOCTTY);
    if (ours < 0 || grantpt(ours) || unlockpt(ours)) return -1;
    const std::string name = ptsname(ours);
    const int theirs = open(name.c_str(), O_RDWR | O_NOCTTY);  // stays open: the line outlives the computers at it
    termios raw;
    if (theirs < 0 || tcgetattr(theirs, &raw)) return -1;
    cfmakeraw(&raw);
    tcsetattr(theirs, TCSANOW, &raw);
    fcntl(ours, F_SETFL, O_NONBLOCK);
    if (link_path) {
        unlink(link_path);
        if (symlink(name.c_str(), link_path)) return -1;
    }
    printf("%s\n", link_path ? link_path : name.c_str());
    fflush(stdout);
    return ours;
}

// What the computer does not read in time is lost, as on a wire.
void exchange(chefbot_board *board, int line) {
    uint8_t bytes[4096];
    const ssize_t got = read(line, bytes, sizeof bytes);
    if (got > 0) chefbot_board_write(board, bytes, static_cast<uint32_t>(got));
    const uint32_t count = chefbot_board_read(board, bytes, sizeof bytes);
    if (count && write(line, bytes, count) < 0 && errno != EAGAIN) perror("chefbot_board");
}

void happen(chefbot_board *board, Plant *plant, const std::string &event) {
    int a, b;
    if (sscanf(event.c_str(), "estop %d", &a) == 1) chefbot_board_estop(board, a);
    else if (sscanf(event.c_str(), "driver_fault %d", &a) == 1) chefbot_board_driver_fault(board, a);
    else if (sscanf(event.c_str(), "block %d %d", &a, &b) == 2) plant->blocked[a & 1] = b != 0;
    else if (sscanf(event.c_str(), "cable %d %d", &a, &b) == 2) plant->cable_off[a & 1] = b == 0;
    else if (sscanf(event.c_str(), "battery %d", &a) == 1) plant->charge(a * 1e-3);
    else if (sscanf(event.c_str(), "echo %d", &a) == 1) chefbot_board_echo(board, a);
    else if (sscanf(event.c_str(), "cliffs %d", &a) == 1) chefbot_board_cliffs(board, a);
    else if (sscanf(event.c_str(), "imu %d", &a) == 1) chefbot_board_imu_answers(board, a);
    else if (sscanf(event.c_str(), "turn %d %d", &a, &b) == 2) chefbot_board_turn(board, a & 1, b);
    else if (event == "hang") chefbot_board_hang(board);
    else if (event == "power") chefbot_board_power_cycle(board);
    else fprintf(stderr, "chefbot: the board knows no event %s\n", event.c_str());
}

void listen(chefbot_board *board, Plant *plant) {
    static std::string part;
    static bool open = true;
    char bytes[256];
    pollfd input = {STDIN_FILENO, POLLIN, 0};
    if (!open || poll(&input, 1, 0) <= 0) return;
    const ssize_t got = read(STDIN_FILENO, bytes, sizeof bytes);
    open = got > 0;
    for (ssize_t i = 0; i < got; ++i) {
        if (bytes[i] != '\n') {
            part += bytes[i];
            continue;
        }
        happen(board, plant, part);
        part.clear();
    }
}

int64_t now_ns() {
    timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return now.tv_sec * 1000000000LL + now.tv_nsec;
}

void sleep_until(int64_t when_ns) {
    const int64_t left = when_ns - now_ns();
    if (left <= 0) return;
    const timespec pause = {static_cast<time_t>(left / 1000000000), static_cast<long>(left % 1000000000)};
    nanosleep(&pause, nullptr);
}

void run(chefbot_board *board, const chefbot::RobotConstants &robot, int line, double seconds) {
    Plant plant(board, robot);
    int64_t next = now_ns();
    for (double t = 0; !ended && (seconds <= 0 || t < seconds); t += STEP) {
        listen(board, &plant);
        exchange(board, line);
        plant.step();
        chefbot_board_advance(board, static_cast<uint32_t>(STEP * 1e6));
        next += static_cast<int64_t>(STEP * 1e9);
        sleep_until(next);
    }
}

}  // namespace

extern "C" int32_t chefbot_board_serve(const int32_t *constants, uint32_t count, const char *link_path, double seconds) {
    chefbot_board *board = chefbot_board_create(constants, count);
    const int line = board ? open_line(link_path) : -1;
    if (line < 0) {
        const char *where = link_path ? link_path : "a terminal of its own";
        if (board) fprintf(stderr, "chefbot: the board cannot be at %s: %s\n", where, strerror(errno));
        else fprintf(stderr, "chefbot: the robot's constants are out of range for the board\n");
        chefbot_board_destroy(board);
        return 2;
    }
    signal(SIGTERM, end);
    signal(SIGINT, end);
    chefbot::RobotConstants robot;
    memcpy(&robot, constants, sizeof robot);
    run(board, robot, line, seconds);
    if (link_path) unlink(link_path);
    chefbot_board_destroy(board);
    return 0;
}
