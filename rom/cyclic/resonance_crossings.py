"""Resonance crossings: where an engine order meets the modes of its nodal diameter (SAFE and Campbell diagrams)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

BACKWARD, FORWARD, STANDING = "backward", "forward", "standing"


def excited_nodal_diameter(engine_order: int, n_blades: int | None) -> int:
    """The nodal diameter that an engine order excites: min(EO mod N_b, N_b - EO mod N_b).

    `n_blades`: number of blades N_b; None for a single structure, which has nodal diameter 0 only.
    """
    if n_blades is None:
        return 0
    rest = engine_order % n_blades
    return min(rest, n_blades - rest)


def wave_direction(engine_order: int, n_blades: int | None) -> str:
    """How the wave of an engine order travels, seen from the blades, relative to the rotation.

    A disturbance at rest passes the blades against the rotation: backward. From half the number of blades on the
    blades sample it as a wave of fewer nodal diameters in the other direction.

    `n_blades`: number of blades N_b; None for a single structure. Returns "backward" for 0 < EO mod N_b < N_b / 2,
    "forward" above N_b / 2, "standing" at 0 and N_b / 2.
    """
    rest = 0 if n_blades is None else engine_order % n_blades
    if n_blades is None or 2 * rest in (0, n_blades):
        return STANDING
    return BACKWARD if 2 * rest < n_blades else FORWARD


@dataclass(frozen=True)
class ResonanceCrossing:
    """One mode that an engine order excites, between its linear limits.

    Springs only raise natural frequencies (Rayleigh), so whatever linear springs below those of stuck contacts stand
    for the contacts, the natural frequency of this number lies between `free_hz` and `stuck_hz`.
    """

    engine_order: int  # engine order EO
    nodal_diameter: int  # its nodal diameter
    wave: str  # "backward", "forward" or "standing", as in `wave_direction`
    mode: int  # number of the mode in this nodal diameter, from 1
    # free_hz, stuck_hz: natural frequencies with free and with stuck contacts, Hz
    free_hz: float
    stuck_hz: float
    # 0 where a part of free_hz to stuck_hz lies in the frequency range; otherwise the distance of the nearer limit
    # from the nearer end of the range, relative to that end, below 0 under the range
    range_distance: float
    # at a steady speed n the same from the excitation frequency EO n / 60; None at rest and for engine order 0
    margin: float | None

    @property
    def in_range(self) -> bool:
        """Whether the mode can resonate in the frequency range."""
        return self.range_distance == 0.0

    @property
    def speeds_rpm(self) -> tuple[float, float] | None:
        """Speeds at which the engine order has the frequencies `free_hz` and `stuck_hz`; None for order 0."""
        if self.engine_order == 0:
            return None
        return 60.0 * self.free_hz / self.engine_order, 60.0 * self.stuck_hz / self.engine_order


def resonance_crossings(
    engine_order: int,
    n_blades: int | None,
    free_hz: ArrayLike,
    stuck_hz: ArrayLike,
    range_hz: tuple[float, float],
    speed_rpm: float = 0.0,
) -> list[ResonanceCrossing]:
    """Modes that an engine order can bring to resonance in a frequency range, and the nearest ones outside of it.

    `free_hz`, `stuck_hz` (m,): natural frequencies at the nodal diameter of the engine order with free and stuck
    contacts, ascending, Hz; `speed_rpm`: steady speed, rev/min; 0: none. Returns those
    in the range, the next one below it and above it, and at a speed the one with the smallest margin, by mode.
    """
    excitation = engine_order * speed_rpm / 60.0
    diameter, wave = excited_nodal_diameter(engine_order, n_blades), wave_direction(engine_order, n_blades)
    every = []
    for mode, (free, stuck) in enumerate(zip(np.asarray(free_hz), np.asarray(stuck_hz), strict=True), start=1):
        limits = float(free), float(stuck)
        margin = signed_distance(limits, (excitation, excitation)) if excitation > 0.0 else None
        every.append(
            ResonanceCrossing(engine_order, diameter, wave, mode, *limits, signed_distance(limits, range_hz), margin)
        )
    return [every[place] for place in sorted(_places(every))]


def speed_crossings(speeds_rpm: ArrayLike, natural_hz: ArrayLike, engine_order: int) -> list[tuple[float, float]]:
    """Where the line f = EO n / 60 crosses a natural frequency that is known at some speeds (Campbell diagram).

    Between two speeds the squared frequency is linear in the squared speed, as for a stiffness K + n^2 K_n.

    `speeds_rpm` (k,): speeds, rev/min, ascending; `natural_hz` (k,): natural frequency at these speeds, Hz. Returns
    speed, rev/min, and frequency, Hz, of each crossing.
    """
    x, f = np.asarray(speeds_rpm, float) ** 2, np.asarray(natural_hz, float) ** 2
    above = f - (engine_order / 60.0) ** 2 * x
    found = []
    for k in range(len(x) - 1):
        first, last = above[k], above[k + 1]
        starts = first == 0.0 and k == 0 and x[0] > 0.0
        if not (starts or (first != 0.0 and first * last <= 0.0)):
            continue
        square = x[k] if starts else x[k] + (x[k + 1] - x[k]) * first / (first - last)
        speed = float(np.sqrt(square))
        found.append((speed, engine_order * speed / 60.0))
    return found


def signed_distance(limits: tuple[float, float], span: tuple[float, float]) -> float:
    """Signed distance of an interval from a span, relative to the nearer end of the span; 0 where they meet."""
    if limits[0] > span[1]:
        return limits[0] / span[1] - 1.0
    return min(limits[1] / span[0] - 1.0, 0.0)


def _places(modes: list[ResonanceCrossing]) -> set[int]:
    """Which modes are kept."""
    kept = {place for place, each in enumerate(modes) if each.in_range}
    below = [place for place, each in enumerate(modes) if each.range_distance < 0.0]
    above = [place for place, each in enumerate(modes) if each.range_distance > 0.0]
    kept |= {*below[-1:], *above[:1]}
    margins = [(abs(each.margin), place) for place, each in enumerate(modes) if each.margin is not None]
    return kept | {place for _, place in sorted(margins)[:1]}
