"""Cases: where they come from, and how their errors are told."""

from __future__ import annotations

import copy
import pickle
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import slipstick as ss
from conftest import DRAGGED


def test_file_text_and_dict_are_the_same_case(tmp_path: Path) -> None:
    case = ss.Case.from_dict(DRAGGED)
    file = tmp_path / "case.toml"
    case.save(file)
    assert ss.Case.load(file).resolved == case.resolved == ss.Case.from_text(case.text).resolved
    with pytest.raises(FileExistsError):
        case.save(file)


def test_numpy_values_and_paths_are_values(tmp_path: Path) -> None:
    changed = copy.deepcopy(DRAGGED)
    changed["body"][0]["box"]["max"] = np.array([4.0, 1.0, 1.3])
    changed["body"][0]["box"]["elements"] = np.array([4, 1, 2])
    changed["contact"][0]["friction"] = np.float64(0.3)
    changed["load_path"]["steps"] = np.int32(4)
    assert ss.Case.from_dict(changed).resolved == ss.Case.from_dict(DRAGGED).resolved


@pytest.mark.parametrize(
    "title",
    ["plain", 'with "quotes" and \\', "two\nlines\tand\x01", "ψ and 😀", "\x7f", "", "# a = [1]"],
)
def test_any_string_survives(title: str) -> None:
    assert ss.Case.from_dict({**DRAGGED, "title": title}).resolved["title"] == title


def test_values_without_a_counterpart_are_refused() -> None:
    with pytest.raises(TypeError, match=r"`load_path.steps` is None: leave the key out"):
        ss.Case.from_dict({**DRAGGED, "load_path": {"steps": None}})
    with pytest.raises(TypeError, match=r"`title` is of type object"):
        ss.Case.from_dict({**DRAGGED, "title": object()})
    with pytest.raises(TypeError, match="keys are strings"):
        ss.Case.from_dict({1: 2})  # type: ignore[dict-item]
    with pytest.raises(TypeError, match="give a dict"):
        ss.Case.from_dict([1])  # type: ignore[arg-type]


def test_templates_are_valid() -> None:
    assert {"half-ball", "clutch"} <= set(ss.templates())
    for name in ss.templates():
        assert ss.Case.template(name).resolved["body"]
    with pytest.raises(ss.InputError, match="templates: half-ball") as caught:
        ss.Case.template("half-bal")
    assert caught.value.help.startswith("templates:")


def test_replace_changes_only_what_is_named(case: ss.Case) -> None:
    other = case.replace({"contact[0].friction": 0.1, "load_path.steps": 7})
    assert other.resolved["contact"][0]["friction"] == 0.1
    assert other.resolved["load_path"]["steps"] == 7
    assert case.resolved["contact"][0]["friction"] == 0.3
    assert other.name == "dragged.toml (with replaced values)"
    assert other.replace({"title": "again"}).name == other.name
    with pytest.raises(ss.InputError, match=r"contact has 1 entry") as caught:
        case.replace({"contact[2].friction": 0.1})
    assert "docs/case_file.md" in caught.value.help
    with pytest.raises(ss.CaseError, match="friction"):
        case.replace({"contact[0].friction": -1})
    with pytest.raises(ss.InputError):
        case.replace({"no key at all!": 1})


def test_errors_are_the_programs_message_and_data(tmp_path: Path) -> None:
    file = tmp_path / "wrong.toml"
    text = ss.Case.template("cube-on-cuboid").text
    file.write_text('titel = "a"\n' + text.replace("steps = 10", "steps = 0"))
    with pytest.raises(ss.CaseError) as caught:
        ss.Case.load(file)
    program = subprocess.run(
        [sys.executable, "-m", "slipstick", "check", str(file)],
        capture_output=True,
        text=True,
        check=False,
    )
    assert str(caught.value) in program.stderr
    wrong, steps = caught.value.diagnostics
    assert steps.code == "slipstick::case::steps" and steps.line > 30
    assert (wrong.severity, wrong.line, wrong.column) == ("error", 1, 1)
    assert wrong.code == "slipstick::case::unknown_key" and wrong.help == "did you mean `title`?"
    assert str(wrong) in str(caught.value)
    assert isinstance(caught.value, ValueError)


def test_files_that_cannot_be_read(tmp_path: Path) -> None:
    with pytest.raises(
        FileNotFoundError, match="cannot read the case file: No such file"
    ) as missing:
        ss.Case.load(tmp_path / "nothing.toml")
    assert str(missing.value.filename) == str(tmp_path / "nothing.toml")
    file = tmp_path / "latin.toml"
    file.write_bytes(b'title = "\xe9"')
    with pytest.raises(ss.InputError, match="UTF-8"):
        ss.Case.load(file)


