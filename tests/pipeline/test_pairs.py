"""Every two features of a scene together: computed, with the effect that the second one has, or refused in one line.

A lumped ring for what needs no mesh; with studies, and on small blades, `long`. The refused ones stand in
`docs/limits.md`.
"""

import json
import math
import re
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pipeline_support import shroud as command
from pipeline_support import small_scene, without_stress_pictures, write_scene
from test_every_key import LUMPED, STUDY_BASES, Keys, changed, ring

import shroud
from pipeline import InputError
from rom import ContactInterface, ReducedModel, with_interfaces

STILL = changed(LUMPED, "", Keys({"load": {"speed_rpm": 0.0}, "aero": None}))
STILL["contact"] = {"normal_stiffness": 2.0, "tangential_stiffness": 1.5, "friction": 0.5, "interference": 0.5}
FEATURES: dict[str, Keys] = {  # of a lumped ring
    "second interface": Keys({"interface": {"second": {"friction": 0.1}}}),
    "speed": Keys({"load.speed_rpm": 10.0, "load.coriolis": False}),
    "Coriolis forces": Keys({"load.speed_rpm": 10.0, "load.coriolis": True}),
    "flow": Keys({"aero": {"family": [{"mode": 4, "offset": [0], "real": [0.0], "imaginary": [-0.05]}]}}),
    "cone": Keys({"contact.law": "cone"}),
    "two orders": Keys({"excitation.harmonic": [{"order": 2, "amplitude": 0.5}], "response.harmonics": 2}),
    "static-first": Keys({"response.method": "static-first"}),
    "bounds": Keys({"response.residual_tractions": "bounds"}),
}
STUDIES = {name: Keys({name: base}) for name, base in STUDY_BASES.items()}
STUDIES["mistuning"]["mistuning"] = {"samples": 1, "linear_samples": 2, "harmonics": 2}
REFUSED = {  # pairs with what the line says
    ("bounds", "static-first"): 'response.residual_tractions: "bounds", allowed: "projected"',
    ("static-first", "backbone"): "response.method",
    ("static-first", "flutter"): "response.method",
    ("static-first", "mistuning"): "response.method",
    ("static-first", "wear"): "response.method",
    ("static-first", "run_up"): "response.method",
    ("static-first", "identify"): "response.method",
    ("two orders", "crossings"): "excitation.harmonic: 1 with [crossings]",
}
ALONE = {  # features that need another one, which the pair lacks
    **{(name, "flutter"): "flutter: given without [aero]" for name in FEATURES if name != "flow"},
}
WITHOUT_EFFECT = {  # a feature that the other one contains, or that changes nothing of a peak
    ("Coriolis forces", "speed"),
}
BLADE = small_scene(
    mesh__size=0.012,
    mesh__contact_grid=[2, 2],
    contact__integration="exact",
    contact__samples=1024,
    response__frequency=[420.0, 470.0],
    blade__n_blades=24,
    excitation__engine_order=6,
)
OF_MESH: dict[str, Keys] = {
    "damper": Keys(
        {
            "platform": {"radius": 0.33, "thickness": 0.008, "flank_angle": 35.0},
            "damper": {"mass": 0.01},
            "interface": {"damper": {"normal_stiffness": 1e7, "tangential_stiffness": 8e6, "interference": 0.0}},
            "load.speed_rpm": 3000.0,
        }
    ),
    "disk": Keys({"disk": {"bore_radius": 0.2, "rim_width": 0.05}}),
    "stress": Keys({"stress": {}, "fatigue": {"endurance_limit": 3e8, "tensile_strength": 9e8}}),
}
ON_BLADE = {
    "speed": Keys({"load.speed_rpm": 4000.0, "load.coriolis": False}),
    "Coriolis forces": Keys({"load.speed_rpm": 4000.0}),
    "flow": Keys({"aero": {"family": [{"mode": 1, "offset": [0], "real": [0.0], "imaginary": [-0.05]}]}}),
    "gas pressure": Keys({"load.pressure": [{"surface": "pressure_side", "pressure": 2e4}]}),
    "cone": FEATURES["cone"],
    "two orders": FEATURES["two orders"],
    "static-first": FEATURES["static-first"],
    "bounds": FEATURES["bounds"],
    "backbone": STUDIES["backbone"],
    "mistuning": STUDIES["mistuning"],
    **OF_MESH,
}


def together(base: dict[str, Any], *features: Keys) -> dict[str, Any]:
    for feature in features:
        base = changed(base, "", feature)
    return base


