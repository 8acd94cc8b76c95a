"""[aero] in a scene: damping of the waves in `shroud modes`, its numbers and figure, what does not fit."""

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pipeline_support import ground_model, ground_scene, shroud, small_scene, write_scene

from pipeline.errors import InputError
from pipeline.scene.aero_section import AeroFamily
from pipeline.scene.reading import read_scene
from pipeline.stages.curve.curve_file import FLOW, modes_of_curve
from pipeline.stages.scene_to_solver import influence_of
from rom import ReducedModelError, write_reduced_model

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


@pytest.mark.parametrize(
    ("n_blades", "said"),
    [
        (12, "a list of 3, allowed: each wave of 12 blades"),
        (None, "aero: given, allowed: nothing for a single"),
    ],
)
def test_a_reduced_model_from_elsewhere_says_how_many_waves_there_are(
    tmp_path: Path, n_blades: int | None, said: str
) -> None:
    write_reduced_model(tmp_path / "own.h5", replace(ground_model(), n_blades=n_blades))
    family = {"mode": 1, "nodal_diameter": [0, 1, 2], "real": [0.0] * 3, "imaginary": [0.1] * 3}
    path = write_scene(tmp_path / "own.toml", ground_scene() | {"aero": {"family": [family]}})
    status, _, error = shroud("respond", path, "--rom", tmp_path / "own.h5", "--out", tmp_path / "out")
    assert status == 2
    assert said in error
    assert not (tmp_path / "out").exists()


def test_coefficients_from_a_file(tmp_path: Path) -> None:
    (tmp_path / "flow.csv").write_text("offset,real,imaginary\n-1,-0.01,0\n0,0,-0.01\n1,0.01,0\n")
    tables = scene() | {"aero": {"family": [{"mode": 1, "file": "flow.csv"}]}}
    file = read_scene(write_scene(tmp_path / "s.toml", tables))
    assert file.first.aero_inputs() == read_scene(write_scene(tmp_path / "t.toml", scene())).first.aero_inputs()
    for content, said in (
        (
            "offset,real\n0,1\n",
            "columns offset, real, allowed: offset, nodal_diameter or phase_angle; ",
        ),
        ("offset,real,imaginary\n0.5,0,0\n", "offset that is no whole number, allowed: "),
        ("offset,real,imaginary\n0,40,0\n", "a coefficient beyond -1 to 1, allowed: "),
        (
            "place,real\n0,0\n",
            'column "place", allowed: offset, nodal_diameter, speed_rpm, frequency, real, imaginary',
        ),
    ):
        (tmp_path / "flow.csv").write_text(content)
        assert said in shroud("validate", tmp_path / "s.toml")[2]


def table(**changes: Any) -> dict[str, Any]:
    """Coefficients at two speeds and two frequencies that depend linearly on both."""
    rows = [(place, speed, hertz) for speed in (0.0, 1000.0) for hertz in (100.0, 2000.0) for place in (-1, 0, 1)]
    real = [1e-3 * place * (1.0 + speed / 1000.0 + hertz / 1000.0) for place, speed, hertz in rows]
    names = dict(zip(("offset", "speed_rpm", "frequency"), map(list, zip(*rows, strict=True)), strict=True))
    return {"mode": 1, **names, "real": real, "imaginary": [-1e-2] * len(rows), **changes}


