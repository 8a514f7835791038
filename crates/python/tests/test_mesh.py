"""Meshes from arrays, from meshio, from PyVista and from files."""

from __future__ import annotations

import copy
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import slipstick as ss
from conftest import DRAGGED, MATERIAL

DATA = Path(__file__).parents[2] / "meshio" / "tests" / "data"
CUBE = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)], dtype=float)
HEXAHEDRON = [[0, 1, 3, 2, 4, 5, 7, 6]]
WEDGES = [[0, 1, 2, 4, 5, 6], [1, 3, 2, 5, 7, 6]]
# five tetrahedra that fill the cube
TETRAHEDRA = [[0, 5, 3, 6], [0, 1, 3, 5], [0, 3, 2, 6], [0, 4, 5, 6], [3, 6, 5, 7]]
FLOOR = {"floor": [[0, 1, 3, 2]]}


def with_meshes(*meshes: Any) -> dict[str, Any]:
    """The case of the tests, with these meshes as its bodies."""
    case = copy.deepcopy(DRAGGED)
    for body, mesh in zip(case["body"], meshes, strict=True):
        del body["box"]
        body["mesh"] = mesh
    return case


def test_a_case_with_its_own_mesh_gives_the_same_bits(case: ss.Case, problem: ss.Problem) -> None:
    mesh = problem.mesh
    parts = [{"file": mesh, "part": name} for name in mesh.bodies]
    again = ss.Case.from_dict(with_meshes(*parts)).build()
    np.testing.assert_array_equal(again.mesh.nodes, mesh.nodes)
    np.testing.assert_array_equal(again.mesh.hexahedra, mesh.hexahedra)
    assert list(again.mesh.bodies) == ["slab", "block"]
    np.testing.assert_array_equal(again.mesh.sets["block_ymin"], mesh.sets["block_ymin"])
    ours, theirs = again.solve(), problem.solve()
    for name, values in theirs.quantities.items():
        np.testing.assert_array_equal(ours.quantities[name], values)


def of_second_order(*bodies: dict[str, Any]) -> ss.Problem:
    """The case of the tests with these bodies, of second order."""
    case = copy.deepcopy(DRAGGED)
    case["body"] = [{"material": MATERIAL, "order": 2} | body for body in bodies]
    return ss.Case.from_dict(case).build()


def cube(name: str, low: float) -> dict[str, Any]:
    """A body of linear tetrahedra in a unit cube whose lowest corner is at y = `low`."""
    nodes = CUBE[:, [1, 2, 0]] + [0.0, low, 0.0]
    faces = {"ymin": np.flatnonzero(nodes[:, 1] == low), "ymax": np.flatnonzero(nodes[:, 1] > low)}
    surfaces = {}
    for side, of in faces.items():
        rows = [[n for n in row if n in of] for row in TETRAHEDRA]
        surfaces[side] = [row for row in rows if len(row) == 3]
    return {"name": name, "mesh": ss.Mesh(nodes, tetrahedra=TETRAHEDRA, surfaces=surfaces)}


@pytest.mark.parametrize(("argument", "columns"), [("hexahedra", 27), ("tetrahedra", 10)])
def test_second_order_meshes_give_the_same_results(argument: str, columns: int) -> None:
    """A problem with ``order = 2``, and one whose bodies are the arrays of its mesh."""
    if argument == "hexahedra":
        bodies = DRAGGED["body"]
    else:
        bodies = [cube("slab", 0.0), cube("block", 1.0)]
    first = of_second_order(*bodies)
    mesh = first.mesh
    cells = getattr(mesh, argument)
    assert cells.shape[1] == columns and len(np.unique(cells)) == len(mesh.nodes)
    parts = [{"file": mesh, "part": name} for name in mesh.bodies]
    again = ss.Case.from_dict(with_meshes(*parts)).build()
    np.testing.assert_array_equal(again.mesh.nodes, mesh.nodes)
    np.testing.assert_array_equal(getattr(again.mesh, argument), cells)
    for name in ("block_ymin", "slab_ymax"):
        np.testing.assert_array_equal(again.mesh.sets[name], mesh.sets[name])
    ours, theirs = again.solve(), first.solve()
    assert np.abs(theirs.quantities["reaction_block_ymax_y"]).max() > 0.0
    for name, values in theirs.quantities.items():
        np.testing.assert_allclose(ours.quantities[name], values, rtol=1e-8, atol=1e-8)


