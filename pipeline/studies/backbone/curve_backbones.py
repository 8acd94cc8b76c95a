"""The nonlinear modes of one response curve, their resonances, and the peaks of the curve beside them.

Around each mode stand linear natural frequencies, free and stuck, of its nodal diameter and of its harmonics'. They
and the motions tell, as far as they do, why a resonance of a mode and a traced peak differ.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from pipeline.scene.labels import member_label
from pipeline.stages.curve.curve_file import read_curve
from pipeline.stages.curve.respond import CurveResult
from pipeline.stages.scene_to_solver import nonlinear_problem
from pipeline.studies.backbone.result import (
    CurveBackbones,
    ModeBackbone,
    PredictedResonance,
    TracedPeak,
    UnpredictedPeak,
)
from pipeline.studies.backbone.section import Backbone

if TYPE_CHECKING:
    from nonlinear.contact.parameters import ContactParameters
    from nonlinear.mode_agreement import PeakAgreement, PeakMotion
    from nonlinear.nonlinear_modes.nonlinear_mode import ModeDamping, NonlinearMode
    from nonlinear.options import Excitation, SolverOptions
    from nonlinear.response_curve import ResponseCurve
    from rom.cyclic.sector_modes import RingModes


NEAR = 0.05  # relative distance at which a harmonic counts as near a mode
_COUNT = 20


@dataclass(frozen=True)
class LinearNeighbours:
    """Frequencies of one structure with its contacts."""

    modal: RingModes  # the structure with free contacts
    contact: ContactParameters  # the contact
    nodal_diameter: int  # nodal diameter of harmonic 1

    def free_hz(self, harmonic: int = 1) -> NDArray[np.float64]:
        """Natural frequencies with open contacts at the phase of a harmonic, Hz."""
        own = self.modal.at(harmonic * self.nodal_diameter)
        return np.asarray(own.angular_frequency / (2.0 * np.pi))

    def stuck_hz(self, harmonic: int = 1) -> NDArray[np.float64]:
        """Natural frequencies with stuck contacts at the phase of a harmonic, Hz."""
        from rom.cyclic.natural_frequencies import coupled_frequencies

        rubs = self.contact.friction > 0.0
        found = coupled_frequencies(
            self.modal,
            harmonic * self.modal.phase(self.nodal_diameter),
            normal=self.contact.normal_stiffness,
            tangential=self.contact.tangential_stiffness * rubs,
        )
        return np.asarray(found / (2.0 * np.pi))

    def ranges(self, harmonic: int = 1) -> Iterator[tuple[int, float, float]]:
        """Number, lowest and highest frequency of the first modes between open and stuck contacts, Hz."""
        pairs = zip(self.free_hz(harmonic), self.stuck_hz(harmonic), strict=False)
        for number, (free, stuck) in enumerate(pairs, start=1):
            if number > _COUNT:
                return
            yield number, float(min(free, stuck)), float(max(free, stuck))

    def within(self, frequency_hz: float, damping: float, own: int) -> Iterator[tuple[int, float]]:
        """Other modes of the same nodal diameter, and their nearest frequency, within the half-power bandwidth."""
        for number, low, high in self.ranges():
            near = float(np.clip(frequency_hz, low, high))
            if number != own and abs(near - frequency_hz) < damping * frequency_hz:
                yield number, near

    def nearest(self, harmonic: int, frequency_hz: float) -> str:
        """The mode that a harmonic is near to, as `, near mode 3: 1250 to 1400 Hz`; empty where there is none."""
        best, said = NEAR, ""
        for number, low, high in self.ranges(harmonic):
            distance = abs(float(np.clip(frequency_hz, low, high)) / frequency_hz - 1.0)
            if distance < best:
                best, said = distance, f", near mode {number} of its nodal diameter: {low:.5g} to {high:.5g} Hz"
        return said


FREQUENCY_WEIGHT = 4.0  # a frequency may deviate by a quarter of the tolerance
FLAT, STEEP = 0.5, 20.0  # d ln F / d ln A
NOTABLE, LARGE = 0.02, 0.1  # share of a higher harmonic, near a mode of its nodal diameter and elsewhere
SUPERHARMONIC = 0.5
BROAD = 0.05  # damping ratio
QUASISTATIC = 3.0  # a free mode with a frequency so much higher answers quasi-statically


@dataclass(frozen=True)
class Disagreement:
    """The reasons for the deviations on one curve."""

    neighbours: LinearNeighbours  # linear frequencies of the structure
    modes: Sequence[tuple[int, NonlinearMode]]  # numbers of the modes, and the modes that were computed
    tolerance: float  # deviation above which there is something to explain
    several: bool  # whether the excitation has harmonics above 1

    def of_resonance(self, pair: PeakAgreement) -> tuple[str, ...]:
        """Reasons why a resonance deviates by more than the tolerance from its peak; none where it does not."""
        if pair.peak is None:
            return tuple(self._without_peak(pair))
        if max(abs(pair.amplitude_deviation), FREQUENCY_WEIGHT * abs(pair.frequency_deviation)) <= self.tolerance:
            return ()
        found = [*self._other_modes(pair), *self._harmonics(pair), *self._force(pair)]
        damping, frequency = pair.resonance.damping_ratio, pair.resonance.frequency_hz
        if damping > BROAD:
            found.append(f"damping ratio {damping:.2f}: the peak is broad, and a background shifts it")
        for number, near in self.neighbours.within(frequency, damping, self.modes[pair.mode][0]):
            found.append(f"mode {number} ({near:.5g} Hz) lies within the half-power bandwidth")
        if self.several:
            found.append("the excitation has further harmonics, which the mode does not see")
        return tuple(found or ["the motions agree; no reason was found"])

    def of_peak(self, peak: PeakMotion) -> tuple[str, ...]:
        """What is known of a peak that no resonance is near to."""
        from nonlinear.nonlinear_modes.mode_curve import harmonic_shares

        shares = harmonic_shares(peak.coordinates)
        found = [] if (h := self._resonant(shares, peak.frequency_hz)) is None else [self._resonance(h, peak, shares)]
        known = [own for own, _ in self.modes]
        for number, low, high in self.neighbours.ranges():
            if low <= peak.frequency_hz <= high and number not in known:
                found.append(f"it lies in the range of mode {number} ({low:.5g} to {high:.5g} Hz), not asked for")
        for number, mode in self.modes:
            if not mode.complete:
                found.append(f"mode {number} ends early: {mode.message}")
        return tuple(found or self._nearest_mode(peak))

    def _resonance(self, h: int, peak: PeakMotion, shares: NDArray[np.float64]) -> str:
        """The resonance of a higher harmonic at a peak."""
        kind = "superharmonic" if shares[h - 2] > SUPERHARMONIC else "internal"
        return f"{kind} resonance 1:{h}: {self._harmonic(peak.frequency_hz, h, shares[h - 2])}"

    def _nearest_mode(self, peak: PeakMotion) -> list[str]:
        """Where the mode that is nearest in frequency has the amplitude of a peak, and under which force."""
        told = []
        for number, mode in self.modes:
            if mode.amplitude_m.min() < peak.amplitude_m < mode.amplitude_m.max():
                at = int(np.argmin(np.abs(np.log(mode.amplitude_m / peak.amplitude_m))))
                frequency, force = float(mode.frequency_hz[at]), float(mode.force[at])
                said = f"mode {number} has this amplitude at {frequency:.5g} Hz under {force:.3g} N"
                told.append((abs(np.log(frequency / peak.frequency_hz)), said))
        return [said for _, said in sorted(told)[:1]]

    def _without_peak(self, pair: PeakAgreement) -> Iterator[str]:
        """Why there may be no peak near a resonance."""
        yield "no peak of the curve is near"
        if not pair.resonance.stable:
            yield "it is the lower end of an isolated branch, which was not found"
        yield from self._harmonics(pair)

    def _other_modes(self, pair: PeakAgreement) -> Iterator[str]:
        """Other modes in harmonic 1."""
        if pair.other_motion < 0.5 * self.tolerance or pair.peak is None:
            return
        frequency = self.neighbours.free_hz()[pair.other_mode - 1]
        which = f"mostly free mode {pair.other_mode} ({frequency:.5g} Hz)"
        if frequency > QUASISTATIC * pair.peak.frequency_hz:
            which = "mostly the quasi-static response of higher modes"
        yield f"other modes carry {100.0 * pair.other_motion:.2g} % of the output at the peak, {which}"

    def _harmonics(self, pair: PeakAgreement) -> Iterator[str]:
        """Higher harmonics: an internal resonance."""
        from nonlinear.nonlinear_modes.mode_curve import harmonic_shares

        own = harmonic_shares(pair.resonance.coordinates)
        larger = np.maximum(own, pair.peak_shares) if len(pair.peak_shares) == len(own) else own
        h = self._resonant(larger, pair.resonance.frequency_hz)
        if h is not None:
            at_peak = f", {100.0 * pair.peak_shares[h - 2]:.2g} % at the peak" if len(pair.peak_shares) else ""
            said = self._harmonic(pair.resonance.frequency_hz, h, own[h - 2])
            yield f"internal resonance 1:{h}: {said} in the mode{at_peak}"

    def _resonant(self, shares: NDArray[np.float64], frequency_hz: float) -> int | None:
        """The largest harmonic that is notable: by far, or less where its frequency is near a mode."""
        near = np.array([bool(self.neighbours.nearest(h, h * frequency_hz)) for h in range(2, len(shares) + 2)])
        shown = np.where(shares > np.where(near, NOTABLE, LARGE), shares, 0.0)
        return int(np.argmax(shown)) + 2 if np.max(shown, initial=0.0) > 0.0 else None

    def _harmonic(self, frequency_hz: float, h: int, share: float) -> str:
        """Share of a harmonic, and the linear mode that its frequency is near to."""
        near = self.neighbours.nearest(h, h * frequency_hz)
        return f"harmonic {h} ({h * frequency_hz:.5g} Hz{near}) has {100.0 * share:.2g} % of harmonic 1"

    def _force(self, pair: PeakAgreement) -> Iterator[str]:
        """Force and amplitude that hardly depend on each other."""
        exponent = abs(pair.resonance.force_exponent)
        if exponent < FLAT:
            percent = 1.0 / max(exponent, 1e-3)
            yield f"the resonant force hardly depends on the amplitude: 1 % of force is {percent:.2g} % of amplitude"
        elif exponent > STEEP and not pair.resonance.stable:
            yield "the mode turns back in amplitude nearby, where one force has several motions"


BELOW, ABOVE = 0.1, 1.5  # of the lowest peak and of the highest motion
SMALL = 0.2  # of the highest peak: smaller ones are not told of where no resonance is near


@dataclass(frozen=True)
class _Problem:
    """A curve with what it was computed with."""

    curve: ResponseCurve
    modal: RingModes
    contact: ContactParameters
    excitation: Excitation
    options: SolverOptions

    @property
    def force(self) -> float:
        """Amplitude of harmonic 1 of the excitation, N."""
        return self.excitation.force * abs(dict(self.excitation.factors).get(1, 1.0))

    def same_wave(self, nodal_diameter: int) -> bool:
        """Whether the excitation has this nodal diameter on the ring, in the same direction."""
        turns = (self.modal.phase(nodal_diameter) - self.modal.phase(self.excitation.engine_order)) / (2.0 * np.pi)
        return abs(turns - round(turns)) < 1e-9


def curve_backbones(number: int, result: CurveResult, file: Path, rom: Path, section: Backbone) -> CurveBackbones:
    """The nonlinear modes of a curve."""
    from nonlinear.mode_agreement import compare_with_peaks
    from rom.files.reduced_model_file import read_reduced_model
    from rom.linear_algebra.threads import one_blas_thread

    with one_blas_thread():
        scene, curve = result.member.scene, read_curve(file)
        modal, contact, excitation, options = nonlinear_problem(scene, read_reduced_model(rom, with_basis=False))
        problem = _Problem(curve, modal, contact, excitation, replace(options, harmonics=curve.harmonics))
        limits = section.amplitudes or _amplitudes(curve)
        asked = section.nodal_diameters or (excitation.engine_order,)
        own_wave = [nd for nd in asked if problem.same_wave(nd)][:1]  # further ones are the same on the ring
        computed = [
            _mode(problem, k, nd, limits, nd in own_wave, section.damping) for nd in asked for k in section.modes
        ]
        excited = [(place, found.mode) for place, found in enumerate(computed) if found.mode and found.excited]
        own = [(computed[place].backbone.number, mode) for place, mode in excited]
        pairs, missed = compare_with_peaks([mode for _, mode in excited], curve, modal, excitation)
    neighbours = LinearNeighbours(modal, contact, excitation.engine_order)
    disagreement = Disagreement(neighbours, own, section.tolerance, len(excitation.harmonics) > 0)
    found = {place: [pair for pair in pairs if excited[pair.mode][0] == place] for place in range(len(computed))}
    modes = tuple(
        replace(each.backbone, resonances=tuple(_predicted(pair, disagreement) for pair in found[place]))
        for place, each in enumerate(computed)
    )
    peaks = [peak for part in (curve, *curve.detached) for peak in part.peaks if peak.located]
    return CurveBackbones(
        curve=number,
        label=member_label(result.member),
        parameters=dict(result.member.parameters),
        engine_order=excitation.engine_order,
        harmonics=curve.harmonics,
        force_n=problem.force,
        traced_m=np.array([peak.amplitude_m for peak in peaks]),
        traced_hz=np.array([peak.frequency_hz for peak in peaks]),
        modes=modes,
        unpredicted=_unpredicted(missed, max((peak.amplitude_m for peak in peaks), default=0.0), disagreement)
        if own
        else (),
    )


@dataclass(frozen=True)
class _Computed:
    """A mode, None where there is none, and what is told of it; `excited`: by the excitation of the curve."""

    backbone: ModeBackbone
    mode: NonlinearMode | None
    excited: bool


def _amplitudes(curve: ResponseCurve) -> tuple[float, float]:
    """A tenth of the lowest highest-peak of a branch, and half more than the highest motion, m."""
    branches = [float(part.amplitude_m.max()) for part in (curve, *curve.detached) if part.points]
    worst = [curve.worst.amplitude_m] if curve.worst is not None else []
    tops = [top for top in (*branches, *worst) if np.isfinite(top) and top > 0.0]
    return BELOW * min(tops), ABOVE * max(tops)


def _mode(
    problem: _Problem,
    number: int,
    nodal_diameter: int,
    limits: tuple[float, float],
    excited: bool,
    damping: ModeDamping,
) -> _Computed:
    """One mode; where it cannot be computed its message says why."""
    from nonlinear.nonlinear_modes.mode_curve import harmonic_shares
    from nonlinear.nonlinear_modes.nonlinear_mode import nonlinear_mode
    from nonlinear.options import OptionsError

    start, neighbours = time.process_time(), LinearNeighbours(problem.modal, problem.contact, nodal_diameter)
    free, stuck = neighbours.free_hz(), neighbours.stuck_hz()
    known = number <= len(stuck)
    empty, none = np.empty(0), np.empty(0, dtype=np.int64)
    told = ModeBackbone(
        number=number,
        nodal_diameter=nodal_diameter,
        free_hz=float(free[number - 1]) if known else float("nan"),
        stuck_hz=float(stuck[number - 1]) if known else float("nan"),
        frequency_hz=empty,
        damping_ratio=empty,
        amplitude_m=empty,
        force_n=empty,
        shape_change=empty,
        higher_harmonic=empty,
        piece=none,
        slipping=none,
        separating=none,
        complete=False,
        message="",
        resonances=(),
        seconds=0.0,
    )
    try:
        given = problem.modal, problem.contact, nodal_diameter, limits, problem.options
        mode = nonlinear_mode(*given, number=number, damping=damping)
    except (ArithmeticError, OptionsError) as error:
        return _Computed(replace(told, message=str(error)), None, excited)
    first = mode.coordinates[:, 1]
    overlap = np.abs(first.conj() @ first[0]) ** 2 / (np.linalg.norm(first, axis=1) * np.linalg.norm(first[0])) ** 2
    told = replace(
        told,
        frequency_hz=mode.frequency_hz,
        damping_ratio=mode.damping_ratio,
        amplitude_m=mode.amplitude_m,
        force_n=mode.force,
        shape_change=np.maximum(1.0 - overlap, 0.0),
        higher_harmonic=harmonic_shares(mode.coordinates).max(axis=1, initial=0.0),
        piece=mode.piece,
        slipping=mode.slipping,
        separating=mode.separating,
        complete=mode.complete,
        message=mode.message,
        seconds=round(time.process_time() - start, 3),
    )
    return _Computed(told, mode, excited)


def _predicted(pair: PeakAgreement, disagreement: Disagreement) -> PredictedResonance:
    resonance, peak = pair.resonance, pair.peak
    return PredictedResonance(
        frequency_hz=resonance.frequency_hz,
        amplitude_m=resonance.amplitude_m,
        damping_ratio=resonance.damping_ratio,
        stable=resonance.stable,
        force_exponent=resonance.force_exponent,
        peak=None if peak is None else _traced(peak),
        amplitude_deviation=pair.amplitude_deviation,
        frequency_deviation=pair.frequency_deviation,
        other_motion=pair.other_motion,
        reasons=disagreement.of_resonance(pair),
    )


def _unpredicted(
    missed: tuple[PeakMotion, ...], highest: float, disagreement: Disagreement
) -> tuple[UnpredictedPeak, ...]:
    """The missed peaks that are not small, the highest first."""
    order = sorted(missed, key=lambda peak: -peak.amplitude_m)
    return tuple(
        UnpredictedPeak(_traced(peak), disagreement.of_peak(peak))
        for peak in order
        if peak.amplitude_m >= SMALL * highest
    )


def _traced(peak: PeakMotion) -> TracedPeak:
    return TracedPeak(peak.frequency_hz, peak.amplitude_m, peak.branch)
