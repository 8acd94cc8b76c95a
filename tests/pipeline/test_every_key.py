"""Every key of a scene, changed alone in a folder that has results, gives what a fresh folder gives.

A lumped ring for what the response depends on; studies of it and blades with all their parts are `long`.
"""

import copy
import csv
import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pipeline_support import MAIN_BRANCH, ground_model, small_scene, without_stress_pictures

import shroud
from pipeline.results.conclusion import lines_of
from pipeline.scene.dotted_keys import split_key, table_in, with_table
from pipeline.scene.schema import SECTIONS
from rom import ReducedModel

VOLATILE = {"seconds", "stages", "provenance", "table_hash", "curves.csv", "response.csv", "response.h5"}
LUMPED: dict[str, Any] = {
    "name": "ring",
    "load": {"speed_rpm": 10.0},
    "aero": {"family": [{"mode": 1, "offset": [0], "real": [0.0], "imaginary": [-0.02]}]},
    "contact": {"normal_stiffness": 2.0, "tangential_stiffness": 1.5, "friction": 0.5, "interference": 0.1},
    "excitation": {"engine_order": 1, "force": 0.5},
    "response": {"frequency": [0.35, 0.4], "damping_ratio": 0.02, **MAIN_BRANCH},
}


class Keys(dict[str, Any]):
    """Values of several keys, where one alone has no meaning."""


