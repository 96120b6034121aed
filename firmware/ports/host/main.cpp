// The board as a program: a pty that speaks the protocol, in real time, with motors, battery, IMU and ultrasonic modelled.
// What happens to it comes on stdin, one line each: `estop 0|1`, `block WHEEL 0|1`, `cable WHEEL 0|1`, `battery MV`,
// `echo US`, `imu 0|1`, `hang`, `power`. It says where its pty is on stdout.
#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <poll.h>
#include <pty.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

#include <string>

#include "chefbot_board.h"
#include "robot.h"
#include "robot_constants.h"

namespace {

const chefbot::RobotConstants ROBOT = CHEFBOT_ROBOT_CONSTANTS;
const double STEP = 0.001;            // s
const double FRICTION = 0.05;         // of stall torque
const double SAG = 0.06;              // of the voltage, both motors stalled
const double DRAIN = 0.4 / 3600;      // V/s at full effort of both motors: empty in hours, not in minutes
const double GYRO_LSB = 65.5 * 180 / M_PI;  // per rad/s
const double TRACK_PER_TURN = 1.06;   // wheel circumference / separation, of the Chefbot; only the modelled gyro needs it

volatile sig_atomic_t ended;

void end(int) { ended = 1; }

// Two gear motors and what carries them.
class Plant {
  public:
    explicit Plant(chefbot_board *board) : board_(board), volts_(ROBOT.battery_low * 1.08e-3) {}

    void step() {
        chefbot_board_state now;
        chefbot_board_get(board_, &now);
        for (int wheel = 0; wheel < 2; ++wheel) turn(wheel, now.drivers ? now.duty[wheel] * 1e-3 : speed_[wheel] / ROBOT.no_load);
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
        effort_[wheel] = duty - speed / ROBOT.no_load;
        const bool moves = fabs(speed) > 1;
        const double drag = moves ? copysign(FRICTION, speed) : fabs(duty) < FRICTION ? duty : copysign(FRICTION, duty);
        const double next = speed + ((duty - drag) * ROBOT.no_load - speed) * STEP / (ROBOT.lag * 1e-3);
        speed = blocked[wheel] || (moves && next * speed < 0 && fabs(duty) < FRICTION) ? 0 : next;
        place_[wheel] += speed * STEP;
        const double whole = floor(place_[wheel]);
        place_[wheel] -= whole;
        if (!cable_off[wheel]) chefbot_board_turn(board_, wheel, static_cast<int32_t>(whole));
    }
    // Level, turning as the wheels say, with the noise that a living sensor has.
    void feel() {
        if (!imu_moves) return;
        const double turns = (speed_[1] - speed_[0]) * 1e3 / ROBOT.ticks_per_turn_milli;
        const double rate = turns * TRACK_PER_TURN;
        int16_t raw[7] = {noise(), noise(), static_cast<int16_t>(8192 + noise()), -3920, noise(), noise(), noise()};
        raw[6] = static_cast<int16_t>(raw[6] + fmax(-32000, fmin(32000, rate * GYRO_LSB)));
        chefbot_board_imu(board_, raw);
    }
    int16_t noise() {
        random_ = random_ * 1664525u + 1013904223u;
        return static_cast<int16_t>(static_cast<int>(random_ >> 29) - 3);
    }

    chefbot_board *board_;
    double volts_;
    double speed_[2] = {0, 0}, place_[2] = {0, 0}, effort_[2] = {0, 0};
    uint32_t random_ = 1;
};

int open_line(const char *link_path) {
    int computer, board;
    char name[256];
    termios raw;
    if (openpty(&computer, &board, name, nullptr, nullptr)) return -1;
    tcgetattr(board, &raw);
    cfmakeraw(&raw);
    tcsetattr(board, TCSANOW, &raw);
    fcntl(computer, F_SETFL, O_NONBLOCK);
    if (link_path) {
        unlink(link_path);
        if (symlink(name, link_path)) return -1;
    }
    printf("%s\n", link_path ? link_path : name);
    fflush(stdout);
    return computer;
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
    else if (sscanf(event.c_str(), "block %d %d", &a, &b) == 2) plant->blocked[a & 1] = b != 0;
    else if (sscanf(event.c_str(), "cable %d %d", &a, &b) == 2) plant->cable_off[a & 1] = b == 0;
    else if (sscanf(event.c_str(), "battery %d", &a) == 1) plant->charge(a * 1e-3);
    else if (sscanf(event.c_str(), "echo %d", &a) == 1) chefbot_board_echo(board, a);
    else if (sscanf(event.c_str(), "imu %d", &a) == 1) chefbot_board_imu_answers(board, a);
    else if (event == "hang") chefbot_board_hang(board);
    else if (event == "power") chefbot_board_power_cycle(board);
    else fprintf(stderr, "chefbot_board: no such event: %s\n", event.c_str());
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

void run(chefbot_board *board, int line, double seconds) {
    Plant plant(board);
    timespec next;
    clock_gettime(CLOCK_MONOTONIC, &next);
    for (double t = 0; !ended && (seconds <= 0 || t < seconds); t += STEP) {
        listen(board, &plant);
        exchange(board, line);
        plant.step();
        chefbot_board_advance(board, static_cast<uint32_t>(STEP * 1e6));
        next.tv_nsec += static_cast<long>(STEP * 1e9);
        if (next.tv_nsec >= 1000000000) next.tv_nsec -= 1000000000, ++next.tv_sec;
        clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &next, nullptr);
    }
}

}  // namespace

int main(int count, char **arguments) {
    const char *link_path = nullptr;
    double seconds = 0;
    for (int i = 1; i < count; ++i) {
        if (!strcmp(arguments[i], "--link") && i + 1 < count) link_path = arguments[++i];
        else if (!strcmp(arguments[i], "--seconds") && i + 1 < count) seconds = atof(arguments[++i]);
        else {
            fprintf(stderr, "usage: chefbot_board [--link PATH] [--seconds N]\n");
            return 2;
        }
    }
    signal(SIGTERM, end);
    signal(SIGINT, end);
    int32_t constants[chefbot::ROBOT_CONSTANTS];
    memcpy(constants, &ROBOT, sizeof constants);
    chefbot_board *board = chefbot_board_create(constants, chefbot::ROBOT_CONSTANTS);
    const int line = open_line(link_path);
    if (!board || line < 0) {
        fprintf(stderr, "chefbot_board: %s\n", board ? strerror(errno) : "the robot's constants are out of range");
        return 2;
    }
    run(board, line, seconds);
    if (link_path) unlink(link_path);
    chefbot_board_destroy(board);
    return 0;
}
