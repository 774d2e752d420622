#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# usage: scripts/mutants.sh [--check] [--with "EXECUTABLE FILTER"] [WORDS]...
# Who notices when a safeguard is broken? Breaks each safeguard of scripts/mutants.txt once, in a copy of the sources, builds the library,
# and runs the nearest tests; or those of --with, the same ones for all safeguards: does a net notice that was not made for them?
# Random scenes are such a net: --with "palpate_stability --first --seed 0-1000000 --frames 400000".
# With WORDS only the safeguards with these words, or with one of several. Prints a table in Markdown. Exits with 1 where a safeguard is
# missed by the tests, with 2 where something is wrong with the list or the build. Takes about half a minute a safeguard on two cores,
# and what a release build takes before that; build/mutants keeps the copy, so that the next time is quicker.
set -euo pipefail
root=$(cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")/.." && pwd)
copy=$root/build/mutants/source
build=$copy/build/release # as deep as in a checkout: the compiler cache has its objects
with="" only_check=""
wanted=()
while [ $# -gt 0 ]; do
    case $1 in
    -h | --help) sed -n '3,/^set /p' "$0" | grep '^#'; exit 0 ;;
    --check) only_check=yes ;; # the list alone: is each line there once?
    --with)
        [ -n "${2:-}" ] || { echo 'mutants.sh: --with needs "EXECUTABLE FILTER"' >&2; exit 2; }
        with=$2
        shift ;;
    -*) echo "mutants.sh: no such option: $1; there are --check and --with" >&2; exit 2 ;;
    *) wanted+=("$1") ;;
    esac
    shift
done
[ ${#wanted[@]} -gt 0 ] || wanted=("")
jobs=$(nproc)
most_seconds=300 # for the tests of a safeguard: what hangs is noticed

fail() { printf 'mutants.sh: %s\n' "$*" >&2; exit 2; }

# Whether a safeguard for purpose $1 is one of those that are wanted.
is_wanted() {
    local words
    for words in "${wanted[@]}"; do
        case $1 in *"$words"*) return 0 ;; esac
    done
    return 1
}

purposes=() files=() lines=() instead=() tests=()
while IFS= read -r purpose; do
    case $purpose in '' | '#'*) continue ;; esac
    IFS= read -r file && IFS= read -r line && IFS= read -r other && IFS= read -r test || fail "scripts/mutants.txt ends early"
    is_wanted "$purpose" || continue
    count=$(sed 's/^ *//' "$root/$file" | grep -cxF -- "$line") || true
    [ "$count" = 1 ] || fail "$file has this line $count times, not once: $line"
    purposes+=("$purpose") files+=("$file") lines+=("$line") instead+=("$other") tests+=("${with:-$test}")
done <"$root/scripts/mutants.txt"
for words in "${wanted[@]}"; do
    case "$(printf '%s\n' "${purposes[@]}")" in *"$words"*) ;; *) fail "no safeguard has the words \"$words\"" ;; esac
done
[ -z "$only_check" ] || exit 0

# Only what differs is written, so that nothing else is compiled again.
mkdir -p "$copy"
(cd "$root" && git ls-files -z --cached --others --exclude-standard) |
    while IFS= read -r -d '' file; do
        [ -f "$root/$file" ] || continue
        cmp -s "$root/$file" "$copy/$file" && continue
        mkdir -p "$(dirname "$copy/$file")"
        cp "$root/$file" "$copy/$file"
    done
# What is gone from the sources is gone from the copy: a test that is there no more notices nothing.
(cd "$copy" && find . -path ./build -prune -o -type f -print0) |
    while IFS= read -r -d '' file; do
        [ -f "$root/$file" ] || rm "$copy/$file"
    done

mapfile -t executables < <(printf '%s\n' "${tests[@]%% *}" | sort -u)
(cd "$copy" && cmake --preset release -DPALPATE_PYTHON=OFF -DPALPATE_BENCH=OFF -DPALPATE_BUNDLES=OFF >/dev/null) || fail "$copy cannot be configured"
cmake --build "$build" --parallel "$jobs" --target "${executables[@]}" >"$build/log" 2>&1 || fail "the sources do not build: $build/log"

# Names of the tests of safeguard $1 that fail; "..." where they end in another way.
failed_tests() {
    local executable=${tests[$1]%% *} filter=${tests[$1]#* } status=0
    if [ "$executable" = palpate_stability ]; then # the invariant that fails, and where
        # shellcheck disable=SC2086 # options, not a filter
        rm -rf "$build/failures" # of the safeguard before, beside which it would not begin
        timeout $most_seconds "$build/$executable" $filter --out "$build/failures" >"$build/tests.log" 2>&1 || status=$?
        [ $status -eq 0 ] && return
        sed -nE 's/^seed ([0-9]+): (.*) in frame.*/\2 (seed \1)/p; s/^seed ([0-9]+): ((hangs|ends).*);.*/\2 (seed \1)/p' \
            "$build/tests.log" | grep . || echo "ends with $status"
        return
    fi
    timeout $most_seconds "$build/$executable" --gtest_filter="$filter" >"$build/tests.log" 2>&1 || status=$?
    [ $status -eq 0 ] && { grep -q '  PASSED  . [1-9]' "$build/tests.log" || fail "$executable has no test $filter"; return; }
    sed -n 's/^\[  FAILED  \] \([^ ,]*\).*/\1/p' "$build/tests.log" | sort -u | grep -v '^[0-9]*$' | grep . && return
    [ $status -eq 124 ] && echo "hangs" && return
    sed -n 's/^\[ RUN      \] /the process ends in /p' "$build/tests.log" | tail -1 | grep . || echo "ends with $status"
}

# In words: the first two of them and how many more.
in_words() {
    awk '{ if (NR <= 2) names = names (NR > 1 ? ", " : "") $0 } END { if (NR > 2) names = names " and " NR - 2 " more"; print names }'
}

declare -A are_sound=()
for i in "${!files[@]}"; do
    [ -z "${are_sound[${tests[i]}]:-}" ] || continue
    sound=$(failed_tests "$i")
    [ -z "$sound" ] || fail "fails before anything is broken: $sound"
    are_sound[${tests[i]}]=yes
done

survivors=0
echo "| safeguard | file | noticed by |"
echo "|---|---|---|"
for i in "${!files[@]}"; do
    cp "$copy/${files[i]}" "$copy/sound"
    LINE=${lines[i]} INSTEAD=${instead[i]} perl -i -pe \
        'if (/^\s*\Q$ENV{LINE}\E$/) { s/\Q$ENV{LINE}\E/$ENV{INSTEAD}/ }' "$copy/${files[i]}"
    built=0
    cmake --build "$build" --parallel "$jobs" --target palpate_whole >"$build/log" 2>&1 || built=$?
    noticed=""
    [ $built -ne 0 ] || noticed=$(failed_tests "$i" | in_words)
    cp "$copy/sound" "$copy/${files[i]}" # sound again in the next one's build
    [ $built -eq 0 ] || fail "does not compile when broken: ${purposes[i]}; see $build/log"
    [ -n "$noticed" ] || { noticed="**nobody**"; survivors=$((survivors + 1)); }
    echo "| ${purposes[i]} | ${files[i]} | $noticed |"
done
printf '%s safeguards, %s not noticed\n' "${#files[@]}" "$survivors" >&2
[ $survivors -eq 0 ]
