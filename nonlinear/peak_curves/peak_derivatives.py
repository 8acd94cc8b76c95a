"""Derivatives of a peak amplitude with respect to the parameters of contact, load and damping, by the adjoint.

At a peak the amplitude A(x, omega, p) is stationary along the response curve R(x, omega, p) = 0. With the adjoint
solution (lambda, kappa) of the system bordered by the tangent t of the curve,

    [dR/dx, dR/domega; t_x, t_omega]^T (lambda, kappa) = (dA/dx, dA/domega),

one solution gives the derivative of the peak for every p at once,

    dA/dp = (dA/dp at constant x, omega) - lambda dR/dp.

The derivatives at constant x and omega are central differences of explicit formulas; one-sided ones of second order
where a parameter is 0 and cannot be negative.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from nonlinear.continuation.response_quantities import output_amplitude
from nonlinear.continuation.solution_point import SolutionPoint
from nonlinear.harmonic_balance.residual import HarmonicBalance
from nonlinear.options import SolverOptions
from nonlinear.peak_curves.parameter_family import PARAMETERS, Problem, parameter_value, with_parameter
from nonlinear.residual_tractions.amplitude_sensitivity import amplitude_adjoint
from nonlinear.response_solver import build_harmonic_balance

RELATIVE_DIFFERENCE = 1e-6


def peak_derivatives(problem: Problem, peak: SolutionPoint, names: Sequence[str] = PARAMETERS) -> dict[str, float]:
    """dA/dp in m per unit of each parameter; a parameter that is 0 and has no natural unit is left out."""
    options, found = problem[3], {}
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
    contact = problem[1]
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
