"""Forward analyses: the numbers of the program, bit for bit, as arrays."""

from __future__ import annotations

import csv
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import slipstick as ss
from numpy.typing import NDArray


def program(*words: str) -> None:
    subprocess.run([sys.executable, "-m", "slipstick", *words], check=True, capture_output=True)


def number(cell: str) -> float:
    try:
        return float(cell)
    except ValueError:
        return float("nan")


def columns(file: Path) -> dict[str, NDArray[np.float64]]:
    with open(file, newline="") as lines:
        header, *rows = csv.reader(lines)
    return {name: np.array([number(row[i]) for row in rows]) for i, name in enumerate(header)}


def test_results_are_those_of_the_program(case: ss.Case, tmp_path: Path) -> None:
    file = tmp_path / "case.toml"
    case.save(file)
    program("solve", str(file), "--out", str(tmp_path / "solve"))
    program("gradient", str(file), "--out", str(tmp_path / "gradient"))
    problem = ss.Case.load(file).build()
    path = problem.solve()
    written = columns(tmp_path / "solve" / "quantities.csv")
    assert set(path.quantities) <= set(written)
    for name, values in path.quantities.items():
        # the table also has the state at rest
        assert np.array_equal(values, written[name][1:]), name
    value, gradient = problem.value_and_gradient()
    assert value == path.objective
    table = columns(tmp_path / "gradient" / "gradient.csv")
    assert np.array_equal(gradient, table["derivative"])


def test_shapes_and_meaning_of_a_path(problem: ss.Problem) -> None:
    path = problem.solve()
    mesh = problem.mesh
    assert [step.number for step in path.steps] == [1, 2, 3, 4]
    assert np.allclose([step.time for step in path.steps], problem.times)
    last = path.steps[-1]
    assert last.displacement.shape == (42, 3) and last.displacement.dtype == np.float64
    assert np.allclose(last.displacement[mesh.sets["block_ymax"]], [0.15, -0.08, 0.04])
    assert not last.displacement[mesh.sets["slab_ymin"]].any()
    contact = last.contact
    assert sorted(contact.node) == sorted(mesh.sets["block_ymin"])
    assert contact.traction.shape == (6, 3) and contact.slip.shape == (6, 2)
    assert set(np.unique(contact.status)) <= {0, 1, 2} and contact.status.dtype == np.uint8
    closed = contact.status > 0
    assert (contact.pressure[closed] > 0).all() and np.allclose(contact.gap[closed], 0, atol=1e-9)
    # the forces on the slave nodes are in equilibrium with the support of the block
    reaction = [path.quantities[f"reaction_block_ymax_{axis}"][-1] for axis in "xyz"]
    assert np.allclose(contact.force.sum(axis=0), -np.array(reaction), rtol=1e-8)
    assert np.isclose(path.quantities["grip"][-1], contact.force[:, 1].sum(), rtol=0.05)


def test_the_mesh_as_arrays(problem: ss.Problem) -> None:
    mesh = problem.mesh
    assert mesh.nodes.shape == (42, 3) and mesh.hexahedra.shape == (10, 8)
    assert mesh.tetrahedra.shape == (0, 4) and mesh.wedges.shape == (0, 6)
    assert np.array_equal(mesh.hexahedron_numbers, np.arange(10))
    assert mesh.bodies["block"].elements == slice(8, 10)
    # by hand
    assert np.isclose(mesh.volumes[mesh.bodies["slab"].elements].sum(), 4.0 * 1.0 * 1.3)
    assert np.array_equal(np.unique(mesh.surfaces["slab_ymax"]), mesh.sets["slab_ymax"])
    assert np.array_equal(problem.designed, np.arange(8))
    assert np.array_equal(problem.initial_density, [0.5] * 8 + [1.0] * 2)


def test_tables(problem: ss.Problem) -> None:
    pandas = pytest.importorskip("pandas")
    path = problem.solve()
    table = path.to_dataframe()
    assert isinstance(table, pandas.DataFrame) and table.index.name == "step"
    assert list(table.index) == [1, 2, 3, 4] and np.array_equal(
        table["grip"], path.quantities["grip"]
    )
    assert path.units["grip"] == "F" and path.units["work"] == "F L"