@pytest.mark.parametrize(("name", "factor"), [("damping_ratio", 1.0), ("log_decrement", 2.0 * math.pi)])
def test_damping_by_phase_angle_is_that_of_the_waves(tmp_path: Path, name: str, factor: float) -> None:
    """As flow solvers give it: forward angles above 0, damping above 0; n = -angle N_b / 360, Im C = -2 zeta."""
    file, count = tmp_path / "flow.csv", 72
    angles = [360.0 * k / count for k in range(-count // 2, count // 2)]
    zeta = {angle: 0.002 + 0.003 * math.sin(math.radians(angle)) for angle in angles}  # backward waves grow
    rows = "".join(f"{angle:.4f},{factor * zeta[angle]!r}\n" for angle in angles)
    file.write_text(f"phase_angle,{name}\n{rows}")
    family = AeroFamily(mode=1, file=str(file)).read()
    found = dict(zip(family.places, family.imaginary, strict=True))
    for angle in angles[1:]:
        assert found[round(-angle * count / 360.0)] == pytest.approx(-2.0 * zeta[angle], abs=1e-15)
    assert family.real == (0.0,) * count
    assert found[18] > 0.0 > found[-18]
    both = "-180,0.1\n-90,0.2\n0,0.3\n90,0.4\n179.9999,"  # one wave, as a closed curve of a flow solver has it
    file.write_text(f"phase_angle,{name}\n{both}0.1\n")
    assert sorted(AeroFamily(mode=1, file=str(file)).read().places) == [-2, -1, 0, 1]
    file.write_text(f"phase_angle,{name}\n{both}0.2\n")
    with pytest.raises(InputError, match=r"phase_angle -180 and 180 with different values, allowed: each wave once"):
        AeroFamily(mode=1, file=str(file)).read()
    file.write_text(f"phase_angle,{name}\n0,0.1\n100,0.1\n")
    with pytest.raises(InputError, match="phase_angle 100, allowed: multiples of 360/2 degrees"):
        AeroFamily(mode=1, file=str(file)).read()
    file.write_text(f"phase_angle,{name},imaginary\n0,0.1,0.1\n")
    with pytest.raises(InputError, match="one of imaginary, damping_ratio and log_decrement"):
        AeroFamily(mode=1, file=str(file)).read()


def test_a_table_is_linear_between_its_speeds_and_frequencies(tmp_path: Path) -> None:
    tables = scene() | {"aero": {"family": [table()]}}
    tables["load"] = {"speed_rpm": 250.0}
    family = read_scene(write_scene(tmp_path / "s.toml", tables)).first.aero_families()[0]
    flow = influence_of(family, N, 250.0)
    for hertz in (100.0, 333.0, 2000.0):
        expected = 1e-3 * np.array([-1.0, 0.0, 1.0]) * (1.25 + hertz / 1000.0) - 1e-2j
        assert flow.at(2.0 * np.pi * hertz) == pytest.approx(expected, rel=1e-12)
    with pytest.raises(ReducedModelError, match=r"mode 1 at 99 Hz, allowed: 100 to 2000 Hz"):
        flow.at(2.0 * np.pi * 99.0)


@pytest.mark.parametrize(
    ("family", "said"),
    [
        (
            table(offset=[-1, 0, 0] * 4),
            "aero.family[0].offset: a table of 12 rows, allowed: each of 12 places once, at",
        ),
        (
            table(speed_rpm=[500.0] * 6 + [1000.0] * 6),
            "speed_rpm: 500 to 1000, allowed: speeds on both sides of load",
        ),
        (
            table(frequency=[100.0]),
            "aero.family[0].frequency: a list of 1, allowed: a list of 12 numbers, one for each",
        ),
    ],
)
def test_a_table_that_does_not_fit_is_said_in_a_line(tmp_path: Path, family: dict[str, Any], said: str) -> None:
    path = write_scene(tmp_path / "s.toml", scene() | {"aero": {"family": [family]}})
    status, _, error = shroud("validate", path)
    assert status == 2
    assert said in error


def test_a_frequency_beyond_the_table_is_said_in_a_line(tmp_path: Path) -> None:
    family = table(frequency=[2000.0 if hertz > 500.0 else 1000.0 for hertz in table()["frequency"]])
    path = write_scene(tmp_path / "s.toml", scene() | {"aero": {"family": [family]}})
    status, _, error = shroud("modes", path, "--out", tmp_path / "out")
    assert status in (1, 2)
    assert "influence coefficients of mode 1 at" in error
    assert "Traceback" not in error


def test_a_curve_has_the_flow_that_it_was_solved_with_at_any_scale(tmp_path: Path) -> None:
    """Coefficients times the factor may be beyond those that a scene may give."""
    tables = scene()
    tables["aero"]["scale"] = 500.0
    solved = read_scene(write_scene(tmp_path / "s.toml", tables)).first
    model = ground_model(n_blades=N)
    attributes = {FLOW: json.dumps(solved.aero_inputs()), "response.damping_ratio": 0.01, "load.speed_rpm": 0.0}
    (flow,) = modes_of_curve(model, attributes).influence
    assert flow.coefficient == pytest.approx(500.0 * np.array([-0.01, -0.01j, 0.01]))
