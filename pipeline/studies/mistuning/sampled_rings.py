"""The rings of the study: deviations of each, nonlinear responses, peaks with linear contacts."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from pipeline.scene.mistuning_section import Mistuning as MistuningKeys
from pipeline.scene.schema import Scene
from pipeline.stages.scene_to_solver import nonlinear_problem
from pipeline.studies.mistuning.factor_quantiles import factor_quantiles
from pipeline.studies.mistuning.mistuning_result import LinearRings, RingCurve, SampledRing, TunedCurve
from pipeline.studies.study import StudyError

if TYPE_CHECKING:
    from nonlinear import (
        ContactParameters,
        Excitation,
        LinearPeak,
        LinearRing,
        LinearSectors,
        MistunedResponse,
        Mistuning,
    )
    from nonlinear import SolverOptions as Options
    from rom import RingModes

DEVIATIONS, BANDWIDTHS = 6.0, 12.0  # half range of the linear peaks about the tuned one
ABOVE = 1.1  # upper end of the frequencies of linear rings over that of the range


@dataclass(frozen=True)
class RingProblem:
    """What the rings of a scene have in common."""

    keys: MistuningKeys  # the section of the scene
    modal: RingModes  # what `nonlinear.mistuned_response` takes
    contact: ContactParameters  # what `nonlinear.mistuned_response` takes
    excitation: Excitation  # what `nonlinear.mistuned_response` takes
    options: Options  # what `nonlinear.mistuned_response` takes

    @classmethod
    def of(cls, scene: Scene, keys: MistuningKeys, rom: Path) -> RingProblem:
        """The problem of a scene on a reduced model."""
        from rom import SectorModes, read_reduced_model

        modal, contact, excitation, options = nonlinear_problem(scene, read_reduced_model(rom, with_basis=False))
        if modal.n_blades is None:
            raise StudyError("the reduced model does not say how many blades the ring has (n_blades)")
        if keys.frequency is not None and len(keys.frequency) != modal.n_blades:
            found, needed = len(keys.frequency), modal.n_blades
            raise StudyError(f"mistuning.frequency: a list of {found}, allowed: one of {needed}, as the model")
        differ = keys.frequency_deviation if keys.frequency is None else any(keys.frequency)
        if isinstance(modal, SectorModes) and differ and modal.model.blade_stiffness is None:
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
        from nonlinear import Mistuning

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
        from nonlinear import mistuned_response

        return mistuned_response(self.modal, self.contact, self.excitation, self.options, mistuning)

    def tuned(self) -> TunedCurve:
        """The tuned ring."""
        found = self.response(None)
        if found.peak is None:
            raise StudyError(f"the tuned ring has no solution: {found.message}")
        peak = found.peak
        return TunedCurve(found.frequency_hz, found.envelope_m, peak.frequency_hz, peak.amplitude_m, found.complete)

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

    def _linear(self, state: str, highest_hz: float) -> LinearRing | LinearSectors:
        """The tuned ring with linear contacts."""
        from nonlinear import LinearRing, LinearSectors, Mistuning
        from rom import ModalModel

        parts = self.contact, self.excitation, Mistuning.of(self.n_blades)
        keys: Any = {"highest_hz": ABOVE * highest_hz, "state": state, "output": self.options.output}
        if isinstance(self.modal, ModalModel):
            return LinearRing.of(self.modal, *parts, **keys)
        return LinearSectors.of(self.modal, *parts, **keys)

    def _tuned_linear(self, state: str) -> LinearPeak:
        """The highest peak of the tuned ring near a natural frequency in the range; else near the next one above."""
        from rom import coupled_frequencies

        low, high = self.options.frequency_hz
        phase, contact, held = self.modal.phase(self.excitation.engine_order), self.contact, float(state == "stuck")
        normal, tangential = held * contact.normal_stiffness, held * contact.tangential_stiffness
        natural = coupled_frequencies(self.modal, phase, normal=normal, tangential=tangential) / (2.0 * np.pi)
        inside = natural[(natural > low) & (natural < high)]
        chosen = inside if inside.size else natural[natural > low][:1]
        if not chosen.size:
            raise StudyError(f"no natural frequency with {state} contacts above {low:g} Hz")
        ring = self._linear(state, float(chosen[-1]))
        half = np.minimum(BANDWIDTHS * ring.bandwidth_hz, 0.5 * chosen)
        found = [ring.peak((float(f - half_f), float(f + half_f))) for f, half_f in zip(chosen, half, strict=True)]
        return max(found, key=lambda peak: peak.amplitude_m)

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
) -> tuple[tuple[SampledRing, ...], RingCurve]:
    """The nonlinear responses of the rings asked for, and the curve of the highest."""
    rings: list[SampledRing] = []
    highest: RingCurve | None = None
    seeds = problem.seeds(problem.keys.samples)
    for seed in seeds:
        mistuning = problem.mistuning(seed)
        found = problem.response(mistuning)
        rings.append(_summary(seed, found, tuned_m))
        if found.peak is not None and rings[-1].factor == max(r.factor for r in rings if math.isfinite(r.factor)):
            highest = RingCurve(
                seed,
                found.frequency_hz,
                found.envelope_m,
                found.peak.blade_amplitude_m,
                found.amplitude_m.max(axis=0),
                mistuning.frequency,
            )
        number = f"ring {len(rings)} of {len(seeds)}"
        progress(f"mistuning, {number}: amplification factor {rings[-1].factor:.4g}, {found.seconds:.1f} s")
    if highest is None:
        raise StudyError(f"no ring has a solution: {rings[0].message}")
    return tuple(rings), highest


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
