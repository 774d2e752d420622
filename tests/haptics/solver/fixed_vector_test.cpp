// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <palpate/geometry/vec.h>
#include <palpate/haptics/solver/fixed_vector.h>

namespace palpate {
namespace {

using Few = FixedVector<Vec3, 3>;

TEST(FixedVector, HoldsWhatWasPutInUntilItIsFull) {
    Few few;
    EXPECT_TRUE(few.empty());
    for (int i = 0; i < 3; ++i) {
        EXPECT_FALSE(few.full());
        few.push_back(Vec3{1.0 * i});
    }
    EXPECT_TRUE(few.full());
    EXPECT_EQ(few, (Few{Vec3{0.0}, Vec3{1.0}, Vec3{2.0}}));
    few.pop_back();
    EXPECT_EQ(few, (Few{Vec3{0.0}, Vec3{1.0}}));
}

TEST(FixedVector, ACopyIsOfItsOwn) {
    Few few(2, Vec3{5.0});
    Few copy = few;
    few[0] = Vec3{7.0};
    EXPECT_EQ(copy, (Few{Vec3{5.0}, Vec3{5.0}}));
    copy = Few{Vec3{1.0}};
    EXPECT_EQ(copy.size(), 1u);
    copy = *&copy;
    EXPECT_EQ(copy, Few{Vec3{1.0}});
}

TEST(FixedVector, AsASpanItIsAsLongAsItIs) {
    const Few few{Vec3{1.0}, Vec3{2.0}};
    const std::span<const Vec3> span = few;
    ASSERT_EQ(span.size(), 2u);
    EXPECT_EQ(span[1], Vec3{2.0});
}

} // namespace
} // namespace palpate
