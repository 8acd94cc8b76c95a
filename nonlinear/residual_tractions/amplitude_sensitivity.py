"""Sensitivity of an amplitude to the contact forces, by the adjoint of the harmonic balance.

With the amplitude A(x, omega, f) of the output, the balance R(x, omega, p) = 0 and forces f(x, p) that depend on
parameters p, the adjoint solution lambda of dR/dx^T lambda = dA/dx gives for every p at once

    dA/dp = dA/df . df/dp - lambda . dR/dp = (dA/df + G^H lambda) . df/dp,

since dR/dp = -G df/dp. On a curve this is the change at constant frequency. At a peak, where A is stationary along
the curve, it is that of the peak amplitude as well (envelope theorem).
"""

import numpy as np

from nonlinear.contact.fourier import to_complex, to_real
from nonlinear.contact.parameters import Array
from nonlinear.continuation.response_quantities import complex_force, largest_amplitude, with_mean
from nonlinear.continuation.solution_point import SolutionPoint
from nonlinear.harmonic_balance.residual import LinearisedResidual
from nonlinear.options import Measure


def amplitude_sensitivity(
    linearised: LinearisedResidual, output: str, mean: Measure, peak: SolutionPoint | None = None
) -> Array:
    """Derivative of the amplitude of an output by a change of the contact forces, (2H+1, n_c, 3), m/N.

    Shapes: returns (2H+1, n_c, 3).
    """
    direct, adjoint = amplitude_adjoint(linearised, output, mean, peak)
    balance, shape = linearised.balance, linearised.contact.force.shape
    rows = np.zeros((shape[0], shape[1] * 3))
    rows[balance.first_row :] = adjoint.reshape(-1, rows.shape[1])
    back = balance.receptance.matrix(linearised.omega).conj().transpose(0, 2, 1) @ to_complex(rows)[..., None]
    return direct + to_real(back[..., 0]).reshape(shape)


def amplitude_adjoint(
    linearised: LinearisedResidual, output: str, mean: Measure, peak: SolutionPoint | None = None
) -> tuple[Array, Array]:
    """dA/df (2H+1, n_c, 3) at constant displacement, m/N, and the adjoint solution lambda (n,).

    Parameters as in `amplitude_sensitivity`.
    """
    balance, omega, contact = linearised.balance, linearised.omega, linearised.contact
    receptance, shape = balance.receptance, contact.force.shape
    coordinates, dcoordinates = receptance.modal_response(omega, complex_force(contact))
    amplitude = largest_amplitude(with_mean(receptance.output(output, coordinates), mean))
    turn = amplitude.sign * np.exp(1j * np.arange(coordinates.shape[0]) * amplitude.angle)
    if mean is not None:
        turn = with_mean(turn, mean if mean == "harmonic_1" else 0.0)
    # Re(sum_h row_h f_h) = conj(row) . f in real coefficients
    direct = to_real((receptance.output_rows(output, omega) * turn[:, None]).conj()).reshape(shape)
    dA_dx = np.einsum("ika,kabij->jkb", direct, contact.jacobian)[balance.first_row :].reshape(-1)
    if peak is None:
        return direct, np.linalg.solve(linearised.jacobian.T, dA_dx)
    dA_domega = float((turn * receptance.output(output, dcoordinates)).sum().real)
    return direct, _bordered_adjoint(linearised, peak, dA_dx, dA_domega)


def _bordered_adjoint(linearised: LinearisedResidual, peak: SolutionPoint, dA_dx: Array, dA_domega: float) -> Array:
    """The adjoint solution of the system bordered by the tangent of the curve, scaled by its metric."""
    metric, size = peak.metric, dA_dx.size
    matrix = np.empty((size + 1, size + 1))
    matrix[:size, :size] = linearised.jacobian
    matrix[:size, size] = linearised.dR_domega * (metric.omega / metric.length)
    matrix[size, :size], matrix[size, size] = peak.tangent[0] / metric.length, peak.tangent[1] / metric.omega
    right = np.append(dA_dx, dA_domega * metric.omega / metric.length)
    return np.asarray(np.linalg.solve(matrix.T, right)[:size], dtype=np.float64)
