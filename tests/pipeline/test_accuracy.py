"""Presets of accuracy: what they set, that the scene itself goes before them, and what is said of them."""

import json
from pathlib import Path
from typing import Any

import pytest
from pipeline_support import WHOLE, ground_scene, shroud, small_scene, summary_of, write_ground_model, write_scene

from pipeline.scene.presets import PRESETS
from pipeline.scene.reading import read_scene
from pipeline.stages.cache_keys import model_keys


def bare(**changes: Any) -> dict[str, Any]:
    """The small scene without what a preset sets."""
    unset = {"mesh__size": None, "mesh__element": None, "rom__modes": None, "response__harmonics": None}
    return {"accuracy": "draft", **small_scene(**unset, **WHOLE, **changes)}


@pytest.mark.parametrize("name", PRESETS)
def test_a_preset_sets_mesh_modes_harmonics_and_tolerances(tmp_path: Path, name: str) -> None:
    file = read_scene(write_scene(tmp_path / "s.toml", bare() | {"accuracy": name}))
    scene, preset = file.first, PRESETS[name]
    assert scene.mesh is not None
    assert scene.mesh.size == pytest.approx(0.036 / preset.elements_along_chord, rel=5e-3)
    assert scene.mesh.element == preset.values["mesh.element"]
    assert scene.mesh.contact_grid == (2, 2)
    assert scene.rom.modes == preset.values["rom.modes"]
    assert scene.rom.tolerance == preset.values["rom.tolerance"]
    assert scene.response.harmonics == preset.values["response.harmonics"]
    assert scene.response.tolerance == preset.values["response.tolerance"]
    assert (scene.response.stability, scene.response.search) == (
        ("folds", "off") if name == "draft" else ("ring", "standard")
    )
    assert file.accuracy is not None
    assert file.accuracy.others == ()
    assert ("only the stability of the highest motion is checked" in file.accuracy.text()) == (name == "draft")


def test_finer_presets_are_finer_and_expect_less() -> None:
    presets = list(PRESETS.values())
    assert sorted(p.elements_along_chord for p in presets) == [p.elements_along_chord for p in presets]
    for part in ("peak_amplitude", "peak_frequency"):
        errors = [getattr(p.expected, part) for p in presets]
        assert sorted(errors, reverse=True) == errors
        assert errors[-1] > 0.0


def test_without_a_preset_nothing_changes(tmp_path: Path) -> None:
    file = read_scene(write_scene(tmp_path / "s.toml", small_scene()))
    assert file.accuracy is None
    scene = file.first
    assert scene.mesh is not None
    assert (scene.mesh.size, scene.rom.modes, scene.response.harmonics) == (0.009, 6, 1)


def test_what_the_scene_says_goes_before_the_preset(tmp_path: Path) -> None:
    changed = bare() | {"rom": {"frequency_limit": 3000.0}}
    changed["mesh"] = {"size": 0.009, "contact_grid": [2, 2]}
    changed["response"]["stability"] = "wave"  # changes no peak
    changed["sweep"] = {"response.harmonics": [1, 3]}
    path = write_scene(tmp_path / "s.toml", changed)
    file = read_scene(path)
    assert [member.scene.response.harmonics for member in file.members] == [1, 3]
    assert file.first.mesh is not None
    assert (file.first.mesh.size, file.first.mesh.element) == (0.009, "hex20")
    assert (file.first.rom.modes, file.first.rom.frequency_limit) == (None, 3000.0)
    assert file.accuracy is not None
    assert file.accuracy.others == ("mesh.size", "rom.modes", "response.harmonics")
    status, said, _ = shroud("validate", path)
    assert status == 0
    assert "not by the preset, so that the error may be another: mesh.size, rom.modes, response.harmonics" in said


def test_a_swept_chord_takes_the_mesh_with_it(tmp_path: Path) -> None:
    scene = bare(blade__chord=None) | {"sweep": {"blade.chord": [0.030, 0.036]}}
    members = read_scene(write_scene(tmp_path / "s.toml", scene)).members
    sizes = [member.scene.mesh.size for member in members if member.scene.mesh is not None]
    assert sizes == pytest.approx([0.00667, 0.008])


