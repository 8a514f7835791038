#!/usr/bin/env python3
"""Random small contact set-ups of the kinds that engineers build, with default settings.

    docs/measure/robustness/setups/setups.py                     300 set-ups; writes setups.md and setups.csv to --out
    docs/measure/robustness/setups/setups.py --seed 17           one of them again, with all findings
    docs/measure/robustness/setups/setups.py --seed 17 --write   only its case file

See docs/measurements/robustness.md for what is checked. Python 3.11, standard library only.
"""

import argparse
import collections
import concurrent.futures
import copy
import csv
import os
import pathlib
import random
import shutil
import statistics
import subprocess
import sys
import time

import kinds
import results
from geometry import exchanged, permuted, refined, turned, scaled

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2]))
from toml_case import toml

PROGRAM = pathlib.Path(os.environ["SLIPSTICK"]) if "SLIPSTICK" in os.environ else pathlib.Path(__file__).parents[4] / "target/release/slipstick"

#: Seconds after which a set-up counts as failed.
LIMIT = 120.0

#: Times as many steps, to tell errors of the trapezoidal rule from losses.
FINER = 8


def set_up(seed):
    """The set-up of a seed: its kind, its case, its mesh files."""
    kind = kinds.KINDS[seed % len(kinds.KINDS)]
    return kind(random.Random(seed))


def variant(seed, setup):
    """One of the equivalent cases of a set-up, with the change that it means for forces."""
    name = ["rotated", "units", "sides", "radius"][seed // len(kinds.KINDS) % 4]
    case = copy.deepcopy(setup.case)
    if name == "rotated":
        if any("boxes" in surface for surface in case.get("surface", [])):
            return None
        case = permuted(case) if setup.has_components else turned(case, [1.0, 2.0, 3.0], 37.0)
    elif name == "units":
        case = scaled(case, 1000.0)
    elif name == "sides":
        if not setup.swappable:
            return None
        case = exchanged(case)
    else:
        if setup.size == 0.0:
            return None
        for contact in case["contact"]:
            contact["search_radius"] = setup.size
    return name, case


#: Times as many elements along the edges of boxes and of other bodies, to tell errors of a coarse mesh from disagreement.
FINER_MESHES = [(3, 2), (4, 3)]


def on_finer_meshes(folder, setup):
    """Whether the forces with the sides as given and exchanged agree on a finer mesh; a remark."""
    remark, agree = "no finer mesh", False
    for boxes, others in FINER_MESHES:
        case = refined(setup.case, boxes, others)
        if case is None:
            break
        forces = []
        for name, sides in [("given", case), ("exchanged", exchanged(case))]:
            out = folder / f"finer-{name}"
            code, text, _ = run(out, sides, setup.meshes, 1, limit=4 * LIMIT)
            if code != 0:
                return False, f"{name} on a finer mesh: {reason(text)}"
            forces.append(results.Run(out / "out", setup).force)
        remark = f"{forces[0]:.4g} and {forces[1]:.4g} on a finer mesh"
        agree = max(forces) > 0.0 and abs(forces[0] - forces[1]) <= results.SAME["sides"] * max(forces)
        if agree:
            break
    return agree, remark


def right_on_a_finer_mesh(folder, setup):
    """Whether nothing is found on a finer mesh, where depths are relative to its smaller facets; a remark."""
    remark = "no finer mesh"
    for boxes, others in FINER_MESHES:
        case = refined(setup.case, boxes, others)
        if case is None:
            break
        steps = case["load_path"]["steps"]
        for factor in [1, FINER]:
            case["load_path"]["steps"] = factor * steps
            code, text, _ = run(folder / "finer-mesh", case, setup.meshes, 1, limit=4 * LIMIT)
            if code != 0:
                return False, f"on a finer mesh: {reason(text)}"
            found = results.Run(folder / "finer-mesh/out", setup)
            notes, lost = found.findings(), found.lost(after=0 if factor == 1 else 1)
            remark = f"on a finer mesh {100 * found.energy:.1f} % of the work, {found.depth:.2f} of a facet"
            if notes:
                remark += f", {notes[0]}"
                break
            if not lost:
                return True, remark
    return False, remark


def has_no_equilibrium(folder, setup):
    """Whether a set-up whose last load grows to the end of the path cannot carry it: its surface is moved instead, as a
    whole, which is no weaker, and the largest reaction is less than the load. Returns a remark, or None."""
    loads = setup.case.get("load", [])
    if len(loads) < 2:
        return None
    case = copy.deepcopy(setup.case)
    last = case["load"].pop()
    (axis,) = [c for c in range(3) if last["force"][c] != 0.0] or [None]
    begin = [w["t"] for w in last["amplitude"] if w["factor"] == 0.0]
    if axis is None or not begin:
        return None
    far = [0.0, 0.0, 0.0]
    far[axis] = 0.3 if last["force"][axis] > 0.0 else -0.3
    case["dirichlet"].append({"set": last["surface"], "components": ["xyz"[axis]],
                              "motion": [{"t": begin[-1], "u": [0.0, 0.0, 0.0]}, {"t": 1.0, "u": far}]})
    case["load_path"]["steps"] = 40
    code, _, _ = run(folder / "moved", case, setup.meshes, 1)
    if code != 0:
        return None
    rows = results.read_csv(folder / "moved/out/quantities.csv")
    reached = max(abs(float(row[f"reaction_{last['surface']}_{'xyz'[axis]}"])) for row in rows)
    load = abs(last["force"][axis])
    return f"carries {reached:.4g} of {load:.4g} at most" if reached < load else None


def run(folder, case, meshes, threads, limit=LIMIT):
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in meshes.items():
        (folder / name).write_text(text)
    (folder / "case.toml").write_text(toml(case))
    command = [PROGRAM, "solve", "case.toml", "--force", "-o", "out", "--threads", str(threads)]
    clock = time.monotonic()
    try:
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=limit)
        code, text = done.returncode, done.stdout + done.stderr
    except subprocess.TimeoutExpired:
        code, text = None, f"not done after {limit:.0f} s"
    return code, text, time.monotonic() - clock


