// SPDX-License-Identifier: Apache-2.0
// While the tests of this folder run, a division of a number by zero ends the process: none of what
// a frame does may rely on infinities that come out of one. Overflow is not trapped, as some tests
// ask for forces and speeds beyond all numbers, nor are operations on what is no number, which
// Embree's boxes of nothing and tests of such settings have.
#include <cfenv>

#include <gtest/gtest.h>

namespace palpate {
namespace {

class DivisionByZeroTraps : public testing::Environment {
public:
    void SetUp() override { feenableexcept(FE_DIVBYZERO); }
    void TearDown() override { fedisableexcept(FE_DIVBYZERO); }
};
const testing::Environment* const traps =
    testing::AddGlobalTestEnvironment(new DivisionByZeroTraps); // gtest deletes it

double divided(double a, double b) {
    const volatile double divisor = b;
    const volatile double result = a / divisor; // nobody may leave it out
    return result;
}

TEST(FloatingPointTraps, ControlADivisionByZeroEndsTheProcess) {
    ASSERT_NE(traps, nullptr);
    EXPECT_DEATH(divided(1.0, 0.0), ""); // by SIGFPE, which a sanitizer may take
    EXPECT_EQ(divided(1.0, 4.0), 0.25);
}

} // namespace
} // namespace palpate
