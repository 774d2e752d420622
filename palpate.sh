#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Palpate from a bare clone on Debian: installs what is missing, builds, and does one of the things below.
set -euo pipefail
cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")"

usage() {
    cat <<'EOT'
usage: ./palpate.sh demo|test|build|bench|help
  demo   build, get the demo data, trace it, and say where the report is
  test   build and run every test, the fast ones once more under AddressSanitizer,
         and what threads share under ThreadSanitizer
  build  leave the command at build/release/palpate, the Python package in build/release/python,
         and all that `cmake --install build/release` takes
  bench  build and run the benchmarks: build/release/bench-results/index.html, results.csv and *.json
  help   this text
Missing Debian packages (scripts/packages.txt) are installed with apt-get, as root or through sudo.
EOT
}

say() { printf 'palpate.sh: %s\n' "$*" >&2; }

# Names in scripts/packages.txt that no installed package has or provides, a line each: Node.js of its own makers provides npm.
# The second letter of a state says what is: a package that is held is installed, too.
missing_packages() {
    local there
    there=$(dpkg-query -W -f='${db:Status-Abbrev}\t${Package}, ${Provides}\n' | sed -n 's/^.i[^\t]*\t//p' |
        sed 's/([^)]*)//g' | tr ',' '\n' | tr -d ' ')
    sed 's/#.*//' scripts/packages.txt | tr -s ' \t' '\n' | grep . | grep -vxF "$there" || true
}

install_packages() {
    if ! command -v dpkg-query >/dev/null || ! command -v apt-get >/dev/null; then
        say "no Debian here: the packages of scripts/packages.txt are taken to be there"
        return
    fi
    local missing as_root=()
    mapfile -t missing < <(missing_packages)
    [ ${#missing[@]} -gt 0 ] || return 0
    if [ "$(id -u)" -ne 0 ]; then
        if ! command -v sudo >/dev/null; then
            say "neither root nor sudo: as root, run: apt-get install --no-install-recommends ${missing[*]}"
            exit 1
        fi
        as_root=(sudo)
    fi
    say "installing ${#missing[@]} missing packages: ${missing[*]}"
    "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get update
    "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y --no-install-recommends "${missing[@]}"
}

# Compilers at once: a core each, and 2 GiB each, which is what a source with CGAL or ITK in it takes.
build_jobs() {
    local cores memory
    cores=$(nproc)
    memory=$(awk '/^MemAvailable:/ {print int($2 / (2 * 1024 * 1024))}' /proc/meminfo)
    [ "$memory" -ge 1 ] || memory=1
    echo $((cores < memory ? cores : memory))
}

# Tests at once: more than cores, as many wait for a clock, a device or a child.
test_jobs() { echo $(($(nproc) + 2)); }

# build_targets PRESET [TARGET...]: everything, or these targets.
build_targets() {
    local preset=$1 targets=()
    shift
    [ $# -eq 0 ] || targets=(--target "$@")
    say "building build/$preset with $(build_jobs) jobs"
    cmake --preset "$preset"
    cmake --build --preset "$preset" --parallel "$(build_jobs)" "${targets[@]}"
}

# Real volumes for tests/data, as far as they can be had: the tests of the others say that they are skipped.
fetch_test_data() {
    local set
    for set in skull brain labels atlases macaque dicom diffusion; do
        scripts/fetch_data.sh build/release/real-data "$set" || say "without the real data \"$set\""
    done
}

# Fields and meshes that tests make of those volumes, some minutes of processor time, are kept for the next checkout, until a source
# or a package is another one.
keep_surfaces() {
    local kept key old
    kept=$(realpath -m "${PALPATE_CHECK_CACHE:-${HOME:-/tmp}/.cache/palpate-checks}")/surfaces
    key=$({
        find CMakeLists.txt CMakePresets.json cmake geometry volume haptics engine -type f -print0 | sort -z | xargs -0 sha256sum
        dpkg-query -W 2>/dev/null || true
    } | sha256sum | cut -c1-40)
    mkdir -p "$kept/$key" build/release/real-data
    touch "$kept/$key"
    mapfile -t old < <(ls -t "$kept" | tail -n +4)
    (cd "$kept" && rm -rf "${old[@]}")
    rm -rf build/release/real-data/cache
    trap 'rm -f build/release/real-data/cache' EXIT # where a build fails, too: what a later one makes is not of these sources
    ln -s "$kept/$key" build/release/real-data/cache
}

run_tests() {
    fetch_test_data
    keep_surfaces
    build_targets release
    build_targets asan fast_tests
    build_targets tsan test_threads
    say "all tests (build/release)"
    local status=0
    ctest --test-dir build/release --output-on-failure --parallel "$(test_jobs)" || status=$?
    rm -f build/release/real-data/cache # what a later build makes is not of these sources
    [ "$status" -eq 0 ] || exit "$status"
    say "what threads share under ThreadSanitizer (build/tsan)"
    ctest --test-dir build/tsan --output-on-failure --parallel "$(test_jobs)" --label-regex '^threads$'
    say "the fast tests under AddressSanitizer and UndefinedBehaviorSanitizer (build/asan)"
    # Last, so that the last line is ctest's own; a failure above has ended the script with ctest's words too.
    exec ctest --test-dir build/asan --output-on-failure --parallel "$(test_jobs)" \
        --label-regex '^(geometry|volume|haptics|drivers|engine|c|fuzz|sanitizers)$'
}

# The options of a benchmark: each measures three times, in turns with the others, so that the spread tells the noise; but for those
# that take long.
benchmark_options() {
    case $1 in
    bench_jitter) echo --seconds 5 ;;
    bench_view_jitter) echo --seconds 2 --rounds 3 ;;
    bench_first_touch | bench_extraction) ;;
    *) echo --benchmark_repetitions=3 --benchmark_enable_random_interleaving=true --benchmark_min_time=0.03 ;;
    esac
}

