// What the board says about itself as a USB device: one serial port (USB 2.0, chapter 9; CDC 1.2, PSTN subclass 1.2).
#pragma once

#include <stdint.h>

namespace chefbot {

const uint8_t NOTIFY_IN = 0x81, DATA_IN = 0x82, DATA_OUT = 0x02;  // endpoints
const uint8_t PACKET = 64;

const uint8_t DEVICE_DESCRIPTOR[] = {
    18, 1,       // device
    0x00, 0x02,  // USB 2.0
    2, 0, 0,     // communications device
    PACKET,      // of endpoint 0
    0x8A, 0x2E,  // Raspberry Pi
    0x0A, 0x00,  // serial port of an RP2040 (github.com/raspberrypi/usb-pid)
    0x00, 0x01,  // version 1.0
    1, 2, 3,     // strings: maker, product, serial number
    1            // configuration
};

const uint8_t CONFIGURATION_DESCRIPTOR[] = {
    9, 2, 67, 0, 2, 1, 0, 0x80, 125,         // 2 interfaces, powered by the bus with up to 250 mA
    9, 4, 0, 0, 1, 2, 2, 0, 0,               // interface 0: communications, abstract control model
    5, 0x24, 0, 0x10, 0x01,                  // CDC 1.1
    5, 0x24, 1, 0, 1,                        // no call management
    4, 0x24, 2, 2,                           // line coding and control line state
    5, 0x24, 6, 0, 1,                        // interface 1 is its data
    7, 5, NOTIFY_IN, 3, 8, 0, 255,           // interrupt, never used
    9, 4, 1, 0, 2, 10, 0, 0, 0,              // interface 1: data
    7, 5, DATA_OUT, 2, PACKET, 0, 0,         // bulk
    7, 5, DATA_IN, 2, PACKET, 0, 0,
};
static_assert(sizeof(CONFIGURATION_DESCRIPTOR) == 67, "its own length is wrong");

const uint8_t LANGUAGES[] = {4, 3, 0x09, 0x04};  // English
const uint8_t LINE_CODING[] = {0x00, 0xC2, 0x01, 0x00, 0, 0, 8};  // 115200 8N1; USB has no such thing

const uint8_t NO_STATUS[] = {0, 0};  // powered by the bus, wakes no computer

const char MAKER[] = "chefbot", PRODUCT[] = "chefbot motor board";

}  // namespace chefbot
