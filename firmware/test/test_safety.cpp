// The faults, one by one, at their exact times.
#include "check.h"
#include "desk.h"
#include "safety.h"

using namespace chefbot;

static const RobotConstants ROBOT = example_robot();
static const int16_t NO_LOAD = 11200;
static const int16_t SLOW = 11200 / 16;

// Steps until `watch` reports a fault, at most 300.
static int steps_to(WheelWatch::Fault fault, int16_t duty, int16_t speed) {
    WheelWatch watch;
    for (int step = 1; step <= 300; ++step) {
        const WheelWatch::Fault now = watch.update(duty, speed, NO_LOAD);
        if (now == fault) return step;
        CHECK(now == WheelWatch::NONE);
    }
    return 0;
}

TEST(stall_is_named_after_a_quarter_second) {
    CHECK_EQ(steps_to(WheelWatch::STALL, 600, 20), 25);
    CHECK_EQ(steps_to(WheelWatch::STALL, -600, -20), 25);
    CHECK_EQ(steps_to(WheelWatch::STALL, 1000, SLOW - 1), 25);
    CHECK_EQ(steps_to(WheelWatch::STALL, 1000, SLOW), 0);
    CHECK_EQ(steps_to(WheelWatch::STALL, 599, 20), 0);
}

TEST(a_silent_encoder_is_named_after_a_fifth) {
    CHECK_EQ(steps_to(WheelWatch::ENCODER, 300, 0), 20);
    CHECK_EQ(steps_to(WheelWatch::ENCODER, -300, 0), 20);
    CHECK_EQ(steps_to(WheelWatch::ENCODER, 1000, 0), 20);
    CHECK_EQ(steps_to(WheelWatch::ENCODER, 299, 0), 0);
    CHECK_EQ(steps_to(WheelWatch::ENCODER, 300, 20), 0);
}

TEST(a_reversed_encoder_is_named_after_a_tenth) {
    CHECK_EQ(steps_to(WheelWatch::ENCODER, 300, -SLOW), 10);
    CHECK_EQ(steps_to(WheelWatch::ENCODER, -300, SLOW), 10);
    CHECK_EQ(steps_to(WheelWatch::ENCODER, 300, -SLOW + 1), 0);
    CHECK_EQ(steps_to(WheelWatch::ENCODER, 299, -5000), 0);
    CHECK_EQ(steps_to(WheelWatch::ENCODER, 900, 5000), 0);
    CHECK_EQ(steps_to(WheelWatch::ENCODER, -900, -5000), 0);
}

TEST(a_wheel_that_brakes_is_no_fault) {
    for (int sign : {1, -1}) {
        WheelWatch watch;
        CHECK(watch.update(static_cast<int16_t>(sign * 300), static_cast<int16_t>(sign * 5000), NO_LOAD) ==
              WheelWatch::NONE);
        for (int pace = 4999; pace >= SLOW; pace -= 20) {
            CHECK(watch.update(static_cast<int16_t>(-sign * 900), static_cast<int16_t>(sign * pace), NO_LOAD) ==
                  WheelWatch::NONE);
        }
    }
}

TEST(a_wheel_that_runs_away_from_its_motor_is_a_fault) {
    WheelWatch watch;
    CHECK(watch.update(300, 3000, NO_LOAD) == WheelWatch::NONE);
    for (int i = 1; i <= 12; ++i) CHECK(watch.update(900, -3000, NO_LOAD) == WheelWatch::NONE);
    for (int i = 1; i <= 12; ++i) CHECK((watch.update(900, -3001, NO_LOAD) == WheelWatch::ENCODER) == (i >= 10));
}

