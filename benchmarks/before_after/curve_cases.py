"""Response curves as they are measured: processor seconds, one BLAS thread, kernels loaded before."""

from __future__ import annotations

import json
import statistics
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from measured_process import OutOfTimeError, cpu_seconds, limited
from model_cases import model_file, scene_file
from problems import CurveProblem, curve_problem, scene_with

ALONE: dict[str, Any] = {"stability": "folds", "detached": False, "truncation": False, "search": "off"}
EXTRAS: dict[str, dict[str, Any]] = {  # each adds to those before it; the last is what `shroud run` does
    "alone": {},
    "truncation": {"truncation": True},
    "detached": {"detached": True},
    "ring stability": {"stability": "ring"},
    "time integration": {"search": "standard"},
}
MOST_HARMONICS = 21  # of the reference of "auto"
SAME, NEAR = 1e-6, 1.05  # relative errors of a peak that count as equal: below it, or within this factor
STIFF = ((1e6, -60e-6), (1e7, -60e-6), (1e8, -20e-6))  # N/m, m
STRESS_SCENE = "figure5"


@dataclass(frozen=True)
class Posed:
    """A member of a scene's sweep, with the options that it asks for."""

    label: str
    problem: CurveProblem
    options: dict[str, Any]

    def solve(self, **changes: Any) -> Any:
        """The curve, alone unless `changes` say otherwise."""
        return self.problem.solve(**{**ALONE, **self.options, **changes})


def posed(models: str, name: str, values: list[float] | None = None) -> Iterator[Posed]:
    """Members of the sweep of a scene, or those interferences (m); "dummy180": the default one, 180 degrees."""
    from pipeline import read_scene

    scene = "dummy" if name == "dummy180" else name
    angle = {"shroud__angle": 180.0} if name == "dummy180" else {}
    model = model_file(models, scene, **angle)
    for member in read_scene(scene_file(scene)).members:
        one = scene_with(member.scene, {"shroud.angle": 180.0} if angle else {})
        if values is not None and min(abs(one.contact.interference - v) for v in values) > 1e-9:
            continue
        yield of_scene(model, one)


def of_scene(model: Path, scene: Any) -> Posed:
    """The curve of one scene with a model."""
    options = {"harmonics": scene.response.harmonics, "harmonic_tolerance": scene.response.tolerance}
    options["integration"] = scene.contact.integration
    label = f"{scene.contact.interference:g} m, EO {scene.excitation.engine_order}"
    return Posed(label, curve_problem(model, scene), options)


def one_thread(function: Callable[..., dict[str, Any]]) -> Callable[..., dict[str, Any]]:
    """The function with one BLAS thread, and the kernels loaded by a coarse curve before."""

    def run(models: str, **arguments: Any) -> dict[str, Any]:
        from rom.linear_algebra.threads import one_blas_thread

        with one_blas_thread():
            warm_up(models)
            return function(models, **arguments)

    return run


def warm_up(models: str) -> None:
    """Load or compile the kernels of curves, of their extras and of the time integration."""
    from nonlinear.time_integration.ring import Ring
    from nonlinear.time_integration.ring_motion import RingLimits, integrate_ring

    curve = next(posed(models, "figure5"))
    curve.solve(harmonics=1, stability="ring", truncation=True)
    problem = curve.problem
    ring = Ring(problem.modal, problem.contact, problem.excitation, problem.options.output)
    with suppress(ArithmeticError):
        integrate_ring(ring, 1e4, None, limits=RingLimits(most_periods=2, window=1, settling=1))


@one_thread
def extras(models: str, scene: str, steps: bool = True, values: list[float] | None = None) -> dict[str, Any]:
    """Seconds of all curves with one extra after the other; what is found with all of them.

    Without `steps` the two dearest extras are added at once.
    """
    seconds = {name: 0.0 for name in EXTRAS if steps or name != "ring stability"}
    found: dict[str, Any] = {}
    for curve in posed(models, scene, values):
        chosen: dict[str, Any] = {}
        for name, added in EXTRAS.items():
            chosen |= added
            if name not in seconds:
                continue
            last, cpu = cpu_seconds(lambda curve=curve, chosen=dict(chosen): curve.solve(**chosen))
            seconds[name] += cpu
        found[curve.label] = answer(last)
    return {"seconds": seconds, "found": found}


def answer(curve: Any) -> dict[str, Any]:
    """What a curve says: peak, worst motion (m), branches, whether it is complete, its points."""
    return {
        "peak": None if curve.peak is None else curve.peak.amplitude_m,
        "worst": None if curve.worst is None else curve.worst.amplitude_m,
        "unresolved": "" if curve.worst is None else curve.worst.unresolved,
        "detached": len(curve.detached),
        "complete": curve.termination.complete,
        "points": curve.points,
    }


