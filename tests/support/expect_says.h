// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <gtest/gtest.h>

/// That a message has these words; else all of it is shown.
#define EXPECT_SAYS(message, words)                                                                \
    do {                                                                                           \
        const std::string said_ = (message);                                                       \
        EXPECT_NE(said_.find(words), std::string::npos) << said_;                                  \
    } while (false)
