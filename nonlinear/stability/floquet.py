"""Floquet exponents of the solved points of a response curve, and what crosses the imaginary axis between them."""

from dataclasses import dataclass
from enum import Enum

import numpy as np

from nonlinear.contact.fourier import ComplexArray
from nonlinear.contact.parameters import Array, ContactParameters
from nonlinear.stability.hill import HillProblem, Memory, PerturbedMotion
from nonlinear.stability.slider_memory import MemorySampler
from rom import RelativeReceptance

SLICE = 0.25  # width of the slices that the strip is cut into, in units of w as all that follows
OVERLAP = 0.02  # an exponent this near to a border counts on both sides of it
SETTLED = 1e-6  # change at which an exponent solved for again stays
SAME = 1e-5  # distance up to which two of those are one
MAX_REPEATS = 8
HALF_TURN = 0.01  # distance of |Im lambda| from w / 2 that still counts as period doubling


class Instability(Enum):
    """How a perturbation of the periodic motion grows, and what happens where it starts to.

    REAL : without turning: a fold of the curve where its frequency turns round, else a branch point, at which another
        family of motions leaves (of another pattern of the ring, if kappa is not 0).
    COMPLEX : with a frequency of its own: the motion becomes quasi-periodic (Neimark-Sacker).
    PERIOD_DOUBLING : with w / 2: every other cycle becomes another one.
    """

    REAL = "real"
    COMPLEX = "complex"
    PERIOD_DOUBLING = "period doubling"


@dataclass(frozen=True)
class FloquetAnalysis:
    """Stability of the points of one balance against perturbations of one pattern of the ring (see `HillProblem`).

    Accuracy: for the harmonics balanced an exponent is exact where it is zero. Elsewhere the poles condensed cost
    some 1e-4 w. A slider remembers where it stopped, which makes its share of the contact Jacobian depend on
    lambda. That is taken into account to some 1e-3 w (`SliderMemory`; `ConeSliderMemory` for the coupled law); without
    it lumped blades in partial slip had (0.011 +- 0.139 i) w where time integration has (-0.006 +- 0.144 i) w.
    Sliders that stick throughout the cycle stand still in every perturbation. The harmonics left out matter more than
    all this: where few of them make another motion, they make another stability.
    """

    problem: HillProblem
    sampler: MemorySampler

    @classmethod
    def of(
        cls, receptance: RelativeReceptance, contact: ContactParameters, *, pattern: float = 0.0, static: bool = True
    ) -> "FloquetAnalysis":
        """For a balance of these parts; `static` False where its harmonic 0 is frozen."""
        harmonics = max(receptance.harmonics)
        problem = HillProblem(receptance.modal, receptance.phase, harmonics, pattern, static)
        return cls(problem, MemorySampler(contact, harmonics))

    def exponents(self, displacement: Array, jacobian: Array, omega: float) -> ComplexArray:
        """Exponents (1/s) of one point, the least stable first (see `floquet_exponents`).

        `displacement` (2H+1, n_c, 3): real coefficients; `jacobian` of `ContactForces` there; w = `omega`, rad/s.
        """
        return floquet_exponents(self.problem, jacobian, omega, self.sampler.memory(displacement))

    def growth_rate(self, displacement: Array, jacobian: Array, omega: float) -> float:
        """Largest real part (1/s): above 0 the motion is unstable; -inf if no mode reaches the strip."""
        found = self.exponents(displacement, jacobian, omega)
        return float(found[0].real) if found.size else -np.inf


def floquet_exponents(
    problem: HillProblem, jacobian: Array, omega: float, memory: Memory | None = None
) -> ComplexArray:
    """Exponents lambda (1/s) with |Im lambda| <= w / 2, the least stable first; none if no mode reaches there.

    `jacobian` (n_c, 3, 3, 2H+1, 2H+1) as in `ContactForces`, w = `omega` in rad/s. With the `memory` of sliders
    the strip is cut into slices and the problem linearised in the middle of each; what grows is solved for again,
    linearised around itself.
    """
    motion = problem.at(jacobian, omega, memory)
    if memory is None:
        found = motion.eigenvalues()
    else:
        found = _sliced(motion)
        grows = found.real > 0.0
        found = np.append(found[~grows], _settled(motion, found[grows]))
    found = found[np.abs(found.imag) <= 0.5 + OVERLAP]
    return omega * found[np.argsort(-found.real)]


