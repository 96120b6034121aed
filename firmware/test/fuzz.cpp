// Fuzzes what a computer may say to the board: random bytes and damaged, forged, stale, extreme lines, judged by a model of the
// protocol written apart from the core. Usage: fuzz BYTES SEED [SECONDS]; with SECONDS it goes on so long, BYTES at a time.
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include "desk.h"
#include "flags.h"

using namespace chefbot;

namespace {

typedef std::string Text;

struct Chance {
    uint64_t state;
    uint32_t next() {  // PCG, O'Neill 2014
        const uint64_t old = state;
        state = old * 6364136223846793005ull + 1442695040888963407ull;
        const uint32_t mixed = static_cast<uint32_t>(((old >> 18) ^ old) >> 27), turn = static_cast<uint32_t>(old >> 59);
        return (mixed >> turn) | (mixed << ((32 - turn) & 31));
    }
    int below(int n) { return static_cast<int>(next() % static_cast<uint32_t>(n)); }
    bool one_in(int n) { return below(n) == 0; }
};

// ---- the model: what the board must do with a line ------------------------------------------------------------------

struct Said {
    bool whole, crc;  // a line of the protocol's form; a right CRC
    char letter;
    std::vector<long> numbers;
};

bool is_number(const Text &text) {
    const size_t start = text[0] == '-' ? 1 : 0;
    if (text.size() <= start || text.size() - start > 9) return false;
    return text.find_first_not_of("0123456789", start) == Text::npos;
}

Said read(const Text &line) {
    Said said = {false, false, 0, {}};
    if (line.size() < 6 || line.size() > 40) return said;
    for (char c : line) {
        if (c < ' ' || c > '~') return said;
    }
    const Text body = line.substr(0, line.size() - 5);
    said.whole = true;
    said.crc = framed(body) == line + "\n";
    if (!said.crc) return said;
    const std::vector<Text> words = split(body.substr(1), ' ');
    said.letter = body[0];
    said.whole = words[0].empty() && words.size() <= 4;
    for (size_t i = 1; i < words.size() && said.whole; ++i) {
        said.whole = !words[i].empty() && is_number(words[i]);
        if (said.whole) said.numbers.push_back(atol(words[i].c_str()));
    }
    return said;
}

struct Model {
    bool open = false, latched = false, neutral = true, fresh = false, moving = false;
    unsigned last = 0;
    uint64_t step = 0, heard = 0, commanded = 0, rested = 0;
    unsigned long accepted = 0, refused = 0;