run_benchmarks() {
    local source name options results=build/release/bench-results targets=() new
    new=$results.new
    for source in bench/*.cpp; do
        [ -e "$source" ] || { say "no benchmarks in bench/"; exit 1; }
        targets+=("bench_$(basename "$source" .cpp)")
    done
    scripts/fetch_data.sh build/release/real-data skull || say "without the real head: its rows are left out"
    build_targets release palpate_command "${targets[@]}"
    rm -rf "$new"
    mkdir -p "$new"
    for name in "${targets[@]}"; do
        say "running $name"
        mapfile -t options < <(benchmark_options "$name" | tr ' ' '\n' | grep .)
        "build/release/$name" "${options[@]}" --benchmark_format=json >"$new/$name.json"
    done
    if command -v valgrind >/dev/null; then
        say "counting instructions"
        scripts/bench_instructions.py --csv "$new/instructions.csv"
    else
        say "valgrind is not installed: instructions are not counted"
    fi
    rm -rf "$results"
    mv "$new" "$results" # what was measured before is there until all is measured again
    scripts/bench_page.py "$results"
    say "the page is $results/index.html, the table $results/results.csv"
}

[ $# -eq 1 ] || { usage >&2; exit 2; }
case $1 in
help | --help | -h) usage ;;
build)
    install_packages
    build_targets release palpate_command palpate_python palpate_c palpate_c_extraction
    say "the command is build/release/palpate, the Python package is in build/release/python"
    ;;
test)
    install_packages
    run_tests
    ;;
bench)
    install_packages
    run_benchmarks
    ;;
demo)
    install_packages
    build_targets release palpate_command
    exec scripts/demo.sh
    ;;
*)
    printf 'palpate.sh: unknown argument "%s"\n' "$1" >&2
    usage >&2
    exit 2
    ;;
esac
