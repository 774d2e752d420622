// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/text/base64.h>

#include <array>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>

namespace palpate {
namespace {

TEST(Base64, GivesAndReadsTheValuesOfRfc4648) {
    const std::array<std::array<std::string, 2>, 8> values{{{"", ""},
                                                            {"f", "Zg=="},
                                                            {"fo", "Zm8="},
                                                            {"foo", "Zm9v"},
                                                            {"foob", "Zm9vYg=="},
                                                            {"fooba", "Zm9vYmE="},
                                                            {"foobar", "Zm9vYmFy"},
                                                            {"\xff\xfe\xfd", "//79"}}};
    for (const auto& [bytes, text] : values) {
        EXPECT_EQ(base64(bytes), text);
        EXPECT_EQ(bytes_of_base64(text), bytes);
    }
}

TEST(Base64, OtherTextIsRefused) {
    for (const char* const text : {"Zg=", "Zg", "Z===", "====", "Zm9v\n", "Zm-v", "Zg==Zg=="})
        EXPECT_THROW(bytes_of_base64(text), std::invalid_argument) << text;
}

} // namespace
} // namespace palpate
