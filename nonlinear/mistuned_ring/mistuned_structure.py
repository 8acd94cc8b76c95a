"""What the contact pairs of a mistuned ring see of its structure, and its unknowns pair by pair.

All Fourier coefficients are in the time of their own blade, the forces and displacements of the pairs (n_h, N_b, 3
n_nodes). A structure is modes with denominators D, forces F and the motions B of the nodes, d = B (F + B^H f) / D.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from nonlinear.contact.fourier import ComplexArray
from nonlinear.contact.parameters import Array
from nonlinear.harmonic_balance.residual import BorderedFactors
from rom.cyclic.receptance import RelativeReceptance


@dataclass(frozen=True)
class RingSystem:
    """The bordered Jacobian [dR/dx, c; t, e] of a ring at one state, as a structure needs it to factorise."""

    omega: float  # excitation frequency, rad/s
    n_blades: int
    force_jacobian: Array  # df/dx of the nodes, as `ContactForces.jacobian`
    times: Callable[[Array], Array]  # dR/dx times a change of the unknown
    column: Array  # (n,), c
    row: Array  # (n,), t
    corner: float  # e

    @property
    def n_rows(self) -> int:
        """Real coefficients of an unknown, 2H+1."""
        return int(self.force_jacobian.shape[3])

    @cached_property
    def change(self) -> ComplexArray:
        """df/dx of the nodes of each pair, see `pair_force_change`."""
        return pair_force_change(self.force_jacobian, self.n_blades)


class RingStructure(ABC):
    """The structure of a mistuned ring: clamped blades, or sectors joined at a disk. Nobody asks which."""

    tuned: RelativeReceptance  # the tuned blade or sector with its phase psi, harmonics and excitation

    @property
    @abstractmethod
    def n_blades(self) -> int:
        """Number of blades N_b."""

    @property
    @abstractmethod
    def n_nodes(self) -> int:
        """Number of nodes of a pair, those of strains counted."""

    @property
    @abstractmethod
    def modal_force(self) -> ComplexArray:
        """F of the excitation, of a shape that adds to (n_h, N_b, m)."""

    @abstractmethod
    def denominators(self, omega: float) -> tuple[ComplexArray, ComplexArray]:
        """D, (n_h, N_b, m), and its derivative in omega."""

    @abstractmethod
    def pushed(self, force: ComplexArray) -> ComplexArray:
        """B^H f: modal forces (n_h, N_b, m) of forces at the nodes."""

    @abstractmethod
    def relative(self, coordinates: ComplexArray) -> ComplexArray:
        """Relative displacements (and strains) of the pairs, of modal coordinates (n_h, N_b, m)."""

    @abstractmethod
    def output(self, name: str, coordinates: ComplexArray) -> ComplexArray:
        """An output of all blades, (N_b, n_h), of modal coordinates (n_h, N_b, m)."""

    @property
    @abstractmethod
    def floating_motions(self) -> ComplexArray:
        """Motions of the nodes of a pair by bodies that contacts alone hold, in all waves, (N_b, 3 n_nodes, r)."""

    @abstractmethod
    def factorise(self, system: RingSystem) -> BorderedFactors:
        """Factors of a bordered Jacobian."""

    def coordinates(self, omega: float, force: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
        """Modal coordinates under the excitation and the forces at the nodes, and their derivatives in omega."""
        value, derivative = self.denominators(omega)
        found = (self.modal_force + self.pushed(force)) / value
        return found, -derivative * found / value

    def increments(self, omega: float, force: ComplexArray) -> ComplexArray:
        """Change of the modal coordinates, (n_h, N_b, m), by changes of the forces."""
        found: ComplexArray = self.pushed(force) / self.denominators(omega)[0]
        return found

    def response(self, omega: float, force: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
        """Motion of the nodes under the excitation and the forces, and its derivative in omega."""
        coordinates, derivative = self.coordinates(omega, force)
        return self.relative(coordinates), self.relative(derivative)


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