TEST(a_moment_of_motion_starts_the_count_anew) {
    WheelWatch watch;
    for (int round = 0; round < 10; ++round) {
        for (int i = 0; i < 24; ++i) CHECK(watch.update(800, 20, NO_LOAD) == WheelWatch::NONE);
        CHECK(watch.update(800, 5000, NO_LOAD) == WheelWatch::NONE);
        for (int i = 0; i < 19; ++i) CHECK(watch.update(400, 0, NO_LOAD) == WheelWatch::NONE);
        CHECK(watch.update(400, 60, NO_LOAD) == WheelWatch::NONE);
        for (int i = 0; i < 9; ++i) CHECK(watch.update(400, -5000, NO_LOAD) == WheelWatch::NONE);
        CHECK(watch.update(0, -5000, NO_LOAD) == WheelWatch::NONE);
    }
}

TEST(a_fault_goes_on_being_named) {
    WheelWatch watch;
    for (int i = 0; i < 1000; ++i) {
        CHECK((watch.update(800, 20, NO_LOAD) == WheelWatch::STALL) == (i >= 24));
    }
}

static SafetyInputs quiet() {
    const SafetyInputs in = {false, false, 12000, {0, 0}, {0, 0}};
    return in;
}

TEST(a_drivers_fault_needs_two_steps_and_can_be_cleared) {
    Safety safety;
    safety.start(ROBOT);
    SafetyInputs in = quiet();
    for (int round = 0; round < 5; ++round) {
        in.driver_fault = true;
        safety.update(in);
        CHECK(!safety.latched() && !safety.driver_fault());
        in.driver_fault = false;
        safety.update(in);
    }
    in.driver_fault = true;
    safety.update(in);
    safety.update(in);
    CHECK_EQ(safety.flags(), DRIVER_FAULT);
    CHECK(safety.latched() && safety.at_once() && safety.driver_fault());
    safety.update(quiet());
    CHECK(safety.driver_fault());
    CHECK(safety.clear());  // the line cannot be seen while the drivers are off
    CHECK_EQ(safety.flags(), 0);
}

TEST(each_wheel_has_its_own_flag) {
    for (int wheel = 0; wheel < 2; ++wheel) {
        Safety stall, silent;
        stall.start(ROBOT);
        silent.start(ROBOT);
        SafetyInputs in = quiet();
        in.duty[wheel] = 800;
        for (int i = 0; i < 25; ++i) silent.update(in);
        in.speed[wheel] = 40;
        for (int i = 0; i < 25; ++i) stall.update(in);
        CHECK_EQ(stall.flags(), wheel == 0 ? STALL_LEFT : STALL_RIGHT);
        CHECK_EQ(silent.flags(), wheel == 0 ? ENCODER_LEFT : ENCODER_RIGHT);
        CHECK(stall.latched() && stall.at_once() && silent.at_once());
        stall.update(quiet());
        CHECK(stall.latched());
        CHECK(stall.clear());
        CHECK_EQ(stall.flags(), 0);
    }
}

TEST(the_estop_input_latches_at_once_and_stays) {
    Safety safety;
    safety.start(ROBOT);
    safety.update(quiet());
    CHECK(!safety.latched());
    SafetyInputs in = quiet();
    in.estop = true;
    safety.update(in);
    CHECK_EQ(safety.flags(), ESTOP_INPUT);
    CHECK(!safety.clear());
    CHECK_EQ(safety.flags(), ESTOP_INPUT);
    safety.update(quiet());
    CHECK_EQ(safety.flags(), ESTOP_INPUT);
    CHECK(safety.clear());
    CHECK(!safety.latched() && !safety.at_once());
}

TEST(the_estop_command_latches) {
    Safety safety;
    safety.start(ROBOT);
    safety.estop();
    CHECK_EQ(safety.flags(), ESTOP_COMMAND);
    CHECK(safety.at_once());
    for (int i = 0; i < 1000; ++i) safety.update(quiet());
    CHECK(safety.latched());
    CHECK(safety.clear());
    safety.start(ROBOT);
    safety.estop();
    safety.start(ROBOT);
    CHECK(!safety.latched());
}

// First step at which the flag is set, at most 3000.
static int steps_to_flag(Safety *safety, uint16_t mv, Flags flag, bool up) {
    SafetyInputs in = quiet();
    in.battery_mv = mv;
    for (int step = 1; step <= 3000; ++step) {
        safety->update(in);
        if (((safety->flags() & flag) != 0) == up) return step;
    }
    return 0;
}

