"""The optimum of a scene: against many curves, against difference quotients, and what is said where there is none."""

import json
import math
import signal
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from pipeline_support import MAIN_BRANCH, shroud, small_scene, write_scene

from nonlinear.peak_curves.worst_envelope import range_below
from pipeline import run_scene
from pipeline.optimise import Asked
from pipeline.optimise import optimise as search_optimum
from pipeline.process.progress import Reporter
from pipeline.results.results import Results
from pipeline.scene.reading import read_scene
from pipeline.stages.curve.curve_summary import CurveSummary
from pipeline.stages.request import Request
from pipeline.studies.optimum.search import TOLERANCE, Point, UnitSearch, WindowSearch
from pipeline.studies.optimum.trials import trial_of
from rom import ReducedModel, write_reduced_model

RUB = {  # two equal contact nodes of one mass against the ground
    "name": "rub",
    "contact": {"normal_stiffness": 1.0, "tangential_stiffness": 3.0, "friction": 0.5, "preload": 1.0},
    "excitation": {"engine_order": 3, "force": 1.0},
    "response": {"frequency": [0.1, 0.4], "harmonics": 1, "damping_ratio": 0.03, **MAIN_BRANCH},
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
    options = [part for k, text in enumerate(over) for part in _with_option(over, k, text)]
    where = ("--rom", folder / "rub.h5", "--out", folder / out, "--jobs", 1)
    return shroud("optimise", folder / scene, *options, *where, "--quiet", "--json")


def _with_option(over: Sequence[str], place: int, text: str) -> list[str]:
    """`--over` before a key, but not where another option stands."""
    return [text] if text.startswith("--") or (place and over[place - 1].startswith("--")) else ["--over", text]


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
    values = np.linspace(0.6, 2.4, 7).tolist()
    sweep = {"sweep": {"contact.preload": values}}
    run = run_scene(folder / "rub.toml", folder / "sweep", rom=folder / "rub.h5", until="respond", **sweep)
    heights = [curve["worst_amplitude_m"] for curve in run.summary["curves"]]
    best = preload["values"]["contact.preload"]
    assert preload["kind"] == "smooth"
    assert preload["amplitude_m"] <= min(heights) * (1.0 + 1e-6)
    assert abs(best - values[int(np.argmin(heights))]) < 0.3
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
    scene = write_scene(
        tmp_path / "s.toml", small_scene(mesh__size=0.018, sweep={"contact.interference": [1e-5, 2e-5]})
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
        (
            ["contact.friction=0.1:1", "--tolerance", "contact.friction"],
            '--tolerance: "contact.friction", allowed: KEY=',
        ),
        (
            ["contact.friction=0.1:1", "--tolerance", "contact.friction=0.2"],
            "--tolerance contact.friction: 0.1 to 1 with 0.2 on both sides, allowed: values that the key may have",
        ),
        (
            ["contact.friction=0.1:1", "--tolerance", "contact.friction=1e-5"],
            "--tolerance contact.friction: 1e-05, allowed: at least a thousandth of the range, 0.0009",
        ),
        (["contact.friction=0.1:1", "--tolerance", "uncertainty"], "a scene with a table [uncertainty]"),
        (["contact.friction=0.1:1", "--tolerance", "contact.frictoin=1"], "did you mean contact.friction?"),
        ([], "optimum: missing, allowed: a table [optimum] in the scene, or --over KEY=LOW:HIGH"),
    ],
)
def test_wrong_keys_and_ranges_are_one_line(folder: Path, over: list[str], line: str) -> None:
    status, said, error = optimise(folder, *over, out="refused")
    assert (status, said) == (2, "")
    assert line in error
    assert error.count("\n") == 1


@pytest.mark.parametrize(
    "options", [["contact.interference=40:300"], ["contact.interference", "--tolerance", "contact.interference=10"]]
)
def test_micrometres_in_place_of_metres_are_refused(tmp_path: Path, options: list[str]) -> None:
    scene = write_scene(tmp_path / "s.toml", small_scene())
    status, said, error = shroud("optimise", scene, "--over", *options, "--out", tmp_path / "out")
    assert (status, said, error.count("\n")) == (2, "", 1)
    assert "contact.interference: " in error
    assert "the key is in metres" in error


