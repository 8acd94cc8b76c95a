"""`shroud check`: any motion of a curve in time, and bad questions refused in one line."""

import json
import sys
from pathlib import Path
from typing import Any

import pytest
from pipeline_support import RAW_TEXT, shroud, write_scene

from rom import write_reduced_model

sys.path.append(str(Path(__file__).parents[1] / "nonlinear"))
from lumped import lumped_blade

UNSTABLE, MANY = 0.1405, 0.2  # Hz: one solution, against which the two blades move apart; three solutions


def pair_scene(**response: Any) -> dict[str, Any]:
    """Two lumped blades with a gap between the shrouds."""
    contact = {"normal_stiffness": 6.0, "tangential_stiffness": 4.2, "friction": 1.0, "interference": -4.0}
    values = {"frequency": [0.1, 0.3], "harmonics": 7, "damping_ratio": 0.01, "truncation": False, "detached": False}
    return {
        "name": "pair",
        "contact": contact,
        "excitation": {"engine_order": 1, "force": 1.0},
        "response": values | {"search": "quick"} | response,
    }


@pytest.fixture(scope="module")
def pair(tmp_path_factory: pytest.TempPathFactory) -> list[Any]:
    """Arguments of a check of the two blades, whose curve is solved."""
    folder = tmp_path_factory.mktemp("pair")
    write_reduced_model(folder / "pair.h5", lumped_blade(2, 1))
    scene = write_scene(folder / "pair.toml", pair_scene())
    return ["check", scene, "--rom", folder / "pair.h5", "--out", folder / "out"]


@pytest.fixture(scope="module")
def checked(pair: list[Any]) -> dict[str, Any]:
    """Values of the check of a motion that no ring keeps."""
    status, said, _ = shroud(*pair, "--frequency", UNSTABLE, "--json")
    assert status == 0
    found: dict[str, Any] = json.loads(said)
    return found


def test_a_ring_leaves_an_unstable_motion(checked: dict[str, Any]) -> None:
    (found,) = checked["solutions"]
    assert (found["branch"], found["stable"], found["nodal_diameter"]) == (0, False, 1)
    assert (checked["nodal_diameter"], checked["ring_blades"]) == (1, 2)
    assert not checked["stays"]
    assert checked["growth_rate"] is None or checked["growth_rate"] > 0.0
    assert checked["predicted_growth_rate"] == pytest.approx(found["growth_rate"], rel=3e-5)
    assert found["growth_rate"] > 0.0
    assert 0.0 < checked["growth_rate_error"] < 0.02


