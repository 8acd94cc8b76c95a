"""Continuation: error of the peak and of the drawn curve over seconds, by the tolerance and by the longest step."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from work_precision.curves import FREQUENCY, PEAK, CurveCase, curve_problem, ending, peak_errors
from work_precision.study import Measured, Quantity, Study, said
from work_precision.timing import timed

if TYPE_CHECKING:
    from nonlinear import ResponseCurve

DRAWN = "curve as drawn"


@dataclass(frozen=True)
class ContinuationSettings:
    """Harmonics, longest steps and tolerances; longest steps of the references, the last the finest."""

    harmonics: int
    steps: Sequence[float]
    tolerances: Sequence[float]
    reference: tuple[float, float] = (0.02, 0.01)


USUAL = ContinuationSettings(3, (1.0, 0.5, 0.25, 0.125, 0.06, 0.03), (1e-2, 1e-3, 1e-4, 1e-6, 1e-8, 1e-10, 1e-13))
FULL = ContinuationSettings(
    5, (2.0, 1.0, 0.5, 0.25, 0.125, 0.06, 0.03, 0.015), tuple(10.0**-n for n in range(1, 14)), (0.01, 0.005)
)


def continuation_study(cases: Sequence[CurveCase], settings: ContinuationSettings, store: Path) -> Study:
    """Errors of the highest peak and of the drawn curve of each case.

    Raises
    ------
    InputError : a scene cannot be read.
    """
    rows: list[Measured] = []
    unsure = {PEAK: 0.0, FREQUENCY: 0.0, DRAWN: 0.0}
    for case in cases:
        problem = curve_problem(case, store)
        nearly, reference = (
            problem.solve(harmonics=settings.harmonics, max_step=step, tolerance=1e-13) for step in settings.reference
        )
        for name, change in _errors(nearly, reference).items():
            unsure[name] = max(unsure[name], change)
        for series, option, values in (
            ("longest step", "max_step", settings.steps),
            ("tolerance", "tolerance", settings.tolerances),
        ):
            for value in values:
                chosen = {option: value, "harmonics": settings.harmonics}
                curve, seconds = timed(lambda problem=problem, chosen=chosen: problem.solve(**chosen))
                counts = {"points": curve.points, "iterations": int(curve.iterations.sum())}
                errors = _errors(curve, reference)
                label = f"{case.label}: {series}"
                rows.append(said(Measured(label, f"{value:g}", seconds, errors, counts, ending(curve))))
    return Study(
        "continuation",
        "Continuation",
        f"Seconds of one response curve with {settings.harmonics} harmonics and exact contact integration, without "
        "Floquet exponents, detached branches and the estimate of the harmonics left out. The longest step is "
        "relative to the vibration at hand, the tolerance is that of Newton's method; where one of them is varied "
        "the other is as the program sets it (0.25; 1e-13). Curve as drawn: largest distance of a point of the "
        "reference from the straight lines between the points solved, frequencies relative to the range, amplitudes "
        "to the peak.",
        f"Reference: longest step {settings.reference[1]:g}, tolerance 1e-13; its uncertainty is what the step "
        f"{settings.reference[0]:g} changes.",
        tuple(Quantity(name, value) for name, value in unsure.items()),
        tuple(rows),
        {},
    )


def _errors(curve: ResponseCurve, reference: ResponseCurve) -> dict[str, float]:
    return {**peak_errors(curve, reference), DRAWN: drawn_error(curve, reference)}


def drawn_error(curve: ResponseCurve, reference: ResponseCurve) -> float:
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
