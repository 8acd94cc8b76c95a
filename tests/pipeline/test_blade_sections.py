"""[blade] sections: a blade from a CSV file of sections; the keys that they replace, and files that do not fit."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pipeline_support import shroud, small_scene, to_toml
from profile_support import sections_of

from geometry import BladeParameters
from pipeline.scene.geometry_parameters import sector_of
from pipeline.scene.reading import read_scene

KEYS = {f"blade__{name}": None for name in ("chord", "thickness", "tip_thickness", "twist", "section")}
SMALL = small_scene()["blade"]
BLADE = BladeParameters(72, SMALL["hub_radius"], SMALL["length"], 0.03, 0.008, 0.006, twist=15.0, section="lens")
TIP = BLADE.hub_radius + BLADE.length - small_scene()["shroud"]["thickness"]


def scene_of(folder: Path, header: str, rows: list[Any], **changes: Any) -> Path:
    """A scene file and its file of sections beside it."""
    lines = [header, *(",".join(str(cell) for cell in row) for row in rows)]
    (folder / "blade.csv").write_text("# made by a test\n" + "\n".join(lines) + "\n")
    path = folder / "scene.toml"
    path.write_text(to_toml(small_scene(**KEYS, blade__sections="blade.csv", **changes)))
    return path


def by_radius(start: float = 0.0) -> list[Any]:
    return [[radius - start, x, y] for section in sections_of(BLADE, TIP) for x, y, radius in section.tolist()]


def cartesian() -> list[Any]:
    sections = [[k, *point] for k, section in enumerate(sections_of(BLADE, TIP)) for point in section.tolist()]
    return [[k, x, r * np.sin(y / r), r * np.cos(y / r)] for k, x, y, r in sections]


def on_cones() -> list[Any]:
    return [[k, r, x, y] for k, section in enumerate(sections_of(BLADE, TIP)) for x, y, r in section.tolist()]


def by_sides() -> list[Any]:
    """Both sides from the leading to the trailing edge, the suction side first."""
    rows = []
    for section in sections_of(BLADE, TIP):
        half = len(section) // 2
        rows += [[r, x, y, "Suction"] for x, y, r in section[half:][::-1].tolist()]
        rows += [[r, x, y, "pressure"] for x, y, r in section[:half].tolist()]
    return rows


@pytest.mark.parametrize(
    ("header", "rows"),
    [
        ("height,x,y", lambda: by_radius(BLADE.hub_radius)),
        ("section,x,y,z", cartesian),
        ("section,radius,x,y", on_cones),
        ("radius,x,y,side", by_sides),
    ],
)
def test_columns_of_one_blade(tmp_path: Path, header: str, rows: Callable[[], list[Any]]) -> None:
    found = [sector_of(read_scene(scene_of(tmp_path, "radius,x,y", by_radius())).first)]
    found.append(sector_of(read_scene(scene_of(tmp_path, header, rows())).first))
    np.testing.assert_allclose(found[0].points, found[1].points, atol=1e-8)


def test_a_changed_file_is_another_mesh(tmp_path: Path) -> None:
    path, out = scene_of(tmp_path, "radius,x,y", by_radius()), tmp_path / "out"
    for _ in range(2):
        status, _, error = shroud("run", path, "--until", "mesh", "--out", out)
        assert status == 0, error
    assert "reused" in (out / "summary.json").read_text()
    scene_of(tmp_path, "radius,x,y", [[r, 1.01 * x, y] for r, x, y in by_radius()])
    status, _, error = shroud("run", path, "--until", "mesh", "--out", out)
    assert status == 0, error
    assert '"ran"' in (out / "summary.json").read_text()


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"blade__twist": 10.0}, "blade.twist: 10.0, allowed: nothing beside blade.sections"),
        ({"sweep": {"blade.camber": [0.0, 10.0]}}, "blade.camber"),
        ({"optimum": {"over": {"blade.twist": [5.0, 10.0]}}}, "nothing beside blade.sections"),
        ({"blade__fillet_radius": 0.002}, "blade.fillet_radius"),
        ({"shroud__fillet_radius": 0.001}, "shroud.fillet_radius: 0.001, allowed: must be 0 with blade.sections"),
        ({"blade__length": 0.5}, "missing at the tip"),
        ({"blade__sections": "no.csv"}, "no such file, did you mean blade.csv?"),
    ],
)
def test_keys_that_do_not_fit_sections(tmp_path: Path, changes: dict[str, Any], told: str) -> None:
    path = scene_of(tmp_path, "radius,x,y", by_radius())
    sweep = {name: changes.pop(name) for name in ("sweep", "optimum") if name in changes}
    scene = small_scene(**KEYS | {"blade__sections": "blade.csv"} | changes) | sweep
    path.write_text(to_toml(scene))
    status, _, error = shroud("validate", path)
    assert (status, error.count("\n")) == (2, 1), error
    assert told in error, error


@pytest.mark.parametrize(
    ("header", "rows", "told"),
    [
        ("radius,x", [[0.3, 0.1]], "blade.csv: columns radius, x, allowed: x, y and one of radius, height and z"),
        ("x,y,z", [[0.3, 0.1, 0.1]], "section with z"),
        ("radius,x,y", by_radius() + by_radius(), "radius 0.3 again after another one"),
        ("radius,x,y", [[1e3 * v for v in row] for row in by_radius()], "the file is in mm, allowed: metres"),
        ("radius,x,y", [[r, x, 0.0] for r, x, _ in by_radius()], "section 1 (radius 0.3 m): the points enclose no"),
        ("radius,x,y", by_radius()[:61], "section 2 (radius 0.3725 m): 1 different points"),
        ("radius,x,y", [[0.3, "a", 0.1]], 'line 3: "0.3,a,0.1", allowed: numbers'),
        ("radius,x,y", [[-0.3, 0.1, 0.1]], "a radius of -0.3 m, allowed: above 0"),
    ],
)
def test_files_that_are_refused(tmp_path: Path, header: str, rows: list[Any], told: str) -> None:
    status, _, error = shroud("validate", scene_of(tmp_path, header, rows))
    assert (status, error.count("\n")) == (2, 1), error
    assert told in error, error


def test_chord_and_thickness_are_needed_without_sections(tmp_path: Path) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(to_toml(small_scene(blade__chord=None)))
    status, _, error = shroud("validate", path)
    assert status == 2
    assert "blade.chord: missing, allowed: a number above 0" in error
