"""Slider memory of two Jenkins sliders a node: what a growing perturbation adds to the contact Jacobian.

These are the hereditary terms of the linearised hysteresis: a sticking slider stands where an earlier instant
left it.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.fourier import ComplexArray, basis_table
from nonlinear.contact.numba_cache import compiled
from nonlinear.contact.parameters import LIFT_OFF, Array, ContactParameters
from nonlinear.stability.block_matrices import Matrix
from nonlinear.stability.cone_slider_memory import ConeSliderMemory, cone_slider_memory

Integers = NDArray[np.int64]
SAMPLES = 512
SMALL = 1e-3  # rate times length below which a series takes the place of the quotient


@dataclass(frozen=True)
class SliderMemory:
    """The M stick intervals of a cycle in which an earlier instant theta_s has set the slider.

    There T = kt (u(theta) - w(theta_s)), and a perturbation of it

        dT(theta) = kt (du(theta) - dw(theta_s)),    dw = du + r dd_n,

    r = -+ mu kn / kt where slip ended, r = -u' / d_n' at re-contact. The Jacobian of the contact element is that of a
    periodic perturbation. One that grows as e^(lambda t) was smaller at theta_s, by
    e^(-sigma (theta - theta_s)), sigma = lambda / omega. For `law = "two_sliders"`.
    """

    node: Integers  # (M,), the slider
    direction: Integers  # (M,), the slider
    start: Array  # (M,), theta_s and the length of the stick interval, rad
    length: Array  # (M,), theta_s and the length of the stick interval, rad
    dw_dn: Array  # (M,), r, derivative of the slider position in the normal displacement
    stiffness: Array  # (M,), kt, N/m
    n_harmonics: int  # H

    @cached_property
    def _powers(self) -> Matrix:
        """e^(i h theta_s), h = -H .. H: (M, 2H+1)."""
        return np.exp(1j * self.start[:, None] * np.arange(-self.n_harmonics, self.n_harmonics + 1))

    @cached_property
    def basis(self) -> Array:
        """Basis functions at theta_s, (M, 2H+1): times the real Fourier coefficients of a motion, its value there."""
        return np.asarray(_basis(self._powers).real)

    def force(self, sigma: complex) -> tuple[Matrix, Matrix]:
        """Real Fourier coefficients of the contact force -dT that dw(theta_s) = 1 makes, beyond those at sigma = 0.

        They are those of kt (e^(-sigma (theta - theta_s)) - 1) over the stick interval.
        Shapes: returns `force, derivative` (M, 2H+1).
        """
        force, change = (self._weights * _basis(part) for part in self._moments(sigma))
        return (force, change) if isinstance(sigma, complex) else (force.real, change.real)

    def force_in_harmonics(self, sigma: complex) -> tuple[ComplexArray, ComplexArray]:
        """As `force`, as amplitudes of the harmonics 0, 1, -1, 2, -2, ...: (M, 2H+1).

        That of the harmonic h is kt / (2 pi) times the integral of e^(-i h theta) times the force.
        """
        half = self.stiffness[:, None] / (2.0 * np.pi)
        force, change = (half * part[:, self._opposite] for part in self._moments(sigma))
        return force, change

    def _moments(self, sigma: complex) -> tuple[ComplexArray, ComplexArray]:
        """Integrals of e^(i h theta) times the force of a unit spring, h = -H .. H, and derivatives: (M, 2H+1)."""
        value, derivative = self._integral(sigma)
        return self._powers * (value - self._integral_of_motion), self._powers * -derivative

    @cached_property
    def _opposite(self) -> Integers:
        """Columns of -h among -H .. H, for h = 0, 1, -1, 2, -2, ..."""
        order = np.arange(1, self.n_harmonics + 1)
        return self.n_harmonics - np.append(0, np.stack([order, -order], axis=1).ravel())

    @cached_property
    def _weights(self) -> Array:
        """kt, over pi (2 pi for the mean): (M, 2H+1)."""
        return np.asarray(self.stiffness[:, None] * np.append(0.5, np.ones(2 * self.n_harmonics)) / np.pi)

    @cached_property
    def _turns(self) -> Matrix:
        """e^(i h length), h = -H .. H: (M, 2H+1)."""
        return np.exp(1j * self.length[:, None] * np.arange(-self.n_harmonics, self.n_harmonics + 1))

    @cached_property
    def _integral_of_motion(self) -> Matrix:
        """`_integral` at sigma = 0."""
        return self._integral(0.0)[0]

    def _integral(self, sigma: complex) -> tuple[Matrix, Matrix]:
        """Integral of e^(rate t), rate = i h - sigma, over t = 0 .. length, its derivative in the rate: (M, 2H+1)."""
        value, derivative = np.empty((2, *self._turns.shape), dtype=complex)
        _integrals(self._turns, self.length, complex(sigma), value, derivative)
        return value, derivative


@compiled
def _integrals(turns: Matrix, length: Array, sigma: complex, value: Matrix, derivative: Matrix) -> None:
    """Write the integrals of e^(rate t) and of t e^(rate t), rate = i h - sigma, over t = 0 .. length.

    `turns`: e^(i h length), h = -H .. H, (M, 2H+1), as `value` and `derivative`.
    """
    count, size = turns.shape
    for m in range(count):
        extent, decay = length[m], np.exp(-sigma * length[m])
        for k in range(size):
            rate = complex(0.0, k - size // 2) - sigma
            z, end = rate * extent, turns[m, k] * decay
            if abs(z) < SMALL:
                value[m, k] = extent * (1.0 + z / 2.0 + z**2 / 6.0 + z**3 / 24.0)
                derivative[m, k] = extent**2 * (0.5 + z / 3.0 + z**2 / 8.0 + z**3 / 30.0)
            else:
                value[m, k] = (end - 1.0) / rate
                derivative[m, k] = (extent * end - value[m, k]) / rate


def _basis(powers: Matrix) -> Matrix:
    """Values of 1, cos, -sin, cos 2, ... from those of e^(i h theta), h = -H .. H, linear in these: (M, 2H+1)."""
    middle = powers.shape[1] // 2
    result = np.empty_like(powers)
    positive, negative = powers[:, middle + 1 :], powers[:, :middle][:, ::-1]
    result[:, 0] = powers[:, middle]
    result[:, 1::2] = 0.5 * (positive + negative)
    result[:, 2::2] = 0.5j * (positive - negative)
    return result


@dataclass(frozen=True)
class MemorySampler:
    """Linearises the sliders over a cycle, at equidistant instants."""

    parameters: ContactParameters  # of the contact nodes
    n_harmonics: int  # H of the motion
    samples: int = SAMPLES  # instants a period

    @cached_property
    def _tables(self) -> tuple[Array, Array]:
        """Basis functions and their derivatives at the instants, (samples, 2H+1)."""
        table = basis_table(self.n_harmonics, self.samples)
        derivative = np.zeros_like(table)
        order = np.arange(1, self.n_harmonics + 1)
        derivative[:, 1::2] = order * table[:, 2::2]
        derivative[:, 2::2] = -order * table[:, 1::2]
        return table, derivative

    def memory(self, displacement: Array) -> SliderMemory | ConeSliderMemory | None:
        """Slider memory under the periodic `displacement` (2H+1, n_c, 3), m; None if no slider slips or touches."""
        p, n = self.parameters, self.samples
        deflection = p.from_slider_origin(displacement)
        motion, speed = (
            np.ascontiguousarray((table @ deflection.reshape(table.shape[1], -1)).T).reshape(-1, 3, n)
            for table in self._tables
        )
        if p.law == "cone":
            return cone_slider_memory(p, self._tables[0], motion, speed)
        state, sign, count = self._return_map(motion)
        found = np.flatnonzero(count)
        row, sample, length = found // n, found % n, count.ravel()[found]
        if row.size == 0:
            return None
        node, direction = row // 2, row % 2
        after = sign[node, direction, (sample + 1) % n]
        kt, kn = p.tangential_stiffness[node], p.normal_stiffness[node]
        closing = speed[node, 2, sample]
        restart = -speed[node, direction, sample] / np.where(closing == 0.0, np.inf, closing)
        slipped = -after * p.friction[node] * kn / kt
        # one instant of slip after re-contact is one of the sampling if the contact can stick at once
        at_once = (state[node, direction, sample - 1] == LIFT_OFF) & (np.abs(restart) <= np.abs(slipped))
        dw_dn = np.where((after == 0) | at_once, restart, slipped)
        # a stick interval begins and ends between two instants: half a step later than the last one before
        start, extent = (np.asarray(2.0 * np.pi / n * count, dtype=np.float64) for count in (sample + 0.5, length))
        return SliderMemory(node, direction, start, extent, dw_dn, kt, self.n_harmonics)

    def _return_map(self, motion: Array) -> tuple[Integers, Integers, Integers]:
        """State, sign and number of samples of stick, see `stick_intervals`, of all sliders: (n_c, 2, samples)."""
        from nonlinear.stability.stick_interval_kernel import stick_intervals

        p = self.parameters
        load = p.normal_load(motion[:, 2].T).T
        state, sign = (np.full((len(motion), 2, self.samples), -1, dtype=np.int64) for _ in range(2))
        count = np.zeros((len(motion), 2, self.samples), dtype=np.int64)
        slides = (p.tangential_stiffness > 0.0) & np.any(load > 0.0, axis=1)
        limit = np.ascontiguousarray(p.friction[:, None] * load)
        stiffness = np.ascontiguousarray(p.tangential_stiffness, dtype=float)
        stick_intervals(motion, limit, stiffness, slides, (state, sign, count))
        return state, sign, count
