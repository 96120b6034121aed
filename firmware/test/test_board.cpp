// The whole board, through its serial link.
#include "check.h"
#include "desk.h"
#include "flags.h"

using namespace chefbot;

enum { WAITING, READY, DRIVING, STOPPED };

static int reason(const Desk &desk) { return desk.state().refusal; }

// ---- before the handshake

TEST(motors_stay_off_without_a_handshake) {
    Desk desk;
    CHECK_EQ(desk.state().drivers, 0);
    desk.run(50);
    CHECK_EQ(desk.state().state, WAITING);
    for (int i = 0; i < 40; ++i) {
        desk.speed(2000, 2000);
        desk.run(20);
        CHECK_EQ(desk.state().duty[0], 0);
        CHECK_EQ(desk.state().drivers, 0);
    }
    CHECK_EQ(reason(desk), 3);
    CHECK(desk.flags() & NO_SESSION);
    CHECK(desk.flags() & NO_COMMAND);
    CHECK(desk.flags() & NEUTRAL_FIRST);
}

TEST(the_handshake_tells_who_is_there) {
    Desk desk;
    desk.run(100);
    desk.write(framed("v 4711 1"));
    desk.run(10);
    const std::vector<std::string> v = desk.last('v');
    const char *expected[] = {"4711", "chefbot", "1", "host", "12345678", "8400000", "100", "1000", "10000", "9600", "8000", "12800"};
    for (size_t i = 0; i < 12; ++i) CHECK(v.at(2 + i) == expected[i]);
    CHECK(v.at(14) == std::to_string(0x1000 + 10));
    CHECK(v.at(15) == "03");
    CHECK_EQ(desk.state().state, READY);
    CHECK(!(desk.flags() & NO_SESSION));
    CHECK_EQ(desk.state().refused, 0u);
}

TEST(without_ultrasonic_the_board_says_so) {
    RobotConstants robot = example_robot();
    robot.sonar_period = 0;
    Desk desk(robot);
    desk.open();
    desk.run(1000);
    CHECK(desk.last('v').at(15) == "01");
    CHECK_EQ(desk.count('u'), 0);
    CHECK(!(desk.flags() & SONAR_BAD));
}

TEST(another_protocol_gets_an_answer_and_no_session) {
    Desk desk;
    desk.write(framed("v 5 2"));
    desk.run(10);
    CHECK(desk.last('v').at(2) == "5");
    CHECK_EQ(desk.state().state, WAITING);
    CHECK_EQ(reason(desk), 5);
}

TEST(after_a_handshake_zero_comes_first) {
    Desk desk;
    desk.open();
    desk.drive(2000, 2000, 200);
    CHECK_EQ(desk.state().duty[0], 0);
    CHECK_EQ(desk.state().state, READY);
    CHECK_EQ(reason(desk), 7);
    desk.speed(0, 1);
    desk.run(10);
    CHECK_EQ(desk.state().state, READY);
    desk.speed(1, 0);
    desk.run(10);
    CHECK_EQ(desk.state().state, READY);
    desk.speed(0, 0);
    desk.run(10);
    CHECK_EQ(desk.state().state, DRIVING);
    CHECK_EQ(desk.flags() & ~(IMU_BAD), 0u);
    CHECK_EQ(desk.state().drivers, 1);
    desk.drive(2000, 2000, 200);
    CHECK(desk.state().duty[0] > 0);
}

// ---- driving

TEST(the_robot_reaches_the_speed_and_holds_it) {
    Desk desk;
    desk.open_and_neutral();
    desk.drive(6000, -2000, 200);
    CHECK(desk.state().set[0] > 2300 && desk.state().set[0] <= 2600);
    CHECK(desk.state().set[1] < -750 && desk.state().set[1] >= -900);
    desk.drive(6000, -2000, 1800);
    CHECK_EQ(desk.state().set[0], 6000);
    CHECK_EQ(desk.state().set[1], -2000);
    CHECK(fabs(desk.wheel_speed[0] - 6000) < 120);
    CHECK(fabs(desk.wheel_speed[1] + 2000) < 60);
    CHECK_EQ(desk.state().state, DRIVING);
    desk.drive(0, 0, 1200);
    CHECK(fabs(desk.wheel_speed[0]) < 30);
}

