"""Solves the problem with GetFEM: `with_getfem.py CASE MESH REFINEMENT`.

Augmented Lagrangian contact by ray tracing from the slave surface ("integral large sliding contact"),
generalized Newton iterations with full steps, MUMPS. The law of the solid is slipstick's:
P = 2c (F - J^(-2 beta) F^(-T)), c = E/4/(1 + nu), beta = nu/(1 - 2 nu).
"""

import json
import subprocess
import sys

import numpy as np

METHOD = "ray tracing, augmented Lagrangian"

# Points of a contact facet are the zeros of polynomials of this degree in each direction.
CONTACT_DEGREE = 5
SOLID_DEGREE = 3
# Largest distance at which a ray finds the other surface.
SEARCH_DISTANCE = 0.8
RESIDUAL = 1e-8
ITERATIONS = 40
# Times that a load step may be halved.
HALVINGS = 8


def version():
    shown = subprocess.run(["dpkg-query", "-W", "-f", "${Version}", "python3-getfem"], capture_output=True, text=True)
    return shown.stdout.split("+")[0]


def command(problem, case, folder):
    """Command line that solves the case in a folder."""
    return [sys.executable, __file__, str(case), str(problem.mesh), str(problem.refinement)]


def outcome(problem, folder):
    """Forces and counts from what the command printed. Iterations of failed attempts count."""
    events = [json.loads(line) for line in (folder / "output").read_text().splitlines() if line.startswith("{")]
    forces = [{"time": event["time"], "reaction": event["reaction"]} for event in events if "reaction" in event]
    return {"forces": forces, "newton": sum(event["newton"] for event in events)}


class Body:
    """A deformable body: its mesh with the surfaces that the problem uses, finite elements, integration."""

    def __init__(self, getfem, problem, number):
        self.number = number
        elements = problem.elements[problem.body == number]
        self.mesh = getfem.Mesh("empty", 3)
        shape = getfem.GeoTrans("GT_QK(3,1)")
        # GetFEM numbers the corners like voxels, x first.
        for corners in elements[:, [0, 1, 3, 2, 4, 5, 7, 6]]:
            self.mesh.add_convex(shape, problem.points[corners].T)
        outer = set(map(tuple, self.mesh.outer_faces().T))
        self.regions = {}
        for surface in [problem.slave, problem.master, problem.held, problem.driven]:
            if problem.body_of(surface) != number:
                continue
            points = self.mesh.pid_from_coords(problem.points[problem.nodes(surface)].T, 1e-9)
            faces = [face for face in self.mesh.faces_from_pid(points).T if tuple(face) in outer]
            assert len(faces) == len(problem.facets(surface)[0]), surface
            self.regions[surface] = len(self.regions) + 1
            self.mesh.set_region(self.regions[surface], np.array(faces).T)
        self.fem = self.elements(getfem)
        self.solid = getfem.MeshIm(self.mesh, getfem.Integ(f"IM_GAUSS_PARALLELEPIPED(3,{SOLID_DEGREE})"))
        self.contact = getfem.MeshIm(self.mesh, getfem.Integ(f"IM_GAUSS_PARALLELEPIPED(3,{CONTACT_DEGREE})"))
        youngs_modulus, poisson_ratio = problem.materials[number]
        gradient = f"(Id(3)+Grad_u{number})"
        power = -2 * poisson_ratio / (1 - 2 * poisson_ratio)
        modulus = youngs_modulus / 2 / (1 + poisson_ratio)
        self.work = (
            f"({modulus:.16g}*({gradient}-pow(Det({gradient}),{power:.16g})*(Inv({gradient}))')):Grad_Test_u{number}"
        )

    def elements(self, getfem):
        fem = getfem.MeshFem(self.mesh, 3)
        fem.set_fem(getfem.Fem("FEM_QK(3,1)"))
        return fem


def solve(case, mesh, refinement):
    """Marches over the load steps; prints reaction and iterations of each attempt as a line of JSON."""
    import getfem

    from problem import Problem

    getfem.util_trace_level(0)
    problem = Problem(case, mesh, int(refinement))
    bodies = [Body(getfem, problem, number) for number in range(2)]
    slave, master = (bodies[problem.body_of(surface)] for surface in (problem.slave, problem.master))
    held, driven = (bodies[problem.body_of(surface)] for surface in (problem.held, problem.driven))
    model = getfem.Model("real")
    for body in bodies:
        model.add_fem_variable(f"u{body.number}", body.fem)
        model.add_fem_data(f"previous{body.number}", body.fem)
    model.add_filtered_fem_variable("multiplier", slave.elements(getfem), slave.regions[problem.slave])
    for body in bodies:
        model.add_nonlinear_term(body.solid, body.work)
    for name, body, surface in [("rest", held, problem.held), ("motion", driven, problem.driven)]:
        model.add_initialized_data(name, [0.0] * 3)
        model.add_Dirichlet_condition_with_simplification(f"u{body.number}", body.regions[surface], name)
    model.add_initialized_data("augmentation", [min(youngs_modulus for youngs_modulus, _ in problem.materials)])
    model.add_initialized_data("alpha", [1.0])
    model.add_initialized_data("friction", [problem.friction])
    contact = model.add_integral_large_sliding_contact_brick_raytracing(
        "augmentation", SEARCH_DISTANCE, "friction", "alpha", 0
    )
    model.add_slave_contact_boundary_to_large_sliding_contact_brick(
        contact, slave.contact, slave.regions[problem.slave], f"u{slave.number}", "multiplier", f"previous{slave.number}"
    )
    model.add_master_contact_boundary_to_large_sliding_contact_brick(
        contact, master.contact, master.regions[problem.master], f"u{master.number}", f"previous{master.number}"
    )
    march(getfem, problem, model, bodies, driven)


def march(getfem, problem, model, bodies, driven):
    """Load steps, halved where Newton's method does not converge."""
    dofs = driven.fem.basic_dof_on_region(driven.regions[problem.driven])
    # Time in units of the smallest sub-step.
    whole = 2**HALVINGS
    now, size = 0, whole
    while now < problem.steps * whole:
        then = now + size
        before = model.from_variables()
        model.set_variable("motion", problem.displacement(then / whole / problem.steps))
        for body in bodies:
            model.set_variable(f"previous{body.number}", model.variable(f"u{body.number}"))
        try:
            iterations, converged = attempt(model)
        except RuntimeError as error:
            print(error, file=sys.stderr)
            iterations, converged = ITERATIONS, False
        event = {"time": then / whole / problem.steps, "newton": iterations}
        if converged:
            name = f"u{driven.number}"
            force = getfem.asm_generic(
                driven.solid, 1, driven.work, -1, name, 1, driven.fem, model.variable(name)
            )
            event["reaction"] = [float(force[dofs[dofs % 3 == axis]].sum()) for axis in range(3)]
            now = then
            if now % whole == 0:
                size = whole
        else:
            model.to_variables(before)
            size //= 2
        print(json.dumps(event), flush=True)
        if size == 0:
            sys.exit("Newton's method does not converge for the smallest step")


def attempt(model):
    """Newton's method with full steps: iterations, and whether it converged."""
    full_steps = ["lsearch", "simplest", "alpha max ratio", 1e6, "alpha min", 1.0]
    solved = model.solve("max_res", RESIDUAL, "max_iter", ITERATIONS, *full_steps)
    iterations = int(solved[0]) if isinstance(solved, (list, tuple)) else int(solved)
    return iterations, iterations < ITERATIONS


if __name__ == "__main__":
    solve(*sys.argv[1:])
