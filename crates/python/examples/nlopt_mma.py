"""The objective of the case under its bound on the volume, with the MMA of nlopt."""

from __future__ import annotations

from typing import Any

import nlopt
import numpy as np
from numpy.typing import NDArray
from scipy_slsqp import CASE


def main(evaluations: int = 20) -> dict[str, Any]:
    """Minimize with this many evaluations; returns what was found."""
    problem = CASE.build()
    designed = problem.designed
    volumes = problem.mesh.volumes[designed] / problem.mesh.volumes[designed].sum()
    bound = CASE.resolved["design"]["volume_fraction"]
    density = problem.initial_density
    scale = abs(problem.value_and_gradient(density)[0])
    history = []

    def objective(x: NDArray[np.float64], gradient: NDArray[np.float64]) -> float:
        density[designed] = x
        value, slope = problem.value_and_gradient(density)
        # nlopt asks for the gradient by an array to fill
        if gradient.size:
            gradient[:] = slope[designed] / scale
        history.append(value)
        return value / scale

    def volume(x: NDArray[np.float64], gradient: NDArray[np.float64]) -> float:
        if gradient.size:
            gradient[:] = volumes
        return float(volumes @ x) - bound

    optimizer = nlopt.opt(nlopt.LD_MMA, len(designed))
    optimizer.set_min_objective(objective)
    optimizer.add_inequality_constraint(volume, 1e-8)
    optimizer.set_lower_bounds(0.0)
    optimizer.set_upper_bounds(1.0)
    optimizer.set_maxeval(evaluations)
    x = optimizer.optimize(density[designed].copy())
    return {"history": history, "objective": min(history), "volume": float(volumes @ x)}


if __name__ == "__main__":
    print(main())
