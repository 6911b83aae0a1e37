#!/usr/bin/env bash
# Cost and error of filters: the samples per second of each relative to box, on the fastest scene and on the room, the
# load of the accumulator, and the error at equal samples. Run on a quiet machine, after cargo build --release.
#
#   benches/filters.sh [rounds]
#   benches/filters.sh --try        small pictures and few samples, to test the script
set -euo pipefail
shopt -s inherit_errexit
cd "$(dirname "$0")/.."
stride=${STRIDE:-target/release/stride}
try= rounds=${1:-5} converged=4096
if [ "$rounds" = --try ]; then try=1 rounds=1 converged=16; fi
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

films=("box importance" "box continuous" "tent importance" "tent continuous" "gaussian continuous"
    "mitchell continuous" "blackman-harris continuous" "lanczos continuous")

field() { sed -n "s/.*\"$1\": \([0-9.e-]*\).*/\1/p" "$2"; }
median() { sort -g | awk '{ a[NR] = $1 } END { print (NR % 2) ? a[(NR + 1) / 2] : (a[NR / 2] + a[NR / 2 + 1]) / 2 }'; }

# Each round measures all films, so that a slow minute affects all of them.
cost() {
    local scene=$1 integrator=$2 spp=$3
    if [ -n "$try" ]; then spp=2; fi
    printf '\n%s, %s, two threads, %s samples a pixel, median of %s rounds\n' "$scene" "$integrator" "$spp" "$rounds"
    for ((round = 0; round < rounds; round++)); do
        for film in "${films[@]}"; do
            read -r filter mode <<<"$film"
            "$stride" render "scenes/$scene.toml" --integrator "$integrator" --spp "$spp" --threads 2 -q --headless \
                --filter "$filter" --film-mode "$mode" -o "$folder/a.png" --stats "$folder/a.json"
            field samples_per_second "$folder/a.json" >>"$folder/$scene-$filter-$mode.rate"
            field accumulator_seconds "$folder/a.json" >>"$folder/$scene-$filter-$mode.adding"
        done
    done
    local base
    base=$(median <"$folder/$scene-box-importance.rate")
    for film in "${films[@]}"; do
        read -r filter mode <<<"$film"
        rate=$(median <"$folder/$scene-$filter-$mode.rate")
        adding=$(median <"$folder/$scene-$filter-$mode.adding")
        pixels=$(sed -n 's/^\(width\|height\) = \([0-9]*\).*/\2/p' "scenes/$scene.toml" | paste -sd'*' | awk -F'*' '{ print $1 * $2 }')
        awk -v f="$filter" -v m="$mode" -v r="$rate" -v b="$base" -v a="$adding" -v n="$((pixels * spp))" 'BEGIN {
            printf "%-16s %-11s %6.2f Msamples/s, cost over box %+6.1f%%; the accumulator takes %7.1f Msamples/s\n",
                f, m, r / 1e6, (b / r - 1) * 100, n / a / 1e6 }'
    done
}

error() {
    local scene=$1 spp=$2 size=$3
    if [ -n "$try" ]; then spp=4 size=24x18; fi
    printf '\n%s at %s, %s samples a pixel: noise (√relMSE_scaled without the worst 0.5%%) against %s samples with the same filter\n' \
        "$scene" "$size" "$spp" "$converged"
    for film in "${films[@]}" "gaussian importance" "blackman-harris importance"; do
        read -r filter mode <<<"$film"
        for seed in 1 2; do
            [ $seed = 1 ] && n=$spp || n=$converged
            "$stride" render "scenes/$scene.toml" --spp "$n" --size "$size" --seed $seed -q --headless \
                --filter "$filter" --film-mode "$mode" -o "$folder/$seed.exr"
        done
        noise=$("$stride" compare "$folder/1.exr" "$folder/2.exr" | sed -n 's/^noise *\([0-9.e-]*\).*/\1/p')
        printf '%-16s %-11s %s\n' "$filter" "$mode" "$noise"
    done
}

cost cover path-naive 256
cost room path 64
error cover 64 160x120
error room 64 160x120
