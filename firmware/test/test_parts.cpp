// Checksum, frames, lines, encoder: unit tests.
#include "check.h"
#include "crc16.h"
#include "desk.h"
#include "encoder.h"
#include "frame.h"
#include "line.h"

using namespace chefbot;

static const uint8_t TURN[4] = {0, 2, 3, 1};  // A before B

// ---- crc, frame, line

TEST(crc_has_the_standard_check_value) {
    uint16_t crc = CRC_START;
    for (const char *c = "123456789"; *c; ++c) crc = crc16(crc, static_cast<uint8_t>(*c));
    CHECK_EQ(crc, 0x29B1);
}

static Got feed(FrameReader *reader, const std::string &bytes) {
    Got got = Got::NOTHING;
    for (char c : bytes) {
        const Got now = reader->push(static_cast<uint8_t>(c));
        if (now != Got::NOTHING) got = now;
    }
    return got;
}

static bool refused(const std::string &bytes, Got why) {
    FrameReader reader;
    const bool right = feed(&reader, bytes) == why;
    return right && feed(&reader, framed("h 5")) == Got::FRAME;  // and nothing of it is left
}

TEST(a_frame_gives_its_letter_and_numbers) {
    FrameReader reader;
    CHECK(feed(&reader, framed("s 65535 -123456789 999999999")) == Got::FRAME);
    CHECK_EQ(reader.frame().letter, 's');
    CHECK_EQ(reader.frame().count, 3);
    CHECK_EQ(reader.frame().numbers[0], 65535);
    CHECK_EQ(reader.frame().numbers[1], -123456789);
    CHECK_EQ(reader.frame().numbers[2], 999999999);
    CHECK(feed(&reader, framed("x 0")) == Got::FRAME);
    CHECK_EQ(reader.frame().letter, 'x');
    CHECK_EQ(reader.frame().count, 1);
    CHECK_EQ(reader.frame().numbers[0], 0);
    CHECK(feed(&reader, framed("q")) == Got::FRAME);
    CHECK_EQ(reader.frame().count, 0);
}

TEST(a_byte_alone_is_no_frame) {
    FrameReader reader;
    const std::string line = framed("h 9");
    for (size_t i = 0; i + 1 < line.size(); ++i) CHECK(reader.push(static_cast<uint8_t>(line[i])) == Got::NOTHING);
    CHECK(reader.push('\n') == Got::FRAME);
}

TEST(empty_lines_are_nothing) {
    FrameReader reader;
    CHECK(feed(&reader, "\n\n\n") == Got::NOTHING);
}

TEST(every_single_bit_error_is_refused) {
    const std::string good = framed("s 77 -1200 1200");
    for (size_t at = 0; at + 1 < good.size(); ++at) {
        for (int bit = 0; bit < 8; ++bit) {
            std::string bad = good;
            bad[at] = static_cast<char>(bad[at] ^ (1 << bit));
            FrameReader reader;
            CHECK(feed(&reader, bad) != Got::FRAME);
        }
    }
}

TEST(bad_crc_is_told_from_bad_form) {
    CHECK(refused("h 7*0000\n", Got::BAD_CRC));
    CHECK(refused("h 7 0000\n", Got::BAD_CRC));
    std::string low = framed("h 12");
    for (char &c : low) c = static_cast<char>(c >= 'A' && c <= 'F' ? c + 32 : c);
    CHECK(low == framed("h 12") || refused(low, Got::BAD_CRC));
    CHECK(refused("12345\n", Got::BAD_FORM));
    CHECK(refused("*FFFF\n", Got::BAD_FORM));
    CHECK(refused("a\n", Got::BAD_FORM));
    CHECK(refused(framed("h 1").substr(0, 3) + "\x01" + framed("h 1").substr(3), Got::BAD_FORM));
    CHECK(refused("\r\n", Got::BAD_FORM));
    CHECK(refused("h 1\x7f*0000\n", Got::BAD_FORM));
    for (char first : {'1', '2', '3', '4'}) CHECK(refused("h 7*" + std::string(1, first) + "00D\n", Got::BAD_CRC));
}

