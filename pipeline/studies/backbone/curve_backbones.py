"""The nonlinear modes of one response curve, their resonances, and the peaks of the curve beside them."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from pipeline.scene.backbone_section import Backbone
from pipeline.scene.labels import member_label
from pipeline.stages.respond import CurveResult
from pipeline.stages.scene_to_solver import nonlinear_problem
from pipeline.stages.stored_curve import read_curve
from pipeline.studies.backbone.backbone_result import (
    CurveBackbones,
    ModeBackbone,
    PredictedResonance,
    TracedPeak,
    UnpredictedPeak,
)
from pipeline.studies.backbone.disagreement import Disagreement
from pipeline.studies.backbone.linear_neighbours import LinearNeighbours

if TYPE_CHECKING:
    from nonlinear import (
        ContactParameters,
        Excitation,
        ModeDamping,
        NonlinearMode,
        PeakAgreement,
        PeakMotion,
        ResponseCurve,
        SolverOptions,
    )
    from rom import RingModes

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
    from nonlinear import compare_with_peaks
    from rom import one_blas_thread, read_reduced_model

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
    from nonlinear import OptionsError, harmonic_shares, nonlinear_mode

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
