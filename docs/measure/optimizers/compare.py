#!/usr/bin/env python3
"""Solves Svanberg's problems with two independent programs and writes what they find to
crates/design/src/optimizer/tests/reference.csv, which the tests of the optimizer read.

    python3 -m venv venv && venv/bin/pip install nlopt==2.11.0 mmapy==0.3.1 numpy==2.4.6
    venv/bin/python docs/measure/optimizers/compare.py crates/design/src/optimizer/tests/reference.csv

nlopt (MIT): optima from the first start. LD_MMA is S. G. Johnson's implementation of Svanberg's
algorithm of 2002; LD_SLSQP, sequential quadratic programming, finds the same optima to more digits.
mmapy (GPL): A. Deetman's translation of Svanberg's own MMA and GCMMA; iterates from every start.
"""

import csv
import math
import sys

import mmapy
import nlopt
import numpy as np

ITERATIONS = 15


class Problem:
    """min f(x) subject to g(x) <= 0 and lower <= x <= upper: functions(x) = f, df, g, dg."""

    def __init__(self, name, functions, starts, lower, upper):
        self.name, self.functions, self.starts = name, functions, starts
        n = len(starts[0])
        self.bounds = [np.broadcast_to(np.array(bound, float), n).copy() for bound in (lower, upper)]


def cantilever(x):
    c = np.array([61.0, 37, 19, 7, 1])
    return 0.0624 * x.sum(), np.full(5, 0.0624), np.array([(c / x**3).sum() - 1]), (-3 * c / x**4)[None]


def two_bars(x):
    length, slope = math.hypot(1, x[1]), x[1] / math.hypot(1, x[1])
    g, dg = [], []
    for sign in (1, -1):
        load = 8 / x[0] + sign / (x[0] * x[1])
        g.append(0.124 * length * load - 1)
        dg.append([-0.124 * length * load / x[0], 0.124 * (slope * load - sign * length / (x[0] * x[1] ** 2))])
    return x[0] * length, np.array([length, x[0] * slope]), np.array(g), np.array(dg)


def two_balls(x):
    centres = np.array([[5.0, 2, 1], [3.0, 4, 3]])
    return x @ x, 2 * x, ((x - centres) ** 2).sum(axis=1) - 9, 2 * (x - centres)


def eight_bars(x):
    nodes = [[-250, -250, 0], [-250, 250, 0], [250, 250, 0], [250, -250, 0]]
    nodes += [[-375, 0, 0], [0, -375, 0], [375, 0, 0], [0, 375, 0]]
    bars = np.array([0, 0, 375.0]) - np.array(nodes, float)
    length = np.linalg.norm(bars, axis=1)
    bars /= length[:, None]
    stiffness = (bars.T * (x / length)) @ bars
    u = np.linalg.solve(stiffness, [40e3, 20e3, 200e3])
    stress = bars @ u / length
    slope = -(bars / length[:, None]) @ np.linalg.solve(stiffness, bars.T) * stress
    weight = 7.8e-6 * length
    return weight @ x, weight, np.concatenate([stress, -stress]) / 100 - 1, np.concatenate([slope, -slope]) / 100


def nonconvex(n):
    i, j = np.meshgrid(np.arange(1, n + 1), np.arange(1, n + 1), indexing="ij")
    alpha = (i + j - 2) / (2 * n - 2)
    near = (1 + abs(i - j)) * math.log(n)
    return (2 + np.sin(4 * math.pi * alpha)) / near, (1 + 2 * alpha) / near, (3 - 2 * alpha) / near


S, P, Q = nonconvex(100)


def convex_objective(x):
    g = [50 - x @ P @ x, 50 - x @ Q @ x]
    return x @ S @ x, 2 * S @ x, np.array(g), -2 * np.array([P @ x, Q @ x])


def concave_objective(x):
    f, df, g, dg = convex_objective(x)
    return -f, -df, -g, -dg


PROBLEMS = [
    Problem("cantilever", cantilever, [[5.0] * 5, [2.0] * 5], 1, 10),
    Problem("two_bars", two_bars, [[1.5, 0.5], [0.5, 0.5]], [0.2, 0.1], [4, 1.6]),
    Problem("two_balls", two_balls, [[4.0, 3, 2], [0.0, 0, 0]], 0, 5),
    Problem("eight_bars", eight_bars, [[400.0] * 8], 100, 2000),
    Problem("convex_objective", convex_objective, [[0.5] * 100, [0.1] * 100], -1, 1),
    Problem("concave_objective", concave_objective, [[0.25] * 100, [0.9] * 100], -1, 1),
]


