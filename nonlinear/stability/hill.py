"""Hill's method: small perturbations of a travelling wave as a condensed linear eigenvalue problem."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from nonlinear.contact.fourier import ComplexArray
from nonlinear.contact.parameters import Array
from nonlinear.stability.block_matrices import Matrix, NodeBlocks
from nonlinear.stability.cone_slider_memory import ConeSliderMemory
from nonlinear.stability.contact_feedback import ContactFeedback, DelayedCone, DelayedFriction, SliderPlaces
from nonlinear.stability.modal_condensation import ContactFreeModel
from nonlinear.stability.slider_memory import SliderMemory
from rom import ModalModel, relative_contact_motion

Memory = SliderMemory | ConeSliderMemory
REACH = 2.0
HIGHEST = 5
MOST_INVERSIONS = 12
ROUND_OFF = 1e-9  # by which a shift is kept off an eigenvalue


@dataclass(frozen=True)
class HillProblem:
    """Small perturbations of the wave q_j(t) = q(t + j psi / w) on blade j, for one pattern of the ring.

        dq_j = e^(lambda t) e^(i j kappa) sum_h p_h e^(i h (w t + j psi)),    h = -H .. H,

    relative displacement (right - left e^(i (h psi + kappa))) p_h = B_h p_h, and in modal coordinates with
    s = lambda + i h w:

        (s^2 + c_m s + w_m^2) p_h,m = phi_m^T B_h^H sum_g K_hg B_g p_g,

    K the Jacobian of the contact forces. kappa = 0 are the perturbations with the symmetry of the wave. The exponents
    of a ring of N_b blades are those of kappa = 2 pi k / N_b, k = 0 .. N_b - 1, with |Im lambda| <= w / 2: others are
    copies of these, lambda + i w for kappa + psi. -kappa has the complex conjugates.

    Most poles of the open blade are condensed to a flexibility, linear in lambda (`ContactFreeModel`). At lambda = 0 nothing
    is neglected: an exponent is zero exactly where det dR/dx is. Elsewhere the error grows with the square of
    |lambda| / (reach w).

    Attributes
    ----------
    modal, phase : the open blade and psi, rad.
    n_harmonics : H of the perturbation, that of the contact Jacobian.
    pattern : kappa, rad.
    static : whether the perturbation has a harmonic 0 (False with a frozen static displacement).
    reach : distance of the poles that are condensed from the strip, in units of w; np.inf: none is.
    highest : harmonics above this keep the poles near the strip only, and none of modes above (highest + reach) w.
    """

    modal: ModalModel
    phase: float
    n_harmonics: int
    pattern: float = 0.0
    static: bool = True
    reach: float = REACH
    highest: int = HIGHEST

    @property
    def symmetric(self) -> bool:
        """Whether the exponents come in complex conjugate pairs: B_-h is the complex conjugate of B_h."""
        return self.modal.left is None or abs(np.sin(self.pattern)) < 1e-12

    @cached_property
    def blade(self) -> ContactFreeModel:
        """The open blade in real motions of the harmonics 0, 1, 2, ..., or in the harmonics 0, 1, -1, 2, -2, ..."""
        harmonics = np.arange(1.0, self.n_harmonics + 1.0)
        if not self.symmetric:
            harmonics = np.stack([harmonics, -harmonics], axis=1).ravel()
        if self.static:
            harmonics = np.append(0.0, harmonics)
        phases = harmonics * self.phase + self.pattern
        relative = relative_contact_motion(self.modal.right, self.modal.left, phases)
        return ContactFreeModel(self.modal, harmonics, relative, self.reach, self.highest, self.symmetric)

    @cached_property
    def _to_real(self) -> Matrix | None:
        """Real coefficients from the amplitudes p_0, p_1, p_-1, ...: Re_h = p_h + p_-h, Im_h = -i (p_h - p_-h)."""
        if self.symmetric:
            return None
        size = 2 * self.n_harmonics + 1
        matrix = np.eye(size, dtype=complex)
        for h in range(1, size, 2):
            matrix[h : h + 2, h : h + 2] = [[1.0, 1.0], [-1j, 1j]]
        return matrix

    def at(self, jacobian: Array, omega: float, memory: Memory | None = None) -> "PerturbedMotion":
        """The linear problem at one solved point, in the states z of the poles kept.

        `jacobian` (n_c, 3, 3, 2H+1, 2H+1) as in `ContactForces`, w = `omega` in rad/s, `memory` of the sliders.
        With lambda z = L z + B f, f = K d and d = C z + (G + lambda G') f:

            lambda z = (L + B S C + lambda B S G' S C) z,    S = K (I - G K)^-1.
        """
        touching = np.any(jacobian != 0.0, axis=(1, 2, 3, 4))
        blade = self.blade.condensed(omega, np.repeat(touching, 3))
        if not np.any(touching):
            return PerturbedMotion(self.symmetric, blade.poles, np.zeros_like(blade.poles))
        values: Matrix = jacobian[touching]
        if self._to_real is not None:
            values = np.linalg.inv(self._to_real) @ values @ self._to_real
        first = 0 if self.static else 1
        contact = NodeBlocks(values.transpose(0, 3, 1, 4, 2)[:, first:, :, first:])
        loop = ContactFeedback.closed(contact, blade.flexibility)
        reaction = loop.reaction(blade.inlet)
        late = blade.slope.after(reaction)
        late_reaction = loop.reaction(late)
        delay: DelayedFriction | DelayedCone | None = None
        node = np.cumsum(touching) - 1
        if isinstance(memory, ConeSliderMemory):
            delay = DelayedCone(memory, node[memory.node], blade, loop, reaction, late_reaction, self._to_real, first)
        elif memory is not None:
            places = SliderPlaces(memory, node[memory.node], int(touching.sum()), self._to_real, first)
            inlet, late = loop.total(blade.inlet, reaction), loop.total(late, late_reaction)
            delay = DelayedFriction.of(places, loop, blade.slope, blade.outlet, inlet, late)
        matrix = blade.poles + reaction @ blade.outlet
        return PerturbedMotion(self.symmetric, matrix, late_reaction @ blade.outlet, delay)


@dataclass(frozen=True)
class PerturbedMotion:
    """lambda z = (A + lambda A') z in the states z of the kept poles, exponents in units of w; see `HillProblem`.

    matrix, lag : A and A', (n_z, n_z), without `delay`, the memory of sliders. symmetric : as there; A is then real.
    """

    symmetric: bool
    matrix: Matrix
    lag: Matrix
    delay: DelayedFriction | DelayedCone | None = None

    def eigenvalues(self, shift: complex = 0.0) -> ComplexArray:
        """All eigenvalues lambda / w; delayed forces are linearised around lambda = `shift` w."""
        matrix, unit = self._linearised(shift)
        return np.linalg.eigvals(np.linalg.solve(unit, matrix)).astype(complex)

    def nearest(self, shift: complex, state: ComplexArray | None = None) -> tuple[complex, ComplexArray | None]:
        """The eigenvalue next to `shift` of those that `eigenvalues` has there, and its state (n_z,), if it is known.

        Inverse iteration from a `state` like that sought; where two are as near, all eigenvalues are solved for.
        """
        from scipy.linalg import lu_factor, lu_solve

        matrix, unit = self._linearised(shift)
        beside = shift * (1.0 + ROUND_OFF) + ROUND_OFF
        factors = lu_factor(matrix - beside * unit, check_finite=False)
        x = np.ones(len(unit), dtype=complex) if state is None else state
        value = complex("nan")
        for _ in range(MOST_INVERSIONS):
            x = x / np.linalg.norm(x)
            y = lu_solve(factors, unit @ x, check_finite=False)
            before, value = value, beside + 1.0 / complex(x.conj() @ y)
            if abs(value - before) <= 1e-3 * abs(value - shift) + ROUND_OFF:
                return value, y
            x = y
        every = np.linalg.eigvals(np.linalg.solve(unit, matrix))
        return complex(every[np.argmin(np.abs(every - shift))]), None

    def _linearised(self, shift: complex) -> tuple[Matrix, Matrix]:
        """A and I - A' with the delayed forces linearised around lambda = `shift` w."""
        matrix, lag = self.matrix, self.lag
        if self.delay is not None:
            added, slope, late = self.delay.added(shift)
            matrix, lag = matrix + added - shift * slope, lag + slope + late
        return matrix, np.eye(len(lag)) - lag
