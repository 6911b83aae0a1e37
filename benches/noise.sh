#!/usr/bin/env bash
# The true error of renders that ended by `--noise`, against a converged picture with the same filter and another seed.
# That picture has at least 14 times as many samples, so that its own error increases the result by at most 4%. Run after
# cargo build --release. It takes an hour on one thread. Other load on the machine does not affect the result.
#
#   benches/noise.sh [size]
#   benches/noise.sh --try        small pictures and large errors, to test the script
set -euo pipefail
shopt -s inherit_errexit
cd "$(dirname "$0")/.."
stride=${STRIDE:-target/release/stride}
try= size=${1:-320x240}
if [ "$size" = --try ]; then try=1 size=24x18; fi
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

field() { sed -n "s/^ *\"$1\": \([0-9.e-]*\).*/\1/p" "$folder/a.json"; }

# Arguments: scene, filter, mode, converged samples, requested errors.
promise() {
    if [ -n "$try" ]; then set -- "$1" "$2" "$3" 64 0.5; fi
    local scene=$1 converged=$4 film=(--filter "$2" --film-mode "$3" --size "$size" -q --headless)
    "$stride" render "scenes/$scene.toml" "${film[@]}" --spp "$converged" --seed 777 -o "$folder/converged.exr"
    for asked in "${@:5}"; do
        for more in "--seed 1" "--seed 2" "--seed 1 --adaptive"; do
            [[ $more = *adaptive && $3 = continuous ]] && continue
            # shellcheck disable=SC2086
            "$stride" render "scenes/$scene.toml" "${film[@]}" --noise "$asked" --spp 100000 $more -o "$folder/a.exr" \
                --stats "$folder/a.json"
            true=$("$stride" compare "$folder/a.exr" "$folder/converged.exr" | sed -n 's/^noise *\([0-9.e-]*\).*/\1/p')
            awk -v s="$scene" -v f="$2 $3" -v m="$more" -v a="$asked" -v t="$true" -v n="$(field spp)" 'BEGIN {
                printf "%-8s %-19s %-19s asked %-5s true %-9.4g %.3f of it, %s samples a pixel\n", s, f, m, a, t, t / a, n }'
        done
    done
}

for film in "tent importance" "mitchell continuous"; do
    # shellcheck disable=SC2086
    {
        promise cover $film 8192 0.2 0.1
        promise room $film 4096 0.2 0.1
        promise smallpt $film 16384 0.2 0.1
    }
done
