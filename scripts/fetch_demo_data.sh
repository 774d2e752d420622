#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Gets two real volumes from Debian packages, for the demo and for nightly tests:
#   scripts/fetch_demo_data.sh OUTDIR
# OUTDIR/skull.nhdr + skull.raw   head CT, Hounsfield units     (invesalius-examples: Cranium.inv3)
# OUTDIR/brain.nii.gz             T1 brain, ch2better           (mricron-data)
# Does nothing where they are there already. Needs no root; nothing is installed.
# Exit status: 0 done, 2 usage, 3 a package cannot be had, 1 anything else.
#
# Orientation of the skull. An .inv3 file keeps no patient axes. Known from the pictures: k runs to
# superior, j to anterior. Not known: whether i runs to the patient's left or right. A CT slice as
# stored by DICOM has i to the left and j to posterior; InVesalius turns j round, so i to the left
# is what the header below states. It is unverified: the skull may be mirrored, and nothing that
# depends on left or right may be concluded from it. Index axes to left, anterior, superior are
# left-handed, which NRRD allows; the scene frame (LPS) stays right-handed. The position in the
# scanner is not known either: the origin puts the middle of the volume at 0, 0, 0.
set -eu

say() { echo "fetch_demo_data: $*"; }
fail() { echo "fetch_demo_data: $2" >&2; exit "$1"; }

[ $# -eq 1 ] || { echo "usage: $0 OUTDIR" >&2; exit 2; }
mkdir -p "$1" || fail 1 "$1: cannot be made; name another folder"
out=$(cd "$1" && pwd)

need_skull=no
need_brain=no
{ [ -s "$out/skull.nhdr" ] && [ -s "$out/skull.raw" ]; } || need_skull=yes
[ -s "$out/brain.nii.gz" ] || need_brain=yes
if [ $need_skull = no ] && [ $need_brain = no ]; then
    say "skull and brain are in $out already"
    exit 0
fi

# In OUTDIR, so that a finished file gets its name by a rename within one file system.
work=$(mktemp -d "$out/.fetch-XXXXXX")
trap 'rm -rf "$work"' EXIT
trap 'exit 1' HUP INT TERM

# Downloads package $1 and unpacks it to $work/$1.
fetch() {
    say "downloading the Debian package $1"
    (cd "$work" && apt-get -q download "$1" >download.log 2>&1) || {
        sed 's/^/    /' "$work/download.log" >&2
        fail 3 "the package $1 cannot be had; try apt-get update, or check the network and that this is Debian"
    }
    dpkg-deb -x "$work/$1"_*.deb "$work/$1"
}

if [ $need_skull = yes ]; then
    fetch invesalius-examples
    say "unpacking the skull"
    project=$work/invesalius-examples/usr/share/doc/invesalius-examples/examples/Cranium.inv3
    [ -f "$project" ] || fail 1 "invesalius-examples: has no Cranium.inv3; its version is not the expected one"
    gzip -dc "$project" | tar -xOf - --wildcards '*/matrix.dat' >"$work/skull.raw"
    # 256 x 256 x 108 voxels of 2 bytes.
    [ "$(wc -c <"$work/skull.raw")" -eq 14155776 ] ||
        fail 1 "Cranium.inv3: its matrix.dat has not the expected size; its version is not the expected one"
    # Spacing from its main.plist; origin = minus half of (size - 1) * direction.
    cat >"$work/skull.nhdr" <<'EOF'
NRRD0004
# Head CT "ProMED CT 0051" from invesalius-examples, Hounsfield units.
# Left and right are unverified: an .inv3 file keeps no patient axes. See scripts/fetch_demo_data.sh.
type: int16
dimension: 3
space: left-posterior-superior
sizes: 256 256 108
space directions: (0.9570312,0,0) (0,-0.9570312,0) (0,0,1.5)
space origin: (-122.021478,122.021478,-80.25)
kinds: domain domain domain
space units: "mm" "mm" "mm"
endian: little
encoding: raw
data file: skull.raw
EOF
    mv "$work/skull.raw" "$out/skull.raw"
    mv "$work/skull.nhdr" "$out/skull.nhdr"
    say "wrote $out/skull.nhdr and skull.raw"
fi

if [ $need_brain = yes ]; then
    fetch mricron-data
    brain=$work/mricron-data/usr/share/mricron/templates/ch2better.nii.gz
    [ -f "$brain" ] || fail 1 "mricron-data: has no ch2better.nii.gz; its version is not the expected one"
    cp "$brain" "$work/brain.nii.gz"
    mv "$work/brain.nii.gz" "$out/brain.nii.gz"
    say "wrote $out/brain.nii.gz"
fi
