"""Floquet exponents of the points of a curve, for any number of harmonics."""

from dataclasses import dataclass, field

from nonlinear.contact.fourier import ComplexArray
from nonlinear.contact.parameters import ContactParameters
from nonlinear.continuation.solution_point import SolutionPoint
from nonlinear.stability.floquet import FloquetAnalysis


@dataclass(frozen=True)
class PointStability:
    """Stability against perturbations with the symmetry of the travelling wave (kappa = 0, see `FloquetAnalysis`).

    Attributes
    ----------
    contact : ContactParameters
        Parameters of the contact nodes.
    """

    contact: ContactParameters
    _analyses: dict[int, FloquetAnalysis] = field(default_factory=dict, init=False, repr=False, compare=False)
    _linear: dict[bytes, ComplexArray] = field(default_factory=dict, init=False, repr=False, compare=False)

    def exponents(self, point: SolutionPoint) -> ComplexArray:
        """Exponents (1/s) of a point that has its contact Jacobian, the least stable first."""
        if point.linear is None:
            return self._solve(point)
        key = point.linear.pressed.tobytes()
        if key not in self._linear:
            self._linear[key] = self._solve(point)[:1]  # the decay rate is the same all along a linear segment
        return self._linear[key]

    def _solve(self, point: SolutionPoint) -> ComplexArray:
        n_harmonics = point.balance.n_harmonics
        if n_harmonics not in self._analyses:
            static = point.balance.frozen_static is None
            self._analyses[n_harmonics] = FloquetAnalysis.of(point.balance.receptance, self.contact, static=static)
        analysis = self._analyses[n_harmonics]
        return analysis.exponents(point.displacement, point.contact.jacobian, point.omega)
