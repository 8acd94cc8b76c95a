"""Contact integration, exact and sampled: error of the peak over seconds of the curve, in partial lift-off."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from work_precision.curves import FREQUENCY, PEAK, CurveCase, curve_problem, ending, peak_errors
from work_precision.study import Measured, Quantity, Study, said
from work_precision.timing import timed

_FINER = {"max_step": 0.1}  # another walk along the same curve tells the error of its peak


@dataclass(frozen=True)
class IntegrationSettings:
    """Harmonics of all curves, and the numbers of samples."""

    harmonics: int
    samples: Sequence[int]


USUAL = IntegrationSettings(3, tuple(2**n for n in range(5, 13)))
FULL = IntegrationSettings(5, tuple(2**n for n in range(5, 15)))


def integration_study(cases: Sequence[CurveCase], settings: IntegrationSettings, store: Path) -> Study:
    """Errors of the highest peak of each case with each integration.

    Raises
    ------
    InputError : a scene cannot be read.
    """
    rows: list[Measured] = []
    unsure = {PEAK: 0.0, FREQUENCY: 0.0}
    for case in cases:
        problem = curve_problem(case, store)
        reference = problem.solve(harmonics=settings.harmonics, **_FINER)
        for samples in settings.samples:
            curve, seconds = timed(
                lambda problem=problem, n=samples: problem.solve(
                    harmonics=settings.harmonics, integration="sampled", samples=n
                )
            )
            counts = {"points": curve.points, "iterations": int(curve.iterations.sum())}
            errors = peak_errors(curve, reference)
            rows.append(
                said(Measured(f"{case.label}: sampled", f"{samples}", seconds, errors, counts, ending(curve)))
            )
        curve, seconds = timed(lambda problem=problem: problem.solve(harmonics=settings.harmonics))
        counts = {"points": curve.points, "iterations": int(curve.iterations.sum())}
        errors = peak_errors(curve, reference)
        rows.append(said(Measured(f"{case.label}: exact", "exact", seconds, errors, counts, ending(curve))))
        for name, error in errors.items():
            unsure[name] = max(unsure[name], error)
    return Study(
        "integration",
        "Contact integration",
        f"Seconds of one response curve with {settings.harmonics} harmonics, without Floquet exponents, detached "
        "branches and the estimate of the harmonics left out; errors of its highest peak by the samples of a period.",
        "Reference: exact integration, with shorter steps; its uncertainty is what the usual steps change.",
        tuple(Quantity(name, value) for name, value in unsure.items()),
        tuple(rows),
        {},
    )
