// Causes of a stop, and the commands after which the board drives again.
#include "check.h"
#include "desk.h"
#include "flags.h"

using namespace chefbot;

enum { WAITING, READY, DRIVING, STOPPED };

static int reason(const Desk &desk) { return desk.state().refusal; }

TEST(the_estop_pin_stops_at_the_next_step_and_latches) {
    Desk desk;
    desk.open_and_neutral();
    desk.drive(5000, 5000, 1000);
    chefbot_board_estop(desk.board, 1);
    desk.run(10);
    CHECK_EQ(desk.state().duty[0], 0);
    CHECK_EQ(desk.state().state, STOPPED);
    CHECK(desk.flags() & ESTOP_INPUT);
    desk.say('c');
    desk.run(10);
    CHECK_EQ(reason(desk), 8);
    chefbot_board_estop(desk.board, 0);
    for (int i = 0; i < 20; ++i) {
        desk.drive(5000, 5000, 50);
        CHECK_EQ(desk.state().duty[0], 0);
    }
    CHECK_EQ(reason(desk), 6);
    desk.say('c');
    desk.run(10);
    CHECK_EQ(desk.state().state, READY);
    desk.drive(5000, 5000, 300);  // the old speed is not a new command
    CHECK_EQ(desk.state().duty[0], 0);
    CHECK_EQ(reason(desk), 7);
    desk.speed(0, 0);
    desk.run(10);
    desk.drive(5000, 5000, 300);
    CHECK(desk.state().duty[0] > 0);
}

TEST(a_drivers_fault_switches_the_drivers_off_and_can_be_cleared) {
    for (int hold : {0, 1}) {
        RobotConstants robot = example_robot();
        robot.enable_diag = 1;
        robot.hold = hold;
        Desk desk(robot);
        chefbot_board_driver_fault(desk.board, 1);
        desk.run(50);
        CHECK_EQ(desk.flags() & LATCHED, 0u);  // the drivers are off: their line is low by the board itself
        chefbot_board_driver_fault(desk.board, 0);
        desk.open_and_neutral();
        desk.drive(5000, 5000, 1000);
        chefbot_board_driver_fault(desk.board, 1);
        desk.run(20);
        CHECK_EQ(desk.flags() & LATCHED, static_cast<unsigned>(DRIVER_FAULT));
        CHECK_EQ(desk.state().drivers, 0);
        CHECK_EQ(desk.state().duty[0], 0);
        for (bool persists : {true, false}) {
            chefbot_board_driver_fault(desk.board, persists);
            desk.say('c');
            desk.run(10);
            CHECK_EQ(desk.state().state, READY);
            desk.speed(0, 0);
            desk.run(10);
            desk.drive(5000, 5000, 300);
            CHECK_EQ(desk.state().state, persists ? STOPPED : DRIVING);
            CHECK_EQ(desk.state().drivers, !persists);
        }
    }
}

TEST(without_en_diag_the_line_is_not_read) {
    Desk desk;
    desk.open_and_neutral();
    chefbot_board_driver_fault(desk.board, 1);
    desk.drive(5000, 5000, 500);
    CHECK_EQ(desk.state().state, DRIVING);
}

TEST(the_estop_command_needs_nothing) {
    Desk desk;
    desk.write(framed("x 0"));
    desk.run(10);
    CHECK_EQ(desk.state().state, STOPPED);
    CHECK(desk.flags() & ESTOP_COMMAND);
    desk.open();  // a new computer does not lift it
    CHECK_EQ(desk.state().state, STOPPED);
    desk.say('c');
    desk.run(10);
    CHECK_EQ(desk.state().state, READY);
    CHECK(desk.flags() & NEUTRAL_FIRST);
}

TEST(the_estop_command_stops_a_drive) {
    Desk desk;
    desk.open_and_neutral();
    desk.drive(5000, 5000, 1000);
    desk.write(framed("x 99"));
    desk.run(10);
    CHECK_EQ(desk.state().duty[0], 0);
    CHECK_EQ(desk.state().refused, 0u);
}

TEST(a_clear_without_fault_asks_for_neutral_too) {
    Desk desk;
    desk.open_and_neutral();
    desk.drive(5000, 5000, 1000);
    desk.say('c');
    desk.run(10);
    CHECK(desk.flags() & NEUTRAL_FIRST);
    desk.drive(5000, 5000, 1000);
    CHECK_EQ(desk.state().set[0], 0);
    CHECK(fabs(desk.wheel_speed[0]) < 100);
}

TEST(a_blocked_wheel_stops_both_within_300_ms_of_full_effort) {
    for (int wheel = 0; wheel < 2; ++wheel) {
        Desk desk;
        desk.open_and_neutral();
        desk.drive(9000, 9000, 1500);
        desk.blocked[wheel] = true;
        int ms = 0;
        while (desk.state().state == DRIVING && ms < 1000) {
            if (ms % 50 == 0) desk.speed(9000, 9000);
            desk.run(10);
            ms += 10;
        }
        CHECK(ms <= 300);
        CHECK_EQ(desk.state().duty[1 - wheel], 0);
        CHECK_EQ(desk.flags() & LATCHED, static_cast<unsigned>(wheel == 0 ? ENCODER_LEFT : ENCODER_RIGHT));
    }
}

