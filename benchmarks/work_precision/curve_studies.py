"""Harmonics, contact integration and continuation: error of the highest peak over seconds of one response curve."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from problems import cached_model, curve_problem, scene_with

from work_precision.study import Measured, Study, announced, relative_error, timed

if TYPE_CHECKING:
    from nonlinear import ResponseCurve

PEAK, FREQUENCY, POLYGON = "peak amplitude", "peak frequency", "curve as drawn"
ALONE = "without Floquet exponents, detached branches and truncation error"
COUNTS: dict[str, Callable[[ResponseCurve], int]] = {
    "points": lambda curve: curve.points,
    "iterations": lambda curve: int(curve.iterations.sum()),
    "harmonics": lambda curve: curve.harmonics,
}
Options = Mapping[str, Any]


@dataclass(frozen=True)
class CurveCase:
    """A scene at one interference, m, and the name of its line in a figure."""

    scene: Path
    interference: float
    label: str


@dataclass(frozen=True)
class CurvePlan:
    """What a study of curves solves.

    Attributes
    ----------
    name, title, about, reference : str
        Texts of the study.
    settings : sequence of (str, str, mapping)
        Series, setting and the solver options of each row.
    finest, coarser : mapping
        Solver options of the reference, and of another one whose distance is its uncertainty.
    counts : sequence of str
        Columns of sizes, keys of `COUNTS`.
    polygon : bool
        Whether the error of the drawn curve is measured too.
    """

    name: str
    title: str
    about: str
    reference: str
    settings: Sequence[tuple[str, str, Options]]
    finest: Options
    coarser: Options
    counts: Sequence[str] = ("points", "iterations")
    polygon: bool = False

    def errors(self, found: ResponseCurve, reference: ResponseCurve) -> dict[str, float]:
        """Relative errors of the highest peak, inf where there is none, and of the drawn curve."""
        errors = {PEAK: float("inf"), FREQUENCY: float("inf")}
        if found.peak is not None and reference.peak is not None:
            errors[PEAK] = relative_error(found.peak.amplitude_m, reference.peak.amplitude_m)
            errors[FREQUENCY] = relative_error(found.peak.frequency_hz, reference.peak.frequency_hz)
        return errors | ({POLYGON: polygon_error(found, reference)} if self.polygon else {})


def harmonics_plan(harmonics: Sequence[int], tolerances: Sequence[float], coarser: int, finest: int) -> CurvePlan:
    """Fixed numbers of harmonics, and "auto" with tolerances."""
    settings: list[tuple[str, str, Options]] = [("H", f"{n}", {"harmonics": n}) for n in harmonics]
    for tolerance in tolerances:
        options = {"harmonics": "auto", "harmonic_tolerance": tolerance}
        settings.append(('tolerance of "auto"', f"{tolerance:g}", options))
    return CurvePlan(
        "harmonics",
        "Harmonics",
        "Seconds of one response curve with event-driven contact integration, without Floquet exponents, detached "
        'branches and truncation error (which "auto" needs); errors of its highest peak.',
        f"Reference: the same curve with {finest} harmonics; its uncertainty is the change from {coarser}.",
        settings,
        {"harmonics": finest},
        {"harmonics": coarser},
        counts=("points", "harmonics"),
    )


def integration_plan(harmonics: int, samples: Sequence[int]) -> CurvePlan:
    """Numbers of samples of the sampled contact element, and event-driven integration."""
    fixed = {"harmonics": harmonics}
    settings: list[tuple[str, str, Options]] = [
        ("sampled", f"{number}", {**fixed, "integration": "sampled", "samples": number}) for number in samples
    ]
    return CurvePlan(
        "integration",
        "Contact integration",
        f"Seconds of one response curve with {harmonics} harmonics, {ALONE}; errors of its highest peak by the "
        "samples of a period.",
        "Reference: event-driven (exact) integration with shorter steps; its uncertainty is the change from the "
        "default steps.",
        [*settings, ("exact", "exact", fixed)],
        {**fixed, "max_step": 0.1},  # other points of the same curve tell the error of its peak
        fixed,
    )


def continuation_plan(
    harmonics: int, steps: Sequence[float], tolerances: Sequence[float], coarser: float, finest: float
) -> CurvePlan:
    """Longest steps, and tolerances of Newton's method."""
    fixed = {"harmonics": harmonics}
    varied = {"longest step": ("max_step", steps), "tolerance": ("tolerance", tolerances)}
    return CurvePlan(
        "continuation",
        "Continuation",
        f"Seconds of one response curve with {harmonics} harmonics and event-driven contact integration, {ALONE}. "
        "The longest step is relative to the present amplitude, the tolerance is that of Newton's method; where one "
        "of them is varied the other has its default (0.25; 1e-13). Curve as drawn: largest distance of a point of "
        "the reference from the straight lines between the solved points, frequencies relative to the range, "
        "amplitudes to the peak.",
        f"Reference: longest step {finest:g}, tolerance 1e-13; its uncertainty is the change from the step "
        f"{coarser:g}.",
        [(name, f"{x:g}", {**fixed, key: x}) for name, (key, values) in varied.items() for x in values],
        {**fixed, "max_step": finest, "tolerance": 1e-13},
        {**fixed, "max_step": coarser, "tolerance": 1e-13},
        polygon=True,
    )


def curve_study(cases: Sequence[CurveCase], plan: CurvePlan, store: Path) -> Study:
    """Errors of each case with each setting of the plan."""
    rows: list[Measured] = []
    uncertainty: dict[str, float] = {}
    for case in cases:
        scene = scene_with(case.scene, {"contact.interference": case.interference})
        problem = curve_problem(cached_model(store, scene), scene)
        reference = problem.solve(**plan.finest)
        for name, error in plan.errors(problem.solve(**plan.coarser), reference).items():
            uncertainty[name] = max(uncertainty.get(name, 0.0), error)
        for series, setting, options in plan.settings:
            curve, seconds = timed(lambda problem=problem, options=options: problem.solve(**options))
            counts = {name: COUNTS[name](curve) for name in plan.counts}
            note = "" if curve.termination.complete else "incomplete"
            label, errors = f"{case.label}: {series}", plan.errors(curve, reference)
            rows.append(announced(Measured(label, setting, seconds, errors, counts, note)))
    return Study(plan.name, plan.title, plan.about, plan.reference, uncertainty, tuple(rows))


def polygon_error(curve: ResponseCurve, reference: ResponseCurve) -> float:
    """Largest distance of a point of the reference from the polygon of a curve, both in units of the reference."""
    spans = np.array([np.ptp(reference.frequency_hz), reference.amplitude_m.max()])
    corners, points = (np.column_stack([c.frequency_hz, c.amplitude_m]) / spans for c in (curve, reference))
    if len(corners) < 2:
        return float("inf")
    starts, along = corners[:-1], np.diff(corners, axis=0)
    lengths = np.maximum(np.einsum("ij,ij->i", along, along), 1e-300)
    offsets = points[:, None, :] - starts[None, :, :]
    share = np.clip(np.einsum("pij,ij->pi", offsets, along) / lengths, 0.0, 1.0)
    nearest = np.linalg.norm(offsets - share[:, :, None] * along[None, :, :], axis=2).min(axis=1)
    return float(nearest.max())
