// Limits, ramp, session, wheel control: unit tests.
#include "check.h"
#include "desk.h"
#include "fixed.h"
#include "limits.h"
#include "session.h"
#include "wheel.h"

using namespace chefbot;

// ---- limits

static Pair limited(int32_t left, int32_t right, bool expected) {
    Pair speed;
    CHECK_EQ(limit_speed(example_robot(), left, right, &speed), expected);
    return speed;
}

TEST(speeds_within_the_limits_pass) {
    for (Pair pass : {Pair{9600, 9600}, Pair{-9600, -9600}, Pair{10000, 9200}, Pair{4000, -4000}, Pair{0, 0}, Pair{9200, 10000}}) {
        const Pair out = limited(pass.left, pass.right, false);
        CHECK_EQ(out.left, pass.left);
        CHECK_EQ(out.right, pass.right);
    }
}

TEST(each_limit_scales_both_wheels) {
    Pair out = limited(12000, 6000, true);  // wheel
    CHECK_EQ(out.left, 10000);
    CHECK_EQ(out.right, 5000);
    out = limited(-6000, -12000, true);
    CHECK_EQ(out.left, -5000);
    CHECK_EQ(out.right, -10000);
    out = limited(10000, 10000, true);  // forward
    CHECK_EQ(out.left, 9600);
    CHECK_EQ(out.right, 9600);
    out = limited(-10000, -10000, true);
    CHECK_EQ(out.left, -9600);
    out = limited(8000, -8000, true);  // turn
    CHECK_EQ(out.left, 4000);
    CHECK_EQ(out.right, -4000);
    out = limited(-5000, 5000, true);
    CHECK_EQ(out.left, -4000);
    CHECK_EQ(out.right, 4000);
    CHECK_EQ(limited(9602, 9602, true).left, 9600);
    CHECK_EQ(limited(4001, -4002, true).right, -4000);
}

TEST(a_speed_at_a_limit_rounded_to_whole_ticks_is_no_excess) {
    CHECK_EQ(limited(9601, 9601, false).left, 9600);
    CHECK_EQ(limited(-9601, -9601, false).right, -9600);
    const Pair turn = limited(4001, -4001, false);
    CHECK_EQ(turn.left, 4000);
    CHECK_EQ(turn.right, -4000);
    CHECK_EQ(limited(4000, -4001, false).left, 3999);
}

TEST(absurd_speeds_stay_in_bounds) {
    for (int32_t left : {-999999999, -70000, -65536, -32768, 0, 32767, 32768, 65535, 70000, 999999999}) {
        for (int32_t right : {-999999999, -65535, -32768, -1, 0, 65536, 999999999}) {
            const Pair speed = limited(left, right, left != 0 || (right != 0 && right != -1));
            CHECK(abs(speed.left) <= 10000 && abs(speed.right) <= 10000);
            CHECK(abs(speed.left + speed.right) <= 2 * 9600 + 1);
            CHECK(abs(speed.right - speed.left) <= 8000);
            CHECK(static_cast<int64_t>(left) * speed.left >= 0 && static_cast<int64_t>(right) * speed.right >= 0);
        }
    }
    CHECK_EQ(limited(999999999, 999999999, true).left, 9600);
    CHECK_EQ(limited(32767, 16384, true).right, 10000 * 16384 / 32767);
}

static Pair run_ramp(Ramp *ramp, Pair target) {
    ramp->step(target);
    return ramp->set();
}

TEST(the_fastest_machine_does_not_overflow) {
    RobotConstants robot = example_robot();
    robot.no_load = robot.max_wheel = robot.max_forward = SPEED_BOUND;
    robot.max_turn = 2 * SPEED_BOUND;
    robot.acceleration = robot.deceleration = 102000;
    CHECK(plausible(robot));
    Pair speed;
    CHECK(limit_speed(robot, 65535, -65535, &speed));
    CHECK_EQ(speed.left, SPEED_BOUND);
    Ramp ramp;
    ramp.start(robot);
    const Pair away = {static_cast<int16_t>(-SPEED_BOUND), static_cast<int16_t>(SPEED_BOUND)};
    for (int i = 0; i < 40; ++i) ramp.step(away);
    CHECK_EQ(ramp.set().left, -SPEED_BOUND);
    int steps = 0;
    for (Pair set = ramp.set(); set.left != speed.left || set.right != speed.right; set = run_ramp(&ramp, speed)) {
        CHECK(++steps < 70);
    }
    CHECK(steps >= 64);
}

