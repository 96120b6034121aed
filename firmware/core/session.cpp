#include "session.h"

namespace chefbot {

uint16_t Session::open(uint32_t step) {
    last_ = static_cast<uint16_t>(last_ + 0x1000u + (static_cast<uint16_t>(step) & 0x0FFFu));
    patience_ = SILENCE;
    return last_;
}

bool Session::accept(uint16_t sequence) {
    const uint16_t ahead = static_cast<uint16_t>(sequence - last_);
    if (!is_open() || ahead == 0 || ahead > WINDOW) return false;
    last_ = sequence;
    patience_ = SILENCE;
    return true;
}

void Session::watch() {
    if (patience_ > 0) --patience_;
}

}  // namespace chefbot
