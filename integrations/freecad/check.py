"""Runs the macro in FreeCAD without windows, on two boxes in contact, and checks what comes back.

    SLIPSTICK=target/release/slipstick QT_QPA_PLATFORM=offscreen LC_ALL=C.UTF-8 freecadcmd integrations/freecad/check.py

Ends with "passed" and exit code 0. Last run with FreeCAD 0.20.2.
"""

import importlib.machinery
import importlib.util
import os
import re
import sys
import tempfile
import traceback

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, HERE)


def load():
    """The macro as a module."""
    loader = importlib.machinery.SourceFileLoader("slipstick_macro", os.path.join(HERE, "Slipstick.FCMacro"))
    spec = importlib.util.spec_from_loader(loader.name, loader)
    module = importlib.util.module_from_spec(spec)
    loader.exec_module(module)
    return module


def close(found, expected, tolerance, what):
    assert abs(found - expected) <= tolerance * abs(expected), f"{what}: {found} instead of {expected}"


def check():
    import FreeCAD
    import Mesh
    import two_boxes

    macro = load()
    document, analysis = two_boxes.make()
    with tempfile.TemporaryDirectory() as folder:
        seen = []
        group = macro.run(
            document, analysis, folder, volume_fraction=0.6, iterations=8, on_event=lambda event: seen.append(event)
        )
        iterations = [event for event in seen if event["event"] == "iteration"]
        # the macro asked to maximize the contact force: it grows, at the volume that was asked for
        assert len(iterations) >= 8 and iterations[-1]["objective"] < 1.02 * iterations[0]["objective"] < 0
        fraction = iterations[-1]["volume_fraction"]
        assert 0.58 < fraction < 0.6006, fraction
        # the part has that volume, and lies within the block
        (low, size, _) = two_boxes.BLOCK
        part = document.getObject("Slipstick_Part").Shape
        close(part.Volume, fraction * size[0] * size[1] * size[2], 0.03, "volume of the part")
        box = part.BoundBox
        assert part.isValid() and len(part.Solids) == 1
        # the same part as triangles: its volume, and the area of the bottom, which is one plane face of the solid
        triangles = os.path.join(folder, "part.stl")
        macro.call(["export", macro.RUN, "--stl", triangles], folder)
        mesh = Mesh.Mesh(triangles)
        assert mesh.isSolid() and not mesh.hasSelfIntersections()
        close(part.Volume, mesh.Volume, 2e-3, "volume of the solid")
        planes = [of for of in part.Faces if of.Surface.TypeId == "Part::GeomPlane"]
        bottom = [of for of in planes if abs(of.CenterOfMass.y - low[1]) < 1e-6]
        assert len(bottom) == 1, [of.Area for of in bottom]
        flat = [of for of in mesh.Facets if all(abs(point[1] - low[1]) < 1e-4 for point in of.Points)]
        close(bottom[0].Area, sum(of.Area for of in flat), 1e-3, "area of the bottom")
        print(f"volume {part.Volume:.2f}, of the triangles {mesh.Volume:.2f}; bottom {bottom[0].Area:.3f}")
        for axis, (least, most) in enumerate(((box.XMin, box.XMax), (box.YMin, box.YMax), (box.ZMin, box.ZMax))):
            assert low[axis] - 1e-4 <= least and most <= low[axis] + size[axis] + 1e-4
        # displacements at the last step: the top of the stamp has moved as prescribed
        results = [of for of in group.Group if of.isDerivedFrom("Fem::FemResultObject")]
        assert len(results) == 4, [of.Name for of in results]
        top = two_boxes.STAMP[0][1] + two_boxes.STAMP[1][1]
        last = results[-1]
        at = dict(zip(last.NodeNumbers, last.DisplacementVectors))
        moved = [at[n].y for n, x in last.Mesh.FemMesh.Nodes.items() if abs(x.y - top) < 1e-6]
        assert len(moved) == 20
        for y in moved:
            close(y, -0.03, 1e-4, "displacement")
        assert max(last.vonMises) > 1.0
        # all fields: the displacement at the top of the stamp, and the pressure below it
        probe = document.addObject("Fem::FemPostDataAtPointFilter", "Probe")
        document.getObject("Slipstick_Fields").Filter = [probe]
        for field, y, least, most in (
            ("displacement", top - 1e-6, 0.02999, 0.03001),
            ("contact_pressure", two_boxes.BLOCK[1][1] - 1e-6, 1.0, 1e5),
        ):
            probe.FieldName, probe.Center = field, FreeCAD.Vector(10.0, y, 5.0)
            document.recompute()
            assert least < probe.PointData[0] < most, f"{field}: {probe.PointData[0]}"
        document.removeObject(probe.Name)
        # a second run replaces the objects, and keeps the case
        case = os.path.join(folder, macro.CASE)
        with open(case, encoding="utf-8") as file:
            text = file.read()
        with open(case, "w", encoding="utf-8") as file:
            file.write(re.sub("volume_fraction = 0.6", "volume_fraction = 0.7", text))
        count = len(document.Objects)
        macro.run(document, analysis, folder, iterations=2)
        assert len(document.Objects) == count, "objects of the first run are left"
        # errors come back in words
        with open(case, "a", encoding="utf-8") as file:
            file.write("\nnonsense = 1\n")
        try:
            macro.run(document, analysis, folder)
            raise AssertionError("no error")
        except macro.SlipstickError as error:
            assert "nonsense" in str(error) and "slipstick.toml:" in str(error), error
    print(f"FreeCAD {'.'.join(FreeCAD.Version()[:3])}: passed")


try:
    check()
    status = 0
except Exception:
    traceback.print_exc()
    status = 1
sys.stdout.flush()
os._exit(status)
