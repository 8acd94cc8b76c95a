"""A body that friction alone holds and that its loads push off: warned of, and no curve of metres."""

import json
from pathlib import Path

import pytest
from mesh_decks import Body, write_deck
from pipeline_support import shroud

SETS = {
    "root": lambda body, r, angle, z: r < 100.1,
    "lower": lambda body, r, angle, z: (body == 0) & (r > 109.9),
    "upper": lambda body, r, angle, z: (body == 1) & (r < 110.1),
}
SCENE = """
name = "opened"
[mesh]
file = "b.inp"
unit = "mm"
n_blades = 36
axis = "z"
contact_grid = [2, 2]
[mesh.sets]
root = "root"
[mesh.interface.joint]
kind = "inside"
right = "upper"
left = "lower"
[[load.pressure]]
surface = "upper"
pressure = {pressure}
[[load.pressure]]
surface = "lower"
pressure = 1e5
[contact]
normal_stiffness = 1.0e7
tangential_stiffness = 1.0e7
friction = 0.3
[excitation]
engine_order = 3
force = 1.0
[response]
frequency = [100.0, 130.0]
harmonics = 1
damping_ratio = 0.005
search = "off"
detached = false
stability = "folds"
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("opened")
    bodies = [Body((a, a + 10.0), (-2.0, 2.0), (0.0, 8.0), (2, 2, 2)) for a in (100.0, 110.0)]
    write_deck(place / "b.inp", bodies, SETS)
    return place


def test_a_body_that_its_loads_push_off(folder: Path) -> None:
    scene = folder / "off.toml"
    scene.write_text(SCENE.format(pressure="1e5"))
    status, _, error = shroud("validate", scene)
    assert status == 0
    assert "held by contacts alone; at rest, without contact.interference or preload" in error
    status, _, error = shroud("modes", scene, "--out", folder / "off")
    assert status == 0
    assert "m open in the static state, the body 0.1" in error
    status, _, error = shroud("run", scene, "--out", folder / "off")
    assert status == 1
    (curve,) = json.loads((folder / "off" / "summary.json").read_text())["curves"]
    assert "further than the body is large (0.1" in curve["reason"]
    assert curve["points"] == 1


def test_a_body_that_its_loads_press_on(folder: Path) -> None:
    scene = folder / "on.toml"
    scene.write_text(SCENE.format(pressure="-1e5"))
    status, _, error = shroud("modes", scene, "--out", folder / "on")
    assert status == 0
    assert "open in the static state" not in error
