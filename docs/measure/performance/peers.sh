#!/usr/bin/env bash
# Solves two contact problems with slipstick, GetFEM and CalculiX, one after the other on one thread, and puts forces and
# costs between the marks of docs/measurements/performance.md. About ten minutes; nothing else should run. Needs Debian or Ubuntu:
# GetFEM and CalculiX are installed with apt.
#
#   docs/measure/performance/peers.sh             runs what has not been run yet with this version, case and script
#   docs/measure/performance/peers.sh --redo      runs everything
#
# SLIPSTICK=PROGRAM measures a program that is already built. PEERS=DIRECTORY keeps the results elsewhere than in
# target/peers.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../../.."

source docs/measure/tables.sh
results=${PEERS:-${CARGO_TARGET_DIR:-target}/peers}
mkdir -p "$results"
if [ "${1:-}" = --redo ]; then rm -f "$results"/*.json; fi

# Without OpenBLAS, GetFEM's direct solver takes twice the time.
packages="python3-getfem calculix-ccx libopenblas0-pthread"
if ! dpkg -s $packages >/dev/null 2>&1; then
    root=$([ "$(id -u)" = 0 ] || echo sudo)
    $root apt-get update -qq
    $root apt-get install -y -qq --no-install-recommends $packages
fi

if [ -z "${SLIPSTICK:-}" ]; then
    cargo build --release -p slipstick-cli
    SLIPSTICK=$programs/slipstick
fi
SLIPSTICK=$(realpath "$SLIPSTICK")
export SLIPSTICK OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 CCX_NPROC_EQUATION_SOLVER=1 PYTHONDONTWRITEBYTECODE=1

# run CASE PROGRAM [REFINEMENT]: Debian's Python is the one that finds GetFEM.
run() {
    /usr/bin/python3 docs/measure/performance/peers/run.py "$2" "docs/measure/performance/$1.toml" "$work/$1/path_0000.vtu" \
        "$results/$1-$2${3:+-$3}.json" "${3:-1}"
}

cases="ironing_block press_and_slide"
for case in $cases; do
    # One step without motion, only for the mesh.
    "$SLIPSTICK" solve "docs/measure/performance/$case.toml" --set 'dirichlet[1].motion=[{t=1.0,u=[0.0,0.0,0.0]}]' \
        --set load_path.steps=1 --out "$work/$case" --quiet
    for program in slipstick getfem calculix; do run $case $program; done
done
# The friction force of CalculiX depends on the size of the steps.
run ironing_block calculix 2

{
    /usr/bin/python3 docs/measure/performance/peers/table.py "$results" $cases
    echo
    echo "$(uname -sm), $(sed -n 's/^model name[^:]*: *//p' /proc/cpuinfo | head -n 1), one thread; bash $BASH_VERSION," \
        "$(/usr/bin/python3 --version)"
} >"$work/peers.md"
put docs/measurements/performance.md peers "$work/peers.md"
