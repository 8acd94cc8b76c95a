"""The sector of a blisk: cut faces by the names of a cyclic solver, and no contact at all."""

import json
import re
from pathlib import Path

import pytest
from mesh_decks import Body, write_deck
from pipeline_support import shroud, small_scene, write_scene

SETS = {
    "root": lambda body, r, angle, z: r < 60.1,
    "left_boundary": lambda body, r, angle, z: angle < -7.49,
    "right_boundary": lambda body, r, angle, z: angle > 7.49,
}
AERO = """
[aero]
[[aero.family]]
mode = 1
offset = [-1, 0, 1]
real = [0.0, 0.0, 0.0]
imaginary = [0.001, -0.002, 0.001]
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("blisk")
    disk = Body((60.0, 100.0), (-7.5, 7.5), (0.0, 6.0), (3, 3, 2))
    blade = Body((100.0, 140.0), (-2.5, 2.5), (0.0, 6.0), (4, 1, 2))
    write_deck(place / "blisk.inp", [disk, blade], SETS, joined=True)
    status, told, error = shroud("new", place / "n", "--mesh", place / "blisk.inp")
    assert status == 0, error
    assert 'cyclic_right: "right_boundary"' in told
    assert "24 blades" in told
    return place / "n"


def peak(folder: Path, name: str, more: str) -> tuple[dict, float]:
    """The summary of a run at engine order 3, and its peak."""
    text = (folder / "scene.toml").read_text().replace("engine_order = 12", "engine_order = 3").replace('"y"', '"x"')
    text = re.sub("frequency = .*", "frequency = [1500.0, 2200.0]", text.partition("[render]")[0])
    (folder / f"{name}.toml").write_text(text + more)
    status, _, error = shroud("run", folder / f"{name}.toml", "--out", folder / name)
    assert status == 0, error
    summary = json.loads((folder / name / "summary.json").read_text())
    return summary, summary["curves"][0]["peak_amplitude_m"]


def test_a_mesh_without_contact_faces_needs_no_contact_section(folder: Path, tmp_path: Path) -> None:
    """Its scene has none; one of a mesh with faces, and of a blade made here, is refused without it."""
    text = (folder / "scene.toml").read_text()
    assert "\n[contact]" not in text
    assert shroud("validate", folder / "scene.toml")[0] == 0
    blade = Body((100.0, 120.0), (-5.0, 5.0), (0.0, 20.0), (1, 4, 3))
    ends = {"root": lambda body, r, angle, z: r < 100.1}
    ends |= {name: lambda body, r, angle, z, s=s: s * angle > 4.99 for name, s in (("right", 1), ("left", -1))}
    write_deck(tmp_path / "b.inp", [blade], ends)
    assert shroud("new", tmp_path / "n", "--mesh", tmp_path / "b.inp", "--blades", "36")[0] == 0
    lines = (tmp_path / "n" / "scene.toml").read_text()
    (tmp_path / "n" / "s.toml").write_text(re.sub(r"\[contact\].*?\n\n", "", lines, flags=re.S))
    for command in (("validate",), ("run", "--until", "mesh", "--out", tmp_path / "out")):
        status, _, error = shroud(command[0], tmp_path / "n" / "s.toml", *command[1:])
        assert status == 2
        assert "contact: missing, allowed: a table [contact] with normal_stiffness, tangential_stiffness, f" in error
    scene = small_scene(contact=None)
    assert "contact: missing" in shroud("validate", write_scene(tmp_path / "m.toml", scene))[2]


def test_a_disk_one_element_wide_is_refused_at_once(tmp_path: Path) -> None:
    """Its cut faces hold all nodes; two elements leave some between them."""
    for across, words in ((1, "must leave nodes between the cut faces"), (2, "next: shroud run")):
        disk = Body((60.0, 100.0), (-7.5, 7.5), (0.0, 6.0), (3, across, 2))
        write_deck(tmp_path / "disk.inp", [disk], SETS)
        assert words in "".join(shroud("new", tmp_path / f"n{across}", "--mesh", tmp_path / "disk.inp")[1:])


def test_a_blisk_without_contact_is_a_linear_model_with_flow(folder: Path) -> None:
    """Free and stuck are one; the flow adds 0.002 (1 - cos 45 degrees) to the loss factor 0.006."""
    summary, still = peak(folder, "still", "")
    status, told, _ = shroud("modes", folder / "still.toml", "--out", folder / "still")
    assert (status, "static contact" in told) == (0, False), told
    model = summary["models"][0]
    assert model["stuck_hz"]["3"][0] == pytest.approx(model["free_at_order_hz"]["3"][0], rel=1e-9)
    _, flow = peak(folder, "flow", AERO)
    assert still / flow == pytest.approx(1.0 + 0.002 * (1.0 - 0.5**0.5) / 0.006, rel=2e-3)
