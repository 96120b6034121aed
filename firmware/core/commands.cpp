// Lines from the computer.
#include "board.h"

namespace chefbot {

void Board::receive(uint8_t byte) {
    switch (reader_.push(byte)) {
        case Got::NOTHING: return;
        case Got::BAD_CRC: return refuse(Refusal::CRC);
        case Got::BAD_FORM: return refuse(Refusal::FORM);
        default: break;
    }
    const Refusal why = obey(reader_.frame());
    if (why != Refusal::NONE) refuse(why);
}

void Board::refuse(Refusal why) {
    ++refused_;
    refusal_ = why;
}

// The emergency stop needs neither session nor sequence: every request is accepted.
Refusal Board::obey(const Frame &frame) {
    if (frame.letter == 'v' && frame.count == 2) return shake_hands(frame);
    if (frame.letter == 'x' && frame.count == 1) {
        emergency_stop();
        return Refusal::NONE;
    }
    const uint8_t wanted = frame.letter == 's' ? 3 : 1;
    const bool known = frame.letter == 's' || frame.letter == 'h' || frame.letter == 'c' || frame.letter == 'r';
    return known && frame.count == wanted ? obey_in_session(frame) : Refusal::LETTER;
}

Refusal Board::obey_in_session(const Frame &frame) {
    const int32_t sequence = frame.numbers[0];
    const uint8_t before = hal_lock(port_);
    const bool accepted =
        sequence >= 0 && sequence <= 0xFFFF && session_.accept(static_cast<uint16_t>(sequence));
    hal_unlock(port_, before);
    if (!accepted) return Refusal::SEQUENCE;
    switch (frame.letter) {
        case 'h': return Refusal::NONE;
        case 'c': return clear_faults();
        case 'r': return restart();
        default: break;
    }
    return set_speed(frame.numbers[1], frame.numbers[2]);
}

Refusal Board::shake_hands(const Frame &frame) {
    if (frame.numbers[1] != PROTOCOL) {
        tell_version(frame.numbers[0]);
        return Refusal::VERSION;
    }
    const uint8_t before = hal_lock(port_);
    session_.open(now_.step);
    fresh_ = false;
    neutral_first_ = true;
    hal_unlock(port_, before);
    tell_version(frame.numbers[0]);
    return Refusal::NONE;
}

// Even a rejected speed shows that the computer runs, so that an empty battery causes a ramped stop.
Refusal Board::set_speed(int32_t left, int32_t right) {
    Pair speed;
    const bool limited = limit_speed(*robot_, left, right, &speed);
    const bool zero = left == 0 && right == 0;
    Refusal why = Refusal::NONE;
    const uint8_t before = hal_lock(port_);
    command_age_ = 0;
    if (safety_.latched()) {
        why = Refusal::STOPPED;
    } else if (neutral_first_ && !zero) {
        why = Refusal::NEUTRAL;
    } else {
        neutral_first_ = false;
        fresh_ = true;
        limited_ = limited;
        target_ = speed;
        now_.obeyed = session_.last();
    }
    hal_unlock(port_, before);
    return why;
}

Refusal Board::clear_faults() {
    const uint8_t before = hal_lock(port_);
    const bool clean = safety_.clear();
    after_watchdog_ = false;
    neutral_first_ = true;
    target_.left = target_.right = 0;
    hal_unlock(port_, before);
    return clean ? Refusal::NONE : Refusal::CAUSE;
}

// Motors off before the processor restarts, whatever its pins do meanwhile.
Refusal Board::restart() {
    const uint8_t before = hal_lock(port_);
    apply(0, 0);
    hal_drivers(port_, false);
    hal_unlock(port_, before);
    hal_restart(port_);
    return Refusal::NONE;
}

void Board::emergency_stop() {
    const uint8_t before = hal_lock(port_);
    safety_.estop();
    hal_unlock(port_, before);
}

}  // namespace chefbot
