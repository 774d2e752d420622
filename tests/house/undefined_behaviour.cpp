// SPDX-License-Identifier: Apache-2.0
// Adds to the greatest int, which nobody may: UndefinedBehaviorSanitizer has to end the process
// there.
#include <climits>
#include <cstdio>

int main(int arguments, char**) {
    volatile int greatest = INT_MAX;
    const int sum = greatest + arguments;
    std::printf("went on with %d\n", sum);
    return 0;
}
