#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Checks that no type of the library is defined twice under one name: two different types called alike are one to the
# linker, which takes the functions of either for both, and no compiler says so.
#   scripts/check_definitions.sh [ROOT]      ROOT: a checkout, by default this one
# Prints FILE:LINE: what is wrong, for each; exit status 1 when there is one, 2 when ROOT is not a checkout.
# What is in an unnamed namespace is a source's own. Relies on the format of .clang-format: namespaces and what they hold
# begin their lines, and a namespace's end says whose it is.
set -euo pipefail

root=${1:-$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")/..}
cd "$root"
if [ ! -d geometry ] || [ ! -d engine ]; then
    echo "check_definitions.sh: $root: no checkout: it has no geometry/ and engine/" >&2
    exit 2
fi

folders=()
for folder in geometry volume haptics drivers engine python; do
    if [ -d "$folder" ]; then folders+=("$folder"); fi
done
mapfile -t sources < <(find "${folders[@]}" -type f \( -name '*.h' -o -name '*.cpp' \) | sort)
[ ${#sources[@]} -gt 0 ] || exit 0
awk '
function scope(    i, text) {
    text = ""
    for (i = 1; i <= depth; ++i) text = text spaces[i] "::"
    return text
}
function is_unnamed(    i) {
    for (i = 1; i <= depth; ++i) if (spaces[i] == "") return 1
    return 0
}
# A word of the line; type names have neither a template argument nor a macro before them in this house.
function type_name(line) {
    sub(/^(enum class|enum struct|enum|struct|class|union) +/, "", line)
    if (!match(line, /^[A-Za-z_][A-Za-z_0-9]*(::[A-Za-z_][A-Za-z_0-9]*)*/)) return ""
    line_rest = substr(line, RLENGTH + 1)
    return substr(line, 1, RLENGTH)
}
FNR == 1 { depth = 0 }
/^(inline )?namespace.*\{ *$/ {
    line = $0
    sub(/^(inline )?namespace */, "", line)
    sub(/ *\{ *$/, "", line)
    spaces[++depth] = line
    next
}
/^} *\/\/ namespace/ { --depth; next }
/^(enum class|enum struct|enum|struct|class|union) / {
    if ($0 ~ /; *$/ && $0 !~ /\{/) next                 # a declaration
    name = type_name($0)
    if (name == "" || line_rest ~ /^</ || is_unnamed()) next
    full = scope() name
    if (full in where) {
        printf "%s:%d: %s is defined in %s, too; give one of them another name\n", FILENAME, FNR, full, where[full]
        bad = 1
    } else {
        where[full] = FILENAME ":" FNR
    }
}
END { exit bad }
' "${sources[@]}"
