// The lines of the board and their times.
#include "check.h"
#include "desk.h"
#include "flags.h"

using namespace chefbot;

enum { WAITING, READY, DRIVING, STOPPED };

static int field(const Desk &desk, char letter, size_t at) { return std::stoi(desk.last(letter).at(at)); }
static const size_t REFUSED = 10, REASON = 11;

TEST(every_line_has_its_rate_and_its_crc) {
    Desk desk;
    chefbot_board_echo(desk.board, 5000);
    desk.run(10000);
    CHECK_EQ(desk.count('e'), 500);
    CHECK(desk.count('i') >= 480 && desk.count('i') <= 500);
    CHECK_EQ(desk.count('s'), 100);
    CHECK(desk.count('u') >= 98 && desk.count('u') <= 100);
    CHECK_EQ(desk.count('b'), 20);
    CHECK_EQ(desk.count('t'), 10);
    CHECK_EQ(field(desk, 'i', 2) % 20000, 10000);  // not together with `e`
    for (size_t i = 0; i < desk.lines.size(); ++i) {
        const std::string &line = desk.lines[i];
        CHECK(framed(line.substr(0, line.size() - 5)) == line + "\n");
        CHECK_EQ(std::stoul(split(line, ' ')[1]), i);
    }
}

TEST(motion_tells_ticks_of_one_moment) {
    Desk desk;
    desk.run(20);
    chefbot_board_turn(desk.board, 0, 1234);
    chefbot_board_turn(desk.board, 1, -567);
    desk.run(20);
    CHECK_EQ(field(desk, 'e', 2), 40000);
    CHECK_EQ(field(desk, 'e', 3), 1234);
    CHECK_EQ(field(desk, 'e', 4), -567);
    CHECK_EQ(desk.state().ticks[1], static_cast<uint32_t>(-567));
    chefbot_board_encoder_lines(desk.board, 0, 3);
    chefbot_board_encoder_lines(desk.board, 0, 0);
    desk.run(100);
    CHECK(field(desk, 's', 12) > 0);
    CHECK_EQ(field(desk, 's', 13), 0);
}

TEST(status_tells_what_is_really_done) {
    Desk desk;
    desk.open_and_neutral();
    desk.drive(5000, 2500, 1500);
    CHECK_EQ(field(desk, 's', 3), DRIVING);
    CHECK(desk.last('s').at(4) == "0000");
    CHECK(field(desk, 's', 5) > desk.sequence - 3 && field(desk, 's', 5) <= desk.sequence);
    CHECK_EQ(field(desk, 's', 6), 5000);
    CHECK_EQ(field(desk, 's', 7), 2500);
    CHECK(abs(field(desk, 's', 8) - desk.state().duty[0]) < 20);
    CHECK(abs(field(desk, 's', 9) - desk.state().duty[1]) < 20);
    desk.write("x\ny\n");
    desk.drive(5000, 2500, 200);
    CHECK_EQ(field(desk, 's', REFUSED), 2);
    CHECK_EQ(field(desk, 's', REASON), 2);
}

TEST(battery_and_time) {
    Desk desk;
    chefbot_board_battery(desk.board, 12345);
    desk.run(9000);
    CHECK(field(desk, 'b', 3) >= 12340 && field(desk, 'b', 3) <= 12345);
    CHECK_EQ(field(desk, 't', 3), 8);
    CHECK_EQ(field(desk, 't', 4), 0);
    CHECK_EQ(field(desk, 't', 5), 0);
}

TEST(lines_without_room_are_dropped_and_counted) {
    Desk desk;
    for (int i = 0; i < 4000; ++i) chefbot_board_advance(desk.board, 10000);  // nobody reads
    desk.run(10);
    desk.lines.clear();
    desk.run(1000);
    CHECK(field(desk, 't', 4) > 100);
    CHECK(std::stoul(desk.last('e').at(1)) > desk.lines.size());
}

TEST(board_time_wraps_without_a_glitch) {
    Desk desk;
    desk.imu_lives = false;
    chefbot_board_imu_answers(desk.board, 0);
    const uint64_t wrap = 1ull << 32;
    for (uint64_t t = 0; t < wrap - 2000000; t += 1000000) {
        uint8_t bytes[65536];
        chefbot_board_advance(desk.board, 1000000);
        chefbot_board_read(desk.board, bytes, sizeof bytes);
    }
    desk.imu_lives = true;
    chefbot_board_imu_answers(desk.board, 1);
    desk.open_and_neutral();
    desk.drive(5000, 5000, 500);
    for (int i = 0; i < 60; ++i) {
        desk.drive(5000, 5000, 50);
        CHECK_EQ(desk.state().state, DRIVING);
    }
    CHECK(field(desk, 'e', 2) < 10000000);
    CHECK(desk.state().time_us > wrap);
    desk.run(200);
    CHECK_EQ(desk.state().duty[0], 0);
}

TEST(bad_constants_make_no_board) {
    int32_t values[ROBOT_CONSTANTS] = {0};
    CHECK(chefbot_board_create(values, ROBOT_CONSTANTS) == nullptr);
    CHECK(chefbot_board_create(values, 3) == nullptr);
}
