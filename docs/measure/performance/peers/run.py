"""Solves a case with one program and records the forces and the cost: `run.py PROGRAM CASE MESH RESULT [REFINEMENT]`.

PROGRAM is slipstick, getfem or calculix; MESH a VTU file of the undeformed bodies that slipstick wrote.
REFINEMENT multiplies the number of load steps, except for slipstick. RESULT is a JSON file. If it exists,
and neither the case file nor the scripts nor the program have changed since, nothing runs.
"""

import hashlib
import importlib
import json
import os
import pathlib
import resource
import subprocess
import sys
import tempfile

from problem import Problem

# Processor seconds after which a run is stopped.
LIMIT = 3600


def digest(files):
    """Digest of the contents of files."""
    total = hashlib.sha256()
    for file in files:
        total.update(pathlib.Path(file).read_bytes())
    return total.hexdigest()


def measured(command, folder):
    """Runs a command in a folder, with its output in `output`: exit status, processor seconds, peak memory in MB.

    The processor time includes reading and writing files.
    """
    with open(folder / "output", "w") as output:
        limit = lambda: resource.setrlimit(resource.RLIMIT_CPU, (LIMIT, LIMIT))
        child = subprocess.Popen(command, cwd=folder, stdout=output, stderr=subprocess.STDOUT, preexec_fn=limit)
        _, status, usage = os.wait4(child.pid, 0)
        child.returncode = os.waitstatus_to_exitcode(status)
    return child.returncode, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024


def main(program, case, mesh, result, refinement="1"):
    case, mesh, result = (pathlib.Path(path).resolve() for path in (case, mesh, result))
    here = pathlib.Path(__file__).parent.resolve()
    adapter = importlib.import_module(f"with_{program}")
    version = adapter.version()
    scripts = [here / name for name in ("problem.py", "run.py", f"with_{program}.py")]
    inputs = digest([case, *scripts, *getattr(adapter, "FILES", [])])
    if result.exists():
        found = json.loads(result.read_text())
        if found["inputs"] == inputs and found["version"] == version:
            print(f"{result.stem}: done earlier")
            return
    problem = Problem(case, mesh, int(refinement))
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        status, seconds, memory = measured(adapter.command(problem, case, folder), folder)
        outcome = adapter.outcome(problem, folder)
        last = (folder / "output").read_text().strip().splitlines()[-5:]
    forces = outcome["forces"]
    reached = forces[-1]["time"] if forces else 0.0
    record = {
        "program": program,
        "version": version,
        "method": adapter.METHOD,
        "inputs": inputs,
        "status": status,
        "finished": status == 0 and abs(reached - 1) < 1e-9,
        "reached": reached,
        "pressed": problem.pressed(),
        "steps": problem.steps,
        "seconds": seconds,
        "memory": memory,
        **outcome,
        "last_lines": last,
    }
    partial = result.with_suffix(".part")
    partial.write_text(json.dumps(record, indent=1) + "\n")
    partial.replace(result)
    print(f"{result.stem}: time {reached:g}, {record['newton']} Newton iterations, {seconds:.1f} s, {memory:.0f} MB")


if __name__ == "__main__":
    main(*sys.argv[1:])