Row = collections.namedtuple("Row", "seed kind outcome iterations seconds energy depth notes warned")

#: Warnings about results that cannot be trusted.
WARNINGS = ["contact transmits no force", "neither friction nor a gap accounts for", "stored energy of"]

#: The warning about work that too large steps miscount; it says nothing about forces.
COARSE_STEPS = "load steps are coarse for the friction work"

#: What the program says of a body that comes loose under its loads.
LOOSE = "only contact holds body"


def reason(text):
    """The line of the message that says why a run failed."""
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    errors = [line for line in lines if "error" in line or "failed" in line or "not done" in line]
    return (errors or lines or ["no message"])[0][:240]


def judge(seed, folder, compare):
    setup = set_up(seed)
    code, text, seconds = run(folder / "base", setup.case, setup.meshes, 1)
    if code != 0:
        kind = "refused" if code == 2 else "failed"
        impossible = has_no_equilibrium(folder, setup)
        loose = [line.strip() for line in text.splitlines() if LOOSE in line]
        if impossible and loose:
            kind, text = "impossible", f"error: {impossible}; {loose[0]}"
        return Row(seed, setup.kind, kind, results.iterations(folder / "base/out"), seconds, 0.0, 0.0, [reason(text)], True)
    found = results.Run(folder / "base/out", setup)
    warned = any(warning in text for warning in WARNINGS)
    notes, remarks, miscounted = found.findings(), [], False
    if found.lost():
        # steps may be too large for the trapezoidal rule: only a loss that remains with smaller ones counts; the first
        # one may let a load fall over a gap, or remove an overlap, and neither conserves energy
        finer = copy.deepcopy(setup.case)
        finer["load_path"]["steps"] *= FINER
        code, finer_text, _ = run(folder / "finer", finer, setup.meshes, 1, limit=4 * LIMIT)
        again = results.Run(folder / "finer/out", setup) if code == 0 else None
        if again is None:
            notes.append(f"{FINER} times the steps: {reason(finer_text)}")
        elif again.lost(after=1):
            notes.append(f"{100 * found.energy:.1f} % of the work is missing, {100 * again.energy:.1f} % with {FINER} times the steps")
            miscounted = COARSE_STEPS in text
    if compare:
        other = variant(seed, setup)
        if other is not None:
            name, case = other
            code, text, _ = run(folder / name, case, setup.meshes, 1)
            if code != 0:
                notes.append(f"{name}: {reason(text)}")
            else:
                other = results.Run(folder / name / "out", setup)
                differ = found.differences(name, other)
                # a run that is right does not warn; the other one does
                warned |= any(warning in text for warning in WARNINGS)
                if differ and name == "sides":
                    agree, remark = on_finer_meshes(folder, setup)
                    differ = [f"{differ[0]}, {remark}"]
                    if agree and warned:
                        remarks, differ = differ, []
                notes += differ
    if notes and warned:
        # an error of the mesh vanishes with it
        right, remark = right_on_a_finer_mesh(folder, setup)
        notes[-1] += f"; {remark}"
        if right:
            remarks, notes = remarks + notes, []
    outcome = "wrong" if notes else "finer" if remarks else "complete"
    notes += remarks
    # a warning about work is none about other findings
    warned |= miscounted and len(notes) == 1
    return Row(seed, setup.kind, outcome, found.iterations, seconds, found.energy, found.depth, notes, warned)


