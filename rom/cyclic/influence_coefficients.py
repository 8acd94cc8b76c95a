"""Aerodynamic influence coefficients: what the flow around a blade adds to the motion of it and of its neighbours.

The flow around blade j makes the modal force

    f_j = w_m^2 sum_l C_l q_(j+l)

on a mode family m: C_l is what blade j feels of the blade l places ahead (in +y), its own motion with l = 0. In a
wave of the inter-blade phase angle psi that is w_m^2 C(psi) q with C(psi) = sum_l C_l exp(i l psi), for exp(i w t):
Im C > 0 feeds the vibration. A mode alone has the damping ratio -Im C(psi) / 2 and the frequency
w_m (1 - Re C(psi) / 2).

The coefficients are those at the frequency w_m of the family with free contacts. At others they act as springs
-w_m^2 Re C_l and dashpots -w_m Im C_l between the blades, real and causal, so that the same holds in time.

References
----------
E. F. Crawley, Aeroelastic formulation for tuned and mistuned rotors, AGARDograph 298 vol. 2, chapter 19, 1988.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rom.cyclic.reduced_model import Array, ComplexArray
from rom.errors import ReducedModelError


@dataclass(frozen=True)
class InfluenceCoefficients:
    """Aerodynamic influence coefficients of one mode family.

    Attributes
    ----------
    mode : int
        Number of the mode with free contacts in its wave, from 1.
    offset : (k,) int array
        Places from the blade that feels the force to the one that moves, in +y.
    coefficient : (k,) or (F, k) complex array
        Modal force over modal displacement and w_m^2; a positive imaginary part at offset 0 feeds the vibration.
    frequency : (F,) array or None
        Frequencies of the rows, rad/s, ascending; those of the family lie between them. None: one row for all.

    Examples
    --------
    Opposite real parts of both neighbours: the damping ratio is a sine over the phase angle, 0.002 - 0.003 sin(psi):

    >>> from rom import InfluenceCoefficients
    >>> flow = InfluenceCoefficients(1, np.array([-1, 0, 1]), np.array([-0.003, -0.004j, 0.003]))
    >>> print(-0.5 * flow.in_wave(np.array([0.0, 0.5 * np.pi, 1.5 * np.pi])).imag)
    [ 0.002 -0.001  0.005]
    """

    mode: int
    offset: NDArray[np.int64]
    coefficient: ComplexArray
    frequency: Array | None = None

    @classmethod
    def of_waves(cls, mode: int, values: ArrayLike, frequency: Array | None = None) -> InfluenceCoefficients:
        """The coefficients of a ring whose value C(psi) is known for each wave.

        Parameters
        ----------
        mode : int
            Number of the mode, from 1.
        values : (N_b,) or (F, N_b) complex array
            C of the waves of 0, 1, ... N_b - 1 nodal diameters; the wave N_b - n is that of -n.
        frequency : (F,) array, optional
            Frequencies of the rows, rad/s.

        Returns
        -------
        InfluenceCoefficients
            N_b coefficients.

        Examples
        --------
        >>> from rom import InfluenceCoefficients
        >>> flow = InfluenceCoefficients.of_waves(1, [-0.01j, 0.002j, -0.01j, -0.02j])
        >>> flow.in_wave(2 * np.pi * 3 / 4).round(12).item()
        (-0-0.02j)
        """
        given = np.asarray(values, dtype=complex)
        count = given.shape[-1]
        return cls(mode, np.arange(count), np.fft.fft(given) / count, frequency)

    def at(self, frequency: float) -> ComplexArray:
        """The coefficients (k,) at a frequency, linear between those of the table.

        Parameters
        ----------
        frequency : float
            Frequency of the family, rad/s.

        Raises
        ------
        ReducedModelError
            The frequency is not one of the table.
        """
        if self.frequency is None:
            return self.coefficient
        low, high = float(self.frequency[0]), float(self.frequency[-1])
        if not low <= frequency <= high:
            in_hz = [value / (2.0 * np.pi) for value in (frequency, low, high)]
            allowed = f"{in_hz[1]:g} to {in_hz[2]:g} Hz, the frequencies of the table"
            raise ReducedModelError(
                f"influence coefficients of mode {self.mode} at {in_hz[0]:g} Hz, allowed: {allowed}"
            )
        rows = self.coefficient.T
        return np.array([np.interp(frequency, self.frequency, row) for row in rows], dtype=complex)

    def in_wave(self, phase: ArrayLike) -> ComplexArray:
        """C in waves, of coefficients that are not a table over the frequency.

        Parameters
        ----------
        phase : float or (J,) array
            Inter-blade phase angles, rad.

        Returns
        -------
        complex or (J,) array
            sum_l C_l exp(i l psi).
        """
        return np.asarray(self._turned(phase) @ self.coefficient)

    def springs_and_dashpots(self, phase: float, frequency: float) -> tuple[complex, complex]:
        """What the flow adds to stiffness and damping of the family in a wave.

        Parameters
        ----------
        phase : float
            Inter-blade phase angle, rad.
        frequency : float
            w_m, rad/s.

        Returns
        -------
        stiffness, damping : complex
            (rad/s)^2 and 1/s: modal force = -stiffness q - damping dq/dt.
        """
        turned, coefficient = self._turned(phase), self.at(frequency)
        stiffness, damping = turned @ coefficient.real, turned @ coefficient.imag
        return complex(-(frequency**2) * stiffness), complex(-frequency * damping)

    def _turned(self, phase: ArrayLike) -> ComplexArray:
        return np.asarray(np.exp(1j * np.multiply.outer(phase, self.offset)))


def flow_in_wave(coefficients: Sequence[InfluenceCoefficients], frequency: Array, phase: float) -> ComplexArray:
    """What the flow adds to the squares of the natural frequencies and to the damping coefficients, (2, m).

    Shapes: `frequency` (m,), rad/s.
    """
    found = np.zeros((2, frequency.size), dtype=complex)
    for each in coefficients:
        if each.mode > frequency.size:
            allowed = f"1 to {frequency.size}, the modes of the model"
            raise ReducedModelError(f"mode of influence coefficients: {each.mode}, allowed: {allowed}")
        found[:, each.mode - 1] += each.springs_and_dashpots(phase, float(frequency[each.mode - 1]))
    return found
