"""What the study `wear` found."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Numbers = NDArray[np.float64]
Counts = NDArray[np.int64]


@dataclass(frozen=True)
class PointHistory:
    """The motion of an operating point at T times."""

    label: str  # the keys that it changes
    share: float  # share of the time, sum 1
    values: Mapping[str, Any]  # keys of the scene with their values
    amplitude_m: Numbers  # (T,), amplitude of the output, m
    frequency_hz: Numbers  # (T,), frequency, Hz
    load_n: Numbers  # (T,), mean normal load of the contact over the cycle, N
    # `sticking`, `slipping`, `separating`: (T,), number of nodes in each worst state
    sticking: Counts
    slipping: Counts
    separating: Counts


@dataclass(frozen=True)
class LifeEvent:
    """Something that happens in the life, see `nonlinear.WearEvent`."""

    kind: str
    hours: float
    cycles: float
    said: str


@dataclass(frozen=True)
class WornResponse:
    """The whole response at a time: its worst motion over all operating points."""

    hours: float
    worst_m: float  # amplitude of the worst motion, m; NaN where none is known
    worst_hz: float  # its frequency, Hz
    motion: str  # "periodic", "quasi-periodic", "irregular"
    followed_m: float  # highest amplitude of the followed motions, m
    margin: float  # least fatigue margin; NaN without [fatigue]
    remark: str  # why the worst motion may be higher, or why there is none


@dataclass(frozen=True)
class LifeQuantile:
    """A quantile of the time until the first limit."""

    level: float
    hours: (
        float  # the quantile, h; where it is not `known` a lower bound, as lives that reach no limit count as ended
    )
    # ends of the interval that holds it with a probability of 95 %; None: the samples do not tell
    low: float | None
    high: float | None
    known: bool


@dataclass(frozen=True)
class SampledLives:
    """Times until the first limit of n sampled lives."""

    values: Mapping[str, Numbers]  # (n,), values of the uncertain keys; of wear.coefficient the factor on it
    hours: Numbers  # (n,), time until the first limit; the life where none is reached
    reached: Counts  # (n,), 1 where a limit is reached
    quantiles: tuple[LifeQuantile, ...]


@dataclass(frozen=True)
class WearResult:
    """Wear of the contact faces over a life, at T times, of n_c contact nodes."""

    coefficient: Mapping[str, float]  # of each interface, m^3/J
    hours: Numbers  # (T,), time, h
    cycles: Numbers  # (T,), cycles over all operating points
    points: tuple[PointHistory, ...]  # the duty
    highest_m: Numbers  # (T,), highest amplitude over the duty, m
    power_w: Numbers  # (T,), mean power of friction, W
    volume_m3: Numbers  # (T,), worn volume of both faces together, m^3
    depth_m: tuple[Numbers, ...]  # n_c of (T,), worn depth of both faces together, m
    interference_m: tuple[Numbers, ...]  # n_c of (T,), interference left, m
    interface: tuple[str, ...]  # (n_c,), interface of each node
    area_m2: Numbers  # (n_c,), area of each node, m^2
    position_m: tuple[Numbers, ...]  # n_c of (3,), position, m
    frame: tuple[Numbers, ...]  # n_c of (9,), directions t1, t2, n one after the other; none where they are not known
    events: tuple[LifeEvent, ...]  # what happened, in order
    responses: tuple[WornResponse, ...]  # whole responses at a few times
    margin_hours: float | None  # time until the least margin is that of the limit, between these responses
    tolerance: float  # of a step, relative
    error_m: float  # sum of the error estimates of the interference, m
    evaluations: int  # times that motions were solved for
    traces: int  # responses traced again on the way
    complete: bool  # whether the life was reached
    seconds: float  # what it took, s
    lives: SampledLives | None = None  # None unless asked for
    message: str = ""  # the result in a line
    remarks: tuple[str, ...] = ()  # what qualifies it

    def of_interface(self, name: str) -> list[int]:
        """The nodes of an interface."""
        return [node for node, own in enumerate(self.interface) if own == name]
