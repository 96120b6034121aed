// A board on the desk: the host port, a motor model on its duty, and a computer that counts its sequence.
#pragma once

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include <string>
#include <vector>

#include "chefbot_board.h"
#include "robot.h"

// Rounded numbers near the Chefbot's, so that expectations can be worked out by hand.
inline chefbot::RobotConstants example_robot() {
    chefbot::RobotConstants robot = {0x12345678, 8400000, 10000, 9600, 8000, 12800, 25600, 11200, 130, 11000, 11600, 2, 10, 0, 0, 0};
    return robot;
}

// CRC-16/CCITT-FALSE by table-free long division, written apart from core/crc16.cpp.
inline unsigned reference_crc(const std::string &text) {
    unsigned long rest = 0xFFFF;
    for (unsigned char c : text) {
        rest ^= static_cast<unsigned long>(c) << 8;
        for (int i = 0; i < 8; ++i) rest = rest & 0x8000 ? ((rest << 1) ^ 0x1021) & 0xFFFF : rest << 1;
    }
    return static_cast<unsigned>(rest & 0xFFFF);
}

inline std::string framed(const std::string &text) {
    char tail[8];
    snprintf(tail, sizeof tail, "*%04X\n", reference_crc(text));
    return text + tail;
}

inline std::vector<std::string> split(const std::string &text, char at) {
    std::vector<std::string> parts(1);
    for (char c : text) {
        if (c == at) parts.push_back("");
        else parts.back() += c;
    }
    return parts;
}

class Desk {
  public:
    explicit Desk(chefbot::RobotConstants robot = example_robot()) : robot_(robot) {
        int32_t values[chefbot::ROBOT_CONSTANTS];
        memcpy(values, &robot, sizeof values);
        board = chefbot_board_create(values, chefbot::ROBOT_CONSTANTS);
    }
    ~Desk() { chefbot_board_destroy(board); }
    Desk(const Desk &) = delete;

    void write(const std::string &bytes) {
        chefbot_board_write(board, reinterpret_cast<const uint8_t *>(bytes.data()), static_cast<uint32_t>(bytes.size()));
    }
    // A command with the next sequence.
    void say(char letter, const std::string &rest = "") {
        ++sequence;
        write(framed(std::string(1, letter) + " " + std::to_string(sequence) + rest));
    }
    void speed(int left, int right) { say('s', " " + std::to_string(left) + " " + std::to_string(right)); }
    void open() {
        write(framed("v 1 1"));
        run(10);
        sequence = static_cast<uint16_t>(std::stoul(last('v').at(14)));
    }
    void open_and_neutral() {
        open();
        speed(0, 0);
        run(10);
    }
    // Drives for so long, saying the speed every 50 ms.
    void drive(int left, int right, int ms) {
        for (int t = 0; t < ms; t += 50) {
            speed(left, right);
            run(50);
        }
    }
    // Ten milliseconds at a time: motors, encoders, a living IMU.
    void run(int ms) {
        for (int t = 0; t < ms; t += 10) {
            turn_wheels();
            if (imu_lives) shake_imu();
            chefbot_board_advance(board, 10000);
        }
        collect();
    }
    chefbot_board_state state() const {
        chefbot_board_state now;
        chefbot_board_get(board, &now);
        return now;
    }
    unsigned flags() const { return state().flags; }
    // Fields of the newest line of this letter, letter first; empty: none.
    std::vector<std::string> last(char letter) const {
        for (size_t i = lines.size(); i-- > 0;) {
            if (lines[i][0] == letter) return split(lines[i].substr(0, lines[i].size() - 5), ' ');
        }
        return {};
    }
    int count(char letter) const {
        int n = 0;
        for (const std::string &line : lines) n += line[0] == letter;
        return n;
    }

    chefbot_board *board;
    uint16_t sequence = 0;
    std::vector<std::string> lines;  // without LF
    double wheel_speed[2] = {0, 0};  // ticks/s, true
    double friction = 0.05;          // of full duty
    bool blocked[2] = {false, false}, cable_off[2] = {false, false}, reversed[2] = {false, false};
    bool imu_lives = true;

  private:
    void turn_wheels() {
        const chefbot_board_state now = state();
        for (int wheel = 0; wheel < 2; ++wheel) {
            double &speed = wheel_speed[wheel];
            const double duty = now.duty[wheel] / 1000.0;
            const double against = fabs(speed) > 1 ? copysign(friction, speed) : fabs(duty) < friction ? duty : copysign(friction, duty);
            const double before = speed;
            speed += ((duty - against) * robot_.no_load - speed) * (1 - exp(-0.01 / 0.13));
            if (before * speed < 0 && fabs(duty) < friction) speed = 0;
            if (blocked[wheel]) speed = 0;
            place_[wheel] += speed * 0.01;
            const int ticks = static_cast<int>(floor(place_[wheel])) - told_[wheel];
            told_[wheel] += ticks;
            if (!cable_off[wheel]) chefbot_board_turn(board, wheel, reversed[wheel] ? -ticks : ticks);
        }
    }
    void shake_imu() {
        noise_ = static_cast<int16_t>((noise_ * 5 + 3) % 7);
        const int16_t raw[7] = {noise_, 2, 8192, -3920, 1, noise_, static_cast<int16_t>(noise_ - 3)};
        chefbot_board_imu(board, raw);
    }
    void collect() {
        uint8_t bytes[65536];
        const uint32_t count = chefbot_board_read(board, bytes, sizeof bytes);
        for (uint32_t i = 0; i < count; ++i) {
            if (bytes[i] != '\n') {
                part_ += static_cast<char>(bytes[i]);
                continue;
            }
            lines.push_back(part_);
            part_.clear();
        }
    }

    chefbot::RobotConstants robot_;
    double place_[2] = {0, 0};
    int told_[2] = {0, 0};
    int16_t noise_ = 0;
    std::string part_;
};
