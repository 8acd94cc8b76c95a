"""Why a resonance of a nonlinear mode and a traced peak differ, as far as their motions tell."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from pipeline.studies.backbone.linear_neighbours import LinearNeighbours

if TYPE_CHECKING:
    from nonlinear import NonlinearMode, PeakAgreement, PeakMotion

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
        from nonlinear import harmonic_shares

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
        from nonlinear import harmonic_shares

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
