"""Runs the program slipstick (environment variable SLIPSTICK)."""

import csv
import json
import os
import subprocess

METHOD = "segment-based mortar, Lagrange multipliers"

PROGRAM = os.environ["SLIPSTICK"]
# A new build is a reason to run again.
FILES = [PROGRAM]


def version():
    return subprocess.run([PROGRAM, "--version"], capture_output=True, text=True, check=True).stdout.split()[-1]


def command(problem, case, folder):
    """Command line that solves the case in a folder."""
    return [PROGRAM, "solve", str(case), "--threads", "1", "--out", "run", "--force", "--json"]


def outcome(problem, folder):
    """Forces and counts from what the command left in the folder."""
    forces, newton = [], 0
    for line in (folder / "output").read_text().splitlines():
        event = json.loads(line) if line.startswith("{") else {}
        if event.get("event") == "result":
            newton = event["newton_iterations"] + event["failed_iterations"]
    table = folder / "run/quantities.csv"
    if not table.exists():
        return {"forces": [], "newton": newton}
    with open(table, newline="") as file:
        for row in csv.DictReader(file):
            reaction = [float(row[f"reaction_{problem.driven}_{axis}"]) for axis in "xyz"]
            forces.append({"time": float(row["time"]), "reaction": reaction})
    return {"forces": forces, "newton": newton}
