"""The performance curve of a damper: worst amplitude per force over preload per force, one curve for every force.

The balance is positively homogeneous: with the force F, the interference v0 and the preload N0 all scaled by one
factor the motion scales by it, at the same frequency. So amplitude / F and the frequency depend on v0 / F (or N0 / F)
alone.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.parameters import Array
from nonlinear.options import OptionsError
from nonlinear.peak_curves.optimum import MOST_RESPONSES, find_optimum
from nonlinear.peak_curves.optimum_result import KINDS, Kind, Optimum, PeakCurve
from nonlinear.peak_curves.peak_search import Solve, solve_in_turn
from nonlinear.problem import Problem, ProblemTuple

OTHER = {"interference": "preload", "preload": "interference"}


@dataclass(frozen=True)
class PerformanceCurve:
    """Worst motion per unit force over the static closure per unit force, K values.

    Attributes
    ----------
    name : {"interference", "preload"}
        The static quantity p that is compared with the force: v0, m, or N0, N per node.
    ratio : (K,) float
        p / F, ascending: m/N, or N/N. Two equal values bound a jump.
    compliance : (K,) float
        Amplitude of the worst motion per force, m/N.
    frequency_hz : (K,) float
        Its frequency, Hz.
    motion, source, origin : (K,) str
        As of `WorstEnvelope`.
    curves : tuple of PeakCurve
        The followed peaks, with `value` p / F and `amplitude_m` per force.
    best_ratio, least_compliance, best_frequency_hz : float
        The optimum: p / F, amplitude per force, frequency.
    kind : str
        Kind of the optimum, as of `Optimum`.
    within : (float, float)
        Range of p / F in which the compliance is at most 10 % higher.
    force : float
        Force at which it was computed, N.
    message : str
        One line that says what was found.
    remarks : tuple of str
        What was searched and what was left open.

    Examples
    --------
    With the names of the example of `performance_curve`:

    >>> print(f"{found.best_value(force=2.0):.3f} N, {found.amplitude_m(force=2.0, value=6.12):.3f} m")
    6.120 N, 2.027 m
    """

    name: str
    ratio: Array
    compliance: Array
    frequency_hz: Array
    motion: NDArray[np.str_]
    source: NDArray[np.str_]
    origin: NDArray[np.str_]
    curves: tuple[PeakCurve, ...]
    best_ratio: float
    least_compliance: float
    best_frequency_hz: float
    kind: Kind
    within: tuple[float, float]
    force: float
    message: str
    remarks: tuple[str, ...] = ()

    def amplitude_m(self, force: float, value: float) -> float:
        """Worst amplitude at a force and a value of the static quantity, m; NaN beyond the curve.

        Parameters
        ----------
        force : float
            Force F, N.
        value : float
            v0, m, or N0, N.
        """
        known = np.isfinite(self.compliance)
        ratios, heights = self.ratio[known], self.compliance[known]
        return float(force * np.interp(value / force, ratios, heights, left=np.nan, right=np.nan))

    def best_value(self, force: float) -> float:
        """The static quantity with the lowest worst motion at a force: v0, m, or N0, N.

        Parameters
        ----------
        force : float
            Force F, N.
        """
        return self.best_ratio * force


def performance_curve(
    problem: ProblemTuple,
    name: str,
    low: float,
    high: float,
    progress: Callable[[str], None] = lambda line: None,
    solver: Solve = solve_in_turn,
    most_responses: int = MOST_RESPONSES,
) -> PerformanceCurve:
    """The worst motion per force over the interference or the preload per force, with its optimum.

    Parameters
    ----------
    problem : tuple
        Modes, contact, excitation and options, as the arguments of `forced_response`. The force is that of the
        excitation; the curve does not depend on it.
    name : {"interference", "preload"}
        The static quantity p.
    low, high : float
        Range of p at this force, SI units.
    progress, solver, most_responses
        As of `find_optimum`.

    Returns
    -------
    PerformanceCurve
        For every force.

    Raises
    ------
    ArithmeticError
        No response in the range has a motion that persists.
    OptionsError
        Another static quantity acts, which does not scale with p.

    Examples
    --------
    With the names of the example of `forced_response`:

    >>> from nonlinear import performance_curve
    >>> found = performance_curve((modal, contact, excitation, options), "preload", 0.5, 4.0)
    >>> print(found.message)
    preload / force = 3.06004: smooth minimum, 1.014 m/N at 0.251939 Hz
    """
    check_homogeneity(problem, name)
    found = find_optimum(problem, name, low, high, progress, solver, most_responses)
    return per_force(found, Problem(*problem).excitation.force)


def check_homogeneity(problem: ProblemTuple, name: str) -> None:
    """Refuse a problem in which scaling the force and one static quantity does not scale the motion."""
    modal, contact, excitation, _ = problem
    if name not in OTHER:
        raise OptionsError(f"parameter: {name!r}, allowed for a performance curve: {', '.join(OTHER)}")
    if excitation.force <= 0.0:
        raise OptionsError(f"force: {excitation.force:g}, allowed for a performance curve: above 0")
    if np.any(modal.at(0).static_force):
        raise OptionsError(
            "static load (centrifugal, pressure, temperature): acts, allowed for a performance curve: none, "
            f"as it does not scale with {name}"
        )
    if np.any(getattr(contact, OTHER[name])):
        raise OptionsError(
            f"{OTHER[name]}: {getattr(contact, OTHER[name]).mean():g}, allowed for a performance curve over {name}: "
            "0, as it does not scale with it"
        )
    if np.any(contact.slider_origin):
        raise OptionsError("slider_origin: not 0, allowed for a performance curve: 0")
    if name == "interference" and np.ptp(contact.interference) > 0.0:
        raise OptionsError("interference: differs from node to node, allowed for a performance curve: one value")


def per_force(found: Optimum, force: float) -> PerformanceCurve:
    """The performance curve from the optimum over the interference or the preload at one force."""
    best, least = found.value / force, found.amplitude_m / force
    curves = (
        replace(each, value=each.value / force, amplitude_m=each.amplitude_m / force) for each in found.curves
    )  # dA/dp is that of the quotients too
    said, height = KINDS[found.kind].said, f"{least:.4g} m/N at {found.frequency_hz:.6g} Hz"
    return PerformanceCurve(
        name=found.name,
        ratio=found.envelope.value / force,
        compliance=found.envelope.amplitude_m / force,
        frequency_hz=found.envelope.frequency_hz,
        motion=found.envelope.motion,
        source=found.envelope.source,
        origin=found.envelope.origin,
        curves=tuple(curves),
        best_ratio=best,
        least_compliance=least,
        best_frequency_hz=found.frequency_hz,
        kind=found.kind,
        within=(found.within[0] / force, found.within[1] / force),
        force=force,
        message=f"{found.name} / force = {best:.6g}: {said}, {height}",
        remarks=found.remarks,
    )
