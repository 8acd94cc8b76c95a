"""Harmonics kept: error of the highest peak over seconds of the curve, in partial lift-off."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from work_precision.curves import FREQUENCY, PEAK, CurveCase, curve_problem, ending, peak_errors
from work_precision.study import Measured, Quantity, Study, said
from work_precision.timing import timed


@dataclass(frozen=True)
class HarmonicsSettings:
    """Numbers of harmonics, tolerances of the automatic choice, harmonics of the references, the last the finest."""

    harmonics: Sequence[int]
    tolerances: Sequence[float]
    reference: tuple[int, int]


USUAL = HarmonicsSettings((1, 2, 3, 4, 5, 6, 7, 9, 11, 13, 15), (1e-1, 1e-2, 1e-3), (19, 25))
FULL = HarmonicsSettings((*range(1, 16), 19, 23), (1e-1, 1e-2, 1e-3, 1e-4), (27, 35))


def harmonics_study(cases: Sequence[CurveCase], settings: HarmonicsSettings, store: Path) -> Study:
    """Errors of the highest peak of each case with each number of harmonics.

    Raises
    ------
    InputError : a scene cannot be read.
    """
    rows: list[Measured] = []
    unsure = {PEAK: 0.0, FREQUENCY: 0.0}
    for case in cases:
        problem = curve_problem(case, store)
        nearly, reference = (problem.solve(harmonics=n) for n in settings.reference)
        for name, change in peak_errors(nearly, reference).items():
            unsure[name] = max(unsure[name], change)
        for n in settings.harmonics:
            curve, seconds = timed(lambda problem=problem, n=n: problem.solve(harmonics=n))
            errors = peak_errors(curve, reference)
            counts = {"points": curve.points, "harmonics": n}
            rows.append(said(Measured(f"{case.label}: H", f"{n}", seconds, errors, counts, ending(curve))))
        for tolerance in settings.tolerances:
            curve, seconds = timed(
                lambda problem=problem, e=tolerance: problem.solve(harmonics="auto", harmonic_tolerance=e)
            )
            errors = peak_errors(curve, reference)
            counts = {"points": curve.points, "harmonics": curve.harmonics}
            rows.append(
                said(
                    Measured(
                        f'{case.label}: tolerance of "auto"', f"{tolerance:g}", seconds, errors, counts, ending(curve)
                    )
                )
            )
    coarse, fine = settings.reference
    return Study(
        "harmonics",
        "Harmonics kept",
        "Seconds of one response curve with exact contact integration, without Floquet exponents, detached branches "
        'and the estimate of the error (which "auto" cannot do without); errors of its highest peak.',
        f"Reference: the same curve with {fine} harmonics; its uncertainty is what {coarse} change.",
        tuple(Quantity(name, value) for name, value in unsure.items()),
        tuple(rows),
        {},
    )
