#!/usr/bin/env bash
# Measures the GPU worker against its performance goals:
#
#   1. the cover, path-naive, 1920×1080: at least 10⁹ samples/s on the GPU; also, without a goal, on a continuous film;
#   2. room, path, 1920×1080: the GPU at least 20 times as fast as all the CPU's cores together;
#   3. the cover with --device all: at least 95% of the sum of both devices;
#   4. the CPU's linearity: 1, 2, 4, 8, 16 threads, at least 0.95 at the end; the plot goes to docs/threads.svg;
#   5. mesh, a bumpy ball of 1.3 million triangles in a box, path, 1920×1080: the GPU at least 20 times as fast as all
#      the CPU's cores together. The ball is made here, which needs python3.
#
# It prints a table and exits with 1 if a goal is missed. Goals 1, 2 and 5 apply to an NVIDIA H200 with 16 CPU cores;
# elsewhere the figures are for comparison only.
#
#   benches/gpu.sh                 everything, about seven minutes
#   benches/gpu.sh --device NAME   on the adapter whose name contains NAME
#   benches/gpu.sh --try           short and small, on any adapter, to test the script
set -euo pipefail
shopt -s inherit_errexit
cd "$(dirname "$0")/.."

name="" size=1920x1080 seconds=10 repeats=3 spp=16 squares=330 plot=docs/threads.svg try=
while (($#)); do
    case "$1" in
    --device) name="$2" && shift 2 ;;
    --try) try=1 size=160x120 seconds=1 repeats=1 spp=4 squares=20 plot=$(mktemp -d)/threads.svg && shift ;;
    *) echo "usage: benches/gpu.sh [--device NAME] [--try]" >&2 && exit 2 ;;
    esac
done
gpu=gpu${name:+:$name}
cores=$(nproc)
stats=$(mktemp)
scratch=$(mktemp -d)
trap 'rm -rf "$stats" "$scratch"' EXIT

# The program to measure.
if [ -z "${STRIDE:-}" ]; then cargo build --release --quiet; fi
stride=${STRIDE:-target/release/stride}
"$stride" info --devices
if [ -z "$try" ] && ! "$stride" info --devices | grep -Eq '^  kind +(discrete|integrated|virtual) GPU'; then
    echo "there is no GPU here, only software at best: nothing to measure (--try shows that the script works)" >&2
    exit 1
fi

# A bumpy ball of 12·squares² triangles.
python3 - "$squares" "$scratch/ball.ply" <<'EOF'
import math, struct, sys

n, path = int(sys.argv[1]), sys.argv[2]


def point(side, i, j):
    a, b = (math.tan((2 * k / n - 1) * math.pi / 4) for k in (i, j))
    p = [(a, b, 1), (b, a, -1), (1, a, b), (-1, b, a), (b, 1, a), (a, -1, b)][side]
    x, y, z = (c / math.hypot(*p) for c in p)
    out, size, f = 1.0, 0.12, 2.1
    for octave in range(6):
        out += size * math.sin(f * x + octave) * math.sin(1.1 * f * y + 2) * math.sin(0.9 * f * z + 3 * octave)
        size, f = size * 0.55, f * 2.03
    return struct.pack("<3f", x * out * 0.6, y * out * 0.6 + 0.85, z * out * 0.6)


vertices = [point(side, i, j) for side in range(6) for i in range(n + 1) for j in range(n + 1)]
faces = []
for side in range(6):
    for i in range(n):
        for j in range(n):
            a = (side * (n + 1) + i) * (n + 1) + j
            b, c, d = a + n + 1, a + n + 2, a + 1
            faces.append(struct.pack("<B3iB3i", 3, a, b, c, 3, a, c, d))
head = f"""ply
format binary_little_endian 1.0
element vertex {len(vertices)}
property float x
property float y
property float z
element face {2 * len(faces)}
property list uchar int vertex_indices
end_header
"""
with open(path, "wb") as file:
    file.write(head.encode() + b"".join(vertices) + b"".join(faces))
