"""The bordered Jacobian solved by LU factors of its full size, or without these in few interface modes.

In the interface modes Q of each harmonic the receptance is G^ = Q^H G Q; outside them it is small. With K = df/dx,

    B = [ I - G K   c ]      P = [ I - Q G^ Q^H K   c ]
        [ t         e ],         [ t                e ],      B = P - E,  E = (G - Q G^ Q^H) K in the first rows.

A solution with P costs one of the size of Q: with y = Q^H K x,

    [ I - (Q^H K Q) G^    Q^H K c ] [ y ]   [ Q^H K b  ]
    [ t Q G^              e - t c ] [ z ] = [ b_e - t b ],      x = b + Q G^ y - c z,

and its determinant is that of P. B x = b is solved by the iteration x += P^-1 (b - B x), to round-off.

The norm of a power of M = P^-1 E is bounded by n random vectors g: norm(M^k) <= a sqrt(2 / pi) max norm(M^k g)
fails with probability a^-n (N. Halko, P. G. Martinsson, J. A. Tropp, SIAM Review 53, 2011, lemma 4.1). Where the
bound is below 1 for some k, so are all eigenvalues of M: the iteration converges, and det B = det P det(I - M) has
the sign of det P. Stiff contacts make M far from normal: its norm may be above 1 where its eigenvalues are below 0.1.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dgetrf, dgetrs

from nonlinear.contact.fourier import ComplexArray
from nonlinear.contact.parameters import Array
from rom.cyclic.receptance import RelativeReceptance

SMALLEST_PROBLEM = 250  # unknowns, below which dense factors cost less
NEGLECTED = 3e-2  # bound of G K in an interface mode, below which one more is enough
LARGEST_SHARE = 0.4  # of interface modes in relative displacements: with more, dense factors cost less
PROBES, BOUND = 8, 20.0  # the bound fails with probability 4e-11
MOST_POWERS = 8  # of M
STAGNATION = 3  # corrections without gain, after which the solution is as exact as round-off allows
ROUND_OFF = 1e-15
MOST_CORRECTIONS = 60
SOLVED = 1e-9  # relative residual of a solution, above which the iteration has failed


@dataclass(frozen=True)
class DenseFactors:
    """LU factors of the Jacobian J = I - G df/dx, bordered by a column and a row.

    ::

        [ J   c ] [ x ]   [ b   ]
        [ t   e ] [ z ] = [ b_e ]

    Passive unknowns, on which no contact force depends (an open contact, a direction without friction), have the
    column of the unit matrix in J: they follow from the active ones and are eliminated before the factorisation.
    """

    coupling: Array  # (n, n_active), G df/dx in the columns of the active unknowns
    # `active`, `passive`: (n_active,), indices of the active and of the passive unknowns
    active: NDArray[np.intp]
    passive: NDArray[np.intp]
    # `column`, `row`: (n,), c and t
    column: Array
    row: Array
    # `factors`, `pivots`: (n_active + 1, n_active + 1), LU factors of the transpose
    factors: Array
    pivots: NDArray[np.int32]
    sign: int  # sign of the determinant

    @classmethod
    def of(cls, coupling: tuple[Array, NDArray[np.intp]], column: Array, row: Array, corner: float) -> "DenseFactors":
        """Factorise; `coupling` is that of `LinearisedResidual`. A singular system solves to NaN or infinity."""
        product, active = coupling
        size, n_active = product.shape
        passive = np.delete(np.arange(size), active) if n_active < size else np.empty(0, dtype=np.intp)
        matrix = np.empty((n_active + 1, n_active + 1))
        np.negative(product[active], out=matrix[:-1, :-1])
        matrix[np.arange(n_active), np.arange(n_active)] += 1.0
        matrix[:-1, -1] = column[active]
        matrix[-1, :-1], matrix[-1, -1] = row[active], corner
        if passive.size:
            matrix[-1, :-1] += row[passive] @ product[passive]
            matrix[-1, -1] -= row[passive] @ column[passive]
        factors, pivots, _ = dgetrf(matrix.T, overwrite_a=1)
        swaps = int(np.count_nonzero(pivots != np.arange(n_active + 1)))
        sign = int(np.prod(np.sign(factors.diagonal()))) * (-1) ** swaps
        return cls(product, active, passive, column, row, factors, pivots, sign)

    def solve(self, right: Array, last: float) -> tuple[Array, float]:
        """Solution (x, z) for the right-hand side (b (n,), b_e)."""
        reduced = np.append(right[self.active], last)
        if self.passive.size:
            reduced[-1] -= self.row[self.passive] @ right[self.passive]
        with np.errstate(all="ignore"):
            solution, _ = dgetrs(self.factors, self.pivots, reduced, trans=1, overwrite_b=1)
        found = np.empty(right.size)
        found[self.active] = solution[:-1]
        if self.passive.size:
            uncoupled = right[self.passive] + self.coupling[self.passive] @ solution[:-1]
            found[self.passive] = uncoupled - self.column[self.passive] * solution[-1]
        return found, float(solution[-1])


@dataclass(frozen=True)
class InterfaceBasis:
    """The interface modes of a receptance at one frequency, as real matrices.

    A coefficient vector has the rows (0, Re 1, Im 1, ...). The rows of harmonics 1 .. H are taken in pairs.
    """

    static: Array  # (3 n_c, r), modes Q of harmonic 0
    # (H, 2, 3 n_c, 2, r), Q of harmonics 1 .. H: [h, part of the displacement, dof, part of the coordinate, mode]
    dynamic: Array
    static_motion: Array  # (3 n_c, r), Q G^ of harmonic 0
    dynamic_motion: Array  # (H, 2, 3 n_c, 2, r), Q G^ of harmonics 1 .. H

    @classmethod
    def of(cls, modes: ComplexArray, matrix: ComplexArray) -> "InterfaceBasis":
        """From the interface modes Q (H+1, 3 n_c, r) and the receptance G (H+1, 3 n_c, 3 n_c)."""
        motion = modes @ (modes.conj().transpose(0, 2, 1) @ (matrix @ modes))
        return cls(modes[0].real.copy(), _real_form(modes[1:]), motion[0].real.copy(), _real_form(motion[1:]))

    def to_modes(self, force: Array) -> Array:
        """Q^H f: (2H+1, 3 n_c, q) to (2H+1, r, q)."""
        n_h, _, dofs, _, r = self.dynamic.shape
        columns = force.shape[-1]
        result = np.empty((2 * n_h + 1, r, columns))
        result[0] = self.static.T @ force[0]
        matrix = self.dynamic.reshape(n_h, 2 * dofs, 2 * r).transpose(0, 2, 1)
        result[1:] = (matrix @ force[1:].reshape(n_h, 2 * dofs, columns)).reshape(2 * n_h, r, columns)
        return result

    def to_motion(self, coordinates: Array) -> Array:
        """Q G^ y: (2H+1, r, q) to (2H+1, 3 n_c, q)."""
        n_h, _, dofs, _, r = self.dynamic.shape
        columns = coordinates.shape[-1]
        result = np.empty((2 * n_h + 1, dofs, columns))
        result[0] = self.static_motion @ coordinates[0]
        matrix = self.dynamic_motion.reshape(n_h, 2 * dofs, 2 * r)
        result[1:] = (matrix @ coordinates[1:].reshape(n_h, 2 * r, columns)).reshape(2 * n_h, dofs, columns)
        return result

    def transposed(self, row: Array) -> Array:
        """(t Q G^) of a row t, (2H+1, 3 n_c), as (2H+1, r)."""
        n_h, _, dofs, _, r = self.dynamic.shape
        paired = row[1:].reshape(n_h, 1, 2 * dofs) @ self.dynamic_motion.reshape(n_h, 2 * dofs, 2 * r)
        return np.concatenate([(row[0] @ self.static_motion)[None], paired.reshape(2 * n_h, r)])


def _real_form(matrices: ComplexArray) -> Array:
    """Complex matrices (H, p, q) acting on pairs of real and imaginary parts: (H, 2, p, 2, q)."""
    result = np.empty((matrices.shape[0], 2, matrices.shape[1], 2, matrices.shape[2]))
    result[:, 0, :, 0] = result[:, 1, :, 1] = matrices.real
    result[:, 1, :, 0] = matrices.imag
    result[:, 0, :, 1] = -matrices.imag
    return result


@dataclass(frozen=True)
class ContactStiffness:
    """The force Jacobian K = df/dx, one matrix for each node."""

    # rows and columns in the order component, coefficient; zero for the coefficients that are not unknown
    matrix: Array

    @classmethod
    def of(cls, jacobian: Array, first: int, odd: bool) -> "ContactStiffness":
        """From df/dd, (n_c, 3, 3, 2H+1, 2H+1): without harmonic 0 if `first` is 1, without even ones if `odd`."""
        n_contacts, _, _, rows, _ = jacobian.shape
        blocks = np.ascontiguousarray(jacobian.transpose(0, 1, 3, 2, 4))
        unused = np.zeros(rows, dtype=bool)
        unused[:first] = True
        if odd:
            unused[3::4] = unused[4::4] = True
        if unused.any():
            blocks[:, :, unused] = 0.0
            blocks[..., unused] = 0.0
        return cls(blocks.reshape(n_contacts, 3 * rows, 3 * rows))

    def times(self, motion: Array) -> Array:
        """K x: (2H+1, 3 n_c, q) to the same shape."""
        rows, dofs, columns = motion.shape
        by_node = (
            motion.reshape(rows, dofs // 3, 3, columns).transpose(1, 2, 0, 3).reshape(dofs // 3, 3 * rows, columns)
        )
        product = (self.matrix @ by_node).reshape(dofs // 3, 3, rows, columns)
        return product.transpose(2, 0, 1, 3).reshape(rows, dofs, columns)

    def in_modes(self, basis: InterfaceBasis) -> Array:
        """Q^H K Q G^, (R, R) with R = (2H+1) r."""
        n_contacts, r = self.matrix.shape[0], basis.static.shape[1]
        n_h = basis.dynamic.shape[0]
        rows = 2 * n_h + 1
        columns = self.matrix.reshape(n_contacts, 3 * rows, 3, rows)
        static = columns[..., 0] @ basis.static_motion.reshape(n_contacts, 3, r)
        pairs = columns[..., 1:].reshape(n_contacts, 3 * rows, 3, n_h, 2).transpose(0, 3, 1, 2, 4)
        motion = basis.dynamic_motion.reshape(n_h, 2, n_contacts, 3, 2 * r).transpose(2, 0, 3, 1, 4)
        dynamic = pairs.reshape(n_contacts, n_h, 3 * rows, 6) @ motion.reshape(n_contacts, n_h, 6, 2 * r)
        by_row = np.empty((rows, n_contacts, 3, rows * r))
        by_row[..., :r] = static.reshape(n_contacts, 3, rows, r).transpose(2, 0, 1, 3)
        by_harmonic = by_row[..., r:].reshape(rows, n_contacts, 3, n_h, 2 * r)  # a view
        by_harmonic[:] = dynamic.reshape(n_contacts, n_h, 3, rows, 2 * r).transpose(3, 0, 2, 1, 4)
        return basis.to_modes(by_row.reshape(rows, 3 * n_contacts, rows * r)).reshape(rows * r, rows * r)


def _mode_count(neglected: Array, dofs: int) -> int:
    """Number of interface modes; `neglected`: bounds of G K in each mode, descending."""
    most = min(int(LARGEST_SHARE * dofs), neglected.size - 1)
    return min(int(np.count_nonzero(neglected > NEGLECTED)) + 1, most)


def _condensed_matrix(
    matrix: ComplexArray,
    stiffness: ContactStiffness,
    basis: InterfaceBasis,
    border: tuple[Array, Array, float],
    first: int,
) -> Array:
    """P condensed to the interface modes, (R + 1, R + 1), see the head of the file."""
    column, row, corner = border
    rows, dofs = 2 * matrix.shape[0] - 1, matrix.shape[1]
    shaped = np.zeros((2, rows, dofs))
    shaped[:, first:] = np.stack([column, row]).reshape(2, rows - first, dofs)
    size = rows * basis.static.shape[1]
    condensed = np.empty((size + 1, size + 1))
    np.negative(stiffness.in_modes(basis), out=condensed[:-1, :-1])
    condensed.flat[: size * (size + 2) : size + 2] += 1.0
    condensed[:-1, -1] = basis.to_modes(stiffness.times(shaped[0][..., None])).reshape(-1)
    condensed[-1, :-1] = basis.transposed(shaped[1]).reshape(-1)
    condensed[-1, -1] = corner - row @ column
    return condensed


@dataclass(frozen=True)
class CondensedFactors:
    """Solver of the bordered system B, see the head of the file; by dense factors where the iteration fails."""

    build_dense: Callable[[], DenseFactors]  # dense factors of B
    matrix: ComplexArray  # (H+1, 3 n_c, 3 n_c), G
    stiffness: ContactStiffness  # K
    basis: InterfaceBasis  # Q and Q G^
    # `column`, `row`: (n,), c and t
    column: Array
    row: Array
    first: int  # first unknown row of coefficients, 0 or 1
    # `factors`, `pivots`: (R + 1, R + 1), LU factors of the condensed matrix, transposed
    factors: Array
    pivots: NDArray[np.int32]
    condensed_sign: int  # sign of det P

    @classmethod
    def of(
        cls,
        build_dense: Callable[[], DenseFactors],
        receptance: RelativeReceptance,
        omega: float,
        jacobian: Array,
        border: tuple[Array, Array, float],
        *,
        first: int,
        odd: bool,
    ) -> "CondensedFactors | None":
        """The factors for c, t and e; None where there are too few contact nodes.

        Shapes: `jacobian` (n_c, 3, 3, 2H+1, 2H+1), `border` (n,).
        """
        modes, values = receptance.interface_modes(omega)
        count = _mode_count(values.max(axis=0) * float(np.abs(jacobian).max()), modes.shape[1])
        if count == 0:
            return None
        matrix, stiffness = receptance.matrix(omega), ContactStiffness.of(jacobian, first, odd)
        basis = InterfaceBasis.of(modes[..., :count], matrix)
        condensed = _condensed_matrix(matrix, stiffness, basis, border, first)
        factors, pivots, _ = dgetrf(condensed.T, overwrite_a=True)
        swaps = int(np.count_nonzero(pivots != np.arange(pivots.size)))
        sign = int(np.prod(np.sign(factors.diagonal()))) * (-1) ** swaps
        return cls(build_dense, matrix, stiffness, basis, border[0], border[1], first, factors, pivots, sign)

    @cached_property
    def contracts(self) -> bool:
        """Whether the bound of a power of M is below 1, see the head of the file."""
        images = np.random.default_rng(0).standard_normal((self.column.size, PROBES))
        smallest = math.inf
        for _ in range(MOST_POWERS):
            neglected = self._neglected(self.stiffness.times(self._rows(images)))
            images, last = self._condensed_solution(neglected, np.zeros(PROBES))
            bound = BOUND * math.sqrt(2.0 / math.pi) * float(np.sqrt((images**2).sum(axis=0) + last**2).max())
            if bound < 1.0 or not bound < smallest:
                return bound < 1.0
            smallest = bound
        return False

    @cached_property
    def _dense(self) -> DenseFactors:
        return self.build_dense()

    @cached_property
    def sign(self) -> int:
        """Sign of det B."""
        return self.condensed_sign if self.contracts else self._dense.sign

    def solve(self, right: Array, last: float) -> tuple[Array, float]:
        """Solution (x, z) of B (x, z) = (b, b_e); NaN for a singular system."""
        residual, lasts = right[:, None], np.array([last])
        whole = math.hypot(math.sqrt(right @ right), last)
        solution, z = np.zeros_like(right), 0.0
        smallest, stagnations = math.inf, 0
        for _ in range(MOST_CORRECTIONS):
            change, change_z = self._condensed_solution(residual, lasts)
            solution, z = solution + change[:, 0], z + float(change_z[0])
            residual, lasts = self._neglected(self.stiffness.times(self._rows(change))), np.zeros(1)
            size = math.sqrt(residual[:, 0] @ residual[:, 0])
            stagnations = 0 if size < smallest else stagnations + 1
            smallest = min(size, smallest)
            if not size > ROUND_OFF * whole or stagnations == STAGNATION:
                break
        return (solution, z) if size <= SOLVED * whole else self._dense.solve(right, last)

    @cached_property
    def static(self) -> Array:
        """G of harmonic 0, (3 n_c, 3 n_c)."""
        return np.ascontiguousarray(self.matrix[0].real)

    def _rows(self, unknowns: Array) -> Array:
        """Unknowns (n, q) as coefficient rows (2H+1, 3 n_c, q), zero for a given harmonic 0."""
        n_h, dofs, _ = self.matrix.shape
        columns = unknowns.shape[1]
        if self.first == 0:
            return unknowns.reshape(2 * n_h - 1, dofs, columns)
        rows = np.zeros((2 * n_h - 1, dofs, columns))
        rows[1:] = unknowns.reshape(2 * n_h - 2, dofs, columns)
        return rows

    def _unknowns(self, rows: Array) -> Array:
        """The inverse of `_rows`."""
        return rows[self.first :].reshape(-1, rows.shape[-1])

    def _neglected(self, force: Array) -> Array:
        """(G - Q G^ Q^H) f of forces (2H+1, 3 n_c, q), (n, q)."""
        motion = np.empty_like(force)
        motion[0] = self.static @ force[0]
        n_h, dofs, _ = self.matrix.shape
        pairs = force[1:].reshape(n_h - 1, 2, dofs, force.shape[-1])
        moved = self.matrix[1:] @ (pairs[:, 0] + 1j * pairs[:, 1])
        motion[1::2], motion[2::2] = moved.real, moved.imag
        motion -= self.basis.to_motion(self.basis.to_modes(force))
        return self._unknowns(motion)

    def _condensed_solution(self, right: Array, last: Array) -> tuple[Array, Array]:
        """P^-1 (b, b_e) for right-hand sides (n, q) and (q,)."""
        columns = right.shape[1]
        reduced = np.empty((self.factors.shape[0], columns))
        reduced[:-1] = self.basis.to_modes(self.stiffness.times(self._rows(right))).reshape(-1, columns)
        reduced[-1] = last - self.row @ right
        with np.errstate(all="ignore"):
            solution, _ = dgetrs(self.factors, self.pivots, reduced, trans=1)
        coordinates = solution[:-1].reshape(-1, self.basis.static.shape[1], columns)
        motion = right + self._unknowns(self.basis.to_motion(coordinates)) - np.outer(self.column, solution[-1])
        return motion, solution[-1]
