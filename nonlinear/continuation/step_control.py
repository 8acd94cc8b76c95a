"""The loop over the steps of a curve, and their lengths: thresholds, the length of the next step, the resonances that
no step must skip.
"""

import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields
from typing import Generic, NamedTuple, TypeVar

import numpy as np

from nonlinear.contact.parameters import Array, ContactParameters
from nonlinear.continuation.solution_point import SolutionPoint
from nonlinear.options import SolverOptions
from rom.cyclic.natural_frequencies import coupled_frequencies
from rom.cyclic.receptance import RelativeReceptance

State = TypeVar("State")


@dataclass(frozen=True)
class ContinuationParameters:
    """Thresholds of step control and of the acceptance tests.

    Lengths are arc lengths, see `Metric`. The deviation of a step is the distance of the corrected from the
    predicted point.
    """

    target_deviation: float = 0.08  # deviation relative to the step length that step control aims at
    max_deviation: float = 0.6  # largest deviation relative to the step length
    # `smallest_factor`, `largest_factor`: limits of the ratio of two successive step lengths
    smallest_factor: float = 0.3
    largest_factor: float = 2.0
    many_iterations: int = 6  # Newton iterations above which the next step is at most `slow_factor` times as long
    slow_factor: float = 0.7  # see `many_iterations`
    # steps up to this length may cross a kink of the curve, where the deviation does not shrink with the step
    kink_step: float = 0.01
    max_kink_deviation: float = 4.0  # largest deviation of these steps, relative to the step length
    min_cosine: float = 0.5  # smallest cosine of the angle between the tangents at both ends of a longer step
    # distance from the mean of the two tangents, relative to the step length, that a smooth segment may have
    max_mean_tangent_deviation: float = 0.02
    # length of the gap that a curve may have at a branch point through which it goes straight on
    branch_point_gap: float = 1e-4
    same_branch_point: float = 1e-3  # distance of two branch points that count as one
    same_solution: float = 1e-6  # relative distance of two solutions that count as one
    # distance of a solution from its guess with another number of harmonics, within which it is the same one
    max_restart_distance: float = 1.5
    resonance_tolerance: float = 1e-9  # relative distance in frequency within which a resonance counts as reached
    frequency_scale: float = 0.1  # part of the frequency range that counts as unit arc length

    def __post_init__(self) -> None:
        """Check ranges."""
        for entry in fields(self):
            if not getattr(self, entry.name) > 0.0:
                raise ValueError(f"{entry.name} = {getattr(self, entry.name)}: must be above 0")
        if not self.smallest_factor < self.slow_factor < 1.0 < self.largest_factor:
            raise ValueError("allowed: smallest_factor < slow_factor < 1 < largest_factor")
        if self.min_cosine >= 1.0:
            raise ValueError(f"min_cosine = {self.min_cosine}: must be below 1")


HIGHEST_ORDER = 7  # highest order of superharmonic resonances; higher ones are too weak


@dataclass(frozen=True)
class Resonances:
    """Resonance frequencies in the range, rad/s, ascending."""

    # natural frequencies with the contacts free, sliding and stuck, of harmonic h of the excitation divided by h
    natural: tuple[float, ...] = ()
    all: tuple[float, ...] = ()  # these and their fractions 1/2 ... 1/H: superharmonic resonances


def find_resonances(receptance: RelativeReceptance, contact: ContactParameters, options: SolverOptions) -> Resonances:
    """The primary and superharmonic resonances of a problem."""
    kn, kt = contact.normal_stiffness, contact.tangential_stiffness
    modal, phase = receptance.modal, receptance.phase
    free, sliding, stuck = (0.0, 0.0), (kn, 0.0), (kn, kt)
    highest = HIGHEST_ORDER if isinstance(options.harmonics, str) else min(options.harmonics, HIGHEST_ORDER)
    limit = highest * options.omega_range[1]
    found = np.concatenate(
        [coupled_frequencies(modal, phase, normal=n, tangential=t, highest=limit) for n, t in (free, sliding, stuck)]
    )
    parts = np.concatenate([found / order for order in range(1, highest + 1)])
    for h in (h for h in receptance.excited_harmonics if h > 1):
        top = h * options.omega_range[1]
        own = [
            coupled_frequencies(modal, h * phase, normal=n, tangential=t, highest=top) / h
            for n, t in (free, sliding, stuck)
        ]
        found, parts = np.concatenate([found, *own]), np.concatenate([parts, *own])
    return Resonances(_inside(found, options), _inside(parts, options))


