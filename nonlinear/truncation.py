"""What the harmonics that were left out would change: a solved point solved again with more of them."""

from dataclasses import dataclass

import numpy as np

from nonlinear.continuation import Continuation
from nonlinear.curve_point import CurvePoint
from nonlinear.family import BalanceFamily
from nonlinear.quantities import largest_amplitude, output_harmonics

LOOKS = 6  # places along a curve, beside its peaks, where the adaptive choice of harmonics looks


def wider_harmonics(n_harmonics: int) -> int:
    """Number of harmonics that H is judged by: 2H + 3, and 8 more where that would be costly."""
    return min(2 * n_harmonics + 3, n_harmonics + 8)


@dataclass(frozen=True)
class Truncation:
    """Estimates the error of the harmonics kept at the points of a curve, relative to the amplitude of its peak."""

    continuation: Continuation
    family: BalanceFamily

    def at_peak(self, points: list[CurvePoint], peak_indices: list[int]) -> float:
        """Relative change of the highest peak's amplitude; NaN where there is no peak, inf where it gets lost."""
        if not peak_indices:
            return float("nan")
        peak = max(peak_indices, key=lambda index: self._height(points[index]))
        return self._relative([points[peak]], self._height(points[peak]))

    def along(self, points: list[CurvePoint], peak_indices: list[int]) -> float:
        """Largest change of the amplitude at the peaks and at places along the curve, relative to the highest."""
        if not points:
            return float("nan")
        heights = [self._height(point) for point in points]
        spread = np.unique(np.linspace(0, len(points) - 1, LOOKS).astype(int)).tolist()
        looked_at = sorted({*peak_indices, *spread, int(np.argmax(heights))})
        return self._relative([points[index] for index in looked_at], max(heights))

    def _relative(self, points: list[CurvePoint], reference: float) -> float:
        if reference == 0.0:
            return 0.0
        return max(abs(self._widened_height(point) - self._height(point)) for point in points) / reference

    def _height(self, point: CurvePoint) -> float:
        return largest_amplitude(output_harmonics(point, self.continuation.options.output)).value

    def _widened_height(self, point: CurvePoint) -> float:
        """Amplitude with more harmonics, in the plane normal to the curve through the point; inf if not found."""
        wider = self.family.balance(wider_harmonics(point.balance.n_harmonics))
        found = self.continuation.of(wider).refit(point)
        return float("inf") if found is None else self._height(found)
