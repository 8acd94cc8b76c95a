"""What the study `identify` gives."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Numbers = NDArray[np.float64]
MISFITS = 0.01  # probability of a misfit as large, below which the model does not fit the data


@dataclass(frozen=True)
class IdentifiedKey:
    """One key and what the data tell of it."""

    key: str
    value: float  # where the misfit is least
    low: float  # `low`, `high`: interval that holds the true value with a probability of 95 %
    high: float
    range_low: float  # `range_low`, `range_high`: where it was sought
    range_high: float
    logarithmic: bool  # whether the range counts by its logarithm
    share: float  # of the value in the range
    deviation: float  # standard deviation of the share; 0.289 where the data tell nothing
    told: float  # part of the prior's standard deviation that the data take away: 0, nothing, to 1
    end: str  # end of the range at which the value lies: "low" or "high"; "": inside


@dataclass(frozen=True)
class Compared:
    """A measured motion beside the one of the model."""

    label: str  # conditions
    output: str
    unit: str
    curve: str  # name of the measured curve; "": a peak
    frequency_hz: float
    amplitude: float  # of the vibration
    frequency_deviation_hz: float  # `frequency_deviation_hz`, `amplitude_deviation` (relative): as compared with
    amplitude_deviation: float
    computed_hz: float
    computed_amplitude: float
    rate_hz_per_s: float  # of the sweep; 0: steady
    sweep_factor: float  # part of the steady peak that the sweep reaches


@dataclass(frozen=True)
class OtherValues:
    """Other values with which the model vibrates as was measured too."""

    values: Mapping[str, float]
    misfit: float


@dataclass(frozen=True)
class NextMeasurement:
    """A peak that could be measured, and what it would tell."""

    label: str
    deviations: Mapping[str, float]  # standard deviation of each key beside that of today
    gain: float  # factor by which the posterior's volume would shrink


@dataclass(frozen=True)
class ComputedCurve:
    """A computed response, for the figure."""

    label: str
    output: str
    frequency_hz: Numbers
    amplitude: Numbers


@dataclass(frozen=True)
class Identification:
    """Keys of a scene from measured motions: their values, how sure they are, and the motions behind them.

    Attributes
    ----------
    keys : tuple of IdentifiedKey
        Of each `key` its `value`, the interval `low` to `high` that holds the true one with a probability of 95 %,
        `told`: the part of what was not known that the data have told, 0 to 1, and `end`: the end of the range
        ("low", "high") at which the value lies.
    correlation : tuple of tuples of float
        Correlations of the keys as they are known now.
    misfit : float
        Sum of the squares of all differences in standard deviations.
    degrees : int
        Measured numbers less keys: about the misfit of a model that is right.
    probability : float
        Of a misfit as large where the model is right; NaN without degrees of freedom.
    factor : float
        By which all intervals were widened, as the misfit is too large for the scatter that was given.
    compared : tuple of Compared
        Measured motions beside those of the model.
    others : tuple of OtherValues
        Other values with which the model vibrates as was measured too.
    untold : tuple of str
        What the data cannot tell, in words.
    following : tuple of NextMeasurement
        Measurements that could come next, the one that tells most first.
    remarks : tuple of str
        What qualifies the numbers.
    curves : tuple of ComputedCurve
        Responses with the best values.
    responses : int
        Responses that were solved.

    Examples
    --------
    With the names of the example of `identify_scene`:

    >>> key = found.keys[0]
    >>> key.key, key.low < 0.5 < key.high, key.end, found.degrees
    ('contact.friction', True, '', 5)
    """

    keys: tuple[IdentifiedKey, ...]
    correlation: tuple[tuple[float, ...], ...]
    misfit: float
    degrees: int
    probability: float
    factor: float
    compared: tuple[Compared, ...]
    others: tuple[OtherValues, ...]
    untold: tuple[str, ...]
    following: tuple[NextMeasurement, ...]
    remarks: tuple[str, ...]
    curves: tuple[ComputedCurve, ...]
    responses: int

    @property
    def fits(self) -> bool:
        """Whether the misfit is no larger than the scatter of the data explains."""
        return not self.probability < MISFITS

    @property
    def values(self) -> dict[str, float]:
        """The values by their keys."""
        return {item.key: item.value for item in self.keys}
