"""[mesh.interface.NAME] of a scene: what is read, and bad input in one line."""

import json
import tomllib
from pathlib import Path

import pytest
from pipeline_support import shroud, write_scene

from pipeline.scene.reading import read_scene

SCENES = Path(__file__).parents[2] / "scenes"


def changed(folder, **values):
    scene = tomllib.loads((SCENES / "root.toml").read_text())
    scene["mesh"]["file"] = str(SCENES / "root.inp")
    for dotted, value in values.items():
        *tables, key = dotted.split("__")
        table = scene
        for name in tables:
            table = table.setdefault(name, {})
        if value is None:
            del table[key]
        else:
            table[key] = value
    return write_scene(folder / "scene.toml", scene)


def test_interfaces_of_a_mesh_are_known_by_their_names(tmp_path):
    scene = read_scene(changed(tmp_path, interface__root__friction=0.2)).first
    assert scene.interfaces == ("root",)
    assert scene.contact_of("root").friction == 0.2
    assert shroud("validate", changed(tmp_path))[0] == 0


def test_a_blade_that_its_root_alone_holds_has_no_free_limit(tmp_path):
    """Without contact it flies away: nothing is compared with that, and no resonance of it is missed in the range."""
    few = {"mesh__contact_grid": [2, 2], "rom__modes": 4, "response__harmonics": 1, "sweep": {}}
    alone = {"response__search": "off", "response__stability": "folds", "load__speed_rpm": 6000.0}
    scene, only = changed(tmp_path, **few, **alone), ("--jobs", "1", "--until", "respond")
    status, said, error = shroud("run", scene, "--out", tmp_path / "out", *only)
    assert status == 0, error
    assert " Hz stuck; inside the range 1020 to 1130 Hz" in said
    assert " free" not in said
    assert "leaves out" not in error
    (entry,) = json.loads((tmp_path / "out" / "summary.json").read_text())["linear"]
    assert "free_hz" not in entry


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"mesh__interface__root__kind": "insde"}, 'mesh.interface.root.kind: "insde", did you mean inside?'),
        (
            {"mesh__interface__root__right": None},
            "mesh.interface.root.right: missing, allowed: the name of a node set",
        ),
        ({"mesh__interface__root__rigth": "X"}, "mesh.interface.root.rigth: unknown key, did you mean right?"),
        ({"mesh__interface__root": 3}, "mesh.interface.root: 3, allowed: a table [mesh.interface.root]"),
        (
            {"mesh__interface__root__contact_grid": [3, 99]},
            "mesh.interface.root.contact_grid[1]: 99, allowed: two",
        ),
        (
            {"interface__rooot__friction": 0.1},
            "interface.rooot: unknown name, allowed: contact interfaces of the model",
        ),
        ({"mesh__interface__root__left": "TIP"}, 'mesh.interface.root.left: "TIP", allowed: has 1 separate patches'),
        ({"mesh__interface__root__kind": "neighbours"}, 'kind = "inside" would fit in mesh.interface.root.kind'),
        (
            {"mesh__interface": {}, "mesh__sets__contact_right": "BLADE_FLANKS"},
            "must be one connected body; there are 2",
        ),
    ],
)
def test_bad_input_is_one_line_that_names_the_interface(tmp_path, changes, said):
    status, _, error = shroud("validate", changed(tmp_path, **changes))
    assert status == 2
    assert said in error
    assert len(error.strip().splitlines()) == 1