def _sliced(motion: PerturbedMotion) -> ComplexArray:
    """Eigenvalues / w in the strip, slice by slice; of two that come near each other at a border one is taken."""
    inside, beside = [], []
    for centre in SLICE * np.arange(0 if motion.symmetric else -2, 3):
        values = motion.eigenvalues(1j * float(centre) if centre else 0.0)
        distance = np.abs(values.imag - centre)
        if motion.symmetric and centre > 0.0:
            values, distance = np.append(values, values.conj()), np.append(distance, distance)
        inside.append(values[distance <= SLICE / 2])
        beside.append(values[(distance > SLICE / 2) & (distance <= SLICE / 2 + OVERLAP)])
    found = np.concatenate(inside)
    for value in np.concatenate(beside):
        if not np.any(np.abs(found - value) < OVERLAP):
            found = np.append(found, value)
    return found


def _settled(motion: PerturbedMotion, values: ComplexArray) -> ComplexArray:
    """The eigenvalues that linearising again and again at the nearest one leads to; what leads to none was false."""
    found: list[complex] = []
    if motion.symmetric:  # the others are the complex conjugates
        values = values[values.imag > -SETTLED]
    for start in values[np.argsort(np.abs(values))]:  # the false ones are large and may lead to the true ones
        value, state = complex(start), None
        for _ in range(MAX_REPEATS):
            if motion.symmetric and abs(value.imag) < SETTLED:
                value = complex(value.real)
            before = value
            value, state = motion.nearest(value, state)
            if abs(value - before) < SETTLED:
                value = complex(value.real) if motion.symmetric and abs(value.imag) < SETTLED else value
                if all(abs(value - other) > SAME for other in found):
                    found.append(value)
                break
    mirrored = [value.conjugate() for value in found if motion.symmetric and abs(value.imag) > SAME]
    return np.array(found + mirrored, dtype=complex)


def kind(exponent: complex, omega: float) -> Instability:
    """What an exponent (1/s) stands for at w = `omega` (rad/s)."""
    turn = abs(exponent.imag) / omega
    if turn < SAME:
        return Instability.REAL
    return Instability.PERIOD_DOUBLING if abs(turn - 0.5) < HALF_TURN else Instability.COMPLEX


def crossings(before: ComplexArray, after: ComplexArray, omega: float) -> tuple[Instability, ...]:
    """What crosses the imaginary axis between two neighbouring points with these exponents; nothing: empty.

    A change of the number of unstable real exponents by an odd one is a real exponent that crosses: complex ones meet
    on the real axis in pairs. For what remains, those of the less stable point are taken that grow most slowly.
    """
    few, many = sorted((before[before.real > 0.0], after[after.real > 0.0]), key=len)
    many = many[np.argsort(many.real)]
    kinds = {kind(value, omega) for value in many[: len(many) - len(few)]}
    if (np.count_nonzero(few.imag == 0.0) + np.count_nonzero(many.imag == 0.0)) % 2:
        others = many[many.imag != 0.0][: len(many) - len(few) - 1]
        kinds = {Instability.REAL} | {kind(value, omega) for value in others}
    return tuple(item for item in Instability if item in kinds)


def wave_patterns(n_blades: int | None, engine_order: int) -> tuple[float, ...]:
    """kappa of the perturbations that the smallest ring with the wave can have: 0, psi, 2 psi, ..., up to pi.

    For engine order N_b / 2: 0 and pi, those of two blades.
    """
    if n_blades is None:
        return (0.0,)
    phases = {min(k * engine_order % n_blades, -k * engine_order % n_blades) for k in range(n_blades)}
    return tuple(2.0 * np.pi * k / n_blades for k in sorted(phases))


def ring_patterns(n_blades: int | None) -> tuple[float, ...]:
    """kappa of all perturbations of the ring, from 0 to pi (-kappa has the complex conjugate exponents)."""
    return wave_patterns(n_blades, 1)
