#!/usr/bin/env python3
"""Forty small design problems, each with default settings, with MMA without its guard, and ten times with tuned settings.

    docs/measure/optimizers/problems/problems.py                      runs what is not yet in problems.csv
    docs/measure/optimizers/problems/problems.py --again VARIANT      repeats one variant, such as `default`
    docs/measure/optimizers/problems/problems.py --only NAME --out D  one problem; keeps its files in D
    docs/measure/optimizers/problems/problems.py --table              only prints the table

See docs/measurements/optimizers.md. Python 3.11, standard library only.
"""

import argparse
import copy
import csv
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import time

from definitions import PROBLEMS

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2]))
from toml_case import toml

HERE = pathlib.Path(__file__).parent
PROGRAM = pathlib.Path(os.environ["SLIPSTICK"]) if "SLIPSTICK" in os.environ else HERE.parents[3] / "target/release/slipstick"
TABLE = HERE / "problems.csv"
FIELDS = ["problem", "variant", "outcome", "objective", "violation", "iterations", "seconds", "said"]

#: Seconds after which a run counts as failed.
LIMIT = 300.0

#: A design meets its constraints up to this violation, relative to the bound.
FEASIBLE = 1e-3

#: How much worse than the best tuned run a run may be.
CLOSE = 0.02


def moves(limit):
    return lambda case: case["optimizer"].update(mma={"move_limit": limit})


def gcmma(limit):
    return lambda case: case["optimizer"].update(method="gcmma", mma={"move_limit": limit})


def asymptotes(case):
    case["optimizer"]["mma"] = {"move_limit": 0.1, "asyinit": 0.2, "asyincr": 1.1, "asydecr": 0.6}


def schedule(limit=0.1, **lists):
    """A schedule that ends with the values of the problem, so that the results can be compared."""
    def change(case):
        optimizer = case["optimizer"]
        old = optimizer.setdefault("schedule", {})
        old.update({key: value for key, value in lists.items() if key == "p"})
        optimizer["mma"] = {"move_limit": limit}
        projection = case["design"].get("projection")
        if projection is not None and "sharpness" in lists:
            end = old["sharpness"][-1][1] if "sharpness" in old else projection.get("sharpness", 8.0)
            steps = [[at, value] for at, value in lists["sharpness"] if value < end]
            last = lists["sharpness"][len(steps)][0] if len(steps) < len(lists["sharpness"]) else steps[-1][0] + 6
            old["sharpness"] = [*steps, [last, end]]
        elif "p" not in lists:
            old["p"] = [[0, 1.5], [8, 2.0], [16, 2.5], [24, 3.0]]
    return change


def start(change):
    def changed(case):
        design = case["design"]
        initial = design.get("initial", design.get("volume_fraction"))
        design["initial"] = round(min(max(initial + change, 0.1), 0.95), 3)
        case["optimizer"]["mma"] = {"move_limit": 0.1}
    return changed


#: Settings of the runs: the default, MMA without its guard for comparison, and the tuned ones.
VARIANTS = {
    "default": lambda case: None,
    "plain MMA": moves(0.1),
    "move 0.05": moves(0.05),
    "move 0.2": moves(0.2),
    "move 0.5": moves(0.5),
    "asymptotes": asymptotes,
    "gcmma 0.1": gcmma(0.1),
    "gcmma 0.4": gcmma(0.4),
    "p": schedule(p=[[0, 1.0], [8, 2.0], [16, 3.0]]),
    "sharpness": schedule(0.2, sharpness=[[0, 1.0], [10, 2.0], [16, 4.0], [22, 8.0]]),
    "lighter start": start(-0.15),
    "heavier start": start(0.25),
}


def run(problem, variant, keep=None):
    made = PROBLEMS[problem]()
    case, files = copy.deepcopy(made if isinstance(made, tuple) else (made, {}))
    VARIANTS[variant](case)
    with tempfile.TemporaryDirectory() as scratch:
        folder = pathlib.Path(keep or scratch)
        folder.mkdir(parents=True, exist_ok=True)
        for name, text in {**files, "case.toml": toml(case)}.items():
            (folder / name).write_text(text)
        command = ["nice", "-n", "19", PROGRAM, "optimize", "case.toml", "--force", "-o", "out", "--threads", "1", "--json"]
        clock = time.monotonic()
        try:
            done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=LIMIT)
            code, text = done.returncode, done.stdout + done.stderr
        except subprocess.TimeoutExpired:
            code, text = None, ""
        seconds = time.monotonic() - clock
        if keep:
            (folder / "log.txt").write_text(text)
    events = [json.loads(line) for line in text.splitlines() if line.startswith("{")]
    row = {"problem": problem, "variant": variant, "seconds": f"{seconds:.1f}", "objective": "", "violation": "", "iterations": ""}
    result = next((event for event in events if event.get("command") == "optimize" and "objective" in event), None)
    if code != 0 or result is None:
        messages = [str(event.get("message", "")) for event in events if "error" in str(event)] or text.splitlines()[-1:]
        said = " ".join(messages[-1].split()) if messages else ""
        return {**row, "outcome": "not done in time" if code is None else "failed", "said": said[:200]}
    feasible = result["violation"] <= FEASIBLE
    warning = next((str(e.get("message")) for e in events if "violates its constraints" in str(e.get("message"))), "")
    return {**row, "outcome": "feasible" if feasible else "infeasible", "objective": f"{result['objective']:.6g}",
            "violation": f"{result['violation']:.2g}", "iterations": result["iterations"], "said": warning[:200]}


