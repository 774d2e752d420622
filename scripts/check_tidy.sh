#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Checks the sources of the libraries and of the command, and their headers, by clang-tidy; .clang-tidy says for what. Clang's own
# warnings are among it.
#   scripts/check_tidy.sh BUILD [ROOT]      BUILD: a build folder that was configured; ROOT: a checkout, by default this one
# Prints FILE:LINE: what is wrong, for each; exit status 1 when there is one, 2 when it cannot run.
# Each source that is clean leaves a stamp in $PALPATE_CHECK_CACHE, by default ~/.cache/palpate-checks: it is not looked at again
# until it, one of our headers that it includes, its flags, this script, .clang-tidy or clang-tidy's version is another one.
# Several sources go to clang-tidy as one that includes them (bundles.awk). Where such a bundle is not clean, its halves are looked
# at, down to a source alone, and that is what counts.
set -euo pipefail

root=$(readlink -f "${2:-$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")/..}")
if [ $# -lt 1 ] || [ ! -f "$1/compile_commands.json" ] || [ ! -f "$root/.clang-tidy" ]; then
    echo "check_tidy.sh: ${1:-no BUILD}: no compile_commands.json; configure it, as by cmake --preset release" >&2
    exit 2
fi
build=$(readlink -f "$1")
script=$(readlink -f "${BASH_SOURCE[0]}")
cd "$root"
if ! command -v clang-tidy >/dev/null; then
    echo "check_tidy.sh: there is no clang-tidy; install the packages of scripts/packages.txt" >&2
    exit 2
fi
cache=${PALPATE_CHECK_CACHE:-${HOME:-/tmp}/.cache/palpate-checks}
mkdir -p "$cache"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# SOURCE <tab> FLAGS of each source of ours, once: those of the library or of the command that clang-tidy needs. What says how code is
# made, or of which library a source is, changes nothing that is found. Where libraries are, each source is told of all: so sources of
# several of ours go into one bundle.
python3 - "$build/compile_commands.json" "$root" >"$work/flags" <<'EOF'
import json, os, re, shlex, sys
database, root = sys.argv[1:]
ours = re.compile(r"(geometry|volume|haptics|drivers|engine|c)/")
of_libraries = re.compile(r"-D(FMT|TOML|BOOST|CGAL)_")

def sources_of(file):
    """A source; of a bundle (cmake/bundles.cmake) all that it includes."""
    folder = os.path.dirname(file)
    if "/bundles/" not in file:
        return [file]
    return [os.path.join(folder, line.split('"')[1]) for line in open(file) if line.startswith('#include "')]

flags, libraries = {}, {}
entries = [(os.path.relpath(source, root), entry) for entry in json.load(open(database)) for source in sources_of(entry["file"])]
for source, entry in entries:
    words = iter(shlex.split(entry["command"])[1:])
    kept, output = [], ""
    for word in words:
        if word == "-o":
            output = next(words)
        elif word in ("-c", "-include", "--param"):
            next(words)
        elif word == "-isystem":
            kept.append(word + next(words))
        elif not word.startswith(("-W", "-O", "-M", "-f", "-m")) and not word.endswith("_EXPORTS"):
            kept.append(word)
    if not ours.match(source) or not output.startswith("CMakeFiles/palpate"):
        continue
    if source.endswith(".cpp"):
        libraries.update((word, 0) for word in kept if word.startswith("-isystem") or of_libraries.match(word))
    flags.setdefault(source, [word for word in kept if word not in libraries])
for source in sorted(flags):
    common = libraries if source.endswith(".cpp") else ()
    print(source, " ".join(map(shlex.quote, [*common, *(word for word in flags[source] if word not in libraries)])), sep="\t")
EOF
if [ ! -s "$work/flags" ]; then
    echo "check_tidy.sh: $build: compiles no source of $root" >&2
    exit 2
fi

# SOURCE <tab> KEY of each source.
general=$({ clang-tidy --version; grep -v '^#' .clang-tidy; cat "$script"; } | sha256sum)
"$(dirname "$script")/source_keys.sh" "$build" "$root" "$general" "$work/flags" >"$work/keys"

# Debian's ITK knows the compiler that it was built with, and refuses any other.
cat >"$work/itk.h" <<'EOF'
#undef __clang__
#undef __GNUC__
#define __GNUC__ 12
#include <itk_compiler_detection.h>
#undef __GNUC__
#define __GNUC__ 4
#define __clang__ 1
EOF

# NUMBER <tab> SOURCE <tab> KEY <tab> FLAGS of each source that has no stamp, in the order of its bundles. A name that bundles.awk
# misses costs time, no more: that bundle does not compile.
while IFS=$'\t' read -r source key; do
    [ -e "$cache/$key" ] || printf '%s\t%s\n' "$source" "$key"
done <"$work/keys" >"$work/open"
open=$(wc -l <"$work/open")
if [ "$open" -eq 0 ]; then
    echo "check_tidy.sh: $(wc -l <"$work/keys") sources, all found clean before"
    exit 0
fi
mapfile -t headers < <(find geometry volume haptics drivers engine c -name '*.h' 2>/dev/null | sort)
mapfile -t open_sources < <(cut -f1 "$work/open")
awk -v most=24 -f "$(dirname "$script")/bundles.awk" "$work/flags" "${headers[@]}" "${open_sources[@]}" |
    awk -F'\t' -v OFS='\t' -v work="$work" '
    FILENAME ~ /\/open$/ { key[$1] = $2; next }
    FILENAME ~ /\/flags$/ { flags[$1] = $2; next }
    { print $1, $2, key[$2], flags[$2] ($3 ~ /itk/ ? " -include " work "/itk.h" : "") }
    ' "$work/open" "$work/flags" - | sort -s -n -k1,1 >"$work/bundles"
# What takes longest begins first: CGAL's templates.
mapfile -t sources < <(cut -f2 "$work/bundles")
mapfile -t with_cgal < <(grep -l '^#include <CGAL/' "${sources[@]}" || true)
printf '%s\n' "${with_cgal[@]}" | awk -F'\t' '
    NR == FNR { slow[$1] = 1; next }
    { if ($2 in slow) first[$1] = 1; there[$1] = 1; last = $1 }
    END {
        for (b = 1; b <= last; ++b) if (b in first) print b
        for (b = 1; b <= last; ++b) if (b in there && !(b in first)) print b
    }' - "$work/bundles" >"$work/order"
echo "check_tidy.sh: $open of $(wc -l <"$work/keys") sources in $(wc -l <"$work/order") bundles"

# look FILE [OPTION...]: clang-tidy at one source with the bundle's flags; what it finds, and its status.
look() {
    local file=$1 words
    shift
    eval "words=($flags)"
    clang-tidy --quiet --config-file="$root/.clang-tidy" "$@" \
        --header-filter="^($root|$build/include/palpate)/((geometry|volume|haptics|drivers|engine|c)/|palpate_c)" "$file" -- "${words[@]}" \
        2>/dev/null
}
# check_sources FIRST COUNT: stamps those of the bundle's sources that are clean, and prints what is wrong with the others.
check_sources() {
    local first=$1 count=$2 status=0 found=$work/found_$number.$1.$2
    if [ "$count" -eq 1 ]; then
        look "$root/${sources[first]}" >"$found" || status=1
        sed "s|^$root/||; s|^$build/include/palpate/||" "$found"
        [ "$status" -eq 0 ] || [ -s "$found" ] || echo "${sources[first]}:1: clang-tidy fails, and says nothing"
    else
        printf "#include \"$root/%s\"\n" "${sources[@]:first:count}" >"$found.cpp"
        if ! look "$found.cpp" --checks=-bugprone-suspicious-include >"$found"; then
            check_sources "$first" $((count / 2)) || status=1
            check_sources $((first + count / 2)) $((count - count / 2)) || status=1
            return $status
        fi
    fi
    [ "$status" -ne 0 ] || (cd "$cache" && touch "${keys[@]:first:count}")
    return $status
}
check_bundle() {
    local number=$1 sources keys flags began=$SECONDS status=0
    mapfile -t sources < <(awk -F'\t' -v number="$number" '$1 == number { print $2 }' "$work/bundles")
    mapfile -t keys < <(awk -F'\t' -v number="$number" '$1 == number { print $3 }' "$work/bundles")
    flags=$(awk -F'\t' -v number="$number" '$1 == number { print $4; exit }' "$work/bundles")
    check_sources 0 ${#sources[@]} || status=1
    echo "check_tidy.sh: bundle $number: ${#sources[@]} sources, $((SECONDS - began)) s"
    return $status
}
export root build work cache
export -f look check_sources check_bundle
xargs -a "$work/order" -P "$(nproc)" -I{} bash -c 'check_bundle {}' || exit 1