TEST(an_empty_battery_needs_two_seconds) {
    Safety safety;
    safety.start(ROBOT);
    CHECK_EQ(steps_to_flag(&safety, 10999, BATTERY_EMPTY, true), 200);
    CHECK(safety.flags() & BATTERY_LOW);
    CHECK(safety.latched() && !safety.at_once());
    Safety enough;
    enough.start(ROBOT);
    CHECK_EQ(steps_to_flag(&enough, 11000, BATTERY_EMPTY, true), 0);
    CHECK(enough.flags() & BATTERY_LOW);
}

TEST(a_dip_is_no_empty_battery) {
    Safety safety;
    safety.start(ROBOT);
    SafetyInputs in = quiet();
    safety.update(in);
    for (int round = 0; round < 50; ++round) {
        in.battery_mv = 9000;
        for (int i = 0; i < 20; ++i) safety.update(in);
        in.battery_mv = 12400;
        for (int i = 0; i < 180; ++i) safety.update(in);
        CHECK(!safety.latched());
    }
}

TEST(the_filter_has_its_time_constant) {
    BatteryWatch battery;
    Flags flags = 0;
    battery.start(ROBOT);
    battery.update(0, &flags);  // no conversion has finished
    battery.update(12000, &flags);
    CHECK_EQ(battery.mv(), 12000);
    for (int i = 0; i < 64; ++i) battery.update(11000, &flags);
    CHECK(battery.mv() > 11355 && battery.mv() < 11380);  // 1000/e left
    for (int i = 0; i < 2000; ++i) battery.update(11500, &flags);
    CHECK(battery.mv() >= 11499 && battery.mv() <= 11500);
    battery.start(ROBOT);
    for (int i = 0; i < 2; ++i) {
        battery.update(65535, &flags);
        CHECK_EQ(battery.mv(), 65535);
    }
}

TEST(low_battery_warns_with_hysteresis) {
    Safety safety;
    safety.start(ROBOT);
    safety.update([] { SafetyInputs in = quiet(); in.battery_mv = 11600; return in; }());
    CHECK(!(safety.flags() & BATTERY_LOW));
    CHECK(steps_to_flag(&safety, 11500, BATTERY_LOW, true) > 0);
    CHECK(!safety.latched());
    CHECK_EQ(steps_to_flag(&safety, 11899, BATTERY_LOW, false), 0);
    CHECK(steps_to_flag(&safety, 11964, BATTERY_LOW, false) > 0);
}

TEST(recovered_is_half_a_margin_above_the_warning) {
    BatteryWatch battery;
    Flags flags = 0;
    battery.start(ROBOT);
    battery.update(11899, &flags);
    CHECK(!battery.recovered());
    battery.start(ROBOT);
    battery.update(11900, &flags);
    CHECK(battery.recovered());
}

TEST(an_empty_battery_is_cleared_only_when_charged) {
    Safety safety;
    safety.start(ROBOT);
    CHECK(steps_to_flag(&safety, 10500, BATTERY_EMPTY, true) > 0);
    safety.estop();
    CHECK(!safety.clear());
    CHECK_EQ(safety.flags(), BATTERY_EMPTY | BATTERY_LOW);  // the command is lifted, the battery not
    CHECK(steps_to_flag(&safety, 12400, BATTERY_LOW, false) > 0);
    CHECK(safety.latched());
    CHECK(safety.clear());
    CHECK_EQ(safety.flags(), 0);
}

TEST(a_warning_survives_a_clear) {
    Safety safety;
    safety.start(ROBOT);
    CHECK_EQ(steps_to_flag(&safety, 11300, BATTERY_LOW, true), 1);
    CHECK(safety.clear());
    CHECK_EQ(safety.flags(), BATTERY_LOW);
    CHECK_EQ(safety.battery_mv(), 11300);
}