def test_volumes_of_curved_elements() -> None:
    shape = {"inner_radius": 1.0, "outer_radius": 2.0, "height": 0.5, "elements": [1, 12, 1]}
    body = {"name": "slab", "hollow_cylinder": shape, "material": MATERIAL, "order": 2}
    case = {
        "body": [body],
        "dirichlet": [{"set": "slab_bottom"}],
        "load_path": {"steps": 1},
    }
    mesh = ss.Case.from_dict(case).build().mesh
    exact = np.pi * (4.0 - 1.0) * 0.5
    assert mesh.volumes.sum() == pytest.approx(exact, rel=2e-4)
    assert ss.Mesh(mesh.nodes, mesh.hexahedra).volumes.sum() == pytest.approx(exact, rel=2e-4)
    # with straight edges, a polygon of 12 sides
    straight = ss.Mesh(mesh.nodes, mesh.hexahedra[:, :8]).volumes.sum()
    assert straight == pytest.approx(6.0 * np.sin(np.pi / 6.0) * 3.0 * 0.5, rel=1e-12)


def test_a_body_has_one_order() -> None:
    mesh = of_second_order(*DRAGGED["body"]).mesh
    cells = mesh.hexahedra.copy()
    cells[0, 8:] = -1
    with pytest.raises(ValueError, match="the mesh has 1 linear and .* second-order elements"):
        ss.Mesh(mesh.nodes, cells)
    # one body of each order
    parts = {"linear": [0], "second": np.arange(1, len(cells))}
    assert ss.Mesh(mesh.nodes, cells, bodies=parts).elements == len(cells)


@pytest.mark.parametrize(
    "elements", [{"hexahedra": HEXAHEDRON}, {"wedges": WEDGES}, {"tetrahedra": TETRAHEDRA}]
)
def test_a_cube_of_each_type(elements: dict[str, Any]) -> None:
    name = next(iter(elements))
    triangles = [[0, 1, 2], [1, 3, 2]] if name == "wedges" else [[0, 1, 3], [0, 3, 2]]
    floor = FLOOR["floor"] if name == "hexahedra" else triangles
    mesh = ss.Mesh(CUBE, **elements, surfaces={"floor": floor}, sets={"corner": [7]})
    assert mesh.elements == len(elements[name]) and mesh.volumes.sum() == pytest.approx(1.0)
    assert mesh.bodies == {}
    case = ss.Case.from_dict(
        {
            "body": [{"name": "cube", "mesh": mesh, "material": MATERIAL}],
            "dirichlet": [
                {"set": "cube_floor"},
                {"set": "cube_corner", "motion": [{"t": 1.0, "u": [0.0, 0.0, -0.01]}]},
            ],
            "load_path": {"steps": 1},
        }
    )
    problem = case.build()
    np.testing.assert_array_equal(getattr(problem.mesh, name), elements[name])
    np.testing.assert_array_equal(problem.mesh.sets["cube_floor"], [0, 1, 2, 3])
    assert problem.solve().quantities["reaction_cube_corner_z"][-1] < 0.0


def test_bodies_of_one_mesh_and_units() -> None:
    nodes = np.concatenate([CUBE, CUBE + [0.0, 0.0, 1.5]])
    cells = np.array(HEXAHEDRON)
    mesh = ss.Mesh(
        nodes, np.concatenate([cells, cells + 8]), bodies={"low": [0], "high": slice(1, 2)}
    )
    assert mesh.bodies["high"] == ss.Body(slice(1, 2), slice(8, 16))
    with pytest.raises(ValueError, match="bodies low, high: choose one"):
        ss.Case.from_dict({"body": [{"name": "a", "mesh": mesh, "material": MATERIAL}]})
    body = {
        "name": "a",
        "mesh": {"file": mesh, "part": "high", "scale": 0.001},
        "material": MATERIAL,
    }
    case = ss.Case.from_dict({"body": [body], "load_path": {"steps": 1}} | HELD)
    np.testing.assert_allclose(case.build().mesh.nodes[:, 2].max(), 0.0025)