def test_errors_of_building_point_into_the_case(case: ss.Case) -> None:
    with pytest.raises(ss.CaseError) as caught:
        case.replace({"dirichlet[0].set": "slab_bottom"}).build()
    assert "slab_bottom" in caught.value.diagnostics[0].message
    loose = copy.deepcopy(DRAGGED)
    loose["body"].append(
        {
            "name": "loose",
            "box": {"min": [9, 9, 9], "max": [10, 10, 10], "elements": [1, 1, 1]},
            "material": DRAGGED["body"][0]["material"],
        }
    )
    with pytest.raises(ss.CaseError, match="loose"):
        ss.Case.from_dict(loose).build()


def test_warnings_of_building_are_warnings(case: ss.Case) -> None:
    with pytest.warns(ss.CaseWarning) as caught:
        case.replace({"design.sensitivity_filter": {"radius": 0.001}}).build()
    assert caught[0].message.diagnostic.code == "slipstick::case::idle_filter"  # type: ignore[union-attr]
    assert caught[0].filename == __file__


def test_check_knows_sizes(case: ss.Case) -> None:
    found = case.check()
    assert [body["name"] for body in found.bodies] == ["slab", "block"]
    assert found.steps == 4 and found.designed == 8
    # by hand: 30 nodes of the slab, 12 of the block, without those prescribed, and three
    # multipliers at each of six slave nodes
    assert found.unknowns == 3 * (15 + 6) + 3 * 6
    assert found.sets["block_ymin"] == 6


def test_cases_go_to_other_processes(case: ss.Case) -> None:
    other = pickle.loads(pickle.dumps(case.replace({"title": "sent"})))
    assert other.resolved == case.replace({"title": "sent"}).resolved and other.name.startswith(
        "dragged.toml"
    )


def test_classes_are_not_made_by_hand() -> None:
    for made in (ss.Case, ss.Problem):
        with pytest.raises(TypeError, match="use Case"):
            made()


LINKS = Path(__file__).parents[3] / "cases" / "links" / "links.inp"


def test_a_deck_is_a_case() -> None:
    case = ss.Case.load(LINKS)
    assert case.deck is not None
    assert {use["keyword"] for use in case.deck} >= {"COUPLING", "EQUATION", "CLOAD"}
    lines = LINKS.read_text().splitlines()
    assert all(lines[use["line"] - 1].startswith(f"*{use['keyword']}") for use in case.deck)
    problem = case.build()
    path = problem.solve(problem.initial_density)
    # CalculiX 2.20 (`cases/punch/ccx.sh cases/links/links.inp CLAMP`)
    force = {"x": -498.725, "y": -100.668, "z": 60.000}
    for axis, expected in force.items():
        reaction = path.quantities[f"reaction_ROOT_CLAMP_{axis}"][-1]
        assert reaction == pytest.approx(expected, abs=1e-3 * 498.7)
    # replaced values are those of the tables of the deck
    double = case.replace({"load_path.steps": 2})
    assert double.deck == case.deck and double.resolved["load_path"]["steps"] == 2
    # and a dict may refer to a deck
    of_dict = ss.Case.from_dict({"deck": {"file": LINKS.name}}, folder=LINKS.parent)
    assert of_dict.resolved == case.resolved and of_dict.deck == case.deck
    assert ss.Case.from_dict(DRAGGED).deck is None


def test_keywords_of_decks_are_refused_at_their_line_or_ignored(tmp_path: Path) -> None:
    file = tmp_path / "links.inp"
    text = LINKS.read_text().replace("*STEP\n", "*MPC\nBEAM, 1, 2\n*STEP\n", 1)
    file.write_text(text)
    with pytest.raises(ss.CaseError) as caught:
        ss.Case.load(file)
    (error,) = caught.value.diagnostics
    line = text.splitlines().index("*MPC") + 1
    assert error.line == line and "MPC" in error.message
    case = ss.Case.load(file, ignore=["MPC"])
    assert case.deck is not None
    assert [use["use"] for use in case.deck if use["keyword"] == "MPC"] == ["ignored"]
    with pytest.raises(TypeError, match="not a single string"):
        ss.Case.load(file, ignore="MPC")
    with pytest.raises(OSError, match="missing.inp"):
        ss.Case.load(tmp_path / "missing.inp")
