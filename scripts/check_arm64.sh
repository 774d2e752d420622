#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Checks with Debian's cross compiler that the sources compile for arm64: all whose libraries' headers it finds.
#   scripts/check_arm64.sh [FOLDER...]      by default all that have sources; build/release has to be configured
# Prints what does not compile, and how many sources did; exit status 1 when one did not, 77 where there is no such compiler.
# Nothing is linked or run. It takes minutes.
set -euo pipefail
cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")/.."
compiler=aarch64-linux-gnu-g++
command -v $compiler >/dev/null || { echo "check_arm64.sh: needs $compiler: apt-get install g++-aarch64-linux-gnu" >&2; exit 77; }
export COMPILER=$compiler INCLUDE=build/release/include
folders=("$@")
[ $# -gt 0 ] || folders=(geometry volume haptics drivers engine c)
[ -d "$INCLUDE/palpate" ] || { echo "check_arm64.sh: $INCLUDE: no headers; run cmake --preset release first" >&2; exit 2; }
WORK=$(mktemp -d)
trap 'rm -rf "$WORK"' EXIT

# OK, LIBRARY where a header of one is missing, or what the compiler says.
compile() {
    local errors
    if errors=$("$COMPILER" -std=c++20 -fsyntax-only -I"$INCLUDE" -DPALPATE_EMBREE=3 "$1" 2>&1); then
        echo OK
    elif grep -q 'fatal error: [^p].*: No such file' <<<"$errors" && ! grep -q 'intrin\.h' <<<"$errors"; then
        echo LIBRARY
    else
        printf '%s:\n%s\n' "$1" "$errors"
    fi
}
export -f compile
find "${folders[@]}" -name '*.cpp' | sort | xargs -P "$(nproc)" -I{} bash -c 'compile {}' >"$WORK/result"
grep -vxE 'OK|LIBRARY' "$WORK/result" || true
printf 'check_arm64.sh: %d sources compile for arm64, %d need headers that are not there for it\n' "$(grep -cx OK "$WORK/result")" \
    "$(grep -cx LIBRARY "$WORK/result")"
! grep -qvxE 'OK|LIBRARY' "$WORK/result"
