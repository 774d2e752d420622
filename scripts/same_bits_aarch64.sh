#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# The same bits on aarch64: builds the library for it with Debian's cross compiler, runs the random scenes in QEMU, and compares
# with the golden hashes (tests/stability/same_bits.txt). Ends with 1 where a hash differs.
#   scripts/same_bits_aarch64.sh
# Needs Debian 12 and, installed, cmake ninja-build g++-aarch64-linux-gnu qemu-user-static; no root. Debian's libraries for arm64
# are unpacked into build/same_bits_aarch64/root by an apt-get with lists of its own: nothing is installed. The first time takes
# 60 MB from Debian and some fifteen processor minutes, two of them in QEMU. For newer packages remove build/same_bits_aarch64.
# ITK alone is not there for arm64. In place of the two sources that use it is one that throws (tests/support/fake_itk): the scenes
# are formulas and meshes, and one that had to read or smooth voxels would fail.
set -euo pipefail
cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")/.."
case ${1:-} in -h | --help) sed -n '3,10p' "$0"; exit 0 ;; esac
fail() { printf 'same_bits_aarch64.sh: %s\n' "$*" >&2; exit 2; }
[ $# -eq 0 ] || fail "takes no argument, but for --help"
for command in cmake ninja aarch64-linux-gnu-g++ qemu-aarch64-static apt-get dpkg-deb; do
    command -v $command >/dev/null ||
        fail "there is no $command; as root: apt-get install cmake ninja-build g++-aarch64-linux-gnu qemu-user-static"
done
# What scripts/packages.txt has of libraries, but for ITK and what is for other targets.
packages=(libc6-dev libstdc++-12-dev libglm-dev libembree-dev libopenvdb-dev libtbb-dev libhidapi-dev libgdcm-dev libhdf5-dev
    libpng-dev zlib1g-dev libssl-dev libboost-dev libtomlplusplus-dev libcli11-dev libfmt-dev nlohmann-json3-dev libgtest-dev
    libgmock-dev)
work=$PWD/build/same_bits_aarch64
root=$work/root build=$work/build
mkdir -p "$work"

# An apt-get on a machine of arm64 where nothing is installed.
apt_of_arm64() {
    apt-get -o APT::Architecture=arm64 -o APT::Architectures=arm64 -o Dir::State="$work/apt" \
        -o Dir::State::status="$work/apt/status" -o Dir::Cache="$work/apt/cache" -o Debug::NoLocking=1 "$@"
}

# The root is complete or not there. In it, as on Debian, /lib is /usr/lib; a link to a path from / would lead out of it.
unpack_packages() {
    local new=$root.new package link target
    mkdir -p "$work/apt/lists/partial" "$work/apt/cache/archives/partial"
    : >"$work/apt/status"
    apt_of_arm64 update && apt_of_arm64 --download-only --no-install-recommends -y install "${packages[@]}" || return
    rm -rf "$new"
    mkdir -p "$new/usr/lib" "$new/usr/bin"
    ln -s usr/lib usr/bin "$new"
    for package in "$work"/apt/cache/archives/*.deb; do
        dpkg-deb --fsys-tarfile "$package" | tar -x --keep-directory-symlink -C "$new" || return
    done
    find "$new" -lname '/*' -printf '%p\t%l\n' | while IFS=$'\t' read -r link target; do ln -sfnr "$new$target" "$link"; done
    mv "$new" "$root"
}

configure() {
    cmake -S . -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=Release -DPALPATE_WITH_CGAL=OFF -DPALPATE_BENCH=OFF -DPALPATE_PYTHON=OFF \
        -DCMAKE_SYSTEM_NAME=Linux -DCMAKE_SYSTEM_PROCESSOR=aarch64 -DCMAKE_SYSROOT="$root" \
        -DCMAKE_C_COMPILER=aarch64-linux-gnu-gcc -DCMAKE_CXX_COMPILER=aarch64-linux-gnu-g++ \
        -DCMAKE_FIND_ROOT_PATH_MODE_PROGRAM=NEVER -DCMAKE_FIND_ROOT_PATH_MODE_LIBRARY=ONLY \
        -DCMAKE_FIND_ROOT_PATH_MODE_INCLUDE=ONLY -DCMAKE_FIND_ROOT_PATH_MODE_PACKAGE=ONLY \
        -DHDF5_C_COMPILER_EXECUTABLE="$root/usr/bin/h5cc" -DITK_DIR="$PWD/tests/support/fake_itk"
}

[ -d "$root" ] || unpack_packages >"$work/packages.log" 2>&1 || fail "no packages of arm64: $work/packages.log"
{ configure && cmake --build "$build" --target same_bits; } >"$work/build.log" 2>&1 || fail "it was not built: $work/build.log"
rm -f "$work/hashes.txt"
PALPATE_WRITE_HASHES=$work/hashes.txt qemu-aarch64-static -L "$root" "$build/same_bits" >"$work/result.log" 2>&1 || true
[ -s "$work/hashes.txt" ] || fail "it did not run to its end: $work/result.log"
mapfile -t different < <(grep -vxFf tests/stability/same_bits.txt "$work/hashes.txt" | cut -d' ' -f1)
if [ ${#different[@]} -eq 0 ] && grep -q '^\[  PASSED  \] 1 test' "$work/result.log"; then
    echo "aarch64: $(wc -l <"$work/hashes.txt") scenes, the same bits"
else
    echo "aarch64: ${#different[@]} of $(wc -l <"$work/hashes.txt") scenes have other bits: $work/result.log; seeds ${different[*]}"
    exit 1
fi
