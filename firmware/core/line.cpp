#include "line.h"

#include "crc16.h"

namespace chefbot {

Line::Line(char letter, uint16_t sequence) {
    put(letter);
    count(sequence);
}

Line &Line::number(int32_t value) {
    put(' ');
    if (value < 0) put('-');
    digits(value < 0 ? 0u - static_cast<uint32_t>(value) : static_cast<uint32_t>(value));
    return *this;
}

Line &Line::count(uint32_t value) {
    put(' ');
    digits(value);
    return *this;
}

Line &Line::hex(uint32_t value, uint8_t digits) {
    put(' ');
    hex_digits(value, digits);
    return *this;
}

Line &Line::word(const char *text) {
    put(' ');
    while (*text) put(*text++);
    return *this;
}

void Line::finish() {
    uint16_t crc = CRC_START;
    for (uint8_t i = 0; i < length_; ++i) crc = crc16(crc, static_cast<uint8_t>(text_[i]));
    put('*');
    hex_digits(crc, 4);
    put('\n');
}

// The fields of every message fit; a longer line would be cut and fail its CRC, without an overrun.
void Line::put(char c) {
    if (length_ < ROOM) text_[length_++] = c;
}

// By subtraction: a 32-bit division takes an 8-bit processor ten times as long.
void Line::digits(uint32_t value) {
    static const uint32_t POWERS[] = {1000000000, 100000000, 10000000, 1000000, 100000, 10000, 1000, 100, 10};
    bool leading = true;
    for (uint8_t i = 0; i < sizeof(POWERS) / sizeof(POWERS[0]); ++i) {
        char digit = '0';
        while (value >= POWERS[i]) {
            value -= POWERS[i];
            ++digit;
        }
        leading = leading && digit == '0';
        if (!leading) put(digit);
    }
    put(static_cast<char>('0' + value));
}

void Line::hex_digits(uint32_t value, uint8_t digits) {
    while (digits-- > 0) {
        const uint8_t nibble = (value >> (4 * digits)) & 15u;
        put(static_cast<char>(nibble < 10 ? '0' + nibble : 'A' + nibble - 10));
    }
}

}  // namespace chefbot
