// Bytes between an interrupt and the main loop: one writer, one reader, indices that are read and written whole.
#pragma once

#include <stdint.h>

namespace chefbot {

template <uint8_t BITS>
class Ring {
  public:
    bool empty() const { return head_ == tail_; }
    uint8_t room() const { return static_cast<uint8_t>(MASK - ((head_ - tail_) & MASK)); }
    void push(uint8_t byte) {
        bytes_[head_] = byte;
        head_ = static_cast<uint8_t>((head_ + 1) & MASK);
    }
    uint8_t pop() {
        const uint8_t byte = bytes_[tail_];
        tail_ = static_cast<uint8_t>((tail_ + 1) & MASK);
        return byte;
    }

  private:
    static const uint8_t MASK = static_cast<uint8_t>((1u << BITS) - 1);
    uint8_t bytes_[1u << BITS] = {0};
    volatile uint8_t head_ = 0, tail_ = 0;
};

}  // namespace chefbot
