// SPDX-License-Identifier: Apache-2.0
#pragma once

#if defined(__x86_64__)
#include <xmmintrin.h>
#endif

namespace palpate::internal {

/// How a frame computes, whatever the caller's mode: rounds to nearest and traps nothing, so that
/// it has the same bits everywhere; denormal numbers, which cost hundreds of cycles each, are zero.
/// The caller's mode is restored after it.
class FrameArithmetic {
public:
#if defined(__x86_64__)
    FrameArithmetic() noexcept : callers_(_mm_getcsr()) { _mm_setcsr(kOfFrames); }
    ~FrameArithmetic() { _mm_setcsr(callers_); }

private:
    static constexpr unsigned kAllTrapsMasked = 0x1f80;
    static constexpr unsigned kFlushToZero = 0x8000, kDenormalsAreZero = 0x0040;
    static constexpr unsigned kOfFrames = kAllTrapsMasked | kFlushToZero | kDenormalsAreZero;
    unsigned callers_;
#else
    FrameArithmetic() noexcept {}
#endif
};

} // namespace palpate::internal
