"""The study `wear` in a run: its numbers, files, figure, report, restart, and what is refused."""

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from pipeline_support import overlapping_texts, shroud, small_scene, to_toml, write_scene
from scipy.optimize import brentq

from pipeline import run_scene
from pipeline.codec import restored
from pipeline.results.results import Results
from pipeline.scene.reading import derived_member, read_scene
from pipeline.studies.wear.figure import wear_figure
from pipeline.studies.wear.life import Life
from pipeline.studies.wear.report import wear_section
from pipeline.studies.wear.result import WearResult
from rom import ReducedModel, write_reduced_model

COEFFICIENT, AREA = 1e-11, 2e-10
PROJECT = Path(__file__).parents[2]


def rubbing_scene(interference: float | list[float] = 3.0, **section: Any) -> dict[str, Any]:
    """A mass on a spring with a slider, all ones, under the load of its interference."""
    return {
        "name": "rubbing",
        "contact": {
            "normal_stiffness": 1.0,
            "tangential_stiffness": 1.0,
            "friction": 1.0,
            "interference": interference,
        },
        "excitation": {"engine_order": 0, "force": 1.0},
        "response": {
            "frequency": [0.1, 0.25],
            "damping_ratio": 1e-9,
            "harmonics": 1,
            "stability": "folds",
            "truncation": False,
            "detached": False,
        },
        "wear": {"coefficient": COEFFICIENT, "cycles": 3.2, "area": AREA, "responses": 3} | section,
    }


def rubbing_model(path: Path) -> Path:
    """A mass on a spring as a reduced model, with a contact against the ground."""
    one, place = np.ones(1), np.zeros((1, 3))
    write_reduced_model(path, ReducedModel(np.eye(1), np.eye(1), np.eye(3, 1), place, one, {"tip": one}))
    return path


def read_result(out: Path) -> WearResult:
    """The result in an output folder."""
    values = json.loads((out / "wear.json").read_text())
    del values["study"], values["curve_key"]
    found: WearResult = restored(WearResult, values)
    return found


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Results]:
    """A run in which the optimum is passed and limits are reached."""
    folder = tmp_path_factory.mktemp("wear")
    scene = rubbing_scene(amplitude_limit=3.3, depth_limit=1.0)
    return folder, run_scene(scene, folder / "out", rom=rubbing_model(folder / "model.h5"))


def clock(load: float) -> float:
    """Cycles until the load has worn from 3 to a value: ln L + pi / (4 L) falls by pi alpha / A a cycle."""
    return float(np.log(3.0 / load) + np.pi / 4.0 * (1.0 / 3.0 - 1.0 / load)) / (np.pi * COEFFICIENT / AREA)


def test_life_in_closed_form(done: tuple[Path, Results]) -> None:
    """The peak of a slider under a load that wears off, with its optimum and the time of a limit."""
    result = read_result(done[0] / "out")
    left = result.interference_m[0]
    assert done[1].complete
    assert result.complete
    np.testing.assert_allclose(result.cycles, [clock(load) for load in left], atol=5e-3)
    np.testing.assert_allclose(result.highest_m, left**2 / (left - np.pi / 4.0), rtol=1e-6)
    np.testing.assert_allclose(result.depth_m[0] * AREA, result.volume_m3, rtol=1e-12)
    times = {(event.kind, event.said): event.cycles for event in result.events}
    assert times["limit", "depth"] == pytest.approx(clock(2.0), rel=1e-3)
    assert times["limit", "amplitude, from the start"] == 0.0
    heights = np.array([(each.worst_m, each.followed_m) for each in result.responses])
    np.testing.assert_allclose(heights[:, 0], heights[:, 1], rtol=1e-5)


def test_restart_goes_on_where_the_life_was(done: tuple[Path, Results], tmp_path: Path) -> None:
    wear = done[1].studies["wear"]
    half = 0.5 * wear["hours"][-1]
    scene = rubbing_scene(
        [float(np.interp(half, wear["hours"], node)) for node in wear["interference_m"]], hours=half
    )
    del scene["wear"]["cycles"]
    run_scene(scene, tmp_path / "out", rom=done[0] / "model.h5", until="study")
    again = read_result(tmp_path / "out")
    assert again.interference_m[0][-1] == pytest.approx(wear["interference_m"][0][-1], rel=2e-3)


def test_files_figure_and_page(done: tuple[Path, Results]) -> None:
    folder, results = done
    found = read_result(folder / "out")
    np.testing.assert_array_equal(found.highest_m, results.studies["wear"]["highest_m"])
    assert not overlapping_texts(wear_figure(found, "Rubbing"))
    assert (folder / "out" / "figures" / "wear.csv").is_file()
    section = wear_section(found)
    assert len(section.rows) == len(found.responses) == 3
    assert any("depth" in line for line in section.conclusion)
    assert "model 1e-11 m³/J" in section.conclusion[-1] or "1e-11 m³/J" in section.conclusion[-1]


