"""Floquet exponents of the solved points of a response curve, and what crosses the imaginary axis between them.

References
----------
A. H. Nayfeh, B. Balachandran, Applied Nonlinear Dynamics, Wiley, 1995.
A. Ruhe, Algorithms for the nonlinear eigenvalue problem, SIAM Journal on Numerical Analysis 10(4), 1973.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from enum import Enum
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.fourier import ComplexArray
from nonlinear.contact.parameters import Array, ContactParameters
from nonlinear.stability.contact_feedback import ContactFeedback
from nonlinear.stability.eigenproblem import (
    CONVERGED,
    OVERLAP,
    ROUND_OFF,
    SAME,
    SLICE_WIDTH,
    WIDTH,
    Near,
    Pencil,
    Refined,
    all_refined,
    converged,
    eigenvalues_by_slices,
    in_strip,
)
from nonlinear.stability.hill import HillProblem, LinearHillProblem, Memory, touching_nodes
from nonlinear.stability.point_contact import PointContact
from nonlinear.stability.reduced_problem import ReducedProblems
from nonlinear.stability.reduced_refinement import ReducedRefinement, ReducedWave
from nonlinear.stability.ring_structure import RingStructure
from nonlinear.stability.slider_memory import MemorySampler
from rom.cyclic.receptance import RelativeReceptance

# in units of omega
IN_DOUBT = 2e-3  # decay up to which an eigenvalue of few modes is refined: three times the largest error seen
# the same of one with condensed poles: stops of 100 times the stiffness of the structure move them by .015
CONDENSED_DOUBT = 0.05
NEXT_TO_ZERO = 1e-3  # eigenvalue up to which condensed poles do not matter
NEUTRAL = 1e-6  # real part up to which an exponent is not called growing: the error of a neutral one
OFF_AXIS = 1e-3j  # from a real eigenvalue of the scan to a complex pair near it
KEPT_PROBLEMS = 16  # with a disk, each with modes of its own
HALF_ORDER = 0.01  # distance of abs(Im sigma) from 1/2 that still counts as period doubling


@dataclass(frozen=True)
class ExactEigenproblem:
    """Hill's method at one point, without its condensation: linearised around the last eigenvalue (Ruhe).

    Poles that are condensed to a flexibility linear in sigma around 0 come in pairs whose flexibilities nearly
    cancel. Where contacts are much stiffer than the structure what is left of their error moves an exponent by 0.01
    omega.
    """

    problem: HillProblem
    contact: PointContact

    @property
    def conjugate_pairs(self) -> bool:
        """Whether the eigenvalues come in conjugate pairs."""
        return self.problem.conjugate_pairs

    def around(self, value: complex) -> LinearHillProblem:
        """The problem linearised next to an approximate eigenvalue: structure and contact."""
        problem, contact, shift = self.problem, self.contact, value * (1.0 + ROUND_OFF) + ROUND_OFF
        touching = touching_nodes(contact.jacobian)
        model = problem.contact_free_in_amplitudes.around(shift, contact.omega, np.repeat(touching, 3))
        pencil = Pencil(model.state_matrix, np.eye(len(model.state_matrix)))
        if touching.any():
            stiffness, change = contact.at(shift)
            loop = ContactFeedback.closed(model, problem.in_amplitudes(stiffness[touching]))
            pencil = loop.pencil(None if change is None else np.asarray(problem.in_amplitudes(change[touching])))
        return LinearHillProblem(shift, Pencil(pencil.matrix + shift * pencil.descriptor, pencil.descriptor))

    def refined(self, linear: LinearHillProblem, value: complex, near: Near) -> Refined | None:
        """Where the eigenvalue changes no more, nothing is linearised."""
        return Refined(value) if abs(near.change) < CONVERGED else None

    def undecided(self, linear: LinearHillProblem, near: Near) -> Near | None:
        """The nearest of all eigenvalues; None where no pole is near."""
        return Near(linear.nearest_of_all(), None) if linear.size else None


class Basis(Enum):
    """The coordinates in which eigenvalues are solved for; which one takes the least work was measured."""

    ALL_MODES = "the states of the retained poles"
    FEW_MODES = "the lowest modes and residual ones"
    SHARED_MOTIONS = "few contact motions that all waves share"


class Instability(Enum):
    """How a perturbation of the periodic motion grows, and what happens where it starts to.

    REAL : lambda is real. A fold of the curve where its frequency turns round, else a branch point, at which another
        family of motions leaves (of another nodal diameter, if kappa is not 0).
    COMPLEX : lambda is one of a complex pair. The motion becomes quasi-periodic (Neimark-Sacker bifurcation).
    PERIOD_DOUBLING : Im lambda = omega / 2. The period of the motion doubles.
    """

    REAL = "real"
    COMPLEX = "complex"
    PERIOD_DOUBLING = "period doubling"


@dataclass(frozen=True)
class FloquetAnalysis:
    """Stability of the points of one balance against perturbations of one phase shift kappa (see `HillProblem`).

    Sliders that stick throughout the cycle stand still in every perturbation.

    For the harmonics balanced an exponent is exact where it is zero. Elsewhere the condensed poles change a leading
    exponent by some 1e-4 omega, the sampling of the slider memory by some 1e-3 omega. The truncation of the harmonics
    matters more: where few harmonics make another motion, they make another stability.
    """

    problem: HillProblem  # perturbations of the wave
    sampler: MemorySampler  # slider memory of a point
    _problems: dict[int, HillProblem] = field(default_factory=dict, init=False, repr=False, compare=False)

    @classmethod
    def of(
        cls, receptance: RelativeReceptance, contact: ContactParameters, *, kappa: float = 0.0, static: bool = True
    ) -> "FloquetAnalysis":
        """For a balance of these parts."""
        harmonics = max(receptance.harmonics)
        problem = HillProblem(receptance.modal.softly_held, receptance.phase, harmonics, kappa, static)
        if ReducedRefinement(problem, contact).small:  # few states anyway, and none is refined where it grows
            problem = replace(problem, retention_harmonic=max(problem.retention_harmonic, harmonics))
        return cls(problem, MemorySampler(contact, harmonics))

    def point(self, displacement: Array, jacobian: Array, omega: float) -> PointContact:
        """The contact of a point.

        Shapes: `displacement` (2H+1, n_c, 3), `jacobian` (n_c, 3, 3, 2H+1, 2H+1).
        """
        return PointContact(jacobian, omega, self.sampler.memory(displacement))

    def exponents(self, displacement: Array, jacobian: Array, omega: float) -> ComplexArray:
        """Floquet exponents of one point (see `floquet_exponents`); the parameters are those of `point`."""
        contact, basis = self.point(displacement, jacobian, omega), self.basis(omega)
        if self.problem.kappa or basis is Basis.ALL_MODES:
            return self._with_all_poles(contact, floquet_exponents(self.problem, jacobian, omega, contact.memory))
        if basis is Basis.FEW_MODES and self.few_modes.suffice(omega):
            return self._in_few_modes(contact)
        return self._refined_where_growing(contact)

    def is_stable(self, displacement: Array, jacobian: Array, omega: float, limit: float) -> bool:
        """Whether no perturbation of a point grows faster than `limit`, 1/s; in the basis of all modes.

        Exponents of condensed poles that are farther from the limit than their error decide as they are, nearer ones
        are refined to those of all poles.
        """
        contact = self.point(displacement, jacobian, omega)
        found = floquet_exponents(self.problem, jacobian, omega, contact.memory)
        doubt = omega * (CONDENSED_DOUBT if self.refinement.small else IN_DOUBT)
        if np.any(found.real > limit + doubt):
            return False
        return not np.any(self._with_all_poles(contact, found[found.real > limit - doubt]).real > limit)

    def followed(self, displacement: Array, jacobian: Array, omega: float, start: complex) -> complex | None:
        """The exponent (1/s) that an exponent of a neighbouring point leads to; None if it leads to none.

        One that has left the strip belongs to another nodal diameter.
        """
        found = self.refined(self.point(displacement, jacobian, omega), start / omega)
        return None if found is None else omega * found

    def basis(self, omega: float, k: int = 0) -> Basis:
        """The basis of the eigenvalues of nodal diameter k that takes the least work."""
        if self.refinement.applies(omega):
            return Basis.FEW_MODES
        modal = self.problem.modal
        if not modal.neighbours_coupled or (k == 0 and self.problem.kappa):
            return Basis.ALL_MODES
        if self.refinement.small and (k == 0 or (not modal.waves_differ and self.few_modes.suffice(omega))):
            return Basis.ALL_MODES
        return Basis.SHARED_MOTIONS

    def refined(self, contact: PointContact, sigma: complex, k: int = 0) -> complex | None:
        """The eigenvalue of nodal diameter k that an approximate one leads to; None if it leads to none."""
        found = self._refined(contact, sigma, k)
        return None if found is None or abs(found.value.imag) > 0.5 + OVERLAP else found.value

    def _refined(self, contact: PointContact, sigma: complex, k: int = 0) -> Refined | None:
        """As `refined`: in the basis with the least work, and with all modes where that is not exact."""
        basis = self.basis(contact.omega, k)
        found: Refined | None = Refined(sigma, False)
        if basis is Basis.FEW_MODES:
            kappa = self.problem_of(k).kappa
            found = _first(lambda value: self.refinement.converged(contact, kappa, value), sigma, k)
        elif basis is Basis.SHARED_MOTIONS:
            found = self.structure.refinement(contact, k).converged(sigma)
        # the sign of a real exponent of the wave next to zero is that of all modes
        if found is None or (found.exact and (k != 0 or abs(found.value) > SAME)):
            return found
        return _first(partial(_with_every_pole, ExactEigenproblem(self.problem_of(k), contact)), found.value, k)

    def problem_of(self, k: int) -> HillProblem:
        """The problem of nodal diameter k with all modes."""
        if k == 0:
            return self.problem
        modal = self.problem.modal
        assert modal.n_blades is not None
        if k not in self._problems:
            if modal.waves_differ and len(self._problems) >= KEPT_PROBLEMS:
                self._problems.clear()
            self._problems[k] = replace(self.problem, kappa=2.0 * np.pi * k / modal.n_blades)
        return self._problems[k]

    @cached_property
    def refinement(self) -> ReducedRefinement:
        """Refines exponents of any kappa in few modes."""
        return ReducedRefinement(self.problem, self.sampler.parameters)

    @cached_property
    def few_modes(self) -> ReducedProblems:
        """The problem in few modes, for approximate exponents of any kappa."""
        return ReducedProblems.few(self.problem, self.sampler.parameters)

    @cached_property
    def structure(self) -> RingStructure:
        """The structure in few contact motions that all waves share."""
        return RingStructure(self.problem, self.sampler.parameters, self.problem.modal.n_blades or 1)

    def _with_all_poles(self, contact: PointContact, exponents: ComplexArray) -> ComplexArray:
        """Exponents of condensed poles; those that may grow are refined to those of all poles."""
        exact, sigma = ExactEigenproblem(self.problem, contact), exponents / contact.omega
        doubtful = (sigma.real > -CONDENSED_DOUBT) & (np.abs(sigma) > NEXT_TO_ZERO)

        found = all_refined(partial(_with_every_pole, exact), sigma[doubtful], exact.conjugate_pairs)
        return contact.omega * in_strip(np.append(sigma[~doubtful], found))

    def _refined_where_growing(self, contact: PointContact) -> ComplexArray:
        """The exponents with stiff contacts; those that grow are refined to exact ones.

        Condensed poles, linear in sigma, matter there: they make perturbations grow that decay.
        """
        found = floquet_exponents(self.problem, contact.jacobian, contact.omega, contact.memory)
        growing = grows(found, contact.omega)
        if not growing.any():
            return found
        refinement = self.structure.refinement(contact, 0)

        def refined(value: complex) -> Refined | None:
            if abs(value) < NEXT_TO_ZERO:
                return Refined(value)
            exact = refinement.converged(value)
            return Refined(value, False) if exact is not None and not exact.exact else exact

        sigma = found / contact.omega
        return contact.omega * in_strip(np.append(sigma[~growing], all_refined(refined, sigma[growing], True)))

    def _in_few_modes(self, contact: PointContact) -> ComplexArray:
        """The exponents in few modes; those that may grow are refined to those of all modes."""
        wave = ReducedWave(self.few_modes.at(contact.omega), self.sampler.parameters, contact)
        sigma = eigenvalues_by_slices(wave.eigenvalues, WIDTH, True)
        doubtful = sigma.real > -IN_DOUBT
        refined = all_refined(partial(self._refined, contact), sigma[doubtful], True)
        return contact.omega * in_strip(np.append(sigma[~doubtful], refined))


def _with_every_pole(exact: ExactEigenproblem, value: complex) -> Refined | None:
    """The eigenvalue that one of condensed poles leads to; itself where it decays and leads to none near it."""
    found = converged(exact, value)
    if not value.real > 0.0 and (found is None or abs(found.value - value) > 2.0 * CONDENSED_DOUBT):
        return Refined(value, False)
    return found


def _first(refine: Callable[[complex], Refined | None], value: complex, k: int) -> Refined | None:
    """The eigenvalue that `value` leads to; of another nodal diameter than the wave's also from beside it."""
    return refine(value) or (refine(value + OFF_AXIS) if k else None)