@pytest.mark.parametrize(
    ("optimum", "changes", "line"),
    [
        ({"over": {"contact.friction": [1.0, 0.5]}}, {}, 'optimum.over."contact.friction": [1.0, 0.5], allowed'),
        ({"over": {"contact.samples": [100.0, 200.0]}}, {}, 'optimum.over."contact.samples": not a design parameter'),
        ({"over": {"shroud.angel": [60.0, 90.0]}}, {}, "did you mean shroud.angle?"),
        ({"over": {"shroud.angle": [90.0, 190.0]}}, {}, 'optimum.over."shroud.angle": 190.0, allowed'),
        (
            {"over": {"contact.friction": [0.1, 0.5]}, "objective": "margin"},
            {},
            'optimum.objective: "margin", allowed: a scene with a table [fatigue]',
        ),
        (
            {"over": {"contact.friction": [0.1, 0.5]}, "output": "mid"},
            {},
            'optimum.output: "mid", allowed: a scene with an [[output]]',
        ),
        (
            {"over": {"contact.friction": [0.1, 0.5]}, "tolerance": {"contact.friction": -0.1}},
            {},
            'optimum.tolerance."contact.friction": -0.1, allowed: "uncertainty", or a table of dotted keys',
        ),
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


def test_a_curve_whose_search_is_open_counts_by_its_highest_solution() -> None:
    """A motion that was found is no conclusion where the program has seen a higher solution."""
    known = {"points": 3, "total_iterations": 3, "seconds": 2.0, "complete": True, "reason": "", "energy_error": 0.0}
    known |= {"harmonics": 1, "truncation_error": 0.0, "sampling_error": 0.0, "sampling_frequency_error": 0.0}
    worst = {"worst_amplitude_m": 1e-6, "worst_frequency_hz": 200.0, "worst_motion": "periodic"}
    peaks = {"peak_amplitude_m": 3e-6, "peak_frequency_hz": 210.0}
    branch = {"peak_amplitude_m": 5e-6, "from_hz": 211.0, "to_hz": 215.0}
    facts = CurveSummary(**known, **worst, **peaks, bifurcations=(), detached=(branch,), worst_unresolved="too long")
    scene: Any = SimpleNamespace(scene=SimpleNamespace(optimum=None))

    def height(facts: CurveSummary) -> float:
        curve: Any = SimpleNamespace(facts=facts, reason="", file=None)
        return trial_of({}, curve, scene).height

    assert height(facts) == 5e-6
    assert height(replace(facts, detached=())) == 3e-6
    assert height(replace(facts, worst_unresolved="")) == 1e-6
    # a static mean is told by what holds it alone
    curves: list[Any] = [
        SimpleNamespace(facts=replace(facts, mean_m=8e-7, worst_unresolved=said)) for said in ("", "x")
    ]
    assert [trial_of({}, curve, scene).mean_m for curve in curves] == [8e-7, 0.0]


@pytest.mark.long
def test_stress_and_margin_within_a_tolerance(tmp_path: Path) -> None:
    """The largest stress amplitude within the tolerance is that of a run at its worse end."""
    scene = small_scene(mesh__size=0.018)
    scene |= {"fatigue": {"endurance_limit": 2e8, "tensile_strength": 9e8}}
    file, out = write_scene(tmp_path / "s.toml", scene), tmp_path / "out"
    asked = ("--over", "contact.interference=0:3e-5", "--tolerance", "contact.interference=8e-6")
    found = {}
    for objective in ("stress", "margin"):
        options = ("--objective", objective, "--out", out, "--jobs", 1, "--quiet", "--json")
        status, said, error = shroud("optimise", file, *asked, *options)
        assert (status, error) == (0, "")
        found[objective] = json.loads(said)
    assert found["stress"]["goal"] <= min(found["stress"]["robust"]["worst"]) * 1.01
    where = found["stress"]["where"]
    run = run_scene(file, tmp_path / "one", overrides={**where, "stress": {"check": False}})
    (entry,) = run.summary["stress"]
    assert entry["largest_amplitude_pa"] == pytest.approx(found["stress"]["goal"], rel=1e-9)
    nominal = found["margin"]["robust"]["nominal"]
    assert 1.0 / found["margin"]["goal"] <= 1.0 / nominal["goal"]


def test_the_command_that_redraws_has_every_option() -> None:
    asked = Asked(["shroud.angle=60:85", "contact.preload"], ["contact.friction=0.1"], "stress", "the rim")
    assert asked.options == (
        " --over shroud.angle=60:85 --over contact.preload --tolerance contact.friction=0.1 --objective stress"
        " --output 'the rim'"
    )


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
    assert len(search.known) < 18


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


def brute(function: Any, low: float, high: float, tolerance: float) -> tuple[float, float]:
    """The same on a fine grid: the best value and the highest within the tolerance around it."""
    grid = np.linspace(low - tolerance, high + tolerance, round((high - low + 2.0 * tolerance) / tolerance * 200) + 1)
    heights = np.array([function(x) for x in grid])
    highest = np.lib.stride_tricks.sliding_window_view(heights, 401).max(axis=1)
    best = int(highest.argmin())
    return float(grid[200 + best]), float(highest[best])


def test_heights_below_a_limit_end_between_values_and_at_jumps() -> None:
    values, heights = np.arange(6.0), np.array([math.inf, 2.0, 1.0, 1.2, 1.6, 1.0])
    assert range_below(values, heights, 2.0, 1.4) == pytest.approx((1.6, 3.5))
    assert range_below(values, heights, 2.2, 2.0) == (1.0, 5.0)  # nothing is known below 1


FUNCTIONS: dict[str, Any] = {
    "kink": lambda x: 0.1 + max(5.0 * (0.3 - x), 0.2 * (x - 0.3)),
    "jump": lambda x: 5.0 if x < 0.3137 else 0.1 + 0.2 * (x - 0.3137),
    "between jumps": lambda x: 0.1 + 0.2 * (x - 0.3) ** 2 if 0.3137 < x < 0.7 else 5.0,
    "a lower valley that is too narrow": lambda x: min(0.2 + abs(x + 0.5), 0.05 + 8.0 * abs(x - 0.4)),
    "a peak inside the window": lambda x: 0.2 + abs(x) + math.exp(-(((x - 0.05) / 0.02) ** 2)),
    "nothing there": lambda x: math.inf if x < 0.1 else 1.0 + (x - 0.15) ** 2,
    "edge": lambda x: 2.0 + x,
}


@pytest.mark.parametrize("name", FUNCTIONS)
def test_the_lowest_highest_value_within_a_tolerance(name: str) -> None:
    function = FUNCTIONS[name]
    search = WindowSearch(lambda values: [(function(x),) for x in values], -1.0, 1.0, 0.1)
    found = search.minimise()
    best, height = brute(function, -1.0, 1.0, 0.1)
    assert found is not None
    assert found == pytest.approx(best, abs=0.1 * 0.1)
    assert search.checked[found] == pytest.approx(height, rel=0.01)
    assert search.bracket(height)[0] - 0.01 <= best <= search.bracket(height)[1] + 0.01
    assert len(search.known) < 33
    assert WindowSearch(lambda values: [(math.inf,)] * len(values), 0.0, 1.0, 0.1).minimise() is None


@pytest.mark.parametrize("name", FUNCTIONS)
@pytest.mark.parametrize("shift", [-0.15, 0.2])
def test_a_window_that_begins_beside_its_best_value_needs_fewer(name: str, shift: float) -> None:
    """From the optimum of a neighbour, to 1 %; a window that is not lower than a height is left early."""
    function = FUNCTIONS[name]
    best, height = brute(function, -1.0, 1.0, 0.1)
    start: dict[str, Any] = {"expected": min(max(best + shift, -1.0), 1.0), "close": 0.01}
    search = WindowSearch(lambda values: [(function(x),) for x in values], -1.0, 1.0, 0.1, **start)
    found = search.minimise()
    assert found is not None
    assert brute(function, found, found, 0.1)[1] <= 1.03 * height
    assert len(search.known) < 35
    left = WindowSearch(lambda values: [(function(x),) for x in values], -1.0, 1.0, 0.1, **start, enough=0.7 * height)
    left.minimise()
    assert len(left.known) <= len(search.known)
    search.close, search.expected = 0.0, None  # the rest of the range
    assert search.minimise() == pytest.approx(best, abs=0.1 * 0.1)
    assert np.diff(sorted(search.known)).max() < 0.201


@pytest.mark.parametrize("function", [lambda x: 1.0 + 3.0 * abs(x - 0.37), lambda x: 1.0 + 2.0 * (x - 0.62) ** 2])
def test_the_lowest_of_dear_values_is_found_to_a_gain(function: Any) -> None:
    search = UnitSearch(lambda points: [function(x) for (x,) in points], 1, 5, 6, 0.02, gain=0.01)
    best = search.minimise([(0.5,)])
    assert best is not None
    assert function(best[0]) <= 1.015
    assert len(search.known) <= 10


def test_a_quantile_over_two_equally_likely_cases() -> None:
    """A kink that lies elsewhere in each case, with normal deviations, against a fine grid of samples."""
    shifts = 0.1 * np.array([-1.96, *np.linspace(-1.2, 1.2, 97), 1.96])

    def cases(x: Any) -> Any:
        return np.array([0.2 + np.abs(x - 0.1), 0.1 + 2.0 * np.abs(x + 0.1)])

    search = WindowSearch(lambda values: cases(np.array(values)).T.tolist(), -1.0, 1.0, 0.15, shifts, 0.9)
    found = search.minimise()
    grid = np.linspace(-1.0, 1.0, 2001)
    heights = np.quantile(cases(grid[:, None] + shifts), 0.9, axis=(0, 2))
    assert found == pytest.approx(grid[heights.argmin()], abs=0.015)
    assert search.value_at(float(found or 0.0)) == pytest.approx(heights.min(), rel=0.01)


def test_an_optimum_with_a_tolerance_is_as_high_at_both_ends(folder: Path, preload: dict[str, Any]) -> None:
    """Of the friction, which is not optimised, the higher end counts as well."""
    tolerances = ("--tolerance", "contact.preload=0.4", "--tolerance", "contact.friction=0.05")
    status, said, error = optimise(folder, "contact.preload=1:2.4", *tolerances, out="robust")
    assert (status, error) == (0, "")
    found = json.loads(said)
    best, height = found["values"]["contact.preload"], found["amplitude_m"]
    low, high = (
        max(worst(folder, contact__preload=best + side, contact__friction=friction) for friction in (0.45, 0.55))
        for side in (-0.4, 0.4)
    )
    assert found["kind"] == "balanced"
    assert height == pytest.approx(max(low, high), rel=1e-6)
    assert low == pytest.approx(high, rel=0.03)
    assert height > 1.05 * preload["amplitude_m"]
    robust = found["robust"]
    assert robust["bracket"][0] <= best <= robust["bracket"][1] <= robust["bracket"][0] + 0.08
    assert robust["lowest"]["amplitude_m"] <= height <= robust["around_lowest"] * 1.001
    assert found["message"].startswith(f"contact.preload = {best:g} N: at most ")
    assert "contact.preload ±0.4 N, contact.friction ±0.05" in found["message"]
    assert (folder / "robust" / "figures" / "optimum.png").is_file()


@pytest.mark.long
def test_a_joint_search_goes_from_optimum_to_optimum(folder: Path) -> None:
    """Over friction, and at each the preload with a tolerance: the lowest is that of a grid of both."""
    asked = ("contact.preload=0.6:4", "contact.friction=0.3:0.6", "--tolerance", "contact.preload=0.3")
    status, said, error = optimise(folder, *asked, out="both")
    assert (status, error) == (0, "")
    found = json.loads(said)
    first, *others = found["trials"]
    assert first["values"]["contact.friction"] == pytest.approx(0.5, rel=1e-6)
    assert all(trial["curves"] < first["curves"] for trial in others if trial["values"] != found["values"])
    assert sum(trial["curves"] for trial in found["trials"]) == found["responses"]
    preloads = np.linspace(0.6, 4.0, 18).tolist()
    for friction in (0.3, 0.4, 0.5, 0.6):
        values = [*(load - 0.3 for load in preloads[:1]), *preloads, preloads[-1] + 0.3]
        heights = np.array([worst(folder, contact__preload=load, contact__friction=friction) for load in values])
        ends = [np.interp(np.add(preloads, side), values, heights) for side in (-0.3, 0.0, 0.3)]
        assert found["amplitude_m"] <= 1.015 * np.max(ends, axis=0).min()


def test_the_highest_of_the_load_cases_counts(folder: Path) -> None:
    """A swept force; the normal stiffness, swept as well, is no load case: its first value is taken."""
    sweep = {"contact.normal_stiffness": [1.0, 2.0], "excitation.force": [0.7, 1.0]}
    write_scene(folder / "cases.toml", {**RUB, "sweep": sweep})
    asked = ("contact.preload=1.4:2", "--tolerance", "contact.preload=0.4")
    status, said, error = optimise(folder, *asked, scene="cases.toml", out="cases")
    assert (status, error) == (0, "")
    found = json.loads(said)
    values = found["values"] | found["where"]
    assert values["excitation.force"] == 1.0
    assert found["amplitude_m"] == pytest.approx(worst(folder, contact__preload=values["contact.preload"]), rel=1e-6)
    assert any("highest of 2 load cases" in remark for remark in found["remarks"])


class StopsAt(Reporter):
    """Receives a signal after a line with some words."""

    words = ""

    def line(self, text: str) -> None:
        if self.words in text:
            self.interrupts.noticed = signal.SIGTERM


def test_a_search_that_is_stopped_leaves_the_best_so_far(folder: Path) -> None:
    request = Request(
        read_scene(folder / "rub.toml", given_model=True), folder / "stop", "respond", jobs=1, rom=folder / "rub.h5"
    )
    asked = Asked(["contact.preload=1:2.4"], ["contact.preload=0.4"])
    stopping = StopsAt()
    stopping.words = "so far"
    found = search_optimum(request, asked, stopping)
    written = json.loads((folder / "stop" / "optimum.json").read_text())
    assert found.stopped is not None
    assert found.stopped.signal == signal.SIGTERM
    assert written == json.loads(json.dumps(found.values))
    assert written["complete"] is False
    assert "so far contact.preload = " in found.lines[0]
    low, high = written["robust"]["bracket"]
    known = len(written["robust"]["computed"])
    whole = search_optimum(request, asked, Reporter(quiet=True))
    assert low <= whole.values["values"]["contact.preload"] <= high
    assert known < len(whole.values["robust"]["computed"])
