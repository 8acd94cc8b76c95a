"""Floquet exponents of the solution points of a branch, whatever their number of harmonics."""

from dataclasses import dataclass, field

from nonlinear.contact.fourier import ComplexArray
from nonlinear.contact.parameters import ContactParameters
from nonlinear.continuation.solution_point import SolutionPoint
from nonlinear.stability.floquet import FloquetAnalysis


@dataclass(frozen=True)
class PointStability:
    """Floquet exponents of solution points, for perturbations with the symmetry of the travelling wave (kappa = 0).

    Two caches keep what many points share.

    Attributes
    ----------
    contact : ContactParameters
        Of the contact nodes.
    analysis_of_harmonics : dict
        Number of harmonics -> analysis, which holds the contact-free model.
    exponents_of_contact_state : dict
        State of the contacts of a linear segment (bytes) -> its leading exponent.
    """

    contact: ContactParameters
    analysis_of_harmonics: dict[int, FloquetAnalysis] = field(default_factory=dict, repr=False)
    exponents_of_contact_state: dict[bytes, ComplexArray] = field(default_factory=dict, repr=False)

    def exponents(self, point: SolutionPoint) -> ComplexArray:
        """Floquet exponents (1/s) of a point that has its contact Jacobian, the least stable first.

        All points of a linear segment decay at one rate: they have the leading exponent only.
        """
        if point.linear is None:
            return self._solved(point)
        state = point.linear.pressed.tobytes()
        if state not in self.exponents_of_contact_state:
            self.exponents_of_contact_state[state] = self._solved(point)[:1]
        return self.exponents_of_contact_state[state]

    def _solved(self, point: SolutionPoint) -> ComplexArray:
        analysis = self._analysis(point)
        return analysis.exponents(point.displacement, point.contact.jacobian, point.omega)

    def _analysis(self, point: SolutionPoint) -> FloquetAnalysis:
        balance = point.balance
        if balance.n_harmonics not in self.analysis_of_harmonics:
            self.analysis_of_harmonics[balance.n_harmonics] = FloquetAnalysis.of(
                balance.receptance, self.contact, static=balance.frozen_static is None
            )
        return self.analysis_of_harmonics[balance.n_harmonics]