def test_without_a_frequency_the_worst_motions_are_checked(
    pair: list[Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A stable solution in time; one that was left open by a longer search, which finds no less and is kept."""
    scene = write_scene(tmp_path / "pair.toml", pair_scene(frequency=[0.17, 0.23], effort=0.3))
    pair = ["check", scene, *pair[2:4], "--out", tmp_path / "out"]
    status, said, error = shroud(*pair, "--quiet", "--json")
    (found,) = json.loads(said)["curves"]
    assert (status, error, found["longer"], found["check"]["stays"]) == (0, "", None, True)
    solution = found["check"]["solutions"][found["check"]["solution"] - 1]
    assert solution["amplitude_m"] == pytest.approx(found["worst"]["amplitude_m"], rel=1e-6)
    monkeypatch.setattr("pipeline.check.check_run.is_open", lambda worst: True)
    status, said, error = shroud(*pair)
    assert (status, "a thorough search: worst motion" in said, "thorough searches, 1 of 1" in error) == (
        0,
        True,
        True,
    )
    status, again, error = shroud(*pair, "--json")
    (found,) = json.loads(again)["curves"]
    assert (found["check"], found["reason"], "thorough searches" in error) == (None, "", False)
    assert found["longer"]["amplitude_m"] >= found["worst"]["amplitude_m"]


def test_a_ring_stays_on_a_stable_motion(pair: list[Any]) -> None:
    """On the highest of three; the one between the folds leads elsewhere."""
    status, said, error = shroud(*pair, "--frequency", MANY, "--quiet", "--json")
    found = json.loads(said)
    assert (status, error, found["stays"], found["periodic"]) == (0, "", True, True)
    heights = [each["amplitude_m"] for each in found["solutions"]]
    assert len(heights) == 3
    assert heights == sorted(heights, reverse=True)
    assert [each["stable"] for each in found["solutions"]] == [True, False, True]
    assert found["amplitude_m"] == pytest.approx(heights[0], rel=0.02)
    _, said, _ = shroud(*pair, "--frequency", MANY, "--solution", 2, "--quiet", "--json")
    found = json.loads(said)
    assert not found["stays"]
    assert found["reaches_solution"] in (1, 3)


def test_the_answer_in_words_and_its_picture(pair: list[Any], checked: dict[str, Any]) -> None:
    out = Path(pair[5])
    before = {path: path.read_bytes() for path in out.iterdir() if path.is_file()}
    status, said, _ = shroud(*pair, "--frequency", UNSTABLE, "--branch", 0)
    assert status == 0
    for text in (
        "1 solution\n",
        "main branch",
        "unstable",
        "ring of 2 blades",
        "predicted",
        "the ring ends in",
        "of the solution",
    ):
        assert text in said
    picture = Path(said.splitlines()[-1])
    assert picture.parent == out / "check"
    assert {path.suffix for path in picture.parent.glob(f"{picture.stem}.*")} == {".png", ".svg", ".csv", ".json"}
    written = json.loads(picture.with_suffix(".json").read_text())
    before_it = {name: value for name, value in checked.items() if name != "files"}
    numbers = {name: value for name, value in before_it.items() if isinstance(value, float)}
    assert {name: written[name] for name in numbers} == pytest.approx(numbers, rel=1e-3)  # rates hang on round-off
    assert written.keys() == before_it.keys()
    for name, value in before_it.items():
        assert isinstance(value, float | list) or written[name] == value
    assert before == {path: path.read_bytes() for path in out.iterdir() if path.is_file()}


def test_a_motion_that_a_flow_feeds_without_bound_is_said(pair: list[Any], tmp_path: Path) -> None:
    """Blades that do not touch, each fed by more than its damping."""
    fed = {"family": [{"mode": 1, "offset": [0], "real": [0.0], "imaginary": [0.1]}]}
    tables = pair_scene(harmonics=1, search="off", frequency=[0.11, 0.13])
    tables["contact"] |= {"interference": -100.0}
    scene = write_scene(tmp_path / "fed.toml", tables | {"aero": fed})
    arguments = ["check", scene, "--rom", pair[3], "--out", tmp_path / "out", "--frequency", 0.12]
    status, said, _ = shroud(*arguments)
    assert status == 0
    assert "the ring leaves this motion for one that grows without bound" in said
    found = json.loads(Path(said.splitlines()[-1]).with_suffix(".json").read_text())
    assert (found["unbounded"], found["stays"], found["settled"]) == (True, False, False)


@pytest.mark.parametrize(
    ("question", "names"),
    [
        (["--frequency", 0.2, "--curve", 1], ["--curve", "1", "allowed: 0"]),
        (["--frequency", 0.2, "--curve", -1], ["--curve"]),
        (["--frequency", 9.0], ["--frequency", "9", "0.1 to 0.3 Hz"]),
        (["--frequency", "nan"], ["--frequency"]),
        (["--frequency", "high"], ["--frequency"]),
        (["--frequency", 0.2, "--branch", 2], ["--branch", "2", "no detached"]),
        (["--frequency", 0.2, "--solution", 9], ["--solution", "9", "1 to "]),
        (["--frequency", 0.2, "--solution", 0], ["--solution"]),
        (["--branch", 0], ["--branch", "--frequency"]),
    ],
)
@pytest.mark.usefixtures("checked")
def test_a_bad_question_is_refused_in_one_line(pair: list[Any], question: list[Any], names: list[str]) -> None:
    status, said, error = shroud(*pair, *question, "--quiet")
    assert (status, said, error.count("\n")) == (2, "", 1)
    assert not RAW_TEXT.search(error)
    for name in names:
        assert name in error


def test_a_frozen_static_part_is_refused(pair: list[Any], tmp_path: Path) -> None:
    scene = write_scene(tmp_path / "s.toml", pair_scene(method="static-first"))
    status, _, error = shroud("check", scene, *pair[2:4], "--out", tmp_path / "out", "--frequency", 0.2)
    assert (status, error.count("\n")) == (2, 1)
    assert "response.method" in error
    assert not (tmp_path / "out").exists()
