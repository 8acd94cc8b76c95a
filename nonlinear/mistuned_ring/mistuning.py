"""Deviations of the blades and of the contact pairs of a ring from the tuned ones; the bound of what they amplify."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import ArrayLike

from nonlinear.contact.parameters import Array, ContactParameters
from rom.cyclic.sector_modes import RingModes


def whitehead_bound(n_blades: int) -> float:
    """Bound of the amplification factor of a linear ring, (1 + sqrt(N_b)) / 2.

    It holds for one family of modes with the same damping in all blades (Whitehead 1966): at most, the vibration
    energy of all nodal diameters meets in one blade. Friction contacts and several families may exceed it.

    References
    ----------
    D. S. Whitehead, "Effect of mistuning on the vibration of turbo-machine blades induced by wakes", Journal of
    Mechanical Engineering Science 8(1), 1966, pp. 15-21.
    """
    return 0.5 * (1.0 + math.sqrt(n_blades))


class MistuningError(ValueError):
    """A deviation out of its range; the message names it, its value and what is allowed."""


@dataclass(frozen=True)
class Mistuning:
    """Deviations of N_b blades and of the contact pairs between them."""

    # (N_b,) relative deviation delta_j of the natural frequencies of blade j, clamped and with free contacts: all its
    # frequencies are (1 + delta_j) times the tuned ones, with the tuned mode shapes, damping coefficients, Coriolis
    # forces and coefficients of a flow
    frequency: Array
    # friction, stiffness (N_b,): relative deviations of the friction coefficient, and of kn and kt, at the pair of
    # the right face of blade j with the left face of blade j+1
    friction: Array
    stiffness: Array
    interference: Array  # (N_b,) added to the interference of that pair, m

    def __post_init__(self) -> None:
        """Check lengths, finiteness and ranges."""
        n_blades = np.asarray(self.frequency).size
        for name in (field.name for field in fields(self)):
            values = np.asarray(getattr(self, name), dtype=float)
            if values.shape != (n_blades,):
                raise MistuningError(f"{name}: {values.size} values, allowed: {n_blades}, one for each blade")
            if not np.isfinite(values).all():
                raise MistuningError(f"{name}: {values.tolist()}, allowed: finite numbers")
            least = float(values.min(initial=0.0))
            if name != "interference" and least <= -1.0:
                raise MistuningError(f"{name}: {least:g}, allowed: above -1")
            object.__setattr__(self, name, values)

    @classmethod
    def of(
        cls,
        n_blades: int,
        *,
        frequency: ArrayLike = 0.0,
        friction: ArrayLike = 0.0,
        stiffness: ArrayLike = 0.0,
        interference: ArrayLike = 0.0,
    ) -> Mistuning:
        """Build from deviations that may be one number for all.

        `frequency`, `friction`, `stiffness` (N_b,): relative deviations; `interference` (N_b,): deviation of the
        interference, m.
        """
        given = (frequency, friction, stiffness, interference)
        arrays = [np.asarray(values, dtype=float) for values in given]
        for name, array in zip((field.name for field in fields(cls)), arrays, strict=True):
            if array.ndim and array.shape != (n_blades,):
                raise MistuningError(f"{name}: {array.size} values, allowed: {n_blades}, one for each blade")
        return cls(*(np.full(n_blades, float(array)) if array.ndim == 0 else array for array in arrays))

    @classmethod
    def sampled(
        cls,
        n_blades: int,
        seed: int,
        *,
        frequency: float = 0.0,
        friction: float = 0.0,
        stiffness: float = 0.0,
        interference: float = 0.0,
    ) -> Mistuning:
        """Draw independent normal deviations of mean zero.

        The same seed gives the same standard normal numbers for each quantity, whatever the other deviations.

        `interference`: standard deviation of the interference, m.
        """
        drawn = np.random.default_rng(seed).standard_normal((4, n_blades))
        scales = np.array([frequency, friction, stiffness, interference])
        return cls(*(scales[:, None] * drawn))

    @property
    def n_blades(self) -> int:
        """Number of blades N_b."""
        return self.frequency.size

    @property
    def added_stiffness(self) -> Array:
        """Stiffness of each blade above the tuned one, relative to it: (1 + delta_j)^2 - 1, (N_b,)."""
        added: Array = (1.0 + self.frequency) ** 2 - 1.0
        return added

    def scaled(self, factor: float) -> Mistuning:
        """The same pattern, with all deviations multiplied by a factor."""
        return Mistuning(*(factor * getattr(self, field.name) for field in fields(self)))

    def contact(self, tuned: ContactParameters) -> ContactParameters:
        """Contact parameters of all N_b n_c nodes of the ring."""
        n, n_c = self.n_blades, tuned.n_contacts
        stiffer, rougher = np.repeat(1.0 + self.stiffness, n_c), np.repeat(1.0 + self.friction, n_c)
        return replace(
            tuned,
            normal_stiffness=np.tile(tuned.normal_stiffness, n) * stiffer,
            tangential_stiffness=np.tile(tuned.tangential_stiffness, n) * stiffer,
            friction=np.tile(tuned.friction, n) * rougher,
            interference=np.tile(tuned.interference, n) + np.repeat(self.interference, n_c),
            preload=np.tile(tuned.preload, n),
            slider_origin=np.tile(tuned.slider_origin, (n, 1)),
        )


def check_blades(modal: RingModes, mistuning: Mistuning) -> None:
    """Check that a model knows the stiffness of blades that differ."""
    if mistuning.frequency.any() and not modal.blades_may_differ:
        raise MistuningError(
            "frequency: blades on a disk that differ, allowed: with blade_stiffness in the reduced model"
        )
