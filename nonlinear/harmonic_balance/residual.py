"""Harmonic balance in the relative contact displacements: residual, Jacobian, derivative in the frequency.

The balance of the contact dofs (Gulisano et al. 2011, eq. 6), written in the relative displacements of the contact
nodes (eq. 17) with the contact forces on both faces (eq. 18), is

    R^(h)(d, omega) = d^(h) - d_lin^(h)(omega) - G^(h)(omega) f^(h)(d) = 0,    h = 0 .. H,

    G^(h) = B_h r^(h) B_h^H,    B_h q^(h) = q_R^(h) - q_L^(h) exp(i h psi),

with the receptance r^(h) of the blade, its inter-blade phase angle psi, the response d_lin without contact forces and
the contact forces f on the right nodes. d_lin and G come from `rom.RelativeReceptance`, f and df/dd from the contact
element.
"""

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.element_choice import evaluation_work
from nonlinear.contact.fourier import ComplexArray, to_complex, to_real
from nonlinear.contact.parameters import Array, ContactElement, ContactForces, ContactParameters
from nonlinear.harmonic_balance.condensed_factors import SMALLEST_PROBLEM, CondensedFactors, DenseFactors
from nonlinear.harmonic_balance.newton_decisions import SMALLEST_VIBRATION, SOFT
from rom.cyclic.receptance import RelativeReceptance

FACTORS_WORK = 0.01  # of an iteration for each unknown, as measured with condensed factors
STATIC_RESOLUTION = 1e-3  # a tolerance of 1e-13 of it is the round-off of the motion of one side


@dataclass(frozen=True)
class InterferenceChange:
    """How a balance changes with a parameter on which only the interference depends, linearly."""

    # (n_c,), change of the interference per unit of the parameter, m. A contact force depends on d_n + v0 only, so
    # that the balance changes with the parameter as with harmonic 0 of the normal displacement that the contacts see
    shift: Array
    defect_rate: Array  # (n,), change of the residual that counts as zero per unit of the parameter, m


@dataclass(frozen=True)
class Parameter:
    """What the parameter of a balance is."""

    name: str
    omega: float | None = None  # excitation frequency, rad/s; None: it is the parameter itself
    limits: tuple[float, float] | None = None  # range that is of interest; None: the frequency range
    change: InterferenceChange | None = None  # how the balance changes, where only the interference does
    # the parameter at which the interference is that of the contact element, and no residual but zero counts as zero
    origin: float = 0.0

    @property
    def lowest(self) -> float:
        """What the parameter must exceed."""
        return 0.0 if self.omega is None else float("-inf")


FREQUENCY = Parameter("frequency")


class BorderedFactors(Protocol):
    """Solver of a bordered system [J, c; t, e] with J = dR/dx."""

    @property
    def sign(self) -> int:
        """Sign of the determinant."""
        ...

    def solve(self, right: Array, last: float) -> tuple[Array, float]:
        """Solution (x (n,), z) for the right-hand side (b (n,), b_e)."""
        ...


@dataclass(frozen=True)
class LinearisedResidual:
    """The residual R and its derivatives at one state (x, omega)."""

    balance: "HarmonicBalance"  # the equations
    omega: float  # excitation frequency, rad/s
    residual: Array  # (n,) R, m
    dR_dp: Array  # (n,) derivative of R with respect to the parameter of the balance, omega in most, at constant x
    contact: ContactForces  # contact forces and their Jacobian

    @cached_property
    def coupling(self) -> tuple[Array, NDArray[np.intp]]:
        """G df/dx in the columns of the active unknowns, (n, n_active), and the indices of these unknowns.

        An unknown is active if a contact force depends on it. The other columns of G df/dx are zero.
        """
        balance = self.balance
        matrix = balance.receptance.matrix(self.omega)
        product = receptance_times_force_jacobian(matrix, self.contact.jacobian, balance.first_row)
        rows = product.shape[0] // (3 * balance.n_contacts)
        unknowns = np.arange(product.shape[0]).reshape(rows, balance.n_contacts, 3).transpose(1, 0, 2)
        active = self._active(rows)
        if active is None:
            return product, unknowns.reshape(-1)
        return product[:, active.reshape(-1)], unknowns[active]

    def _active(self, rows: int) -> NDArray[np.bool_] | None:
        """Which unknowns are active, (n_c, rows, 3); None if all are. An odd balance has no even harmonics."""
        depends: NDArray[np.bool_] = np.any(self.contact.jacobian, axis=(1, 3, 4))
        if depends.all() and not self.balance.odd:
            return None
        active = np.repeat(depends[:, None, :], rows, axis=1)
        if self.balance.odd:
            first = self.balance.first_row
            active[:, 3 - first :: 4] = active[:, 4 - first :: 4] = False
        return active

    @cached_property
    def jacobian(self) -> Array:
        """dR/dx = I - G df/dx, (n, n)."""
        product, active = self.coupling
        jacobian = np.eye(self.residual.size)
        jacobian[:, active] -= product
        return jacobian

    def factorise(self, column: Array, row: Array, corner: float) -> BorderedFactors:
        """Factors of the bordered Jacobian [dR/dx, c; t, e]. `column`, `row` (n,): c and t."""
        if self.residual.size >= SMALLEST_PROBLEM:
            balance, border = self.balance, (column, row, corner)
            found = CondensedFactors.of(
                lambda: DenseFactors.of(self.coupling, *border),
                balance.receptance,
                self.omega,
                self.contact.jacobian,
                border,
                first=balance.first_row,
                odd=balance.odd,
            )
            if found is not None:
                return found
        return DenseFactors.of(self.coupling, column, row, corner)

    def solve(self, right: Array) -> Array:
        """Solution of dR/dx x = b, (n,); NaN or infinity if dR/dx is singular. `right` (n,): b."""
        border = np.zeros_like(right)
        return self.factorise(border, border, 1.0).solve(right, 0.0)[0]