TEST(no_overshoot_above_five_percent) {
    for (int top : {2000, 5000, 9500}) {
        Desk desk;
        desk.open_and_neutral();
        double most = 0;
        for (int i = 0; i < 60; ++i) {
            desk.drive(top, top, 50);
            most = fmax(most, desk.wheel_speed[0]);
        }
        CHECK(most < 1.05 * top);
        CHECK(most > 0.98 * top);
    }
}

TEST(speeds_beyond_the_limit_are_limited_and_named) {
    Desk desk;
    desk.open_and_neutral();
    desk.drive(999999999, 999999999, 2000);
    CHECK_EQ(desk.state().set[0], 9600);
    CHECK(desk.flags() & LIMITED);
    CHECK(desk.wheel_speed[0] < 1.05 * 9600);
    desk.drive(5000, 5000, 50);
    CHECK(!(desk.flags() & LIMITED));
    desk.drive(20000, 20000, 50);
    CHECK(desk.flags() & LIMITED);
    desk.run(500);
    CHECK(!(desk.flags() & LIMITED));
}

TEST(a_silent_computer_stops_the_motors_in_150_ms) {
    for (int offset = 0; offset < 10; ++offset) {
        Desk desk;
        desk.open_and_neutral();
        desk.drive(8000, 8000, 1500);
        chefbot_board_advance(desk.board, static_cast<uint32_t>(offset) * 1000);
        desk.speed(8000, 8000);
        chefbot_board_advance(desk.board, 139999 - 9000);
        CHECK(desk.state().duty[0] > 0 && desk.state().duty[1] > 0);
        chefbot_board_advance(desk.board, 150000 - 130999);
        CHECK_EQ(desk.state().duty[0], 0);
        CHECK_EQ(desk.state().duty[1], 0);
        CHECK_EQ(desk.state().state, READY);
        CHECK(desk.flags() & NO_COMMAND);
        CHECK_EQ(desk.state().drivers, 1);  // brakes
        CHECK_EQ(desk.state().set[0], 0);
    }
}

TEST(the_watchdog_counts_from_the_command_to_the_step) {
    Desk desk;
    desk.open_and_neutral();
    desk.drive(8000, 8000, 1000);
    desk.speed(8000, 8000);  // at a step: counted from it
    for (int i = 1; i < 15; ++i) {
        desk.run(10);
        CHECK(desk.state().duty[0] > 0);
    }
    desk.run(10);
    CHECK_EQ(desk.state().duty[0], 0);
}

TEST(brakes_then_lets_go) {
    Desk desk;
    desk.open_and_neutral();
    desk.drive(3000, 3000, 500);
    desk.run(100);
    for (int i = 0; i < 99; ++i) {
        CHECK_EQ(desk.state().drivers, 1);
        CHECK_EQ(desk.state().duty[0], 0);
        desk.run(10);
    }
    CHECK_EQ(desk.state().drivers, 0);
}

TEST(holds_as_long_as_it_rests) {
    RobotConstants robot = example_robot();
    robot.hold = 1;
    Desk desk(robot);
    CHECK_EQ(desk.state().drivers, 0);
    desk.open_and_neutral();
    desk.drive(3000, 3000, 500);
    desk.run(5000);
    CHECK_EQ(desk.state().drivers, 1);
    CHECK_EQ(desk.state().duty[0], 0);
}

TEST(a_heartbeat_keeps_the_session_but_not_the_motors) {
    Desk desk;
    desk.open_and_neutral();
    desk.drive(3000, 3000, 500);
    for (int i = 0; i < 60; ++i) {
        desk.say('h');
        desk.run(50);
    }
    CHECK_EQ(desk.state().duty[0], 0);
    CHECK_EQ(desk.state().state, READY);
    desk.drive(3000, 3000, 100);  // resumes: same session
    CHECK(desk.state().duty[0] > 0);
    desk.run(940);
    CHECK_EQ(desk.state().state, READY);
    desk.run(20);
    CHECK_EQ(desk.state().state, WAITING);
    desk.drive(3000, 3000, 100);
    CHECK_EQ(desk.state().duty[0], 0);
    CHECK_EQ(reason(desk), 3);
}

