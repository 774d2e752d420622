#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Compiles each public header alone, so that who includes it first needs nothing before it.
#   scripts/check_headers.sh BUILD [ROOT]      BUILD: a build folder that was configured; ROOT: a checkout, by default this one
# Prints what the compiler says; exit status 1 where a header does not compile, 2 when it cannot run.
# Where there are many, a precompiled header has most of what they take from the standard library and from glm: that each includes
# what it names of those, check_includes.sh says. Each header that compiles leaves a stamp in $PALPATE_CHECK_CACHE, by default
# ~/.cache/palpate-checks: it is not looked at again until it, one that it includes, this script or the compiler is another one.
set -euo pipefail

script=$(readlink -f "${BASH_SOURCE[0]}")
root=$(readlink -f "${2:-$(dirname "$script")/..}")
if [ $# -lt 1 ] || [ ! -f "$1/CMakeCache.txt" ] || [ ! -d "$1/include/palpate" ]; then
    echo "check_headers.sh: ${1:-no BUILD}: no CMakeCache.txt and include/palpate; configure it, as by cmake --preset release" >&2
    exit 2
fi
build=$(readlink -f "$1")
compiler=$(sed -n 's/^CMAKE_CXX_COMPILER:[A-Z]*=//p' "$build/CMakeCache.txt")
cd "$root"
cache=${PALPATE_CHECK_CACHE:-${HOME:-/tmp}/.cache/palpate-checks}
mkdir -p "$cache"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

find geometry volume haptics drivers engine -name '*.h' 2>/dev/null | grep -vE '/(internal|command)/' | sort >"$work/headers" || true
if [ ! -s "$work/headers" ]; then
    echo "check_headers.sh: $root: no header of geometry, volume, haptics, drivers or engine" >&2
    exit 2
fi
general="$("$compiler" --version | head -1) $(cat "$script")"
sed 's/$/\t/' "$work/headers" >"$work/flags"
"$(dirname "$script")/source_keys.sh" "$build" "$root" "$general" "$work/flags" >"$work/keys"
while IFS=$'\t' read -r header key; do
    [ -e "$cache/$key" ] || printf '%s %s\n' "$header" "$key"
done <"$work/keys" >"$work/open"
if [ ! -s "$work/open" ]; then
    echo "check_headers.sh: $(wc -l <"$work/keys") headers, all found to compile before"
    exit 0
fi
echo "check_headers.sh: $(wc -l <"$work/open") of $(wc -l <"$work/keys") headers"

flags=(-std=c++20 -I"$build/include")
if [ "$(wc -l <"$work/open")" -gt 8 ]; then # of fewer it takes longer than it saves
    for header in algorithm any array atomic chrono cmath cstdint filesystem functional future limits map memory optional set span \
        stdexcept string string_view unordered_map utility variant vector glm/gtc/quaternion.hpp glm/mat3x3.hpp glm/vec3.hpp; do
        echo "#include <$header>"
    done >"$work/first.h"
    "$compiler" "${flags[@]}" -x c++-header "$work/first.h" -o "$work/first.h.gch"
    flags+=(-include "$work/first.h")
fi
look() {
    local header=$1 key=$2
    echo "#include <palpate/$header>" >"$work/$key.cpp"
    if "${@:3}" "$work/$key.cpp"; then
        touch "$cache/$key"
    else
        echo "$header: does not compile alone: it lacks an include"
        return 1
    fi
}
export work cache
export -f look
xargs -a "$work/open" -P "$(nproc)" -L1 bash -c 'look "${@: -2}" "${@:1:$#-2}"' look "$compiler" "${flags[@]}" \
    -fsyntax-only || exit 1
