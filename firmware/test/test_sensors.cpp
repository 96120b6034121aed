// IMU and ultrasonic ranger with the emulated chips of the port.
#include "check.h"
#include "desk.h"
#include "flags.h"
#include "imu.h"
#include "sonar.h"

using namespace chefbot;

static int field(const Desk &desk, char letter, size_t at) { return std::stoi(desk.last(letter).at(at)); }

static void hold_imu(Desk *desk, int16_t gz, int steps) {
    for (int i = 0; i < steps; ++i) {
        const int16_t raw[7] = {static_cast<int16_t>(i & 1), 0, 8192, -3920, 0, 0, gz};
        chefbot_board_imu(desk->board, raw);
        chefbot_board_advance(desk->board, 10000);
    }
    desk->run(0);
}

TEST(the_imu_wakes_within_a_third_of_a_second) {
    Desk desk;
    CHECK(desk.count('i') == 0);
    desk.run(300);
    CHECK(!(desk.flags() & IMU_BAD));
    CHECK(desk.count('i') > 0);
}

TEST(inertia_is_in_si) {
    Desk desk;
    desk.imu_lives = false;
    desk.run(0);
    hold_imu(&desk, 0, 40);
    const int16_t raw[7] = {8192, -4096, 100, 340, 655, -655, 6550};
    for (int i = 0; i < 2; ++i) {
        chefbot_board_imu(desk.board, raw);
        chefbot_board_advance(desk.board, 10000);
    }
    desk.run(0);
    CHECK_EQ(field(desk, 'i', 3), 174532);   // 10 deg/s
    CHECK_EQ(field(desk, 'i', 4), -174532);
    CHECK(abs(field(desk, 'i', 5) - 1745329) <= 12);  // 100 deg/s
    CHECK(abs(field(desk, 'i', 6) - 9807) <= 1);
    CHECK(abs(field(desk, 'i', 7) + 4903) <= 1);
    CHECK_EQ(field(desk, 'i', 9), 3753);
}

TEST(the_gyro_angle_is_the_integral) {
    Desk desk;
    desk.imu_lives = false;
    hold_imu(&desk, 0, 40);
    const int before = field(desk, 'e', 5), samples = field(desk, 'e', 6);
    hold_imu(&desk, 3275, 100);  // 50 deg/s for a second
    const double turned = (field(desk, 'e', 5) - before) * 1e-8;
    CHECK(fabs(turned - 0.8726646) < 1e-5);
    CHECK_EQ(field(desk, 'e', 6) - samples, 100);
}

TEST(the_bias_is_reported_and_not_hidden) {
    Desk desk;
    desk.imu_lives = false;
    hold_imu(&desk, 20, 300);  // 0.3 deg/s
    CHECK_EQ(field(desk, 'i', 10), 5329);
    CHECK_EQ(field(desk, 'i', 5), 5329);
    const int before = field(desk, 'e', 5);
    hold_imu(&desk, 20, 100);
    CHECK_EQ(field(desk, 'e', 5) - before, 532900);
    for (int i = 0; i < 300; ++i) {  // moved by hand: no rest, no new bias
        chefbot_board_turn(desk.board, 0, 1);
        hold_imu(&desk, 400, 1);
    }
    CHECK_EQ(field(desk, 'i', 10), 5329);
}

TEST(a_driven_wheel_is_not_at_rest_even_if_it_stands) {
    for (int wheel = 0; wheel < 2; ++wheel) {
        Desk desk;
        desk.imu_lives = false;
        hold_imu(&desk, 0, 300);
        desk.open_and_neutral();
        desk.blocked[wheel] = true;
        for (int i = 0; i < 60; ++i) {  // below the duty that names a fault
            desk.speed(wheel == 0 ? 100 : 0, wheel == 1 ? 100 : 0);
            hold_imu(&desk, 40, 3);
            if (i == 20) CHECK(desk.state().duty[wheel] > 0 && desk.state().duty[1 - wheel] == 0);
        }
        CHECK(desk.state().duty[wheel] < 300);
        CHECK(abs(field(desk, 'i', 10)) < 200);
        desk.write(framed("x 0"));
        hold_imu(&desk, 40, 200);
        CHECK(field(desk, 'i', 10) > 10000);
    }
}