def floquet_exponents(
    problem: HillProblem, jacobian: Array, omega: float, memory: Memory | None = None
) -> ComplexArray:
    """Floquet exponents lambda with abs(Im lambda) <= omega / 2; none if no retained pole comes there.

    With a slider `memory` the strip is cut into slices, and the problem is linearised in the middle of each. What
    grows is refined by successive linear problems (Ruhe 1973).
    Shapes: `jacobian` (n_c, 3, 3, 2H+1, 2H+1), returns (k,).
    """
    eigenproblem = problem.eigenproblem(jacobian, omega, memory)
    if memory is None:
        sigma = eigenproblem.eigenvalues()
    else:
        pairs = eigenproblem.conjugate_pairs
        sigma = eigenvalues_by_slices(eigenproblem.eigenvalues, SLICE_WIDTH, pairs)
        grows = sigma.real > 0.0
        refined = all_refined(partial(converged, eigenproblem), sigma[grows], pairs)
        sigma = np.append(sigma[~grows], refined)
    return omega * in_strip(sigma)


def with_conjugate(exponent: complex) -> ComplexArray:
    """An exponent of the wave (1/s) and, if it is not real, the other one of its pair."""
    return np.array([exponent] if exponent.imag == 0.0 else [exponent, exponent.conjugate()], dtype=complex)


