// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/voxel_numbers.h>

#include <memory>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace palpate {
namespace {

using Numbers = VoxelNumbers<float>;

const std::vector<float> kFour{4.0F, 3.0F, 2.0F, 1.0F};

struct Program {
    std::shared_ptr<std::vector<float>> memory = std::make_shared<std::vector<float>>(kFour);

    Numbers view() const { return Numbers::view(*memory, memory); }
};

TEST(VoxelNumbers, AViewReadsAsItsNumbersDo) {
    const Program program;
    const Numbers view = program.view();
    EXPECT_TRUE(view.is_view());
    EXPECT_EQ(view.data(), program.memory->data());
    EXPECT_EQ(view.size(), 4u);
    EXPECT_FALSE(view.empty());
    EXPECT_EQ(view, kFour);
    EXPECT_EQ(std::vector<float>(view.begin(), view.end()), kFour);
    EXPECT_EQ(view[1], 3.0F);
    EXPECT_EQ(view.front(), 4.0F);
    EXPECT_EQ(view.back(), 1.0F);
    EXPECT_FALSE(view == (Numbers{4.0F, 3.0F, 2.0F}));
}

TEST(VoxelNumbers, ACopyOfAViewIsTheSameViewAndKeepsTheMemory) {
    Program program;
    const std::weak_ptr<std::vector<float>> memory = program.memory;
    auto first = std::make_unique<const Numbers>(program.view()); // const: it is only looked at
    const Numbers second = *first;
    EXPECT_EQ(second.data(), first->data());
    program.memory = nullptr;
    first = nullptr;
    EXPECT_FALSE(memory.expired());
    EXPECT_EQ(second, kFour);
}

TEST(VoxelNumbers, WhatChangesAViewCopiesItAndLetsGoOfTheMemory) {
    const std::vector<void (*)(Numbers&)> changes{
        [](Numbers& n) { n[0] = 9.0F; },
        [](Numbers& n) { n.front() = 9.0F; },
        [](Numbers& n) { n.back() = 9.0F; },
        [](Numbers& n) { n.data()[2] = 9.0F; },
        [](Numbers& n) { *n.begin() = 9.0F; },
        [](Numbers& n) { *(n.end() - 1) = 9.0F; },
        [](Numbers& n) { n.push_back(9.0F); },
        [](Numbers& n) { n.pop_back(); },
        [](Numbers& n) { n.resize(7, 9.0F); },
        [](Numbers& n) { n.assign(std::size_t{3}, 9.0F); },
        [](Numbers& n) {
            n.insert(n.end(), {9.0F, 8.0F});
        },
        [](Numbers& n) { n.insert(n.begin(), kFour.begin(), kFour.end()); },
        [](Numbers& n) { n.erase(n.begin(), n.begin() + 2); },
        [](Numbers& n) { n = {9.0F}; },
    };
    for (std::size_t i = 0; i < changes.size(); ++i) {
        const Program program;
        Numbers changed = program.view(), own = kFour;
        changes[i](changed);
        changes[i](own);
        EXPECT_FALSE(changed.is_view()) << i;
        EXPECT_EQ(changed, own) << i;
        EXPECT_FALSE(changed == kFour) << i;
        EXPECT_EQ(*program.memory, kFour) << i;
        EXPECT_EQ(program.memory.use_count(), 1) << i;
    }
}

TEST(VoxelNumbers, AMovedViewIsTheView) {
    const Program program;
    Numbers from = program.view();
    const Numbers to = std::move(from);
    EXPECT_EQ(to.data(), program.memory->data());
    EXPECT_EQ(program.memory.use_count(), 2);
}

} // namespace
} // namespace palpate
