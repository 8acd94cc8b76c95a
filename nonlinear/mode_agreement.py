"""Resonances of nonlinear modes beside the peaks of a traced curve, and what the difference is made of.

A nonlinear mode predicts a peak as far as the motion at the peak is that of the mode. The vibration in harmonic 1 at
a peak, q_p in mass-normalised modal coordinates, has a part along the mode, q_r, and a rest:

    q_p = c q_r + r,     q_r^H r = 0.

The rest is what other modes carry. It adds to the output, and in a peak of damping ratio zeta a background of the
relative size s moves the frequency by up to about zeta s.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from nonlinear.contact.fourier import ComplexArray
from nonlinear.contact.parameters import Array
from nonlinear.nonlinear_modes.mode_curve import harmonic_shares
from nonlinear.nonlinear_modes.nonlinear_mode import ModeResonance, NonlinearMode
from nonlinear.options import Excitation
from nonlinear.response_curve import ResponseCurve
from rom.cyclic.receptance import RelativeReceptance
from rom.cyclic.sector_modes import RingModes

FARTHEST = 0.7  # distance |ln A_r / A_p| + 10 |ln f_r / f_p| up to which a resonance and a peak belong together
_FREQUENCY_WEIGHT, _OTHER_KIND = 10.0, 0.1  # _OTHER_KIND: a minimum for a maximum, where force or amplitude turn


@dataclass(frozen=True)
class PeakMotion:
    """The motion at an extreme amplitude of a traced curve."""

    frequency_hz: float
    amplitude_m: float  # amplitude of the output, m
    branch: int  # 0: the main branch; k: detached branch k
    maximum: bool  # whether the amplitude is a maximum; the lower end of an isolated branch is a minimum
    # (H+1, m) modal coordinates of the m modes of the structure
    coordinates: ComplexArray = field(repr=False, compare=False)


@dataclass(frozen=True)
class PeakAgreement:
    """A resonance of a nonlinear mode with the extreme of the traced curve that is nearest to it."""

    mode: int  # place of the mode in the sequence given
    resonance: ModeResonance
    peak: PeakMotion | None  # the extreme; None where there is none near
    # amplitude_deviation, frequency_deviation: of the resonance from the peak, relative to the peak; NaN without a
    # peak
    amplitude_deviation: float
    frequency_deviation: float
    other_motion: float  # share of the output in harmonic 1 at the peak that other modes carry; NaN without a peak
    other_mode: int  # number of the free mode of the structure with the largest part in it, from 1; 0 without a peak
    # (H-1,) sizes of the harmonics 2 .. H at the peak relative to harmonic 1
    peak_shares: Array = field(repr=False, compare=False)


def peak_motions(curve: ResponseCurve, modal: RingModes, excitation: Excitation) -> tuple[PeakMotion, ...]:
    """The motions at the peaks of all branches of a curve, and at the lower ends of its detached branches."""
    found = []
    for branch, part in enumerate((curve, *curve.detached)):
        places = [(peak.index, True) for peak in part.peaks if peak.located]
        places += [(index, False) for index in _minima(part.amplitude_m)] if branch else []
        for index, maximum in places:
            coordinates = _coordinates(part, index, modal, excitation)
            frequency, amplitude = float(part.frequency_hz[index]), float(part.amplitude_m[index])
            found.append(PeakMotion(frequency, amplitude, branch, maximum, coordinates))
    return tuple(found)


def compare_with_peaks(
    modes: Sequence[NonlinearMode], curve: ResponseCurve, modal: RingModes, excitation: Excitation
) -> tuple[tuple[PeakAgreement, ...], tuple[PeakMotion, ...]]:
    """The resonances of nonlinear modes beside the peaks of a traced curve.

    A resonance whose force grows with the amplitude is a maximum of the curve, one whose force falls is the lower end
    of an isolated branch. The nearest are paired first, each peak with one resonance.

    Returns `agreements`: one for each resonance in the frequency range of the curve or with a peak near; by mode, the
    largest first; `missed`: maxima of the curve that no resonance is near to.
    """
    force = excitation.force * abs(dict(excitation.factors).get(1, 1.0))
    peaks = peak_motions(curve, modal, excitation)
    low, high = (float(end) for end in (np.min(curve.frequency_hz), np.max(curve.frequency_hz)))
    output = _receptance(modal, excitation, 1).output_shapes("tip")
    output = output if output.ndim == 1 else output[1]
    resonances = [(place, each) for place, mode in enumerate(modes) for each in mode.resonances(force)]
    partners = _pairs([each for _, each in resonances], peaks)
    agreements = [
        _agreement(place, each, None if number not in partners else peaks[partners[number]], output)
        for number, (place, each) in enumerate(resonances)
        if number in partners or low <= each.frequency_hz <= high
    ]
    taken = set(partners.values())
    missed = tuple(peak for number, peak in enumerate(peaks) if peak.maximum and number not in taken)
    return tuple(agreements), missed


def _pairs(resonances: Sequence[ModeResonance], peaks: Sequence[PeakMotion]) -> dict[int, int]:
    """Numbers of the peaks by those of the resonances that they belong to, the nearest first."""

    def distances() -> Iterator[tuple[float, int, int]]:
        for number, resonance in enumerate(resonances):
            for at, peak in enumerate(peaks):
                height = abs(np.log(resonance.amplitude_m / peak.amplitude_m))
                shift = abs(np.log(resonance.frequency_hz / peak.frequency_hz))
                other = 0.0 if peak.maximum == resonance.stable else _OTHER_KIND
                yield float(height + _FREQUENCY_WEIGHT * shift) + other, number, at

    found: dict[int, int] = {}
    for distance, number, at in sorted(distances()):
        if distance < FARTHEST and number not in found and at not in found.values():
            found[number] = at
    return found


def _agreement(place: int, resonance: ModeResonance, peak: PeakMotion | None, output: ComplexArray) -> PeakAgreement:
    """What is to be said of one resonance and its peak."""
    if peak is None:
        nan = float("nan")
        return PeakAgreement(place, resonance, None, nan, nan, nan, 0, np.empty(0))
    own, motion = resonance.coordinates[1], peak.coordinates[1]
    rest = motion - own * (np.vdot(own, motion) / np.vdot(own, own).real)
    return PeakAgreement(
        mode=place,
        resonance=resonance,
        peak=peak,
        amplitude_deviation=resonance.amplitude_m / peak.amplitude_m - 1.0,
        frequency_deviation=resonance.frequency_hz / peak.frequency_hz - 1.0,
        other_motion=float(abs(output @ rest) / max(abs(output @ motion), 1e-300)),
        other_mode=int(np.argmax(np.abs(output * rest))) + 1,
        peak_shares=harmonic_shares(peak.coordinates),
    )


def _coordinates(part: ResponseCurve, index: int, modal: RingModes, excitation: Excitation) -> ComplexArray:
    """Modal coordinates (H+1, m) at a point of a branch."""
    force = part.contact_force[index]
    receptance = _receptance(modal, excitation, len(force) - 1)
    omega = 2.0 * np.pi * float(part.frequency_hz[index])
    return receptance.modal_response(omega, force.reshape(len(force), -1))[0]


def _receptance(modal: RingModes, excitation: Excitation, highest: int) -> RelativeReceptance:
    phase, harmonics = modal.phase(excitation.engine_order), tuple(range(highest + 1))
    return RelativeReceptance(modal, phase, harmonics, excitation.force, excitation.factors)


def _minima(amplitude: Array) -> list[int]:
    """Inner points whose amplitude is below that of both neighbours."""
    inner = (amplitude[1:-1] < amplitude[:-2]) & (amplitude[1:-1] <= amplitude[2:])
    return [int(place) + 1 for place in np.flatnonzero(inner)]
