// CRC-16/CCITT-FALSE: polynomial 0x1021, start 0xFFFF, no reflection, no final XOR; 0x29B1 for "123456789".
#pragma once

#include <stdint.h>

namespace chefbot {

const uint16_t CRC_START = 0xFFFF;

uint16_t crc16(uint16_t crc, uint8_t byte);

}  // namespace chefbot
