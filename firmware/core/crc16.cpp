#include "crc16.h"

namespace chefbot {

uint16_t crc16(uint16_t crc, uint8_t byte) {
    crc = static_cast<uint16_t>(crc ^ (static_cast<uint16_t>(byte) << 8));
    for (uint8_t bit = 0; bit < 8; ++bit) {
        const bool carry = crc & 0x8000u;
        crc = static_cast<uint16_t>(crc << 1);
        if (carry) crc ^= 0x1021u;
    }
    return crc;
}

}  // namespace chefbot
