#include "session.h"

namespace chefbot {

uint16_t Session::open(uint32_t step) {
    last_ = static_cast<uint16_t>(last_ + 0x1000u + (step & 0x0FFFu));
    heard_ = step;
    open_ = true;
    return last_;
}

bool Session::accept(uint16_t sequence, uint32_t step) {
    const uint16_t ahead = static_cast<uint16_t>(sequence - last_);
    if (!open_ || ahead == 0 || ahead > WINDOW) return false;
    last_ = sequence;
    heard_ = step;
    return true;
}

void Session::watch(uint32_t step) {
    if (step - heard_ >= SILENCE) open_ = false;
}

}  // namespace chefbot
