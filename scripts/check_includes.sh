#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Checks which folder includes what, that a header may be included twice, and that every source and script names its licence.
#   scripts/check_includes.sh [ROOT]      ROOT: a checkout, by default this one
# Prints FILE:LINE: what is wrong, for each violation; exit status 1 when there is one, 2 when ROOT is not a checkout.
#
#   geometry <- volume <- haptics <- engine <- { c, python }, geometry <- drivers <- engine     (docs/architecture.md)
# The rooms of a folder stand on floors, in the order of `floors` below: a room includes what is below it.
# Rooms belong to libraries, as CMakeLists.txt lists them: the run time includes nothing of palpate::files or palpate::report,
# palpate::files nothing of palpate::report, and none of them anything of palpate::view.
# Public headers, FOLDER/*.h, show only the standard library, GLM and <palpate/...>; every other library stays in the
# sources named below. c/ and python/ include public headers alone, as a program does that embeds palpate.
# haptics does its work in the loop: nothing there may wait, print or open files.
# What a public header names of the standard library, it includes, itself or by a header of ours, and something of GLM where it names
# that. check_headers.sh compiles each of them alone, but behind those headers: it could not tell.
set -euo pipefail

root=${1:-$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")/..}
cd "$root"
if [ ! -d geometry ] || [ ! -d engine ]; then
    echo "check_includes.sh: $root: no checkout: it has no geometry/ and engine/" >&2
    exit 2
fi

# rooms_of LIBRARY: the rooms of palpate::LIBRARY, with | between them, from ROOT's CMakeLists.txt.
rooms_of() {
    local rooms
    rooms=$(sed -n "s/^set($1_rooms \(.*\))\$/\1/p" CMakeLists.txt 2>/dev/null || true)
    if [ -z "$rooms" ]; then
        echo "check_includes.sh: $root/CMakeLists.txt: no line set($1_rooms ...): which rooms are palpate::$1?" >&2
        exit 2
    fi
    echo "${rooms// /|}"
}
files_rooms=$(rooms_of files)
report_rooms=$(rooms_of report)
view_rooms=$(rooms_of view)

library_sources() {
    local folder folders=()
    for folder in geometry volume haptics drivers engine c python; do
        if [ -d "$folder" ]; then folders+=("$folder"); fi
    done
    find "${folders[@]}" -type f \( -name '*.h' -o -name '*.cpp' \) | sort
}

# Everything of ours that has comments. Build trees, downloaded data and results are not ours.
licensed_files() {
    find . \( -name .git -o -path ./build -o -path ./data -o -path ./demo-output \) -prune -o -type f \
        \( -name '*.h' -o -name '*.cpp' -o -name '*.py' -o -name '*.pyi' -o -name '*.sh' -o -name '*.cmake' -o -name CMakeLists.txt -o -path './.ci/*' \) \
        -print | sed 's|^\./||' | sort
}

check_includes() {
    local sources
    mapfile -t sources < <(library_sources)
    [ ${#sources[@]} -gt 0 ] || return 0
    awk -v files_rooms="$files_rooms" -v report_rooms="$report_rooms" -v view_rooms="$view_rooms" '
    function complain(what) { printf "%s:%d: %s\n", FILENAME, FNR, what; bad = 1 }

    # In which sources a library may be included; "" for a library that nobody knows.
    function home_of(header) {
        if (header ~ /^embree/) return "^geometry/internal/embree\\.h$"
        if (header ~ /intrin\.h$|^arm_/) return "^engine/loop/internal/frame_arithmetic\\.h$"  # of one processor
        if (header ~ /^CGAL\//) return "^geometry/(isosurface\\.cpp|mesh_intersections\\.cpp|internal/surface_refinement\\.h)$"
        if (header ~ /^openvdb\//) return "^volume/.*\\.cpp$"
        if (header ~ /^itk/) return "^volume/(filters|formats)/.*\\.cpp$"
        if (header ~ /^gdcm/) return "^volume/formats/internal/dicom_pixels\\.cpp$"
        if (header ~ /^zlib\.h$/) return "^(geometry/formats/internal/vtp_arrays|volume/formats/.*|engine/report/internal/mcap_file|engine/view/view_page)\\.cpp$"
        if (header ~ /^boost\//) return "^(drivers/(igtl_device|internal/websocket_client)\\.cpp|engine/(view|serve)/.*\\.cpp|engine/view/internal/(listening|live_answer|live_page|page_work)\\.h|engine/serve/internal/served_client\\.h)$"
        if (header ~ /^hidapi/) return "^drivers/internal/hid_port\\.cpp$"
        if (header ~ /^hdf5/) return "^engine/record/internal/recording_store\\.cpp$"
        if (header ~ /^openssl\//) return "^engine/files/internal/sha256\\.cpp$"
        if (header ~ /^toml/) return "^engine/scene/(scene_file\\.cpp|internal/toml_reader\\.(h|cpp))$"
        if (header ~ /^png\.h$/) return "^engine/picture/internal/canvas\\.cpp$"
        if (header ~ /^fmt\//) return "^engine/(.*\\.cpp|command/command\\.h)$"
        if (header ~ /^nlohmann\//) return "^(engine/(.*\\.cpp|(text/internal/json_text|devices/internal/inverse_service_json)\\.h|view/internal/(container|live_page|page_marks)\\.h)|drivers/internal/inverse3_messages\\.cpp)$"
        if (header ~ /^CLI\//) return "^engine/command/"
        if (header ~ /^(pybind11|python)\//) return "^python/bindings/"
        return ""
    }

    # The floor of a path FOLDER/ROOM/...; what is in no room of the folder is below all of them.
    function floor_of(path,    parts, list, count, i) {
        split(path, parts, "/")
        count = split(floors[parts[1]], list, " ")
        for (i = 1; i <= count; ++i) if (list[i] == parts[2]) return i
        return 0
    }

    # 0 of what is in the run time, else the place in `library`; the command, C and Python may include all of them.
    function library_of(path,    i) {
        if (path ~ /^(engine\/command|c|python)\//) return 9
        for (i = 3; i >= 1; --i) if (path ~ rooms_of[i]) return i
        return 0
    }

    function check_own(header,    target, parts) {
        if (header ~ /^palpate\/(version|palpate|palpate_c|palpate_c_extraction|device_plugin)\.h$/) return
        split(header, parts, "/")
        target = parts[2]
        sub(/^palpate\//, "", header)
        if (index(may_include[folder], " " target " ") == 0)
            complain(folder " must not include " target ": <palpate/" header ">")
        else if (target == folder && floor_of(header) > floor_of(FILENAME))
            complain(room_of(FILENAME) " must not include what stands above it: <palpate/" header ">")
        else if (library_of(header) > library_of(FILENAME))
            complain(library[library_of(FILENAME)] " must not include " library[library_of(header)] ": <palpate/" header ">")
        if ((is_public || (is_outside && target != folder)) && header ~ /\/(internal|command)\//)
            complain("a public header must not include a private one: <palpate/" header ">")
    }

    function room_of(path,    parts) {
        split(path, parts, "/")
        return parts[1] "/" parts[2]
    }

    function check_other(header,    home) {
        if (folder == "haptics" && header ~ never_in_haptics)
            complain("haptics must not include <" header ">")
        if (header == "iostream" && FILENAME !~ /^engine\/command\//)
            complain("the library prints nothing: <iostream> belongs to engine/command")
        if (header ~ /^glm\// || header ~ /^[a-z_]+$/) return  # GLM; the standard library has no dots or slashes
        home = home_of(header)
        if (home != "") {
            if (FILENAME !~ home) complain("<" header "> belongs to " home " alone")
        } else if (is_public || header !~ system_header) {
            complain("<" header "> is neither ours nor the standard library nor on the list of check_includes.sh")
        }
    }

    BEGIN {
        may_include["geometry"] = " geometry "
        may_include["volume"] = " volume geometry "
        may_include["haptics"] = " haptics volume geometry "
        may_include["drivers"] = " drivers geometry "
        may_include["engine"] = " engine drivers haptics volume geometry "
        may_include["c"] = " c engine drivers haptics volume geometry "
        may_include["python"] = " engine drivers haptics volume geometry "
        floors["geometry"] = "formats"
        floors["volume"] = "internal fields filters formats"
        floors["haptics"] = "solver contact effects stepping hand"
        floors["engine"] = "text scene loop truth devices run files record baking picture info report study view serve command"
        library[0] = "palpate::palpate"
        library[1] = "palpate::files"
        library[2] = "palpate::report"
        library[3] = "palpate::view"
        rooms_of[1] = "^(" files_rooms ")/"
        rooms_of[2] = "^(" report_rooms ")/"
        rooms_of[3] = "^(" view_rooms ")/"
        never_in_haptics = "^(thread|mutex|shared_mutex|condition_variable|future|iostream|fstream|filesystem|cstdio|stdio\\.h)$"
        system_header = "^((sys|linux|netinet)/)?[a-z0-9_]+\\.h$"  # of the C library, kernel and compiler; libraries are above
    }
    FNR == 1 {
        folder = FILENAME
        sub(/\/.*/, "", folder)
        is_outside = folder ~ /^(c|python)$/
        is_public = FILENAME ~ /\.h$/ && !is_outside && FILENAME !~ /\/(internal|command|bindings)\//
    }
    /^[ \t]*#[ \t]*include[ \t]*"/ {
        complain("write <palpate/folder/header.h>, not quotes")
        next
    }
    /^[ \t]*#[ \t]*include[ \t]*</ {
        header = $0
        sub(/^[^<]*</, "", header)
        sub(/>.*/, "", header)
        if (header ~ /^palpate\//) check_own(header)
        else check_other(header)
    }
    END { exit bad }
    ' "${sources[@]}"
}

# c/ has a guard that every compiler of C knows.
check_guards() {
    local headers
    mapfile -t headers < <(library_sources | grep '\.h$' | grep -v '^c/')
    [ ${#headers[@]} -gt 0 ] || return 0
    ! grep -L '^#pragma once$' "${headers[@]}" | sed 's/$/:1: no line #pragma once/' | grep .
}

check_licences() {
    local files
    mapfile -t files < <(licensed_files)
    [ ${#files[@]} -gt 0 ] || return 0
    # Beside the first line, the second: scripts begin with their interpreter.
    awk '
    FNR <= 2 && /SPDX-License-Identifier: Apache-2[.]0/ { is_licensed[FILENAME] = 1 }
    FNR == 2 { nextfile }
    END {
        for (i = 1; i < ARGC; ++i) {
            if (ARGV[i] in is_licensed) continue
            print ARGV[i] ":1: no line SPDX-License-Identifier: Apache-2.0"
            bad = 1
        }
        exit bad
    }' "${files[@]}"
}

check_names() {
    local headers
    mapfile -t headers < <(library_sources | grep '\.h$' | grep -Ev '^(c|python)/')
    [ ${#headers[@]} -gt 0 ] || return 0
    awk '
    function declare(header, names,    list, n, i) {
        n = split(names, list, " ")
        for (i = 1; i <= n; ++i) header_of["std::" list[i]] = header
    }
    BEGIN {
        declare("algorithm", "any_of clamp equal max min sort")
        declare("any", "any any_cast")
        declare("array", "array")
        declare("atomic", "atomic memory_order_acq_rel memory_order_acquire memory_order_relaxed memory_order_release")
        declare("chrono", "chrono")
        declare("cmath", "abs atan2 ceil copysign floor isfinite isinf isnan sqrt")
        declare("cstdint", "int8_t int16_t int32_t int64_t uint8_t uint16_t uint32_t uint64_t")
        declare("filesystem", "filesystem")
        declare("functional", "function")
        declare("future", "future shared_future")
        declare("initializer_list", "initializer_list")
        declare("limits", "numeric_limits")
        declare("map", "map")
        declare("memory", "construct_at make_shared make_unique shared_ptr unique_ptr weak_ptr")
        declare("mutex", "lock_guard mutex")
        declare("numbers", "numbers")
        declare("optional", "nullopt optional")
        declare("ratio", "micro")
        declare("set", "set")
        declare("span", "span")
        declare("stdexcept", "invalid_argument runtime_error")
        declare("string", "string to_string")
        declare("string_view", "string_view")
        declare("thread", "thread")
        declare("type_traits", "is_nothrow_copy_constructible_v is_same_v is_trivially_copyable_v is_trivially_destructible_v")
        declare("typeinfo", "type_info")
        declare("unordered_map", "unordered_map")
        declare("utility", "exchange forward move pair swap")
        declare("variant", "get_if variant visit")
        declare("vector", "vector")
        header_of["std::size_t"] = header_of["std::ptrdiff_t"] = ""  # of nearly every header
        header_of["assert("] = "cassert"
        header_of["offsetof("] = "cstddef"
        header_of["typeid("] = "typeinfo"
    }
    /^[ \t]*#[ \t]*include[ \t]*</ {
        header = $0
        sub(/^[^<]*</, "", header)
        sub(/>.*/, "", header)
        sub(/^palpate\//, "", header)
        if (header ~ /^glm\//) header = "glm"
        includes[FILENAME] = includes[FILENAME] " " header
        next
    }
    FILENAME !~ /\/(internal|command)\// {
        line = $0
        gsub(/"[^"]*"/, "", line)
        sub(/\/\/.*/, "", line)
        line = " " line
        while (match(line, /std::[a-z_0-9]+|glm::|[^a-z_](assert|offsetof|typeid)\(/)) {
            name = substr(line, RSTART, RLENGTH)
            line = substr(line, RSTART + RLENGTH)
            sub(/^[^a-z]/, "", name)
            if (seen[FILENAME, name]++) continue
            ++count
            file[count] = FILENAME
            place[count] = FNR
            used[count] = name
        }
    }
    # Whether `wanted` is among what `from` includes, or what that includes of ours.
    function reaches(from, wanted,    list, n, i) {
        if (from in visited) return 0
        visited[from] = 1
        n = split(includes[from], list, " ")
        for (i = 1; i <= n; ++i) if (list[i] == wanted || reaches(list[i], wanted)) return 1
        return 0
    }
    END {
        for (k = 1; k <= count; ++k) {
            name = used[k]
            if (name != "glm::" && !(name in header_of)) {
                printf "%s:%d: %s: of which header? add it to check_names() in check_includes.sh\n", file[k], place[k], name
                bad = 1
                continue
            }
            wanted = name == "glm::" ? "glm" : header_of[name]
            split("", visited)
            if (wanted == "" || reaches(file[k], wanted)) continue
            printf "%s:%d: %s, and nothing includes <%s>\n", file[k], place[k], name, wanted == "glm" ? "glm/...hpp" : wanted
            bad = 1
        }
        exit bad
    }' "${headers[@]}"
}

status=0
check_includes || status=1
check_names || status=1
check_guards || status=1
check_licences || status=1
exit $status
