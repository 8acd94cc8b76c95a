"""The study `mistuning`: the tuned ring, sampled mistuned rings, and many with linear contacts.

Quantiles of the amplification factor have distribution-free confidence intervals: the number of n independent samples
below the quantile of level p is binomial, so the order statistics x_(l) and x_(u) hold the quantile with the
probability P(l <= B < u), B binomial of n and p, whatever the distribution [1]_.

References
----------
.. [1] H. A. David, H. N. Nagaraja, Order Statistics, 3rd ed., Wiley, 2003, section 7.1.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import reason_of
from pipeline.results.worst import (
    end_said,
    number_error,
    open_remarks,
    seen_remarks,
    share,
    unstable_peaks,
    with_unit,
    worst_cells,
)
from pipeline.scene.labels import prefixed
from pipeline.scene.schema import Scene
from pipeline.stages.curve.curve_summary import CurveSummary, summary_of
from pipeline.stages.scene_to_solver import nonlinear_problem
from pipeline.studies.mistuning.result import (
    FactorQuantile,
    LinearRings,
    MistuningResult,
    RingCurve,
    SampledRing,
    TunedCurve,
)
from pipeline.studies.mistuning.section import Mistuning as MistuningKeys
from pipeline.studies.study import StudyError

if TYPE_CHECKING:
    from nonlinear.contact.parameters import ContactParameters
    from nonlinear.mistuned_ring.linear_contacts import LinearPeak
    from nonlinear.mistuned_ring.linear_sectors import LinearSectors
    from nonlinear.mistuned_ring.mistuning import Mistuning
    from nonlinear.mistuned_ring.ring_response import MistunedResponse
    from nonlinear.options import Excitation
    from nonlinear.options import SolverOptions as Options
    from pipeline.studies.study import StudyContext
    from rom.cyclic.sector_modes import RingModes


LEVELS = (0.05, 0.5, 0.95, 0.99)
CONFIDENCE = 0.95


def factor_quantiles(values: NDArray[np.float64]) -> tuple[FactorQuantile, ...]:
    """Quantiles of independent samples.

    Shapes: `values` (n,).
    """
    known = np.sort(values[np.isfinite(values)])
    levels = [level for level in LEVELS if known.size * min(level, 1.0 - level) >= 0.5]
    return tuple(_quantile(known, level) for level in levels)


def _quantile(ordered: NDArray[np.float64], level: float) -> FactorQuantile:
    from scipy.stats import binom

    n, tail = ordered.size, 0.5 * (1.0 - CONFIDENCE)
    low = int(binom.ppf(tail, n, level))  # of the samples at least so many lie below, but for the tail
    high = int(binom.ppf(1.0 - tail, n, level)) + 1
    value = float(np.quantile(ordered, level, method="hazen"))
    return FactorQuantile(
        level,
        value,
        float(ordered[low - 1]) if low >= 1 else None,
        float(ordered[high - 1]) if high <= n else None,
    )


DEVIATIONS, BANDWIDTHS = 6.0, 12.0  # half range of the linear peaks about the tuned one
ABOVE = 1.1  # upper end of the frequencies of linear rings over that of the range


@dataclass(frozen=True)
class RingProblem:
    """What the rings of a scene have in common."""

    keys: MistuningKeys  # the section of the scene
    # `modal`, `contact`, `excitation`, `options`: what `nonlinear.mistuned_response` takes
    modal: RingModes
    contact: ContactParameters
    excitation: Excitation
    options: Options

    @classmethod
    def of(cls, scene: Scene, keys: MistuningKeys, rom: Path) -> RingProblem:
        """The problem of a scene on a reduced model."""
        from rom.files.reduced_model_file import read_reduced_model

        modal, contact, excitation, options = nonlinear_problem(scene, read_reduced_model(rom, with_basis=False))
        if modal.n_blades is None:
            raise StudyError("the reduced model does not say how many blades the ring has (n_blades)")
        if keys.frequency is not None and len(keys.frequency) != modal.n_blades:
            found, needed = len(keys.frequency), modal.n_blades
            raise StudyError(f"mistuning.frequency: a list of {found}, allowed: one of {needed}, as the model")
        differ = keys.frequency_deviation if keys.frequency is None else any(keys.frequency)
        if differ and not modal.blades_may_differ:
            raise StudyError(
                "blades on a disk that differ need blade_stiffness in the reduced model; without it allowed: "
                "mistuning.frequency_deviation = 0"
            )
        limits = keys.frequency_range or options.frequency_hz
        return cls(keys, modal, contact, excitation, replace(options, harmonics=keys.harmonics, frequency_hz=limits))

    @property
    def n_blades(self) -> int:
        """Number of blades of the ring."""
        return self.modal.n_blades or 0

    def mistuning(self, seed: int) -> Mistuning:
        """The deviations of one ring; a list of the scene in the place of random ones."""
        from nonlinear.mistuned_ring.mistuning import Mistuning

        keys = self.keys
        drawn = Mistuning.sampled(
            self.n_blades,
            seed,
            frequency=keys.frequency_deviation,
            friction=keys.friction_deviation,
            stiffness=keys.stiffness_deviation,
            interference=keys.interference_deviation,
        )
        return drawn if keys.frequency is None else replace(drawn, frequency=np.array(keys.frequency))

    def seeds(self, count: int, linear: bool = False) -> range:
        """Seeds of so many rings; one where nothing that matters is drawn at random."""
        keys = self.keys
        loads = () if linear else (keys.friction_deviation, keys.interference_deviation)
        drawn = keys.frequency is None or any((keys.stiffness_deviation, *loads))
        return range(keys.seed, keys.seed + (count if drawn else 1))

    def response(self, mistuning: Mistuning | None) -> MistunedResponse:
        """The nonlinear response of one ring; None: the tuned one."""
        from nonlinear.mistuned_ring.ring_response import mistuned_response

        return mistuned_response(self.modal, self.contact, self.excitation, self.options, mistuning)

    def tuned(self) -> TunedCurve:
        """The tuned ring."""
        found = self.response(None)
        if found.peak is None:
            raise StudyError(f"the tuned ring has no solution: {found.message}")
        peak = found.peak
        return TunedCurve(found.frequency_hz, found.envelope_m, peak.frequency_hz, peak.amplitude_m, found.complete)

    def with_worst_motion(self, mistuning: Mistuning, response: MistunedResponse) -> CurveSummary:
        """The response of a ring with its worst motion, in numbers."""
        from nonlinear.mistuned_ring.mistuned_curve import mistuned_curve

        return summary_of(
            mistuned_curve(self.modal, self.contact, self.excitation, self.options, mistuning, response)
        )

    def linear_rings(self) -> LinearRings:
        """Amplification factors with linear contacts: stuck, or free where no contact is pressed at rest."""
        started = time.perf_counter()
        state = "stuck" if np.any(self.contact.initial_load > 0.0) else "free"
        tuned = self._tuned_linear(state)
        half = self._half_range(tuned.frequency_hz)
        low, high = max(tuned.frequency_hz - half, 0.1 * tuned.frequency_hz), tuned.frequency_hz + half
        ring = self._linear(state, high)
        factors = [
            ring.with_mistuning(self.mistuning(seed)).peak((low, high)).amplitude_m / tuned.amplitude_m
            for seed in self.seeds(self.keys.linear_samples, linear=True)
        ]
        found = np.array(factors)
        seconds = round(max(0.0, time.perf_counter() - started), 3)
        return LinearRings(state, tuned.frequency_hz, tuned.amplitude_m, found, factor_quantiles(found), seconds)

    def _linear(self, state: str, highest_hz: float) -> LinearSectors:
        """The tuned ring with linear contacts."""
        from nonlinear.mistuned_ring.linear_sectors import LinearSectors
        from nonlinear.mistuned_ring.mistuning import Mistuning

        parts = self.contact, self.excitation, Mistuning.of(self.n_blades)
        keys: Any = {"highest_hz": ABOVE * highest_hz, "state": state, "output": self.options.output}
        return LinearSectors.of(self.modal, *parts, **keys)

    def _tuned_linear(self, state: str) -> LinearPeak:
        """The highest peak of the tuned ring near a natural frequency in the range; else near the next one above."""
        low, high = self.options.frequency_hz
        natural = self._natural_hz(state)
        inside = natural[(natural > low) & (natural < high)]
        chosen = inside if inside.size else natural[natural > low][:1]
        if not chosen.size:
            raise StudyError(f"no natural frequency with {state} contacts above {low:g} Hz")
        ring = self._linear(state, float(chosen[-1]))
        half = np.minimum(BANDWIDTHS * ring.bandwidth_hz, 0.5 * chosen)
        found = [ring.peak((float(f - half_f), float(f + half_f))) for f, half_f in zip(chosen, half, strict=True)]
        return max(found, key=lambda peak: peak.amplitude_m)

    def _natural_hz(self, state: str) -> NDArray[np.float64]:
        """Frequencies of the tuned ring in the wave of the excitation; with Coriolis forces those of low modes."""
        from rom.cyclic.natural_frequencies import coupled_frequencies

        if self.modal.turns:
            return self._linear(state, self.options.frequency_hz[1]).tuned_hz
        phase, contact, held = self.modal.phase(self.excitation.engine_order), self.contact, float(state == "stuck")
        normal, tangential = held * contact.normal_stiffness, held * contact.tangential_stiffness
        found = coupled_frequencies(self.modal, phase, normal=normal, tangential=tangential) / (2.0 * np.pi)
        return np.asarray(found)

    def _half_range(self, frequency_hz: float) -> float:
        """How far from the tuned peak the highest one of a ring may lie, Hz."""
        first = self.modal.at_phase(self.modal.phase(self.excitation.engine_order))
        moving = first.angular_frequency > 0.0
        keys, damping = self.keys, (first.damping[moving] / first.angular_frequency[moving])
        own = keys.frequency_deviation if keys.frequency is None else float(np.abs(keys.frequency).max())
        spread = DEVIATIONS * math.hypot(own, 0.5 * keys.stiffness_deviation)
        return frequency_hz * max(spread, BANDWIDTHS * float(damping[0]))


def sampled_rings(
    problem: RingProblem, tuned_m: float, progress: Callable[[str], None]
) -> tuple[tuple[SampledRing, ...], RingCurve, CurveSummary]:
    """The nonlinear responses of the rings asked for, the curve of the highest, and the numbers of that one."""
    rings: list[SampledRing] = []
    highest: tuple[Mistuning, MistunedResponse, RingCurve] | None = None
    seeds = problem.seeds(problem.keys.samples)
    for seed in seeds:
        mistuning = problem.mistuning(seed)
        found = problem.response(mistuning)
        rings.append(_summary(seed, found, tuned_m))
        if found.peak is not None and rings[-1].factor == max(r.factor for r in rings if math.isfinite(r.factor)):
            curve = RingCurve(
                seed,
                found.frequency_hz,
                found.envelope_m,
                found.peak.blade_amplitude_m,
                found.amplitude_m.max(axis=0),
                mistuning.frequency,
            )
            highest = mistuning, found, curve
        number = f"ring {len(rings)} of {len(seeds)}"
        progress(f"mistuning, {number}: amplification factor {rings[-1].factor:.4g}, {found.seconds:.1f} s")
    if highest is None:
        raise StudyError(f"no ring has a solution: {rings[0].message}")
    started = time.perf_counter()
    mistuning, found, curve = highest
    worst = problem.with_worst_motion(mistuning, found)
    progress(f"mistuning, worst motion of seed {curve.seed}: {max(0.0, time.perf_counter() - started):.1f} s")
    return tuple(rings), curve, worst


def _summary(seed: int, found: MistunedResponse, tuned_m: float) -> SampledRing:
    """One ring in numbers."""
    peak, nan = found.peak, float("nan")
    return SampledRing(
        seed=seed,
        frequency_hz=nan if peak is None else peak.frequency_hz,
        amplitude_m=nan if peak is None else peak.amplitude_m,
        blade=-1 if peak is None else peak.blade,
        factor=nan if peak is None else peak.amplitude_m / tuned_m,
        points=found.frequency_hz.size,
        complete=found.complete,
        message=found.message,
        seconds=round(found.seconds, 3),
    )


class MistuningStudy:
    """Responses of mistuned rings, as `Study`."""

    name = "mistuning"
    result = MistuningResult

    def key(self, context: StudyContext) -> Mapping[str, Any]:
        """Nothing more than its section and the first curve of the scene."""
        return {}

    def compute(self, context: StudyContext) -> MistuningResult:
        """The rings, one after another."""
        from nonlinear.mistuned_ring.mistuning import MistuningError, whitehead_bound
        from nonlinear.options import OptionsError
        from rom.linear_algebra.threads import one_blas_thread

        section = context.scene.mistuning
        assert section is not None  # the study is asked for
        try:
            with one_blas_thread():
                problem = RingProblem.of(context.scene, section, context.model.rom)
                tuned = problem.tuned()
                rings, highest, worst = sampled_rings(problem, tuned.peak_m, context.progress)
                linear = problem.linear_rings() if section.linear_samples else None
        except (ArithmeticError, MistuningError, OptionsError) as error:
            raise StudyError(reason_of(error)) from None
        return MistuningResult(
            n_blades=problem.n_blades,
            engine_order=problem.excitation.engine_order,
            harmonics=section.harmonics,
            output=problem.options.output,
            drawn=section.frequency is None,
            bound=whitehead_bound(problem.n_blades),
            tuned=tuned,
            rings=rings,
            quantiles=factor_quantiles(np.array([ring.factor for ring in rings])),
            highest=highest,
            worst=worst,
            linear=linear,
        )

    def lines(self, result: MistuningResult) -> Sequence[str]:
        """The largest amplification, its distribution, and what is missing."""
        return [f"mistuning: {line}" for line in (headline(result), *remarks(result))]


def headline(result: MistuningResult) -> str:
    """The largest amplification factor in one line."""
    top = max((ring for ring in result.rings if math.isfinite(ring.factor)), key=lambda ring: ring.factor)
    factor, unit = prefixed(top.amplitude_m, "m")
    count = f"{len(result.rings)} rings" if len(result.rings) > 1 else "1 ring"
    return (
        f"amplification factor {top.factor:.4g} at most of {count}: {top.amplitude_m * factor:.4g} {unit} at "
        f"{top.frequency_hz:.5g} Hz, blade {top.blade}, seed {top.seed}; tuned "
        f"{result.tuned.peak_m * factor:.4g} {unit} at {result.tuned.peak_hz:.5g} Hz"
    )


def remarks(result: MistuningResult) -> tuple[str, ...]:
    """The worst motion, quantiles, the linear rings, and what is missing, a line each."""
    said = [worst_said(result), *worst_remarks(result)]
    said += [f"nonlinear contacts: {quantile_text(result.quantiles)}"] if len(result.rings) > 1 else []
    if result.linear is not None:
        many = len(result.linear.factor)
        values = quantile_text(result.linear.quantiles) if many > 1 else f"factor {result.linear.factor[0]:.4g}"
        said.append(f"{result.linear.state} contacts, {many} rings: {values}; Whitehead's bound {result.bound:.4g}")
    if not result.tuned.complete:
        said.append("the tuned curve does not span the range")
    partial = [ring for ring in result.rings if not ring.complete]
    if partial:
        said.append(f"{len(partial)} of {len(result.rings)} rings are not complete: {partial[0].message}")
    return tuple(said)


def worst_said(result: MistuningResult) -> str:
    """The worst motion of the ring with the highest amplitude, as a table of curves has it."""
    facts = result.worst
    factor, unit = prefixed(facts.height, "m")
    frequency, amplitude, kind = worst_cells(facts, factor)
    ring = f" of seed {result.highest.seed}" if len(result.rings) > 1 else ""
    said = f"worst motion{ring}, largest displacement of any blade: {amplitude} {unit} at {frequency} Hz"
    return f"{said} (branch {kind}), truncation error {share(number_error(facts))}"


def worst_remarks(result: MistuningResult) -> Iterator[str]:
    """What persists of the curve, what was seen in time, what was left open, and what was searched."""
    facts = result.worst
    if unstable_peaks({0: facts}):
        yield f"the peak of the main branch, {with_unit(facts.peak_amplitude_m)}, does not persist"
    yield from filter(None, (end_said(facts),))
    yield from seen_remarks(facts)
    yield from open_remarks(facts)
    yield from filter(None, (facts.worst_searched,))


def quantile_text(quantiles: Sequence[FactorQuantile]) -> str:
    """Quantiles with their intervals as text."""
    parts = []
    for each in quantiles:
        low, high = ("?" if end is None else f"{end:.4g}" for end in (each.low, each.high))
        name = "median" if each.level == 0.5 else f"{100.0 * each.level:g} %"
        parts.append(f"{name} {each.value:.4g} ({low} to {high})")
    return ", ".join(parts)
