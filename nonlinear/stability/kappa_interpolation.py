"""Trigonometric interpolation in the phase shift kappa of a perturbation."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from nonlinear.contact.parameters import Array


@dataclass(frozen=True)
class KappaInterpolation:
    """From 2 J equidistant kappas to the nodal diameters k = 1 .. N_b / 2 of a ring, kappa = 2 pi k / N_b."""

    nodes: int  # J, number of kappas between 0 and pi
    n_blades: int  # n_b

    @cached_property
    def kappas(self) -> Array:
        """(j + 1/2) pi / J, j = 0 .. J - 1, and then the same with the other sign, (2 J,)."""
        positive = (np.arange(self.nodes) + 0.5) * np.pi / self.nodes
        return np.concatenate([positive, -positive])

    @cached_property
    def weights(self) -> Array:
        """sin(J (kappa - kappa_j)) / (2 J tan((kappa - kappa_j) / 2)), (N_b / 2, 2 J)."""
        kappas = 2.0 * np.pi / self.n_blades * np.arange(1, self.n_blades // 2 + 1)
        half = (kappas[:, None] - self.kappas) / 2.0
        with np.errstate(divide="ignore", invalid="ignore"):
            weights = np.sin(2 * self.nodes * half) / (2 * self.nodes * np.tan(half))
        return np.where(np.abs(np.sin(half)) < 1e-12, 1.0, weights)