def test_load_cases_are_named() -> None:
    case = ss.Case.from_text(
        ss.Case.template("cube-on-cuboid").text
        + '\n[[load_case]]\nname = "dragged"\n[[load_case]]\nname = "pushed"\nweight = 0.5\n'
    )
    problem = case.build()
    assert problem.load_cases == ["dragged", "pushed"] and problem.steps == 20
    path = problem.solve()
    assert [step.load_case for step in path.steps] == ["dragged"] * 10 + ["pushed"] * 10
    assert path.steps[10].time == pytest.approx(0.1)
    # both cases have the same motions
    force = path.quantities["cube_ymin_normal_force"]
    assert np.allclose(force[:10], force[10:], rtol=1e-9)


def test_results_do_not_depend_on_earlier_calls(
    problem: ss.Problem, density: NDArray[np.float64]
) -> None:
    first = problem.solve()
    problem.value_and_gradient(density)
    problem.vjp(density, ["grip"])[1](np.ones((1, 4)))
    again = problem.solve()
    assert np.array_equal(first.steps[-1].displacement, again.steps[-1].displacement)
    # a path stays what it was when others follow
    assert np.array_equal(first.quantities["drag"], again.quantities["drag"])


def test_a_failed_march_says_why(case: ss.Case) -> None:
    far = case.replace({"dirichlet[1].motion[0].u": [0, -3, 0], "load_path.max_cutbacks": 1})
    problem = far.replace({"contact[0].search_radius": 20.0}).build()
    with pytest.raises(ss.AnalysisError) as caught:
        problem.solve()
    assert caught.value.step == 1 and caught.value.cause and caught.value.cures
    assert caught.value.cause in str(caught.value) and isinstance(caught.value, RuntimeError)


def test_open_contact_is_a_warning(case: ss.Case) -> None:
    with pytest.warns(ss.CaseWarning):
        problem = case.replace({"body[1].place": {"translate": [0, 0.5, 0]}}).build()
    with pytest.warns(ss.SlipstickWarning, match="contact never closed"):
        problem.solve()


def test_progress_is_shown(
    problem: ss.Problem, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("tqdm", "tqdm.auto"):
        # as if it were not installed
        monkeypatch.setitem(sys.modules, name, None)
    problem.solve(progress=True)
    shown = capsys.readouterr().err
    assert "\rsolve: step 1 of 4, Newton" in shown
    assert "step 4 of 4, Newton" in shown and shown.endswith("\n")
    problem.solve()
    assert not capsys.readouterr().err


def test_lost_work_is_reported() -> None:
    """The edge of a stiff block drags through a soft strip: averaged normals add a third of the energy."""
    stiff, soft = ({"neo_hooke": {"youngs_modulus": modulus, "poisson_ratio": 0.3}} for modulus in (1000.0, 10.0))
    case = ss.Case.from_dict(
        {
            "body": [
                {"name": "low", "box": {"min": [0, 0, 0], "max": [3, 1, 0.5], "elements": [9, 3, 1]}, "material": soft},
                {
                    "name": "up",
                    "box": {"min": [-0.5, 1, 0], "max": [0.9, 2, 0.5], "elements": [4, 3, 1]},
                    "material": stiff,
                },
            ],
            "contact": [{"slave": "up_ymin", "master": "low_ymax", "friction": 0.0, "normals": "averaged"}],
            "dirichlet": [
                {"set": "low_ymin"},
                {"set": "low_zmin", "components": ["z"]},
                {"set": "low_zmax", "components": ["z"]},
                {"set": "up_ymax", "motion": [{"t": 0.5, "u": [0, -0.3, 0]}, {"t": 1.0, "u": [0.5, -0.3, 0]}]},
            ],
            "load_path": {"steps": 20},
        }
    )
    path = case.build().solve()
    with pytest.warns(ss.SlipstickWarning, match="neither friction nor a gap accounts for"):
        path.quantities
