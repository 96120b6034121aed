// MPU-6050 and its relatives at register level (InvenSense RM-MPU-6000A-00, RM-MPU-6500A-00): 500 deg/s, 4 g, 42 Hz
// low-pass, sampled once per control step. Axes are the chip's own.
#pragma once

#include <stdint.h>

namespace chefbot {

class Imu {
  public:
    // For the ranges that SETTINGS (imu.cpp) selects: 4 g and 500 deg/s (register map 4.4, 4.5, 4.17, 4.19).
    static constexpr int16_t LSB_PER_G = 8192, LSB_PER_10_DEGREES = 655;

    // One step: brings the chip up, reads it, or tries again half a second after a failure.
    void step(void *port);

    // Whether wheels or motors move the robot. More than 1 s at rest gives a new estimate of the gyro's offset.
    void rest(bool resting);

    // WHO_AM_I of the chip on the bus, 0 if none answers.
    uint8_t id() const { return id_; }
    // The last sample can be trusted.
    bool good() const { return good_; }
    // rad/s * 10^6
    int32_t rate(uint8_t axis) const { return scaled(raw_[4 + axis], MICRORADIANS_Q7, 7); }
    // m/s^2 * 10^3
    int32_t acceleration(uint8_t axis) const { return scaled(raw_[axis], GRAVITY_MM, G_BITS); }
    // 1/100 degree Celsius of an MPU-6050: raw / 340 + 36.53. Later chips are some 15 degrees colder than that.
    int32_t temperature() const { return scaled(raw_[3], 19275, 16) + 3653; }
    // Turn about the chip's z since the start, 10^-8 rad, modulo 2^32: the sum of rates, 10 ms each.
    uint32_t angle() const { return angle_; }
    // Samples in `angle`, modulo 2^16.
    uint16_t samples() const { return samples_; }
    // Mean rate about z during the last 1.28 s at rest, 10^-6 rad/s. Reported, never subtracted.
    int32_t bias() const { return bias_; }

  private:
    // 1 LSB of a rate, 10^-6 rad/s * 2^7: one degree is 17453.2925 of them.
    static constexpr int32_t MICRORADIANS_Q7 = static_cast<int32_t>(17453.2925 * 10 * 128 / LSB_PER_10_DEGREES + 0.5);
    static constexpr int32_t GRAVITY_MM = 9807;  // mm/s^2 per g
    static constexpr uint8_t G_BITS = 13;
    static_assert(LSB_PER_G == 1 << G_BITS, "a shift divides by it");

    enum State : uint8_t { ABSENT, RESETTING, SETTLING, RUNNING };

    void begin(void *port);
    void configure(void *port);
    void check(void *port);
    void run(void *port);
    void fail();
    bool read(void *port);
    bool saturated() const;
    bool plausible_at_rest() const;
    void integrate();
    static int32_t scaled(int16_t raw, int32_t factor, uint8_t bits);

    int16_t raw_[7] = {0};  // ax ay az temperature gx gy gz
    State state_ = ABSENT;
    uint8_t id_ = 0;
    bool good_ = false;
    bool resting_ = false;
    uint8_t wait_ = 0;    // steps
    uint8_t misses_ = 0;  // reads in a row that failed
    uint8_t repeats_ = 0;  // samples in a row that were the same in every bit
    uint8_t rest_samples_ = 0;
    uint16_t samples_ = 0;
    uint32_t angle_ = 0;
    int32_t rest_sum_ = 0;
    int32_t bias_ = 0;
};

}  // namespace chefbot
