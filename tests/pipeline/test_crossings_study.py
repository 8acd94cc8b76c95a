"""The study `crossings`: a friction damper in closed form, single runs, reuse, stops, figure, careless values."""

import csv
import json
import signal
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from map_support import FORCE, KT, one_mass, peak
from pipeline_support import MAIN_BRANCH, overlapping_texts, shroud, small_scene, write_scene

from pipeline import run_scene
from pipeline.codec import restored
from pipeline.process.progress import Reporter
from pipeline.scene.reading import read_scene
from pipeline.stages.request import Request
from pipeline.studies.crossings.figure import crossings_figure
from pipeline.studies.crossings.result import CrossingsResult
from pipeline.study_reply import find_crossings
from rom import ReducedModel, write_reduced_model

ORDERS = [{"order": 4}, {"order": 6, "scale": 0.5}, {"order": 9, "force": 0.0}]


def result_of(folder: Path) -> CrossingsResult:
    values = json.loads((folder / "crossings.json").read_text())
    found: CrossingsResult = restored(
        CrossingsResult, {name: item for name, item in values.items() if name not in ("study", "curve_key")}
    )
    return found


def mass_scene(orders: list[dict[str, Any]], **section: Any) -> dict[str, Any]:
    """One mass with a friction damper against the ground."""
    return {
        "name": "one_mass",
        "contact": {"normal_stiffness": 0.0, "tangential_stiffness": KT, "friction": 0.3, "preload": 20.0},
        "excitation": {"engine_order": 1, "force": FORCE, "order": orders},
        "response": {"frequency": [0.1, 0.3], "damping_ratio": 0.01, "harmonics": 1, **MAIN_BRANCH},
        "crossings": {"speed": [2.0, 12.0], **section},
    }


