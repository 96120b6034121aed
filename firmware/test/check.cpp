// Runs every test; `--first` stops at the first failure (for the mutation run).
#include "check.h"

#include <stdlib.h>
#include <string.h>

namespace check {

static Test *all = nullptr;
static int failures = 0;
static bool first_only = false;

Test::Test(const char *n, void (*b)()) : name(n), body(b), next(all) { all = this; }

void failed(const char *file, int line, const std::string &what) {
    ++failures;
    if (failures <= 20) printf("%s:%d: %s\n", file, line, what.c_str());
    if (first_only) _Exit(1);
}

}  // namespace check

int main(int count, char **arguments) {
    check::first_only = count > 1 && strcmp(arguments[1], "--first") == 0;
    int run = 0, bad = 0;
    for (check::Test *test = check::all; test; test = test->next, ++run) {
        const int before = check::failures;
        test->body();
        if (check::failures == before) continue;
        printf("FAILED %s\n", test->name);
        ++bad;
    }
    printf("%d tests, %d failed\n", run, bad);
    return bad ? 1 : 0;
}