TEST(a_wheel_that_creeps_at_full_effort_is_a_stall) {
    Desk desk;
    desk.open_and_neutral();
    desk.drive(5000, 5000, 1000);
    desk.blocked[1] = true;
    for (int i = 0; i < 60; ++i) {
        if (i % 5 == 0) desk.speed(5000, 5000);
        chefbot_board_turn(desk.board, 1, 1 + i % 2);
        desk.run(10);
    }
    CHECK_EQ(desk.flags() & LATCHED, static_cast<unsigned>(STALL_RIGHT));
}

TEST(a_dead_or_reversed_encoder_stops) {
    for (int wheel = 0; wheel < 2; ++wheel) {
        for (bool reversed : {false, true}) {
            Desk desk;
            desk.open_and_neutral();
            if (reversed) desk.reversed[wheel] = true;
            else desk.drive(9000, 9000, 1500);
            desk.cable_off[wheel] = !reversed;
            int ms = 0;
            while (desk.state().state == DRIVING && ms < 1000) {
                if (ms % 50 == 0) desk.speed(9000, 9000);
                desk.run(10);
                ms += 10;
            }
            CHECK(ms <= 350);
            CHECK_EQ(desk.flags() & LATCHED, static_cast<unsigned>(wheel == 0 ? ENCODER_LEFT : ENCODER_RIGHT));
        }
    }
}

TEST(an_empty_battery_stops_softly) {
    Desk desk;
    desk.open_and_neutral();
    desk.drive(5000, 5000, 1000);
    chefbot_board_battery(desk.board, 10000);
    int slowest_change = 0, last = 5000;
    for (int i = 0; i < 100; ++i) {
        desk.drive(5000, 5000, 50);
        const int set = desk.state().set[0];
        slowest_change = last - set > slowest_change ? last - set : slowest_change;
        last = set;
    }
    CHECK_EQ(desk.state().state, STOPPED);
    CHECK_EQ(desk.flags() & LATCHED, static_cast<unsigned>(BATTERY_EMPTY));
    CHECK_EQ(last, 0);
    CHECK(slowest_change <= 5 * 256);
    CHECK_EQ(reason(desk), 6);
    CHECK(fabs(desk.wheel_speed[0]) < 30);
    desk.say('c');
    desk.run(10);
    CHECK_EQ(reason(desk), 8);
}

TEST(an_empty_battery_and_a_silent_computer_stop_at_once) {
    Desk desk;
    desk.open_and_neutral();
    chefbot_board_battery(desk.board, 10000);
    desk.drive(9000, 9000, 1000);
    while (!(desk.flags() & BATTERY_EMPTY)) desk.drive(9000, 9000, 50);
    CHECK(desk.state().duty[0] != 0);
    desk.run(200);
    CHECK_EQ(desk.state().duty[0], 0);
    desk.drive(9000, 9000, 200);
    CHECK_EQ(desk.state().set[0], 0);
    CHECK_EQ(desk.state().duty[0], 0);
}

TEST(a_hanging_main_loop_is_restarted_with_motors_off) {
    Desk desk;
    desk.open_and_neutral();
    desk.drive(5000, 5000, 1000);
    chefbot_board_hang(desk.board);
    chefbot_board_advance(desk.board, 40000);
    CHECK_EQ(desk.state().restarts, 0u);
    chefbot_board_advance(desk.board, 10000);
    CHECK_EQ(desk.state().restarts, 1u);
    CHECK_EQ(desk.state().duty[0], 0);
    CHECK_EQ(desk.state().drivers, 0);
    desk.run(30);
    CHECK_EQ(desk.state().state, WAITING);
    CHECK(desk.flags() & WATCHDOG_RESET);
    desk.open();
    desk.say('c');
    desk.run(10);
    CHECK(!(desk.flags() & WATCHDOG_RESET));
}

TEST(restart_by_command) {
    Desk desk;
    desk.open_and_neutral();
    desk.drive(5000, 5000, 1000);
    desk.say('r');
    chefbot_board_advance(desk.board, 1);
    CHECK_EQ(desk.state().duty[0], 0);
    CHECK_EQ(desk.state().drivers, 0);
    CHECK_EQ(chefbot_board_restarted_driving(desk.board), 0);
    desk.run(10);
    CHECK_EQ(desk.state().restarts, 1u);
    CHECK_EQ(desk.state().state, WAITING);
    CHECK(!(desk.flags() & WATCHDOG_RESET));
    CHECK_EQ(desk.state().ticks[0] < 100u, true);
}

TEST(power_cycle_keeps_nothing) {
    Desk desk;
    desk.open_and_neutral();
    desk.drive(5000, 5000, 1000);
    chefbot_board_power_cycle(desk.board);
    CHECK_EQ(desk.state().drivers, 0);
    desk.drive(5000, 5000, 300);
    CHECK_EQ(desk.state().duty[0], 0);
    CHECK_EQ(desk.state().state, WAITING);
}

