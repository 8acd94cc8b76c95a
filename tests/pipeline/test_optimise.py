"""The optimum of a scene: against many curves, against difference quotients, and what is said where there is none."""

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pipeline_support import shroud, small_scene, write_scene

from pipeline import run_scene
from pipeline.results.results import Results
from pipeline.studies.optimum.study import TOLERANCE, Point, UnitSearch
from rom import ReducedModel, write_reduced_model

pytestmark = pytest.mark.xdist_group("optimise")  # one worker: what the module makes is made once

QUICK = {"detached": False, "truncation": False, "time_integration": False, "stability": "wave"}
RUB = {  # two equal contact nodes of one mass against the ground
    "name": "rub",
    "contact": {"normal_stiffness": 1.0, "tangential_stiffness": 3.0, "friction": 0.5, "preload": 1.0},
    "excitation": {"engine_order": 3, "force": 1.0},
    "response": {"frequency": [0.1, 0.4], "harmonics": 1, "damping_ratio": 0.03, **QUICK},
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a scene and its reduced model."""
    found = tmp_path_factory.mktemp("optimise")
    one = np.ones(1)
    right, position = np.vstack([np.eye(3, 1)] * 2), np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    write_reduced_model(
        found / "rub.h5", ReducedModel(np.eye(1), np.eye(1), right, position, one, {"tip": one}, n_blades=12)
    )
    write_scene(found / "rub.toml", RUB)
    return found


def optimise(folder: Path, *over: str, scene: str = "rub.toml", out: str = "out") -> tuple[int, str, str]:
    """`shroud optimise` of a scene in the folder on the reduced model there."""
    options = [part for text in over for part in ("--over", text)]
    where = ("--rom", folder / "rub.h5", "--out", folder / out, "--jobs", 1)
    return shroud("optimise", folder / scene, *options, *where, "--quiet", "--json")


def worst(folder: Path, **keys: float) -> float:
    """Worst amplitude of the scene with other values, m."""
    overrides = {key.replace("__", "."): value for key, value in keys.items()}
    run = run_scene(
        folder / "rub.toml", folder / "single", rom=folder / "rub.h5", until="respond", overrides=overrides
    )
    return float(run.summary["curves"][0]["worst_amplitude_m"])


@pytest.fixture(scope="module")
def preload(folder: Path) -> dict[str, Any]:
    """The optimum over the preload, in the range that the program chooses."""
    status, said, error = optimise(folder, "contact.preload")
    assert (status, error) == (0, "")
    found: dict[str, Any] = json.loads(said)
    assert json.loads((folder / "out" / "optimum.json").read_text()) == found
    return found


def test_the_optimum_is_below_all_curves_of_a_sweep(folder: Path, preload: dict[str, Any]) -> None:
    values = np.linspace(0.2, 3.0, 15).tolist()
    sweep = {"sweep": {"contact.preload": values}}
    run = run_scene(folder / "rub.toml", folder / "sweep", rom=folder / "rub.h5", until="respond", **sweep)
    heights = [curve["worst_amplitude_m"] for curve in run.summary["curves"]]
    best = preload["values"]["contact.preload"]
    assert preload["kind"] == "smooth"
    assert preload["amplitude_m"] <= min(heights) * (1.0 + 1e-6)
    assert abs(best - values[int(np.argmin(heights))]) < 0.2
    assert preload["amplitude_m"] == pytest.approx(worst(folder, contact__preload=best), rel=1e-4)
    assert preload["base"]["amplitude_m"] == pytest.approx(worst(folder), rel=1e-12)
    for end in preload["within"]["contact.preload"]:
        assert worst(folder, contact__preload=end) == pytest.approx(1.1 * preload["amplitude_m"], rel=2e-3)


def test_derivatives_and_curvature_are_those_of_the_keys_of_the_scene(folder: Path, preload: dict[str, Any]) -> None:
    best = preload["values"]["contact.preload"]
    for key, value in (("contact.tangential_stiffness", 3.0), ("excitation.force", 1.0), ("contact.friction", 0.5)):
        step = 1e-3 * value
        name = key.replace(".", "__")
        sides = [worst(folder, contact__preload=best, **{name: value + sign * step}) for sign in (1.0, -1.0)]
        assert preload["derivatives"][key] == pytest.approx(
            (sides[0] - sides[1]) / (2.0 * step), rel=2e-2, abs=1e-3
        ), key
    step = 0.03 * best
    sides = [worst(folder, contact__preload=best + shift) for shift in (-step, 0.0, step)]
    assert preload["curvature"] == pytest.approx((sides[0] - 2.0 * sides[1] + sides[2]) / step**2, rel=0.05)


def test_force_and_preload_together_scale(folder: Path, preload: dict[str, Any]) -> None:
    """Preload over force decides: the lowest force with the preload that is best for it."""
    status, said, error = optimise(folder, "contact.preload=0.05:2", "excitation.force=0.3:2", out="joint")
    assert (status, error) == (0, "")
    found = json.loads(said)
    assert found["kind"] == "edge"
    assert found["values"]["excitation.force"] == pytest.approx(0.3, rel=1e-6)
    assert found["amplitude_m"] == pytest.approx(0.3 * preload["amplitude_m"], rel=1e-2)


def test_a_key_that_does_nothing_is_flat(folder: Path) -> None:
    """Motion is tangential, so that the normal stiffness has no part in it."""
    status, said, error = optimise(folder, "contact.normal_stiffness", out="flat")
    assert (status, error) == (0, "")
    found = json.loads(said)
    assert found["kind"] == "flat"
    assert found["ranges"] == {"contact.normal_stiffness": [0.1, 10.0]}
    assert "changes by less than 0.1 %" in found["message"]


def test_the_default_range_of_the_preload_ends_where_all_nodes_stick(folder: Path, preload: dict[str, Any]) -> None:
    low, high = preload["ranges"]["contact.preload"]
    assert low < preload["values"]["contact.preload"] < high
    stuck = worst(folder, contact__preload=100.0)
    assert worst(folder, contact__preload=1.001 * high) == pytest.approx(stuck, rel=1e-6)
    assert worst(folder, contact__preload=0.97 * high) < stuck * (1.0 - 1e-4)


def test_the_section_of_a_scene_finds_what_the_command_has_computed(folder: Path, preload: dict[str, Any]) -> None:
    def run(**tables: Any) -> Results:
        return run_scene(folder / "rub.toml", folder / "out", rom=folder / "rub.h5", until="figures", **tables)

    found = run(optimum={"over": preload["ranges"]})
    assert found.complete
    assert found.summary["stages"]["study"]["status"] == "reused"
    assert found.studies == {"optimum": preload}
    assert "figures/optimum.png" in found.summary["pictures"]
    assert run().studies == {}
    assert (folder / "out" / "optimum.json").is_file()  # still about the first curve of the scene
    assert (folder / "out" / "figures" / "optimum.png").is_file()
    run(contact={"friction": 0.3})
    assert not (folder / "out" / "optimum.json").exists()
    assert not (folder / "out" / "figures" / "optimum.png").exists()


@pytest.mark.long
def test_a_key_that_remeshes_the_blade(tmp_path: Path) -> None:
    """Single curves are compared; angles that cannot be meshed are left out."""
    fast = {f"response__{key}": value for key, value in QUICK.items()}
    scene = write_scene(
        tmp_path / "s.toml", small_scene(**fast, mesh__size=0.018, sweep={"contact.interference": [1e-5, 2e-5]})
    )
    out = ("--out", tmp_path / "out", "--jobs", 1, "--quiet", "--json")
    status, said, error = shroud("optimise", scene, "--over", "shroud.contact_length=0.012:0.1", *out)
    assert (status, error) == (0, "")
    found = json.loads(said)
    heights = {each["values"]["shroud.contact_length"]: each["amplitude_m"] for each in found["trials"]}
    known = [height for height in heights.values() if height is not None]
    assert found["amplitude_m"] == min(known)
    assert len(known) < len(heights)
    assert any("curves are missing" in remark for remark in found["remarks"])
    value = found["values"]["shroud.contact_length"]
    again = run_scene(
        scene, tmp_path / "one", until="respond", overrides={"shroud.contact_length": value, "sweep": {}}
    )
    assert again.summary["curves"][0]["worst_amplitude_m"] == pytest.approx(found["amplitude_m"], rel=1e-9)


@pytest.mark.parametrize(
    ("over", "line"),
    [
        (["contact.frictoin=0:1"], "--over contact.frictoin: unknown key, did you mean contact.friction?"),
        (["contact.law"], "--over contact.law: not a design parameter"),
        (["contact.friction=1:1"], '--over: "contact.friction=1:1", allowed: KEY=LOW:HIGH'),
        (["contact.friction=low:1"], '--over: "contact.friction=low:1", allowed: KEY=LOW:HIGH'),
        (["contact.friction=-1:1"], "--over contact.friction: -1.0, allowed: a number, 0 to 1e15"),
        (["contact.friction", "contact.friction=0:1"], "--over contact.friction: given twice"),
        (["blade.thickness=1e-3:2e-3"], "--over blade.thickness: has no effect on a given reduced model"),
        (["load.speed_rpm"], "--over load.speed_rpm: no range, and the scene's value tells none"),
        ([], "optimum: missing, allowed: a table [optimum] in the scene, or --over KEY=LOW:HIGH"),
    ],
)
def test_wrong_keys_and_ranges_are_one_line(folder: Path, over: list[str], line: str) -> None:
    status, said, error = optimise(folder, *over, out="refused")
    assert (status, said) == (2, "")
    assert line in error
    assert error.count("\n") == 1


@pytest.mark.parametrize(
    ("optimum", "changes", "line"),
    [
        ({"over": {"contact.friction": [1.0, 0.5]}}, {}, 'optimum.over."contact.friction": [1.0, 0.5], allowed'),
        ({"over": {"contact.samples": [100.0, 200.0]}}, {}, 'optimum.over."contact.samples": not a design parameter'),
        ({"over": {"shroud.angel": [60.0, 90.0]}}, {}, "did you mean shroud.angle?"),
        ({"over": {"shroud.angle": [90.0, 190.0]}}, {}, 'optimum.over."shroud.angle": 190.0, allowed'),
        ({"over": {}}, {}, "optimum.over: {}, allowed: a table of 1 to 6 dotted keys"),
        ({"over": {"response.damping_ratio": [0.1, 0.2]}}, {"damping_ratio": [0.1, 0.2]}, "a list mode by mode"),
    ],
)
def test_a_wrong_section_is_one_line(tmp_path: Path, optimum: Any, changes: Any, line: str) -> None:
    scene = small_scene(optimum=optimum)
    scene["response"] |= changes
    status, _, error = shroud("run", write_scene(tmp_path / "s.toml", scene), "--out", tmp_path / "out")
    assert status == 2
    assert line in error
    assert error.count("\n") == 1


def test_nothing_that_can_be_computed_is_one_line(tmp_path: Path) -> None:
    scene = write_scene(tmp_path / "s.toml", small_scene(response__frequency=[300.0, 500.0]))
    out = ("--out", tmp_path / "out", "--jobs", 1, "--quiet")
    status, said, error = shroud("optimise", scene, "--over", "shroud.contact_length=0.2:0.3", *out)
    assert (status, said) == (1, "")
    assert error.startswith("optimum: no values in the ranges have a motion: ")
    assert error.count("\n") == 1


def two_valleys(points: Sequence[Point]) -> list[float]:
    """A wide valley at 0.25, a narrower and lower one with a kink at 0.83; nothing above 0.95."""
    return [math.inf if x > 0.95 else min(1.2 + 4.0 * (x - 0.25) ** 2, 1.0 + 3.0 * abs(x - 0.83)) for (x,) in points]


def test_the_lower_of_two_minima_is_found_without_derivatives() -> None:
    search = UnitSearch(two_valleys, 1)
    best = search.minimise()
    assert best is not None
    assert best[0] == pytest.approx(0.83, abs=TOLERANCE)
    assert len(search.known) < 60


def test_a_kink_over_two_variables_is_found_without_derivatives() -> None:
    search = UnitSearch(lambda points: [1.0 + max(2.0 * x + y - 1.0, 0.9 - x - 2.0 * y, y - x) for x, y in points], 2)
    best = search.minimise()
    assert best is not None
    value = 1.0 + max(2.0 * best[0] + best[1] - 1.0, 0.9 - best[0] - 2.0 * best[1], best[1] - best[0])
    exact = min(
        1.0 + max(2.0 * x + y - 1.0, 0.9 - x - 2.0 * y, y - x)
        for x in np.linspace(0.0, 1.0, 401)
        for y in np.linspace(0.0, 1.0, 401)
    )
    assert value == pytest.approx(exact, abs=1e-2)
    assert UnitSearch(lambda points: [math.inf] * len(points), 2).minimise() is None
