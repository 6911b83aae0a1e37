#!/usr/bin/env bash
# What the GPU worker promises, measured on the machine that runs this:
#
#   1. the cover, path-naive, 1920×1080: at least 10⁹ samples/s on the GPU;
#   2. room, path, 1920×1080: the GPU at least 20 times as fast as all the CPU's cores together;
#   3. the cover with --device all: within 5% of the sum of both devices, or faster;
#   4. the CPU's linearity: 1, 2, 4, 8, 16 threads, at least 0.95 at the end; the plot goes to docs/threads.svg.
#
# It prints a table and exits with 1 if a promise is not kept. The figures of 1 and 2 are promised for an NVIDIA
# H200 beside 16 CPU cores; elsewhere they are just figures.
#
#   benches/gpu.sh                 everything, about five minutes
#   benches/gpu.sh --device NAME   on the adapter whose name contains NAME
#   benches/gpu.sh --try           short and small, on whatever adapter there is: shows that the script works
set -euo pipefail
cd "$(dirname "$0")/.."

name="" size=1920x1080 seconds=10 repeats=3 spp=16 plot=docs/threads.svg try=
while (($#)); do
    case "$1" in
    --device) name="$2" && shift 2 ;;
    --try) try=1 size=160x120 seconds=1 repeats=1 spp=4 plot=$(mktemp -d)/threads.svg && shift ;;
    *) echo "usage: benches/gpu.sh [--device NAME] [--try]" >&2 && exit 2 ;;
    esac
done
gpu=gpu${name:+:$name}
cores=$(nproc)
stats=$(mktemp)
trap 'rm -f "$stats"' EXIT

cargo build --release --quiet
stride=target/release/stride
"$stride" info --devices
if [ -z "$try" ] && ! "$stride" info --devices | grep -Eq '^  kind +(discrete|integrated|virtual) GPU'; then
    echo "there is no GPU here, only software at best: nothing to measure (--try shows that the script works)" >&2
    exit 1
fi

# Samples a second: the median of a few runs. Arguments: device, scene, what else.
rate() {
    local device=$1 scene=$2
    shift 2
    for ((i = 0; i < repeats; i++)); do
        "$stride" render "$scene" --device "$device" --size "$size" --time "${seconds}s" --headless --quiet \
            --stats "$stats" -o "$(dirname "$stats")/stride-bench-$$.exr" "$@"
        sed -n 's/.*"samples_per_second": \([0-9.e+]*\).*/\1/p' "$stats"
        rm -f "$(dirname "$stats")/stride-bench-$$.exr"
    done | sort -g | awk '{ x[NR] = $1 } END { print x[int((NR + 1) / 2)] }'
}

kept=0
# A line of the table. Arguments: what, figure, bound.
verdict() {
    if awk -v a="$2" -v b="$3" 'BEGIN { exit !(a >= b) }'; then word=kept; else word=MISSED kept=1; fi
    printf '%-58s %14.4g  at least %-8.4g %s\n' "$1" "$2" "$3" "$word"
}
over() { awk -v a="$1" -v b="$2" 'BEGIN { print a / b }'; }
plus() { awk -v a="$1" -v b="$2" 'BEGIN { print a + b }'; }

naive=(--integrator path-naive --sampler independent)
cover_cpu=$(rate cpu scenes/cover.toml "${naive[@]}")
cover_gpu=$(rate "$gpu" scenes/cover.toml "${naive[@]}")
cover_all=$(rate all scenes/cover.toml "${naive[@]}")
room_cpu=$(rate cpu scenes/room.toml --integrator path)
room_gpu=$(rate "$gpu" scenes/room.toml --integrator path)

threads=1
for n in 2 4 8 16; do ((n <= cores)) && threads=$threads,$n; done
table=$("$stride" bench threads scenes/cover.toml --size "$size" "${naive[@]}" --spp "$spp" --repeat "$repeats" \
    --threads "$threads" --plot "$plot" --quiet)

echo
printf '%-58s %14s\n' "$size, median of $repeats runs of ${seconds} s" samples/s
printf '%-58s %14.4g\n' \
    "cover, path-naive, $cores CPU threads" "$cover_cpu" "cover, path-naive, $gpu" "$cover_gpu" \
    "cover, path-naive, all" "$cover_all" "room, path, $cores CPU threads" "$room_cpu" "room, path, $gpu" "$room_gpu"
echo
echo "$table"
echo
verdict "1. cover, path-naive, $gpu: samples/s" "$cover_gpu" 1e9
verdict "2. room, path: $gpu over $cores CPU threads" "$(over "$room_gpu" "$room_cpu")" 20
verdict "3. cover, path-naive: all over the sum of cpu and gpu" \
    "$(over "$cover_all" "$(plus "$cover_cpu" "$cover_gpu")")" 0.95
verdict "4. efficiency of ${threads##*,} CPU threads" \
    "$(echo "$table" | awk 'NF { last = $0 } END { n = split(last, x, " "); print x[n] / 100 }')" 0.95
if [ -n "$try" ]; then
    echo "(too small and too short to say anything: --try)"
    exit 0
fi
exit $kept