static Ramp example_ramp() {
    static const RobotConstants robot = example_robot();
    Ramp ramp;
    ramp.start(robot);  // 128 ticks/s per step, 256 while it slows down
    return ramp;
}

TEST(ramp_keeps_the_limit_and_the_proportion) {
    for (Pair target : {Pair{9000, 3000}, Pair{-3000, -9000}, Pair{-4000, 4000}, Pair{9000, 0}, Pair{0, -9000}}) {
        Ramp ramp = example_ramp();
        Pair before = {0, 0};
        int steps = 0;
        while (before.left != target.left || before.right != target.right) {
            const Pair set = run_ramp(&ramp, target);
            CHECK(abs(set.left - before.left) <= 129 && abs(set.right - before.right) <= 129);
            CHECK(fabs(set.left * (target.right / 1000.0) - set.right * (target.left / 1000.0)) < 30);
            CHECK(++steps < 100);
            before = set;
        }
        const int most = abs(target.left) > abs(target.right) ? abs(target.left) : abs(target.right);
        CHECK(steps >= most / 128 && steps <= most / 128 + 2);
    }
}

TEST(ramp_lands_exactly) {
    Ramp ramp = example_ramp();
    Pair set = run_ramp(&ramp, Pair{127, -127});
    CHECK_EQ(set.left, 127);
    CHECK_EQ(set.right, -127);
    set = run_ramp(&ramp, Pair{127, -257});  // two more than a step
    CHECK_EQ(set.left, 127);
    CHECK_EQ(set.right, -255);
    set = run_ramp(&ramp, Pair{127, -257});
    CHECK_EQ(set.right, -257);
    set = run_ramp(&ramp, Pair{28, -157});  // less than a step
    CHECK_EQ(set.left, 28);
    CHECK_EQ(set.right, -157);
    ramp.stop();
    CHECK_EQ(ramp.set().left, 0);
    CHECK_EQ(ramp.set().right, 0);
}

TEST(ramp_takes_the_wheel_with_more_to_go_as_its_measure) {
    for (bool swap : {false, true}) {
        Ramp ramp = example_ramp();
        for (int i = 0; i < 10; ++i) ramp.step(swap ? Pair{3200, 6400} : Pair{6400, 3200});
        const int fast = swap ? ramp.set().right : ramp.set().left, slow = swap ? ramp.set().left : ramp.set().right;
        CHECK(fast >= 1278 && fast <= 1280);
        CHECK(slow >= 638 && slow <= 640);
    }
}

TEST(ramp_knows_parts_of_a_tick) {
    RobotConstants robot = example_robot();
    robot.acceleration = 12850;
    Ramp ramp;
    ramp.start(robot);
    for (int i = 0; i < 20; ++i) ramp.step(Pair{2600, 2600});
    CHECK(ramp.set().left >= 2568 && ramp.set().left <= 2570);
}

TEST(ramp_turns_round_without_a_jump) {
    Ramp ramp = example_ramp();
    for (int i = 0; i < 100; ++i) ramp.step(Pair{5000, 4000});
    int last = 5000;
    for (int i = 0; i < 100; ++i) {
        const Pair set = run_ramp(&ramp, Pair{-5000, -4000});
        CHECK(set.left <= last && last - set.left <= 129);
        last = set.left;
    }
    CHECK_EQ(last, -5000);
    CHECK_EQ(ramp.set().right, -4000);
}

TEST(ramp_slows_down_with_the_deceleration) {
    for (int sign : {1, -1}) {
        Ramp ramp = example_ramp();
        const Pair fast = {static_cast<int16_t>(sign * 5120), static_cast<int16_t>(sign * -2560)};
        for (int i = 0; i < 41; ++i) ramp.step(fast);
        for (int i = 1; i <= 20; ++i) {
            const Pair set = run_ramp(&ramp, Pair{0, 0});
            CHECK(abs(set.left - sign * (5120 - 256 * i)) <= 1 && abs(set.right + sign * (2560 - 128 * i)) <= 1);
        }
        ramp.step(Pair{0, 0});
        CHECK_EQ(ramp.set().left, 0);
        CHECK_EQ(ramp.set().right, 0);
    }
}

