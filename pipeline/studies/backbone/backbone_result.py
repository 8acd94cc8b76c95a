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
    """An extreme amplitude of a response curve.

    Attributes
    ----------
    frequency_hz, amplitude_m : float
        Where it is, Hz and m.
    branch : int
        0: the main branch; k: detached branch k.
    """

    frequency_hz: float
    amplitude_m: float
    branch: int


@dataclass(frozen=True)
class PredictedResonance:
    """A resonance of a nonlinear mode under the force of the curve.

    Attributes
    ----------
    frequency_hz, amplitude_m : float
        Where it is, Hz and m.
    damping_ratio : float
        Damping ratio of the mode there.
    stable : bool
        Whether the resonant force grows with the amplitude.
    force_exponent : float
        d ln F / d ln A of the resonant force over the amplitude of the output.
    peak : TracedPeak or None
        The extreme of the curve that belongs to it.
    amplitude_deviation, frequency_deviation : float
        From the peak, relative; NaN without one.
    other_motion : float
        Share of the output in harmonic 1 at the peak that other modes carry; NaN without a peak.
    reasons : tuple of str
        Why it deviates by more than the tolerance; empty where it does not.
    """

    frequency_hz: float
    amplitude_m: float
    damping_ratio: float
    stable: bool
    force_exponent: float
    peak: TracedPeak | None
    amplitude_deviation: float
    frequency_deviation: float
    other_motion: float
    reasons: tuple[str, ...]


@dataclass(frozen=True)
class ModeBackbone:
    """A nonlinear mode at P amplitudes.

    Attributes
    ----------
    number, nodal_diameter : int
        Which mode it is.
    free_hz, stuck_hz : float
        Its linear limits: natural frequencies with open and with stuck contacts.
    frequency_hz, damping_ratio, amplitude_m, force_n : (P,) array
        Frequency, damping ratio, amplitude of the output and resonant force.
    shape_change : (P,) array
        1 - MAC of the motion in harmonic 1 and that of the smallest amplitude, mass-normalised.
    higher_harmonic : (P,) array
        Size of the largest of the harmonics above 1, relative to harmonic 1.
    piece : (P,) int
        Number of the piece: between two pieces an internal resonance was passed over.
    slipping, separating : (P,) int
        Contact nodes that slip and that open in the cycle.
    complete : bool
        Whether the largest amplitude was reached.
    message : str
        Why it ends, or why there is none.
    resonances : tuple of PredictedResonance
        Under the force of the curve, the largest first; none for another nodal diameter than that of the excitation.
    seconds : float
        What it took, s.
    """

    number: int
    nodal_diameter: int
    free_hz: float
    stuck_hz: float
    frequency_hz: Numbers
    damping_ratio: Numbers
    amplitude_m: Numbers
    force_n: Numbers
    shape_change: Numbers
    higher_harmonic: Numbers
    piece: Counts
    slipping: Counts
    separating: Counts
    complete: bool
    message: str
    resonances: tuple[PredictedResonance, ...]
    seconds: float


@dataclass(frozen=True)
class UnpredictedPeak:
    """A peak of a response curve that no resonance of the modes is near to.

    Attributes
    ----------
    peak : TracedPeak
        The peak.
    reasons : tuple of str
        What is known of it.
    """

    peak: TracedPeak
    reasons: tuple[str, ...]


@dataclass(frozen=True)
class CurveBackbones:
    """The nonlinear modes of one response curve.

    Attributes
    ----------
    curve : int
        Number of the curve in the run.
    label : str
        Its swept parameters.
    parameters : mapping
        Swept keys and values.
    engine_order, harmonics : int
        Engine order and number of harmonics.
    force_n : float
        Amplitude of harmonic 1 of the excitation, N.
    traced_m, traced_hz : (N,) array
        The peaks of all its branches.
    modes : tuple of ModeBackbone
        The modes.
    unpredicted : tuple of UnpredictedPeak
        Peaks of a tenth of the highest or more that no resonance is near to.
    """

    curve: int
    label: str
    parameters: Mapping[str, Any]
    engine_order: int
    harmonics: int
    force_n: float
    traced_m: Numbers
    traced_hz: Numbers
    modes: tuple[ModeBackbone, ...]
    unpredicted: tuple[UnpredictedPeak, ...]


@dataclass(frozen=True)
class BackboneResult:
    """Nonlinear modes of the curves of a run.

    Attributes
    ----------
    tolerance : float
        Deviation above which reasons are given.
    curves : tuple of CurveBackbones
        The curves with their modes.
    damping : str
        Harmonics in which damping is compensated: "first_harmonic" or "all_harmonics".
    """

    tolerance: float
    curves: tuple[CurveBackbones, ...]
    damping: str = "first_harmonic"

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