def has_odd_harmonics_only(receptance: RelativeReceptance, contact: ContactParameters) -> bool:
    """Whether half a period later all forces are opposite: neither contact nor excitation has even harmonics."""
    return contact.odd and all(h % 2 == 1 for h in receptance.excited_harmonics)


@dataclass(frozen=True)
class HarmonicBalance:
    """R^(h) = d^(h) - d_lin^(h)(omega) - G^(h)(omega) f^(h)(d) = 0 (Gulisano et al. 2011, eqs. 6, 17 and 18).

    The unknown x holds the real Fourier coefficients of d: rows (0, Re 1, Im 1, Re 2, ...) of 3 n_c numbers each,
    metres.
    """

    receptance: RelativeReceptance  # the structure: G, d_lin and the harmonics 0 .. H
    element: ContactElement  # the contact forces f(d)
    # (n_c, 3) given harmonic 0 of d, which is then not balanced: the second step of the classical two-step method
    frozen_static: Array | None = None
    # length far below any displacement of interest, m. It keeps relative errors finite where nothing moves
    tiny: float = 1e-15
    # there are no even harmonics (see `has_odd_harmonics_only`). They stay zero and are not solved for
    odd: bool = False
    # (n,) residual that counts as zero, m: what the solution of another problem leaves of this one (see `Homotopy`)
    defect: Array | None = None

    @property
    def parameter(self) -> Parameter:
        """The parameter p of R(x, p) = 0."""
        return FREQUENCY

    @property
    def is_modal_sum(self) -> bool:
        """Whether R is what the kernels write out: every harmonic balanced, G the plain sum over the modes."""
        return self.frozen_static is None and type(self.receptance) is RelativeReceptance

    @property
    def n_contacts(self) -> int:
        """Number of contact nodes n_c."""
        return self.receptance.modal.n_contacts

    @property
    def n_harmonics(self) -> int:
        """Number of harmonics H; harmonic 0 not counted."""
        return len(self.receptance.harmonics) - 1

    @property
    def first_row(self) -> int:
        """First unknown row of coefficients: 1 if harmonic 0 is frozen, else 0."""
        return 0 if self.frozen_static is None else 1

    @property
    def size(self) -> int:
        """Number of real unknowns n."""
        return (2 * len(self.receptance.harmonics) - 1 - self.first_row) * 3 * self.n_contacts

    @property
    def iteration_work(self) -> float:
        """Work of a Newton iteration, millions of operations: contact forces and dense factors."""
        return evaluation_work(self.element) + FACTORS_WORK * self.size

    def displacement(self, unknown: Array) -> Array:
        """Real Fourier coefficients of d, (2H+1, n_c, 3), a frozen harmonic 0 included. `unknown` (n,): x, m."""
        rows = unknown.reshape(-1, self.n_contacts, 3)
        return rows if self.frozen_static is None else np.concatenate([self.frozen_static[None], rows])

    def unknown(self, displacement: Array) -> Array:
        """The unknown x, (n,), of a displacement: the inverse of `displacement`.

        `displacement` (2H+1, n_c, 3): real Fourier coefficients of d, m.
        """
        return displacement[self.first_row :].reshape(-1)

    def forces(self, unknown: Array) -> ContactForces:
        """Contact forces and their Jacobian. `unknown` (n,): x, m."""
        return self.forces_of(self.displacement(unknown))

    def forces_of(self, displacement: Array) -> ContactForces:
        """Contact forces of a displacement, a frozen harmonic 0 included.

        `displacement` (2H+1, n_c, 3): real Fourier coefficients, m.
        """
        forces = self.element.evaluate(displacement)
        if self.odd:
            forces.force[3::4] = forces.force[4::4] = 0.0  # round-off, which stiff contacts would amplify
        return forces

    def with_force(self, force: float) -> "HarmonicBalance":
        """The same balance under another excitation amplitude."""
        return replace(self, receptance=replace(self.receptance, force=force))

    def evaluate(self, unknown: Array, omega: float) -> LinearisedResidual:
        """Residual and derivatives. `unknown` (n,): x, m; `omega`: excitation frequency, rad/s."""
        contact = self.forces(unknown)
        force = to_complex(contact.force.reshape(contact.force.shape[0], -1))
        response, dresponse_domega = self.receptance.response(omega, force)
        first = self.first_row
        residual = unknown - to_real(response)[first:].reshape(-1)
        if self.defect is not None:
            residual -= self.defect
        return LinearisedResidual(self, omega, residual, -to_real(dresponse_domega)[first:].reshape(-1), contact)

    def vibration(self, unknown: Array) -> float:
        """2-norm of harmonics 1 .. H, m. `unknown` (n,): x, m."""
        dynamic = unknown[(1 - self.first_row) * 3 * self.n_contacts :]
        return math.sqrt(dynamic @ dynamic)

    def relative_error(self, residual: Array, unknown: Array) -> float:
        """Norm of a residual (n,) relative to the displacement.

        The static rows count relative to the whole displacement, the dynamic rows relative to the vibration. On a
        soft support the residual is that share of a force that moves a body as far as a contact: see `weighted`. A
        vibration a million times smaller than the static displacement is not resolved further: round-off of the
        contact forces does not allow it.

        `residual` (n,): R, m; `unknown` (n,): x, m.
        """
        total = math.sqrt(unknown @ unknown) + self.tiny + self.static_resolution
        vibration = max(self.vibration(unknown), SMALLEST_VIBRATION * total)
        dynamic, weighted = self.vibration(residual) / vibration, self.weighted(residual)
        return max(dynamic, math.sqrt(weighted @ weighted) / total)

    def weighted(self, residual: Array) -> Array:
        """A residual (n,) in which a force on a body counts by its displacement on the contacts, not on the support.

        `residual` (n,): R, m.
        """
        motions = self.floating_motions
        if not motions.shape[1]:
            return residual
        found, size = residual.copy(), len(motions)
        found[:size] = counted_at_contacts(found[:size], motions)
        return found

    @cached_property
    def floating_motions(self) -> Array:
        """Orthonormal motions (3 n_c, r) of the contacts by bodies that these alone hold."""
        receptance = self.receptance
        if receptance.support is None or self.frozen_static is not None:
            return np.zeros((3 * self.n_contacts, 0))
        return np.linalg.qr(receptance.relative[0].real[:, : receptance.floating])[0]

    @cached_property
    def static_resolution(self) -> float:
        """Static relative displacement (m) below which the difference of both sides is round-off.

        A static force that moves both sides alike causes a relative displacement of pure round-off.
        """
        receptance = self.receptance
        if receptance.harmonics[0] != 0 or self.frozen_static is not None:
            return 0.0
        free = np.abs(receptance.modal_force[0] / receptance.modes.total_stiffness[0].real)
        free[: receptance.floating] = 0.0
        right = np.abs(receptance.modal.at(0).right)
        return STATIC_RESOLUTION * float(np.linalg.norm(right @ free[: right.shape[1]]))


