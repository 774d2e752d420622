#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# For checks that remember what they found clean: a hash of all that what they find in a source depends on.
#   scripts/source_keys.sh BUILD ROOT GENERAL FLAGS      BUILD: a build folder that was configured; ROOT: a checkout
# GENERAL: a text that is the same for all sources: the check itself, its tools. FLAGS: a file, SOURCE <tab> FLAGS of each source.
# Prints SOURCE <tab> KEY: another one where GENERAL, the flags, the source, or one of our headers that it includes is another one.
# Where BUILD and ROOT are changes nothing.
set -euo pipefail

build=$(readlink -f "$1")
general=$3
flags=$(readlink -f "$4")
cd "$2"
root=$PWD
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

find geometry volume haptics drivers engine c \( -name '*.h' -o -name '*.cpp' -o -name '*.c' \) 2>/dev/null | sort >"$work/files" || true
mapfile -t files <"$work/files"
sha256sum "${files[@]}" >"$work/hashes"
version=$build/include/palpate/version.h
general=$({ printf '%s' "$general"; [ ! -f "$version" ] || cat "$version"; } | sha256sum)
awk -v general="$general" -v root="$root" -v build="$build" '
FILENAME == ARGV[1] { hash[$2] = $1; next }
FILENAME == ARGV[2] {
    source = $0
    sub(/\t.*/, "", source)
    order[++count] = source
    flags[source] = substr($0, length(source) + 2)
    next
}
/^[ \t]*#[ \t]*include[ \t]*<palpate\// {
    header = $0
    sub(/^[^<]*<palpate\//, "", header)
    sub(/>.*/, "", header)
    if (header == "palpate.h") header = "engine/loop/palpate.h"
    if (header ~ /^(palpate_c|device_plugin)/) header = "c/" header
    includes[FILENAME] = includes[FILENAME] " " header
}
function reach(file,    list, n, i) {
    if (file in seen) return
    seen[file] = 1
    text = text " " hash[file]
    n = split(includes[file], list, " ")
    for (i = 1; i <= n; ++i) reach(list[i])
}
END {
    for (i = 1; i <= count; ++i) {
        if (!(order[i] in hash)) { # its key would stay the same whatever is in it
            print "source_keys.sh: " order[i] ": no source of " root >"/dev/stderr"
            exit 1
        }
        delete seen
        text = flags[order[i]]
        while ((at = index(text, build)) > 0) text = substr(text, 1, at - 1) "BUILD" substr(text, at + length(build))
        while ((at = index(text, root)) > 0) text = substr(text, 1, at - 1) "ROOT" substr(text, at + length(root))
        text = general order[i] text
        reach(order[i])
        print order[i] "\t" text
    }
}' "$work/hashes" "$flags" "${files[@]}" |
    while IFS=$'\t' read -r source text; do
        printf '%s\t%s\n' "$source" "$(printf '%s' "$text" | sha256sum | cut -c1-40)"
    done
