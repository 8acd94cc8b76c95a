"""What the study `run_up` gives."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

Numbers = NDArray[np.float64]


@dataclass(frozen=True)
class SweepFacts:
    """One sweep of a curve."""

    rate_hz_per_s: float  # above 0 upwards
    peak_m: float  # largest displacement (strain) of any blade, m; NaN where the sweep has no result
    peak_hz: float  # excitation frequency there, Hz
    frequency_hz: Numbers  # (P,), of groups of periods, in the order of time
    envelope_m: Numbers  # (P,), largest displacement of any blade in the group, m
    # (K,), some frequencies, and shares of contacts and time of a period there that are open, and that slip
    place_hz: Numbers
    open_share: Numbers
    slip_share: Numbers
    seconds: float
    message: str = ""  # why there is no result
    passages: int = 0  # at probes
    # (R,), excitation frequency of each revolution, Hz, and amplitude that the probes tell there, m; empty where they
    # do not tell one
    read_hz: Numbers = field(default_factory=lambda: np.empty(0))
    read_m: Numbers = field(default_factory=lambda: np.empty(0))

    @property
    def direction(self) -> str:
        """The way, in words."""
        return "up" if self.rate_hz_per_s > 0.0 else "down"


@dataclass(frozen=True)
class CurveRunUps:
    """The sweeps of one curve."""

    curve: int  # number of the curve in the run
    label: str  # its swept parameters
    parameters: Mapping[str, Any]  # swept keys and values
    n_blades: int  # of the ring that was integrated
    half_bandwidth_hz: float  # of the mode that decays slowest without contact
    # highest steady solution of the main branch within the ends of the sweeps, m and Hz
    steady_m: float
    steady_hz: float
    # (Q,), the main branch, Hz and m
    branch_hz: Numbers
    branch_m: Numbers
    sweeps: tuple[SweepFacts, ...]
    output: str = ""  # name of the output; "": the default one
    unit: str = "m"  # of its values; "m/m" of a strain

    def share(self, sweep: SweepFacts) -> float:
        """Peak of a sweep over the highest steady solution."""
        return sweep.peak_m / self.steady_m

    def lag_bands(self, sweep: SweepFacts) -> float:
        """Half bandwidths by which the peak comes later than the steady one."""
        way = 1.0 if sweep.rate_hz_per_s > 0.0 else -1.0
        return way * (sweep.peak_hz - self.steady_hz) / self.half_bandwidth_hz


@dataclass(frozen=True)
class RunUpResult:
    """The sweeps of the curves of a scene."""

    curves: tuple[CurveRunUps, ...]
