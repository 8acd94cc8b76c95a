"""What the study `backbone` found."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Numbers = NDArray[np.float64]
Counts = NDArray[np.int64]


@dataclass(frozen=True)
class TracedPeak:
    """An extreme amplitude of a response curve."""

    # `frequency_hz`, `amplitude_m`: where it is, Hz and m
    frequency_hz: float
    amplitude_m: float
    branch: int  # 0: the main branch; k: detached branch k


@dataclass(frozen=True)
class PredictedResonance:
    """A resonance of a nonlinear mode under the force of the curve."""

    # `frequency_hz`, `amplitude_m`: where it is, Hz and m
    frequency_hz: float
    amplitude_m: float
    damping_ratio: float  # damping ratio of the mode there
    stable: bool  # whether the resonant force grows with the amplitude
    force_exponent: float  # d ln F / d ln A of the resonant force over the amplitude of the output
    peak: TracedPeak | None  # the extreme of the curve that belongs to it
    # `amplitude_deviation`, `frequency_deviation`: from the peak, relative; NaN without one
    amplitude_deviation: float
    frequency_deviation: float
    other_motion: float  # share of the output in harmonic 1 at the peak that other modes carry; NaN without a peak
    reasons: tuple[str, ...]  # why it deviates by more than the tolerance; empty where it does not


@dataclass(frozen=True)
class ModeBackbone:
    """A nonlinear mode at P amplitudes."""

    # `number`, `nodal_diameter`: which mode it is
    number: int
    nodal_diameter: int
    # `free_hz`, `stuck_hz`: its linear limits: natural frequencies with open and with stuck contacts
    free_hz: float
    stuck_hz: float
    frequency_hz: Numbers  # (P,), frequency, damping ratio, amplitude of the output and resonant force
    damping_ratio: Numbers  # (P,), frequency, damping ratio, amplitude of the output and resonant force
    amplitude_m: Numbers  # (P,), frequency, damping ratio, amplitude of the output and resonant force
    force_n: Numbers  # (P,), frequency, damping ratio, amplitude of the output and resonant force
    # (P,), 1 - MAC of the motion in harmonic 1 and that of the smallest amplitude, mass-normalised
    shape_change: Numbers
    higher_harmonic: Numbers  # (P,), size of the largest of the harmonics above 1, relative to harmonic 1
    piece: Counts  # (P,), number of the piece: between two pieces an internal resonance was passed over
    # `slipping`, `separating`: (P,), contact nodes that slip and that open in the cycle
    slipping: Counts
    separating: Counts
    complete: bool  # whether the largest amplitude was reached
    message: str  # why it ends, or why there is none
    # under the force of the curve, the largest first; none for another nodal diameter than that of the excitation
    resonances: tuple[PredictedResonance, ...]
    seconds: float  # what it took, s


@dataclass(frozen=True)
class UnpredictedPeak:
    """A peak of a response curve that no resonance of the modes is near to."""

    peak: TracedPeak  # the peak
    reasons: tuple[str, ...]  # what is known of it


@dataclass(frozen=True)
class CurveBackbones:
    """The nonlinear modes of one response curve."""

    curve: int  # number of the curve in the run
    label: str  # its swept parameters
    parameters: Mapping[str, Any]  # swept keys and values
    # `engine_order`, `harmonics`: engine order and number of harmonics
    engine_order: int
    harmonics: int
    force_n: float  # amplitude of harmonic 1 of the excitation, N
    # `traced_m`, `traced_hz`: (N,), the peaks of all its branches
    traced_m: Numbers
    traced_hz: Numbers
    modes: tuple[ModeBackbone, ...]  # the modes
    unpredicted: tuple[UnpredictedPeak, ...]  # peaks of a tenth of the highest or more that no resonance is near to


@dataclass(frozen=True)
class BackboneResult:
    """Nonlinear modes of the curves of a run."""

    tolerance: float  # deviation above which reasons are given
    curves: tuple[CurveBackbones, ...]  # the curves with their modes
    damping: str = "first_harmonic"  # harmonics in which damping is compensated: "first_harmonic" or "all_harmonics"

    @property
    def definition(self) -> str:
        """The definition of the modes in words."""
        where = "all harmonics (Krack 2015)" if self.damping == "all_harmonics" else "harmonic 1 (backbone.damping)"
        return f"damping compensated in {where}"


def agreement(result: BackboneResult) -> tuple[int, int, float]:
    """Number of resonances at maxima, of those within the tolerance, and the largest amplitude deviation of these."""
    pairs = [
        each
        for curve in result.curves
        for mode in curve.modes
        for each in mode.resonances
        if each.peak is not None and each.stable
    ]
    good = [each for each in pairs if not each.reasons]
    return len(pairs), len(good), max((abs(each.amplitude_deviation) for each in good), default=0.0)
