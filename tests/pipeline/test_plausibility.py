"""Unusual values: one warning line each, computed all the same."""

import json
import re
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from pipeline_support import ground_scene, shroud, small_scene, statuses, summary_of, write_ground_model, write_scene
from scipy.linalg import eigh

from pipeline import InputError, run_scene
from pipeline.figures.linear_limits import _limit
from pipeline.results.contact_advice import V0, Closing, ContactAdvice
from pipeline.results.frequency_range import (
    Resonance,
    held_said,
    missing,
    missing_warnings,
    resonances_of,
    stored_resonances,
)
from pipeline.scene.plausibility import plausibility_warnings
from pipeline.scene.reading import given_scene, read_scene
from pipeline.stages.cache_keys import model_keys
from pipeline.stages.model.modal_truncation import _immobility
from pipeline.stages.scene_to_solver import contact_on_model
from pipeline.store.content_store import Store
from rom import ReducedModel, write_reduced_model
from rom.reduction.model_comparison import LinearOperation

MILLIMETRES = {
    "blade__length": 150.0,
    "blade__hub_radius": 300.0,
    "blade__chord": 36.0,
    "blade__thickness": 9.0,
    "shroud__thickness": 5.0,
    "shroud__axial_width": 40.0,
    "shroud__contact_length": 12.0,
    "mesh__size": 9.0,
}


# beyond all experience: what is said before "is unusual" with --force, and before "allowed" without
NONSENSE: list[tuple[dict[str, Any], list[str]]] = [
    (
        MILLIMETRES,
        [
            *("blade.hub_radius: 300.0", "blade.length: 150.0", "blade.chord: 36.0", "blade.thickness: 9.0"),
            *("shroud.thickness: 5.0", "shroud.axial_width: 40.0", "shroud.contact_length: 12.0"),
        ],
    ),
    ({"material__young_modulus": 210.0}, ["material.young_modulus: 210.0"]),
    ({"material__density": 7.85e-9}, ["material.density: 7.85e-09"]),
    ({"material__young_modulus": 2.1e8}, ["material.young_modulus: 210000000.0"]),  # kPa: 164 m/s
    ({"contact__friction": 40.0}, ["contact.friction: 40.0"]),
    ({"contact__friction": [0.4, 0.4, 40.0, 0.4]}, ["contact.friction: 40.0"]),
    ({"contact__interference": 70.0}, ["contact.interference: 70.0"]),
    ({"response__frequency": [1e12, 2e12]}, ["response.frequency: 1000000000000.0"]),
    ({"sweep": {"contact.friction": [0.4, 30.0, 40.0]}}, ['sweep."contact.friction": 30.0']),
    # the same units in the tables of what varies a key
    ({"contact__interference": {"mean": 5e-6, "tilt": [3.0, 0.0]}}, ["contact.interference: 3.000005"]),
    ({"optimum": {"over": {"contact.interference": [-20.0, 20.0]}}}, ['optimum.over."contact.interference": -20.0']),
    (
        {"optimum": {"over": {"contact.interference": [0.0, 1e-4]}, "tolerance": {"contact.interference": 2.0}}},
        ['optimum.tolerance."contact.interference": 2.0'],
    ),
    (
        {"map": {"over": {"contact.interference": [0.0, 20.0], "contact.friction": [0.1, 0.5]}}},
        ['map.over."contact.interference": 20.0'],
    ),
    (
        {
            "uncertainty": {
                "parameter": [
                    {"key": "contact.interference", "distribution": "normal", "mean": 5e-6, "deviation": 2.0}
                ]
            }
        },
        ["uncertainty.parameter[0].deviation: 2.0"],
    ),
    ({"fatigue": {"endurance_limit": 250.0, "tensile_strength": 9e8}}, ["fatigue.endurance_limit: 250.0"]),
    (
        {"wear": {"coefficient": 1e-14, "hours": 1e3, "duty": [{"share": 1.0, "force": 1e12}]}},
        ["wear.duty[0].force: 1000000000000.0"],
    ),
]


