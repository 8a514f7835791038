#!/usr/bin/env python3
"""The multifrontal LU beside MKL PARDISO on the same matrices. Optional; nothing in the build depends on it.

    python3 -m venv venv && venv/bin/pip install mkl numpy scipy
    cargo run --release -p slipstick --example export_matrix -- 33000 contact33.bin
    cargo build --release -p slipstick-linalg --example measure
    venv/bin/python crates/linalg/benches/compare_pardiso.py contact33.bin --threads 1,2 --rounds 3

PARDISO runs as for a real unsymmetric matrix (type 11) with its default settings: METIS, scaling and weighted matching,
up to two steps of refinement in each solve. Every run is a process of its own; the solvers take turns, and the shortest
time of all rounds counts. Memory is the peak above what the loaded matrix takes; "entries" are those of both factors.
Operations are counted for our own ordering only.
"""

import argparse
import ctypes
import json
import os
import pathlib
import subprocess
import sys
import time

COLUMNS = ["solver", "threads", "analyse", "factor", "ratio", "Gflop/s", "solve", "transposed", "MB", "Mentries",
           "residual", "transposed res."]


def read(path):
    import numpy as np

    with open(path, "rb") as file:
        n, entries = (int(x) for x in np.fromfile(file, "<u8", 2))
        offsets = np.fromfile(file, "<u8", n + 1)
        columns = np.fromfile(file, "<u4", entries)
        file.seek(4 * n, 1)  # elimination groups
        values = np.fromfile(file, "<f8", entries)
    return n, offsets.astype(np.int32), columns.astype(np.int32), values


def status(key):
    for line in open("/proc/self/status", encoding="ascii"):
        if line.startswith(key):
            return float(line.split()[1]) / 1024
    return float("nan")


class Pardiso:
    """The calls of the library, phase by phase."""

    def __init__(self, n, offsets, columns, values):
        import numpy as np

        found = sorted(pathlib.Path(sys.prefix).glob("lib/libmkl_rt.so*"))
        name = os.environ.get("MKL_RT") or (str(found[0]) if found else "libmkl_rt.so")
        self.library = ctypes.CDLL(name)
        self.handle = np.zeros(64, np.int64)
        self.options = np.zeros(64, np.int32)
        self.n, self.values = n, values
        self.offsets, self.columns = offsets + np.int32(1), columns + np.int32(1)

    def __call__(self, phase, b=None, x=None):
        integer = lambda i: ctypes.byref(ctypes.c_int32(i))
        pointer = lambda a: a.ctypes.data_as(ctypes.c_void_p) if a is not None else None
        error = ctypes.c_int32(0)
        start = time.perf_counter()
        self.library.pardiso(
            pointer(self.handle), integer(1), integer(1), integer(11), integer(phase), integer(self.n),
            pointer(self.values), pointer(self.offsets), pointer(self.columns), None, integer(1),
            pointer(self.options), integer(0), pointer(b), pointer(x), ctypes.byref(error))
        if error.value:
            sys.exit(f"PARDISO failed in phase {phase} with error {error.value}")
        return time.perf_counter() - start


def pardiso(path, runs):
    """In a process of its own: prints a line of JSON like that of the example `measure`."""
    import numpy as np
    from scipy.sparse import csr_matrix

    n, offsets, columns, values = read(path)
    matrix = csr_matrix((values, columns, offsets), shape=(n, n))
    b = np.sin(np.arange(n, dtype=float) ** 2 * 0.618034)
    solver = Pardiso(n, offsets, columns, values)
    before = status("VmRSS:")
    analyse = solver(11)
    # From here on the settings that the library chose stay, so that the transposed solve can be asked for.
    solver.options[0] = 1
    factor = min(solver(22) for _ in range(runs))
    result = {"n": n, "analyse": analyse, "factor": factor, "entries": int(solver.options[17])}
    for name, key, transpose in [("solve", "forward", 0), ("solve_transpose", "transposed", 2)]:
        solver.options[11] = transpose
        x = np.zeros(n)
        result[name] = min(solver(33, b, x) for _ in range(5))
        product = matrix.T @ x if transpose else matrix @ x
        result[key] = {"residual": float(np.linalg.norm(product - b) / np.linalg.norm(b))}
    result["megabytes"] = status("VmHWM:") - before
    print(json.dumps(result))


def run(command, threads):
    names = ["RAYON_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS"]
    environment = dict(os.environ, **{name: str(threads) for name in names})
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    if done.returncode:
        sys.exit(f"{' '.join(command)}\n{done.stderr}{done.stdout}")
    return json.loads(done.stdout)


def better(old, new):
    """The run with the shortest times of both; everything else of the newer."""
    times = ["analyse", "factor", "solve", "solve_transpose"]
    return new | {key: min(old[key], new[key]) for key in times} if old else new


def compare(path, arguments):
    ours = [str(arguments.measure), path]
    theirs = [sys.executable, __file__, path, "--pardiso", "--runs", str(arguments.runs)]
    solvers = {"PARDISO f64": theirs}
    for precision in ["f64", "f32"]:
        solvers[f"multifrontal {precision}"] = [*ours, precision, str(arguments.runs)]
    best = {}
    for _ in range(arguments.rounds):
        for threads in arguments.threads:
            for name, command in solvers.items():
                if name.split()[0].lower() not in arguments.skip:
                    best[name, threads] = better(best.get((name, threads)), run(command, threads))
    gflop = next((r["gflop"] for r in best.values() if "gflop" in r), float("nan"))
    print(f"\n{pathlib.Path(path).name}: {next(iter(best.values()))['n']} unknowns, {gflop:.0f} Gflop\n")
    print("| " + " | ".join(COLUMNS) + " |\n|" + "---|" * len(COLUMNS))
    for (name, threads), r in best.items():
        reference = best.get(("PARDISO f64", threads))
        ratio = f"{r['factor'] / reference['factor']:.2f}" if reference else "-"
        cells = [name, str(threads), f"{r['analyse']:.2f}", f"{r['factor']:.3f}", ratio,
                 f"{r['gflop'] / r['factor']:.1f}" if "gflop" in r else "-",
                 f"{r['solve']:.3f}", f"{r['solve_transpose']:.3f}", f"{r['megabytes']:.0f}",
                 f"{r['entries'] / 1e6:.1f}", f"{r['forward']['residual']:.0e}",
                 f"{r['transposed']['residual']:.0e}"]
        print("| " + " | ".join(cells) + " |", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="+", help="matrices written by the example export_matrix")
    parser.add_argument("--threads", default="1,2", type=lambda text: [int(t) for t in text.split(",")])
    parser.add_argument("--rounds", default=2, type=int, help="turns of every solver")
    parser.add_argument("--runs", default=2, type=int, help="factorizations in a turn")
    parser.add_argument("--skip", default="", help="pardiso or multifrontal")
    parser.add_argument("--measure", type=pathlib.Path, help="the built example `measure`")
    parser.add_argument("--pardiso", action="store_true", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.pardiso:
        return pardiso(arguments.files[0], arguments.runs)
    target = os.environ.get("CARGO_TARGET_DIR", pathlib.Path(__file__).resolve().parents[3] / "target")
    arguments.measure = arguments.measure or pathlib.Path(target) / "release/examples/measure"
    for path in arguments.files:
        compare(path, arguments)


if __name__ == "__main__":
    main()