@one_thread
def automatic(models: str, scene: str, values: list[float]) -> dict[str, Any]:
    """Seconds of "auto" and of the cheapest fixed number of harmonics whose peak is as near to the reference."""
    rows = {}
    for curve in posed(models, scene, values):
        true = reference_peak(models, f"{scene} {curve.label}", curve)
        by_tolerance, cpu = cpu_seconds(lambda curve=curve: curve.solve(harmonics="auto"))
        error = abs(by_tolerance.peak.amplitude_m / true - 1.0)
        cheapest = None
        for number in range(1, MOST_HARMONICS + 1, 2):
            fixed, seconds = cpu_seconds(lambda curve=curve, number=number: curve.solve(harmonics=number))
            if fixed.peak and abs(fixed.peak.amplitude_m / true - 1.0) <= max(NEAR * error, SAME):
                cheapest = {"harmonics": number, "seconds": seconds}
                break
        rows[curve.label] = {"auto": cpu, "harmonics": by_tolerance.harmonics, "error": error, "fixed": cheapest}
    return {"curves": rows}


def reference_peak(models: str, name: str, curve: Posed) -> float:
    """Peak, m, with many harmonics; kept beside the models, so that both states are compared with the same one."""
    file = Path(models) / "peaks.json"
    kept = json.loads(file.read_text(encoding="utf-8")) if file.exists() else {}
    if name not in kept:
        kept[name] = curve.solve(harmonics=MOST_HARMONICS).peak.amplitude_m
        file.write_text(json.dumps(kept, indent=1), encoding="utf-8")
    return float(kept[name])


@one_thread
def growth(models: str, nodes: list[int], harmonics: list[int]) -> dict[str, Any]:
    """Milliseconds a point round the peak of the default blade: n x n nodes with H = 1; 9 nodes with each H."""
    from scaling import INTERFERENCE

    rows = []
    for grid, number in [*((grid, 1) for grid in nodes), *((3, number) for number in harmonics)]:
        values = {} if grid == 3 else {"mesh__contact_grid": (grid, grid)}
        scene = scene_with(scene_file("dummy"), {"contact.interference": INTERFERENCE})
        curve = of_scene(model_file(models, "dummy", **values), scene)
        changes = {"frequency_hz": (407.0, 412.0), "harmonics": number}
        found, seconds = cpu_seconds(lambda curve=curve, changes=changes: curve.solve(**changes))
        unknowns = 3 * grid * grid * (2 * number + 1)
        row = {"nodes": grid * grid, "harmonics": number, "unknowns": unknowns, "points": found.points}
        rows.append(row | {"ms": 1e3 * seconds / found.points, "seconds": seconds})
    return {"rows": rows}


@one_thread
def hard(models: str, cases: list[int], most: float, seed: int = 1) -> dict[str, Any]:
    """Cases of `stress.py --hard`: seconds with all extras, `most` where these are over; points."""
    from stress_cases import draw_cases
    from stress_solving import attempt

    drawn = draw_cases(max(cases) + 1, seed, hard=True)
    rows = []
    for case in (drawn[index] for index in cases):
        model = model_file(models, STRESS_SCENE, shroud__angle=case.angle)
        row: dict[str, Any] = {"case": case.index, "harmonics": case.harmonics, "limited": False}
        try:
            with limited(most):
                (result, curve), seconds = cpu_seconds(
                    lambda case=case, model=model: attempt(case, model, 1e6), most=1
                )
            row |= {"seconds": seconds, "points": result.points, "complete": result.complete}
            row |= {"found": None if curve is None else answer(curve)}
        except OutOfTimeError:
            row |= {"seconds": most, "points": 0, "complete": False, "limited": True}
        rows.append(row)
    return {"rows": rows}


@one_thread
def stiff(models: str, most: float, tolerance: float = 1e-3) -> dict[str, Any]:
    """Seconds of "auto" with all extras on stiff contacts with a gap, default blade at 180 degrees."""
    model = model_file(models, "dummy", shroud__angle=180.0)
    rows = []
    for stiffness, interference in STIFF:
        values: dict[str, Any] = {"interference": interference, "normal_stiffness": stiffness}
        values["tangential_stiffness"] = 0.75 * stiffness
        scene = scene_with(scene_file("dummy"), {f"contact.{key}": value for key, value in values.items()})
        curve = of_scene(model, scene)
        asked = {key: value for added in EXTRAS.values() for key, value in added.items()}
        row: dict[str, Any] = {"kn": stiffness, "v0": interference, "seconds": most, "limited": True}
        try:
            with limited(most):
                found, seconds = cpu_seconds(
                    lambda curve=curve, asked=asked: curve.solve(**asked, harmonic_tolerance=tolerance), most=1
                )
            row |= {"seconds": seconds, "limited": False, "found": answer(found)}
        except OutOfTimeError:
            pass
        rows.append(row)
    return {"rows": rows}


def peers(models: str, cases: list[str], program: str = "shroud", curves: int = 5) -> dict[str, Any]:
    """Milliseconds of processor time a point on the problems of `peers.py`, the first curve not counted."""
    from peers import CASES, TOLERANCE
    from peers_programs import Request, answer

    rows = {}
    for case in cases:
        kind, number = CASES[case]
        file = str(Path(models) / "blade.npz")
        found = answer(Request(program, "exact", kind, number, TOLERANCE, curves=curves, file=file))
        assert found.curve is not None
        seconds = statistics.median(each.cpu for each in found.timed)
        rows[case] = {"ms": 1e3 * seconds / found.curve.points, "points": found.curve.points}
    return {"cases": rows}