@pytest.mark.parametrize(("changes", "expected"), NONSENSE)
def test_nonsense_is_computed_with_force_only(tmp_path: Path, changes: dict[str, Any], expected: list[str]) -> None:
    path = write_scene(tmp_path / "s.toml", small_scene(**changes))
    status, _, error = shroud("validate", path)
    assert status == 2
    for line, words in zip(error.splitlines(), expected, strict=True):
        assert re.match(
            rf"{re.escape(str(path))}(:\d+)?: {re.escape(words)}, allowed: .*; to use it anyway: --force ", line
        )
    status, _, error = shroud("validate", path, "--force")
    assert status == 0
    for line, words in zip(error.splitlines(), expected, strict=True):
        assert line.startswith(f"warning: {path}: {words} is unusual; ")


def test_a_run_refuses_nonsense_before_it_writes_anything(tmp_path: Path) -> None:
    path = write_scene(tmp_path / "s.toml", small_scene(contact__friction=40.0))
    status, _, error = shroud("run", path, "--out", tmp_path / "out", "--until", "mesh")
    assert (status, error.count("\n")) == (2, 1)
    assert not (tmp_path / "out").exists()
    with pytest.raises(InputError, match=r"contact\.friction: 40\.0, allowed: 0 to 2; .*force=True"):
        run_scene(path, tmp_path / "out", until="mesh")
    assert run_scene(path, tmp_path / "out", until="mesh", force=True).complete


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"excitation__force": 1e9}, ["excitation.force: 1000000000.0 is unusual; the key is in N"]),
        ({"contact__preload": 1e9}, ["contact.preload: 1000000000.0 is unusual"]),
        (
            {"response__damping_ratio": None, "response__rayleigh": [0.0, 1e-3]},
            ["response.rayleigh: [0.0, 0.001] is unusual; it damps modes of the range by up to 2.2 of critical"],
        ),
        ({"response__damping_ratio": None, "response__rayleigh": [10.0, 2e-6]}, []),
        ({"shroud__angle": 1.22}, ["shroud.angle: 1.22 is unusual; the key is in degrees"]),
        ({"response__damping_ratio": 0.3}, ["response.damping_ratio: 0.3 is unusual; the key is a fraction"]),
        ({"contact__normal_stiffness": 200.0}, ["contact.normal_stiffness: 200.0 is unusual; the key is in N/m"]),
        ({"contact__interference": -0.005}, ["contact.interference: -0.005 is unusual; the key is in metres"]),
        (
            {"contact__friction": 0.0, "contact__normal_stiffness": 0.0, "contact__interference": 0.0},
            ["contact.normal_stiffness: 0 without a preload: the faces pass through each other"],
        ),
        ({"contact__normal_stiffness": 0.0, "contact__preload": 5.0}, []),
        ({"blade__twist": 0.44}, ["blade.twist: 0.44 is unusual; the key is in degrees"]),
        ({"blade__twist": -0.44}, ["blade.twist: -0.44 is unusual; the key is in degrees"]),
        (
            {"load__speed_rpm": 314.0},
            ["load.speed_rpm: 314.0 is unusual; the tip moves at 15 m/s; 314 rad/s are 2998 r"],
        ),
        (
            {"excitation__engine_order": 75},
            ["excitation.engine_order: 75 is above the 72 blades: the wave has 3 nodal"],
        ),
        ({"contact__normal_stiffness": "punch"}, []),
        (
            {"material__young_modulus": 2.1e9},
            ["material.young_modulus: 2100000000.0 is unusual; with density 7850 sqrt(E / rho) is 517 m/s"],
        ),
        ({}, []),
    ],
)
def test_unusual_values_are_reported_and_used(tmp_path: Path, changes: dict[str, Any], expected: list[str]) -> None:
    path = write_scene(tmp_path / "s.toml", small_scene(**changes))
    status, said, error = shroud("validate", path)
    assert status == 0
    assert "valid" in said
    lines = error.splitlines()
    assert len(lines) == len(expected)
    for line, words in zip(lines, expected, strict=True):
        assert line.startswith(f"warning: {path}: {words}")


