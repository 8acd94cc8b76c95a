"""A scene to start from, the schema for editors, and completion."""

import json
import os
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import pytest
from jsonschema import Draft202012Validator
from pipeline_support import shroud, small_scene, write_scene

from pipeline.scene.presets import PRESETS, preset_values
from pipeline.scene.reading import read_scene

REPOSITORY = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def validator() -> Draft202012Validator:
    status, said, error = shroud("schema")
    assert (status, error) == (0, "")
    found = json.loads(said)
    Draft202012Validator.check_schema(found)
    return Draft202012Validator(found)


def test_a_new_scene_is_valid_and_has_the_name_of_its_folder(tmp_path: Path) -> None:
    folder = tmp_path / "deep" / "my-blade_2"
    status, said, error = shroud("new", folder)
    assert (status, error) == (0, "")
    assert f"shroud run {folder / 'scene.toml'}" in said
    assert shroud("validate", folder / "scene.toml")[0] == 0
    text = (folder / "scene.toml").read_text()
    assert tomllib.loads(text)["name"] == "my-blade_2"
    assert text.startswith("#:schema ./scene.schema.json\n")
    assert json.loads((folder / "scene.schema.json").read_text()) == json.loads(shroud("schema")[1])


@pytest.mark.parametrize("name", PRESETS)
def test_its_accuracy_decides_all_that_a_preset_gives(tmp_path: Path, name: str) -> None:
    assert shroud("new", tmp_path / "mine")[0] == 0
    path = tmp_path / "mine" / "scene.toml"
    text = path.read_text()
    assert 'accuracy = "standard"' in text
    path.write_text(text.replace('accuracy = "standard"', f'accuracy = "{name}"'))
    found = json.loads(shroud("validate", path, "--json")[1])["accuracy"]
    assert (found["preset"], found["not_by_preset"]) == (name, [])
    assert found["values"] == preset_values(name, tomllib.loads(text)["blade"]["chord"])


def test_it_is_the_default_blade_but_for_the_preset(tmp_path: Path) -> None:
    assert shroud("new", tmp_path / "mine")[0] == 0
    new = read_scene(tmp_path / "mine" / "scene.toml").first.model_dump()
    default = read_scene(REPOSITORY / "scenes" / "dummy.toml").first.model_dump()
    by_preset = preset_values("standard", default["blade"]["chord"])
    for section, keys in default.items():
        if isinstance(keys, dict):
            ours = {key for key in keys if f"{section}.{key}" not in by_preset}
            assert {key: new[section][key] for key in ours} == {key: keys[key] for key in ours}


def test_the_title_is_asked_for_or_left_out(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert shroud("new", tmp_path / "a")[0] == 0
    assert "title" not in tomllib.loads((tmp_path / "a" / "scene.toml").read_text())
    assert shroud("new", tmp_path / "b", "--title", 'Stage "1"')[0] == 0
    assert tomllib.loads((tmp_path / "b" / "scene.toml").read_text())["title"] == 'Stage "1"'
    status, _, error = shroud("new", tmp_path / "c", "--title", "x" * 201)
    assert (status, error.count("\n")) == (2, 1)
    assert error.endswith("allowed: one line of text, 200 characters at most\n")
    assert not (tmp_path / "c").exists()


def test_its_template_is_the_default_scene() -> None:
    template = (REPOSITORY / "pipeline" / "scene" / "template" / "scene.toml").read_text()
    assert template == (REPOSITORY / "scenes" / "dummy.toml").read_text()


def test_nothing_is_overwritten(tmp_path: Path) -> None:
    (tmp_path / "scene.schema.json").write_text("mine")
    status, said, error = shroud("new", tmp_path)
    assert (status, said) == (2, "")
    assert error.count("\n") == 1
    assert str(tmp_path / "scene.schema.json") in error
    assert [file.name for file in tmp_path.iterdir()] == ["scene.schema.json"]
    assert (tmp_path / "scene.schema.json").read_text() == "mine"


@pytest.mark.parametrize("name", ["-x", "two words", "é", "x" * 65, "a'b"])
def test_a_folder_that_cannot_name_a_scene(tmp_path: Path, name: str) -> None:
    status, _, error = shroud("new", "--", tmp_path / name)
    assert status == 2
    assert error.count("\n") == 1
    assert not any(tmp_path.iterdir())


def test_a_file_in_the_way(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    status, _, error = shroud("new", tmp_path / "file" / "scene")
    assert status == 2
    assert error.count("\n") == 1


@pytest.mark.parametrize("scene", sorted((REPOSITORY / "scenes").glob("*.toml")), ids=lambda path: path.stem)
def test_the_schema_knows_every_shipped_scene(validator: Draft202012Validator, scene: Path) -> None:
    assert list(validator.iter_errors(tomllib.loads(scene.read_text()))) == []


@pytest.mark.parametrize(
    "change",
    [
        {"contact__friction": -0.1},
        {"contact__friktion": 0.1},
        {"blade__n_blades": 2},
        {"blade__n_blades": "many"},
        {"mesh__contact_grid": [3]},
        {"mesh__element": "tet4"},
        {"shroud__angle": 0.0},
        {"response__harmonics": "some"},
        {"rom__tolerance": 1.0},
        {"name": "a/b"},
        {"name": None},
        {"contact": None},
        {"excitation__force": None},
        {"sweep": {"contact.friction": 0.1}},
        {"sweep": {"contact.friction": [0.1, -0.1]}},
        {"sweep": {"render.modes": [[1]]}},
        {"sweep": {"contact.friktion": [0.1]}},
    ],
)
def test_schema_and_program_refuse_the_same(
    tmp_path: Path, validator: Draft202012Validator, change: dict[str, Any]
) -> None:
    scene = small_scene(**change)
    assert list(validator.iter_errors(scene))
    assert shroud("validate", write_scene(tmp_path / "s.toml", scene))[0] == 2


def test_a_preset_gives_the_element_size(validator: Draft202012Validator) -> None:
    scene = small_scene(mesh__size=None)
    assert list(validator.iter_errors(scene))
    assert list(validator.iter_errors(scene | {"accuracy": "draft"})) == []
    assert list(validator.iter_errors(scene | {"accuracy": "best"}))


def test_every_key_is_explained(validator: Draft202012Validator) -> None:
    schema: Any = validator.schema
    for name, definition in schema["$defs"].items():
        for key, value in definition["properties"].items():
            assert "; allowed: " in value["description"], f"{name}.{key}"


def test_completion() -> None:
    environment = os.environ | {
        "_SHROUD_COMPLETE": "complete_bash",
        "COMP_WORDS": "shroud ver",
        "COMP_CWORD": "1",
    }
    done = subprocess.run(
        [sys.executable, "-m", "pipeline"],
        cwd=REPOSITORY,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.stdout.split() == ["verify"]
