"""A small neural network as the parametrization of the density, trained with Adam of PyTorch.

The network maps the centre of an element to its density. The bound on the volume is met exactly:
the output of the network is shifted by a number that bisection finds.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import slipstick as ss
import torch
from scipy_slsqp import CASE


class Density(torch.nn.Module):
    """Densities of the designed elements from their centres."""

    def __init__(self, centres: torch.Tensor, volumes: torch.Tensor, fraction: float) -> None:
        super().__init__()
        self.layers = torch.nn.Sequential(
            torch.nn.Linear(3, 16), torch.nn.Tanh(), torch.nn.Linear(16, 1)
        ).double()
        self.centres, self.volumes, self.fraction = centres, volumes, fraction

    def forward(self) -> torch.Tensor:
        """The densities, which fill the fraction of the volume."""
        output = 4.0 * self.layers(self.centres).squeeze(1)
        with torch.no_grad():
            low, high = -output.max() - 20.0, -output.min() + 20.0
            for _ in range(60):
                shift = 0.5 * (low + high)
                filled = self.volumes @ torch.sigmoid(output + shift)
                low, high = (low, shift) if filled > self.fraction else (shift, high)
            # implicit function theorem: the shift depends on the output, too
            slope = torch.sigmoid(output + shift)
            slope = self.volumes * slope * (1.0 - slope)
        shift = shift - (slope @ (output - output.detach())) / slope.sum()
        return torch.sigmoid(output + shift)


def main(epochs: int = 20) -> dict[str, Any]:
    """Train for this many analyses; returns what was found."""
    torch.manual_seed(0)
    problem = CASE.build()
    mesh, designed = problem.mesh, problem.designed
    centres = mesh.nodes[mesh.hexahedra].mean(axis=1)[designed]
    centres = (centres - centres.mean(axis=0)) / np.ptp(centres, axis=0).max()
    volumes = mesh.volumes[designed] / mesh.volumes[designed].sum()
    fraction = CASE.resolved["design"]["volume_fraction"]
    network = Density(torch.tensor(centres), torch.tensor(volumes), fraction)
    objective = ss.torch.objective(problem)
    full, index = torch.ones(mesh.elements, dtype=torch.float64), torch.tensor(designed)
    optimizer = torch.optim.Adam(network.parameters(), lr=0.02)
    history = []
    for _ in range(epochs):
        optimizer.zero_grad()
        value = objective(full.index_put((index,), network()))
        value.backward()
        history.append(value.item())
        optimizer.step()
    with torch.no_grad():
        volume = float(torch.tensor(volumes) @ network())
    return {"history": history, "volume": volume}


if __name__ == "__main__":
    print(main())