FAMILY = {"mode": 1, "offset": [0], "real": [0.01], "imaginary": [-0.02]}
RING: dict[str, Any] = {  # keys with other values
    "load.speed_rpm": 5.0,
    "aero.scale": 0.5,
    "contact.normal_stiffness": 3.0,
    "contact.friction": 0.2,
    "contact.interference": -10.0,
    "excitation.engine_order": 2,
    "excitation.force": 0.7,
    "response.frequency": [0.3, 0.4],
    "response.damping_ratio": 0.03,
}
MORE_OF_RING: dict[str, Any] = {
    "load.coriolis": False,
    "load.equilibrium": "linear",
    "aero.family": [FAMILY],
    "contact.tangential_stiffness": 1.0,
    "contact.preload": 0.1,
    "contact.law": "cone",
    "contact.integration": "sampled",
    "contact.samples": Keys({"contact.integration": "sampled", "contact.samples": 64}),
    "contact.interfaces": ["shroud"],
    "interface": {"shroud": {"friction": 0.2}},
    "excitation.harmonic": Keys({"excitation.harmonic": [{"order": 2, "amplitude": 0.5}], "response.harmonics": 2}),
    "response.harmonics": 2,
    "response.tolerance": Keys({"response.harmonics": "auto", "response.tolerance": 0.1}),
    "response.rayleigh": Keys({"response.damping_ratio": None, "response.rayleigh": [0.0, 0.02]}),
    "response.method": "static-first",
    "response.stability": "wave",
    "response.residual_tractions": "bounds",
    "response.detached": True,
    "response.truncation": True,
    "response.search": "quick",
    "response.seed": 3,
    "response.effort": 2.0,
    "output": [{"name": "other"}],
    "excitation.order": Keys(
        {"crossings": {"speed": [10.0, 40.0]}, "excitation.order": [{"order": 1, "force": 0.3}, {"order": 2}]}
    ),
    "accuracy": "draft",
    "title": "Another title",
}
LAW = {"key": "contact.friction", "distribution": "normal", "relative_deviation": 0.1}
STIFFNESS = {**LAW, "key": "contact.tangential_stiffness"}
PEAK = {"frequency": 0.368, "amplitude": 0.68}
STUDIES: dict[str, dict[str, Any]] = {
    "optimum": {
        "over": {"contact.interference": [0.0, 0.4]},
        "objective": "harmonic_1",
        "output": Keys({"output": [{"name": "other"}], "optimum.output": "other"}),
        "life": Keys(
            {
                "wear.coefficient": 1e-11,
                "wear.area": 1e-4,
                "wear.hours": 1.0,
                "wear.responses": 2,
                "optimum.objective": "life",
                "optimum.life": 0.5,
            }
        ),
        "tolerance": {"contact.interference": 0.02},
        "quantile": Keys(
            {
                "uncertainty.parameter": [
                    {"key": "contact.friction", "distribution": "normal", "relative_deviation": 0.1}
                ],
                "uncertainty.samples": 16,
                "optimum.tolerance": "uncertainty",
                "optimum.quantile": 0.8,
            }
        ),
    },
    "map": {
        "over": {"contact.interference": [0.0, 0.4], "contact.friction": [0.2, 0.6]},
        "values": [3, 4],
        "logarithmic": ["contact.friction"],
        "refine": 1,
        "tolerance": Keys({"map.refine": 1, "map.tolerance": 0.2}),
    },
    "backbone": {
        "modes": [2],
        "nodal_diameters": [2],
        "amplitudes": [0.01, 0.2],
        "curves": [0],
        "damping": "all_harmonics",
        "tolerance": 0.5,
    },
    "flutter": {
        "mode": 2,
        "nodal_diameters": [1],
        "harmonics": 3,
        "reach": 10.0,
        "curves": [0],
        "periods": 30,
        "disturbance": Keys({"flutter.periods": 30, "flutter.disturbance": 0.1}),
        "in_time": Keys({"flutter.periods": 30, "flutter.in_time": [0]}),
    },
    "run_up": {
        "rate": [0.02],
        "speed_rate": Keys({"run_up.rate": None, "run_up.speed_rate": [0.5], "excitation.engine_order": 2}),
        "direction": "up",
        "frequency": [0.12, 0.2],
        "output": Keys({"output": [{"name": "other"}], "run_up.output": "other"}),
        "probes": {"angles": [10.0, 100.0, 220.0], "radius": 1.0, "noise": 1e-6},
        "curves": [0],
    },
    "identify": {
        "over": {"contact.friction": [0.3, 0.6]},
        "measured": [{**PEAK, "amplitude": 0.7}],
        "amplitude_deviation": 0.1,
        "frequency_deviation": 0.01,
        "scouts": 5,
        "candidates": {"excitation": {"force": [0.6]}},
    },
    "crossings": {
        "speed": [12.0, 42.0],
        "steady": [20.0],
        "least": 0.3,
        "limit": Keys({"crossings.limit": 0.3, "uncertainty": {"samples": 16, "parameter": [LAW]}}),
        "tolerance": {"contact.friction": 0.1},
    },
    "uncertainty": {
        "correlation": Keys(
            {"uncertainty.parameter": [LAW, STIFFNESS], "uncertainty.correlation": [[1.0, 0.5], [0.5, 1.0]]}
        ),
        "parameter": [{"key": "contact.friction", "distribution": "normal", "relative_deviation": 0.2}],
        "samples": 32,
        "seed": 3,
        "sensitivities": True,
        "limit": 0.4,
    },
    "mistuning": {
        "frequency": [0.0, 0.01, -0.01, 0.02, 0.0, -0.02],
        "frequency_deviation": 0.02,
        "friction_deviation": 0.1,
        "stiffness_deviation": 0.1,
        "interference_deviation": 0.01,
        "samples": 2,
        "linear_samples": 5,
        "seed": 5,
        "harmonics": 3,
        "frequency_range": [0.36, 0.39],
    },
    "wear": {
        "coefficient": 2e-11,
        "hours": 2.0,
        "cycles": Keys({"wear.hours": None, "wear.cycles": 1e3}),
        "duty": [{"share": 1.0, "force": 0.6}],
        "amplitude_limit": 0.5,
        "depth_limit": 1e-9,
        "responses": 3,
        "samples": Keys(
            {
                "wear.amplitude_limit": 0.5,
                "wear.samples": 16,
                "wear.coefficient_factor": 2.0,
            }
        ),
        "coefficient_factor": Keys(
            {
                "wear.amplitude_limit": 0.5,
                "wear.samples": 16,
                "wear.coefficient_factor": 3.0,
            }
        ),
        "seed": Keys(
            {
                "wear.amplitude_limit": 0.5,
                "wear.samples": 16,
                "wear.coefficient_factor": 2.0,
                "wear.seed": 1,
            }
        ),
        "tolerance": 1e-2,
        "area": 2e-4,
    },
}
STUDY_BASES: dict[str, dict[str, Any]] = {
    "optimum": {"over": {"contact.interference": [0.0, 0.3]}},
    "map": {"over": {"contact.interference": [0.0, 0.3], "contact.friction": [0.2, 0.5]}, "values": 3},
    "backbone": {},
    "flutter": {"nodal_diameters": [2]},
    "uncertainty": {"parameter": [LAW], "samples": 16},
    "mistuning": {"samples": 1, "linear_samples": 3},
    "wear": {"coefficient": 1e-11, "hours": 1.0, "responses": 2, "area": 1e-4},
    "run_up": {"rate": [0.01]},
    "identify": {"over": {"contact.friction": [0.2, 0.8]}, "measured": [PEAK], "scouts": 4},
    "crossings": {"speed": [10.0, 40.0]},
}
BLADE = small_scene(contact__integration="exact", contact__samples=1024, response__frequency=[420.0, 470.0])
PARTS: dict[str, dict[str, Any]] = {  # tables that a blade may have beside its own, for which keys follow below
    "snubber": {"radius": 0.36, "thickness": 0.004, "width": 0.01},
    "platform": {"radius": 0.33, "thickness": 0.008, "flank_angle": 35.0},
    "damper": {"mass": 0.01},
    "disk": {"bore_radius": 0.2, "rim_width": 0.05},
    "stress": {},
    "fatigue": {"endurance_limit": 3e8, "tensile_strength": 9e8},
}
WITH: dict[str, tuple[str, ...]] = {"damper": ("platform", "damper"), "fatigue": ("stress", "fatigue")}
HEATED = {"material.expansion": 1e-5, "load.temperature": {"uniform": 400.0}}
HOT = HEATED | {"material.at": [{"temperature": 600.0, "young_modulus": 1.5e11}]}
CUBIC = {"material.shear_modulus": 1e11}
COLD_LIMITS = HEATED | {"fatigue.at": [{"temperature": 500.0, "endurance_limit": 1e8}]}
OF_BLADE: dict[str, dict[str, Any]] = {
    "blade": {
        "n_blades": 71,
        "hub_radius": 0.31,
        "length": 0.14,
        "chord": 0.034,
        "thickness": 0.010,
        "tip_thickness": 0.007,
        "twist": 10.0,
        "section": "lens",
        "root_stagger": 5.0,
        "fillet_radius": 0.002,
        "camber": 10.0,
    },
    "shroud": {
        "angle": 60.0,
        "thickness": 0.006,
        "axial_width": 0.042,
        "contact_length": 0.011,
        "gap": 1e-4,
        "edge_angle": 5.0,
        "fillet_radius": 0.001,
    },
    "material": {
        "young_modulus": 2e11,
        "poisson_ratio": 0.29,
        "density": 7800.0,
        "expansion": 1e-5,
        "shear_modulus": 1e11,
        "stiffness": Keys(
            {
                "material.young_modulus": None,
                "material.poisson_ratio": None,
                "material.stiffness": [2.5e11, 1.5e11, 1e11],
            }
        ),
        **dict.fromkeys(("young_modulus_2", "young_modulus_3"), 150000000000.0),
        **dict.fromkeys(("poisson_ratio_13", "poisson_ratio_23"), 0.2),
        **dict.fromkeys(("shear_modulus_13", "shear_modulus_23"), 90000000000.0),
        **{name: Keys(HEATED | {f"material.{name}": 2e-5}) for name in ("expansion_2", "expansion_3")},
        "temperature": Keys(HOT | {"material.temperature": 100.0}),
        "at": Keys(HOT),
        "mean_from": Keys(HOT | {"material.mean_from": 0.0}),
        "extended": Keys(HOT | {"load.temperature": {"uniform": 900.0}, "material.extended": True}),
        "axes": Keys(CUBIC | {"material.axes": [[0, 1, 1], [1, 0, 0]]}),
        "along": Keys(CUBIC | {"material.along": [1, 1, 1]}),
        "tilt": Keys(CUBIC | {"material.tilt": 10.0}),
        "turn": Keys(CUBIC | {"material.turn": 10.0}),
    },
    "mesh": {"size": 0.011, "element": "hex20", "contact_grid": [3, 2], "grading": 2.0},
    "rom": {
        "modes": "auto",
        "frequency_limit": Keys({"rom.modes": None, "rom.frequency_limit": 3000.0}),
        "contact_dofs": "patch",
        "tolerance": Keys({"rom.modes": "auto", "rom.tolerance": 0.01}),
    },
    "load": {
        "speed_rpm": 3000.0,
        "equilibrium": Keys({"load.speed_rpm": 3000.0, "load.equilibrium": "linear"}),
        "force": [{"at": "tip", "force": 10.0}],
        "pressure": [{"surface": "pressure_side", "pressure": 1e4}],
        "temperature": Keys(HEATED),
        "temperature_factor": Keys(HEATED | {"load.temperature_factor": 0.5}),
    },
    "excitation": {
        "direction": "x",
        "at": [0.0, 0.0, 0.44],
        "load": [{"surface": "pressure_side", "amplitude": 1e3}],
    },
    "snubber": {"radius": 0.37, "thickness": 0.005, "width": 0.012, "angle": 160.0, "gap": 1e-4},
    "platform": {
        "radius": 0.335,
        "thickness": 0.009,
        "flank_angle": 30.0,
        "flank_length": 0.004,
        "width": 0.03,
        "gap": 1e-3,
    },
    "damper": {
        "mass": 0.02,
        "form": Keys({"damper.form": "cylinder", "mesh.contact_grid": [2, 3]}),
        "radius": 0.32,
        "inertia": [1e-6, 1e-6, 1e-6],
        "axial_stiffness": 1e5,
    },
    "disk": {
        "bore_radius": 0.21,
        "rim_width": 0.052,
        "bore_width": 0.06,
        "profile": [[0.25, 0.03]],
        "bore": "free",
        "size": 0.03,
    },
    "crossings": {
        "temperature_factor": Keys(
            HEATED | {"crossings.speed": [4e3, 7e3], "crossings.temperature_factor": [0.0, 1.0]}
        ),
        "margin": Keys(
            {"crossings.speed": [4e3, 7e3], "crossings.margin": 30.0, "fatigue": PARTS["fatigue"]}
            | {"uncertainty": {"samples": 16, "parameter": [LAW]}}
        ),
    },
    "stress": {"curves": "all", "hot_spots": 3, "check": False},
    "fatigue": {"endurance_limit": 2e8, "tensile_strength": 8e8, "yield_strength": 6e8, "factor": 1.5}
    | {"at": Keys(COLD_LIMITS), "temperature": Keys(COLD_LIMITS | {"fatigue.temperature": 300.0})},
}


