// A line from the computer: letter, sequence and at most two numbers, CRC. See docs/protocol.md.
#pragma once

#include <stdint.h>

namespace chefbot {

struct Frame {
    char letter;
    uint8_t count;       // of numbers, sequence included
    int32_t numbers[3];  // |number| < 10^9
};

enum class Got : uint8_t { NOTHING, FRAME, BAD_CRC, BAD_FORM };

class FrameReader {
  public:
    // Pass byte by byte; after FRAME, `frame()` contains the line's values.
    Got push(uint8_t byte);
    const Frame &frame() const { return frame_; }

  private:
    Got finish();
    bool crc_holds() const;
    bool parse();
    bool parse_number(uint8_t *at, int32_t *number) const;

    static const uint8_t ROOM = 40;  // the longest valid line has 35 before its end
    static const uint8_t TAIL = 5;   // '*' and four digits

    char line_[ROOM] = {0};
    uint8_t length_ = 0;
    bool spoilt_ = false;
    Frame frame_ = Frame();
};

}  // namespace chefbot
