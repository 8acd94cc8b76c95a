"""The performance curve of a damper: worst amplitude per force over preload per force, one curve for every force.

The balance is positively homogeneous: with the force F, the interference v0 and the preload N0 all scaled by one
factor the motion scales by it, at the same frequency. So amplitude / F and the frequency depend on v0 / F (or N0 / F)
alone.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.parameters import Array
from nonlinear.peak_curves.optimum_result import Kind, PeakCurve


@dataclass(frozen=True)
class PerformanceCurve:
    """Worst motion per unit force over the static closure per unit force, K values.

    Attributes
    ----------
    name : {"interference", "preload"}
        The static quantity p that is compared with the force: v0, m, or N0, N per node.
    ratio : (K,) float
        p / F, ascending: m/N, or N/N. Two equal values bound a jump.
    compliance : (K,) float
        Amplitude of the worst motion per force, m/N.
    frequency_hz : (K,) float
        Its frequency, Hz.
    motion, source, origin : (K,) str
        As of `WorstEnvelope`.
    curves : tuple of PeakCurve
        The followed peaks, with `value` p / F and `amplitude_m` and `slope` per force.
    best_ratio, least_compliance, best_frequency_hz : float
        The optimum: p / F, amplitude per force, frequency.
    kind : str
        Kind of the optimum, as of `Optimum`.
    within : (float, float)
        Range of p / F in which the compliance is at most 10 % higher.
    force : float
        Force at which it was computed, N.
    message : str
        One line that says what was found.
    remarks : tuple of str
        What was searched and what was left open.

    Examples
    --------
    With the names of the example of `forced_response`:

    >>> from nonlinear import performance_curve
    >>> curve = performance_curve((modal, contact, excitation, options), "preload", 0.5, 4.0)
    >>> round(curve.best_value(force=2.0), 3), round(curve.amplitude_m(force=2.0, value=6.12), 3)
    (6.12, 2.029)
    """

    name: str
    ratio: Array
    compliance: Array
    frequency_hz: Array
    motion: NDArray[np.str_]
    source: NDArray[np.str_]
    origin: NDArray[np.str_]
    curves: tuple[PeakCurve, ...]
    best_ratio: float
    least_compliance: float
    best_frequency_hz: float
    kind: Kind
    within: tuple[float, float]
    force: float
    message: str
    remarks: tuple[str, ...] = ()

    def amplitude_m(self, force: float, value: float) -> float:
        """Worst amplitude at a force and a value of the static quantity, m; NaN beyond the curve.

        Parameters
        ----------
        force : float
            Force F, N.
        value : float
            v0, m, or N0, N.
        """
        known = np.isfinite(self.compliance)
        ratios, heights = self.ratio[known], self.compliance[known]
        return float(force * np.interp(value / force, ratios, heights, left=np.nan, right=np.nan))

    def best_value(self, force: float) -> float:
        """The static quantity with the lowest worst motion at a force: v0, m, or N0, N.

        Parameters
        ----------
        force : float
            Force F, N.
        """
        return self.best_ratio * force
