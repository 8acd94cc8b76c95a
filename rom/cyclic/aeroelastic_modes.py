"""Complex modes of waves with aerodynamic influence coefficients, Coriolis forces and damping: linear flutter.

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

from rom.cyclic.cyclic_symmetry import inter_blade_phase
from rom.cyclic.natural_frequencies import natural_modes
from rom.cyclic.reduced_model import ComplexArray, ReducedModel
from rom.cyclic.sector_modes import RingModes
from rom.errors import ReducedModelError
from rom.units import angular_speed

SHAPES = 30  # modes with contact springs between which these forces act, or twice as many as asked for


@dataclass(frozen=True)
class InfluenceCoefficients:
    """Aerodynamic influence coefficients of one mode family.

    Attributes
    ----------
    mode : int
        Number of the mode with free contacts in its wave, from 1.
    offset : (k,) int array
        Places from the blade that feels the force to the one that moves, in +y.
    coefficient : (k,) complex array
        Modal force over modal displacement and w_m^2; a positive imaginary part at offset 0 feeds the vibration.

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

    @classmethod
    def of_waves(cls, mode: int, values: ArrayLike) -> InfluenceCoefficients:
        """The coefficients of a ring whose value C(psi) is known for each wave.

        Parameters
        ----------
        mode : int
            Number of the mode, from 1.
        values : (N_b,) complex array
            C of the waves of 0, 1, ... N_b - 1 nodal diameters; the wave N_b - n is that of -n.

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
        offset = np.arange(given.size)
        return cls(mode, offset, np.fft.fft(given) / given.size)

    def in_wave(self, phase: ArrayLike) -> ComplexArray:
        """C in waves.

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
        turned = self._turned(phase)
        stiffness, damping = turned @ self.coefficient.real, turned @ self.coefficient.imag
        return complex(-(frequency**2) * stiffness), complex(-frequency * damping)

    def _turned(self, phase: ArrayLike) -> ComplexArray:
        return np.asarray(np.exp(1j * np.multiply.outer(phase, self.offset)))


def aeroelastic_modes(
    model: ReducedModel,
    modal: RingModes,
    nodal_diameter: int,
    coefficients: Sequence[InfluenceCoefficients] = (),
    *,
    normal: ArrayLike = 0.0,
    tangential: ArrayLike = 0.0,
    count: int = 10,
) -> ComplexArray:
    """Eigenvalues of a wave with its aerodynamic, damping and Coriolis forces, as far as these are known.

    Parameters
    ----------
    model : ReducedModel
        The model of a ring; Coriolis forces act where it has their matrix and a speed.
    modal : ModalModel or SectorModes
        Its modes with free contacts, with their damping.
    nodal_diameter : int
        n of any sign, the phase angle is 2 pi n / N_b: a wave n > 0 runs against +y, as that of an engine order.
    coefficients : sequence of InfluenceCoefficients
        Those of the mode families that the flow acts on.
    normal, tangential : float or (n_c,) array
        Contact springs kn, kt of the nodes, N/m.
    count : int
        Number of eigenvalues.

    Returns
    -------
    (count,) complex array
        lambda, rad/s, of motions exp(lambda t), by ascending frequency Im lambda > 0; Re lambda > 0: flutter.

    Raises
    ------
    ReducedModelError
        A family that the model does not have, or a mass that is not positive definite.

    Examples
    --------
    A blade of 1000 rad/s and one percent of damping, in a flow that takes two percent away:

    >>> from rom import InfluenceCoefficients, ReducedModel, aeroelastic_modes, modal_model
    >>> n, one = np.array([[0.0], [0.0], [1.0]]), np.ones(1)
    >>> blade = ReducedModel(np.eye(1), 1e6 * np.eye(1), n, np.zeros((1, 3)), one, {"tip": one}, n_blades=12)
    >>> flow = InfluenceCoefficients(1, np.array([0]), np.array([0.04j]))
    >>> print(aeroelastic_modes(blade, modal_model(blade, damping_ratio=0.01), 3, [flow]).round(3))
    [10.+999.95j]
    """
    phase = inter_blade_phase(nodal_diameter, model.n_blades)
    free, springs = modal.at_phase(phase), {"normal": normal, "tangential": tangential}
    hertz, shapes = natural_modes(model, phase, count=min(max(SHAPES, 2 * count), model.size), **springs)
    # modal coordinates with free contacts, of the modes with contact springs
    share = free.shapes.conj().T @ (model.mass @ shapes)
    stiffness = np.diag((2.0 * np.pi * hertz) ** 2).astype(complex)
    damping = share.conj().T @ (free.damping[:, None] * share)
    for each in coefficients:
        if each.mode > free.angular_frequency.size:
            allowed = f"1 to {free.angular_frequency.size}, the modes of the model"
            raise ReducedModelError(f"mode of influence coefficients: {each.mode}, allowed: {allowed}")
        row = share[each.mode - 1]
        family = np.outer(row.conj(), row)
        spring, dashpot = each.springs_and_dashpots(phase, float(free.angular_frequency[each.mode - 1]))
        stiffness, damping = stiffness + spring * family, damping + dashpot * family
    if model.coriolis is not None and model.speed_rpm is not None:
        damping = damping + angular_speed(model.speed_rpm) * (shapes.conj().T @ (model.coriolis @ shapes))
    zero = np.zeros_like(stiffness)
    values = np.linalg.eigvals(np.block([[zero, np.eye(len(zero))], [-stiffness, -damping]]))
    values = values[values.imag > 0.0]
    return values[np.argsort(values.imag)][:count]