def ring() -> ReducedModel:
    """Six blades of three masses that touch their neighbours, with all that a reduced model may have."""
    turn = np.kron(np.eye(4), np.array([[0.0, -0.2, 0.0], [0.2, 0.0, 0.0], [0.0, 0.0, 0.0]]))
    select, other = np.eye(12), np.zeros(12)
    other[10] = 1.0
    model = ground_model(
        contact_right=select[:3],
        contact_left=select[3:6],
        contact_position=np.zeros((1, 3)),
        force_centrifugal=0.05 * np.ones(12),
        coriolis=turn,
        n_blades=6,
    )
    return ReducedModel(**{**vars(model), "outputs": {**model.outputs, "other": other}})


def changed(scene: Mapping[str, Any], key: str, value: Any) -> dict[str, Any]:
    """The scene with another value of a dotted key; None removes it."""
    scene = copy.deepcopy(dict(scene))
    for each, item in value.items() if isinstance(value, Keys) else ((key, value),):
        table, name = split_key(each)
        values = {**((table_in(scene, table) or {}) if table else scene), name: item}
        values = {name: inner for name, inner in values.items() if inner is not None}
        scene = with_table(scene, table, values) if table else values
    return scene


def answer(folder: Path) -> dict[str, Any]:
    """All that a run left but times, hashes of stages, and pictures."""
    summary = json.loads((folder / "summary.json").read_text())
    files: dict[str, Any] = {"said": lines_of(summary)}
    for path in sorted(folder.glob("*.csv")):
        files[path.stem] = stable(list(csv.DictReader(path.read_text().splitlines())))
    for path in sorted(folder.glob("*.json")):
        files[path.stem] = stable(json.loads(path.read_text()))
    return files