def two_interfaces() -> ReducedModel:
    """The ring of `test_every_key`, whose blades touch at a second place too."""
    model, select = ring(), np.eye(12)
    second = ContactInterface(select[6:9], np.ones((1, 3)), select[3:6], name="second")
    first = ContactInterface(model.contact_right, model.contact_position, model.contact_left, name="shroud")
    return with_interfaces(model, first, second)


def solved(folder: Path, scene: dict[str, Any], rom: ReducedModel | None, until: str = "study") -> dict[str, Any]:
    shroud.run_scene(scene, folder, rom=rom, until=until, quiet=True)
    with open(folder / "summary.json") as file:
        summary: dict[str, Any] = json.load(file)
    assert summary["problems"] == []
    curve = summary["curves"][0]
    assert curve["complete"], curve["reason"]
    assert all(math.isfinite(curve[key]) for key in ("peak_amplitude_m", "peak_frequency_hz"))
    return summary


def peak(summary: dict[str, Any]) -> tuple[float, float]:
    return summary["curves"][0]["peak_amplitude_m"], summary["curves"][0]["peak_frequency_hz"]


def pair_id(pair: tuple[str, str]) -> str:
    return re.sub(r"\W+", "_", " and ".join(pair))


def refusal(pair: tuple[str, str]) -> str | None:
    return next(
        (said for known in (ALONE, REFUSED) for each in (pair, pair[::-1]) if (said := known.get(each))), None
    )


def check_pair(folder: Path, pair: tuple[str, str], features: dict[str, Keys]) -> None:
    """Each of the two changes the peak of the other one, if it changes that of a ring without both."""
    rom = two_interfaces() if "second interface" in pair else ring()
    scene = together(STILL, *(features[name] for name in pair))
    if (said := refusal(pair)) is not None:
        with pytest.raises(InputError, match=re.escape(said)):
            solved(folder / "both", scene, rom)
        return
    both = peak(solved(folder / "both", scene, rom))
    for name, other in (pair, pair[::-1]):
        if name in STUDIES or other in STUDIES or tuple(sorted(pair)) in WITHOUT_EFFECT:
            continue
        alone = peak(solved(folder / other, together(STILL, features[other]), rom))
        without = peak(solved(folder / "neither", STILL, rom))
        with_it = peak(solved(folder / name, together(STILL, features[name]), rom))
        if with_it != pytest.approx(without, rel=1e-4):
            assert both != pytest.approx(alone, rel=1e-6), f"{name} has no effect beside {other}"


@pytest.mark.parametrize("pair", list(combinations(FEATURES, 2)), ids=pair_id)
def test_two_features_of_a_ring(tmp_path_factory: pytest.TempPathFactory, pair: tuple[str, str]) -> None:
    check_pair(
        tmp_path_factory.getbasetemp() / "pairs" / ("two" if "second interface" in pair else "one"), pair, FEATURES
    )


@pytest.mark.long
@pytest.mark.parametrize("study", STUDIES)
def test_a_study_with_each_feature_of_a_ring(tmp_path: Path, study: str) -> None:
    """Its base values are those of the curve, which the feature changes; flutter needs a flow."""
    for name in FEATURES:
        check_pair(tmp_path / pair_id((name, study)), (name, study), {**FEATURES, **STUDIES})
        if refusal((name, study)) is None:
            assert (tmp_path / pair_id((name, study)) / "both" / f"{study}.json").is_file()


@pytest.mark.long
@pytest.mark.parametrize("feature", OF_MESH)
def test_a_feature_of_a_mesh_with_each_other(tmp_path: Path, feature: str) -> None:
    until = "stresses" if feature == "stress" else "study"
    for name, other in ON_BLADE.items():
        if name == feature:
            continue
        scene = together(BLADE, OF_MESH[feature], other)
        status, _, error = command("validate", write_scene(tmp_path / "s.toml", scene))
        if status == 2:
            assert len(error.splitlines()) == 1, error
            assert refusal((feature, name)) is not None, error
            continue
        with without_stress_pictures():
            summary = solved(tmp_path / pair_id((feature, name)), scene, None, until)
        assert (feature, bool(summary["stress"])) != ("stress", False)


def test_refused_pairs_stand_in_the_documents() -> None:
    text = (Path(__file__).parents[2] / "docs" / "limits.md").read_text()
    rows = re.findall(r"^\| ([^|]+) \| ([^|]+) \| refused:", text, flags=re.MULTILINE)
    assert {tuple(sorted(row)) for row in rows} == {tuple(sorted(pair)) for pair in REFUSED}