TEST(bytes_between_space_and_tilde_only) {
    FrameReader reader;
    CHECK(feed(&reader, framed("~ 1")) == Got::FRAME);
    CHECK(feed(&reader, framed("  1")) == Got::FRAME);  // a space is a letter that nobody obeys
    CHECK_EQ(reader.frame().letter, ' ');
}

TEST(malformed_numbers_are_refused) {
    for (const char *text : {"h 1234567890", "h -", "h  1", "h 1 ", "h+1", "h 1 2 3 4", "h 1a", "h --1", "h 1-", "h,1", "h 1.5",
                             "h nan", "hh 1", "s 1 2 3 "}) {
        CHECK(refused(framed(text), Got::BAD_FORM));
    }
}

TEST(an_endless_line_costs_only_itself) {
    CHECK(refused(std::string(40, 'h') + "h\n", Got::BAD_FORM));
    CHECK(refused(std::string(5000, 'h') + framed("h 1"), Got::BAD_FORM));
    FrameReader reader;
    CHECK(feed(&reader, framed("s 65535 -123456789 -123456789")) == Got::FRAME);
}

TEST(a_line_of_exactly_the_room_is_read_whole) {
    CHECK(refused(framed(std::string(35, 'h')), Got::BAD_FORM));  // CRC right, so it was not cut
    CHECK(refused(framed(std::string(36, 'h')), Got::BAD_FORM));
    FrameReader reader;
    std::string wrong = framed(std::string(35, 'h'));
    wrong[36] = 'x';
    CHECK(feed(&reader, wrong) == Got::BAD_CRC);
}

TEST(lines_write_what_they_are_told) {
    Line line('e', 65535);
    line.number(-2147483647 - 1).number(2147483647).count(4294967295u).number(0).hex(0xBEEF, 4).hex(5, 2).word("abc");
    line.finish();
    const std::string text(line.text(), line.length());
    CHECK(text == framed("e 65535 -2147483648 2147483647 4294967295 0 BEEF 05 abc"));
}

TEST(a_line_without_room_is_cut) {
    Line line('e', 1);
    for (int i = 0; i < 20; ++i) line.number(-2147483647);
    line.finish();
    CHECK_EQ(line.length(), 120);
}

// ---- encoder

TEST(encoder_counts_four_per_cycle_both_ways) {
    Encoder encoder;
    encoder.start(0);
    for (int i = 1; i <= 4000; ++i) encoder.edge(TURN[i & 3]);
    CHECK_EQ(encoder.count(), 4000u);
    for (int i = 3999; i >= -10; --i) encoder.edge(TURN[i & 3]);
    CHECK_EQ(static_cast<int32_t>(encoder.count()), -10);
    CHECK_EQ(encoder.illegal(), 0);
}

TEST(encoder_every_transition) {
    for (int before = 0; before < 4; ++before) {
        for (int after = 0; after < 4; ++after) {
            Encoder encoder;
            encoder.start(static_cast<uint8_t>(TURN[before] | 0xFC));
            encoder.edge(static_cast<uint8_t>(TURN[after] | 0xA4));
            const int step = (after - before) & 3;
            CHECK_EQ(static_cast<int32_t>(encoder.count()), step == 1 ? 1 : step == 3 ? -1 : 0);
            CHECK_EQ(encoder.illegal(), step == 2 ? 1 : 0);
        }
    }
}

TEST(encoder_starts_anew_and_takes_hardware_counts) {
    Encoder encoder;
    encoder.set(0xFFFFFFFFu, 7);
    CHECK_EQ(encoder.illegal(), 7);
    encoder.edge(2);
    CHECK_EQ(encoder.count(), 0u);  // wraps
    encoder.edge(0);
    CHECK_EQ(encoder.count(), 0xFFFFFFFFu);
    encoder.start(3);
    CHECK_EQ(encoder.count(), 0u);
    CHECK_EQ(encoder.illegal(), 0);
    encoder.edge(1);
    CHECK_EQ(encoder.count(), 1u);
}
