// A unit test in C++: TEST(name) { CHECK(x); CHECK_EQ(a, b); }. Linked tests register themselves; run_all() runs them.
#pragma once

#include <stdio.h>

#include <string>

namespace check {

struct Test {
    Test(const char *name, void (*body)());
    const char *name;
    void (*body)();
    Test *next;
};

void failed(const char *file, int line, const std::string &what);

template <class A, class B>
void equal(A a, B b, const char *text, const char *file, int line) {
    if (a == b) return;
    failed(file, line, std::string(text) + ": " + std::to_string(a) + " is not " + std::to_string(b));
}

}  // namespace check

#define TEST(name)                                    \
    static void name();                               \
    static check::Test test_of_##name(#name, name);   \
    static void name()
#define CHECK(x) \
    do {         \
        if (!(x)) check::failed(__FILE__, __LINE__, #x); \
    } while (0)
#define CHECK_EQ(a, b) check::equal((a), (b), #a " == " #b, __FILE__, __LINE__)
