"""Unknowns of a ring pair by pair, and products of its receptance with the Jacobian of the contact forces."""

from __future__ import annotations

import numpy as np

from nonlinear.contact.fourier import ComplexArray
from nonlinear.contact.parameters import Array


def by_pair(values: Array, n_rows: int, n_blades: int) -> Array:
    """Values in the order coefficient, pair, dof as (N_b, coefficients and dofs)."""
    return np.ascontiguousarray(values.reshape(n_rows, n_blades, -1).transpose(1, 0, 2)).reshape(n_blades, -1)


def from_pairs(values: Array, n_rows: int) -> Array:
    """The inverse of `by_pair`."""
    return values.reshape(len(values), n_rows, -1).transpose(1, 0, 2).reshape(-1)


def pair_force_change(jacobian: Array, n_blades: int) -> ComplexArray:
    """df/dx of the nodes of each pair: (N_b, H+1, n_c, 3, 3 (2H+1)) complex force coefficients."""
    nodes, rows = jacobian.shape[0], jacobian.shape[3]
    by_row = jacobian.transpose(0, 3, 1, 4, 2).reshape(nodes, rows, 3, 3 * rows)
    change = np.zeros((nodes, (rows + 1) // 2, 3, 3 * rows), complex)
    change[:, 0] = by_row[:, 0]
    change.real[:, 1:], change.imag[:, 1:] = by_row[:, 1::2], by_row[:, 2::2]
    return change.reshape(n_blades, nodes // n_blades, *change.shape[1:]).transpose(0, 2, 1, 3, 4)


def real_product(receptance: ComplexArray, change: ComplexArray) -> Array:
    """G df/dx of all pairs, (N_b, b, b), rows and columns in the order coefficient, node, component.

    Shapes: `receptance` (N_b, H+1, 3 n_c, 3 n_c).
    """
    n_blades, n_h, dofs, _ = receptance.shape
    n_c = dofs // 3
    faces = receptance.reshape(n_blades, n_h, dofs, n_c, 3).transpose(0, 1, 3, 2, 4)
    moved = faces @ change  # (N_b, H+1, node of the force, dof, coefficient and component of its displacement)
    rows = 2 * n_h - 1
    real = np.empty((n_blades, rows, dofs, rows, n_c, 3))
    split = moved.reshape(n_blades, n_h, n_c, dofs, rows, 3).transpose(0, 1, 3, 4, 2, 5)
    real[:, 0] = split[:, 0].real
    real[:, 1::2], real[:, 2::2] = split[:, 1:].real, split[:, 1:].imag
    return real.reshape(n_blades, rows * dofs, rows * dofs)
