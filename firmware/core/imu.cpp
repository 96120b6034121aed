#include "imu.h"

#include "fixed.h"
#include "hal.h"

namespace chefbot {

namespace {

const uint8_t ADDRESS = 0x68;
const uint8_t DIVIDER = 0x19, CONFIG = 0x1A, GYRO_CONFIG = 0x1B, ACCEL_CONFIG = 0x1C, ACCEL_FILTER = 0x1D;
const uint8_t SAMPLE = 0x3B, POWER = 0x6B, WHO_AM_I = 0x75;
const uint8_t WAKE_ON_GYRO_CLOCK = 0x01, RESET = 0x80;

const uint8_t RESET_STEPS = 10, SETTLE_STEPS = 10, RETRY_STEPS = 50;
const uint8_t MISSES = 3;   // reads
const uint8_t REPEATS = 8;  // samples; with real noise, six axes and the temperature are not equal even twice in a row
const uint8_t REST_SAMPLES = 128;
const int16_t RAIL = 32700;  // LSB; the chip saturates at 32767
const uint16_t REST_RATE = (Imu::LSB_PER_10_DEGREES + 1) / 2;  // 5 deg/s
const uint16_t GRAVITY = Imu::LSB_PER_G / 128;                 // 128 LSB
const uint16_t LEAST = GRAVITY * 4 / 5, MOST = GRAVITY * 6 / 5;

struct Setting {
    uint8_t reg, value;
};

const Setting SETTINGS[] = {{DIVIDER, 0}, {CONFIG, 3}, {GYRO_CONFIG, 0x08}, {ACCEL_CONFIG, 0x08}};
const uint8_t SETTING_COUNT = sizeof(SETTINGS) / sizeof(SETTINGS[0]);

// Read back: a bus that always answers 0xFF or 0x00 must fail.
bool set(void *port, Setting setting) {
    uint8_t now = 0;
    return hal_i2c_write(port, ADDRESS, setting.reg, setting.value) &&
           hal_i2c_read(port, ADDRESS, setting.reg, &now, 1) && now == setting.value;
}

}  // namespace

int32_t Imu::scaled(int16_t raw, int32_t factor, uint8_t bits) {
    return shift_down(raw * factor + (static_cast<int32_t>(1) << (bits - 1)), bits);
}

void Imu::step(void *port) {
    if (wait_ > 0) {
        --wait_;
        return;
    }
    switch (state_) {
        case ABSENT: return begin(port);
        case RESETTING: return configure(port);
        case SETTLING: return check(port);
        default: return run(port);
    }
}

void Imu::fail() {
    state_ = ABSENT;
    good_ = false;
    wait_ = RETRY_STEPS;
}

void Imu::begin(void *port) {
    // Any chip is tried: many have the registers of the MPU-6050 and an identity of their own. Those that do not fail to
    // return the settings.
    id_ = 0;
    if (!hal_i2c_read(port, ADDRESS, WHO_AM_I, &id_, 1)) hal_i2c_clear(port);
    if (!hal_i2c_write(port, ADDRESS, POWER, RESET)) return fail();
    state_ = RESETTING;
    wait_ = RESET_STEPS;
}

void Imu::configure(void *port) {
    // From the MPU-6500 on the accelerometer has a filter of its own, 44 Hz; an MPU-6050 has an unused threshold there.
    if (!hal_i2c_write(port, ADDRESS, POWER, WAKE_ON_GYRO_CLOCK) || !hal_i2c_write(port, ADDRESS, ACCEL_FILTER, 3)) {
        return fail();
    }
    for (uint8_t i = 0; i < SETTING_COUNT; ++i) {
        if (!set(port, SETTINGS[i])) return fail();
    }
    state_ = SETTLING;
    wait_ = SETTLE_STEPS;
}

// At rest there is gravity and no rotation; while the robot is carried, the estimate waits.
void Imu::check(void *port) {
    if (!read(port) || (resting_ && !plausible_at_rest())) return fail();
    state_ = RUNNING;
    misses_ = 0;
}

// Gravity within 20 %, no rotation.
bool Imu::plausible_at_rest() const {
    uint16_t square = 0;
    for (uint8_t axis = 0; axis < 3; ++axis) {
        const uint16_t part = magnitude(raw_[axis]) / 128u;
        if (part > MOST || magnitude(raw_[4 + axis]) > REST_RATE) return false;
        square = static_cast<uint16_t>(square + part * part);
    }
    return square >= LEAST * LEAST && square <= MOST * MOST;
}

void Imu::run(void *port) {
    if (!read(port)) {
        good_ = false;
        if (++misses_ == MISSES) fail();
        return;
    }
    misses_ = 0;
    if (repeats_ == REPEATS) return fail();
    good_ = !saturated();
    if (good_) integrate();
}

bool Imu::read(void *port) {
    uint8_t bytes[14];
    if (!hal_i2c_read(port, ADDRESS, SAMPLE, bytes, sizeof bytes)) return false;
    bool same = true;
    for (uint8_t i = 0; i < 7; ++i) {
        const int16_t value =
            static_cast<int16_t>(static_cast<uint16_t>(static_cast<uint16_t>(bytes[2 * i]) << 8) | bytes[2 * i + 1]);
        same = same && value == raw_[i];
        raw_[i] = value;
    }
    if (!same) repeats_ = 0;
    if (same && repeats_ < REPEATS) ++repeats_;
    return true;
}

bool Imu::saturated() const {
    for (uint8_t i = 0; i < 7; ++i) {
        if (i != 3 && (raw_[i] > RAIL || raw_[i] < -RAIL)) return true;
    }
    return false;
}

void Imu::integrate() {
    angle_ += static_cast<uint32_t>(rate(2));
    ++samples_;
    if (!resting_) return;
    rest_sum_ += rate(2);
    if (++rest_samples_ < REST_SAMPLES) return;
    bias_ = shift_down(rest_sum_, 7);
    rest_samples_ = 0;
    rest_sum_ = 0;
}

void Imu::rest(bool resting) {
    if (!resting) {
        rest_samples_ = 0;
        rest_sum_ = 0;
    }
    resting_ = resting;
}

}  // namespace chefbot
