"""Writes the problem as a deck for CalculiX, runs `ccx` and reads its results.

Two things differ from the case file. The neo-Hookean law of CalculiX separates the change of volume,
Psi = G/2 (I1 J^(-2/3) - 3) + K/2 (J - 1)^2, with the same shear and bulk modulus G and K for small
strains. Its mortar contact needs a contact stiffness, here 50 times the larger Young's modulus, and a
tenth of that for sticking nodes.
"""

import re
import subprocess

METHOD = "mortar, contact stiffness 50 E"

CONTACT_STIFFNESS = 50.0
STICK_STIFFNESS = 0.1


def version():
    output = subprocess.run(["ccx", "-v"], capture_output=True, text=True).stdout
    return re.search(r"Version (\S+)", output).group(1)


def lines_of(problem):
    """The input deck."""
    yield "*NODE, NSET=ALL"
    for number, x in enumerate(problem.points, 1):
        yield f"{number}, {x[0]:.15g}, {x[1]:.15g}, {x[2]:.15g}"
    for body in range(len(problem.materials)):
        yield f"*ELEMENT, TYPE=C3D8, ELSET=BODY{body}"
        for element in (problem.body == body).nonzero()[0]:
            yield ", ".join(str(n + 1) for n in [element, *problem.elements[element]])
    for name, surface in [("HELD", problem.held), ("DRIVEN", problem.driven)]:
        yield f"*NSET, NSET={name}"
        yield from (str(node + 1) for node in problem.nodes(surface))
    for name, surface in [("SLAVE", problem.slave), ("MASTER", problem.master)]:
        yield f"*SURFACE, NAME={name}, TYPE=ELEMENT"
        yield from (f"{element + 1}, S{face + 1}" for element, face in zip(*problem.facets(surface)))
    for body, (youngs_modulus, poisson_ratio) in enumerate(problem.materials):
        shear, bulk = youngs_modulus / 2 / (1 + poisson_ratio), youngs_modulus / 3 / (1 - 2 * poisson_ratio)
        yield f"*MATERIAL, NAME=LAW{body}"
        yield "*HYPERELASTIC, NEO HOOKE"
        yield f"{shear / 2:.15g}, {2 / bulk:.15g}"
        yield f"*SOLID SECTION, ELSET=BODY{body}, MATERIAL=LAW{body}"
    stiffness = CONTACT_STIFFNESS * max(youngs_modulus for youngs_modulus, _ in problem.materials)
    yield "*SURFACE INTERACTION, NAME=CONTACT"
    yield "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR"
    yield f"{stiffness:.15g}"
    yield "*FRICTION"
    yield f"{problem.friction:.15g}, {STICK_STIFFNESS * stiffness:.15g}"
    yield "*CONTACT PAIR, INTERACTION=CONTACT, TYPE=MORTAR"
    yield "SLAVE, MASTER"
    for axis in range(3):
        yield f"*AMPLITUDE, NAME=MOTION{axis + 1}"
        yield "0., 0."
        yield from (f"{point['t']:.15g}, {point['u'][axis]:.15g}" for point in problem.motion)
    step = 1 / problem.steps
    yield from ["*BOUNDARY", "HELD, 1, 3", "*STEP, NLGEOM, INC=1000", "*STATIC", f"{step:.15g}, 1., 1e-6, {step:.15g}"]
    for axis in range(3):
        yield f"*BOUNDARY, AMPLITUDE=MOTION{axis + 1}"
        yield f"DRIVEN, {axis + 1}, {axis + 1}, 1."
    yield from ["*NODE PRINT, NSET=DRIVEN, TOTALS=ONLY", "RF", "*END STEP"]


def command(problem, case, folder):
    """Writes the deck into a folder; command line that solves it there."""
    (folder / "case.inp").write_text("\n".join(lines_of(problem)) + "\n")
    return ["ccx", "case"]


def outcome(problem, folder):
    """Forces and counts from what the command left in the folder. Iterations of failed attempts count."""
    forces = []
    data = (folder / "case.dat").read_text() if (folder / "case.dat").exists() else ""
    for time, values in re.findall(r"total force.*for set DRIVEN and time\s+(\S+)\s+(.*)", data):
        forces.append({"time": float(time), "reaction": [float(value) for value in values.split()]})
    newton = len(re.findall(r"^ *iteration +\d+ *$", (folder / "output").read_text(), re.MULTILINE))
    return {"forces": forces, "newton": newton}
