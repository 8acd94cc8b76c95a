"""Maps over two keys of a run, against a friction damper and a gap in closed form."""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from map_support import DAMPING, FORCE, KT, STIFFNESS, exact_point, one_mass, peak
from pipeline_support import MAIN_BRANCH, shroud, write_scene

from pipeline import run_scene
from pipeline.codec import restored
from pipeline.results.results import Results, read_results
from pipeline.results.worst import FREE, SEPARATING, SLIPPING, STUCK
from pipeline.studies.map.report import map_section
from pipeline.studies.map.result import WorstMotionMap
from rom import write_reduced_model

LOAD, FRICTION, GAP, EXCITATION = "contact.preload", "contact.friction", "contact.interference", "excitation.force"


def scene(over: dict[str, Any], kn: float, **section: Any) -> dict[str, Any]:
    """One mass against the ground."""
    return {
        "name": "one_mass",
        "contact": {"normal_stiffness": kn, "tangential_stiffness": KT, "friction": 0.3, "preload": 0.0},
        "excitation": {"engine_order": 0, "force": FORCE},
        "response": {"frequency": [0.08, 0.30], "damping_ratio": 0.01, "harmonics": 1, **MAIN_BRANCH},
        "map": {"over": over, **section},
    }


def run(folder: Path, direction: int, given: dict[str, Any]) -> Results:
    folder.mkdir(exist_ok=True)
    rom = folder / "mass.h5"
    write_reduced_model(rom, one_mass(direction))
    return run_scene(given, folder / "out", rom=rom)


def map_of(results: Results) -> WorstMotionMap:
    values = {key: value for key, value in results.studies["map"].items() if key not in ("study", "curve_key")}
    found: WorstMotionMap = restored(WorstMotionMap, values)
    return found