@pytest.fixture(scope="module")
def mass(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("mass")
    at_speed = ReducedModel(**{**vars(one_mass(0)), "force_centrifugal": np.zeros(3)})
    write_reduced_model(folder / "mass.h5", at_speed)
    write_reduced_model(folder / "still.h5", one_mass(0))
    return folder


def test_the_rows_of_a_friction_damper_in_closed_form(mass: Path) -> None:
    """Each order meets the mass where 60 f / EO is the speed; its force gives the height."""
    orders = [{"order": 1}, {"order": 2, "force": 3.0}, {"order": 8}]
    path = write_scene(mass / "s.toml", mass_scene(orders, steady=[8.0]))
    status, said, error = shroud("crossings", path, "--rom", mass / "mass.h5", "--out", mass / "out", "--jobs", 1)
    assert status == 0, error
    rows = result_of(mass / "out").rows
    assert [row.engine_order for row in rows] == [1, 2]  # order 8 meets it at 1.2 rev/min
    for row, force in zip(rows, (FORCE, 3.0), strict=True):
        omega, amplitude = peak(0.3 * 20.0, force)
        assert row.worst.worst_amplitude_m == pytest.approx(amplitude, rel=1e-6)
        assert row.speed_rpm == pytest.approx(60.0 * omega / (2.0 * np.pi) / row.engine_order, rel=5e-3)
        assert row.distance == pytest.approx(row.speed_rpm / 8.0 - 1.0)
    table = list(csv.DictReader((mass / "out" / "crossings.csv").read_text().splitlines()))
    assert [float(line["worst_amplitude_m"]) for line in table] == [row.worst.worst_amplitude_m for row in rows]
    assert "checked by" in said


def test_what_the_rows_have_of_their_own_is_not_told_as_swept(mass: Path, tmp_path: Path) -> None:
    scene = {**mass_scene([{"order": 1}]), "sweep": {"excitation.engine_order": [2, 3], "contact.friction": [0.3]}}
    path = write_scene(tmp_path / "s.toml", scene)
    status, _, error = shroud("crossings", path, "--rom", mass / "mass.h5", "--out", tmp_path / "out", "--jobs", 1)
    assert status == 0, error
    assert "note: excitation.engine_order is swept" not in error
    assert "note: contact.friction is swept" in error


@pytest.fixture(scope="module")
def blade(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A small blade whose frequencies rise with the speed, and its report."""
    folder = tmp_path_factory.mktemp("blade")
    scene = small_scene(
        excitation__order=ORDERS[:1], crossings={"speed": [1000.0, 6000.0]}, response__frequency=[300.0, 320.0]
    )
    status, _, error = shroud(
        "run", write_scene(folder / "s.toml", scene), "--out", folder / "out", "--until", "report"
    )
    assert status == 0, error
    return folder


def test_a_row_is_its_single_run_to_the_digit(blade: Path, tmp_path: Path) -> None:
    (row,) = result_of(blade / "out").rows
    scene = small_scene(response__frequency=[300.0, 320.0])
    for key, value in row.parameters.items():
        section, _, name = key.partition(".")
        scene[section][name] = value
    (curve,) = run_scene(scene, tmp_path / "single", quiet=True).summary["curves"]
    assert curve["worst_amplitude_m"] == row.worst.worst_amplitude_m
    assert curve["worst_frequency_hz"] == row.worst.worst_frequency_hz
    assert curve["static_lowest_m"] == row.overlap_m[0]
    assert abs(row.frequency_error) <= 5e-3


def test_one_order_more_computes_that_one(blade: Path) -> None:
    scene = small_scene(
        excitation__order=ORDERS, crossings={"speed": [1000.0, 6000.0]}, response__frequency=[300.0, 320.0]
    )
    (first,) = result_of(blade / "out").rows
    path = write_scene(blade / "more.toml", scene)
    status, _, error = shroud("crossings", path, "--out", blade / "out")
    assert status == 0, error
    solved = [line for line in error.splitlines() if "peak" in line]
    assert solved
    assert all("EO 6" in line for line in solved)
    rows = result_of(blade / "out").rows
    assert [row.engine_order for row in rows] == [4, 6]  # of order 9 the force is 0
    assert rows[0] == first
    assert rows[1].parameters["excitation.force"] == 0.1
    again = shroud("crossings", path, "--out", blade / "out")[2]
    assert "reducing" not in again
    assert "peak" not in again


def test_figure_and_page_show_the_crossings(blade: Path) -> None:
    figure = crossings_figure(result_of(blade / "out"), "title")
    assert figure is not None
    assert overlapping_texts(figure) == []
    assert (blade / "out" / "figures" / "crossings.png").is_file()
    text = (blade / "out" / "report.html").read_text(encoding="utf-8")
    assert "Resonance crossings" in text
    assert "checked by" in text


LAWS = [
    {"key": "contact.friction", "distribution": "normal", "relative_deviation": 0.1},
    {"key": "contact.preload", "distribution": "lognormal", "factor": 1.2},
    {"key": "excitation.force", "distribution": "uniform", "low": 0.8, "high": 1.3},
]


@pytest.fixture(scope="module")
def height() -> Callable[[Any], Any]:
    """Amplitude over the force of a friction damper, of its friction limit over the force."""
    limits = np.geomspace(0.3, 40.0, 1500)
    heights = np.array([peak(limit)[1] for limit in limits])
    return lambda limit: np.interp(limit, limits, heights)


@pytest.mark.parametrize("limit", [22.0, pytest.param(33.0, marks=pytest.mark.long)])
def test_the_probability_of_a_friction_damper_by_100000_samples(
    mass: Path, height: Callable[[Any], Any], limit: float
) -> None:
    """The force of an order varies as that of the scene."""
    draw = np.random.default_rng(1)
    friction = 0.3 * (1.0 + 0.1 * draw.standard_normal(100_000))
    preload = 20.0 * np.exp(np.log(1.2) * draw.standard_normal(100_000))
    force = 2.0 * draw.uniform(0.8, 1.3, 100_000)
    exact = float(np.mean(force * height(friction * preload / force) > limit))
    scene = mass_scene([{"order": 2, "scale": 2.0}], limit=limit, tolerance={"contact.friction": 0.05})
    scene |= {"uncertainty": {"samples": 16, "parameter": LAWS}}
    reply = run_scene(scene, mass / "drawn", rom=mass / "mass.h5", until="study", quiet=True)
    (row,) = result_of(mass / "drawn").rows
    assert row.scatter is not None, reply
    found = row.scatter.exceedance
    assert found is not None, row.remarks
    error = 3.0 * np.sqrt(exact * (1.0 - exact) / 1e5)
    assert found.low - error <= exact <= found.high + error
    assert found.high - found.low < 0.005
    assert found.curves == 8
    assert found.curve_error < 1e-4
    ends = [2.0 * height(0.5 * 20.0 * mu) for mu in (0.25, 0.3, 0.35)]
    assert row.scatter.tolerance == pytest.approx((min(ends) / ends[1] - 1.0, max(ends) / ends[1] - 1.0), abs=2e-3)


@pytest.mark.long
def test_the_probability_of_a_blade_by_whole_runs(tmp_path: Path) -> None:
    """With a kink of the height where contacts begin to slip: 256 curves of the single run of a row."""
    laws = [
        {"key": "contact.friction", "distribution": "normal", "deviation": 0.05},
        {"key": "contact.interference", "distribution": "normal", "deviation": 1e-6},
    ]
    scene = small_scene(
        contact__integration="exact",
        contact__samples=1024,
        excitation__order=[{"order": 6, "force": 0.1}],
        crossings={"speed": [1000.0, 6000.0], "limit": 7.5e-6},
        uncertainty={"samples": 256, "limit": 7.5e-6, "parameter": laws},
    )
    assert shroud("crossings", write_scene(tmp_path / "s.toml", scene), "--out", tmp_path / "out")[0] == 0
    (row,) = result_of(tmp_path / "out").rows
    del scene["crossings"], scene["excitation"]["order"]
    for key, value in row.parameters.items():
        section, _, name = key.partition(".")
        scene[section][name] = value
    curves = run_scene(scene, tmp_path / "out", until="study", quiet=True).studies["uncertainty"]["exceedance"]
    assert row.scatter is not None
    found = row.scatter.exceedance
    assert found is not None
    assert 0.05 < curves["value"] < 0.95
    assert found.low <= curves["high"]
    assert curves["low"] <= found.high
    assert abs(found.probability - curves["value"]) < 0.05


class StopsAt(Reporter):
    """Receives a signal after a line with some words."""

    words = ""

    def line(self, text: str) -> None:
        if self.words in text:
            self.interrupts.noticed = signal.SIGINT


def test_a_study_that_is_stopped_leaves_its_rows(mass: Path, tmp_path: Path) -> None:
    path = write_scene(mass / "stop.toml", mass_scene([{"order": 1}, {"order": 2, "force": 3.0}]))
    request = Request(read_scene(path, given_model=True), tmp_path, "respond", jobs=1, rom=mass / "mass.h5")
    stopping = StopsAt()
    stopping.words = "round 2"
    reply = find_crossings(request, stopping)
    assert reply.stopped is not None
    found = result_of(tmp_path)
    assert not found.complete
    assert len(found.rows) == 2
    assert "stopped" in "\n".join(reply.lines)
    whole = find_crossings(request, Reporter(quiet=True))
    assert whole.values["complete"] is True


@pytest.mark.parametrize(
    ("excitation", "section", "line"),
    [
        ({}, {"speed": [6.0, 2.0]}, "crossings.speed: [6.0, 2.0], allowed: a list of two numbers, 0 to 1e6, the sec"),
        (
            {},
            {"speed": [2.0, 6.0], "tolerance": {"contact.friction": 0.1}},
            'contact.integration: "sampled", allowed: "exact", with crossings.tolerance',
        ),
        ({}, {}, "crossings.speed: missing, allowed: a list of two numbers, 0 to 1e6"),
        ({}, {"speed": [2.0, 6.0], "steady": [0.0]}, "crossings.steady[0]: 0.0, allowed: a list of at most 20 num"),
        (
            {},
            {"speed": [2.0, 6.0], "temperature_factor": [0.0, 1.0]},
            "crossings.temperature_factor: [0.0, 1.0], allowed: a list of two numbers, 0 to 10, with a table",
        ),
        ({"engine_order": 0}, {"speed": [2.0, 6.0]}, "excitation.engine_order: 0, allowed: 1 or more"),
        (
            {"order": [{"order": 2, "force": 0.0}]},
            {"speed": [2.0, 6.0]},
            "excitation.order: every force is 0, allowed: a force above 0",
        ),
        (
            {"order": [{"order": 2}, {"order": 2}]},
            {"speed": [2.0, 6.0]},
            "excitation.order: [{'order': 2}, {'order': 2}], allowed: tables [[excitation.order]], each order once",
        ),
        (
            {"order": [{"order": 2, "force": 1.0, "scale": 2.0}]},
            {"speed": [2.0, 6.0]},
            "excitation.order[0].scale: 2.0, allowed: a number, 0 to 1e15 (give this or force)",
        ),
        (
            {"order": [{"order": 0}]},
            {"speed": [2.0, 6.0]},
            "excitation.order[0].order: 0, allowed: a whole number, 1",
        ),
        (
            {"harmonic": [{"order": 2}]},
            {"speed": [2.0, 6.0]},
            "excitation.harmonic: 1 with [crossings], allowed: none",
        ),
    ],
)
def test_careless_values_are_refused(
    tmp_path: Path, excitation: dict[str, Any], section: dict[str, Any], line: str
) -> None:
    scene = small_scene(crossings=section)
    scene["excitation"] |= excitation
    scene["response"]["harmonics"] = 2
    status, _, error = shroud("validate", write_scene(tmp_path / "s.toml", scene))
    assert status == 2
    assert line in error
    assert len(error.splitlines()) == 1


def test_a_model_without_centrifugal_forces_has_no_crossings(mass: Path) -> None:
    path = write_scene(mass / "still.toml", mass_scene([{"order": 1}]))
    status, _, error = shroud("crossings", path, "--rom", mass / "still.h5", "--out", mass / "still")
    assert status == 1
    assert "crossings: force/centrifugal: missing, but load.speed_rpm is not 0" in error


def test_the_command_needs_the_table(tmp_path: Path) -> None:
    status, _, error = shroud("crossings", write_scene(tmp_path / "s.toml", small_scene()))
    assert status == 2
    assert "crossings: missing, allowed: a table [crossings] with speed = [LOW, HIGH] in the scene" in error
