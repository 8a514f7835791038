#!/usr/bin/env python3
"""A soft block that is pressed on a rigid plane and dragged, computed without slipstick.

Plane strain, bilinear quadrilaterals, compressible neo-Hooke. The nodes of the bottom and of both sides
meet the plane with a penalty and Coulomb's law, so that the normal of contact is that of the plane. Prints
forces along the slide, for docs/measurements/edges.md, "High friction at a leading edge". Needs NumPy.
"""

import numpy as np

WIDTH, HEIGHT, E, NU, PENALTY = 1.5, 1.5, 1000.0, 0.3, 1e5
PRESS, SLIDE, STEPS = 0.05, 1.0, 40


class Block:
    def __init__(self, n):
        number = lambda i, j: j * (n + 1) + i
        self.x = np.array([[i * WIDTH / n, j * HEIGHT / n] for j in range(n + 1) for i in range(n + 1)])
        corners = lambda i, j: [number(i, j), number(i + 1, j), number(i + 1, j + 1), number(i, j + 1)]
        self.elements = np.array([corners(i, j) for j in range(n) for i in range(n)])
        self.top = [number(i, n) for i in range(n + 1)]
        outline = [number(0, j) for j in range(n - 1, 0, -1)] + [number(i, 0) for i in range(n + 1)]
        outline += [number(n, j) for j in range(1, n)]
        self.length = {node: 0.0 for node in outline}
        for a, b in zip(outline, outline[1:]):
            for node in (a, b):
                self.length[node] += 0.5 * np.linalg.norm(self.x[a] - self.x[b])
        gauss = 1 / np.sqrt(3)
        self.points = []
        for s, t in ((-gauss, -gauss), (gauss, -gauss), (gauss, gauss), (-gauss, gauss)):
            slopes = 0.25 * np.array([[t - 1, s - 1], [1 - t, -1 - s], [1 + t, 1 + s], [-1 - t, 1 - s]])
            jacobian = np.einsum("ab,eac->ebc", slopes, self.x[self.elements])
            gradient = np.einsum("ab,ecb->eac", slopes, np.linalg.inv(jacobian))
            self.points.append((gradient, np.linalg.det(jacobian)))
        self.dofs = (2 * self.elements[:, :, None] + np.arange(2)).reshape(len(self.elements), 8)

    def assemble(self, u, traction, before, mu):
        """Residual, tangent, tangential forces, resultant and status; None if an element is inverted."""
        size = 2 * len(self.x)
        residual, tangent = np.zeros(size), np.zeros((size, size))
        d, one = u.reshape(-1, 2), np.eye(2)
        c, beta = E / (4 * (1 + NU)), NU / (1 - 2 * NU)
        for gradient, volume in self.points:
            f = one + np.einsum("eai,eaj->eij", d[self.elements], gradient)
            j = np.linalg.det(f)
            if j.min() <= 0:
                return None
            inverse, power = np.linalg.inv(f), j ** (-2 * beta)
            stress = 2 * c * (f - power[:, None, None] * inverse.transpose(0, 2, 1))
            power = power[:, None, None, None, None]
            moduli = 2 * beta * np.einsum("eji,elk->eijkl", inverse, inverse)
            moduli = moduli + np.einsum("ejk,eli->eijkl", inverse, inverse)
            moduli = 2 * c * (np.einsum("ik,jl->ijkl", one, one)[None] + power * moduli)
            force = np.einsum("eaj,eij,e->eai", gradient, stress, volume).reshape(-1, 8)
            stiffness = np.einsum("eaj,eijkl,ebl,e->eaibk", gradient, moduli, gradient, volume).reshape(-1, 8, 8)
            np.add.at(residual, self.dofs, force)
            np.add.at(tangent, (self.dofs[:, :, None], self.dofs[:, None, :]), stiffness)
        forces, resultant, stick = {}, np.zeros(2), 0
        for node, length in self.length.items():
            x, y = self.x[node] + d[node]
            if y >= 0:
                continue
            k = PENALTY * length
            pressure = -k * y
            trial = traction.get(node, 0.0) - k * (x - before[node])
            if abs(trial) <= mu * pressure:
                friction, slopes, stick = trial, (k, 0.0), stick + 1
            else:
                friction, slopes = mu * pressure * np.sign(trial), (0.0, mu * k * np.sign(trial))
            forces[node] = friction
            resultant += [friction, pressure]
            row = [2 * node, 2 * node + 1]
            residual[row] -= [friction, pressure]
            tangent[np.ix_(row, row)] += [slopes, (0.0, k)]
        return residual, tangent, forces, resultant, (stick, len(forces) - stick)


def drag(mu, n):
    block = Block(n)
    size = 2 * len(block.x)
    fixed = np.array([2 * node + c for node in block.top for c in (0, 1)])
    free = np.setdiff1d(np.arange(size), fixed)
    u, traction, before, at = np.zeros(size), {}, block.x[:, 0].copy(), np.zeros(2)
    path = [np.array([0.0, -PRESS * (k + 1) / 4]) for k in range(4)]
    path += [np.array([SLIDE * (k + 1) / STEPS, -PRESS]) for k in range(STEPS)]
    for number, target in enumerate(path):
        pending = [target]
        while pending:
            moved = np.zeros(size)
            moved[fixed] = np.tile(pending[-1] - at, len(block.top))
            trial, state, converged = u.copy(), None, False
            for iteration in range(40):
                state = block.assemble(trial, traction, before, mu)
                if state is None:
                    break
                residual, tangent = state[:2]
                right = -residual[free] - tangent[np.ix_(free, fixed)] @ moved[fixed]
                step = np.linalg.solve(tangent[np.ix_(free, free)], right)
                trial[free] += step
                trial += moved
                moved[:] = 0.0
                if not np.abs(step).max() < 1.0:
                    break
                if iteration > 0 and np.abs(step).max() < 1e-9:
                    state = block.assemble(trial, traction, before, mu)
                    converged = state is not None
                    break
            if converged:
                u, traction, before, at = trial, state[2], block.x[:, 0] + trial[0::2], pending.pop()
            elif len(pending) > 8:
                return print(f"mu {mu}: no equilibrium beyond {at}")
            else:
                pending.append(0.5 * (at + pending[-1]))
        if number % 8 == 3 and number > 3:
            (fx, fy), (stick, slip) = state[3], state[4]
            print(f"mu {mu}, {n} x {n}: slide {at[0]:.1f}, Fx {-fx:.2f}, Fy {fy:.2f}, ratio {-fx / fy:.4f}, "
                  f"{stick} nodes stick, {slip} slip", flush=True)


if __name__ == "__main__":
    for mu in (0.3, 0.5, 0.7, 0.8, 0.9, 1.3):
        for n in (6, 12):
            drag(mu, n)
