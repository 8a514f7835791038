"""A document of FreeCAD with two boxes in contact: a steel stamp is pressed onto a block of aluminium.

The mesh is made of hexahedra here, so that the test needs no mesh generator.
"""

import FreeCAD
import Fem
import ObjectsFem

GAP = 0.001  # mm; FreeCAD finds nodes of faces by their position, so faces in contact must not coincide
BLOCK = ((0.0, 0.0, 0.0), (20.0, 6.0, 10.0), (10, 4, 5))
STAMP = ((6.0, 6.0 + GAP, 2.0), (8.0, 4.0, 6.0), (4, 2, 3))


def grid(mesh, corner, size, counts, first):
    """Adds hexahedra with nodes from number `first` on; returns the next number."""
    nx, ny, nz = (count + 1 for count in counts)
    for n in range(nx * ny * nz):
        at = (n % nx, n // nx % ny, n // (nx * ny))
        mesh.addNode(*(corner[c] + size[c] * at[c] / counts[c] for c in range(3)), first + n)
    number = lambda i, j, k: first + i + nx * (j + ny * k)
    for k in range(counts[2]):
        for j in range(counts[1]):
            for i in range(counts[0]):
                corners = ((i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1))
                mesh.addVolume([number(a, b, z) for z in (k, k + 1) for a, b in corners])
    return first + nx * ny * nz


def material(document, name, modulus, shape):
    of = ObjectsFem.makeMaterialSolid(document, name)
    of.Material = {"Name": name, "YoungsModulus": f"{modulus} MPa", "PoissonRatio": "0.30", "Density": "7900 kg/m^3"}
    of.References = [(shape, "Solid1")]
    return of


def face(box, normal):
    """The name of the face with this outward normal."""
    for index, of in enumerate(box.Shape.Faces, 1):
        if (of.normalAt(0, 0) - FreeCAD.Vector(*normal)).Length < 1e-6:
            return f"Face{index}"
    raise ValueError("no such face")


def make(name="two_boxes"):
    """The document, with an analysis that CalculiX can run."""
    document = FreeCAD.newDocument(name)
    boxes = []
    for label, (corner, size, _) in (("Block", BLOCK), ("Stamp", STAMP)):
        box = document.addObject("Part::Box", label)
        box.Length, box.Width, box.Height = size
        box.Placement.Base = FreeCAD.Vector(*corner)
        boxes.append(box)
    both = document.addObject("Part::Compound", "Both")
    both.Links = boxes
    document.recompute()

    analysis = ObjectsFem.makeAnalysis(document, "Analysis")
    solver = ObjectsFem.makeSolverCalculixCcxTools(document, "Solver")
    solver.GeometricalNonlinearity = "nonlinear"
    solver.IterationsUserDefinedIncrementations = True
    solver.TimeInitialStep, solver.TimeEnd = 0.25, 1.0
    block, stamp = boxes
    fixed = ObjectsFem.makeConstraintFixed(document, "Held")
    fixed.References = [(block, face(block, (0, -1, 0)))]
    pressed = ObjectsFem.makeConstraintDisplacement(document, "Pressed")
    pressed.References = [(stamp, face(stamp, (0, 1, 0)))]
    pressed.xFix = pressed.zFix = True
    pressed.yFree, pressed.yDisplacement = False, -0.03
    contact = ObjectsFem.makeConstraintContact(document, "Contact")
    contact.References = [(block, face(block, (0, 1, 0))), (stamp, face(stamp, (0, -1, 0)))]
    contact.Slope = 1e6  # MPa/mm
    contact.Friction = 0.2
    mesh = Fem.FemMesh()
    grid(mesh, *STAMP, grid(mesh, *BLOCK, 1))
    of_mesh = document.addObject("Fem::FemMeshObject", "Mesh")
    of_mesh.FemMesh = mesh
    if hasattr(of_mesh, "Part"):
        of_mesh.Part = both
    for member in (
        solver, fixed, pressed, contact, of_mesh,
        material(document, "Aluminium", 70000, block), material(document, "Steel", 210000, stamp),
    ):
        analysis.addObject(member)
    document.recompute()
    return document, analysis
