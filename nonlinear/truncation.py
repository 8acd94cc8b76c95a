"""Estimate of what the harmonics that were left out would change at the peak."""

from dataclasses import replace

import numpy as np

from nonlinear.balance import HarmonicBalance
from nonlinear.contact import ContactParameters
from nonlinear.continuation import CurvePoint
from nonlinear.elements import contact_element
from nonlinear.options import SolverOptions
from nonlinear.quantities import largest_amplitude, output_harmonics

EXTRA_FACTOR, EXTRA_HARMONICS = 2, 3


def truncation_error(
    balance: HarmonicBalance,
    contact: ContactParameters,
    points: list[CurvePoint],
    peak_indices: list[int],
    options: SolverOptions,
) -> float:
    """Relative change of the highest peak's amplitude by one Newton step in a balance with more harmonics.

    The step is taken normal to the curve. A first-order estimate: small values are trustworthy, values beyond some
    per cent only say that more harmonics are needed. NaN where there is no peak.
    """
    if not peak_indices:
        return float("nan")
    output = options.output

    def height(index: int) -> float:
        return largest_amplitude(output_harmonics(balance, points[index], output)).value

    point = points[max(peak_indices, key=height)]
    n_harmonics = EXTRA_FACTOR * options.harmonics + EXTRA_HARMONICS
    wider = replace(
        balance,
        receptance=replace(balance.receptance, harmonics=tuple(range(n_harmonics + 1))),
        element=contact_element(contact, n_harmonics, options),
    )
    unknown = np.zeros(wider.size)
    unknown[: point.unknown.size] = point.unknown
    at = wider.evaluate(unknown, point.frequency)
    border = np.zeros(wider.size)
    border[: point.unknown.size] = point.tangent[0]
    length = np.linalg.norm(border) or 1.0
    omega = abs(point.tangent[1]) or point.frequency
    matrix = np.block(
        [
            [at.jacobian, (at.slope * omega / length)[:, None]],
            [border[None] / length, np.array([[point.tangent[1] / omega]])],
        ]
    )
    try:
        step = np.linalg.solve(matrix, np.append(-at.residual, 0.0))
    except np.linalg.LinAlgError:
        return float("inf")
    moved_x, moved_w = unknown + step[:-1], point.frequency + step[-1] * omega / length
    if moved_w <= 0.0:
        return float("inf")
    moved = replace(point, unknown=moved_x, frequency=moved_w, contact=wider.forces(moved_x))
    after = largest_amplitude(output_harmonics(wider, moved, output)).value
    before = largest_amplitude(output_harmonics(balance, point, output)).value
    return abs(after - before) / before if before > 0.0 else 0.0
