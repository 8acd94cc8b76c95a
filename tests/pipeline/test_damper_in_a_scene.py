"""Scenes with a damper under the platforms: its statics, its limits, and what does not go with it."""

import json
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from pipeline_support import shroud, small_scene, summary_of, write_scene

from pipeline.scene.labels import fixed_values, values_said
from pipeline.scene.reading import read_scene
from rom import read_reduced_model

FLANK_ANGLE, SPEED = 35.0, 3000.0
QUICK: dict[str, Any] = {"stability": "folds", "detached": False, "truncation": False, "search": "off"}


def damped(**changes: dict[str, Any]) -> dict[str, Any]:
    """The small scene with a platform and a damper, which alone touches."""
    scene = small_scene()
    hub = scene["blade"]["hub_radius"]
    found: dict[str, Any] = scene | {
        "platform": {"radius": hub + 0.03, "thickness": 0.008, "flank_angle": FLANK_ANGLE},
        "damper": {"mass": 0.01},
        "load": {"speed_rpm": SPEED, "equilibrium": "linear"},
        "contact": {
            "normal_stiffness": 1e7,
            "tangential_stiffness": 8e6,
            "friction": 0.3,
            "interfaces": ["damper_right", "damper_left"],
        },
        "response": scene["response"] | QUICK | {"harmonics": 1},
    }
    found["mesh"] = found["mesh"] | {"contact_grid": [2, 2]}
    found.pop("sweep", None)
    return {
        name: {**found.get(name, {}), **changes.get(name, {})} if name in changes else found[name] for name in found
    }


def test_mean_normal_forces_bear_the_centrifugal_force(tmp_path: Path) -> None:
    """Without friction W = 2 N cos b, whatever the vibration."""
    tables = damped(contact={"friction": 0.0}, damper={"mass": 0.03, "radius": 0.4})
    status, _, error = shroud(
        "run", write_scene(tmp_path / "scene.toml", tables), "--out", tmp_path / "out", "--quiet"
    )
    assert (status, error) == (0, "")
    summary = summary_of(tmp_path / "out")
    rom = read_reduced_model(tmp_path / "out" / summary["models"][0]["rom"], with_basis=False)
    assert rom.interfaces == {"damper_right": 4, "damper_left": 4}
    with h5py.File(tmp_path / "out" / "response.h5") as file:
        force = file["curve/0/contact_force"][0, 0, :, 2].real
    pull = 0.03 * 0.4 * (2.0 * np.pi * SPEED / 60.0) ** 2
    expected = -pull / (2.0 * np.cos(np.deg2rad(FLANK_ANGLE)))
    assert [force[:4].sum(), force[4:].sum()] == pytest.approx([expected] * 2, rel=1e-4)
    assert all(value > 1.0 for value in summary["models"][0]["free_hz"])  # rigid motions are no natural frequencies


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"platform": {"flank_angle": 0.0}}, "the flanks face the same way"),
        ({"damper": {"mass": -1.0}}, "damper.mass"),
        ({"damper": {"form": "cylinder"}}, "an odd second number"),
        ({"contact": {"interfaces": ["damper_above"]}}, "damper_above"),
        ({"mesh": {"contact_grid": [2, 1]}}, "two rows or more"),
    ],
)
def test_what_does_not_go_with_a_damper_is_one_line(
    tmp_path: Path, changes: dict[str, dict[str, Any]], words: str
) -> None:
    status, _, error = shroud("validate", write_scene(tmp_path / "scene.toml", damped(**changes)))
    assert status == 2
    assert words in error
    assert ", allowed: " in error


@pytest.mark.long
def test_a_ring_with_dampers_without_deviations_is_tuned(tmp_path: Path) -> None:
    changes = {"response": {"frequency": [300.0, 320.0]}, "blade": {"n_blades": 6}, "excitation": {"engine_order": 2}}
    scene = damped(**changes) | {"mistuning": {"frequency": [0.0] * 6, "samples": 1, "linear_samples": 0}}
    path = write_scene(tmp_path / "scene.toml", scene)
    status, _, error = shroud("run", path, "--out", tmp_path / "out", "--until", "study", "--quiet")
    assert (status, error) == (0, "")
    (ring,) = json.loads((tmp_path / "out" / "mistuning.json").read_text())["rings"]
    assert ring["factor"] == pytest.approx(1.0, rel=1e-4)


def test_a_sweep_over_the_mass_reduces_the_blade_once(tmp_path: Path) -> None:
    """What differs is the damper's inertia and centrifugal force."""
    tables = damped(rom={"contact_dofs": "nodal"}) | {"sweep": {"damper.mass": [0.01, 0.04]}}
    where = write_scene(tmp_path / "scene.toml", tables), "--out", tmp_path / "out", "--until", "reduce"
    status, _, error = shroud("run", *where)
    assert (status, error.count("reducing:")) == (0, 1)
    light, heavy = (
        read_reduced_model(tmp_path / "out" / each["rom"], with_basis=False)
        for each in summary_of(tmp_path / "out")["models"]
    )
    assert np.diag(heavy.mass - light.mass)[-6:-3] == pytest.approx([0.03] * 3)
    assert not (heavy.mass - light.mass)[:-6].any()
    assert np.array_equal(light.stiffness, heavy.stiffness)
    assert heavy.force_centrifugal[-4] == pytest.approx(4.0 * light.force_centrifugal[-4])
    # the flanks mirror each other in the plane midway between the blades, with the normals out of the blades
    middle = np.array([0.0, np.cos(np.pi / light.n_blades), -np.sin(np.pi / light.n_blades)])
    frames = np.split(light.contact_frame, 2)
    assert frames[1] == pytest.approx(frames[0] - 2.0 * np.outer(frames[0] @ middle, middle).reshape(4, 3, 3))
    assert frames[0][:, 2] @ middle == pytest.approx(np.sin(np.deg2rad(FLANK_ANGLE)))


STUDIES: dict[str, Any] = {
    "optimum": {"over": {"damper.mass": [0.001, 0.1], "platform.flank_angle": [30.0, 50.0]}},
    "uncertainty": {
        "samples": 16,
        "parameter": [{"key": "damper.mass", "distribution": "normal", "relative_deviation": 0.1}],
    },
    "map": {"over": {"damper.mass": [0.001, 0.1], "contact.friction": [0.1, 0.5]}, "values": 3},
}


def test_studies_over_the_mass_of_a_damper(tmp_path: Path) -> None:
    tables = damped() | STUDIES
    assert shroud("validate", write_scene(tmp_path / "scene.toml", tables))[0] == 0
    del tables["damper"]
    tables["contact"].pop("interfaces")
    status, _, error = shroud("validate", write_scene(tmp_path / "scene.toml", tables))
    assert (status, error.count("the scene has no [damper], allowed: ")) == (2, 3)


def test_a_damper_needs_a_platform(tmp_path: Path) -> None:
    tables = damped()
    del tables["platform"]
    status, _, error = shroud("validate", write_scene(tmp_path / "scene.toml", tables))
    assert (status, error.count("\n")) == (2, 1)
    assert "platform: missing, allowed: a table [platform]" in error


def test_a_shroud_that_does_not_touch_is_not_said() -> None:
    scene = read_scene(Path(__file__).parents[2] / "scenes" / "damper.toml").first
    assert values_said(fixed_values(scene, ["damper.mass"])) == "EO 12, 1 N at the tip, 3000 rev/min, friction 0.3"