@pytest.fixture(scope="module")
def damper(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run with the map of a friction damper whose normal load is constant, its cells halved once."""
    folder = tmp_path_factory.mktemp("damper")
    over = {LOAD: [1.0, 6.0, 36.0, 60.0], FRICTION: [0.1, 0.8]}
    run(folder, 0, scene(over, 0.0, values=4, logarithmic=[LOAD, FRICTION], refine=1, tolerance=0.3))
    return folder


def test_a_map_of_a_friction_damper_in_closed_form(damper: Path) -> None:
    """Amplitude, frequency and state of every curve; the stuck region begins where the linear response slips."""
    found = map_of(read_results(damper / "out"))
    assert len(found.points) > 16
    for point in found.points:
        exact = exact_point(found.grid, point.place)
        assert point.values == exact.values
        assert point.amplitude_m == pytest.approx(exact.amplitude_m, rel=1e-6)
        assert point.frequency_hz == pytest.approx(exact.frequency_hz, rel=1e-4)
        linear = FORCE / (DAMPING * math.sqrt(STIFFNESS + KT - DAMPING**2 / 4.0))  # of the stuck mass
        limit = math.prod(point.values)
        assert point.state == (STUCK if limit >= KT * linear else SLIPPING)
    assert found.shares.keys() == {STUCK, SLIPPING}
    assert sum(found.shares.values()) == pytest.approx(1.0)


def test_the_lowest_point_brackets_the_best_friction_limit(damper: Path) -> None:
    """The amplitude is a function of mu N0: every basin point has a limit near the best one."""
    found = map_of(read_results(damper / "out"))
    assert found.basin is not None
    limits = np.geomspace(0.1, 48.0, 200)
    heights = np.array([peak(limit)[1] for limit in limits])
    best, level = limits[np.argmin(heights)], heights.min()
    load, friction = found.basin.ranges
    assert load.bracket[0] * friction.bracket[0] < best < load.bracket[1] * friction.bracket[1]
    for number in found.basin.points:
        assert found.points[number].height <= 1.1 * found.points[found.basin.lowest].height
    at = load.alone[1] * friction.value  # where the amplitude is 10 % higher, interpolated
    assert np.interp(at, limits, heights) == pytest.approx(1.1 * found.points[found.basin.lowest].height, rel=0.2)
    assert found.points[found.basin.lowest].height < 1.2 * level


def test_the_best_design_of_a_map_is_judged_over_its_condition(damper: Path) -> None:
    """Friction is no choice: the preload whose highest motion over the friction is lowest, in closed form."""
    found = map_of(read_results(damper / "out"))
    loads, frictions = (axis.values for axis in found.grid.axes)
    highest = {load: max(peak(load * friction)[1] for friction in frictions) for load in loads}
    best = min(highest, key=lambda load: highest[load])
    assert found.best is not None
    point = found.points[found.best]
    assert point.values[0] == best != found.lowest.values[0]  # type: ignore[union-attr]
    assert point.amplitude_m == pytest.approx(highest[best], rel=1e-6)
    first = map_section(found).conclusion[0]
    assert first.startswith(f"Best design: preload {best:.6g} N, at most {point.amplitude_m:.4g} m")


def test_a_second_run_computes_no_map_again(damper: Path) -> None:
    results = read_results(damper / "out")
    before = (damper / "out" / "map.json").read_bytes()
    given = json.loads(before)
    assert given["study"] == "map"
    assert (damper / "out" / "figures" / "response_map.png").is_file()
    tables = scene({LOAD: [1.0, 6.0, 36.0, 60.0], FRICTION: [0.1, 0.8]}, 0.0, values=4, logarithmic=[LOAD, FRICTION])
    tables["map"] |= {"refine": 1, "tolerance": 0.3}
    again = run_scene(tables, damper / "out", rom=damper / "mass.h5")
    assert again.summary["stages"]["study"]["status"] == "reused"
    assert (damper / "out" / "map.json").read_bytes() == before
    assert again.studies["map"] == results.studies["map"]


def test_a_map_of_gap_and_force_depends_on_their_ratio(tmp_path: Path) -> None:
    """Force and gap scaled together scale the response; free is what moves less than the gap."""
    over = {GAP: [-80.0, -40.0, -20.0, 10.0], EXCITATION: [0.5, 1.0, 2.0, 4.0]}
    found = map_of(run(tmp_path, 2, scene(over, 0.1)))
    free = 1.0 / (0.02 * math.sqrt(1.0 - 0.01**2))  # largest motion for 1 N without contact
    by_ratio: dict[float, list[tuple[float, float]]] = {}
    for point in found.points:
        gap, force = point.values
        assert point.state == (FREE if -gap > free * force else SEPARATING)
        assert point.amplitude_m is not None
        assert point.frequency_hz is not None
        by_ratio.setdefault(gap / force, []).append((point.amplitude_m / force, point.frequency_hz))
    assert max(map(len, by_ratio.values())) >= 3
    for same in by_ratio.values():
        assert np.ptp(np.log(same), axis=0) == pytest.approx(0.0, abs=1e-6)


def test_the_page_says_where_the_lowest_motion_lies(damper: Path) -> None:
    found = map_of(read_results(damper / "out"))
    lowest, section = found.lowest, map_section(found)
    assert lowest is not None
    assert f"{lowest.amplitude_m:.4g} m" in section.conclusion[1]
    assert f"preload {lowest.values[0]:.6g} N" in section.conclusion[1]
    assert any("slipping" in sentence and "stuck" in sentence for sentence in section.conclusion)
    assert [row[1] for row in section.rows] == [f"{lowest.values[0]:.6g} N", f"{lowest.values[1]:.6g}"]
    assert all(len(row) == len(section.headings) for row in section.rows)


@pytest.mark.parametrize(
    ("section", "said"),
    [
        (
            {"over": {LOAD: [1.0, 2.0]}},
            "allowed: a table of two dotted keys",
        ),
        (
            {"over": {LOAD: [2.0, 1.0], FRICTION: [0.1, 0.2]}},
            'map.over."contact.preload": [2.0, 1.0], allowed: ascending',
        ),
        ({"over": {"contact.frict": [0.1, 0.2], LOAD: [1.0, 2.0]}}, 'map.over."contact.frict"'),
        ({"over": {"excitation.engine_order": [1, 5], LOAD: [1.0, 2.0]}}, "keys of numbers with a fraction"),
        ({"over": {"blade.length": [0.1, 0.2], LOAD: [1.0, 2.0]}}, "has no effect on a given reduced model"),
        ({"over": {FRICTION: [-0.1, 0.2], LOAD: [1.0, 2.0]}}, 'map.over."contact.friction": -0.1'),
        ({"over": {FRICTION: [0.0, 0.2], LOAD: [1.0, 2.0]}, "logarithmic": [FRICTION]}, "map.logarithmic"),
        ({"over": {FRICTION: [0.1, 0.2], LOAD: [1.0, 2.0]}, "values": 2}, "map.values: 2"),
        ({"over": {FRICTION: [0.1, 0.2], LOAD: [1.0, 2.0]}, "refine": 9}, "map.refine: 9"),
    ],
)
def test_a_section_that_is_not_right_is_refused_in_one_line(
    section: dict[str, Any], said: str, tmp_path: Path
) -> None:
    rom = tmp_path / "mass.h5"
    write_reduced_model(rom, one_mass(0))
    path = write_scene(tmp_path / "scene.toml", scene({}, 0.0) | {"map": section})
    status, _, error = shroud("respond", path, "--rom", rom, "--out", tmp_path / "out")
    assert status == 2
    assert error.count("\n") == 1
    assert said in error
    assert not (tmp_path / "out").exists()
