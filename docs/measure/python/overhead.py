"""Time of a call of the Python package beyond the analysis, at about 33 000 unknowns.

python docs/measure/python/overhead.py

An analysis of this size takes seconds, and their spread hides milliseconds. So this measures what a
call does before and after the analysis. Densities are checked and converted, as in all calls, here
by `volume_fraction`, which does nothing else without a design; and results become arrays. Contact
is evaluated when it is read, which takes as long as assembling the forces once.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
import slipstick as ss

REPETITIONS = 20
MATERIAL = {"neo_hooke": {"youngs_modulus": 1000.0, "poisson_ratio": 0.3}}
CASE = {
    "body": [
        {
            "name": "slab",
            "box": {
                "min": [0.0, 0.0, 0.0],
                "max": [3.0, 1.0, 3.0],
                "elements": [32, 10, 32],
            },
            "material": MATERIAL,
        },
        {
            "name": "block",
            "box": {
                "min": [1.03, 1.0, 1.03],
                "max": [1.93, 1.6, 1.93],
                "elements": [6, 4, 6],
            },
            "material": MATERIAL,
        },
    ],
    "contact": [{"slave": "block_ymin", "master": "slab_ymax", "friction": 0.3}],
    "dirichlet": [
        {"set": "slab_ymin"},
        {"set": "block_ymax", "motion": [{"t": 1.0, "u": [0.0, -0.02, 0.0]}]},
    ],
    "load_path": {"steps": 1},
}


def milliseconds(call: Callable[[], object]) -> float:
    """The fastest of several calls."""
    times = []
    for _ in range(REPETITIONS):
        start = time.perf_counter()
        call()
        times.append(time.perf_counter() - start)
    return 1e3 * min(times)


def main() -> None:
    """Print the times."""
    case = ss.Case.from_dict(CASE)
    problem = case.build()
    density = problem.initial_density
    start = time.perf_counter()
    path = problem.solve(density)
    analysis = time.perf_counter() - start
    inner = path._path
    parts = {
        "densities in": lambda: problem.volume_fraction(density),
        "a gradient out": lambda: np.array(problem.initial_density),
        "a path out": lambda: ss.Path(inner),
        "displacements of a step": lambda: inner.displacement(1),
        "contact of a step": lambda: inner.contact(1),
    }
    print(f"{case.check().unknowns} unknowns, {problem.mesh.elements} elements")
    print(f"solve: {analysis:.2f} s, of which")
    times = {name: milliseconds(call) for name, call in parts.items()}
    for name, time_of in times.items():
        print(f"  {name}: {time_of:.3f} ms")
    print(f"together: {sum(times.values()):.3f} ms")


if __name__ == "__main__":
    main()
