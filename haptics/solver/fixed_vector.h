// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <initializer_list>
#include <memory>
#include <span>
#include <type_traits>

namespace palpate {

/// A few plain values in a row, with room for `Capacity` and no allocation. Room that is not used
/// is neither cleared nor copied: what holds two planes of a possible 32 costs two. Indices
/// are below size(), and size() stays within the capacity: the caller sees to both.     [any]
template <class T, std::size_t Capacity>
class FixedVector {
    static_assert(std::is_nothrow_copy_constructible_v<T> && std::is_trivially_destructible_v<T>);

public:
    FixedVector() noexcept {}
    /// `count` copies, at most Capacity.                                                    [loop]
    FixedVector(std::size_t count, const T& value) noexcept { assign(count, value); }
    /// At most Capacity values.                                                             [loop]
    FixedVector(std::initializer_list<T> values) noexcept {
        for (const T& value : values)
            push_back(value);
    }
    FixedVector(const FixedVector& other) noexcept { *this = other; } ///< [loop]
    /// Copies what is in use, not the whole capacity.                                       [loop]
    FixedVector& operator=(const FixedVector& other) noexcept {
        if (this == &other) return *this;
        clear();
        for (const T& value : other)
            push_back(value);
        return *this;
    }
    ~FixedVector() = default;

    void clear() noexcept { size_ = 0; } ///< [loop]
    /// `count` copies and nothing else, at most Capacity.                                   [loop]
    void assign(std::size_t count, const T& value) noexcept {
        clear();
        while (size_ < count)
            push_back(value);
    }
    /// Not when full().                                                                     [loop]
    void push_back(const T& value) noexcept {
        assert(size_ < Capacity);
        std::construct_at(values_ + size_, value);
        ++size_;
    }
    void pop_back() noexcept { --size_; } ///< not when empty()  [loop]

    std::size_t size() const noexcept { return size_; }      ///< [loop]
    bool empty() const noexcept { return size_ == 0; }       ///< [loop]
    bool full() const noexcept { return size_ == Capacity; } ///< no push_back() any more  [loop]
    /// i < size().                                                                          [loop]
    T& operator[](std::size_t i) noexcept {
        assert(i < size_);
        return values_[i];
    }
    /// The same of a constant one.                                                          [loop]
    const T& operator[](std::size_t i) const noexcept {
        assert(i < size_);
        return values_[i];
    }
    T* begin() noexcept { return values_; }                   ///< [loop]
    T* end() noexcept { return values_ + size_; }             ///< [loop]
    const T* begin() const noexcept { return values_; }       ///< [loop]
    const T* end() const noexcept { return values_ + size_; } ///< [loop]
    /// Of what is in use; valid until the next change.                                      [loop]
    operator std::span<const T>() const noexcept { return {values_, size_}; }
    /// Whether as many elements are in use, and each is equal.                              [loop]
    friend bool operator==(const FixedVector& a, const FixedVector& b) noexcept {
        return std::equal(a.begin(), a.end(), b.begin(), b.end());
    }

private:
    union {
        T values_[Capacity]; // in a union, where nothing constructs it
    };
    std::size_t size_ = 0;
};

} // namespace palpate