TEST(a_stuck_imu_is_named_within_100_ms_and_never_believed) {
    Desk desk;
    desk.run(500);
    CHECK(!(desk.flags() & IMU_BAD));
    desk.imu_lives = false;
    desk.run(110);
    CHECK(desk.flags() & IMU_BAD);
    const int lines = desk.count('i'), samples = field(desk, 'e', 6);
    desk.run(5000);
    CHECK_EQ(desk.count('i'), lines);
    CHECK_EQ(field(desk, 'e', 6), samples);
    desk.imu_lives = true;
    desk.run(1000);
    CHECK(!(desk.flags() & IMU_BAD));
}

TEST(a_dead_bus_is_named_and_found_again) {
    Desk desk;
    desk.run(500);
    chefbot_board_imu_answers(desk.board, 0);
    desk.run(20);
    CHECK(desk.flags() & IMU_BAD);
    desk.run(2000);
    chefbot_board_imu_answers(desk.board, 1);
    desk.run(1000);
    CHECK(!(desk.flags() & IMU_BAD));
}

TEST(one_missed_read_costs_one_sample) {
    Desk desk;
    desk.run(500);
    const int before = field(desk, 'e', 6);
    chefbot_board_imu_answers(desk.board, 0);
    desk.run(10);
    chefbot_board_imu_answers(desk.board, 1);
    desk.run(90);
    CHECK_EQ(field(desk, 'e', 6) - before, 9);
    CHECK(!(desk.flags() & IMU_BAD));
}

TEST(a_saturated_gyro_is_not_integrated) {
    Desk desk;
    desk.imu_lives = false;
    hold_imu(&desk, 0, 40);
    const int angle = field(desk, 'e', 5);
    hold_imu(&desk, 32767, 10);
    CHECK(desk.flags() & IMU_BAD);
    hold_imu(&desk, -32768, 10);
    CHECK_EQ(field(desk, 'e', 5), angle);
    hold_imu(&desk, 0, 3);
    CHECK(!(desk.flags() & IMU_BAD));
}

TEST(an_imu_that_fails_its_check_at_rest_is_not_used) {
    for (int fault = 0; fault < 4; ++fault) {
        Desk desk;
        desk.imu_lives = false;
        for (int i = 0; i < 600; ++i) {
            int16_t raw[7] = {static_cast<int16_t>(i & 1), 0, 8192, -3920, 0, 0, static_cast<int16_t>(i & 1)};
            if (fault == 0) raw[2] = 0;                            // no gravity
            if (fault == 1) raw[2] = 16384;                        // too much
            if (fault == 2) raw[4] = static_cast<int16_t>(500 + i);  // turns at rest
            if (fault == 3) raw[6] = static_cast<int16_t>(-500 - i);
            if (i < 60) raw[0] = raw[1] = 0;
            chefbot_board_imu(desk.board, raw);
            chefbot_board_advance(desk.board, 10000);
        }
        desk.run(0);
        CHECK(desk.flags() & IMU_BAD);
    }
}

TEST(a_chip_with_the_same_registers_is_used_and_reported) {
    for (int id : {0x68, 0x70, 0x71, 0x98, 0xEA}) {
        Desk desk;
        chefbot_board_imu_id(desk.board, id);
        desk.run(1200);
        CHECK(!(desk.flags() & IMU_BAD));
        CHECK_EQ(std::stoi(desk.last('t').at(6), nullptr, 16), id);
    }
}

TEST(an_absent_chip_is_reported_as_none) {
    Desk desk;
    chefbot_board_imu_answers(desk.board, 0);
    desk.run(1200);
    CHECK(desk.flags() & IMU_BAD);
    CHECK(desk.last('t').at(6) == "00");
}

TEST(a_chip_that_holds_the_bus_is_freed) {
    Desk desk;
    desk.run(500);
    chefbot_board_imu_holds_bus(desk.board);
    desk.run(50);
    CHECK(desk.flags() & IMU_BAD);
    desk.run(1500);
    CHECK(!(desk.flags() & IMU_BAD));
}

// ---- ultrasonic

TEST(an_echo_is_told_in_microseconds) {
    Desk desk;
    for (int us : {116, 2915, 5831, 23310, 25000}) {
        chefbot_board_echo(desk.board, us);
        desk.run(300);
        CHECK_EQ(field(desk, 'u', 3), us);
    }
    CHECK(!(desk.flags() & SONAR_BAD));
}