def test_the_worn_face_is_a_map_for_each_time(done: tuple[Path, Results]) -> None:
    """In one scale of colours, from what is not worn to the deepest."""
    found = read_result(done[0] / "out")
    at, frame = tuple(1e-3 * np.array([[0, 0, 0], [4, 0, 0], [4, 2, 0], [0, 2, 0]])), np.eye(3).ravel()
    depth = tuple(share * found.depth_m[0] for share in (1.0, 0.5, 0.25, 0.75))
    flat = replace(found, depth_m=depth, interface=("shroud",) * 4, position_m=at, frame=(frame,) * 4)
    figure = wear_figure(flat, "Rubbing")
    maps = [axes for axes in figure.axes if axes.get_title().startswith("after ")]
    assert len(maps) == 4
    assert not any(hasattr(axes, "zaxis") for axes in figure.axes)
    limits = {axes.collections[0].get_clim() for axes in maps}
    assert len(limits) == 1
    assert min(limits)[0] == 0.0
    assert not overlapping_texts(figure)


def test_quantiles_of_the_life(done: tuple[Path, Results], tmp_path: Path) -> None:
    """The life goes with 1 / alpha: of a lognormal alpha the life is lognormal too, about the life of its median."""
    limits = {"depth_limit": 0.5, "cycles": 1.2, "samples": 16, "coefficient_factor": 1.2}
    run_scene(rubbing_scene(**limits), tmp_path / "out", rom=done[0] / "model.h5", until="study")
    found = read_result(tmp_path / "out")
    lives = found.lives
    assert lives is not None
    limit = next(event for event in found.events if event.kind == "limit")
    assert limit.cycles == pytest.approx(clock(2.5), rel=1e-3)
    factors, reached = lives.values["wear.coefficient"], lives.reached == 1
    np.testing.assert_array_equal(reached, limit.cycles / factors < 1.2)
    np.testing.assert_allclose(lives.hours[reached], limit.hours / factors[reached], rtol=2e-3)
    middle = next(each for each in lives.quantiles if each.level == 0.5)
    assert middle.known
    assert middle.hours == pytest.approx(limit.hours, rel=0.1)
    assert any("16 sampled lives: " in line for line in wear_section(found).conclusion)


@pytest.mark.parametrize(
    ("section", "said"),
    [
        ({"coefficient": 1e-4, "hours": 1.0}, "wear.coefficient: 0.0001, allowed: a number, 0 to 1e-10 m^3/J (usual"),
        ({"coefficient": 1e-14}, "wear.hours: missing, allowed: hours or cycles, one of the two"),
        ({"coefficient": 1e-14, "hours": 1.0, "cycles": 1e9}, "wear.hours: 1 beside cycles, allowed: hours or"),
        (
            {"coefficient": 1e-14, "hours": 1.0, "duty": [{"share": 0.0}]},
            "wear.duty: shares [0.0], allowed: tables [[wear.duty]] with shares whose sum is above 0",
        ),
        ({"coefficient": {"root": 1e-14}, "hours": 1.0}, "wear.coefficient.root: no such interface, allowed: shroud"),
        ({"coefficient": 1e-14, "hours": 1.0, "depth_limit": 1.0}, "wear.depth_limit: 1, allowed: 0.012 m at most"),
        ({"coefficient": 1e-14, "hours": 1.0, "margin_limit": 1.0}, "wear.margin_limit: 1, allowed: a scene with"),
        ({"coefficient": 1e-14, "hours": 1.0, "samples": 16}, "wear.samples: 16, allowed: a scene with wear.ampl"),
        (
            {"coefficient": 1e-14, "hours": 1.0, "coefficient_factor": 2.0},
            "wear.coefficient_factor: 2 without samples",
        ),
        (
            {"coefficient": 1e-14, "hours": 1.0, "duty": [{"share": 1.0, "frequency": 5.0}]},
            "wear.duty[0].frequency: 5, allowed: ",
        ),
    ],
)
def test_what_does_not_fit_is_refused(tmp_path: Path, section: dict[str, Any], said: str) -> None:
    status, _, error = shroud("validate", write_scene(tmp_path / "scene.toml", small_scene() | {"wear": section}))
    assert status == 2
    assert said in error
    assert error.count("\n") == 1


def test_without_interfaces_by_name_the_coefficient_is_a_number(tmp_path: Path) -> None:
    scene = {name: table for name, table in small_scene().items() if name != "shroud"}
    path = write_scene(tmp_path / "scene.toml", scene | {"wear": {"coefficient": {"x": 1e-14}, "hours": 1.0}})
    status, _, error = shroud("validate", path)
    assert status == 2
    assert "wear.coefficient.x: no such interface, allowed: a number: the scene has no interface by name" in error


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--life", "soon"], 'shroud: --life: "soon", allowed: hours above 0, such as 20000h'),
        (["--life", "1h", "--objective", "stress"], "shroud: --life: beside --objective stress, allowed: one of the"),
        (["--life", "20000h"], 'optimum.objective: "life", allowed: a scene with a table [wear]'),
    ],
)
def test_lives_that_cannot_be_optimised(tmp_path: Path, options: list[str], said: str) -> None:
    scene = write_scene(tmp_path / "scene.toml", small_scene())
    status, _, error = shroud("optimise", scene, "--over", "contact.interference=0:1e-5", *options)
    assert (status, error.count("\n")) == (2, 1)
    assert said in error


