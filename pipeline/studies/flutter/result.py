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
class CurveFlutter:
    """The waves of one member of a scene."""

    curve: int  # number of the curve in the run
    label: str  # its swept parameters
    parameters: Mapping[str, Any]  # swept keys and values
    n_blades: int
    harmonics: int
    waves: tuple[WaveCycles, ...]  # by ascending nodal diameter
    seconds: float


@dataclass(frozen=True)
class FlutterResult:
    """Limit cycles of the waves of a scene."""

    mode: int  # number of the mode
    curves: tuple[CurveFlutter, ...]