def read():
    if not TABLE.exists():
        return {}
    with TABLE.open() as file:
        return {(row["problem"], row["variant"]): row for row in csv.DictReader(file)}


def write(rows):
    with TABLE.open("w") as file:
        writer = csv.DictWriter(file, FIELDS, lineterminator="\n")
        writer.writeheader()
        for problem in PROBLEMS:
            writer.writerows(rows[problem, variant] for variant in VARIANTS if (problem, variant) in rows)


def number(value):
    return f"{float(value):.4g}".replace("-", "−")


def table(rows):
    lines = ["| problem | plain MMA | default: outcome | objective | best tuned | by | default is worse by |",
             "|---|--:|---|--:|--:|---|--:|"]
    good = close = plain_feasible = plain_close = 0
    for problem in PROBLEMS:
        default = rows.get((problem, "default"))
        if default is None:
            continue
        tuned = [rows[problem, variant] for variant in list(VARIANTS)[2:] if (problem, variant) in rows]
        tuned = [row for row in tuned if row["outcome"] == "feasible"]
        best = min(tuned, key=lambda row: float(row["objective"]), default=None)
        outcome, worse = default["outcome"], ""
        if outcome == "infeasible":
            outcome = f"violates by {100 * float(default['violation']):.2g} %" + (", warned" if default["said"] else ", silent")
        good += default["outcome"] == "feasible" or bool(default["said"])
        if default["outcome"] == "feasible":
            if best is None:
                worse = "no tuned run is feasible"
                close += 1
            else:
                loss = (float(default["objective"]) - float(best["objective"])) / abs(float(best["objective"]))
                close += loss <= CLOSE
                worse = f"{100 * loss:.1f} %".replace("-", "−")
        elif best is None:
            worse = "no tuned run is feasible"
        plain = rows.get((problem, "plain MMA"), {"outcome": "–"})
        if plain["outcome"] == "feasible":
            plain_feasible += 1
            limit = best and float(best["objective"]) + CLOSE * abs(float(best["objective"]))
            plain_close += best is None or float(plain["objective"]) <= limit
        plain = number(plain["objective"]) if plain["outcome"] == "feasible" else plain["outcome"]
        cells = [problem, plain, outcome, number(default["objective"]) if default["objective"] else "–",
                 number(best["objective"]) if best else "–", best["variant"] if best else "–", worse or "–"]
        lines.append("| " + " | ".join(cells) + " |")
    count = sum((problem, "default") in rows for problem in PROBLEMS)
    lines.append("")
    lines.append(f"Of {count} problems, {good} end feasible or say why not, and {close} are at most {100 * CLOSE:.0f} % worse than the")
    lines.append(f"best tuned run. With plain MMA, {plain_feasible} end feasible, and {plain_close} are at most {100 * CLOSE:.0f} % worse.")
    tuned = [rows.get((problem, variant), {}).get("outcome") for problem in PROBLEMS for variant in list(VARIANTS)[2:]]
    without = sum(outcome not in ("feasible", "infeasible") for outcome in tuned)
    lines.append(f"{without} of the {len(tuned)} tuned runs have no result, since a path failed or time ran out.")
    return "\n".join(lines) + "\n"


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--again", action="append", default=[], choices=list(VARIANTS))
    parser.add_argument("--only", choices=list(PROBLEMS))
    parser.add_argument("--variant", action="append", choices=list(VARIANTS))
    parser.add_argument("--out", type=pathlib.Path)
    parser.add_argument("--table", action="store_true")
    arguments = parser.parse_args()
    if arguments.table:
        print(table(read()), end="")
        return
    if arguments.only:
        for variant in arguments.variant or VARIANTS:
            keep = arguments.out and arguments.out / variant.replace(" ", "_")
            row = run(arguments.only, variant, keep)
            print(*[row[key] for key in FIELDS], sep="\t", flush=True)
        return
    again = set(arguments.again)
    for variant in arguments.variant or VARIANTS:
        for problem in PROBLEMS:
            rows = read()
            if (problem, variant) in rows and variant not in again:
                continue
            rows[problem, variant] = run(problem, variant)
            write(rows)
            print(*[rows[problem, variant][key] for key in FIELDS], sep="\t", flush=True)


if __name__ == "__main__":
    main()
