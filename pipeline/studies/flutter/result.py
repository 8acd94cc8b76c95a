"""What the study `flutter` found."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Numbers = NDArray[np.float64]


@dataclass(frozen=True)
class CycleFacts:
    """A limit cycle of a wave."""

    # `frequency_hz`, `amplitude_m`, `vibration_m`: Hz, and largest displacement with and without the static part, m
    frequency_hz: float
    amplitude_m: float
    vibration_m: float
    attracting: bool  # whether other amplitudes of the wave come to it
    persists: bool  # whether it attracts, and no perturbation of another nodal diameter grows
    growth_rate: float  # largest real part of their exponents, 1/s; NaN where it is not known
    growth_nodal_diameter: int  # nodal diameter of that perturbation relative to the wave
    # `flow_j`, `damping_j`, `friction_j`: work of the flow, of structural damping and friction per cycle and blade, J
    flow_j: float
    damping_j: float
    friction_j: float


@dataclass(frozen=True)
class WaveCycles:
    """What one wave does without excitation."""

    nodal_diameter: int  # above 0 a backward wave
    # `frequency_hz`, `damping_ratio`: of small motions about the equilibrium; below 0 they grow
    frequency_hz: float
    damping_ratio: float
    free_damping_ratio: float  # with free contacts
    linear_limit_m: float  # vibration at which a node first slips, lifts off or touches; inf: none does
    vibration_m: Numbers  # (P,), vibration and damping ratio of the nonlinear mode
    mode_damping_ratio: Numbers  # (P,), vibration and damping ratio of the nonlinear mode
    cycles: tuple[CycleFacts, ...]  # the smallest first
    outcome: str  # what small and large disturbances lead to
    message: str  # why there is no result, or it ends early; empty where it is complete

    @property
    def held(self) -> CycleFacts | None:
        """The cycle that small motions grow to."""
        if self.damping_ratio < 0.0 and self.cycles and self.cycles[0].attracting:
            return self.cycles[0]
        return None

    @property
    def threshold(self) -> CycleFacts | None:
        """The cycle beyond which motions grow for ever."""
        return self.cycles[-1] if self.cycles and not self.cycles[-1].attracting else None


@dataclass(frozen=True)
class RingInTime:
    """What becomes of a small disturbance of all waves, in time."""

    # "decays": no wave grows from rest; "one wave", "several waves": settled; "not settled"; "grows for ever"; empty
    # where there is no result
    ending: str
    frequency_hz: float  # frequency whose periods are counted: that of the wave that grows fastest from rest
    periods: Numbers  # (T,), from the start
    largest_m: Numbers  # (T,), largest displacement of any blade since the instant before, static part included, m
    nodal_diameter: tuple[int, ...]  # waves, ascending; above 0 backward
    amplitude_m: tuple[Numbers, ...]  # (T,) of each wave, first harmonic of the output, m
    final_hz: Numbers  # frequency of each wave at the end; NaN where it has no part of the motion
    seconds: float
    message: str  # why there is no result

    @property
    def final_m(self) -> dict[int, float]:
        """Amplitude of each wave at the end, the largest first, m."""
        ends = {n: float(values[-1]) for n, values in zip(self.nodal_diameter, self.amplitude_m, strict=True)}
        return dict(sorted(ends.items(), key=lambda item: -item[1]))

    @property
    def share(self) -> float:
        """Part of the largest wave in the sum of the squares of the amplitudes at the end."""
        squares = [value**2 for value in self.final_m.values()]
        return squares[0] / max(sum(squares), 1e-300)


@dataclass(frozen=True)
class CurveFlutter:
    """The waves of one member of a scene."""

    curve: int  # number of the curve in the run
    label: str  # its swept parameters
    parameters: Mapping[str, Any]  # swept keys and values
    n_blades: int
    harmonics: int
    waves: tuple[WaveCycles, ...]  # by ascending nodal diameter
    seconds: float
    ring: RingInTime | None = None  # the ring in time, where asked for


@dataclass(frozen=True)
class FlutterResult:
    """Limit cycles of the waves of a scene."""

    mode: int  # number of the mode
    curves: tuple[CurveFlutter, ...]