def test_a_preset_makes_the_same_results_as_its_values(tmp_path: Path) -> None:
    preset = read_scene(write_scene(tmp_path / "a.toml", bare())).first
    spelt = read_scene(
        write_scene(tmp_path / "b.toml", small_scene(mesh__size=0.008, mesh__element="hex20", rom__modes=10))
    ).first
    assert model_keys(preset) == model_keys(spelt)


def test_expected_errors_are_said_and_written(tmp_path: Path) -> None:
    scene = small_scene(response__harmonics=None, mesh__size=0.012) | {"accuracy": "draft"}
    path = write_scene(tmp_path / "s.toml", scene)
    status, _said, error = shroud("run", path, "--out", tmp_path / "out", "--until", "mesh")
    assert status == 0, error
    expected = PRESETS["draft"].expected
    line = f"error of a peak of the default blade {100.0 * expected.peak_amplitude:g} %"
    assert line in shroud("validate", path)[1]
    written = summary_of(tmp_path / "out")["accuracy"]
    assert written["preset"] == "draft"
    assert written["expected_error"]["peak_frequency"] == expected.peak_frequency
    assert written["values"]["response.harmonics"] == PRESETS["draft"].values["response.harmonics"]
    assert "mesh.size" in written["not_by_preset"]


def test_a_larger_error_of_the_scene_itself_is_printed_in_place_of_the_expected_one(tmp_path: Path) -> None:
    accuracy = read_scene(write_scene(tmp_path / "s.toml", bare())).accuracy
    assert accuracy is not None
    assert "error of a peak of the default blade 5 %" in accuracy.text((0.04, 0.001))
    line = accuracy.text((0.23, 0.001))
    assert "modes left out change a receptance of this scene by 23 %, a frequency by 0.1 %" in line
    assert "expected error" not in line


def test_no_preset_is_null_in_the_summary(tmp_path: Path) -> None:
    path = write_scene(tmp_path / "s.toml", small_scene(mesh__size=0.012))
    assert shroud("run", path, "--out", tmp_path / "out", "--until", "mesh", "--quiet")[0] == 0
    assert json.loads((tmp_path / "out" / "summary.json").read_text())["accuracy"] is None


def test_a_given_model_takes_the_harmonics_only(tmp_path: Path) -> None:
    scene = write_scene(tmp_path / "s.toml", {"accuracy": "standard", **ground_scene()})
    rom = write_ground_model(tmp_path / "g.h5")
    assert shroud("respond", scene, "--rom", rom, "--out", tmp_path / "out", "--quiet")[0] == 0
    written = summary_of(tmp_path / "out")["accuracy"]
    assert set(written["values"]) == {"response.harmonics", "response.tolerance"}
    assert "rom.modes" in written["not_by_preset"]


@pytest.mark.parametrize(
    ("value", "said"),
    [
        ("standrad", 'accuracy: "standrad", did you mean standard?, allowed: "draft", "standard" or "reference"'),
        ("best", 'accuracy: "best", allowed: "draft", "standard" or "reference"'),
        (3, 'accuracy: 3, allowed: "draft", "standard" or "reference"'),
    ],
)
def test_a_preset_that_does_not_exist(tmp_path: Path, value: Any, said: str) -> None:
    path = write_scene(tmp_path / "s.toml", bare() | {"accuracy": value})
    status, _, error = shroud("validate", path)
    assert (status, error) == (2, f"{path}:1: {said}\n")


@pytest.mark.parametrize("chord", [None, "wide", -1.0, True])
def test_a_chord_that_is_wrong_is_what_is_named(tmp_path: Path, chord: Any) -> None:
    status, _, error = shroud("validate", write_scene(tmp_path / "s.toml", bare(blade__chord=chord)))
    assert status == 2
    assert "blade.chord: " in error


def test_expected_errors_cover_what_was_measured() -> None:
    document = Path(__file__).parents[2] / "docs" / "developers" / "performance.md"
    rows = [[cell.strip() for cell in line.split("|")] for line in document.read_text().splitlines()]
    measured = {row[2].strip('"'): row[-3:-1] for row in rows if len(row) > 5 and row[1] == "accuracy ="}
    assert set(measured) == set(PRESETS)
    for name, cells in measured.items():
        amplitude, frequency = (float(cell.removesuffix("%")) / 100.0 for cell in cells)
        assert amplitude <= PRESETS[name].expected.peak_amplitude
        assert frequency <= PRESETS[name].expected.peak_frequency
