#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Compiles for arm64, with Debian's cross compiler, every source that needs no library but GLM: nothing in them is of x86 alone.
#   scripts/check_arm64.sh [BUILD]      BUILD: a configured build folder, by default build/release
# Prints what does not compile, and how many sources did; exit status 1 when one did not, 77 where there is no such compiler.
# Nothing is linked or run.
set -euo pipefail
cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")/.."
compiler=aarch64-linux-gnu-g++
command -v $compiler >/dev/null || { echo "check_arm64.sh: needs $compiler: apt-get install g++-aarch64-linux-gnu" >&2; exit 77; }
export COMPILER=$compiler INCLUDE=${1:-build/release}/include
[ -d "$INCLUDE/palpate" ] || { echo "check_arm64.sh: $INCLUDE: no headers; run cmake first" >&2; exit 2; }
WORK=$(mktemp -d)
export WORK
trap 'rm -rf "$WORK"' EXIT
ln -s /usr/include/glm "$WORK/glm"  # and nothing else of this machine's

# OK, LIBRARY where a header of one is missing, or what the compiler says.
compile() {
    local errors
    if errors=$("$COMPILER" -std=c++20 -fsyntax-only -I"$INCLUDE" -I"$WORK" -DPALPATE_EMBREE=3 "$1" 2>&1); then
        echo OK
    elif grep -q 'fatal error: [^p].*: No such file' <<<"$errors" && ! grep -q 'intrin\.h' <<<"$errors"; then
        echo LIBRARY
    else
        printf '%s:\n%s\n' "$1" "$errors"
    fi
}
export -f compile
find geometry volume haptics drivers engine -name '*.cpp' | sort | xargs -P "$(nproc)" -I{} bash -c 'compile {}' >"$WORK/result"
grep -vxE 'OK|LIBRARY' "$WORK/result" || true
printf 'check_arm64.sh: %d sources compile for arm64, %d need a library\n' "$(grep -cx OK "$WORK/result")" \
    "$(grep -cx LIBRARY "$WORK/result")"
! grep -qvxE 'OK|LIBRARY' "$WORK/result"