def stable(value: Any) -> Any:
    if isinstance(value, dict):
        return {name: stable(item) for name, item in value.items() if name not in VOLATILE}
    return [stable(item) for item in value] if isinstance(value, list) else value


def differences(one: Any, other: Any, place: str = "") -> Iterator[str]:
    """Places where two answers differ by more than the last digits."""
    if isinstance(one, dict) and isinstance(other, dict):
        for name in one.keys() | other.keys():
            yield from differences(one.get(name), other.get(name), f"{place}.{name}")
    elif isinstance(one, list) and isinstance(other, list) and len(one) == len(other):
        for number, pair in enumerate(zip(one, other, strict=True)):
            yield from differences(*pair, f"{place}[{number}]")
    elif one != other and not close(one, other):
        yield f"{place}: {one!r} and {other!r}"


def close(one: Any, other: Any) -> bool:
    try:
        return bool(np.isclose(float(one), float(other), rtol=1e-6, atol=1e-12))
    except (TypeError, ValueError):
        return False


def check_key(folder: Path, base: Mapping[str, Any], key: str, value: Any, **given: Any) -> None:
    """The base has been run in `folder / "kept"`."""
    scene = changed(base, key, value)
    for name in ("kept", "fresh"):
        shroud.run_scene(scene, folder / name, quiet=True, **given)
    found = list(differences(answer(folder / "kept"), answer(folder / "fresh")))
    assert not found, found[:5]


