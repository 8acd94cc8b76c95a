"""Floquet exponents of the points of a curve, whatever their number of harmonics."""

from dataclasses import dataclass, field, replace

from nonlinear.contact import ContactParameters
from nonlinear.curve_point import CurvePoint
from nonlinear.floquet import FloquetAnalysis
from nonlinear.fourier import ComplexArray

MOST_HARMONICS = 7  # of the perturbation; more change its growth little and cost much


@dataclass(frozen=True)
class Stability:
    """Against perturbations with the symmetry of the travelling wave (kappa = 0, see `FloquetAnalysis`)."""

    contact: ContactParameters
    analyses: dict[int, FloquetAnalysis] = field(default_factory=dict)  # by number of harmonics
    linear: dict[bytes, ComplexArray] = field(default_factory=dict)  # by state of the contacts

    def exponents(self, point: CurvePoint) -> ComplexArray:
        """Exponents (1/s) of a point that has its contact Jacobian, the least stable first."""
        if point.linear is None:
            return self._solve(point)
        key = point.linear.pressed.tobytes()
        if key not in self.linear:
            self.linear[key] = self._solve(point)[:1]  # how fast it decays is the same all along the stretch
        return self.linear[key]

    def _solve(self, point: CurvePoint) -> ComplexArray:
        n_harmonics = min(point.balance.n_harmonics, MOST_HARMONICS)
        if n_harmonics not in self.analyses:
            static = point.balance.frozen_static is None
            receptance = replace(point.balance.receptance, harmonics=tuple(range(n_harmonics + 1)))
            self.analyses[n_harmonics] = FloquetAnalysis.of(receptance, self.contact, static=static)
        kept = slice(2 * n_harmonics + 1)
        jacobian = point.contact.jacobian[..., kept, kept]
        return self.analyses[n_harmonics].exponents(point.displacement[kept], jacobian, point.frequency)
