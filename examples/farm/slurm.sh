#!/bin/sh
#SBATCH --job-name=stride
#SBATCH --requeue
# Runs one command of `stride split`: the one of the array's task, or without an array the last one, which merges.
#
#   stride split scene.toml --into 64 > commands.sh
#   array=$(sbatch --parsable --array=1-64 slurm.sh commands.sh)
#   sbatch --dependency="afterok:${array%%;*}" slurm.sh commands.sh
#
# `exec` lets Slurm's signals reach stride, which then writes its film; a requeued task continues the film.
set -eu
eval "exec $(sed -n "${SLURM_ARRAY_TASK_ID:-\$}p" "$1")"