EVERYWHERE = {"min": [-99.0, -99.0, -99.0], "max": [99.0, 99.0, 99.0]}
HELD = {"set": [{"name": "all", "boxes": [EVERYWHERE]}], "dirichlet": [{"set": "all"}]}


def test_a_mesh_in_memory_survives(tmp_path: Path) -> None:
    """In pickles, in replaced values, beside a saved case, and in the directory of a run."""
    mesh = ss.Case.from_dict(DRAGGED).build().mesh
    parts = [{"file": mesh, "part": name} for name in mesh.bodies]
    case = ss.Case.from_dict(with_meshes(*parts))
    restored = pickle.loads(pickle.dumps(case))
    value = case.build().solve().objective
    assert restored.build().solve().objective == value
    assert case.replace({"title": "other"}).build().solve().objective == value
    # a mesh can be replaced, too
    longer = ss.Mesh(
        mesh.nodes * [1.1, 1.0, 1.0],
        mesh.hexahedra,
        bodies=mesh.bodies,
        surfaces={"slab_ymin": mesh.surfaces["slab_ymin"], "slab_ymax": mesh.surfaces["slab_ymax"]},
    )
    replaced = case.replace({"body[0].mesh": {"file": longer, "part": "slab"}})
    assert replaced.build().mesh.bodies["slab"] == mesh.bodies["slab"]
    assert replaced.check().bodies[0]["volume"] == pytest.approx(1.1 * 4.0 * 1.3)
    case.save(tmp_path / "saved.toml")
    assert ss.Case.load(tmp_path / "saved.toml").build().solve().objective == value
    result = case.build().optimize(iterations=1, directory=tmp_path / "run")
    assert len(list((tmp_path / "run").glob("mesh_*.inp"))) == 1
    again = ss.resume(tmp_path / "run", iterations=2)
    assert len(again.iterations) == 3 and result.iterations[0].objective == value


@pytest.mark.parametrize(
    ("change", "error", "message"),
    [
        ({"nodes": CUBE[:, :2]}, ValueError, r"nodes has shape \(8, 2\): give \(8, 3\)"),
        ({"nodes": CUBE * np.nan}, ValueError, r"nodes\[0, 0\] is nan"),
        ({"hexahedra": [[0, 1, 2]]}, ValueError, r"hexahedra has shape \(1, 3\): give \(1, 8\)"),
        ({"hexahedra": [[0, 1, 3, 2, 4, 5, 7, 8]]}, ValueError, r"hexahedra\[0, 7\] is 8: there"),
        ({"hexahedra": [[0, 1, 3, 2, 4, 5, 7, 7]]}, ValueError, r"hexahedra\[0\] has a node twice"),
        ({"hexahedra": [[0.5] * 8]}, TypeError, "hexahedra has dtype float64: give whole numbers"),
        ({"hexahedra": None}, ValueError, "there are no elements"),
        ({"bodies": {"a": [1]}}, ValueError, r"bodies\['a'\]\[0\] is 1: there are 1 elements"),
        ({"bodies": {"a": []}}, ValueError, r"bodies\['a'\] is empty"),
        ({"sets": {"a": [True]}}, TypeError, r"np.flatnonzero\(sets\['a'\]\)"),
        ({"sets": {"a": [-1]}}, ValueError, r"sets\['a'\]\[0\] is -1: there are 8 nodes"),
        ({"surfaces": {"a": [[0, 1]]}}, ValueError, r"surfaces\['a'\] has shape \(1, 2\)"),
        ({"surfaces": {"a": [[0, 1, -1, 2]]}}, ValueError, r"surfaces\['a'\]\[0, 2\] is -1"),
        ({"hexahedron_numbers": [1]}, ValueError, r"hexahedron_numbers\[0\] is 1"),
    ],
)
def test_wrong_arrays_are_named(
    change: dict[str, Any], error: type[Exception], message: str
) -> None:
    with pytest.raises(error, match=message):
        ss.Mesh(**({"nodes": CUBE, "hexahedra": HEXAHEDRON} | change))