TEST(ramp_does_not_brake_beyond_standstill) {
    Ramp ramp = example_ramp();
    for (int i = 0; i < 4; ++i) ramp.step(Pair{200, 200});
    CHECK_EQ(run_ramp(&ramp, Pair{-800, -800}).left, 72);
    CHECK_EQ(run_ramp(&ramp, Pair{-800, -800}).left, -56);
}

TEST(magnitudes_and_clips) {
    CHECK_EQ(magnitude(-32768), 32767);
    CHECK_EQ(magnitude(-32767), 32767);
    CHECK_EQ(magnitude(5), 5);
    CHECK_EQ(clip(40000), 32767);
    CHECK_EQ(clip(-40000), -32767);
}

TEST(implausible_robots_are_refused) {
    CHECK(plausible(example_robot()));
    const RobotConstants good = example_robot();
    RobotConstants bad[30];
    for (RobotConstants &robot : bad) robot = good;
    bad[0].ticks_per_turn_milli = 0;
    bad[1].max_wheel = 0;
    bad[2].max_wheel = good.no_load + 1;
    bad[3].max_forward = 0;
    bad[4].max_forward = 32768;
    bad[5].max_turn = 0;
    bad[6].max_turn = 65535;
    bad[7].acceleration = 127;
    bad[8].acceleration = 102001;
    bad[9].no_load = 125;
    bad[10].no_load = 32768;
    bad[11].battery_stop = -1;
    bad[12].battery_low = good.battery_stop - 1;
    bad[13].battery_low = 40001;
    bad[14].imu_period = 0;
    bad[15].imu_period = 101;
    bad[16].sonar_period = -1;
    bad[17].sonar_period = 1001;
    bad[18].lag = -1;
    bad[19].lag = 2001;
    bad[20].cliff_sensors = -1;
    bad[21].cliff_sensors = 5;
    bad[22].deceleration = 12799;
    bad[23].deceleration = 102001;
    bad[24].hold = -1;
    bad[25].hold = 2;
    bad[26].enable_diag = -1;
    bad[27].enable_diag = 2;
    for (int i = 0; i < 28; ++i) CHECK(!plausible(bad[i]));
}

// ---- session

TEST(a_session_accepts_only_newer_lines) {
    Session session;
    CHECK(!session.accept(1));
    const uint16_t first = session.open(5);
    CHECK_EQ(first, 0x1005);
    CHECK(session.is_open());
    CHECK(!session.accept(first));
    CHECK(!session.accept(static_cast<uint16_t>(first - 1)));
    CHECK(session.accept(static_cast<uint16_t>(first + 1)));
    CHECK(!session.accept(static_cast<uint16_t>(first + 1)));
    CHECK(session.accept(static_cast<uint16_t>(first + 257)));
    CHECK(!session.accept(static_cast<uint16_t>(first + 257 + 257)));
    CHECK_EQ(session.last(), first + 257);
}

TEST(sequence_wraps) {
    Session session;
    uint16_t at = session.open(0);
    for (int i = 0; i < 300; ++i) {
        at = static_cast<uint16_t>(at + 256);
        CHECK(session.accept(at));
        CHECK(!session.accept(static_cast<uint16_t>(at - 1)));
    }
}

TEST(nothing_of_an_old_session_is_new_in_the_next) {
    Session session;
    for (uint32_t step : {0u, 1u, 4095u, 4096u, 0xFFFFFFFFu}) {
        const uint16_t before = session.last();
        const uint16_t first = session.open(step);
        CHECK_EQ(first, static_cast<uint16_t>(before + 0x1000 + (step & 0xFFF)));
        for (uint16_t old = 0; old < 1000; ++old) CHECK(!session.accept(static_cast<uint16_t>(before + old)));
    }
}

static void wait(Session *session, int steps) {
    for (int i = 0; i < steps; ++i) session->watch();
}

TEST(silence_closes_the_session) {
    Session session;
    wait(&session, 1000);
    CHECK(!session.is_open());
    const uint16_t first = session.open(0xFFFFFFF0u);
    wait(&session, 99);
    CHECK(session.is_open());
    CHECK(session.accept(static_cast<uint16_t>(first + 1)));
    wait(&session, 99);
    CHECK(session.is_open());
    CHECK(!session.accept(first));  // what is refused is no sign of life
    wait(&session, 1);
    CHECK(!session.is_open());
    CHECK(!session.accept(static_cast<uint16_t>(first + 2)));
    wait(&session, 1000);
    CHECK(!session.is_open());
}