def counted_at_contacts(residual: NDArray[Any], motions: NDArray[Any]) -> NDArray[Any]:
    """Residuals (..., n) or (..., n, k) of harmonic 0, see `HarmonicBalance.weighted`.

    Shapes: `motions` (..., n, r), orthonormal ones of bodies that contacts alone hold.
    """
    found: NDArray[Any] = residual - (1.0 - SOFT) * motions @ (motions.conj().swapaxes(-1, -2) @ residual)
    return found


def receptance_times_force_jacobian(receptance: ComplexArray, jacobian: Array, first: int) -> Array:
    """G df/dx in real coefficients, in the rows and columns of coefficients from `first` on.

    The force Jacobian is block diagonal in the nodes: a node needs one small product per harmonic.
    Shapes: `receptance` (H+1, 3 n_c, 3 n_c), `jacobian` (n_c, 3, 3, 2H+1, 2H+1), returns (n, n).
    """
    n_h, n_contacts, rows = receptance.shape[0], jacobian.shape[0], jacobian.shape[3]
    columns = 3 * (rows - first)
    by_row = jacobian[..., first:].transpose(3, 0, 1, 4, 2).reshape(rows, n_contacts, 3, columns)
    derivative = np.zeros((n_h, n_contacts, 3, columns), dtype=complex)
    derivative[0] = by_row[0]
    derivative.real[1:], derivative.imag[1:] = by_row[1::2], by_row[2::2]
    blocks = receptance.reshape(n_h, 3 * n_contacts, n_contacts, 3).transpose(0, 2, 1, 3)
    product = (blocks @ derivative).transpose(0, 2, 1, 3)
    result = np.empty((rows, 3 * n_contacts, n_contacts, columns))
    result[0] = product[0].real
    result[1::2], result[2::2] = product[1:].real, product[1:].imag
    return result[first:].reshape((rows - first) * 3 * n_contacts, -1)