@pytest.mark.parametrize(
    ("changes", "first", "others"),
    [
        (
            {"blade__length": 15.0},
            "blade.length: 15.0 is unusual, allowed: usually 0.005 to 3; the key is in metres",
            ["mesh.size: 1e-05"],
        ),
        ({"blade__chord": 3.6}, "blade.chord: 3.6, allowed: the section, turned", ["mesh.size: 1e-05"]),
        ({"shroud__axial_width": 4.0}, "shroud.axial_width: 4.0", ["mesh.size: 1e-05"]),
    ],
)
def test_hints_on_units_come_before_other_errors(
    tmp_path: Path, changes: dict[str, Any], first: str, others: list[str]
) -> None:
    """Too many elements is what a wrong unit leads to, and says nothing of it."""
    path = write_scene(tmp_path / "s.toml", small_scene(mesh__size=1e-5, **changes))
    status, _, error = shroud("validate", path)
    lines = [re.sub(r"\.toml:\d+: ", ".toml: ", line).removeprefix(f"{path}: ") for line in error.splitlines()]
    assert status == 2
    assert lines[0].startswith(first)
    assert lines[0].endswith("the key is in metres")
    assert [line[: len(other)] for line, other in zip(lines[1:], others, strict=True)] == others
    status, _, error = shroud("run", path, "--out", tmp_path / "out")
    assert (status, error.count("\n")) == (2, 1)
    assert "the key is in metres" in error


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"frequency": [0.1, 0.9]}, "near 330 Hz: [100.0, 900.0] where kHz are meant"),
        ({"frequency": [0.3, 0.6]}, "near 330 Hz: [300.0, 600.0] where kHz are meant"),
        ({"frequency": [3.0, 9.0]}, "near 330 Hz"),
        ({"frequency": [30.0, 90.0]}, ""),
        ({"frequency": [1.0, 700.0]}, ""),
    ],
)
def test_a_range_in_kilohertz_is_said(tmp_path: Path, changes: dict[str, Any], expected: str) -> None:
    """The first mode of a clamped steel beam of 9 by 150 mm: 3.516 sqrt(E t^2 / (12 rho)) / (2 pi L^2) = 334 Hz."""
    scene = read_scene(write_scene(tmp_path / "s.toml", small_scene(response__frequency=changes["frequency"])))
    found = plausibility_warnings(scene)
    assert len(found) == bool(expected)
    assert all(line.endswith(expected) for line in found), found


@pytest.mark.parametrize(("grid", "minutes"), [([15, 15], 13), ([12, 10], 2), ([9, 9], 0)])
def test_contact_nodes_that_take_long_are_reported(tmp_path: Path, grid: list[int], minutes: int) -> None:
    path = write_scene(tmp_path / "s.toml", small_scene(mesh__contact_grid=grid))
    status, _, error = shroud("validate", path)
    assert status == 0
    said = f"mesh.contact_grid: with {grid[0]} x {grid[1]} contact nodes a curve takes some {minutes} minutes"
    assert (said in error) == (minutes > 0)


