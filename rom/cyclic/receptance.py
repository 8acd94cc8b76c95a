"""Receptance of the relative contact displacement: all that the contact forces see of the structure.

The modal sum avoids the inversion of the dynamic stiffness at each frequency (Gulisano et al. 2011, after eq. 6).

On a large contact face few modes are summed one by one, all others are a power series. With x = h w a mode far above
x contributes

    1 / (w_m^2 + i c_m x - x^2) = a_0 + a_1 x + a_2 x^2 + ...,  w_m^2 a_k = a_(k-2) - i c_m a_(k-1),  a_0 = 1 / w_m^2,

so that the sum over such modes is S_0 + S_1 x + S_2 x^2 + ... with matrices that do not depend on the frequency. With
Coriolis forces the sum is one over poles, k + i c x without x^2, and what moves the contacts differs from what their
forces move.

Interface modes are the relative motions in which G = B D B^H is large: with weights W >= ``|D|`` over a band of
frequencies, the eigenvectors of B W B^H with the largest eigenvalues. Outside them G is small in the whole band.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rom.cyclic.modal_model import WaveModes
from rom.cyclic.reduced_model import Array, ComplexArray
from rom.cyclic.sector_modes import RingModes

LARGEST_DENSE = 150  # relative displacements, above which a random subspace is iterated in place of all eigenvectors
SUBSPACE = 64
ITERATIONS = 3
NO_DAMPING = 1e-5  # damping coefficient over natural frequency that limits the weights


def band_weights(frequency: Array, damping: Array, order: float, band: tuple[float, float]) -> Array:
    """Bounds of the modal receptances ``|1 / (w_m^2 + i c_m x - x^2)|`` for x = h w and w in a band.

    Shapes: `frequency` (m,), `damping` (m,), returns (m,).
    """
    low, high = order * band[0], order * band[1]
    nearest = np.clip(frequency, low, high)
    damped = np.maximum(damping, NO_DAMPING * frequency) * nearest
    return 1.0 / np.maximum(np.hypot(frequency**2 - nearest**2, damped), np.finfo(float).tiny)


def interface_modes(relative: ComplexArray, weights: Array) -> tuple[ComplexArray, Array]:
    """The leading eigenvectors of B W B^H and their eigenvalues, descending.

    Shapes: `relative` (3 n_c, m), `weights` (m,), returns `basis` (3 n_c, r), `values` (r,).
    """
    size = relative.shape[0]
    if size <= LARGEST_DENSE:
        values, vectors = np.linalg.eigh((relative * weights) @ relative.conj().T)
        return vectors[:, ::-1], values[::-1]
    adjoint = relative.conj().T
    basis = np.random.default_rng(0).standard_normal((size, SUBSPACE)).astype(relative.dtype)
    for _ in range(ITERATIONS):
        basis = relative @ (weights[:, None] * (adjoint @ np.linalg.qr(basis)[0]))
    basis = np.linalg.qr(basis)[0]
    projected = adjoint @ basis
    values, vectors = np.linalg.eigh((projected.conj().T * weights) @ projected)
    return basis @ vectors[:, ::-1], values[::-1]


SMALLEST_FACE = 150  # relative displacements, below which the modal sum costs less
TERMS = 5
NEGLIGIBLE = 1e-16  # of the largest contribution of a mode: what all modes in the series together may leave out


@dataclass(frozen=True)
class ReceptanceSeries:
    """The receptance G of one harmonic at the frequencies x up to a limit."""

    relative: ComplexArray  # (3 n_c, k), relative motions of the modes that are summed one by one
    adjoint: ComplexArray  # (k, 3 n_c), their conjugate transpose, or what poles take of contact forces
    # `stiffness`, `damping`: (k,), their coefficients of 1 and of i x, (rad/s)^2 and 1/s
    stiffness: NDArray[Any]
    damping: NDArray[Any]
    inertia: float  # coefficient of -x^2
    terms: ComplexArray  # (TERMS, 3 n_c, 3 n_c), S_0, S_1,

    @classmethod
    def of(cls, waves: WaveModes, row: int, limit: float) -> ReceptanceSeries:
        """Choose the modes of a wave and sum up the others."""
        relative, adjoint, inertia = waves.relative[row], waves.adjoint[row], waves.inertia
        stiffness, damping = waves.total_stiffness[row], waves.total_damping[row]
        square = np.where(np.abs(stiffness) > np.finfo(float).tiny, stiffness, np.finfo(float).tiny)
        coefficients = np.zeros((TERMS, square.size), complex)
        coefficients[0] = 1.0 / square
        coefficients[1] = -1j * damping / square**2
        for k in range(2, TERMS):
            coefficients[k] = (inertia * coefficients[k - 2] - 1j * damping * coefficients[k - 1]) / square
        size = (relative.real**2 + relative.imag**2).sum(axis=0)
        exact = 1.0 / (square + 1j * damping * limit - inertia * limit**2)
        left_out = np.abs(exact - coefficients.T @ limit ** np.arange(TERMS)) * size
        left_out[np.abs(square) < (2.0 * limit) ** 2] = np.inf
        order = np.argsort(left_out, kind="stable")
        small = np.cumsum(left_out[order]) <= NEGLIGIBLE * float((size / np.abs(square)).max())
        summed, single = np.sort(order[small]), np.sort(order[~small])
        largest = float((size / np.abs(square)).max())
        terms = np.empty((TERMS, relative.shape[0], relative.shape[0]), complex)
        for k in range(TERMS):
            matters = np.abs(coefficients[k, summed]) * size[summed] * limit**k > 1e-3 * NEGLIGIBLE * largest
            others = summed[matters]
            terms[k] = (relative[:, others] * coefficients[k, others]) @ adjoint[others]
        kept = np.ascontiguousarray(relative[:, single]), np.ascontiguousarray(adjoint[single])
        return cls(*kept, stiffness[single], damping[single], inertia, terms)

    def matrix(self, x: float) -> ComplexArray:
        """G at x = h w, rad/s: (3 n_c, 3 n_c), m/N."""
        value = self.stiffness + 1j * self.damping * x - self.inertia * x**2
        size = self.terms.shape[1]
        powers = (x ** np.arange(TERMS)).astype(complex)
        result: ComplexArray = (powers @ self.terms.reshape(TERMS, size * size)).reshape(size, size)
        result += (self.relative / value) @ self.adjoint
        return result


@dataclass(frozen=True)
class Support:
    """Soft springs that hold bodies in harmonic 0 which contacts alone hold, so that they have a static response.

    In modal coordinates of their rigid motions the force is -stiffness (q - position): none at the position.
    """

    stiffness: float  # square of a natural frequency, (rad/s)^2; far below that of the bodies on their contacts
    # (r,) modal coordinates of the rigid motions in static equilibrium, where the springs bear nothing
    position: Array


PUSHED = 1e-6  # modal force on a rigid motion, over the largest one, from which the excitation moves that body
NOT_HELD = 1e8  # frequency of rigid motions in harmonic 0 that nothing holds there, times the highest one
BANDS = 4.0  # frequency bands of the interface modes in an octave


@dataclass(frozen=True)
class RelativeReceptance:
    """Receptance G^(h)(w) = B_h r^(h)(w) B_h^H of a travelling wave of inter-blade phase angle psi.

    The relative displacement of the contact nodes is d^(h) = q_R^(h) - q_L^(h) exp(i h psi) = B_h q^(h). The contact
    force f^(h) on the right nodes acts on the blade as B_h^H f^(h) (Gulisano et al. 2011, eqs. 17 and 18). The
    receptance of the reduced system is the modal sum
    r^(h) = sum_m phi_m phi_m^H / (w_m^2 + i c_m h w - (h w)^2) with c_m = 2 zeta_m w_m. With a disk each harmonic has
    the modes of its own wave, that of the phase h psi; a flow adds to w_m^2 and c_m there. With Coriolis
    forces the sum is over the poles of the wave, `waves`; coordinates and forces of modes are those of `modes`.
    """

    modal: RingModes  # the m modes
    phase: float  # inter-blade phase angle psi, rad
    harmonics: tuple[int, ...]  # the n_h harmonics h, ascending; may hold 0
    force: float  # amplitude of the excitation, N
    # harmonics h of the excitation and their complex amplitudes relative to `force`. Harmonic 1, and the harmonics
    # with a force of their own in `modal`, have the factor 1 where none is given; the others are not excited
    harmonic_factors: tuple[tuple[int, complex], ...] = ()
    # what holds bodies in harmonic 0 that contacts alone hold; None: there they do not move
    support: Support | None = None
    _last: dict[float, tuple[ComplexArray, ComplexArray]] = field(
        default_factory=dict, init=False, repr=False, compare=False
    )
    _last_matrix: dict[float, ComplexArray] = field(default_factory=dict, init=False, repr=False, compare=False)
    _series: dict[tuple[int, int], ReceptanceSeries] = field(
        default_factory=dict, init=False, repr=False, compare=False
    )
    _modes: dict[float, tuple[ComplexArray, Array]] = field(
        default_factory=dict, init=False, repr=False, compare=False
    )
    _common: dict[tuple[float, float], tuple[Array, Array]] = field(
        default_factory=dict, init=False, repr=False, compare=False
    )
    _outputs: dict[str, NDArray[Any]] = field(default_factory=dict, init=False, repr=False, compare=False)

    @cached_property
    def modes(self) -> WaveModes:
        """The modes of the wave of each harmonic; rigid motions have no static response but that on a support."""
        waves, still = self.modal.waves(self._phases, [h != 0 for h in self.harmonics]), self.floating
        if not still or 0 not in self.harmonics:
            return waves
        frequency, row = waves.angular_frequency.copy(), self.harmonics.index(0)
        held = NOT_HELD * frequency.max() if self.support is None else np.sqrt(self.support.stiffness)
        frequency[row, :still] = held
        return replace(waves, angular_frequency=frequency)

    @cached_property
    def waves(self) -> WaveModes:
        """What the sums are over: `modes`, or with Coriolis forces the poles, in harmonic 0 still the modes."""
        return self.modal.in_motion(self.modes, self._phases, [h != 0 for h in self.harmonics])

    @property
    def floating(self) -> int:
        """Number of the first modes of harmonic 0 that are rigid motions which contacts alone hold."""
        return self.modal.at(0).floating if 0 in self.harmonics else 0

    @property
    def _phases(self) -> Array:
        return np.asarray(self.harmonics, dtype=float) * self.phase

    @property
    def relative(self) -> ComplexArray:
        """Relative contact motion of the modes, B_h phi: (n_h, 3 n_c, m)."""
        return self.waves.relative

    @cached_property
    def force_of_waves(self) -> ComplexArray:
        """What the terms of the sums take of the external force, (n_h, m)."""
        return self.waves.pushed(self.modal_force)

    @cached_property
    def modal_force(self) -> ComplexArray:
        """External modal force: the static one in harmonic 0, the excitation in its harmonics, (n_h, m)."""
        factors = dict(self.harmonic_factors)
        forces = np.zeros(self.modes.angular_frequency.shape, dtype=complex)
        for row, h in enumerate(self.harmonics):
            if h == 0:
                static = self.modal.at(0).static_force
                forces[row, : static.size] = static
                if self.support is not None:
                    forces[row, : self.floating] += self.support.stiffness * self.support.position
            elif h in self.excited_harmonics:
                unit = self.unit_force(h)
                forces[row] = self.force * unit if h not in factors else self.force * factors[h] * unit
        return forces

    def unit_force(self, harmonic: int) -> NDArray[Any]:
        """Modal force of 1 N of excitation in one of the harmonics, (m,)."""
        modes = self.modal.at_phase(harmonic * self.phase)
        own = modes.harmonic_forces.get(harmonic, modes.force)
        return np.pad(own, (0, self.modes.angular_frequency.shape[1] - own.size))

    @cached_property
    def excited_harmonics(self) -> tuple[int, ...]:
        """Harmonics in which the excitation acts, ascending; (1,) for a harmonic force."""
        factors, own = dict(self.harmonic_factors), self.modal.harmonic_forces
        given = sorted({1, *own} | set(factors))
        return tuple(h for h in given if factors.get(h, 1.0) != 0.0) or (1,)

    @property
    def pushes_floating_bodies(self) -> bool:
        """Whether the excitation moves a body that contacts alone hold: without contact it flies away."""
        for harmonic in self.excited_harmonics:
            force = np.abs(self.unit_force(harmonic))
            floating = self.modal.at_phase(harmonic * self.phase).floating
            if force[:floating].max(initial=0.0) > PUSHED * force.max(initial=0.0):
                return True
        return False

    @property
    def adjoint(self) -> ComplexArray:
        """Modal forces of unit contact forces, (B_h phi)^H: (n_h, m, 3 n_c)."""
        return self.waves.adjoint

    @cached_property
    def _rates(self) -> tuple[ComplexArray, Array]:
        """The coefficients of w and of -w^2 in the denominators, (n_h, m) and (n_h, 1)."""
        h = np.asarray(self.harmonics, dtype=float)[:, None]
        return 1j * h * self.waves.total_damping, self.waves.inertia * h**2

    def denominators(self, omega: float) -> tuple[ComplexArray, ComplexArray]:
        """Denominators of the modal sum, w_m^2 + i c_m h w - (h w)^2.

        `omega`: excitation frequency, rad/s. Returns `values, derivatives` (n_h, m): the denominators and their
        derivatives in w.
        """
        found = self._last.get(omega)
        if found is None:  # the last frequency is asked for many times
            damping, squares = self._rates
            value = damping * omega + (self.waves.total_stiffness - squares * omega**2)
            found = value, damping - 2.0 * omega * squares
            self._last.clear()
            self._last[omega] = found
        return found

    def matrix(self, omega: float) -> ComplexArray:
        """Receptance G^(h), (n_h, 3 n_c, 3 n_c), m/N."""
        found = self._last_matrix.get(omega)
        if found is None:
            found = self._large_matrix(omega) if self.large else self._modal_sum(omega)
            self._last_matrix.clear()
            self._last_matrix[omega] = found
        return found

    @property
    def large(self) -> bool:
        """Whether the faces have so many contact displacements that a series takes the place of most modes."""
        return 3 * self.modal.n_contacts >= SMALLEST_FACE

    def _modal_sum(self, omega: float) -> ComplexArray:
        value, _ = self.denominators(omega)
        return (self.relative * (1.0 / value)[:, None, :]) @ self.adjoint

    def _large_matrix(self, omega: float) -> ComplexArray:
        """As `_modal_sum`; a series takes the place of most modes, valid up to the end of an octave."""
        octave = int(np.ceil(np.log2(omega))) if omega > 0.0 else 0
        waves, size = self.waves, 3 * self.modal.n_contacts
        found = np.empty((len(self.harmonics), size, size), complex)
        for row, h in enumerate(self.harmonics):
            if h == 0:
                found[row] = self.static_matrix
                continue
            if (octave, h) not in self._series:
                self._series[octave, h] = ReceptanceSeries.of(waves, row, h * 2.0**octave)
            found[row] = self._series[octave, h].matrix(h * omega)
        return found

    @cached_property
    def static_matrix(self) -> Array:
        """Receptance of harmonic 0, (3 n_c, 3 n_c), m/N: the same at every frequency."""
        row = self.harmonics.index(0)
        relative = self.relative[row].real
        return (relative / self.waves.total_stiffness[row].real) @ relative.T

    def interface_modes(self, omega: float) -> tuple[ComplexArray, Array]:
        """Interface modes of each harmonic for a band of frequencies that holds `omega`.

        `omega`: excitation frequency, rad/s. Returns `modes` (n_h, 3 n_c, r): orthonormal relative motions in which
        the receptances are largest; those of harmonic 0 are real; `values` (n_h, r): bounds of the receptances in
        these, m/N, descending.
        """
        band = float(np.floor(BANDS * np.log2(omega))) if omega > 0.0 else 0.0
        if band not in self._modes:
            limits = 2.0 ** (band / BANDS), 2.0 ** ((band + 1.0) / BANDS)
            found = []
            for row, (h, relative) in enumerate(zip(self.harmonics, self.relative, strict=True)):
                weights = self._weights(row, h, limits)
                found.append(interface_modes(relative.real if h == 0 else relative, weights))
            self._modes[band] = (
                np.array([basis for basis, _ in found], complex),
                np.array([size for _, size in found]),
            )
        return self._modes[band]

    def _weights(self, row: int, harmonic: int, band: tuple[float, float]) -> Array:
        """Bounds of the terms of the sum of a harmonic: w (w - x) of a pole is at least half of w^2 - x^2."""
        waves = self.waves
        bounds = band_weights(waves.angular_frequency[row], waves.damping[row], harmonic, band)
        return bounds if waves.inertia else 2.0 * bounds

    def common_interface_modes(self, low: float, high: float) -> tuple[Array, Array]:
        """Real interface modes that serve for all harmonics in a range of frequencies.

        `low`, `high`: excitation frequencies, rad/s. Returns `modes` (3 n_c, 3 n_c): orthonormal relative motions,
        those first in which the receptances are largest; `values` (3 n_c,): bounds of the receptances of all
        harmonics in these, m/N.
        """
        if (low, high) not in self._common:
            bounds = []
            for row, (h, relative) in enumerate(zip(self.harmonics, self.relative, strict=True)):
                weights = self._weights(row, h, (low, high))
                bounds.append(((relative * weights) @ relative.conj().T).real)
            _, modes = np.linalg.eigh(np.sum(bounds, axis=0))
            modes = np.ascontiguousarray(modes[:, ::-1])
            self._common[low, high] = modes, np.max([(modes * (each @ modes)).sum(axis=0) for each in bounds], axis=0)
        return self._common[low, high]

    def response(self, omega: float, contact_force: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
        """Relative displacement d_lin + G f under the external and the contact forces.

        Two products with vectors; G itself is not formed.

        `omega`: excitation frequency, rad/s; `contact_force` (n_h, 3 n_c): f^(h) on the right nodes, N. Returns
        `displacement, derivative` (n_h, 3 n_c): d_lin + G f in m, and its derivative in w at constant f.
        """
        if self.large and self.harmonics[0] == 0:
            return self._large_response(omega, contact_force)
        coordinates = np.stack(self._terms(omega, contact_force), axis=-1)
        both = self.relative @ coordinates
        return both[..., 0], both[..., 1]

    def _large_response(self, omega: float, contact_force: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
        """As `response`; harmonic 0 takes its matrix in place of all modes."""
        value, derivative = (values[1:] for values in self.denominators(omega))
        coordinates = (self.force_of_waves[1:] + (self.adjoint[1:] @ contact_force[1:, :, None])[..., 0]) / value
        both = self.relative[1:] @ np.stack([coordinates, -derivative * coordinates / value], axis=-1)
        found = np.zeros((2, *contact_force.shape), complex)
        found[:, 1:] = both.transpose(2, 0, 1)
        found[0, 0] = self._static_motion + self.static_matrix @ contact_force[0].real
        return found[0], found[1]

    @cached_property
    def _static_motion(self) -> Array:
        """Relative displacement of harmonic 0 without contact forces, (3 n_c,), m."""
        return self.relative[0].real @ (self.force_of_waves[0].real / self.waves.total_stiffness[0].real)

    def modal_response(self, omega: float, contact_force: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
        """Modal coordinates under the external and the contact forces.

        `omega`: excitation frequency, rad/s; `contact_force` (n_h, 3 n_c): f^(h) on the right nodes, N. Returns
        `coordinates, derivatives` (n_h, m): modal coordinates, and their derivatives in w at constant f.
        """
        coordinates, derivatives = self._terms(omega, contact_force)
        return self.in_modes(coordinates), self.in_modes(derivatives)

    def _terms(self, omega: float, contact_force: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
        """The terms of the sums, (n_h, m), and their derivatives in w: modal coordinates but for Coriolis forces."""
        value, derivative = self.denominators(omega)
        coordinates = (self.force_of_waves + (self.adjoint @ contact_force[..., None])[..., 0]) / value
        return coordinates, -derivative * coordinates / value

    def in_modes(self, terms: ComplexArray) -> ComplexArray:
        """Modal coordinates from the terms of the sums, which are those of poles with Coriolis forces."""
        turning = self.waves.turning
        return terms if turning is None else (turning.shapes @ terms[..., None])[..., 0]

    def reduced_coordinates(self, coordinates: ComplexArray) -> ComplexArray:
        """Coordinates of the reduced model from modal coordinates of each harmonic.

        `coordinates` (n_h, m): modal coordinates. Returns (n_h, n): q^(h) of the reduced model.
        """
        return self.modal.reduced_coordinates(coordinates, self._phases)

    def coordinates(self, omegas: Array, contact_force: ComplexArray) -> ComplexArray:
        """Modal coordinates at several frequencies, each under its own contact force.

        `omegas` (P,): excitation frequencies, rad/s; `contact_force` (P, n_h, 3 n_c): f^(h) on the right nodes, N.
        Returns (P, n_h, m): modal coordinates.
        """
        damping, squares = self._rates
        omega = omegas[:, None, None]
        value = damping * omega + (self.waves.total_stiffness - squares * omega**2)
        by_harmonic = self.adjoint @ contact_force.transpose(1, 2, 0)
        return self.in_modes((self.force_of_waves + by_harmonic.transpose(2, 0, 1)) / value)

    def output_rows(self, name: str, omega: float) -> ComplexArray:
        """Receptance of an output to contact forces, o r^(h) B_h^H: (n_h, 3 n_c) in m/N."""
        value, _ = self.denominators(omega)
        weighted = (self.output_of_waves(name) / value)[:, None, :]
        return (weighted @ self.adjoint)[:, 0, :]

    def output_of_waves(self, name: str) -> NDArray[Any]:
        """An output of the terms of the sums, as `output_shapes` of the modes."""
        return self.waves.rows(self.output_shapes(name))

    def output_shapes(self, name: str) -> NDArray[Any]:
        """An output of the modes of each harmonic, (n_h, m); (m,) of a blade alone, the same in all."""
        if name not in self._outputs:
            self._outputs[name] = self.modal.wave_outputs(name, self._phases)
        return self._outputs[name]

    def output(self, name: str, coordinates: ComplexArray) -> ComplexArray:
        """An output from modal coordinates of each harmonic.

        `coordinates` (..., n_h, m): modal coordinates. Returns (..., n_h): Fourier coefficients of the output, m.
        """
        shapes = self.output_shapes(name)
        return coordinates @ shapes if shapes.ndim == 1 else (coordinates * shapes).sum(axis=-1)
