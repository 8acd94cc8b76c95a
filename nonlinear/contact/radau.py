"""Radau collocation: points, weights and matrices on the unit interval.

References
----------
E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, 2nd ed., Springer, 1996, section IV.5.
"""

import math
from typing import NamedTuple

import numpy as np

from nonlinear.contact.parameters import Array

ORDER = 8  # collocation points; the method has order 2 * ORDER - 1 = 15


class RadauTable(NamedTuple):
    """Collocation table of n points of [0, 1]: s = 0 and the n - 1 right Radau points."""

    point: Array  # s, (n,)
    weight: Array  # of the Radau quadrature, (n,), 0 at s = 0
    legendre: Array  # values at the points to the last two Legendre coefficients, (2, n)
    derivative: Array  # values at the points to derivatives in s there, (n, n)
    bernstein: Array  # values at the points to Bernstein coefficients, (n, n)


def radau_table(order: int = ORDER) -> RadauTable:
    """Collocation table with `order` right Radau points."""
    legendre = np.polynomial.legendre
    ends = np.zeros(order + 1)
    ends[order - 1 :] = -1.0, 1.0
    x = np.sort(legendre.legroots(ends).real)
    for _ in range(3):
        x -= legendre.legval(x, ends) / legendre.legval(x, legendre.legder(ends))
    x[-1] = 1.0
    s = np.concatenate([[0.0], 0.5 * (1.0 + x)])
    gap = s[:, None] - s + np.eye(order + 1)
    barycentric = 1.0 / np.prod(gap, axis=1)
    derivative = barycentric / barycentric[:, None] / gap
    np.fill_diagonal(derivative, 0.0)
    np.fill_diagonal(derivative, -derivative.sum(axis=1))
    power = np.arange(order + 1)
    binomial = np.array([math.comb(order, k) for k in power])
    bernstein = np.linalg.inv(binomial * s[:, None] ** power * (1.0 - s[:, None]) ** (order - power))
    weight = np.append(0.0, np.linalg.solve(legendre.legvander(x, order - 1).T, np.eye(order)[0]))
    last = np.linalg.inv(legendre.legvander(2.0 * s - 1.0, order))[-2:]
    matrices = (np.ascontiguousarray(matrix, dtype=np.float64) for matrix in (last, derivative, bernstein))
    return RadauTable(s, weight, *matrices)
