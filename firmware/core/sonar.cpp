#include "sonar.h"

namespace chefbot {

void Sonar::edge(bool high, uint16_t us) {
    if (high && state_ == SENT) {
        rose_us_ = us;
        state_ = RISEN;
    } else if (!high && state_ == RISEN) {
        width_us_ = static_cast<uint16_t>(us - rose_us_);
        state_ = FALLEN;
    }
}

bool Sonar::step() {
    if (period_ == 0) return false;
    ++since_;
    if (since_ == VERDICT_STEPS) judge();
    if (since_ < period_) return false;
    since_ = 0;
    state_ = SENT;
    return true;
}

void Sonar::judge() {
    switch (state_) {
        case IDLE: return;
        case SENT: echo_us_ = NO_SENSOR; break;
        case RISEN: echo_us_ = NOTHING; break;
        default: echo_us_ = width_us_ <= TIMEOUT_US ? static_cast<int32_t>(width_us_) : NOTHING;
    }
    new_ = true;
}

bool Sonar::take_result() {
    const bool result = new_;
    new_ = false;
    return result;
}

}  // namespace chefbot
