# SPDX-License-Identifier: Apache-2.0
# Which sources may go to a compiler as one that includes them: nearly all of a source's time goes into headers of libraries.
#   awk -v most=16 [-v apart=1] -f scripts/bundles.awk KINDS HEADER... SOURCE...
# KINDS: a file, SOURCE <tab> KIND; sources of different kinds stay apart. HEADER...: all of ours, which have names, too.
# Prints BUNDLE <tab> SOURCE <tab> LIBRARIES, in the order of the sources: those of a bundle, a number from 1, share no name in an
# unnamed namespace, and include the same large libraries. apart: each test has a namespace of its own (bundle_text.awk), so that
# what others see of it are its macros, and what is outside of its unnamed namespace.
# Relies on the format of .clang-format: namespaces and what they hold begin their lines. Where it misses a name, that bundle does
# not compile, but for two functions with other arguments: give one of both another name.
NR == FNR { split($0, part, "\t"); kinds[part[1]] = part[2]; next }
function note_spaces(    i) { # within: the namespaces around this line, without unnamed ones
    within = ""
    for (i = 1; i <= depth; ++i) if (spaces[i] != "") within = within spaces[i] "::"
    unnamed = depth > 0 && spaces[depth] == ""
}
# Whether one of a name's namespaces in headers, in[name], is around `space`, or is that.
function is_seen_in(space, headers_spaces,    list, n, i) {
    n = split(headers_spaces, list, " ")
    for (i = 1; i <= n; ++i) if (list[i] == "-" || index(space, list[i]) == 1) return 1
    return 0
}
FNR == 1 { depth = 0; note_spaces(); is_header = FILENAME ~ /\.h$/; if (!is_header) order[++count] = FILENAME }
{ sub(/^(\[\[[a-z_:]*\]\] *)+/, "") } # attributes
/^(inline )?namespace.*\{ *(\/\/.*)?$/ {
    space = $0
    gsub(/^(inline )?namespace *| *\{ *(\/\/.*)?$/, "", space)
    opened_at = FNR
    spaces[++depth] = space
    note_spaces()
    if (!is_header) opened[FILENAME] = opened[FILENAME] " " within
    next
}
# Around a single line its end has no comment.
/^} *\/\/ namespace/ || ($0 == "}" && depth > 0 && FNR == opened_at + 2) { --depth; note_spaces(); next }
is_header {
    if (/^(struct|class|enum class|enum) [A-Za-z]/) {
        sub(/^(enum )?(struct|class|enum) /, "")
        match($0, /^[A-Za-z0-9_]+/)
        name = substr($0, 1, RLENGTH)
        in_headers[name] = in_headers[name] " " (within == "" ? "-" : within)
    } else if (/^[A-Za-z].*[ *&][a-z_0-9]+\(/) {
        match($0, /[a-z_0-9]+\(/)
        functions[substr($0, RSTART, RLENGTH - 1)] = 1
    }
    next
}
/^#include <(openvdb\/|itk|CGAL\/|toml|nlohmann\/)/ && FILENAME !~ /^engine\/command\// { # there all have the same ones
    library = $0
    sub(/^#include </, "", library)
    match(library, /^(openvdb|itk|CGAL|toml|nlohmann)/)
    library = substr(library, 1, RLENGTH)
    if (index(libraries[FILENAME], library) == 0) libraries[FILENAME] = libraries[FILENAME] library " "
}
{
    line = $0
    while (match(line, /(^|[^A-Za-z_0-9.>:])[a-z_0-9]+\(/)) { # no member, and nothing that is qualified
        name = substr(line, RSTART, RLENGTH - 1)
        line = substr(line, RSTART + RLENGTH)
        sub(/^[^a-z_0-9]/, "", name)
        if (name in functions) uses[FILENAME] = uses[FILENAME] " " name
    }
}
/^using namespace / { directives[FILENAME] = directives[FILENAME] $3; next } # what is unnamed beside it would hide what comes from there
/^#define [A-Za-z]/ { macros[FILENAME] = macros[FILENAME] " " $2; names[FILENAME] = names[FILENAME] " " $2 }
/^using [A-Za-z]+ = / { names[FILENAME] = names[FILENAME] " " within $2 }
/^using [A-Za-z_:]+;/ { # of another namespace: it may be there twice, but not beside one that is unnamed
    line = $2
    gsub(/.*:|;/, "", line)
    open_names[FILENAME] = open_names[FILENAME] " " within line
}
/^(public|private|protected):$/ || /^using / { next }
/^(TYPED_)?(TEST|INSTANTIATE)[A-Z_]*\(/ { next } # one program has each test once
!unnamed && /^[A-Za-z].* [*&]?[a-z_0-9]+\(/ {
    match($0, /[a-z_0-9]+\(/)
    open_names[FILENAME] = open_names[FILENAME] " " within substr($0, RSTART, RLENGTH - 1)
}
/^(static|namespace [a-z]* =)/ || (unnamed && /^[A-Za-z]/) {
    line = $0
    while (match(line, /k[A-Z][A-Za-z0-9]* = /)) { # several constants in a line
        names[FILENAME] = names[FILENAME] " " within substr(line, RSTART, RLENGTH - 3)
        sub(/ = /, "; ", line)
    }
    sub(/^template *<.*> */, "", line)
    gsub(/"[^"]*"|\[\[[a-z_]*\]\]/, "", line)
    sub(/[={;].*/, "", line)
    while (gsub(/<[^<>]*>/, "", line) > 0) ;
    gsub(/[A-Za-z_0-9]*::/, "", line)
    sub(/[(\[:].*/, "", line)
    sub(/ +(final *)?$/, "", line)
    sub(/.*[ *&]/, "", line)
    if (line != "") names[FILENAME] = names[FILENAME] " " within line
}
# The names that a source uses, as each namespace that it opens and each around that may have them; their count.
function spread(source, into,    names_used, spaces_opened, n, s, i, k, u, rest, done) {
    n = split(uses[source], names_used, " ")
    s = split("- " opened[source], spaces_opened, " ")
    for (k = 1; k <= s; ++k) {
        rest = spaces_opened[k] == "-" ? "" : spaces_opened[k]
        for (;;) {
            for (i = 1; i <= n; ++i) if (!done[rest names_used[i]]++) into[++u] = rest names_used[i]
            if (!match(rest, /[A-Za-z_0-9]+::$/)) break
            rest = substr(rest, 1, RSTART - 1)
        }
    }
    return u + 0
}
END {
    for (i = 1; i <= count; ++i) {
        source = order[i]
        is_apart = apart && source ~ /_test\.cpp$/
        kind = kinds[source] libraries[source] (is_apart ? "apart" : directives[source])
        if (is_apart) { names[source] = macros[source]; open_names[source] = uses[source] = "" }
        n = split(names[source], list, " ")
        p = split(open_names[source], open_list, " ")
        h = 0
        for (k = 1; k <= n; ++k) {
            name = list[k]
            sub(/.*::/, "", name)
            space = substr(list[k], 1, length(list[k]) - length(name))
            # Another thing where that header is seen; a directive brings names of other namespaces.
            if (name in in_headers && (directives[source] != "" || is_seen_in(space, in_headers[name]))) kind = source
            if (name in functions) hides[++h] = list[k] # for all that is in that namespace, too
        }
        u = spread(source, use_list)
        for (b = 1; b <= bundles; ++b) {
            if (kind_of[b] != kind || size[b] >= most) continue
            for (k = 1; k <= n; ++k) if ((b, list[k]) in taken || (b, list[k]) in called) break
            for (m = 1; m <= p; ++m) if ((b, open_list[m]) in taken) break
            for (i_h = 1; i_h <= h; ++i_h) if ((b, hides[i_h]) in used) break
            for (i_u = 1; i_u <= u; ++i_u) if ((b, use_list[i_u]) in hidden) break
            if (k > n && m > p && i_h > h && i_u > u) break
        }
        if (b > bundles) { bundles = b; kind_of[b] = kind }
        ++size[b]
        for (k = 1; k <= n; ++k) taken[b, list[k]] = 1
        for (m = 1; m <= p; ++m) called[b, open_list[m]] = 1
        for (k = 1; k <= h; ++k) hidden[b, hides[k]] = 1
        for (k = 1; k <= u; ++k) used[b, use_list[k]] = 1
        print b "\t" source "\t" libraries[source]
    }
}