    int judge(const Said &said) {
        if (!said.whole) return 2;
        if (!said.crc) return 1;
        const size_t n = said.numbers.size();
        if (said.letter == 'v' && n == 2) return shake(said);
        if (said.letter == 'x' && n == 1) {
            latched = true;
            return 0;
        }
        const bool known = (said.letter == 's' && n == 3) || (Text("hcr").find(said.letter) != Text::npos && n == 1);
        if (!known) return 4;
        const long ahead = said.numbers[0] - static_cast<long>(last), wrapped = ((ahead % 65536) + 65536) % 65536;
        if (said.numbers[0] < 0 || said.numbers[0] > 65535 || !open || wrapped < 1 || wrapped > 256) return 3;
        last = static_cast<unsigned>(said.numbers[0]);
        heard = step;
        return in_session(said);
    }
    int shake(const Said &said) {
        if (said.numbers[1] != 1) return 5;
        last = (last + 0x1000 + (step & 0xFFF)) & 0xFFFF;
        heard = step;
        open = neutral = true;
        fresh = false;
        return 0;
    }
    int in_session(const Said &said) {
        if (said.letter == 'h') return 0;
        if (said.letter == 'r') {
            const unsigned long keep = accepted, lost = refused;
            *this = Model();
            accepted = keep, refused = lost;
            return 0;
        }
        if (said.letter == 'c') {
            latched = false;
            neutral = true;
            moving = false;
            return 0;
        }
        commanded = step;
        const bool zero = said.numbers[1] == 0 && said.numbers[2] == 0;
        if (latched) return 6;
        if (neutral && !zero) return 7;
        neutral = false;
        fresh = true;
        moving = !zero;
        return 0;
    }
    void tick() {
        ++step;
        if (open && step - heard >= 100) open = false;
        if (!open || step - commanded >= 15 || latched) fresh = false;
        if (latched) neutral = true;
        if (!fresh) moving = false;
    }
};

// ---- what is said ---------------------------------------------------------------------------------------------------

long extreme(Chance *chance) {
    static const long VALUES[] = {0, 1, -1, 9, 127, 128, 255, 256, 32767, 32768, 65535, 65536, 999999999, -999999999, 100000, -32768};
    return VALUES[chance->below(sizeof VALUES / sizeof VALUES[0])];
}

Text good_line(Chance *chance, const Model &model) {
    unsigned sequence = model.last + 1;
    if (chance->one_in(6)) sequence = model.last + static_cast<unsigned>(chance->below(600)) - 150;
    Text text;
    const int kind = chance->below(20);
    const Text head = " " + std::to_string(chance->one_in(30) ? extreme(chance) : static_cast<long>(sequence & 0xFFFF));
    if (kind < 9) text = "s" + head + " " + std::to_string(chance->below(20001) - 10000) + " " + std::to_string(chance->below(20001) - 10000);
    else if (kind < 12) text = "s" + head + " 0 0";
    else if (kind < 13) text = "s" + head + " " + std::to_string(extreme(chance)) + " " + std::to_string(extreme(chance));
    else if (kind < 15) text = "h" + head;
    else if (kind < 17) text = "c" + head;
    else if (kind < 18) text = chance->one_in(4) ? "x" + head : "h" + head;
    else if (kind < 19) text = chance->one_in(2) || !model.open ? "v " + std::to_string(chance->below(1000)) + (chance->one_in(5) ? " 2" : " 1") : "h" + head;
    else text = chance->one_in(8) ? "r" + head : Text(1, static_cast<char>(' ' + chance->below(95))) + head;
    return text;
}

void damage(Chance *chance, Text *line) {
    const size_t at = static_cast<size_t>(chance->below(static_cast<int>(line->size())));
    switch (chance->below(7)) {
        case 0: (*line)[at] = static_cast<char>((*line)[at] ^ (1 << chance->below(8))); break;
        case 1: line->erase(at, 1 + static_cast<size_t>(chance->below(3))); break;
        case 2: line->insert(at, 1, static_cast<char>(chance->below(256))); break;
        case 3: line->insert(at, line->substr(at)); break;
        case 4: line->resize(at); break;
        case 5: (*line)[at] = static_cast<char>(chance->below(256)); break;
        default: std::swap((*line)[at], (*line)[(at + 1) % line->size()]);
    }
}

Text forged(Chance *chance, const Model &model) {  // malformed, CRC right
    static const char *const WORDS[] = {"nan", "inf", "1e9", "+1", "--1", "0x10", "", " ", "-", "1234567890", "9999999999999", "*", "**ABCD"};
    Text text = good_line(chance, model);
    if (chance->one_in(2)) damage(chance, &text);
    else text += Text(" ") + WORDS[chance->below(sizeof WORDS / sizeof WORDS[0])];
    return framed(text.substr(0, text.find('\n')));
}

Text noise(Chance *chance) {
    Text text;
    const bool printable = chance->one_in(2);
    for (int n = 1 + chance->below(90); n > 0; --n) text += static_cast<char>(printable ? ' ' + chance->below(95) : chance->below(256));
    if (chance->one_in(2)) text += '\n';
    return text;
}

Text something(Chance *chance, const Model &model) {
    const int kind = chance->below(10);
    if (kind < 5) return framed(good_line(chance, model));
    if (kind < 7) {
        Text line = framed(good_line(chance, model));
        for (int n = 1 + chance->below(3); n > 0 && !line.empty(); --n) damage(chance, &line);
        return line;
    }
    return kind < 8 ? forged(chance, model) : noise(chance);
}

// ---- the judge ------------------------------------------------------------------------------------------------------

void fail(const char *what, const Text &line, const Model &model) {
    printf("fuzz: %s, at step %llu, after the line: ", what, static_cast<unsigned long long>(model.step));
    for (char c : line) printf(c < ' ' || c > '~' ? "\\x%02x" : "%c", static_cast<unsigned char>(c));
    printf("\n");
    exit(1);
}

struct Bench {
    Desk desk;
    Model model;
    Text part;
    uint64_t motions = 0, steps = 0;

