// A line to the computer: letter, sequence, fields with one space before each, CRC, LF.
#pragma once

#include <stdint.h>

namespace chefbot {

class Line {
  public:
    Line(char letter, uint16_t sequence);
    Line &number(int32_t value);
    Line &count(uint32_t value);
    Line &hex(uint32_t value, uint8_t digits);
    Line &word(const char *text);
    void finish();

    const char *text() const { return text_; }
    uint8_t length() const { return length_; }

  private:
    void put(char c);
    void digits(uint32_t value);
    void hex_digits(uint32_t value, uint8_t digits);

    static const uint8_t ROOM = 120;
    char text_[ROOM];
    uint8_t length_ = 0;
};

}  // namespace chefbot
