"""Section [uncertainty] of a scene: distributions of parameters, whose effect on the worst motion is sampled."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, ValidationInfo, field_validator

from pipeline.scene.fields import POSITIVE, Number, Positive, Section, Truth, Whole
from pipeline.scene.fields import key as _key

UncertainKey = Literal[
    "contact.normal_stiffness",
    "contact.tangential_stiffness",
    "contact.friction",
    "contact.interference",
    "contact.preload",
    "excitation.force",
    "response.damping_ratio",
]
KEYS = (
    '"contact.normal_stiffness", "contact.tangential_stiffness", "contact.friction", "contact.interference", '
    '"contact.preload", "excitation.force" or "response.damping_ratio", each once'
)
SAMPLES = "a power of two, 16 to 4096"
VALUE = "a number, -1e15 to 1e15"
Value = Annotated[Number, Field(ge=-1e15, le=1e15)]
_OF = {  # keys that go with one distribution alone
    "mean": "normal",
    "deviation": "normal",
    "relative_deviation": "normal",
    "median": "lognormal",
    "factor": "lognormal",
}


class UncertainParameter(Section):
    """[[uncertainty.parameter]]: the distribution of one parameter; all parameters are independent."""

    key: UncertainKey = _key("the parameter", KEYS)
    distribution: Literal["normal", "lognormal", "uniform"] = _key(
        "kind of the distribution", '"normal", "lognormal" or "uniform"'
    )
    mean: Value | None = _key("mean of a normal distribution, unit of the key; none: value of the scene", VALUE, None)
    deviation: Positive | None = _key("standard deviation of a normal distribution, unit of the key", POSITIVE, None)
    relative_deviation: Positive | None = _key(
        "the same relative to the mean", f"{POSITIVE} (give this or deviation)", None, validate_default=True
    )
    median: Positive | None = _key(
        "median of a lognormal distribution, unit of the key; none: value of the scene", POSITIVE, None
    )
    factor: Annotated[Number, Field(ge=1.0001, le=1e3)] | None = _key(
        "of a lognormal distribution: 68 % of the values lie between median / factor and median * factor",
        "a number above 1, 1.0001 to 1000",
        None,
        validate_default=True,
    )
    low: Value | None = _key(
        "lowest value, unit of the key; normal and lognormal distributions are truncated there",
        VALUE,
        None,
        validate_default=True,
    )
    high: Value | None = _key(
        "highest value, unit of the key; normal and lognormal distributions are truncated there",
        f"{VALUE}, above low",
        None,
        validate_default=True,
    )

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


class Uncertainty(Section):
    """[uncertainty]: distribution of the worst motion. Nothing is sampled unless this section is there."""

    samples: Literal[16, 32, 64, 128, 256, 512, 1024, 2048, 4096] = _key("curves that are sampled", SAMPLES, 128)
    seed: Whole = _key(
        "seed of the quasi-random numbers: the same seed gives the same samples",
        "a whole number, 0 to 9223372036854775807",
        0,
        ge=0,
        le=2**63 - 1,
    )
    sensitivities: Truth = _key(
        "whether the Sobol indices are sampled as well, which costs `samples` curves for each parameter and as many "
        "once more; those of a polynomial through the samples cost none",
        "true or false",
        False,
    )
    limit: Positive | None = _key(
        "amplitude, m: the probability that the worst motion exceeds it is given", POSITIVE, None
    )
    parameter: tuple[UncertainParameter, ...] = _key(
        "uncertain parameters", "tables [[uncertainty.parameter]], one or more, each key once", ()
    )

    @field_validator("parameter")
    @classmethod
    def _each_once(cls, value: Any) -> Any:
        keys = [item.key for item in value]
        if len(set(keys)) < len(keys):
            raise ValueError("tables [[uncertainty.parameter]], one or more, each key once")
        return value