@pytest.fixture(scope="module")
def ring_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("ring")
    shroud.run_scene(LUMPED, folder / "kept", rom=ring(), until="study", quiet=True)
    return folder


@pytest.mark.parametrize("key", RING)
def test_a_changed_key_of_a_ring(ring_folder: Path, key: str) -> None:
    check_key(ring_folder, LUMPED, key, RING[key], rom=ring(), until="study")


@pytest.mark.long
@pytest.mark.parametrize("key", MORE_OF_RING)
def test_further_keys_of_a_ring(ring_folder: Path, key: str) -> None:
    check_key(ring_folder, LUMPED, key, MORE_OF_RING[key], rom=ring(), until="study")


@pytest.mark.long
@pytest.mark.parametrize("study", STUDIES)
def test_changed_keys_of_studies(tmp_path: Path, study: str) -> None:
    base = {**LUMPED, study: STUDY_BASES[study]}
    shroud.run_scene(base, tmp_path / "kept", rom=ring(), until="study", quiet=True)
    for key, value in STUDIES[study].items():
        check_key(tmp_path, base, f"{study}.{key}", value, rom=ring(), until="study")


@pytest.mark.long
@pytest.mark.parametrize("section", OF_BLADE)
def test_changed_keys_of_blades(tmp_path: Path, section: str) -> None:
    base = {**BLADE, **{part: PARTS[part] for part in WITH.get(section, (section,)) if part in PARTS}}
    until = {"stress": "stresses", "fatigue": "stresses", "crossings": "study"}.get(section, "respond")
    with without_stress_pictures():
        shroud.run_scene(base, tmp_path / "kept", until=until, quiet=True)
        for key, value in OF_BLADE[section].items():
            check_key(tmp_path, base, f"{section}.{key}", value, until=until)


def test_every_key_is_changed_somewhere() -> None:
    """But those of pictures, which are drawn anew by what they show, and of files, which go by their content."""
    tested = {*RING, *MORE_OF_RING}
    tested |= {f"{table}.{key}" for tables in (STUDIES, OF_BLADE) for table, keys in tables.items() for key in keys}
    keys = {f"{table}.{key}" for table, section in SECTIONS.items() for key in section.model_fields}
    untested = {key for key in keys - tested if key.partition(".")[0] not in ("model", "render", "figures")}
    assert untested == {
        *(f"mesh.{key}" for key in ("file", "n_blades", "unit", "axis", "axis_point", "tolerance", "bore")),
        *("mesh.other_faces", "mesh.sets", "mesh.interface", "blade.sections", "identify.data"),
        *("rom.nodal_diameters", "wear.margin_limit"),
    }
