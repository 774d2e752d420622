// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <exception>
#include <new>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>

#include <palpate/geometry/vec.h>
#include <palpate/palpate_c.h>

/// What every function of the C interface does: it looks at what it was given, and lets no
/// exception out.
namespace palpate::c {

/// A mistake of the caller's, told apart from a scene's.
struct BadCall : std::invalid_argument {
    using std::invalid_argument::invalid_argument;
};

inline void require(bool holds, const std::string& what) {
    if (!holds) throw BadCall(what);
}

/// Says what went wrong, as far as there is room.
inline palpate_code fail(palpate_error* error, palpate_code code,
                         std::string_view message) noexcept {
    if (error == nullptr || error->size < sizeof(palpate_error)) return code;
    error->code = code;
    constexpr std::string_view cut = "...";
    const std::size_t room = sizeof error->message - 1;
    const bool fits = message.size() <= room;
    std::size_t size = fits ? message.size() : room - cut.size();
    const auto continues = [&] { return (static_cast<unsigned char>(message[size]) >> 6) == 0b10; };
    while (!fits && size > 0 && continues()) // a character of UTF-8 is not cut
        --size;
    char* end = std::copy_n(message.data(), size, error->message);
    if (!fits) end = std::copy(cut.begin(), cut.end(), end);
    *end = '\0';
    std::replace(error->message, end, '\n', ' ');
    return code;
}

/// Does `call`, and turns what it throws into a code with its message.
template <class Call>
palpate_code guarded(palpate_error* error, const Call& call) noexcept {
    if (error != nullptr && error->size >= sizeof(palpate_error)) {
        error->code = PALPATE_OK;
        error->message[0] = '\0';
    }
    try {
        call();
        return PALPATE_OK;
    } catch (const BadCall& mistake) {
        return fail(error, PALPATE_BAD_CALL, mistake.what());
    } catch (const std::bad_alloc&) {
        return fail(error, PALPATE_NO_MEMORY, "not enough memory");
    } catch (const std::length_error&) { // more elements than there are addresses
        return fail(error, PALPATE_NO_MEMORY, "not enough memory");
    } catch (const std::invalid_argument& mistake) {
        return fail(error, PALPATE_BAD_INPUT, mistake.what());
    } catch (const std::runtime_error& mistake) {
        return fail(error, PALPATE_BAD_INPUT, mistake.what());
    } catch (const std::exception& mistake) {
        return fail(error, PALPATE_INTERNAL, mistake.what());
    } catch (...) {
        return fail(error, PALPATE_INTERNAL, "an unknown exception");
    }
}

/// A struct of the caller's as this library knows it: what the caller's version of it did not have
/// is 0.
template <class Struct>
Struct known(const Struct& given) noexcept {
    Struct all{};
    std::memcpy(&all, &given, std::min(given.size, sizeof all));
    return all;
}

/// The same where NULL is allowed; throws BadCall where its size cannot be true. `first`: the size
/// of its first version, whose programs are still served.
template <class Struct>
Struct known(const Struct* given, std::size_t first, const char* name) {
    if (given == nullptr) return {};
    require(given->size >= first,
            std::string(name) + ": size is too small; set it to sizeof(" + name + ")");
    // One that ends within a pointer would leave half of it.
    require(given->size % alignof(Struct) == 0,
            std::string(name) + ": no struct has this size; set it to sizeof(" + name + ")");
    return known(*given);
}

/// What a function writes to a struct of the caller's, as much of it as the caller knows.
template <class Struct>
void tell(Struct found, Struct& to) noexcept {
    found.size = to.size;
    std::memcpy(&to, &found, std::min(found.size, sizeof found));
}

/// Whether the first size of a caller's array may count for all of its entries. One that was never
/// set must not lead beyond the array.
template <class Struct>
bool is_array(const Struct* array, std::size_t first) noexcept {
    constexpr std::size_t kMost = 4096; // no struct of any version
    return array != nullptr && array->size >= first && array->size <= kMost &&
           array->size % alignof(Struct) == 0;
}

/// Entry i of a caller's array, whose structs may be longer than ours, or shorter.
template <class Struct>
Struct& entry(Struct* array, std::size_t stride, std::size_t i) noexcept {
    using Byte = std::conditional_t<std::is_const_v<Struct>, const char, char>;
    return *reinterpret_cast<Struct*>(reinterpret_cast<Byte*>(array) + stride * i);
}

/// Writes `list`, entry by entry as `convert` makes it, to a caller's array.
template <class Struct, class List, class Convert>
palpate_code tell_list(const List& list, Struct* to, std::size_t capacity, std::size_t* count,
                       std::size_t first, const Convert& convert) noexcept {
    if (count == nullptr || (capacity > 0 && !is_array(to, first))) return PALPATE_BAD_CALL;
    *count = list.size();
    const std::size_t stride = capacity > 0 ? to->size : 0;
    for (std::size_t i = 0; i < std::min(capacity, list.size()); ++i) {
        Struct& written = entry(to, stride, i);
        written.size = stride;
        tell(convert(list[i]), written);
    }
    return PALPATE_OK;
}

inline Vec3 vec(const double (&of)[3]) noexcept { return {of[0], of[1], of[2]}; }

inline void put(const Vec3& value, double (&to)[3]) noexcept {
    for (int i = 0; i < 3; ++i)
        to[i] = value[i];
}

} // namespace palpate::c
