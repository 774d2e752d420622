#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# The same bits from every compiler and at every level of optimisation: builds what the golden hashes need (tests/stability/
# same_bits.txt) once for each COMPILER:LEVEL, and compares. Ends with 1 where a hash differs.
#   scripts/same_bits.sh                              # g++ and clang++ at -O0, -O1, -O2 and -O3
#   scripts/same_bits.sh g++:-O0 clang++:-O2          # these two alone
# A build takes some ten processor minutes. Folders: build/same_bits/COMPILER-LEVEL.
set -euo pipefail
cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")/.."
case ${1:-} in -h | --help) sed -n '3,8p' "$0"; exit 0 ;; esac
builds=("$@")
[ $# -gt 0 ] || builds=({g++,clang++}:{-O0,-O1,-O2,-O3})
for build in "${builds[@]}"; do
    [[ $build == *:-O[0-3] ]] || { echo "same_bits.sh: \"$build\" is no COMPILER:LEVEL, as g++:-O2" >&2; exit 2; }
    command -v "${build%%:*}" >/dev/null || { echo "same_bits.sh: there is no ${build%%:*}: install it, or name others" >&2; exit 2; }
done
different=0
for build in "${builds[@]}"; do
    compiler=${build%%:*} level=${build##*:}
    folder=build/same_bits/$compiler$level
    mkdir -p "$folder"
    if ! { cmake -S . -B "$folder" -G Ninja -DCMAKE_BUILD_TYPE=None -DCMAKE_CXX_FLAGS="$level -DNDEBUG" \
        -DCMAKE_CXX_COMPILER="$compiler" -DPALPATE_WITH_CGAL=OFF -DPALPATE_BENCH=OFF -DPALPATE_PYTHON=OFF &&
        cmake --build "$folder" --parallel --target same_bits; } >"$folder/build.log" 2>&1; then
        echo "same_bits.sh: $compiler $level was not built: $folder/build.log" >&2
        exit 2
    fi
    if "$folder/same_bits" >"$folder/result.log" 2>&1; then
        echo "$compiler $level: the same bits"
    else
        echo "$compiler $level: $(grep -c 'Which is: .*"$\|seed [0-9]*:$' "$folder/result.log" || true) differences: $folder/result.log"
        different=1
    fi
done
exit $different
