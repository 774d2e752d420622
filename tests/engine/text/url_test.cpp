// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/text/url.h>

#include <gtest/gtest.h>

namespace palpate {
namespace {

TEST(Url, OnlyWhatMeansNothingElseStaysAsItIs) {
    EXPECT_EQ(percent_encoded("a-Z/0._~"), "a-Z/0._~");
    EXPECT_EQ(percent_encoded("50% #1?.html"), "50%25%20%231%3F.html");
    EXPECT_EQ(percent_encoded("Sch\xc3\xa4"
                              "del\""),
              "Sch%C3%A4del%22");
}

} // namespace
} // namespace palpate
