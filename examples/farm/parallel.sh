#!/bin/sh
# Runs the commands of `stride split` with GNU parallel, one at a time on each machine, and merges the films here.
# Further arguments are options of parallel. The machines share the current folder, and log in without a password.
#
#   stride split scene.toml --into 64 > commands.sh
#   sh parallel.sh commands.sh --sshloginfile machines
#
# A command that fails is tried twice more, on other machines if there are any; it continues its film.
set -eu
commands=$1
shift
sed '$d' "$commands" | PARALLEL_SHELL=/bin/sh parallel --jobs 1 --retries 3 --workdir . "$@"
eval "$(tail -n 1 "$commands")"
