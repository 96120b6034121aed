#include "frame.h"

#include "crc16.h"

namespace chefbot {

namespace {

const uint8_t MOST_DIGITS = 9;

bool is_digit(char c) { return c >= '0' && c <= '9'; }

char hex_digit(uint16_t nibble) { return static_cast<char>(nibble < 10 ? '0' + nibble : 'A' + nibble - 10); }

}  // namespace

Got FrameReader::push(uint8_t byte) {
    if (byte == '\n') return finish();
    if (byte < ' ' || byte > '~' || length_ == ROOM) {
        spoilt_ = true;
        return Got::NOTHING;
    }
    line_[length_++] = static_cast<char>(byte);
    return Got::NOTHING;
}

Got FrameReader::finish() {
    Got got = Got::NOTHING;
    if (spoilt_ || (length_ > 0 && length_ <= TAIL)) {
        got = Got::BAD_FORM;
    } else if (length_ > 0) {
        got = !crc_holds() ? Got::BAD_CRC : parse() ? Got::FRAME : Got::BAD_FORM;
    }
    length_ = 0;
    spoilt_ = false;
    return got;
}

bool FrameReader::crc_holds() const {
    const uint8_t star = static_cast<uint8_t>(length_ - TAIL);
    uint16_t crc = CRC_START;
    for (uint8_t i = 0; i < star; ++i) crc = crc16(crc, static_cast<uint8_t>(line_[i]));
    bool equal = line_[star] == '*';
    for (uint8_t i = 1; i < TAIL; ++i) {
        equal = equal && line_[star + i] == hex_digit(crc >> 12);
        crc = static_cast<uint16_t>(crc << 4);
    }
    return equal;
}

// letter { ' ' number }
bool FrameReader::parse() {
    const uint8_t end = static_cast<uint8_t>(length_ - TAIL);
    uint8_t at = 1;
    frame_.letter = line_[0];
    frame_.count = 0;
    while (at < end) {
        if (line_[at++] != ' ' || frame_.count == 3) return false;
        if (!parse_number(&at, &frame_.numbers[frame_.count++])) return false;
    }
    return true;
}

// An optional minus and one to nine digits. The line ends in '*', so no index runs past it.
bool FrameReader::parse_number(uint8_t *at, int32_t *number) const {
    const bool negative = line_[*at] == '-';
    if (negative) ++*at;
    const uint8_t first = *at;
    int32_t sum = 0;
    while (is_digit(line_[*at])) {
        if (*at - first == MOST_DIGITS) return false;
        sum = sum * 10 + (line_[(*at)++] - '0');
    }
    *number = negative ? -sum : sum;
    return *at > first;
}

}  // namespace chefbot
