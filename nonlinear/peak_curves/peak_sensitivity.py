"""Derivatives of amplitude and frequency of a peak on a solved curve with respect to parameters.

The derivative of the amplitude is that of the adjoint (`peak_derivatives`). The frequency of a peak has no such
formula without second derivatives of the balance: its derivative is the central difference of two peaks that are
solved for, at the parameter a little above and below.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from nonlinear.continuation.solution_point import SolutionPoint
from nonlinear.peak_curves.parameter_family import ParameterFamily, Problem, parameter_value
from nonlinear.peak_curves.peak_curve import PeakContinuation
from nonlinear.peak_curves.peak_derivatives import peak_derivatives
from nonlinear.peak_curves.peak_search import stored_point
from nonlinear.response_curve import ResponseCurve

RELATIVE_DIFFERENCE = 1e-4  # of a parameter, for the frequency


@dataclass(frozen=True)
class PeakSensitivity:
    """A peak with its derivatives.

    Attributes
    ----------
    amplitude_m, frequency_hz : float
        The peak.
    amplitude : mapping of str to float
        Derivative of the amplitude with respect to each parameter, m per unit; those of which nothing is known are
        left out.
    frequency : mapping of str to float
        Derivative of the frequency, Hz per unit.

    Examples
    --------
    With the names of the example of `forced_response`.

    Twice the force and twice the preload double the response:

    >>> from nonlinear import peak_sensitivity
    >>> found = peak_sensitivity((modal, contact, excitation, options), curve, curve.peak.index, ["force", "preload"])
    >>> scaled = 1.0 * found.amplitude["force"] + 2.0 * found.amplitude["preload"]
    >>> bool(abs(scaled / found.amplitude_m - 1.0) < 1e-6)
    True
    """

    amplitude_m: float
    frequency_hz: float
    amplitude: Mapping[str, float]
    frequency: Mapping[str, float]


def peak_sensitivity(
    problem: Problem, branch: ResponseCurve, index: int, names: Sequence[str]
) -> PeakSensitivity | None:
    """Derivatives of a peak with respect to parameters; None where no peak is found near the point.

    Parameters
    ----------
    problem : tuple
        Modes, contact, excitation and options of the curve, as for `forced_response`.
    branch : ResponseCurve
        The branch of the curve.
    index : int
        Index of the peak among the points of the branch.
    names : sequence of str
        Parameters by the names of `find_optimum`; "damping" is a factor on the damping of all modes.

    Returns
    -------
    PeakSensitivity or None
        The peak and its derivatives.

    Raises
    ------
    OptionsError
        There is no such parameter.

    Examples
    --------
    With the names of the example of `forced_response`:

    >>> from nonlinear import peak_sensitivity
    >>> found = peak_sensitivity((modal, contact, excitation, options), curve, curve.peak.index, ["friction"])
    >>> print(f"{found.frequency_hz:.3f} Hz, {found.frequency['friction']:.3f} Hz per unit of friction")
    0.198 Hz, 0.302 Hz per unit of friction
    """
    modal, contact, excitation, options = problem
    fixed = modal, contact, excitation, replace(options, harmonics=branch.harmonics)
    steps = {name: _step(fixed, name, branch, index) for name in names}
    follower = PeakContinuation(ParameterFamily(fixed, "force", excitation.force, 2.0 * excitation.force))
    start = stored_point(follower.continuation(0.0), branch, index)
    peak = follower.peak_near(0.0, start)
    if peak is None or not peak.is_maximum:
        return None
    frequency = {}
    for name, step in steps.items():
        difference = None if step == 0.0 else _frequency_difference(fixed, name, step, peak.point)
        if difference is not None:
            frequency[name] = difference
    known = [name for name, step in steps.items() if step != 0.0]
    amplitude = peak_derivatives(fixed, peak.point, known)
    return PeakSensitivity(peak.amplitude, peak.point.omega / (2.0 * np.pi), amplitude, frequency)


def _step(problem: Problem, name: str, branch: ResponseCurve, index: int) -> float:
    """Difference of a parameter, relative to its value; of the interference to the normal motion as well."""
    value = abs(parameter_value(problem, name))
    if name == "interference":
        value = max(value, float(np.abs(branch.relative_displacement[index, :, :, 2]).max()))
    return RELATIVE_DIFFERENCE * value


def _frequency_difference(problem: Problem, name: str, step: float, peak: SolutionPoint) -> float | None:
    """Derivative of the frequency of the peak, Hz per unit of the parameter; None where a peak is not found again."""
    value = parameter_value(problem, name)
    follower = PeakContinuation(ParameterFamily(problem, name, value - step, value + step))
    below, above = (follower.peak_near(share, peak) for share in (0.0, 1.0))
    if below is None or above is None:
        return None
    return float((above.point.omega - below.point.omega) / (4.0 * np.pi * step))