@pytest.mark.parametrize(
    ("mesh", "message"),
    [
        (
            # a face is pushed through the opposite one
            ss.Mesh(CUBE * [1, 1, 1] + [[0, 0, -3 * (n == 6)] for n in range(8)], HEXAHEDRON),
            "element 0 at .*the hexahedron is folded or flat",
        ),
        (
            ss.Mesh(CUBE, tetrahedra=[[0, 1, 2, 3]]),
            "element 0 at .*the tetrahedron is flat",
        ),
        (
            ss.Mesh(CUBE, tetrahedra=TETRAHEDRA, surfaces={"inside": [[0, 3, 5]]}),
            "surface `inside`, facet at .*the facet",
        ),
    ],
)
def test_wrong_elements_are_errors_of_the_case(mesh: ss.Mesh, message: str) -> None:
    with pytest.raises(ss.CaseError, match=message) as caught:
        ss.Case.from_dict(
            {
                "body": [{"name": "cube", "mesh": mesh, "material": MATERIAL}],
                # a surface that no case uses is no error
                "dirichlet": [{"set": "cube_inside"}],
                "load_path": {},
            }
        )
    assert any(d.code.endswith("mesh_file") for d in caught.value.diagnostics)


def test_names_that_a_mesh_cannot_have() -> None:
    mesh = ss.Mesh(CUBE, HEXAHEDRON, sets={"a,b": [0]})
    body = {"name": "cube", "mesh": mesh, "material": MATERIAL}
    with pytest.raises(ValueError, match="sets has the name 'a,b'"):
        ss.Case.from_dict({"body": [body]})


def test_inside_out_elements_are_turned_with_a_warning() -> None:
    turned = [[0, 2, 3, 1, 4, 6, 7, 5]]
    mesh = ss.Mesh(CUBE, turned, surfaces=FLOOR)
    body = {"name": "cube", "mesh": mesh, "material": MATERIAL}
    case = ss.Case.from_dict(
        {"body": [body], "dirichlet": [{"set": "cube_floor"}], "load_path": {"steps": 1}}
    )
    with pytest.warns(ss.CaseWarning, match="numbered inside out"):
        assert case.build().mesh.volumes.sum() == pytest.approx(1.0)


@pytest.mark.skipif(not DATA.exists(), reason="the mesh files are only in the repository")
@pytest.mark.parametrize("name", ["gmsh_41_ascii.msh", "gmsh_22_ascii.msh"])
def test_files(name: str) -> None:
    mesh = ss.Mesh.read(DATA / name)
    assert set(mesh.bodies) >= {"block", "slab"}
    by_file = {"file": str(DATA / name), "part": "slab"}
    body = {"name": "slab", "material": MATERIAL}
    cases = [
        ss.Case.from_dict({"body": [{**body, "mesh": table}], "load_path": {"steps": 1}} | HELD)
        for table in (by_file, {"file": mesh, "part": "slab"})
    ]
    ours, theirs = cases[1].build().mesh, cases[0].build().mesh
    np.testing.assert_array_equal(ours.nodes, theirs.nodes)
    np.testing.assert_array_equal(ours.hexahedra, theirs.hexahedra)
    assert ours.surfaces.keys() == theirs.surfaces.keys()
    for surface, facets in theirs.surfaces.items():
        assert {frozenset(row) for row in ours.surfaces[surface].tolist()} == {
            frozenset(row) for row in facets.tolist()
        }
    assert ours.sets.keys() == theirs.sets.keys()