EOF
cat >"$scratch/mesh.toml" <<'EOF'
camera = { eye = [0, 1, 3.9], look_at = [0, 1, 0], up = [0, 1, 0], vertical_fov = 39 }
entities = [
    { shape = { type = "mesh", file = "ball.ply" }, material = "clay" },
    { shape = { type = "quad", corner = [-1, 0, -1], u = [0, 0, 2], v = [2, 0, 0] }, material = "white" },
    { shape = { type = "quad", corner = [-1, 2, -1], u = [2, 0, 0], v = [0, 0, 2] }, material = "white" },
    { shape = { type = "quad", corner = [-1, 0, -1], u = [2, 0, 0], v = [0, 2, 0] }, material = "white" },
    { shape = { type = "quad", corner = [-1, 0, -1], u = [0, 2, 0], v = [0, 0, 2] }, material = "red" },
    { shape = { type = "quad", corner = [1, 0, -1], u = [0, 0, 2], v = [0, 2, 0] }, material = "green" },
    { shape = { type = "quad", corner = [-0.3, 1.99, -0.3], u = [0.6, 0, 0], v = [0, 0, 0.6] }, material = "white", emission = [17, 14, 10] },
]
[materials]
clay = { type = "matte", reflectance = [0.6, 0.55, 0.5] }
white = { type = "matte", reflectance = [0.73, 0.73, 0.73] }
red = { type = "matte", reflectance = [0.63, 0.065, 0.05] }
green = { type = "matte", reflectance = [0.14, 0.45, 0.091] }
EOF

# Samples per second: the median of a few runs. Arguments: device, scene, further options.
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
# A line of the table. Arguments: description, figure, bound.
verdict() {
    if awk -v a="$2" -v b="$3" 'BEGIN { exit !(a >= b) }'; then word=kept; else word=MISSED kept=1; fi
    printf '%-58s %14.4g  at least %-8.4g %s\n' "$1" "$2" "$3" "$word"
}
over() { awk -v a="$1" -v b="$2" 'BEGIN { print a / b }'; }
plus() { awk -v a="$1" -v b="$2" 'BEGIN { print a + b }'; }

naive=(--integrator path-naive --sampler independent)
cover_cpu=$(rate cpu scenes/cover.toml "${naive[@]}")
cover_gpu=$(rate "$gpu" scenes/cover.toml "${naive[@]}")
cover_splats=$(rate "$gpu" scenes/cover.toml "${naive[@]}" --filter mitchell)
cover_all=$(rate all scenes/cover.toml "${naive[@]}")
room_cpu=$(rate cpu scenes/room.toml --integrator path)
room_gpu=$(rate "$gpu" scenes/room.toml --integrator path)
mesh_cpu=$(rate cpu "$scratch/mesh.toml" --integrator path)
mesh_gpu=$(rate "$gpu" "$scratch/mesh.toml" --integrator path)

threads=1
for n in 2 4 8 16; do ((n <= cores)) && threads=$threads,$n; done
table=$("$stride" bench threads scenes/cover.toml --size "$size" "${naive[@]}" --spp "$spp" --repeat "$repeats" \
    --threads "$threads" --plot "$plot" --quiet)

echo
printf '%-58s %14s\n' "$size, median of $repeats runs of ${seconds} s" samples/s
printf '%-58s %14.4g\n' \
    "cover, path-naive, $cores CPU threads" "$cover_cpu" "cover, path-naive, $gpu" "$cover_gpu" \
    "cover, path-naive, mitchell, $gpu" "$cover_splats" \
    "cover, path-naive, all" "$cover_all" "room, path, $cores CPU threads" "$room_cpu" "room, path, $gpu" "$room_gpu" \
    "mesh, path, $cores CPU threads" "$mesh_cpu" "mesh, path, $gpu" "$mesh_gpu"
echo
echo "$table"
echo
verdict "1. cover, path-naive, $gpu: samples/s" "$cover_gpu" 1e9
verdict "2. room, path: $gpu over $cores CPU threads" "$(over "$room_gpu" "$room_cpu")" 20
verdict "3. cover, path-naive: all over the sum of cpu and gpu" \
    "$(over "$cover_all" "$(plus "$cover_cpu" "$cover_gpu")")" 0.95
verdict "4. efficiency of ${threads##*,} CPU threads" \
    "$(echo "$table" | awk 'NF { last = $0 } END { n = split(last, x, " "); print x[n] / 100 }')" 0.95
verdict "5. mesh, path: $gpu over $cores CPU threads" "$(over "$mesh_gpu" "$mesh_cpu")" 20
if [ -n "$try" ]; then
    echo "(too small and too short to say anything: --try)"
    exit 0
fi
exit $kept