// ---- wheel

static Wheel wheel_of(const RobotConstants &robot) {
    Wheel wheel;
    wheel.start(robot);
    return wheel;
}

TEST(speed_is_ticks_over_the_window) {
    Wheel wheel = wheel_of(example_robot());
    for (int i = 1; i <= 5; ++i) {
        wheel.observe(100);
        CHECK_EQ(wheel.speed(), 2000 * i);
    }
    for (int i = 0; i < 20; ++i) wheel.observe(-50);
    CHECK_EQ(wheel.speed(), -5000);
    wheel.observe(2147483647);
    CHECK_EQ(wheel.speed(), (327 - 200) * 20);
    wheel.observe(-2147483647);
    CHECK_EQ(wheel.speed(), -150 * 20);
    for (int i = 0; i < 5; ++i) wheel.observe(2147483647);
    CHECK_EQ(wheel.speed(), 32700);
}

TEST(a_wheel_at_rest_gets_nothing) {
    Wheel wheel = wheel_of(example_robot());
    CHECK_EQ(wheel.control(0), 0);
    for (int i = 0; i < 50; ++i) wheel.control(5000);
    CHECK_EQ(wheel.control(0), 0);  // not even what the integral learnt
    wheel.control(0);
    CHECK_EQ(wheel.control(1), wheel_of(example_robot()).control(1));
}

TEST(first_answer_is_feed_forward_lead_and_error) {
    RobotConstants robot = example_robot();
    robot.no_load = 10000;
    robot.lag = 0;
    Wheel plain = wheel_of(robot);
    CHECK_EQ(plain.control(1000), 0);    // 100 and an error of 1000 - 2 * 1000
    CHECK_EQ(plain.control(1000), 194);  // 100 + 100 - 100 / 16
    robot.lag = 100;
    Wheel led = wheel_of(robot);
    CHECK_EQ(led.control(1000), 1000);  // lead of 10 steps: 1100 - 100
    robot.lag = 30;
    Wheel some = wheel_of(robot);
    CHECK_EQ(some.control(1000), 400 - 100);
    CHECK_EQ(wheel_of(robot).control(-1000), -300);
}

TEST(proportional_and_integral_have_their_gains) {
    RobotConstants robot = example_robot();
    robot.no_load = 10000;
    robot.lag = 0;
    Wheel wheel = wheel_of(robot);
    for (int i = 0; i < 5; ++i) wheel.observe(20);  // 2000 ticks/s
    wheel.control(3000);
    wheel.release();
    for (int i = 0; i < 5; ++i) wheel.observe(20);
    wheel.control(3000);                  // change of 3000: expected -3000, error -5000
    const int16_t second = wheel.control(3000);  // 300 + 100 - 500/16
    CHECK(second == 369 || second == 368);
    const int16_t third = wheel.control(3000);  // + 100/16
    CHECK(third == 375 || third == 374);
}

TEST(the_integral_stops_where_the_duty_saturates) {
    Wheel wheel = wheel_of(example_robot());
    for (int i = 0; i < 500; ++i) CHECK(wheel.control(10000) <= 1000);
    CHECK_EQ(wheel.control(10000), 1000);
    for (int i = 0; i < 5; ++i) wheel.observe(105);  // wheel free again, a little too fast
    int steps = 0;
    while (wheel.control(10000) == 1000) CHECK(++steps < 25);  // no long unwinding
    Wheel back = wheel_of(example_robot());
    for (int i = 0; i < 500; ++i) CHECK(back.control(-10000) >= -1000);
    for (int i = 0; i < 5; ++i) back.observe(-105);
    steps = 0;
    while (back.control(-10000) == -1000) CHECK(++steps < 25);
}

TEST(extremes_do_not_overflow) {
    RobotConstants robot = example_robot();
    robot.lag = 2000;
    for (int32_t no_load : {126, 11200, 32767}) {
        robot.no_load = no_load;
        for (int32_t set : {-no_load, 0, no_load}) {
            Wheel wheel = wheel_of(robot);
            for (int i = 0; i < 200; ++i) {
                wheel.observe(i & 1 ? 2147483647 : -2147483647);
                if (i > 100) wheel.observe(3000);
                CHECK(abs(wheel.control(static_cast<int16_t>(i & 4 ? set : -set))) <= 1000);
            }
        }
    }
}