def test_files_that_are_no_meshes(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        ss.Mesh.read(tmp_path / "none.msh")
    (tmp_path / "no.msh").write_text("hello")
    with pytest.raises(ss.InputError, match="unknown mesh format"):
        ss.Mesh.read(tmp_path / "no.msh")


@pytest.mark.skipif(not DATA.exists(), reason="needs the repository")
def test_wedges_of_15_and_18_nodes() -> None:
    # the same mesh of Gmsh: wedges of 18 nodes, and of 15, which are completed
    name = "gmsh_wedges_second_order"
    whole, lacking = (ss.Mesh.read(DATA / f"{name}.{end}") for end in ("msh", "inp"))
    for mesh in (whole, lacking):
        assert mesh.wedges.shape == (16, 18)
        corners = mesh.nodes[mesh.wedges[:, [0, 1, 4, 3]]].mean(axis=1)
        np.testing.assert_allclose(mesh.nodes[mesh.wedges[:, 15]], corners, atol=1e-9)
    assert len(whole.nodes) == len(lacking.nodes)
    np.testing.assert_allclose(np.sort(whole.volumes), np.sort(lacking.volumes), rtol=1e-9)
    body = {"name": "block", "material": MATERIAL, "mesh": {"file": whole, "part": "block"}}
    held = {"dirichlet": [{"set": "block_bottom"}], "load_path": {"steps": 1}}
    built = ss.Case.from_dict({"body": [body]} | held).build().mesh
    assert built.wedges.shape == (16, 18)
    np.testing.assert_allclose(np.sort(built.volumes), np.sort(whole.volumes), rtol=1e-12)


def same(a: ss.Mesh, b: ss.Mesh) -> None:
    for name in ("nodes", "hexahedra", "wedges", "tetrahedra"):
        np.testing.assert_array_equal(getattr(a, name), getattr(b, name))


MIXED = ss.Mesh(
    np.concatenate([CUBE, CUBE + [2, 0, 0], CUBE + [4, 0, 0]]),
    HEXAHEDRON,
    np.array(WEDGES) + 8,
    np.array(TETRAHEDRA) + 16,
    bodies={"a": [0], "b": [1, 2], "c": [3, 4, 5, 6, 7]},
    sets={"some": [0, 9]},
)


def test_meshio(tmp_path: Path) -> None:
    meshio = pytest.importorskip("meshio", reason="meshio is not installed")
    theirs = MIXED.to_meshio({"density": np.arange(8.0)})
    assert [block.type for block in theirs.cells] == ["hexahedron", "wedge", "tetra"]
    np.testing.assert_array_equal(theirs.cell_data["density"][1], [1.0, 2.0])
    same(ss.Mesh.from_meshio(theirs), MIXED)
    np.testing.assert_array_equal(ss.Mesh.from_meshio(theirs).sets["some"], [0, 9])
    # through a file that this reader and meshio's agree on
    theirs.write(tmp_path / "mixed.vtu")
    np.testing.assert_allclose(ss.Mesh.read(tmp_path / "mixed.vtu").volumes.sum(), 3.0)
    if DATA.exists():
        same(
            ss.Mesh.from_meshio(meshio.read(DATA / "gmsh_41_ascii.msh")),
            ss.Mesh.read(DATA / "gmsh_41_ascii.msh"),
        )
        ours = ss.Mesh.from_meshio(meshio.read(DATA / "gmsh_41_ascii.msh"))
        assert {"block", "slab"} <= ours.bodies.keys() and ours.surfaces
    with pytest.raises(ValueError, match="1 cells of type pyramid, which are not supported"):
        ss.Mesh.from_meshio(meshio.Mesh(CUBE, [("pyramid", [[0, 1, 3, 2, 4]])]))
    with pytest.raises(ValueError, match="mesh has no hexahedra, wedges or tetrahedra"):
        ss.Mesh.from_meshio(meshio.Mesh(CUBE, [("triangle", [[0, 1, 3]])]))


def test_meshio_and_second_order(tmp_path: Path) -> None:
    pytest.importorskip("meshio", reason="meshio is not installed")
    mesh = of_second_order(*DRAGGED["body"]).mesh
    theirs = mesh.to_meshio()
    assert [block.type for block in theirs.cells] == ["hexahedron27"]
    back = ss.Mesh.from_meshio(theirs)
    same(back, mesh)
    linear = ss.Mesh.from_meshio(theirs, first_order=True)
    np.testing.assert_allclose(linear.volumes, mesh.volumes, rtol=1e-14)
    assert linear.hexahedra.shape[1] == 8
    theirs.write(tmp_path / "second.vtu")
    np.testing.assert_allclose(ss.Mesh.read(tmp_path / "second.vtu").volumes, mesh.volumes)


def test_pyvista() -> None:
    pyvista = pytest.importorskip("pyvista", reason="PyVista is not installed")
    grid = MIXED.to_pyvista({"body": [0, 1, 1, 2, 2, 2, 2, 2]}, {"x": MIXED.nodes[:, 0]})
    # VTK's own volumes, which are negative for elements that are numbered inside out
    sizes = grid.compute_cell_sizes(length=False, area=False)["Volume"]
    np.testing.assert_allclose(sizes, MIXED.volumes, rtol=1e-12)
    back = ss.Mesh.from_pyvista(grid, bodies="body", sets={"s": [3]}, surfaces=FLOOR)
    same(back, MIXED)
    assert list(back.bodies) == ["0", "1", "2"]
    np.testing.assert_array_equal(back.surfaces["floor"], [[0, 1, 3, 2]])
    voxels = pyvista.ImageData(dimensions=(3, 2, 2)).cast_to_unstructured_grid()
    mesh = ss.Mesh.from_pyvista(voxels)
    np.testing.assert_allclose(mesh.volumes, [1.0, 1.0])
    moved = MIXED.to_pyvista(displacement=np.ones_like(MIXED.nodes))
    np.testing.assert_allclose(moved.points, MIXED.nodes + 1.0)
    with pytest.raises(ValueError, match="bodies is 'part', but the cell arrays are: body"):
        ss.Mesh.from_pyvista(grid, bodies="part")
    with pytest.raises(TypeError, match="cast_to_unstructured_grid"):
        ss.Mesh.from_pyvista(pyvista.Sphere())


def test_xarray(problem: ss.Problem) -> None:
    pytest.importorskip("xarray", reason="xarray is not installed")
    path = problem.solve()
    data = path.to_xarray()
    assert data.displacement.dims == ("step", "node", "component")
    np.testing.assert_array_equal(
        data.displacement.sel(step=2, component="y"), path.steps[1].displacement[:, 1]
    )
    np.testing.assert_array_equal(data["drag"], path.quantities["drag"])
    np.testing.assert_array_equal(data.time, problem.times)


def test_coordinates_of_other_libraries() -> None:
    pandas = pytest.importorskip("pandas")
    mesh = ss.Mesh(pandas.DataFrame(CUBE, columns=["x", "y", "z"]), HEXAHEDRON)
    np.testing.assert_array_equal(mesh.nodes, CUBE)
    with pytest.raises(ValueError, match=r"nodes has shape \(\): give \(n, 3\), three coordinates"):
        ss.Mesh(np.array(1.0), HEXAHEDRON)
    with pytest.raises(ValueError, match=r"hexahedra has shape \(\): give \(n, 8\)"):
        ss.Mesh(CUBE, np.array(1))


def test_empty_sets(tmp_path: Path) -> None:
    for empty in (slice(0, 0), []):
        with pytest.raises(ValueError, match=r"bodies\['none'\] is empty: give the numbers"):
            ss.Mesh(CUBE, HEXAHEDRON, bodies={"none": empty})
    text = ss.Mesh(CUBE, HEXAHEDRON, bodies={"cube": [0]})._as_file()[1].decode()
    (tmp_path / "mesh.inp").write_text(f"{text}*ELSET, ELSET=nothing\n")
    mesh = ss.Mesh.read(tmp_path / "mesh.inp")
    assert list(mesh.bodies) == ["cube"] and mesh.sets == {}
