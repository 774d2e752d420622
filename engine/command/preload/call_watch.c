/* SPDX-License-Identifier: Apache-2.0 */
/* Counts what a thread allocates, and how long it waits for locks, between palpate_watch_begin()
   and palpate_watch_end(). `palpate validate` preloads it into the processes of its checks
   (LD_PRELOAD); nothing else does. It stands before the C library's functions and calls them. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <pthread.h>
#include <stddef.h>
#include <stdint.h>
#include <time.h>

#define EXPORT __attribute__((visibility("default")))
#define OF_THREAD static __thread __attribute__((tls_model("initial-exec")))

OF_THREAD int is_watched;
OF_THREAD uint64_t allocations;
OF_THREAD uint64_t locks;
OF_THREAD double longest_wait_s;

EXPORT void palpate_watch_begin(void);
EXPORT void palpate_watch_end(uint64_t* counted, uint64_t* locked, double* waited_s);

void palpate_watch_begin(void) {
    allocations = 0;
    locks = 0;
    longest_wait_s = 0.0;
    is_watched = 1;
}

void palpate_watch_end(uint64_t* counted, uint64_t* locked, double* waited_s) {
    is_watched = 0;
    *counted = allocations;
    *locked = locks;
    *waited_s = longest_wait_s;
}

/* The C library's own, under its other names: dlsym() itself allocates.
   NOLINTBEGIN(clang-diagnostic-reserved-identifier) */
void* __libc_malloc(size_t size);
void* __libc_calloc(size_t count, size_t size);
void* __libc_realloc(void* block, size_t size);
void* __libc_memalign(size_t alignment, size_t size);
/* NOLINTEND(clang-diagnostic-reserved-identifier) */

static void count(void) {
    if (is_watched) ++allocations;
}

EXPORT void* malloc(size_t size) {
    count();
    return __libc_malloc(size);
}
EXPORT void* calloc(size_t number, size_t size) {
    count();
    return __libc_calloc(number, size);
}
EXPORT void* realloc(void* block, size_t size) {
    count();
    return __libc_realloc(block, size);
}
EXPORT void* memalign(size_t alignment, size_t size) {
    count();
    return __libc_memalign(alignment, size);
}
EXPORT void* aligned_alloc(size_t alignment, size_t size) {
    count();
    return __libc_memalign(alignment, size);
}
EXPORT int posix_memalign(void** block, size_t alignment, size_t size) {
    count();
    *block = __libc_memalign(alignment, size);
    return *block != NULL ? 0 : ENOMEM;
}

static double seconds(const struct timespec* time) {
    return (double)time->tv_sec + 1e-9 * (double)time->tv_nsec;
}

/* A function of the C library that waits for a lock, watched. */
#define WATCHED(name, parameters, ...)                                                             \
    EXPORT int name parameters {                                                                   \
        static int(*real) parameters;                                                              \
        struct timespec before, after;                                                             \
        int(*lock) parameters = __atomic_load_n(&real, __ATOMIC_RELAXED);                          \
        if (lock == NULL) {                                                                        \
            *(void**)&lock = dlsym(RTLD_NEXT, #name);                                              \
            __atomic_store_n(&real, lock, __ATOMIC_RELAXED);                                       \
        }                                                                                          \
        if (!is_watched) return lock(__VA_ARGS__);                                                 \
        ++locks;                                                                                   \
        clock_gettime(CLOCK_MONOTONIC, &before);                                                   \
        const int result = lock(__VA_ARGS__);                                                      \
        clock_gettime(CLOCK_MONOTONIC, &after);                                                    \
        const double waited_s = seconds(&after) - seconds(&before);                                \
        if (waited_s > longest_wait_s) longest_wait_s = waited_s;                                  \
        return result;                                                                             \
    }

WATCHED(pthread_mutex_lock, (pthread_mutex_t * mutex), mutex)
WATCHED(pthread_mutex_timedlock, (pthread_mutex_t * mutex, const struct timespec* abstime), mutex,
        abstime)
WATCHED(pthread_mutex_clocklock,
        (pthread_mutex_t * mutex, clockid_t clockid, const struct timespec* abstime), mutex,
        clockid, abstime)
WATCHED(pthread_rwlock_rdlock, (pthread_rwlock_t * rwlock), rwlock)
WATCHED(pthread_rwlock_wrlock, (pthread_rwlock_t * rwlock), rwlock)
