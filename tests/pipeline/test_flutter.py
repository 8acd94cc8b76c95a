"""[aero] in a scene: damping of the waves in `shroud modes`, its numbers and figure, what does not fit."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pipeline_support import shroud, small_scene, write_scene

from pipeline.scene.reading import read_scene

N = 12
FAMILY: dict[str, Any] = {"mode": 1, "offset": [-1, 0, 1], "real": [-0.01, 0.0, 0.01], "imaginary": [0.0, -0.01, 0.0]}


def scene(**family: Any) -> dict[str, Any]:
    tables = small_scene()
    tables["blade"] = tables["blade"] | {"n_blades": N}
    tables["excitation"] = tables["excitation"] | {"engine_order": 3}
    return tables | {"aero": {"family": [FAMILY | family]}}


def test_modes_say_the_damping_of_every_wave(tmp_path: Path) -> None:
    """With free contacts in closed form; the sums for each wave in place of the coefficients are the same."""
    tables = scene()
    psi = 2.0 * np.pi * np.arange(N) / N
    summed: dict[str, Any] = {"mode": 1, "nodal_diameter": list(range(N)), "real": [0.0] * N}
    summed["imaginary"] = (0.02 * np.sin(psi) - 0.01).tolist()
    found = []
    for name, family in (("a", FAMILY), ("b", summed)):
        path = write_scene(tmp_path / f"{name}.toml", tables | {"aero": {"family": [family]}})
        status, text, _ = shroud("modes", path, "--out", tmp_path / name)
        assert status == 0
        assert "flutter margin" in text
        assert (tmp_path / name / "modes" / "flutter.png").is_file()
        values = json.loads((tmp_path / name / "modes" / "modes.json").read_text())
        found.append(values["models"][0]["flutter"])
    one, other = found
    diameters, free = np.array(one["nodal_diameter"]), one["states"][0]
    structural = tables["response"]["damping_ratio"]
    closed = structural + 0.005 - 0.01 * np.sin(2.0 * np.pi * diameters / N)
    assert diameters.tolist() == list(range(-5, 7))
    assert free["damping_ratio"][0] == pytest.approx(closed, abs=1e-4)
    assert np.min(one["states"][2]["damping_ratio"][0]) > np.min(free["damping_ratio"][0])
    for state, same in zip(one["states"], other["states"], strict=True):
        assert same["damping_ratio"] == pytest.approx(np.array(state["damping_ratio"]), abs=1e-10)


@pytest.mark.parametrize(
    ("family", "said"),
    [
        ({"offset": [-1, 0, -1]}, "aero.family[0].offset: [-1, 0, -1], allowed: each of 12 places once"),
        ({"offset": [0, 1, 12]}, "aero.family[0].offset: [0, 1, 12], allowed: each of 12 places once"),
        ({"real": [0.0]}, "aero.family[0].real: a list of 1, allowed: a list of 3 numbers, one for each offset"),
        ({"nodal_diameter": [0]}, "aero.family[0].nodal_diameter: given beside offset, allowed: offset or nodal"),
        ({"file": "a.csv"}, "aero.family[0].file: given beside lists, allowed: a file or lists"),
        ({"mode": 0}, "aero.family[0].mode: 0, allowed: a whole number, 1 to 100"),
        ({"imag": [0.0]}, "aero.family[0].imag: unknown key, did you mean"),
    ],
)
def test_what_does_not_fit_is_said_in_a_line(tmp_path: Path, family: dict[str, Any], said: str) -> None:
    status, _, error = shroud("validate", write_scene(tmp_path / "s.toml", scene(**family)))
    assert status == 2
    assert said in error


def test_waves_that_are_missing_are_said(tmp_path: Path) -> None:
    few = {key: value for key, value in FAMILY.items() if key != "offset"} | {"nodal_diameter": [-1, 0, 1]}
    path = write_scene(tmp_path / "s.toml", scene() | {"aero": {"family": [few]}})
    assert (
        "aero.family[0].nodal_diameter: a list of 3, allowed: each wave of 12 blades once"
        in shroud("validate", path)[2]
    )


def test_coefficients_from_a_file(tmp_path: Path) -> None:
    (tmp_path / "flow.csv").write_text("offset,real,imaginary\n-1,-0.01,0\n0,0,-0.01\n1,0.01,0\n")
    tables = scene() | {"aero": {"family": [{"mode": 1, "file": "flow.csv"}]}}
    file = read_scene(write_scene(tmp_path / "s.toml", tables))
    assert file.first.aero_inputs() == read_scene(write_scene(tmp_path / "t.toml", scene())).first.aero_inputs()
    for content, said in (
        ("offset,real\n0,1\n", "columns offset, real, allowed: columns offset or nodal_diameter, real and imaginary"),
        ("offset,real,imaginary\n0.5,0,0\n", "offset that is no whole number, allowed: "),
        ("offset,real,imaginary\n0,40,0\n", "a coefficient beyond -1 to 1, allowed: "),
        ("place,real\n0,0\n", 'column "place", allowed: offset, nodal_diameter, real, imaginary'),
    ):
        (tmp_path / "flow.csv").write_text(content)
        assert said in shroud("validate", tmp_path / "s.toml")[2]