NODES, PATCHES = "(nodal): stuck natural frequencies", "(patch): stuck natural frequencies"
ESTIMATE = "too low (an estimate, shroud verify measures it)"
USE_MORTAR = 'set rom.contact_dofs = "mortar"'


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"dofs": "nodal"}, f"{NODES} up to some 20 % {ESTIMATE}; {USE_MORTAR}"),
        ({"dofs": "patch"}, f"{PATCHES} up to some 5 % {ESTIMATE}; {USE_MORTAR}"),
        ({"dofs": "nodal", "kn": 1e7}, USE_MORTAR),
        ({"dofs": "nodal", "kn": 1e6}, None),
        ({}, None),
        ({"kn": 1e7, "grid": [2, 2]}, None),
        ({"kn": 1e7, "grid": [1, 3]}, "set mesh.contact_grid = [3, 3]"),
        ({"kn": 1e10}, f"up to some 6 % {ESTIMATE}; set mesh.contact_grid = [4, 4]"),
        ({"kn": 1e10, "grid": [4, 4]}, None),
        ({"kn": 9e11}, "lower it: the deformation of the blades is in the mesh, and a punch has 1e+09 N/m"),
        ({"dofs": "patch", "kn": [1e9 / 9] * 9}, "1e+09 N/m is stiff for 3 x 3 contact nodes (patch)"),
    ],
)
def test_contacts_too_stiff_for_their_nodes_are_reported(
    tmp_path: Path, changes: dict[str, Any], expected: str | None
) -> None:
    """Measured with a punch stiffness, worst of five modes: nodes 5 to 19 %, patches 1 to 5 %, mortar 0.6 %."""
    kn = changes.get("kn", "punch")
    scene = small_scene(
        mesh__contact_grid=changes.get("grid", [3, 3]),
        rom__contact_dofs=changes.get("dofs", "mortar"),
        contact__normal_stiffness=kn,
        contact__tangential_stiffness="punch" if kn == "punch" else 1e5,
    )
    path = write_scene(tmp_path / "s.toml", scene)
    status, _, error = shroud("validate", path)
    assert status == 0
    if expected is None:
        assert error == ""
        return
    assert error.startswith(f"warning: {path}: contact.normal_stiffness: ")
    assert expected in error
    assert error.count("\n") == 1
    assert plausibility_warnings(read_scene(path)) == [error.removeprefix("warning: ").rstrip("\n")]


@pytest.mark.parametrize("scene", sorted(Path(__file__).parents[2].glob("scenes/*.toml")), ids=lambda path: path.stem)
def test_nothing_is_wrong_with_the_scenes_that_ship(scene: Path) -> None:
    assert plausibility_warnings(read_scene(scene)) == []


def resonances(*rows: tuple[str, int, int, float, float]) -> list[Resonance]:
    return [Resonance(*row) for row in rows]


BLADE = resonances(  # one that the force excites, one that it does not, a third far above, and engine order 12
    ("free", 6, 1, 250.0, 1e-3),
    ("stuck", 6, 1, 821.0, 4e-4),
    ("free", 6, 2, 500.0, 1e-6),
    ("stuck", 6, 2, 700.0, 1e-6),
    ("free", 6, 3, 1500.0, 1e-4),
    ("stuck", 6, 3, 2100.0, 1e-4),
    ("free", 12, 1, 125.0, 5e-4),
    ("stuck", 12, 1, 480.0, 3e-4),
)


@pytest.mark.parametrize(
    ("interference", "limits", "outside"),
    [
        (2e-4, [100.0, 600.0], [821.0]),
        (-2e-4, [100.0, 600.0], []),
        (-2e-4, [200.0, 600.0], [125.0]),
        (0.0, [200.0, 600.0], [821.0, 125.0]),
        ([-1e-6, 1e-6], [300.0, 900.0], [250.0, 125.0]),
        (2e-4, [100.0, 900.0], []),
        (2e-4, [3000.0, 4000.0], [821.0]),
        (-2e-4, [3000.0, 4000.0], [250.0]),
    ],
)
def test_resonances_that_the_range_leaves_out(
    interference: Any, limits: list[float], outside: list[float], tmp_path: Path
) -> None:
    """The designer's range ended at 600 Hz, below the stuck resonance at 821 Hz."""
    scene = small_scene(contact__interference=interference, response__frequency=limits)
    member = read_scene(write_scene(tmp_path / "s.toml", scene)).members[0]
    assert sorted(each.frequency_hz for each in missing(member.scene, BLADE)) == sorted(outside)
    lines = missing_warnings([member], lambda _: BLADE)
    assert len(lines) == bool(outside)
    assert all(f"{hz:.4g} Hz" in lines[0] for hz in outside)
    low, high = min(limits[0], *outside, limits[1]), max(limits[1], *outside, limits[0])
    for line in lines:  # the range proposed holds them, and not much more
        given = [float(word) for word in line.rpartition("[")[2].partition("]")[0].split(", ")]
        assert 0.85 * low <= given[0] <= low
        assert high <= given[1] <= 1.15 * high


