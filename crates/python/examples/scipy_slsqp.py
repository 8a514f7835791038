"""The least material whose grip reaches a bound, with SLSQP of scipy.

The objective is the volume, and the bound a quantity of the case: the optimizer sees functions and
gradients, and slipstick analyses each design once for both.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
import slipstick as ss
from numpy.typing import NDArray
from scipy.optimize import minimize

STEEL = {"neo_hooke": {"youngs_modulus": 1000.0, "poisson_ratio": 0.3}}
CASE = ss.Case.from_dict(
    {
        "body": [
            {
                "name": "slab",
                "box": {"min": [0.0, 0.0, 0.0], "max": [4.0, 1.0, 1.3], "elements": [6, 2, 2]},
                "material": STEEL,
            },
            {
                "name": "block",
                "box": {"min": [0.6, 1.0, 0.2], "max": [1.7, 1.8, 1.0], "elements": [2, 1, 1]},
                "material": STEEL,
            },
        ],
        "contact": [{"slave": "block_ymin", "master": "slab_ymax", "friction": 0.3}],
        "dirichlet": [
            {"set": "slab_ymin"},
            {"set": "block_ymax", "motion": [{"t": 1.0, "u": [0.05, -0.08, 0.0]}]},
        ],
        "load_path": {"steps": 2},
        "design": {"bodies": ["slab"], "volume_fraction": 0.7, "simp": {"p": 3.0, "min": 0.01}},
        "objective": {"contact_force": {"steps": "last"}},
        "optimizer": {"iterations": 10},
        "quantity": [
            {"name": "grip", "contact_force": {"slave": "block_ymin", "component": "normal"}}
        ],
    },
    name="slab.toml",
)


def main(share: float = 0.75, iterations: int = 25) -> dict[str, Any]:
    """Ask for this share of the grip of the full slab; returns what was found."""
    problem = CASE.build()
    designed = problem.designed
    volumes = problem.mesh.volumes[designed] / problem.mesh.volumes[designed].sum()
    full = np.ones(problem.mesh.elements)
    least = share * problem.solve(full).quantities["grip"][-1]

    def density(x: NDArray[np.float64]) -> NDArray[np.float64]:
        found = full.copy()
        # SLSQP may leave its bounds by round-off
        found[designed] = np.clip(x, 0.0, 1.0)
        return found

    @lru_cache(maxsize=1)
    def analysed(x: bytes) -> tuple[float, NDArray[np.float64]]:
        values, pullback = problem.vjp(density(np.frombuffer(x)), "grip")
        return values["grip"][-1] / least - 1.0, pullback({"grip": [0.0, 1.0 / least]})[designed]

    found = minimize(
        lambda x: float(volumes @ x),
        np.full(len(designed), 0.9),
        jac=lambda x: volumes,
        bounds=[(0.0, 1.0)] * len(designed),
        constraints={
            "type": "ineq",
            "fun": lambda x: analysed(x.tobytes())[0],
            "jac": lambda x: analysed(x.tobytes())[1],
        },
        method="SLSQP",
        options={"maxiter": iterations, "ftol": 1e-6},
    )
    grip = problem.solve(density(found.x)).quantities["grip"][-1]
    return {"volume": found.fun, "grip": grip, "bound": least, "iterations": found.nit}


if __name__ == "__main__":
    print(main())
