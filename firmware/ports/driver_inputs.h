// What the inputs of the motor drivers mean, `driver.inputs` of the robot file.
//
// INA_INB_PWM  two direction inputs and a PWM: VNH2SP30, VNH5019, TB6612, L298. Both high: brake.
// DIR_PWM      one direction input and a PWM: MDD10A, MD10C, G2. PWM low: brake.
// TWO_PWM      a PWM for each direction: BTS7960 (IBT-2), DRV8833, DRV8871. Both high: brake; the low part of one of
//              them drives, so that the current decays slowly and the speed follows the duty in a line. Both low while
//              the drivers are off: those without an enable input let the motor turn freely then.
#pragma once

#include <stdint.h>

namespace chefbot {

enum DriverInputs : uint8_t { INA_INB_PWM, DIR_PWM, TWO_PWM };

struct TwoPwm {
    uint16_t ahead, back;  // parts of the period, high
};

// The two PWM signals of a motor; `size` is the part of `period` that drives.
inline TwoPwm two_pwm(bool on, int16_t duty, uint16_t size, uint16_t period) {
    if (!on) return {0, 0};
    const uint16_t low = static_cast<uint16_t>(period - size);
    return duty > 0 ? TwoPwm{period, low} : duty < 0 ? TwoPwm{low, period} : TwoPwm{period, period};
}

}  // namespace chefbot
