"""Section [uncertainty] of a scene: distributions of parameters, whose effect on the worst motion is sampled.

The distribution of one parameter is normal, lognormal or uniform, within bounds.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from statistics import NormalDist
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field, ValidationInfo, field_validator

from pipeline.scene.blade_section import Damper
from pipeline.scene.contact_section import PER_NODE, Contact
from pipeline.scene.dotted_keys import CONTACT, INTERFACE, of_contact
from pipeline.scene.fields import (
    MOTION,
    POSITIVE,
    Length,
    Number,
    Positive,
    Section,
    StudyKeys,
    Truth,
    Whole,
    bounds_in,
    meaning_in,
)
from pipeline.scene.fields import key as _key
from pipeline.scene.loads_section import Excitation, Load
from pipeline.scene.material_section import Material
from pipeline.scene.response_section import Response

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


_TABLES: dict[str, type[Section]] = {
    CONTACT: Contact,
    "excitation": Excitation,
    "response": Response,
    "damper": Damper,
    "material": Material,
    "load": Load,
}
BOUNDS = {  # what the uncertain keys themselves allow
    f"{table}.{name}": bounds_in(kind, name)
    for table, kind in _TABLES.items()
    for name in kind.model_fields
    if meaning_in(kind, name).uncertain or meaning_in(kind, name).solver
}
if TYPE_CHECKING:
    UncertainKey = str
else:
    UncertainKey = Literal[tuple(BOUNDS)]
*_FIRST, _LAST = (f'"{key}"' for key in BOUNDS)
KEYS = f'{", ".join(_FIRST)} or {_LAST}, or one of an interface, such as "interface.NAME.friction", each once'
OF_INTERFACE = rf"^{INTERFACE}\..+\.({'|'.join(PER_NODE)})$"
SAMPLES = "a power of two, 16 to 4096"
VALUE = "a number, -1e15 to 1e15"
CORRELATIONS = (
    "a row for each parameter with a number for each, -1 to 1: symmetric, 1 on the diagonal, positive definite; "
    "nothing with correlation_length"
)
Correlation = Annotated[Number, Field(ge=-1.0, le=1.0)]
Value = Annotated[Number, Field(ge=-1e15, le=1e15)]
_OF = {  # keys that go with one distribution alone
    "mean": "normal",
    "deviation": "normal",
    "relative_deviation": "normal",
    "median": "lognormal",
    "factor": "lognormal",
}


class UncertainParameter(Section):
    """[[uncertainty.parameter]]: the distribution of one parameter."""

    key: UncertainKey | Annotated[str, Field(pattern=OF_INTERFACE)] = _key("the parameter", allowed=KEYS)
    distribution: Literal["normal", "lognormal", "uniform"] = _key("kind of the distribution")
    mean: Value | None = _key("mean of a normal distribution, unit of the key; none: value of the scene", None)
    deviation: Positive | None = _key("standard deviation of a normal distribution, unit of the key", None)
    relative_deviation: Positive | None = _key(
        "the same relative to the mean", None, allowed=f"{POSITIVE} (give this or deviation)", validate_default=True
    )
    median: Positive | None = _key(
        "median of a lognormal distribution, unit of the key; none: value of the scene", None
    )
    factor: Annotated[Number, Field(ge=1.0001, le=1e3)] | None = _key(
        "of a lognormal distribution: 68 % of the values between median / factor and median * factor",
        None,
        allowed="a number above 1, 1.0001 to 1000",
        validate_default=True,
    )
    low: Value | None = _key(
        "lowest value, unit of the key; normal and lognormal distributions are truncated there, and where the key "
        "ends",
        None,
        validate_default=True,
    )
    high: Value | None = _key(
        "highest value, unit of the key; normal and lognormal distributions are truncated there",
        None,
        allowed=f"{VALUE}, above low",
        validate_default=True,
    )

    correlation_length: Length | None = _key(
        "of a contact parameter: it varies from node to node, with the correlation exp(-(d / correlation_length)^2) "
        "of nodes at the distance d, m; none: one value for all nodes",
        None,
        allowed=f"{POSITIVE}, with a key of contact or of an interface",
        validate_default=True,
    )

    @field_validator("correlation_length")
    @classmethod
    def _of_contact(cls, value: Any, info: ValidationInfo) -> Any:
        key = str(info.data.get("key", f"{CONTACT}."))
        if value is not None and not of_contact(key).startswith(f"{CONTACT}."):
            raise ValueError("nothing with this key: it has one value, not one at each contact node")
        return value

    @field_validator(*_OF)
    @classmethod
    def _of_its_distribution(cls, value: Any, info: ValidationInfo) -> Any:
        chosen, own = info.data.get("distribution"), _OF[str(info.field_name)]
        if value is not None and chosen not in (None, own):
            raise ValueError(f'nothing with distribution = "{chosen}"')
        return value

    @field_validator("relative_deviation")
    @classmethod
    def _one_deviation(cls, value: Any, info: ValidationInfo) -> Any:
        given = (value is not None) + (info.data.get("deviation") is not None)
        if info.data.get("distribution") == "normal" and given != 1 and "deviation" in info.data:
            raise ValueError("deviation or relative_deviation, one of the two")
        return value

    @field_validator("factor")
    @classmethod
    def _some_factor(cls, value: Any, info: ValidationInfo) -> Any:
        if info.data.get("distribution") == "lognormal" and value is None:
            raise ValueError("a number above 1, 1.0001 to 1000")
        return value

    @field_validator("low", "high")
    @classmethod
    def _ends(cls, value: Any, info: ValidationInfo) -> Any:
        low = info.data.get("low")
        if value is None and info.data.get("distribution") == "uniform":
            raise ValueError(f"{VALUE} (a uniform distribution needs low and high)")
        if info.field_name == "high" and value is not None and low is not None and not low < value:
            raise ValueError(f"{VALUE}, above low")
        return value


class Uncertainty(StudyKeys):
    """[uncertainty]: distribution of the worst motion. Nothing is sampled unless this section is there."""

    samples: Literal[16, 32, 64, 128, 256, 512, 1024, 2048, 4096] = _key(
        "curves that are sampled; more add to those there are, only the new ones are solved", 128, allowed=SAMPLES
    )
    seed: Whole = _key(
        "seed of the quasi-random numbers: the same seed gives the same samples", 0, ge=0, le=2**63 - 1
    )
    sensitivities: Truth = _key(
        "whether Sobol indices are sampled too: `samples` curves for each parameter and as many once more; those of "
        "a polynomial cost none",
        False,
    )
    limit: Annotated[Positive | None, MOTION] = _key(
        "amplitude, m: the probability that the worst motion exceeds it is given", None
    )
    parameter: tuple[UncertainParameter, ...] = _key(
        "uncertain parameters", (), allowed="tables [[uncertainty.parameter]], one or more, each key once"
    )

    correlation: tuple[tuple[Correlation, ...], ...] = _key(
        "correlations of the parameters in their order (of their normal scores); none: independent",
        (),
        allowed=CORRELATIONS,
        validate_default=True,
    )

    @field_validator("correlation")
    @classmethod
    def _a_correlation(cls, value: Any, info: ValidationInfo) -> Any:
        parameters = info.data.get("parameter")
        if value and parameters is not None:
            import numpy as np

            n = len(parameters)
            if len(value) != n or any(len(row) != n for row in value):
                raise ValueError(CORRELATIONS)
            matrix = np.array(value)
            if np.abs(matrix - matrix.T).max() > 1e-9 or np.linalg.eigvalsh(matrix).min() <= 0.0:
                raise ValueError(CORRELATIONS)
            if np.abs(np.diag(matrix) - 1.0).max() > 1e-9 or any(item.correlation_length for item in parameters):
                raise ValueError(CORRELATIONS)
        return value

    @field_validator("parameter")
    @classmethod
    def _each_once(cls, value: Any) -> Any:
        keys = [item.key for item in value]
        if len(set(keys)) < len(keys):
            raise ValueError("tables [[uncertainty.parameter]], one or more, each key once")
        return value


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
    # `low`, `high`: bounds of the values: of the distribution or of the key
    low: float
    high: float

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
    return BOUNDS[of_contact(key)]


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
