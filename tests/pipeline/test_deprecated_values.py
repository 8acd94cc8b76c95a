"""Earlier spellings of values are read with a note, and nothing after the reading sees them."""

from pathlib import Path
from typing import Any

import h5py
import jsonschema
import pytest
from pipeline_support import (
    ground_scene,
    shroud,
    small_scene,
    statuses,
    without_lines,
    write_ground_model,
    write_scene,
)

from pipeline.scene.json_schema import scene_schema
from pipeline.scene.reading import read_scene


def note(path: Path, key: str, old: str, new: str) -> str:
    return f'note: {path}: {key} = "{old}" is now spelled "{new}"\n'


@pytest.mark.parametrize(("old", "new"), [("uncoupled", "two_sliders"), ("coupled", "cone")])
def test_an_earlier_spelling_of_the_law_is_the_same_scene(tmp_path: Path, old: str, new: str) -> None:
    path = write_scene(tmp_path / "old.toml", small_scene(contact__law=old))
    today = write_scene(tmp_path / "new.toml", small_scene(contact__law=new))
    assert read_scene(path).first == read_scene(today).first
    status, said, error = shroud("validate", path)
    assert (status, error) == (0, note(path, "contact.law", old, new))
    assert "valid, 1 curve" in said
    assert shroud("validate", today)[2] == ""


def test_each_spelling_in_a_sweep_is_noted_once(tmp_path: Path) -> None:
    sweep = {"contact.law": ["uncoupled", "coupled"]}
    path = write_scene(tmp_path / "s.toml", small_scene(sweep=sweep) | {"accuracy": "draft"})
    file = read_scene(path)
    laws = ["two_sliders", "cone"]
    assert [member.parameters["contact.law"] for member in file.members] == laws
    assert [member.scene.contact.law for member in file.members] == laws
    key = 'sweep."contact.law"'
    expected = note(path, key, "uncoupled", "two_sliders") + note(path, key, "coupled", "cone")
    assert shroud("validate", path)[2] == expected


def test_a_value_that_the_sweep_replaces_is_noted(tmp_path: Path) -> None:
    """A designer who changes contact.interference below a sweep over it would see no effect, and not why."""
    for own, noted in ((3e-6, True), (1e-6, False)):
        values = small_scene(contact__interference=own, sweep={"contact.interference": [0.0, 1e-6]})
        path = write_scene(tmp_path / "s.toml", values)
        said = f"note: {path}: contact.interference = {own} is not used: [sweep] gives the values\n"
        assert shroud("validate", path)[2] == said * noted


def test_results_are_those_of_the_spelling_of_today(tmp_path: Path) -> None:
    rom, out = write_ground_model(tmp_path / "g.h5"), tmp_path / "out"
    old = write_scene(tmp_path / "old.toml", ground_scene(law="uncoupled"))
    status, _, error = shroud("respond", old, "--rom", rom, "--out", out)
    assert status == 0
    assert error.startswith(note(old, "contact.law", "uncoupled", "two_sliders"))
    with h5py.File(out / "response.h5") as file:
        assert file["curve/0"].attrs["contact.law"] == "two_sliders"
    today = write_scene(tmp_path / "new.toml", ground_scene(law="two_sliders"))
    assert shroud("respond", today, "--rom", rom, "--out", out, "--quiet") == (0, "", "")
    assert statuses(out)["respond"] == "reused"


@pytest.mark.parametrize(
    ("change", "key"),
    [
        ({"contact__law": "linked"}, "contact.law"),
        ({"sweep": {"contact.law": ["cone", "linked"]}}, 'sweep."contact.law"[1]'),
    ],
)
def test_a_wrong_law_is_told_the_spellings_of_today(tmp_path: Path, change: dict[str, Any], key: str) -> None:
    path = write_scene(tmp_path / "s.toml", small_scene(**change))
    status, _, error = shroud("validate", path)
    assert (status, without_lines(error)) == (2, f'{path}: {key}: "linked", allowed: "two_sliders" or "cone"\n')


def test_editors_accept_earlier_spellings_and_mark_them() -> None:
    check = jsonschema.Draft202012Validator(scene_schema())
    for law, valid in (("two_sliders", True), ("cone", True), ("uncoupled", True), ("coupled", True), ("no", False)):
        assert check.is_valid(small_scene(contact__law=law)) == valid
        assert check.is_valid(small_scene(sweep={"contact.law": [law]})) == valid
    field = scene_schema()["$defs"]["Contact"]["properties"]["law"]
    assert [choice.get("deprecated", False) for choice in field["anyOf"]] == [False, True]
