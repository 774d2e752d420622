#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Checks that what points to the documentation points to something:
#   - a page that a source or a page cites ("docs/contact.md", "numerics.md") is there;
#   - a citation with a number ("numerics 3.4", "contact.md 1.2, step 5", "numerics 5, case 9") has that section, which
#     is a numbered heading ("### 3.4 Title") of the page, and in it that entry of its numbered list or table;
#   - a relative link in Markdown leads to a file, and its #anchor to a heading of it;
#   - a line of Markdown has 100 characters at most, but for tables and blocks of code.
# Equations are not checked: "(9)" is the paper's number.
#   scripts/check_references.sh [ROOT]      ROOT: a checkout, by default this one
# Prints FILE:LINE: what is wrong, for each; exit status 1 when there is one, 2 when ROOT is not a checkout.
# A citation may be broken across two lines of a comment.
set -euo pipefail

root=${1:-$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")/..}
cd "$root"
if [ ! -d docs ] || [ ! -d engine ]; then
    echo "check_references.sh: $root: no checkout: it has no docs/ and engine/" >&2
    exit 2
fi

folders=()
for folder in geometry volume haptics drivers engine c python tests bench examples scripts docs cmake; do
    if [ -d "$folder" ]; then folders+=("$folder"); fi
done
mapfile -t pages < <({ find docs -name '*.md'; find . -maxdepth 1 -name '*.md' -printf '%f\n'; } | sort)
mapfile -t readers < <({ find "${folders[@]}" -type f \( -name '*.h' -o -name '*.cpp' -o -name '*.c' -o -name '*.py' \
    -o -name '*.sh' -o -name '*.toml' -o -name CMakeLists.txt -o -name '*.md' \)
    find . -maxdepth 1 -type f \( -name '*.md' -o -name CMakeLists.txt \) -printf '%f\n'; } | sort -u |
    grep -v '^scripts/check_references.sh$')
[ ${#pages[@]} -gt 0 ] || exit 0

awk -v page_count=${#pages[@]} '
function complain(line, what,    text) {
    text = sprintf("%s:%d: %s", FILENAME, line, what)
    if (!(text in said)) print text
    said[text] = 1
    bad = 1
}
function base(path) { sub(/.*\//, "", path); return path }
function folder(path) { return path ~ /\// ? substr(path, 1, match(path, /[^\/]*$/) - 1) : "" }
# The anchor that a heading gets: lower case, without punctuation, hyphens for spaces.
function anchor(title) {
    title = tolower(title)
    gsub(/[^a-z0-9 _-]/, "", title)
    gsub(/ /, "-", title)
    return title
}
function without_dots(path) {
    while (path ~ /(^|\/)\.\//) sub(/\.\//, "", path)
    while (match(path, /[^\/]+\/\.\.\//)) path = substr(path, 1, RSTART - 1) substr(path, RSTART + RLENGTH)
    return path
}
function exists(path) { return system("test -e \"" path "\"") == 0 }
# A page, a section and, after it, a step or case: "contact.md 1.2, step 5".
function check_number(line, page, rest,    section, entry, words) {
    if (!match(rest, /^\)?,? *[0-9]+(\.[0-9]+)*/)) return
    section = substr(rest, 1, RLENGTH)
    rest = substr(rest, RLENGTH + 1)
    gsub(/[), ]/, "", section)
    if (!((page, section) in heading)) {
        complain(line, page " has no section " section "; cite one of its numbered headings")
    } else if (match(rest, /^, (steps?|case) [0-9]+/)) {
        words = substr(rest, 1, RLENGTH)
        entry = words
        gsub(/[^0-9]/, "", entry)
        if (!((page, section, entry) in item))
            complain(line, page " " section " has no" substr(words, 2) " in a numbered list or table")
    }
    if (match(rest, /^(, (steps?|case) [0-9]+)? and [0-9]+(\.[0-9]+)*([).,;:]|$)/)) {
        sub(/^(, (steps?|case) [0-9]+)? and /, "", rest)
        check_number(line, page, " " rest)
    }
}
# Citations that begin in `text`, of which `own` characters are this line and the rest is the next one.
function check_citations(line, text, own,    at, name, rest, before) {
    at = 1
    while (match(substr(text, at), /([A-Za-z_][A-Za-z_0-9]*\.md|numerics)/)) {
        name = substr(text, at + RSTART - 1, RLENGTH)
        before = at + RSTART > 2 ? substr(text, at + RSTART - 2, 1) : " "
        rest = substr(text, at + RSTART - 1 + RLENGTH)
        if (at + RSTART - 1 > own) return
        at += RSTART - 1 + RLENGTH
        if (before ~ /[A-Za-z0-9_.-]/ || rest ~ /^[A-Za-z0-9_]/) continue
        if (name == "numerics" && rest !~ /^,? *[0-9]/) continue
        if (name == "numerics") name = "numerics.md"
        if (!(name in is_page)) name = tolower(substr(name, 1, 1)) substr(name, 2) # begins a sentence
        if (!(name in is_page)) {
            complain(line, name " is no page of docs/; cite one that is there")
            continue
        }
        check_number(line, name, rest)
    }
}
function check_links(line, text,    target, place, file) {
    gsub(/`[^`]*`/, "", text)
    while (match(text, /\]\([^)]*\)/)) {
        target = substr(text, RSTART + 2, RLENGTH - 3)
        text = substr(text, RSTART + RLENGTH)
        sub(/ +".*"$/, "", target)
        if (target ~ /^[a-z]+:/ || target == "") continue
        place = target
        sub(/#.*$/, "", place)
        file = place == "" ? FILENAME : without_dots(folder(FILENAME) place)
        if (!exists(file)) {
            complain(line, "link to " target ", which is not there")
        } else if (target ~ /#/ && file ~ /\.md$/) {
            sub(/^[^#]*#/, "", target)
            if (!((file, target) in anchors)) complain(line, "link to #" target ", no heading of " file)
        }
    }
}
# Neither a comment mark at the beginning of a line nor a page of another place is a part of what is cited.
function bare(text) {
    gsub(/[a-z]+:\/\/[^ )]*/, "", text)
    sub(/^[ \t]*(\/\/+!?<?|#+|\*)?[ \t]*/, "", text)
    return text
}
function finish() {
    if (have_last) check_citations(last_line, last_text " ", length(last_text))
    have_last = 0
}
FNR == 1 { file_number += 1; fenced = 0 }
# First every page: its headings, and what is numbered in each section.
file_number <= page_count {
    if (FNR == 1) { is_page[base(FILENAME)] = 1; section = "" }
    if ($0 ~ /^```/) fenced = !fenced
    if (fenced) next
    if (match($0, /^#+ +/)) {
        title = substr($0, RLENGTH + 1)
        anchors[FILENAME, anchor(title)] = 1
        section = ""
        if (match(title, /^[0-9]+(\.[0-9]+)*/)) {
            section = substr(title, 1, RLENGTH)
            heading[base(FILENAME), section] = 1
        }
    } else if (section != "" && match($0, /^([0-9]+\. |\| *[0-9]+ *\|)/)) {
        entry = substr($0, 1, RLENGTH)
        gsub(/[^0-9]/, "", entry)
        item[base(FILENAME), section, entry] = 1
    }
    next
}
# Then everything that may cite one.
FNR == 1 {
    if (NR > 1) { keep = FILENAME; FILENAME = last_file; finish(); FILENAME = keep }
    last_file = FILENAME
}
{
    if (FILENAME ~ /\.md$/ && /^```/) fenced = !fenced
    text = fenced ? "" : bare($0)
    if (have_last) check_citations(last_line, last_text " " text, length(last_text))
    last_text = text; last_line = FNR; have_last = 1; last_file = FILENAME
    if (FILENAME ~ /\.md$/ && !fenced) {
        check_links(FNR, $0)
        if ($0 !~ /^ *\|/ && length($0) > 100) complain(FNR, length($0) " characters in a line; 100 are the most")
    }
}
END { FILENAME = last_file; finish(); exit bad }
' "${pages[@]}" "${readers[@]}"
