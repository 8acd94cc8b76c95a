"""Distribution of one uncertain parameter: normal, lognormal or uniform, within bounds."""

from __future__ import annotations

import math
from dataclasses import dataclass
from statistics import NormalDist
from typing import TYPE_CHECKING, Literal

from pipeline.scene.uncertainty_section import UncertainParameter

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

# What the key itself allows, see `pipeline.scene.schema`.
BOUNDS = {
    "contact.interference": (-1e3, 1e3),
    "excitation.force": (1e-12, 1e15),
    "response.damping_ratio": (1e-12, 1.0 - 1e-12),
}
NOT_NEGATIVE = 0.0, 1e15  # of all others
Kind = Literal["normal", "lognormal", "uniform"]


@dataclass(frozen=True)
class Marginal:
    """Distribution of one parameter."""

    key: str  # dotted key of the parameter
    kind: Kind  # kind of the distribution
    # mean of the normal, median of the lognormal distribution before truncation, middle of the uniform one; unit of
    # the key
    centre: float
    # standard deviation of the normal distribution, factor of the lognormal one (its logarithm has the standard
    # deviation log(factor)), half width of the uniform one
    spread: float
    low: float  # bounds of the values: of the distribution or of the key
    high: float  # bounds of the values: of the distribution or of the key

    @property
    def mass(self) -> float:
        """Probability of the values within the bounds before truncation; 1 for a uniform distribution."""
        if self.kind == "uniform":
            return 1.0
        below, above = (NormalDist().cdf(z) for z in self._scores)
        return above - below

    def quantile(self, probability: NDArray[np.float64]) -> NDArray[np.float64]:
        """The values below which the distribution has some probabilities (n,) between 0 and 1."""
        import numpy as np
        from scipy.stats import truncnorm

        if self.kind == "uniform":
            values = self.low + (self.high - self.low) * probability
        else:
            scores = truncnorm.ppf(probability, *self._scores)
            if self.kind == "normal":
                values = self.centre + self.spread * scores
            else:
                values = self.centre * np.exp(math.log(self.spread) * scores)
        return np.clip(values, self.low, self.high)

    @property
    def moments(self) -> tuple[float, float]:
        """Mean and standard deviation of the truncated distribution."""
        if self.kind == "uniform":
            return self.centre, self.spread / math.sqrt(3.0)
        if self.kind == "lognormal":
            first, second = self._lognormal_moment(1), self._lognormal_moment(2)
            return first, math.sqrt(max(second - first * first, 0.0))
        from scipy.stats import truncnorm

        mean, variance = truncnorm.stats(*self._scores, moments="mv")
        return self.centre + self.spread * float(mean), self.spread * math.sqrt(float(variance))

    @property
    def _scores(self) -> tuple[float, float]:
        """The bounds in standard deviations from the centre, of the logarithm of a lognormal parameter."""
        if self.kind == "normal":
            return (self.low - self.centre) / self.spread, (self.high - self.centre) / self.spread
        sigma = math.log(self.spread)
        low = math.log(self.low / self.centre) / sigma if self.low > 0.0 else -math.inf
        return low, math.log(self.high / self.centre) / sigma if self.high > 0.0 else -math.inf

    def _lognormal_moment(self, k: int) -> float:
        """E[x^k] of a truncated lognormal distribution."""
        sigma, cdf = math.log(self.spread), NormalDist().cdf
        low, high = self._scores
        inside = cdf(high - k * sigma) - cdf(low - k * sigma)
        return self.centre**k * math.exp(0.5 * (k * sigma) ** 2) * inside / self.mass


def bounds_of(key: str) -> tuple[float, float]:
    """Lowest and highest value that a key allows."""
    return BOUNDS.get(key, NOT_NEGATIVE)


def marginal_of(item: UncertainParameter, nominal: float) -> Marginal:
    """The distribution of a parameter."""
    least, most = bounds_of(item.key)
    low, high = (least if item.low is None else item.low), (most if item.high is None else item.high)
    if item.distribution == "uniform":
        return Marginal(item.key, "uniform", 0.5 * (low + high), 0.5 * (high - low), low, high)
    if item.distribution == "lognormal":
        assert item.factor is not None  # the schema sees to it
        centre = nominal if item.median is None else item.median
        return Marginal(item.key, "lognormal", centre, item.factor, low, high)
    centre = nominal if item.mean is None else item.mean
    deviation = abs(centre) * (item.relative_deviation or 0.0) if item.deviation is None else item.deviation
    return Marginal(item.key, "normal", centre, deviation, low, high)
