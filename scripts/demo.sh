#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# The main job: a real head CT and a real brain to haptic traces of their surfaces, and a page about them.
# palpate.sh demo builds the command and runs this; results go to demo-output/.
set -euo pipefail
top=$(cd "$(dirname "$0")/.." && pwd)
palpate=$top/build/release/palpate
out=$top/demo-output
data=$out/data
mkdir -p "$data"
export PALPATE_CACHE=${PALPATE_CACHE:-$out/cache}

step() { printf '\n== %s\n' "$*"; }
seconds() { date +%s.%N; }

step "Data"
if "$top/scripts/fetch_data.sh" "$data"; then
    subjects=(skull brain)
    labels=yes
    notes=(--note "The skull is a real head CT (Debian package invesalius-examples), bone at 226 HU; the brain is the ch2better template (mricron-data), cortex at 60; the eight structures are labels of its AAL atlas. Left and right of the skull are not verified.")
else
    echo "The real volumes cannot be had here: a generated phantom takes their place."
    "$palpate" phantom "$data/phantom.nrrd" --force
    subjects=(phantom)
    labels=no
    notes=(--note "The real volumes could not be had on this machine: this is a generated phantom.")
fi
main=${subjects[0]}

step "Volumes"
for subject in "${subjects[@]}"; do
    case $subject in
        skull) "$palpate" info "$data/skull.nhdr" --picture "$out/skull.png" --iso 226 --force ;;
        brain) "$palpate" info "$data/brain.nii.gz" --picture "$out/brain.png" --iso 60 --force ;;
        phantom) "$palpate" info "$data/phantom.nrrd" --picture "$out/phantom.png" --iso 226 --force ;;
    esac
done
[ $labels = no ] || "$palpate" info "$data/aal.nii.gz" --picture "$out/aal.png" --force

step "Surfaces"
extract() {
    local began; began=$(seconds)
    "$palpate" extract "$@"
    awk -v a="$began" -v b="$(seconds)" 'BEGIN {printf "extracted in %.1f s\n", b - a}'
}
for subject in "${subjects[@]}"; do
    case $subject in
        skull) extract "$data/skull.nhdr" -o "$out/skull.ply" --iso 226 --smooth-voxels 0.7 --keep largest ;;
        brain) extract "$data/brain.nii.gz" -o "$out/brain.ply" --iso 60 --smooth-voxels 0.7 --keep largest ;;
        phantom) extract "$data/phantom.nrrd" -o "$out/phantom.ply" --iso 226 --smooth-voxels 0.7 --keep largest ;;
    esac
done

step "What a sub-step computes"
"$palpate" explain "$top/examples/$main.toml"

step "Traces"
traces=()
trace() {
    local name=$1; shift
    echo "-- $name"
    "$palpate" trace "$@" --out "$out/$name"
    traces+=("$out/$name")
}
trace "$main-adaptive" "$top/examples/$main.toml"
trace "$main-paper" "$top/examples/$main.toml" --method paper
trace "$main-direct" "$top/examples/$main.toml" --contact direct
for subject in "${subjects[@]:1}"; do trace "$subject-adaptive" "$top/examples/$subject.toml"; done
[ $labels = no ] || trace labels-adaptive "$top/examples/aal.toml"
playback=()
# A build without npm has no page that could play anything.
if [ -f "$top/build/release/web/palpate_view.html" ]; then
    playback=(--playback)
    for folder in "${traces[@]}"; do
        [[ $folder != *-adaptive ]] || playback+=("$folder")
    done
fi

step "The same bits again"
"$palpate" replay "$out/$main-adaptive/recording.h5" --check

step "Report"
"$palpate" report "${traces[@]}" "${playback[@]}" -o "$out/index.html" "${notes[@]}"