def table(rows):
    lines = ["| kind | set-ups | complete | right on a finer mesh | no equilibrium | failed | wrong | of these without a warning "
             "| iterations, median | largest | seconds, median | largest |"]
    lines.append("|---|---|---|---|---|---|---|---|---|---|---|---|")
    names = list(dict.fromkeys(row.kind for row in rows))
    for name in names + ["all"]:
        mine = [row for row in rows if name in (row.kind, "all")]
        if not mine:
            continue
        of = lambda outcome: sum(row.outcome in outcome for row in mine)
        numbers = [row.iterations for row in mine]
        times = [row.seconds for row in mine]
        lines.append(
            f"| {name} | {len(mine)} | {of(['complete'])} | {of(['finer'])} | {of(['impossible'])} | {of(['failed', 'refused'])} | {of(['wrong'])} "
            f"| {sum(row.outcome == 'wrong' and not row.warned for row in mine)} "
            f"| {statistics.median(numbers):.0f} | {max(numbers)} "
            f"| {statistics.median(times):.1f} | {max(times):.1f} |"
        )
    return "\n".join(lines) + "\n"


def failures(rows, path):
    with open(path, "w", newline="") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(["seed", "kind", "outcome", "warned", "why"])
        out.writerows([row.seed, row.kind, row.outcome, "yes" if row.warned else "no", "; ".join(row.notes)] for row in rows if row.outcome != "complete")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--count", type=int, default=304)
    parser.add_argument("--seed", type=int, help="only this set-up")
    parser.add_argument("--write", action="store_true", help="write case files, run nothing")
    parser.add_argument("--alone", action="store_true", help="without the equivalent case")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("setups"))
    options = parser.parse_args()
    seeds = [options.seed] if options.seed is not None else range(options.first, options.first + options.count)
    if options.write:
        for seed in seeds:
            setup, folder = set_up(seed), options.out / str(seed)
            folder.mkdir(parents=True, exist_ok=True)
            (folder / "case.toml").write_text(toml(setup.case))
            for name, text in setup.meshes.items():
                (folder / name).write_text(text)
            print(folder / "case.toml")
        return
    rows = []
    with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        judged = {seed: pool.submit(judge, seed, options.out / str(seed), not options.alone) for seed in seeds}
        for seed, future in judged.items():
            row = future.result()
            rows.append(row)
            print(f"{seed:4} {row.kind:22} {row.outcome:9} {'warned' if row.warned else '':6} {row.iterations:5} {row.seconds:6.1f} s  {'; '.join(row.notes)}", flush=True)
            if row.outcome == "complete" and options.seed is None:
                shutil.rmtree(options.out / str(seed), ignore_errors=True)
    print(table(rows))
    options.out.mkdir(parents=True, exist_ok=True)
    if options.seed is None:
        (options.out / "setups.md").write_text(table(rows))
        failures(rows, options.out / "setups.csv")


if __name__ == "__main__":
    main()
