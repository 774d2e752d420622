// SPDX-License-Identifier: Apache-2.0
#pragma once

// Sanitizers make system calls of their own.
#if defined(__linux__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define PALPATE_HAS_SYSTEM_CALL_FILTER

#include <cerrno>
#include <cstddef>
#include <iterator>

#include <linux/filter.h>
#include <linux/seccomp.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <unistd.h>

namespace palpate::test {

/// From here on this process may only end, or make the call that is allowed; anything else kills
/// it, other libraries' threads included. False where the kernel has no such filter.
inline bool forbid_system_calls(unsigned allowed = SYS_exit_group) {
    sock_filter rules[] = {
        BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, nr)),
        BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SYS_exit_group, 2, 0),
        BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, allowed, 1, 0),
        BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_KILL_PROCESS),
        BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW),
    };
    const sock_fprog program{static_cast<unsigned short>(std::size(rules)), rules};
    return prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0 &&
           prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program) == 0;
}

/// From here on this process, all its threads, finds no file by its name: none can be looked at,
/// opened, made or removed (EACCES). Files that are open may be used. False where the kernel has no
/// such filter.
inline bool hide_files() {
    constexpr unsigned of_files[] = {
        SYS_open,   SYS_openat,    SYS_creat,     SYS_stat,       SYS_lstat,  SYS_statx,
        SYS_access, SYS_faccessat, SYS_mkdir,     SYS_mkdirat,    SYS_unlink, SYS_unlinkat,
        SYS_rename, SYS_renameat,  SYS_renameat2, SYS_newfstatat, SYS_chdir};
    constexpr std::size_t count = std::size(of_files);
    sock_filter rules[count + 3] = {BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, nr))};
    for (std::size_t i = 0; i < count; ++i)
        rules[i + 1] = BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, of_files[i],
                                static_cast<unsigned char>(count - i), 0);
    rules[count + 1] = BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW);
    rules[count + 2] = BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ERRNO | EACCES);
    const sock_fprog program{static_cast<unsigned short>(std::size(rules)), rules};
    return prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0 &&
           syscall(SYS_seccomp, SECCOMP_SET_MODE_FILTER, SECCOMP_FILTER_FLAG_TSYNC, &program) == 0;
}

} // namespace palpate::test
#endif