def _inside(frequencies: Array, options: SolverOptions) -> tuple[float, ...]:
    low, high = (2.0 * np.pi * limit for limit in options.frequency_hz)
    frequencies = np.unique(frequencies)
    return tuple(frequencies[(frequencies > low) & (frequencies < high)].tolist())


def next_step(
    step: float, deviation: float, iterations: int, options: SolverOptions, parameters: ContinuationParameters
) -> float:
    """Length of the step after one of length `step`.

    The deviation from the tangent grows with the square of the step, so deviation / step is proportional to the
    step: it is brought to `target_deviation`. Many iterations make the next step shorter.
    """
    factor = parameters.target_deviation / (deviation / step + 1e-12)
    following = step * min(max(factor, parameters.smallest_factor), parameters.largest_factor)
    if iterations > parameters.many_iterations:
        following = min(following, parameters.slow_factor * step)
    return min(following, options.max_step)


def step_to_resonance(
    point: SolutionPoint, step: float, resonances: tuple[float, ...], min_step: float, tolerance: float
) -> float:
    """The step, cut short where it would pass one of the `resonances` (rad/s).

    A resonance can be narrower than a step. `tolerance`: relative distance within which it counts as reached.
    """
    domega_ds = point.tangent[1]
    for resonance in resonances:
        distance = resonance - point.omega
        if distance * domega_ds > 0.0 and abs(distance) > tolerance * resonance:
            step = min(step, distance / domega_ds)
    return max(step, min_step)


class Step(NamedTuple, Generic[State]):
    """An accepted step of a curve."""

    state: State  # where it leads: the point, and what the next step needs beside it
    length: float  # its length
    following: float  # length proposed for the next step
    last: bool = False  # whether the curve ends there


Way = Callable[[State, float], Step[State] | float | None]


def follow(
    start: State,
    ways: Sequence[Way[State]],
    lengths: tuple[float, float],
    most: int = sys.maxsize,
    arrive: Callable[[State, Step[State]], Step[State] | None] | None = None,
) -> Iterator[Step[State]]:
    """Accepted steps of a curve from `start` on, `most` of them at most: the loop of every continuation.

    `ways`: how the next point is sought; the first one that finds it counts. From a state and a length each gives the
    step, a shorter length to try, or None where it leads nowhere. `lengths`: of the first and of the shortest step.
    `arrive`: what becomes of a step from a state; None: the curve ends before it.
    """
    state, length = start, lengths[0]
    for _ in range(most):
        step = _first_step(state, ways, max(length, lengths[1]), lengths[1])
        if step is not None and arrive is not None:
            step = arrive(state, step)
        if step is None:
            return
        yield step
        if step.last:
            return
        state, length = step.state, step.following


def _first_step(state: State, ways: Sequence[Way[State]], longest: float, shortest: float) -> Step[State] | None:
    """The step by the first of the ways that succeeds with the longest length, or with a shorter one."""
    for way in ways:
        found = way(state, longest)
        while isinstance(found, float) and found >= shortest:
            found = way(state, found)
        if isinstance(found, Step):
            return found
    return None


@dataclass(frozen=True)
class IterationControl:
    """Step lengths of a curve whose corrector tells by its iterations how hard a step was."""

    first: float
    largest: float
    smallest: float  # the curve ends where a shorter step would be needed
    few: int  # iterations up to which the next step is longer
    many: int  # iterations from which it is shorter

    def follow(
        self, start: State, advance: Callable[[State, float], tuple[State, int] | None], most: int
    ) -> Iterator[Step[State]]:
        """Steps along a curve. `advance`: the point a step beyond another, and the iterations; None: it is halved."""

        def way(state: State, length: float) -> Step[State] | float:
            found = advance(state, length)
            return 0.5 * length if found is None else Step(found[0], length, self._following(length, found[1]))

        return follow(start, (way,), (self.first, self.smallest), most)

    def _following(self, step: float, iterations: int) -> float:
        """Length of the next step."""
        step = min(1.5 * step, self.largest) if iterations <= self.few else step
        return 0.5 * step if iterations >= self.many else step
