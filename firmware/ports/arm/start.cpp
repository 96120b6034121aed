// From reset to main on a Cortex-M: copies .data, clears .bss, runs constructors. No C library is linked.
#include <stddef.h>
#include <stdint.h>

extern "C" {

extern uint32_t data_load, data_start, data_end, bss_start, bss_end;
typedef void (*Constructor)();
extern Constructor constructors_start, constructors_end;

int main();

// The compiler calls these for large copies; without the attribute it would turn each into a call of itself.
__attribute__((optimize("no-tree-loop-distribute-patterns"))) void *memset(void *to, int value, size_t count) {
    uint8_t *at = static_cast<uint8_t *>(to);
    while (count-- > 0) *at++ = static_cast<uint8_t>(value);
    return to;
}

__attribute__((optimize("no-tree-loop-distribute-patterns"))) void *memcpy(void *to, const void *from, size_t count) {
    uint8_t *at = static_cast<uint8_t *>(to);
    const uint8_t *source = static_cast<const uint8_t *>(from);
    while (count-- > 0) *at++ = *source++;
    return to;
}

void reset_handler() {
    const uint32_t *source = &data_load;
    for (uint32_t *at = &data_start; at < &data_end; ++at) *at = *source++;
    for (uint32_t *at = &bss_start; at < &bss_end; ++at) *at = 0;
    for (Constructor *each = &constructors_start; each < &constructors_end; ++each) (*each)();
    main();
    for (;;) {}
}

// A fault: the hardware watchdog ends it, with the motors' pins back in their reset state.
void hang() {
    for (;;) {}
}
}