@pytest.mark.long
def test_sampled_lives_are_single_lives(done: tuple[Path, Results], tmp_path: Path) -> None:
    """With an uncertain force and coefficient, each life is that of a scene with its values."""
    limits = {"depth_limit": 0.5, "cycles": 2.5, "samples": 16, "coefficient_factor": 1.5}
    law = {"key": "excitation.force", "distribution": "uniform", "low": 0.8, "high": 1.2}
    scene = rubbing_scene(**limits) | {"uncertainty": {"parameter": [law], "samples": 16}}
    run_scene(scene, tmp_path / "out", rom=done[0] / "model.h5", until="study")
    lives = read_result(tmp_path / "out").lives
    assert lives is not None
    for number in (0, 7):
        values = {key: float(column[number]) for key, column in lives.values.items()}
        single = rubbing_scene(depth_limit=0.5, cycles=2.5, coefficient=COEFFICIENT * values["wear.coefficient"])
        single["excitation"]["force"] = values["excitation.force"]
        run_scene(single, tmp_path / f"single_{number}", rom=done[0] / "model.h5", until="study")
        found = read_result(tmp_path / f"single_{number}")
        limit = [event.hours for event in found.events if event.kind == "limit"]
        assert bool(limit) == bool(lives.reached[number])
        assert lives.hours[number] == pytest.approx(limit[0] if limit else found.hours[-1], rel=0.01)


@pytest.mark.long
def test_interference_of_the_lowest_highest_amplitude(done: tuple[Path, Results]) -> None:
    """The peak is highest at the beginning or at the end of a life: the best interference makes them equal."""
    folder, cycles = done[0], 2.0
    (folder / "life.toml").write_text(to_toml(rubbing_scene(cycles=cycles)))
    options = ("--rom", folder / "model.h5", "--out", folder / "life", "--objective", "life", "--quiet", "--json")
    status, said, _ = shroud("optimise", folder / "life.toml", "--over", "contact.interference=1.5:3.5", *options)
    assert status == 0
    found = json.loads(said)

    def peak(load: float) -> float:
        return load**2 / (load - np.pi / 4.0)

    def difference(first: float) -> float:
        last = brentq(lambda load: clock(load) - clock(first) - cycles, 0.8, first)
        return peak(first) - peak(last)

    best = brentq(difference, 2.05, 3.0)
    assert found["values"]["contact.interference"] == pytest.approx(best, rel=0.01)
    assert found["amplitude_m"] == pytest.approx(peak(best), rel=0.005)


def test_worn_interfaces_keep_the_other_values_of_their_table(tmp_path: Path) -> None:
    """Both flanks of a damper have the table [interface.damper]; worn, each has a table of its own."""
    path, source = tmp_path / "scene.toml", PROJECT / "scenes" / "shroud_and_damper.toml"
    path.write_text(source.read_text() + "\n[wear]\ncoefficient = { damper = 1e-14 }\nhours = 1.0\n")
    file = read_scene(path)
    scene, names = file.first, file.first.interfaces
    assert scene.wear is not None
    assert names is not None
    life = Life(SimpleNamespace(scene=scene), scene.wear)
    life.model = SimpleNamespace(interfaces=dict.fromkeys(names, 2), n_contacts=2 * len(names))
    left = np.linspace(0.0, 1e-5, 2 * len(names))
    worn = derived_member(file, life.worn(left), "wear.duty").scene
    kept = {"normal_stiffness", "tangential_stiffness", "friction", "preload", "law"}
    for number, name in enumerate(names):
        assert worn.contact_of(name).interference == pytest.approx(left[2 * number : 2 * number + 2])
        assert worn.contact_of(name).model_dump(include=kept) == scene.contact_of(name).model_dump(include=kept)
    assert life.by_node().tolist() == [1e-14 * name.startswith("damper") for name in names for _ in range(2)]


def test_without_areas_there_is_no_depth(tmp_path: Path) -> None:
    scene = rubbing_scene()
    del scene["wear"]["area"]
    (tmp_path / "scene.toml").write_text(to_toml(scene))
    rom = rubbing_model(tmp_path / "model.h5")
    status, _, error = shroud("respond", tmp_path / "scene.toml", "--rom", rom, "--out", tmp_path / "out")
    assert status == 1
    assert "wear: the reduced model has no areas of its contact nodes, allowed: wear.area" in error
