"""What the harmonics that were left out would change: a solved point solved again with more of them."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from nonlinear.balance import HarmonicBalance
from nonlinear.contact import ContactParameters
from nonlinear.continuation import Continuation
from nonlinear.curve_point import CurvePoint
from nonlinear.elements import contact_element
from nonlinear.options import SolverOptions
from nonlinear.quantities import largest_amplitude, output_harmonics

LOOKS = 6  # places along a curve, beside its peaks, where the adaptive choice of harmonics looks


def wider_harmonics(n_harmonics: int) -> int:
    """Number of harmonics that H is judged by: 2H + 3, and 8 more where that would be costly."""
    return min(2 * n_harmonics + 3, n_harmonics + 8)


@dataclass(frozen=True)
class Truncation:
    """Estimates the error of the harmonics kept in `balance`, relative to the amplitude of the highest peak."""

    balance: HarmonicBalance
    contact: ContactParameters
    options: SolverOptions
    n_harmonics: int

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

    def _height(self, point: CurvePoint, balance: HarmonicBalance | None = None) -> float:
        return largest_amplitude(output_harmonics(balance or self.balance, point, self.options.output)).value

    @cached_property
    def _wider(self) -> HarmonicBalance:
        """The balance with more harmonics, its tables made once for all points."""
        n_harmonics = wider_harmonics(self.n_harmonics)
        return replace(
            self.balance,
            receptance=replace(self.balance.receptance, harmonics=tuple(range(n_harmonics + 1))),
            element=contact_element(self.contact, n_harmonics, self.options),
        )

    def _widened_height(self, point: CurvePoint) -> float:
        """Amplitude with more harmonics, in the plane normal to the curve through the point; inf if not found."""
        wider = self._wider
        missing = wider.size - point.unknown.size
        start = replace(
            point,
            unknown=np.append(point.unknown, np.zeros(missing)),
            tangent=(np.append(point.tangent[0], np.zeros(missing)), point.tangent[1]),
        )
        try:
            found = Continuation(wider, self.options).correct_in_plane(start)
        except np.linalg.LinAlgError:
            return float("inf")
        return float("inf") if found is None else self._height(found, wider)
