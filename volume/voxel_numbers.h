// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <initializer_list>
#include <memory>
#include <span>
#include <utility>
#include <vector>

namespace palpate {

/// The numbers of a volume: its own, or a view of a program's, which is never written to. It is
/// used as a std::vector. The first call that may change a view copies the numbers; a copy of a
/// view is the same view.
template <class Number>
class VoxelNumbers {
public:
    using value_type = Number; ///< of one voxel
    using iterator = typename std::vector<Number>::iterator; ///< may write
    using const_iterator = const Number*; ///< may read

    VoxelNumbers() = default;
    VoxelNumbers(std::vector<Number> own) noexcept : own_(std::move(own)) {} ///< its own
    VoxelNumbers(std::initializer_list<Number> own) : own_(own) {} ///< its own

    /// Numbers that stay where and as they are while `keeper`, not null, lives. It lives as long as
    /// any view of them.                                                                [setup]
    static VoxelNumbers view(std::span<const Number> numbers, std::shared_ptr<const void> keeper) {
        VoxelNumbers viewed;
        viewed.view_ = numbers;
        viewed.keeper_ = std::move(keeper);
        return viewed;
    }
    bool is_view() const noexcept { return keeper_ != nullptr; } ///< [any]

    // What looks at them. All [any].
    const Number* data() const noexcept { return keeper_ ? view_.data() : own_.data(); } ///< [any]
    std::size_t size() const noexcept { return keeper_ ? view_.size() : own_.size(); } ///< [any]
    bool empty() const noexcept { return size() == 0; } ///< [any]
    const_iterator begin() const noexcept { return data(); } ///< [any]
    const_iterator end() const noexcept { return data() + size(); } ///< [any]
    const Number& operator[](std::size_t i) const noexcept { return data()[i]; } ///< [any]
    const Number& front() const noexcept { return data()[0]; } ///< [any]
    const Number& back() const noexcept { return data()[size() - 1]; } ///< [any]
    friend bool operator==(const VoxelNumbers& a, const VoxelNumbers& b) noexcept {
        return std::equal(a.begin(), a.end(), b.begin(), b.end());
    } ///< number by number

    // What may change them: as std::vector's. All [setup].
    Number* data() { return own().data(); } ///< [setup]
    iterator begin() { return own().begin(); } ///< [setup]
    iterator end() { return own().end(); } ///< [setup]
    Number& operator[](std::size_t i) { return own()[i]; } ///< [setup]
    Number& front() { return own().front(); } ///< [setup]
    Number& back() { return own().back(); } ///< [setup]
    void reserve(std::size_t count) { own().reserve(count); } ///< [setup]
    void push_back(Number number) { own().push_back(number); } ///< [setup]
    void pop_back() { own().pop_back(); } ///< [setup]
    template <class... Arguments>
    void resize(Arguments&&... arguments) {
        own().resize(std::forward<Arguments>(arguments)...);
    } ///< [setup]
    template <class... Arguments>
    void assign(Arguments&&... arguments) {
        own().assign(std::forward<Arguments>(arguments)...);
    } ///< [setup]
    template <class... Arguments>
    void insert(Arguments&&... arguments) {
        own().insert(std::forward<Arguments>(arguments)...);
    } ///< [setup]
    void insert(iterator at, std::initializer_list<Number> numbers) { own().insert(at, numbers); } ///< [setup]
    template <class... Arguments>
    void erase(Arguments&&... arguments) {
        own().erase(std::forward<Arguments>(arguments)...);
    } ///< [setup]

private:
    std::vector<Number>& own() {
        if (keeper_) {
            own_.assign(view_.begin(), view_.end());
            keeper_.reset();
        }
        return own_;
    }

    std::vector<Number> own_;
    std::span<const Number> view_;       // where there is a keeper
    std::shared_ptr<const void> keeper_; // null: the numbers are own_
};

} // namespace palpate