def test_validate_knows_the_resonances_of_an_earlier_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    path = write_scene(tmp_path / "s.toml", small_scene(response__frequency=[0.1, 0.18], contact__interference=1e-6))
    assert "leaves out" not in shroud("validate", path)[2]
    scene = read_scene(path).first
    write_reduced_model(tmp_path / "rom.h5", lumped_mass())
    store = Store(tmp_path / "out" / scene.name / "store")
    stored_resonances(store, model_keys(scene).reduce, scene, tmp_path / "rom.h5")
    status, _, error = shroud("validate", path)
    assert status == 0
    assert "warning: response.frequency, 0.1 to 0.18 Hz, leaves out the resonance at " in error


def lumped_mass() -> ReducedModel:
    """A mass of 1 kg on a spring of 1 N/m, in contact with the next blade along t1."""
    one = np.ones(1)
    return ReducedModel(np.eye(1), np.eye(1), np.eye(3, 1), np.zeros((1, 3)), one, {"tip": one}, n_blades=12)


def test_resonances_of_a_lumped_blade_and_a_run_that_says_what_its_range_leaves_out(tmp_path: Path) -> None:
    """A mass of 1 kg on 1 N/m that sticks to 3 N/m: 1 / (2 pi) Hz free, 2 / (2 pi) Hz stuck; A = F / (2 zeta k)."""
    rom = tmp_path / "rom.h5"
    write_reduced_model(rom, lumped_mass())
    contact = {"normal_stiffness": 1.0, "tangential_stiffness": 3.0, "friction": 0.5, "preload": 2.0}
    scene = {"contact": contact, "excitation": {"engine_order": 3, "force": 1.0}, "name": "s"}
    scene["response"] = {"frequency": [0.1, 0.18], "damping_ratio": 0.01}
    path = write_scene(tmp_path / "s.toml", scene)
    found = {each.state: each for each in resonances_of(rom, read_scene(path).first)}
    assert found["free"].frequency_hz == pytest.approx(1.0 / (2.0 * np.pi))
    assert found["stuck"].frequency_hz == pytest.approx(2.0 / (2.0 * np.pi))
    assert found["free"].amplitude_m == pytest.approx(1.0 / 0.02)
    status, out, error = shroud("respond", path, "--rom", rom, "--out", tmp_path / "out")
    assert status == 0
    assert "leaves out the resonance at 0.3183 Hz (stuck, engine order 3)" in error
    assert "[0.1, 0.34] holds it" in error
    assert "end of the range, no peak; may be higher" in out
    (curve,) = summary_of(tmp_path / "out")["curves"]
    assert (curve["peak_at_end"], curve["worst_at_end"], curve["peak_frequency_hz"]) == (True, True, 0.18)


def test_the_linear_limit_has_its_peak_at_the_resonance_not_at_the_end_of_the_range(tmp_path: Path) -> None:
    """The mass of 1 kg on 1 + 3 N/m with c = 0.02 N s/m has 1 / (2 c) at 1 / pi Hz; the range ends before."""
    scene: dict[str, Any] = {"name": "s", "excitation": {"engine_order": 3, "force": 1.0}}
    scene["contact"] = {"normal_stiffness": 1.0, "tangential_stiffness": 3.0, "friction": 0.5, "preload": 2.0}
    scene["response"] = {"frequency": [0.1, 0.2], "damping_ratio": 0.01}
    first = read_scene(write_scene(tmp_path / "s.toml", scene)).first
    curve: Any = SimpleNamespace(scene=first, contact_parameters=contact_on_model(first, lumped_mass()))
    limit = _limit("stuck", lumped_mass(), [curve], [0])
    assert limit.frequency_hz.max() == 0.2
    assert limit.resonance == pytest.approx((1.0 / np.pi, 25.0), rel=1e-3)
    free = _limit("free", lumped_mass(), [curve], [0])
    assert free.resonance == pytest.approx((0.5 / np.pi, 50.0), rel=1e-3)