def growth_limit(exponents: ComplexArray, omega: float) -> NDArray[np.float64]:
    """Real part (1/s) from which on exponents of the wave count as growing at `omega` (rad/s).

    1e-6 omega: a smaller one is the numerical error of a neutral exponent; as a growth it would take 160 000 periods
    for a factor e. Zero for a real one: its sign is exact, that of det dR/dx.
    """
    return np.where(np.imag(exponents) == 0.0, 0.0, NEUTRAL * omega)


def grows(exponents: ComplexArray, omega: float) -> NDArray[np.bool_]:
    """Which of the exponents of the wave (1/s) grow at `omega` (rad/s): those beyond `growth_limit`."""
    return np.asarray(exponents.real > growth_limit(exponents, omega))


def instability_of(exponent: complex, omega: float) -> Instability:
    """What an `exponent` (1/s) with a positive real part stands for at `omega` (rad/s)."""
    order = abs(exponent.imag) / omega
    if order < SAME:
        return Instability.REAL
    return Instability.PERIOD_DOUBLING if abs(order - 0.5) < HALF_ORDER else Instability.COMPLEX


def crossings(before: ComplexArray, after: ComplexArray, omega: float) -> tuple[Instability, ...]:
    """What crosses the imaginary axis between two neighbouring points with these exponents; nothing: empty.

    A change of the number of unstable real exponents by an odd one is a real exponent that crosses: complex ones meet
    on the real axis in pairs. Those at half of the frequency meet there too, and only where complex ones do. For what
    remains, those of the less stable point are taken that grow most slowly.
    """
    growing = before[grows(before, omega)], after[grows(after, omega)]
    kinds = [np.abs(np.abs(one.imag) / omega - 0.5) < HALF_ORDER for one in growing]
    crossed: set[Instability] = set()
    if not any(np.any(~half & (one.imag != 0.0)) for one, half in zip(growing, kinds, strict=True)):
        if np.count_nonzero(kinds[0]) != np.count_nonzero(kinds[1]):
            crossed.add(Instability.PERIOD_DOUBLING)
        growing = tuple(one[one.imag == 0.0] for one in growing)
    few, many = sorted(growing, key=len)
    many = many[np.argsort(many.real)]
    rest = {instability_of(value, omega) for value in many[: len(many) - len(few)]}
    if (np.count_nonzero(few.imag == 0.0) + np.count_nonzero(many.imag == 0.0)) % 2:
        others = many[many.imag != 0.0][: len(many) - len(few) - 1]
        rest = {Instability.REAL} | {instability_of(value, omega) for value in others}
    crossed |= rest
    return tuple(item for item in Instability if item in crossed)
