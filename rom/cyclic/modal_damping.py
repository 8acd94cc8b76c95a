"""Modal damping from ratios or from Rayleigh's two coefficients."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from rom.cyclic.reduced_model import Array
from rom.errors import ReducedModelError


@dataclass(frozen=True)
class ModalDamping:
    """2 zeta_m w_m of modes: ratios zeta_m, or C = a M + b K."""

    # zeta, one number for all modes or one for each of the first modes; the last one holds for the modes above
    ratio: ArrayLike | None = None
    rayleigh: tuple[float, float] | None = None  # (a, b), 2 zeta_m w_m = a + b w_m^2

    def times(self, factor: float) -> "ModalDamping":
        """The damping times a factor."""
        if self.rayleigh is not None:
            return ModalDamping(rayleigh=(factor * self.rayleigh[0], factor * self.rayleigh[1]))
        return ModalDamping(factor * np.asarray(self.ratio, dtype=float))

    def coefficients(self, frequency: Array) -> Array:
        """2 zeta_m w_m, (m,), 1/s.

        Shapes: `frequency` (m,).
        """
        if (self.ratio is None) == (self.rayleigh is None):
            raise ReducedModelError("damping: give either a damping ratio or Rayleigh coefficients, not both or none")
        if self.rayleigh is not None:
            damping = self.rayleigh[0] + self.rayleigh[1] * frequency**2
        else:
            ratios = np.atleast_1d(np.asarray(self.ratio, dtype=float))
            if ratios.ndim != 1 or ratios.size == 0:
                raise ReducedModelError("damping_ratio: allowed: a number or a list of numbers, one a mode")
            if ratios.size > frequency.size:
                allowed = f"allowed: at most one for each of the {frequency.size} modes"
                raise ReducedModelError(f"damping_ratio: {ratios.size} values, {allowed}")
            zeta = np.full(frequency.size, ratios[-1])
            zeta[: ratios.size] = ratios
            damping = 2.0 * zeta * frequency
        if not np.all(np.isfinite(damping)) or np.any(damping < 0.0):
            raise ReducedModelError("damping: negative or not finite in some mode, allowed: 0 or more in every mode")
        return damping