TEST(a_second_handshake_stops_and_starts_anew) {
    Desk desk;
    desk.open_and_neutral();
    desk.drive(3000, 3000, 500);
    const uint16_t old = desk.sequence;
    desk.open();
    CHECK_EQ(desk.state().duty[0], 0);
    CHECK(desk.sequence != old);
    desk.speed(3000, 3000);
    desk.run(10);
    CHECK_EQ(reason(desk), 7);
    desk.sequence = old;
    desk.speed(0, 0);
    desk.run(10);
    CHECK_EQ(reason(desk), 3);
}

TEST(old_repeated_and_far_lines_are_refused) {
    Desk desk;
    desk.open_and_neutral();
    const std::string line = framed("s " + std::to_string(desk.sequence + 1) + " 2000 2000");
    desk.write(line);
    desk.run(10);
    CHECK_EQ(desk.state().refused, 0u);
    desk.write(line);
    desk.run(10);
    CHECK_EQ(desk.state().refused, 1u);
    CHECK_EQ(reason(desk), 3);
    for (const char *bad : {"s -1 0 0", "s 65536 0 0", "s 999999999 0 0"}) {
        desk.write(framed(bad));
        desk.run(10);
        CHECK_EQ(reason(desk), 3);
    }
    desk.sequence = static_cast<uint16_t>(desk.sequence + 258);
    desk.speed(0, 0);
    desk.run(10);
    CHECK_EQ(desk.state().refused, 5u);
}

TEST(sequence_is_read_whole) {
    Desk desk;
    desk.open_and_neutral();
    desk.write(framed("s " + std::to_string(desk.sequence + 1 + 65536) + " 0 0"));
    desk.write(framed("s " + std::to_string(desk.sequence + 1 - 65536) + " 0 0"));
    desk.run(10);
    CHECK_EQ(desk.state().refused, 2u);
    for (int i = 0; i < 260; ++i) {  // up to and over the end of 16 bits
        desk.sequence = static_cast<uint16_t>(desk.sequence + 250);
        desk.speed(0, 0);
        desk.run(10);
    }
    CHECK_EQ(desk.state().refused, 2u);
    desk.sequence = static_cast<uint16_t>(65535 - 2);
    Desk top;
    top.open_and_neutral();
    while (top.sequence < 65535) {
        top.sequence = static_cast<uint16_t>(top.sequence + 200 < 65535 ? top.sequence + 200 : 65534);
        top.speed(0, 0);
        top.run(10);
    }
    CHECK_EQ(top.state().refused, 0u);
    top.write(framed("s 65536 0 0"));
    top.run(10);
    CHECK_EQ(top.state().refused, 1u);
    top.speed(0, 0);  // sequence 0
    top.run(10);
    CHECK_EQ(top.state().refused, 1u);
}

TEST(what_was_learnt_before_a_stop_is_forgotten) {
    Desk desk;
    desk.friction = 0.25;
    int first[2];
    desk.open_and_neutral();
    desk.speed(4000, -4000);
    desk.run(20);
    for (int wheel = 0; wheel < 2; ++wheel) first[wheel] = desk.state().duty[wheel];
    desk.drive(4000, -4000, 2000);
    desk.blocked[0] = desk.blocked[1] = true;
    desk.run(500);
    desk.blocked[0] = desk.blocked[1] = false;
    desk.speed(4000, -4000);
    desk.run(20);
    for (int wheel = 0; wheel < 2; ++wheel) CHECK(abs(desk.state().duty[wheel] - first[wheel]) <= 2);
}

TEST(unknown_letters_and_counts_are_refused) {
    Desk desk;
    desk.open_and_neutral();
    unsigned n = 0;
    for (const char *text : {"z 1", "q", "s 1 2", "s 1", "h 1 2", "c 1 2", "r 1 2", "x 1 2", "x", "v 1", "v 1 1 1", "S 1 0 0", "g 1", "i 1"}) {
        desk.write(framed(text));
        chefbot_board_advance(desk.board, 5000);
        CHECK_EQ(desk.state().refused, ++n);
        CHECK_EQ(reason(desk), 4);
    }
    CHECK_EQ(desk.state().state, DRIVING);
    desk.write("garbage\n");
    desk.run(10);
    CHECK_EQ(reason(desk), 1);
    desk.write("a\n");
    desk.run(10);
    CHECK_EQ(reason(desk), 2);
}
