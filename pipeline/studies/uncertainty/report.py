"""Section of the page about the study `uncertainty`."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from pipeline.results.worst import sentence
from pipeline.scene.labels import prefixed, quantity
from pipeline.studies.registry import StudySection
from pipeline.studies.uncertainty.quantiles import Estimate
from pipeline.studies.uncertainty.remarks import distribution_said, interval, percent
from pipeline.studies.uncertainty.result import Spread, UncertaintyResult
from pipeline.studies.uncertainty.sensitivities import LinearSpread, PolynomialChaos, SobolIndex

HEADINGS = ("", "samples (95 % confidence)", "polynomial", "first order")
CAPTION = (
    "Distribution functions of the worst amplitude and of its frequency with quantiles and their confidence "
    "intervals; shares of the variance of the amplitude by parameter; quantiles over the number of samples; the "
    "amplitude over the parameter that it depends on most."
)


def uncertainty_section(result: UncertaintyResult) -> StudySection:
    """The section of a result."""
    said = ", ".join(distribution_said(marginal) for marginal in result.marginals)
    joint = "They are correlated." if result.correlation else "All are independent."
    conclusion = (sentence(result.message), f"Uncertain: {said}. {joint}")
    remarks = tuple(sentence(remark) for remark in result.remarks)
    rows = (*_quantile_rows(result), *_moment_rows(result), *_sensitivity_rows(result))
    return StudySection("Uncertainty", (*conclusion, *remarks), CAPTION, HEADINGS, rows)


@dataclass(frozen=True)
class _Quantity:
    """One of the two sampled quantities, with the factor from SI to its unit."""

    name: str
    unit: str
    factor: float
    spread: Spread
    polynomial: PolynomialChaos | None
    linear: LinearSpread | None


def _quantities(result: UncertaintyResult) -> tuple[_Quantity, _Quantity]:
    factor, unit = prefixed(max(q.value for q in result.amplitude.quantiles), "m")
    linear = result.first_order
    return (
        _Quantity(
            "worst amplitude",
            unit,
            factor,
            result.amplitude,
            result.polynomial,
            None if linear is None else linear.amplitude,
        ),
        _Quantity(
            "its frequency",
            "Hz",
            1.0,
            result.frequency,
            result.frequency_polynomial,
            None if linear is None else linear.frequency,
        ),
    )


def _quantile_rows(result: UncertaintyResult) -> Iterator[tuple[str, ...]]:
    for each in _quantities(result):
        for place, (level, found) in enumerate(zip(result.levels, each.spread.quantiles, strict=True)):
            fitted = "" if each.polynomial is None else f"{each.polynomial.at(level) * each.factor:.5g}"
            linear = "" if each.linear is None else f"{each.linear.quantiles[place] * each.factor:.5g}"
            yield f"{each.name}, {percent(level)} [{each.unit}]", _estimate(found, each.factor), fitted, linear
    if result.exceedance is not None and result.limit_m is not None:
        limit, of = prefixed(result.limit_m, "m")
        yield f"above {result.limit_m * limit:g} {of} [%]", _estimate(result.exceedance, 100.0), "", ""


def _moment_rows(result: UncertaintyResult) -> Iterator[tuple[str, ...]]:
    for each in _quantities(result):
        linear = "" if each.linear is None else _moments(each.linear.mean, each.linear.deviation, each.factor)
        sampled = _moments(each.spread.mean, each.spread.deviation, each.factor)
        yield f"{each.name}, mean, deviation [{each.unit}]", sampled, "", linear
    for each in _quantities(result):
        if each.polynomial is not None:
            missed = f"{100.0 * each.polynomial.leave_one_out:.2g}"
            yield f"{each.name}, variance that the polynomial misses [%] (leave-one-out)", "", missed, ""


def _sensitivity_rows(result: UncertaintyResult) -> Iterator[tuple[str, ...]]:
    """Shares in the variance of the amplitude, in percent: alone, and with all others."""
    terms = () if result.first_order is None else result.first_order.terms
    parts = {term.key: term.amplitude_deviation**2 for term in terms}
    sampled = {index.key: index for index in result.sobol}
    fitted = {} if result.polynomial is None else {index.key: index for index in result.polynomial.indices}
    for key in (marginal.key for marginal in result.marginals):
        linear = f"{100.0 * parts[key] / sum(parts.values()):.3g}" if sum(parts.values()) > 0.0 else ""
        name = f"variance of the amplitude by {quantity(key).symbol}, alone and with all others [%]"
        yield name, _shares(sampled.get(key)), _shares(fitted.get(key)), linear


def _shares(index: SobolIndex | None) -> str:
    return "" if index is None else f"{100.0 * index.first:.3g}, {100.0 * index.total:.3g}"


def _estimate(found: Estimate, factor: float) -> str:
    return f"{found.value * factor:.5g}{interval(found, factor)}"


def _moments(mean: float, deviation: float, factor: float) -> str:
    return f"{mean * factor:.5g}, {deviation * factor:.3g}"
