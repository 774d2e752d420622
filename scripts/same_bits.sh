#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# The same bits from every compiler and at every level of optimisation: compiles what computes a frame once for each COMPILER:LEVEL,
# links it with the rest of a release build, and compares with the golden hashes (tests/stability/same_bits.txt). Ends with 1 where a
# hash differs.
#   scripts/same_bits.sh                              # g++ and clang++ at -O0, -O1, -O2 and -O3
#   scripts/same_bits.sh g++:-O0 clang++:-O2          # these two alone
# What computes: geometry, haptics, volume/fields, engine/loop and engine/truth, but for geometry/formats. The rest reads and writes.
# That release build, of each source alone, is in build/same_bits/release. After it a COMPILER:LEVEL takes two to six processor
# minutes. Folders: build/same_bits/COMPILER-LEVEL.
set -euo pipefail
cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")/.."
case ${1:-} in -h | --help) sed -n '3,10p' "$0"; exit 0 ;; esac
fail() { printf 'same_bits.sh: %s\n' "$*" >&2; exit 2; }
builds=("$@")
[ $# -gt 0 ] || builds=({g++,clang++}:{-O0,-O1,-O2,-O3})
for build in "${builds[@]}"; do
    [[ $build =~ ^(.*/)?(g|clang)[+][+](-[0-9]+)?:-O[0-3]$ ]] || fail "\"$build\" is no COMPILER:LEVEL, as g++:-O2 or clang++-14:-O0"
    command -v "${build%%:*}" >/dev/null || fail "there is no ${build%%:*}: install it, or name others"
done
release=build/same_bits/release root=$PWD
rooms='geometry/|haptics/|volume/fields/|engine/loop/|engine/truth/'
mkdir -p build/same_bits
{ cmake --preset release -B "$release" -DPALPATE_BUNDLES=OFF -DPALPATE_PYTHON=OFF -DPALPATE_BENCH=OFF && cmake --build "$release" --target same_bits; } >build/same_bits/release.log 2>&1 ||
    fail "$release was not built: build/same_bits/release.log"
cd "$release"
ninja -t commands libpalpate.so >commands.same_bits

# The command that compiles source $1 with compiler $2 at level $3 to object $4: as in the release build, but for these, and silent.
command_of() {
    grep -F -- " -c $root/$1" commands.same_bits | sed -E "s|^.*/c\+\+ |$2 |; s| -O[0-3] | $3 |g; s| -W[^ ]*||g
        s| -MD -MT [^ ]* -MF [^ ]*||; s| -o [^ ]* -c | -o $4 -c |"
}
mapfile -t sources < <(sed -nE "s#.* -c $root/(($rooms).*)#\1#p" commands.same_bits)
[ ${#sources[@]} -gt 50 ] || fail "$release has only ${#sources[@]} sources that compute"

# Compiles all of them, and links them in front of the rest: of two copies of an inline function the linker takes the first.
build_library() {
    local compiler=$1 level=$2 folder=$3 source link objects=()
    link=$(grep -- '-soname,libpalpate.so' commands.same_bits | sed 's/^: && //; s/ && .*//')
    for source in "${sources[@]}"; do
        objects+=("$folder/${source//\//_}.o")
        link=${link/ CMakeFiles\/palpate.dir\/$source.o/}
        printf '%s ' "$(command -v ccache || true)"
        command_of "$source" "$compiler" "$level" "${objects[-1]}"
    done >"$folder/commands"
    xargs -d '\n' -P "$(nproc)" -I{} bash -c '{}' <"$folder/commands" || return 1
    link=${link/ -o libpalpate.so.0.1.0 / -o $folder/libpalpate.so.0 ${objects[*]} }
    $link
}

different=0
for build in "${builds[@]}"; do
    compiler=${build%%:*} level=${build##*:}
    folder=$root/build/same_bits/$compiler$level
    mkdir -p "$folder"
    build_library "$compiler" "$level" "$folder" >"$folder/build.log" 2>&1 || fail "$compiler $level was not built: $folder/build.log"
    # Not through a pipe: grep may end before ldd has written all, and ldd's end would count.
    [[ $(LD_LIBRARY_PATH=$folder ldd ./same_bits) == *"$folder/libpalpate.so.0"* ]] || fail "same_bits does not use $folder/libpalpate.so.0"
    if LD_LIBRARY_PATH=$folder ./same_bits >"$folder/result.log" 2>&1; then
        echo "$compiler $level: ${#sources[@]} sources, the same bits"
    else
        echo "$compiler $level: $(grep -c 'Which is: .*"$\|seed [0-9]*:$' "$folder/result.log" || true) differences: $folder/result.log"
        different=1
    fi
done
exit $different
