"""Derivatives of a peak amplitude with respect to the parameters of contact, load and damping, by the adjoint.

At a peak the amplitude A(x, omega, p) is stationary along the response curve R(x, omega, p) = 0. With the adjoint
solution (lambda, kappa) of the system bordered by the tangent t of the curve,

    [dR/dx, dR/domega; t_x, t_omega]^T (lambda, kappa) = (dA/dx, dA/domega),

one solution gives the derivative of the peak for every p at once,

    dA/dp = (dA/dp at constant x, omega) - lambda dR/dp.

The derivatives at constant x and omega are central differences of explicit formulas.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from nonlinear.continuation.response_quantities import output_amplitude
from nonlinear.continuation.solution_point import SolutionPoint
from nonlinear.harmonic_balance.residual import HarmonicBalance
from nonlinear.peak_curves.parameter_family import PARAMETERS, Problem, parameter_value, with_parameter
from nonlinear.residual_tractions.amplitude_sensitivity import amplitude_adjoint
from nonlinear.response_solver import build_harmonic_balance

RELATIVE_DIFFERENCE = 1e-6


def peak_derivatives(problem: Problem, peak: SolutionPoint, names: Sequence[str] = PARAMETERS) -> dict[str, float]:
    """dA/dp in m per unit of each parameter; a parameter that is 0 and has no natural unit is left out.

    Parameters
    ----------
    problem : tuple
        Modes, contact, excitation and options.
    peak : SolutionPoint
        The peak.
    names : sequence of str
        The parameters, see `with_parameter`.
    """
    output = problem[3].output
    found = {}
    _, adjoint = amplitude_adjoint(peak.balance.evaluate(peak.unknown, peak.omega), output, None, peak)
    for name in names:
        step = _step(problem, peak, name)
        if step == 0.0:
            continue
        value = parameter_value(problem, name)
        above, below = (
            build_harmonic_balance(*with_parameter(problem, name, value + sign * step)) for sign in (1.0, -1.0)
        )
        residual = (
            above.evaluate(peak.unknown, peak.omega).residual - below.evaluate(peak.unknown, peak.omega).residual
        )
        amplitude = _amplitude(above, peak, output) - _amplitude(below, peak, output)
        found[name] = float((amplitude - adjoint @ residual) / (2.0 * step))
    return found


def _step(problem: Problem, peak: SolutionPoint, name: str) -> float:
    """Difference of a parameter: relative to its value, of the interference to the normal motion as well."""
    value = abs(parameter_value(problem, name))
    if name == "interference":
        value = max(value, float(np.abs(peak.displacement[:, :, 2]).max()))
    return RELATIVE_DIFFERENCE * value


def _amplitude(balance: HarmonicBalance, peak: SolutionPoint, output: str) -> float:
    """Amplitude of the output at the unknowns of a peak under the forces of another balance."""
    return output_amplitude(replace(peak, balance=balance, contact=balance.forces(peak.unknown)), output)