TEST(no_echo_and_late_echo_are_nothing) {
    Desk desk;
    chefbot_board_echo(desk.board, CHEFBOT_NO_ECHO);
    desk.run(500);
    CHECK_EQ(field(desk, 'u', 3), 0);
    chefbot_board_echo(desk.board, 25001);
    desk.run(500);
    CHECK_EQ(field(desk, 'u', 3), 0);
    CHECK(!(desk.flags() & SONAR_BAD));
}

// ---- cliff sensors

TEST(a_cliff_is_told_within_20_ms) {
    RobotConstants robot = example_robot();
    robot.cliff_sensors = 3;
    Desk desk(robot);
    desk.open();
    CHECK(desk.last('v').at(15) == "07");
    desk.run(990);
    CHECK_EQ(desk.count('d'), 50);
    CHECK(desk.last('d').at(3) == "00");
    for (int bits : {1, 2, 4, 7}) {
        chefbot_board_cliffs(desk.board, bits);
        desk.run(20);
        CHECK_EQ(field(desk, 'd', 3), bits);
    }
    chefbot_board_cliffs(desk.board, 0);
    desk.run(20);
}

TEST(a_new_cliff_stops_at_once_and_commands_go_on) {
    RobotConstants robot = example_robot();
    robot.cliff_sensors = 3;
    Desk desk(robot);
    desk.open_and_neutral();
    desk.drive(4000, 4000, 1000);
    CHECK(desk.state().set[0] > 3900);
    chefbot_board_cliffs(desk.board, 1);
    desk.run(10);
    CHECK_EQ(desk.state().set[0], 0);
    CHECK_EQ(desk.state().duty[0], 0);
    desk.drive(-2000, -2000, 1000);  // away from it, while it still sees no floor
    CHECK(desk.state().set[0] < -1900);
    chefbot_board_cliffs(desk.board, 3);
    desk.run(10);
    CHECK_EQ(desk.state().set[0], 0);
    desk.drive(-2000, -2000, 500);
    chefbot_board_cliffs(desk.board, 2);
    desk.run(10);
    CHECK(desk.state().set[0] < -1900);
}

TEST(inputs_without_a_sensor_are_no_cliffs) {
    RobotConstants robot = example_robot();
    robot.cliff_sensors = 3;
    Desk desk(robot);
    chefbot_board_cliffs(desk.board, 0xF8);
    desk.run(100);
    CHECK(desk.last('d').at(3) == "00");
    robot.cliff_sensors = 4;
    Desk four(robot);
    chefbot_board_cliffs(four.board, 0x18);
    four.run(100);
    CHECK(four.last('d').at(3) == "08");
    Desk none;
    chefbot_board_cliffs(none.board, 0xF);
    none.run(100);
    CHECK_EQ(none.count('d'), 0);
}

TEST(an_absent_ultrasonic_is_named_and_delays_nothing) {
    Desk desk;
    chefbot_board_echo(desk.board, CHEFBOT_NO_SENSOR);
    desk.run(500);
    CHECK_EQ(field(desk, 'u', 3), -1);
    CHECK(desk.flags() & SONAR_BAD);
    CHECK_EQ(desk.count('e'), 25);
    chefbot_board_echo(desk.board, 1000);
    desk.run(300);
    CHECK(!(desk.flags() & SONAR_BAD));
}

TEST(edges_nobody_asked_for_mean_nothing) {
    Sonar sonar;
    sonar.start(10);
    sonar.edge(true, 5);
    sonar.edge(false, 500);
    for (int i = 0; i < 9; ++i) CHECK(!sonar.step());
    CHECK(!sonar.take_result());
    CHECK(sonar.step());
    sonar.edge(false, 10);  // falls before it rose
    sonar.edge(true, 65000);
    sonar.edge(true, 65100);
    sonar.edge(false, 1000);  // the microseconds wrapped
    sonar.edge(false, 3000);
    for (int i = 0; i < 3; ++i) sonar.step();
    CHECK(sonar.take_result());
    CHECK(!sonar.take_result());
    CHECK_EQ(sonar.echo_us(), 1536);
}

TEST(a_line_that_never_falls_is_no_sensor) {
    Sonar sonar;
    sonar.start(10);
    while (!sonar.step()) {}
    sonar.edge(true, 0);
    while (!sonar.step()) {}
    CHECK(sonar.take_result());
    CHECK_EQ(sonar.echo_us(), Sonar::NOTHING);
    while (!sonar.step()) {}
    CHECK_EQ(sonar.echo_us(), Sonar::NO_SENSOR);
    CHECK(sonar.bad());
}