    // Byte by byte, so that every line is judged by itself.
    void say(const Text &bytes) {
        for (char c : bytes) {
            desk.write(Text(1, c));
            if (c != '\n') {
                part += c;
                continue;
            }
            end_of_line();
        }
    }
    void end_of_line() {
        const unsigned before = desk.state().refused;
        const uint32_t restarts = desk.state().restarts;
        chefbot_board_advance(desk.board, 0);
        const int expected = part.empty() ? 0 : model.judge(read(part));
        const chefbot_board_state now = desk.state();
        const bool restarted = now.restarts != restarts;
        if (!restarted && now.refused != ((before + (expected != 0)) & 0xFFFF)) fail(expected ? "a line was obeyed that must not be" : "a good line was refused", part, model);
        if (!restarted && expected && now.refusal != expected) fail("a line was refused for the wrong reason", part, model);
        if (now.refused == 0 && restarted && expected) fail("restarted by a bad line", part, model);
        ++(expected ? model.refused : model.accepted);
        part.clear();
    }
    void step() {
        chefbot_board_state now = desk.state();
        for (int wheel = 0; wheel < 2; ++wheel) chefbot_board_turn(desk.board, wheel, now.set[wheel] / 100);
        if (model.step % 3 == 0) {
            const int16_t raw[7] = {static_cast<int16_t>(model.step), 0, 8192, -3920, 0, 0, 5};
            chefbot_board_imu(desk.board, raw);
        }
        chefbot_board_advance(desk.board, 10000);
        model.tick();
        now = desk.state();
        const bool moves = now.duty[0] || now.duty[1] || now.set[0] || now.set[1];
        motions += moves;
        ++steps;
        if (moves && !model.fresh) fail("motion without a fresh command", part, model);
        if (!model.moving) ++model.rested;
        else model.rested = 0;
        if (now.set[0] && model.rested > 100) fail("motion a second after the last command to move", part, model);
        for (int wheel = 0; wheel < 2; ++wheel) {
            if (abs(now.set[wheel]) > 10000 || abs(now.duty[wheel]) > 1000) fail("beyond the limits", part, model);
        }
        if (((now.flags & LATCHED) != 0) != model.latched) fail("a fault nobody caused, or one forgotten", part, model);
    }
    void check_lines() {
        desk.run(0);
        for (const Text &line : desk.lines) {
            if (framed(line.substr(0, line.size() - 5)) != line + "\n") fail("the board said a damaged line", line, model);
        }
        desk.lines.clear();
    }
};

unsigned long fuzz(unsigned long bytes, uint64_t seed) {
    Chance chance = {seed * 2654435761u + 1};
    Bench bench;
    unsigned long said = 0;
    for (unsigned round = 0; said < bytes; ++round) {
        const int lines = chance.below(8);
        for (int i = 0; i < lines; ++i) {
            const Text text = something(&chance, bench.model);
            bench.say(text);
            said += text.size();
        }
        bench.step();
        if (chance.one_in(300)) for (int n = chance.below(150); n > 0; --n) bench.step();
        if (round % 64 == 0) bench.check_lines();
    }
    printf("fuzz: %lu bytes, seed %llu: %lu lines accepted, %lu refused, motion in %llu of %llu steps; no fault found\n", said,
           static_cast<unsigned long long>(seed), bench.model.accepted, bench.model.refused,
           static_cast<unsigned long long>(bench.motions), static_cast<unsigned long long>(bench.steps));
    fflush(stdout);
    return said;
}

}  // namespace

int main(int count, char **arguments) {
    if (count < 3) {
        fprintf(stderr, "usage: fuzz BYTES SEED [SECONDS]\n");
        return 2;
    }
    const time_t began = time(nullptr), end = began + (count > 3 ? atol(arguments[3]) : 0);
    uint64_t seed = strtoull(arguments[2], nullptr, 10);
    double said = 0;
    do {
        said += static_cast<double>(fuzz(strtoul(arguments[1], nullptr, 10), seed++));
    } while (time(nullptr) < end);
    const double took = difftime(time(nullptr), began);
    printf("firmware fuzz: %.0f bytes in %.0f s (%.2f MB/s), ASan and UBSan; 0 findings\n", said, took, said / 1e6 / (took > 1 ? took : 1));
    return 0;
}
