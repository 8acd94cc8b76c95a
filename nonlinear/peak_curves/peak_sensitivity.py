"""Derivatives of amplitude and frequency of a peak with respect to the parameters of contact, load and damping.

At a peak the amplitude A(x, omega, p) is stationary along the response curve R(x, omega, p) = 0. With the adjoint
solution (lambda, kappa) of the system bordered by the tangent t of the curve,

    [dR/dx, dR/domega; t_x, t_omega]^T (lambda, kappa) = (dA/dx, dA/domega),

one solution gives the derivative of the peak for every p at once,

    dA/dp = (dA/dp at constant x, omega) - lambda dR/dp.

The derivatives at constant x and omega are central differences of explicit formulas; one-sided ones of second order
where a parameter is 0 and cannot be negative. The frequency of a peak has no such formula without second derivatives
of the balance: its derivative is the central difference of two peaks that are solved for.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from nonlinear.continuation.response_quantities import output_amplitude
from nonlinear.continuation.solution_point import SolutionPoint
from nonlinear.harmonic_balance.residual import HarmonicBalance
from nonlinear.options import SolverOptions
from nonlinear.peak_curves.parameter_family import (
    PARAMETERS,
    ParameterFamily,
    parameter_value,
    with_parameter,
)
from nonlinear.peak_curves.peak_curve import PeakContinuation
from nonlinear.peak_curves.peak_search import stored_point
from nonlinear.problem import Problem, ProblemTuple
from nonlinear.residual_tractions.extreme_amplitude import amplitude_adjoint
from nonlinear.response_curve import ResponseCurve
from nonlinear.response_solver import build_harmonic_balance

RELATIVE_DIFFERENCE = 1e-6
RELATIVE_FREQUENCY_DIFFERENCE = 1e-4  # of a parameter, for the frequency


def peak_derivatives(
    problem: ProblemTuple, peak: SolutionPoint, names: Sequence[str] = PARAMETERS
) -> dict[str, float]:
    """dA/dp in m per unit of each parameter; a parameter that is 0 and has no natural unit is left out."""
    problem, found = Problem(*problem), {}
    options = problem.options
    linearised = peak.balance.evaluate(peak.unknown, peak.omega)
    _, adjoint = amplitude_adjoint(linearised, options.output, options.measure, peak)

    def objective(name: str, value: float) -> float:
        """A - lambda R at the unknowns of the peak, less than a constant."""
        balance = build_harmonic_balance(*with_parameter(problem, name, value))
        return _amplitude(balance, peak, options) - float(
            adjoint @ balance.evaluate(peak.unknown, peak.omega).residual
        )

    for name in names:
        step = RELATIVE_DIFFERENCE * _natural_unit(problem, peak, name)
        if step == 0.0:
            continue
        value = parameter_value(problem, name)
        if name == "interference" or value > step:
            found[name] = (objective(name, value + step) - objective(name, value - step)) / (2.0 * step)
        else:
            ahead = [objective(name, value + k * step) for k in range(3)]
            found[name] = (-3.0 * ahead[0] + 4.0 * ahead[1] - ahead[2]) / (2.0 * step)
    return found


def _natural_unit(problem: Problem, peak: SolutionPoint, name: str) -> float:
    """Size of a parameter: its value; of the interference the normal motion too; where it is 0, that of its kind."""
    contact = problem.contact
    value = abs(parameter_value(problem, name))
    motion = float(np.abs(peak.displacement[:, :, 2]).max())
    if name == "interference":
        return max(value, motion)
    if value > 0.0:
        return value
    if name == "preload":
        return float(contact.normal_stiffness.mean()) * motion
    if name == "friction":
        return 1.0
    stiffnesses = contact.normal_stiffness.mean(), contact.tangential_stiffness.mean()
    return float(max(stiffnesses)) if name in ("normal_stiffness", "tangential_stiffness") else 0.0


def _amplitude(balance: HarmonicBalance, peak: SolutionPoint, options: SolverOptions) -> float:
    """Amplitude of the output at the unknowns of a peak under the forces of another balance."""
    moved = replace(peak, balance=balance, contact=balance.forces(peak.unknown))
    return output_amplitude(moved, options.output, options.measure)


@dataclass(frozen=True)
class PeakSensitivity:
    """A peak with its derivatives."""

    # amplitude_m, frequency_hz: the peak
    amplitude_m: float
    frequency_hz: float
    # derivative of the amplitude with respect to each parameter, m per unit; those of which nothing is known are left
    # out
    amplitude: Mapping[str, float]
    frequency: Mapping[str, float]  # derivative of the frequency, Hz per unit


def peak_sensitivity(
    problem: ProblemTuple, branch: ResponseCurve, index: int, names: Sequence[str]
) -> PeakSensitivity | None:
    """Derivatives of a peak with respect to parameters; None where no peak is found near the point."""
    fixed = Problem(*problem).with_harmonics(branch.harmonics)
    force = fixed.excitation.force
    steps = {name: _step(fixed, name, branch, index) for name in names}
    follower = PeakContinuation(ParameterFamily.over(fixed, "force", force, 2.0 * force))
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
    return RELATIVE_FREQUENCY_DIFFERENCE * value


def _frequency_difference(problem: Problem, name: str, step: float, peak: SolutionPoint) -> float | None:
    """Derivative of the frequency of the peak, Hz per unit of the parameter; None where a peak is not found again."""
    value = parameter_value(problem, name)
    follower = PeakContinuation(ParameterFamily.over(problem, name, value - step, value + step))
    below, above = (follower.peak_near(share, peak) for share in (0.0, 1.0))
    if below is None or above is None:
        return None
    return float((above.point.omega - below.point.omega) / (4.0 * np.pi * step))