def test_a_model_without_units_is_taken_as_it_is(tmp_path: Path) -> None:
    """Stiffness and interference of a given model may have any size; friction and damping ratio have no unit."""
    scene = {**ground_scene(friction=3.0), "response": {"frequency": [5.0, 6.0], "rayleigh": [0.0, 0.002]}}
    path, rom = write_scene(tmp_path / "s.toml", scene), write_ground_model(tmp_path / "g.h5")
    status, _, error = shroud("respond", path, "--rom", rom, "--out", tmp_path / "out")
    assert status == 0
    warnings = [line for line in error.splitlines() if line.startswith("warning: ")]
    assert len(warnings) == 2
    assert warnings[0].startswith(f"warning: {path}: contact.friction: 3.0 is unusual")
    stuck = summary_of(tmp_path / "out")["models"][0]["stuck_hz"]["0"][0]  # preloaded contacts
    assert warnings[1] == (
        "warning: response.frequency, 5 to 6 Hz, leaves out the resonance at "
        f"{stuck:.4g} Hz (stuck, engine order 0): peaks may lie outside, and the end of the range is no peak; "
        "[0.2, 6] holds it"
    )
    assert statuses(tmp_path / "out")["respond"] == "ran"
    quiet = shroud("respond", path, "--rom", rom, "--out", tmp_path / "out", "--quiet")
    assert quiet == (0, "", "")


@pytest.mark.parametrize("spring", [10.0, 1e4])
def test_a_point_that_stuck_shrouds_hold_is_no_place_for_the_force(spring: float) -> None:
    """Two masses in a row, the contact at the outer one that is loaded; neighbours in opposition."""
    tip, mass, stiffness = np.array([0.0, 1.0]), np.eye(2), np.array([[2e3, -1e3], [-1e3, 1e3]])
    face = np.stack([0.0 * tip, 0.0 * tip, tip])
    model = ReducedModel(mass, stiffness, face, np.zeros((1, 3)), tip, {"tip": tip}, contact_left=face)
    springs = np.array([spring])
    operation = LinearOperation((1.0, 100.0), np.pi, springs, springs, damping_ratio=1e-3)
    free, stuck = (eigh(stiffness + held * np.outer(tip, tip))[1][1, 0] for held in (0.0, 4.0 * spring))
    found = _immobility(model, operation)
    assert found == pytest.approx((free / stuck) ** 2, rel=0.1)  # springs change the damping ratio
    scene, warning = given_scene(small_scene(), {}).first, held_said(found)
    assert ('surface = "pressure_side"' in warning) == (spring > 1e3)
    lines = ContactAdvice(found, (Closing("shroud", 1e-4, 1.2e-4, False),), {V0: (-2e-5, 3e-4)}).lines(scene)
    assert (warning in lines) == (spring > 1e3)
    assert lines[-2:] == [
        "the contacts of shroud are open at rest: they touch with v0 = 100 µm, and are closed with 120 µm",
        "contact.interference from -20 µm to 300 µm: from contacts that never touch to contacts that always stick",
    ]


def test_modes_and_validate_say_which_interference_closes_the_contacts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """At speed the pitch widens: the static contact with the values that are named is closed, and open below them."""
    monkeypatch.chdir(tmp_path)
    scene = small_scene(contact__interference=0.0, load={"speed_rpm": 6000.0})
    write_scene(tmp_path / "s.toml", scene)
    status, said, _ = shroud("modes", "s.toml", "--json")
    assert status == 0
    (model,) = json.loads(said)["models"]
    assert model["static"][0]["open_share"] > 0.0
    (line,) = [line for line in model["helps"] if "are open at 6000 rev/min" in line]
    parts = line.split("v0 = ")[1], line.split("closed with ")[1]
    touch, close = (float(part.split(" µm")[0]) * 1e-6 for part in parts)
    shares = []
    for v0 in (touch - 1e-6, close + 1e-6):
        write_scene(tmp_path / "t.toml", scene | {"name": "t", "contact": scene["contact"] | {"interference": v0}})
        (other,) = json.loads(shroud("modes", "t.toml", "--json")[1])["models"]
        shares.append(other["static"][0]["open_share"])
    assert shares == [1.0, 0.0]
    assert any("contact.interference from " in each for each in model["helps"])
    assert line in "".join(shroud("validate", "s.toml")[1:])
