// SPDX-License-Identifier: Apache-2.0
// Linked to test_threads alone. ThreadSanitizer does not see how Debian's TBB hands work from thread
// to thread, and would take that for races: here TBB has one thread, the caller's.
#include <tbb/global_control.h>

namespace {
const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
} // namespace
