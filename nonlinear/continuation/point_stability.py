"""Floquet exponents of the points of a curve, for any number of harmonics."""

from dataclasses import dataclass, field

import numpy as np

from nonlinear.contact.fourier import ComplexArray
from nonlinear.contact.parameters import ContactParameters
from nonlinear.continuation.linear_segments import LinearSegments
from nonlinear.continuation.solution_point import LinearState, SolutionPoint
from nonlinear.harmonic_balance.residual import HarmonicBalance
from nonlinear.harmonic_balance.truncated_balances import TruncatedBalances
from nonlinear.stability.floquet import FloquetAnalysis
from nonlinear.stability.linear_poles import least_damped_pole

MOST_HARMONICS = 25  # of a perturbation


@dataclass(frozen=True)
class PointStability:
    """Stability against perturbations with the symmetry of the travelling wave (kappa = 0, see `FloquetAnalysis`).

    On a linear segment these are the free vibrations of the ring with the springs of its contacts, with the phases
    h psi of the harmonics balanced. The exponent recorded is that of the least damped one, at whatever frequency:
    its real part is the same all along the segment.

    Attributes
    ----------
    contact : ContactParameters
        Parameters of the contact nodes.
    balances : TruncatedBalances or None
        The balances with other numbers of harmonics. With them the perturbation of a point gets more harmonics than
        its motion where the frequency is so low that no natural frequency lies within omega / 2 of those balanced.
    """

    contact: ContactParameters
    balances: TruncatedBalances | None = None
    _analyses: dict[int, FloquetAnalysis] = field(default_factory=dict, init=False, repr=False, compare=False)
    _segments: dict[int, LinearSegments] = field(default_factory=dict, init=False, repr=False, compare=False)
    _linear: dict[tuple[int, bytes], tuple[complex, int]] = field(
        default_factory=dict, init=False, repr=False, compare=False
    )

    def exponents(self, point: SolutionPoint) -> ComplexArray:
        """Exponents (1/s) of a point that has its contact Jacobian, the least stable first."""
        n_harmonics = point.balance.n_harmonics
        if n_harmonics not in self._segments:
            self._segments[n_harmonics] = LinearSegments(point.balance, self.contact)
        state = point.linear or self._segments[n_harmonics].state(point.displacement)
        return self._of_nonlinear_motion(point) if state is None else self._of_linear_motion(point, state)

    def _of_linear_motion(self, point: SolutionPoint, state: LinearState) -> ComplexArray:
        """The exponent lambda = s - i h omega of the least damped pole s at the phases h psi."""
        n_harmonics = point.balance.n_harmonics
        key = n_harmonics, state.pressed.tobytes()
        if key not in self._linear:
            receptance = point.balance.receptance
            springs = self._segments[n_harmonics].system(state).springs
            first = 0 if point.balance.frozen_static is None else 1
            poles: dict[float, tuple[complex, int]] = {}  # by the cosine of the phase: -phase has the same decay
            for h in range(first, n_harmonics + 1):
                phase = h * receptance.phase
                cosine = round(float(np.cos(phase)), 12)
                if cosine not in poles:
                    poles[cosine] = least_damped_pole(receptance.modal, phase, springs), h
            self._linear[key] = max(poles.values(), key=lambda pole: pole[0].real)
        pole, h = self._linear[key]
        return np.array([pole - 1j * h * point.omega])

    def _of_nonlinear_motion(self, point: SolutionPoint) -> ComplexArray:
        found = self._analysis(point.balance).exponents(point.displacement, point.contact.jacobian, point.omega)
        if found.size or self.balances is None:
            return found
        lowest = int(point.balance.receptance.modal.angular_frequency[0] / point.omega)
        for n_harmonics in range(max(point.balance.n_harmonics + 1, lowest), MOST_HARMONICS + 1):
            wider = self.balances.balance(n_harmonics)
            displacement = point.with_balance(wider).displacement
            jacobian = wider.element.evaluate(displacement).jacobian
            found = self._analysis(wider).exponents(displacement, jacobian, point.omega)
            if found.size:
                break
        return found

    def _analysis(self, balance: HarmonicBalance) -> FloquetAnalysis:
        if balance.n_harmonics not in self._analyses:
            static = balance.frozen_static is None
            self._analyses[balance.n_harmonics] = FloquetAnalysis.of(balance.receptance, self.contact, static=static)
        return self._analyses[balance.n_harmonics]
