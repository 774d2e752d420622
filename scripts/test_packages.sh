#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Installs the Debian packages in a bare Debian 12, uses them, and removes them.
#   scripts/test_packages.sh [BUILD]      BUILD: a build folder, by default build/release; all of its targets are built
# Makes the packages (cpack) and the bare system (debootstrap, which takes a minute) in BUILD/test-packages; the latter stays there
# for the next time. Needs root, debootstrap, and Debian's packages from the mirror that this machine uses. What is needed
# and not there is named, with exit status 77.
set -euo pipefail
cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")/.."
build=$(readlink -f "${1:-build/release}")
work=$build/test-packages base=$build/test-packages/base run=$build/test-packages/run

say() { printf 'test_packages.sh: %s\n' "$*" >&2; }
skip() { say "$*"; exit 77; }
[ "$(id -u)" -eq 0 ] || skip "needs root, for chroot"
command -v debootstrap >/dev/null || skip "needs debootstrap: apt-get install debootstrap"
command -v dpkg-shlibdeps >/dev/null || skip "needs dpkg-shlibdeps: apt-get install dpkg-dev"
[ -e "$build/CPackConfig.cmake" ] || { say "$build: no build folder with packages"; exit 2; }

mkdir -p "$work"

say "making the packages"
rm -rf "$work/debs"
cpack -G DEB --config "$build/CPackConfig.cmake" -B "$work/debs" >"$work/cpack.log" 2>&1 || { cat "$work/cpack.log" >&2; exit 1; }

if [ ! -e "$base/.ready" ]; then
    say "making a bare Debian"
    rm -rf --one-file-system "$base"
    mirror=$(apt-get indextargets --format '$(SITE)' 'Suite: bookworm' | head -n 1)
    debootstrap --variant=minbase --include=ca-certificates bookworm "$base" "${mirror:-http://deb.debian.org/debian}" \
        >"$work/debootstrap.log" 2>&1 || { tail "$work/debootstrap.log" >&2; exit 1; }
    touch "$base/.ready"
fi
rm -rf --one-file-system "$run"
cp -a "$base" "$run"
# How this machine reaches its packages.
for file in /etc/resolv.conf /etc/hosts /etc/ssl/certs/ca-certificates.crt; do
    [ ! -e "$file" ] || cp -L "$file" "$run$file"
done
cp -r /etc/apt/apt.conf.d/. "$run/etc/apt/apt.conf.d/"

mkdir "$run/root/test"
cp "$work"/debs/*.deb examples/custom_effect/main.cpp examples/embed_c/main.c tests/consume/felt.py "$run/root/test/"
cp -r examples/custom_effect "$run/root/test/cpp"
cat >"$run/root/test/use.sh" <<'INSIDE'
set -euo pipefail
cd /root/test
export DEBIAN_FRONTEND=noninteractive
say() { printf '  %s\n' "$*"; }
quietly() { "$@" >log 2>&1 || { cat log; echo "failed: $*"; exit 1; }; }
packages=(libpalpate0 libpalpate-dev libpalpate-extraction0 libpalpate-extraction-dev palpate python3-palpate python3-palpate-extraction)
install() { quietly apt-get install -y --no-install-recommends "$@"; }
debs() { local name; for name in "$@"; do ls ./"$name"_*.deb; done; }
files() { find / -xdev \( -path /root/test -o -path /proc -o -path /sys -o -path /dev -o -path /var/log -o -path /var/cache -o -path /tmp \) \
    -prune -o -print | sort; }
quietly apt-get update

install $(debs palpate)
say "palpate alone: $(palpate --version)"
quietly palpate trace /usr/share/doc/palpate/examples/cavity.toml --out /root/test/out
say "a trace: $(wc -l <out/frames.csv) lines of frames"
quietly apt-get purge -y palpate

install $(debs libpalpate0 python3-palpate)
say "import palpate: $(python3 felt.py)"

install g++ cmake make pkg-config $(debs libpalpate0 libpalpate-dev)
quietly cmake -S cpp -B build-cpp
quietly cmake --build build-cpp
say "find_package: $(build-cpp/custom_effect | tail -n 1)"
quietly g++ -std=c++20 -O1 main.cpp -o by-pkg-config $(pkg-config --cflags --libs palpate)
say "pkg-config: $(./by-pkg-config | tail -n 1)"
quietly gcc -std=c99 main.c -o in-c $(pkg-config --cflags --libs palpate_c) -lm
say "pkg-config in C: $(./in-c)"
mkdir extraction
printf '%s\n' 'cmake_minimum_required(VERSION 3.25)' 'project(asking LANGUAGES CXX)' \
    'find_package(palpate REQUIRED COMPONENTS extraction)' >extraction/CMakeLists.txt
if cmake -S extraction -B build-extraction >log 2>&1; then echo "extraction was found without its package"; exit 1; fi
grep -q 'extraction is not installed' log || { cat log; exit 1; }
say "extraction without its package: refused"
install $(debs libpalpate0 libpalpate-dev libpalpate-extraction0 libpalpate-extraction-dev python3-palpate python3-palpate-extraction)
quietly cmake -S extraction -B build-extraction
say "extraction with its package: found"
python3 -c 'import palpate._extraction'

# All of them gone; then, over the same other packages, in and out again: every file that is there was there.
quietly dpkg --purge "${packages[@]}"
files >before
quietly dpkg -i ./*.deb
python3 felt.py >/dev/null
files >with
quietly dpkg --purge "${packages[@]}"
files >after
if ! diff before after; then echo "not removed cleanly"; exit 1; fi
say "removed: of $(comm -13 before with | wc -l) files none is left"
INSIDE
say "in a bare Debian:"
# What is mounted there is seen by nobody else, and gone with the process, however it ends.
unshare --mount bash -c 'for folder in dev proc sys; do mount --bind "/$folder" "$0/$folder"; done; exec chroot "$0" "$@"' \
    "$run" /usr/bin/env -i HOME=/root LANG=C.UTF-8 PATH=/usr/sbin:/usr/bin:/sbin:/bin bash /root/test/use.sh </dev/null
say "passed"