def with_nlopt(problem, start, algorithm, evaluations):
    n, m = len(start), len(problem.functions(np.array(start))[2])

    def objective(x, gradient):
        f, df, _, _ = problem.functions(x)
        if gradient.size:
            gradient[:] = df
        return f

    def constraints(result, x, gradient):
        _, _, g, dg = problem.functions(x)
        result[:] = g
        if gradient.size:
            gradient[:] = dg

    opt = nlopt.opt(algorithm, n)
    opt.set_lower_bounds(problem.bounds[0])
    opt.set_upper_bounds(problem.bounds[1])
    opt.set_min_objective(objective)
    opt.add_inequality_mconstraint(constraints, [1e-10] * m)
    opt.set_xtol_rel(1e-12)
    opt.set_maxeval(evaluations)
    x = opt.optimize(np.array(start))
    name = {nlopt.LD_MMA: "nlopt_mma", nlopt.LD_SLSQP: "nlopt_slsqp"}[algorithm]
    return (name, opt.get_numevals(), 0, problem.functions(x), x)


class Shared:
    """What both methods of mmapy are given: columns, penalties c = 1000, d = 1."""

    def __init__(self, problem, start):
        self.lower, self.upper = (bound[:, None] for bound in problem.bounds)
        self.x = [np.array(start)[:, None]] * 3
        self.n, self.m = len(start), len(problem.functions(np.array(start))[2])
        self.low, self.upp = np.zeros((self.n, 1)), np.zeros((self.n, 1))
        ones = np.ones((self.m, 1))
        self.elastic = (1.0, 0 * ones, 1000 * ones, ones)

    def move_on(self, x):
        self.x = [x, self.x[0], self.x[1]]


def columns(problem, x):
    f, df, g, dg = problem.functions(x[:, 0])
    return np.array([[f]]), df[:, None], g[:, None], dg


def with_mma(problem, start):
    s = Shared(problem, start)
    rows = [("mma", 0, 0, problem.functions(s.x[0][:, 0]), s.x[0][:, 0])]
    for iteration in range(1, ITERATIONS + 1):
        f, df, g, dg = columns(problem, s.x[0])
        result = mmapy.mmasub(
            s.m, s.n, iteration, s.x[0], s.lower, s.upper, s.x[1], s.x[2], f, df, g, dg, s.low, s.upp, *s.elastic
        )
        s.move_on(result[0])
        s.low, s.upp = result[-2:]
        rows.append(("mma", iteration, 0, problem.functions(s.x[0][:, 0]), s.x[0][:, 0]))
    return rows


def with_gcmma(problem, start):
    s = Shared(problem, start)
    tolerance, raa0, raa, least = 1e-7, 0.01, 0.01 * np.ones((s.m, 1)), 1e-6
    rows = [("gcmma", 0, 0, problem.functions(s.x[0][:, 0]), s.x[0][:, 0])]
    for iteration in range(1, ITERATIONS + 1):
        f, df, g, dg = columns(problem, s.x[0])
        s.low, s.upp, raa0, raa = mmapy.asymp(
            iteration, s.n, *s.x, s.lower, s.upper, s.low, s.upp, raa0, raa, least, least * np.ones((s.m, 1)), df, dg
        )
        for inner in range(100):
            result = mmapy.gcmmasub(
                s.m, s.n, iteration, tolerance, s.x[0], s.lower, s.upper, s.low, s.upp, raa0, raa, f, df, g, dg, *s.elastic
            )
            x, f_approximated, g_approximated = result[0], result[-2], result[-1]
            f_found, _, g_found, _ = columns(problem, x)
            if mmapy.concheck(s.m, tolerance, f_approximated, f_found, g_approximated, g_found):
                break
            raa0, raa = mmapy.raaupdate(
                x, s.x[0], s.lower, s.upper, s.low, s.upp, f_found, g_found, f_approximated, g_approximated,
                raa0, raa, least, least * np.ones((s.m, 1)), tolerance,
            )
        s.move_on(x)
        rows.append(("gcmma", iteration, inner, problem.functions(x[:, 0]), x[:, 0]))
    return rows


def main(path):
    with open(path, "w", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(["problem", "start", "program", "iteration", "inner_iterations", "objective", "violation", "x"])
        for problem in PROBLEMS:
            for number, start in enumerate(problem.starts):
                rows = with_mma(problem, start) + with_gcmma(problem, start)
                if number == 0:
                    rows.append(with_nlopt(problem, start, nlopt.LD_MMA, 3000))
                    rows.append(with_nlopt(problem, start, nlopt.LD_SLSQP, 3000))
                for program, iteration, inner, (f, _, g, _), x in rows:
                    # a few variables suffice to tell iterates apart
                    cells = [f"{float(f):.12g}", f"{max(g.max(), 0):.3g}", " ".join(f"{v:.10g}" for v in x[:8])]
                    table.writerow([problem.name, number, program, iteration, inner, *cells])


if __name__ == "__main__":
    main(sys.argv[1])
