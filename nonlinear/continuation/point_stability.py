"""Floquet exponents of the points of a curve, whatever their number of harmonics."""

from dataclasses import dataclass, field

from nonlinear.contact.fourier import ComplexArray
from nonlinear.contact.parameters import ContactParameters
from nonlinear.continuation.solution_point import SolutionPoint
from nonlinear.stability.floquet import FloquetAnalysis


@dataclass(frozen=True)
class PointStability:
    """Against perturbations with the symmetry of the travelling wave (kappa = 0, see `FloquetAnalysis`)."""

    contact: ContactParameters
    analyses: dict[int, FloquetAnalysis] = field(default_factory=dict)  # by number of harmonics
    linear: dict[bytes, ComplexArray] = field(default_factory=dict)  # by state of the contacts

    def exponents(self, point: SolutionPoint) -> ComplexArray:
        """Exponents (1/s) of a point that has its contact Jacobian, the least stable first."""
        if point.linear is None:
            return self._solve(point)
        key = point.linear.pressed.tobytes()
        if key not in self.linear:
            self.linear[key] = self._solve(point)[:1]  # how fast it decays is the same all along the stretch
        return self.linear[key]

    def _solve(self, point: SolutionPoint) -> ComplexArray:
        n_harmonics = point.balance.n_harmonics
        if n_harmonics not in self.analyses:
            static = point.balance.frozen_static is None
            self.analyses[n_harmonics] = FloquetAnalysis.of(point.balance.receptance, self.contact, static=static)
        analysis = self.analyses[n_harmonics]
        return analysis.exponents(point.displacement, point.contact.jacobian, point.omega)
