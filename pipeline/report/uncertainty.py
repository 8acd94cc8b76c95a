"""Section of the page about the study `uncertainty`."""

from __future__ import annotations

from collections.abc import Iterator

from pipeline.report.studies import StudySection
from pipeline.scene.labels import prefixed, quantity
from pipeline.scene.marginal import Marginal
from pipeline.studies.uncertainty.quantiles import Estimate
from pipeline.studies.uncertainty.remarks import interval, percent
from pipeline.studies.uncertainty.uncertainty_result import UncertaintyResult

HEADINGS = ("", "samples (95 % confidence)", "first order")
CAPTION = (
    "Distribution functions of the worst amplitude and of its frequency with quantiles and their confidence intervals; "
    "shares of the variance of the amplitude by parameter; quantiles over the number of samples; the amplitude over the "
    "parameter that it depends on most."
)


def uncertainty_section(result: UncertaintyResult) -> StudySection:
    """The section of a result.

    Parameters
    ----------
    result : UncertaintyResult
        The result of the study.
    """
    said = ", ".join(_distribution(marginal) for marginal in result.marginals)
    conclusion = (f"{_capital(result.message)}.", f"Uncertain: {said}. All are independent.")
    remarks = tuple(f"{_capital(remark)}." for remark in result.remarks)
    rows = (*_quantile_rows(result), *_moment_rows(result), *_sensitivity_rows(result))
    return StudySection("Uncertainty", (*conclusion, *remarks), CAPTION, HEADINGS, rows)


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]


def _distribution(marginal: Marginal) -> str:
    """A parameter with its distribution."""
    named = quantity(marginal.key)
    if marginal.kind == "uniform":
        return f"{named.symbol} {named.value(marginal.low)} to {named.value(marginal.high)} (uniform)"
    centre = named.value(marginal.centre)
    if marginal.kind == "lognormal":
        return f"{named.symbol} median {centre}, factor {marginal.spread:g} (lognormal)"
    return f"{named.symbol} {centre}, deviation {named.value(marginal.spread)} (normal)"


def _quantile_rows(result: UncertaintyResult) -> Iterator[tuple[str, ...]]:
    factor, unit = prefixed(max(q.value for q in result.amplitude.quantiles), "m")
    linear = result.first_order
    for name, spread, number, of, first in (
        ("worst amplitude", result.amplitude, factor, unit, None if linear is None else linear.amplitude),
        ("its frequency", result.frequency, 1.0, "Hz", None if linear is None else linear.frequency),
    ):
        for place, (level, found) in enumerate(zip(result.levels, spread.quantiles, strict=True)):
            beside = "" if first is None else f"{first.quantiles[place] * number:.5g}"
            yield f"{name}, {percent(level)} [{of}]", _estimate(found, number), beside
    if result.exceedance is not None and result.limit_m is not None:
        limit, of = prefixed(result.limit_m, "m")
        yield f"above {result.limit_m * limit:g} {of} [%]", _estimate(result.exceedance, 100.0), ""


def _moment_rows(result: UncertaintyResult) -> Iterator[tuple[str, ...]]:
    linear = result.first_order
    factor, unit = prefixed(result.amplitude.mean, "m")
    for name, spread, number, of, first in (
        ("worst amplitude", result.amplitude, factor, unit, None if linear is None else linear.amplitude),
        ("its frequency", result.frequency, 1.0, "Hz", None if linear is None else linear.frequency),
    ):
        beside = "" if first is None else _moments(first.mean * number, first.deviation * number)
        yield f"{name}, mean, deviation [{of}]", _moments(spread.mean * number, spread.deviation * number), beside


def _sensitivity_rows(result: UncertaintyResult) -> Iterator[tuple[str, ...]]:
    polynomial = result.polynomial
    indices = result.sobol or (() if polynomial is None else polynomial.indices)
    terms = {} if result.first_order is None else {t.key: t.amplitude_deviation for t in result.first_order.terms}
    variance = sum(part**2 for part in terms.values())
    source = "sampled" if result.sobol else "polynomial"
    for index in indices:
        beside = f"{100.0 * terms[index.key] ** 2 / variance:.3g}" if index.key in terms and variance else ""
        shares = f"{100.0 * index.first:.3g}, {100.0 * index.total:.3g}"
        yield f"variance by {quantity(index.key).symbol}: alone, with all others [%] ({source})", shares, beside


def _estimate(found: Estimate, factor: float) -> str:
    return f"{found.value * factor:.5g}{interval(found, factor)}"


def _moments(mean: float, deviation: float) -> str:
    return f"{mean:.5g}, {deviation:.3g}"
