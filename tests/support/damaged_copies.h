// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <random>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>

namespace palpate::test {

/// Whether `read` takes these bytes; else it has to refuse them in one line with a remedy.
template <class Read>
bool reads_or_says_why(const std::string& bytes, Read read) {
    try {
        read(bytes);
        return true;
    } catch (const std::runtime_error& error) {
        const std::string message = error.what();
        EXPECT_EQ(message.find('\n'), std::string::npos) << message;
        EXPECT_NE(message.find("; "), std::string::npos) << "no remedy: " << message;
        return false;
    }
}

/// Cut off at each `step`-th byte a file is refused; with one byte behind DICOM's preamble changed
/// it is read or refused, some of each.
template <class Read>
void expect_damage_is_survived(const std::string& whole, std::size_t step, unsigned seed,
                               Read read) {
    constexpr std::size_t kPreamble = 132;
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    std::mt19937 random(seed);
    for (std::size_t cut = 0; cut < whole.size(); cut += step)
        EXPECT_FALSE(reads_or_says_why(whole.substr(0, cut), read)) << cut;
    int taken = 0;
    for (int n = 0; n < 300; ++n) {
        std::string damaged = whole;
        damaged[kPreamble + random() % (whole.size() - kPreamble)] = static_cast<char>(random());
        taken += reads_or_says_why(damaged, read);
    }
    EXPECT_GT(taken, 0);
    EXPECT_LT(taken, 300);
}

} // namespace palpate::test
