"""What is said of a sampled distribution: one line with the result, and what qualifies its numbers."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from nonlinear.options import NO_PEAK, TRUNCATION_TOLERATED
from pipeline.results.worst import share
from pipeline.scene.labels import prefixed, quantity
from pipeline.studies.uncertainty.quantiles import LEVELS, Estimate

if TYPE_CHECKING:
    from pipeline.studies.uncertainty.result import UncertaintyResult
    from pipeline.studies.uncertainty.section import Marginal

MISSED = 0.1  # share of the variance that a polynomial may miss for its indices to be more than rough
CLOSE = 0.01  # the same, for its quantiles to be given beside those of the samples
LARGE = 0.1  # relative half width of an interval above which more samples are advised


def percent(level: float) -> str:
    """A level as it is said: 5 %."""
    return f"{100.0 * level:g} %"


def headline(result: UncertaintyResult) -> str:
    """The result in one line."""
    amplitude, frequency = (
        dict(zip(result.levels, spread.quantiles, strict=True)) for spread in (result.amplitude, result.frequency)
    )
    factor, unit = prefixed(amplitude[0.95].value, "m")
    low, middle, high = (amplitude[level].value * factor for level in LEVELS)
    between = " to ".join(f"{frequency[level].value:.5g}" for level in (LEVELS[0], LEVELS[2]))
    at_least = ">= " if result.lower_bound.any() else ""
    line = (
        f"worst amplitude median {middle:.4g} {unit}, 5 % {low:.4g} {unit}, 95 % {at_least}{high:.4g} {unit}"
        f"{interval(amplitude[0.95], factor)}, frequency {between} Hz (5 % to 95 %), {result.samples} samples"
    )
    if result.exceedance is not None and result.limit_m is not None:
        limit, of = prefixed(result.limit_m, "m")
        share = f"{at_least}{100.0 * result.exceedance.value:.3g} %{interval(result.exceedance, 100.0)}"
        line += f"; above {result.limit_m * limit:g} {of}: {share}"
    return line


def interval(estimate: Estimate, factor: float) -> str:
    """The confidence interval in brackets, in the unit of the value times `factor`."""
    low, high = ("?" if end is None else f"{end * factor:.4g}" for end in (estimate.low, estimate.high))
    return f" ({low} to {high})"


def remarks_on(result: UncertaintyResult, without_first_order: str, sampled_indices: bool) -> tuple[str, ...]:
    """What qualifies the numbers of a result, one line each."""
    lines = [*_bounds(result), *_convergence(result), *_exchange(result)]
    if without_first_order:
        lines.append(f"no first-order answer: {without_first_order}")
    else:
        lines += _disagreement(result)
    if result.residual is not None:
        lines.append(_residual(result))
    lines += _polynomial(result)
    if sampled_indices and not result.sobol:
        lines.append("no Sobol indices: too many samples have no curve, or the amplitude does not vary")
    return tuple(lines)


def _bounds(result: UncertaintyResult) -> Iterator[str]:
    n = result.samples
    if result.missing:
        yield f"{result.missing} of {n} samples have no curve and are left out"
    counts = []
    if result.incomplete:
        counts.append(f"{result.incomplete} incomplete curves")
    if result.unresolved:
        counts.append(f"{result.unresolved} whose worst motion is not settled")
    if counts:
        said = f"{' and '.join(counts)} of {n} samples: quantiles of the amplitude are lower bounds"
        top = next(q for level, q in zip(result.levels, result.amplitude.quantiles, strict=True) if level == 0.95)
        factor, unit = prefixed(top.value, "m")
        bound = "without an upper bound" if top.at_most is None else f"at most {top.at_most * factor:.4g} {unit}"
        yield f"{said}; that at 95 % is {bound}"
    if result.at_end:
        yield f"on {result.at_end} of {n} samples {NO_PEAK}: lower bounds; widen response.frequency"
    lacking = result.truncation_error[result.truncation_error > TRUNCATION_TOLERATED]
    if lacking.size:
        yield (
            f"too few harmonics on {lacking.size} of {n} samples: truncation error up to "
            f"{share(float(lacking.max()))}; raise response.harmonics"
        )


def _convergence(result: UncertaintyResult) -> Iterator[str]:
    """How far the highest quantile still moves, and how well it is known."""
    *_, last = result.convergence
    before = [row for row in result.convergence if row.samples * 2 == last.samples]
    top = last.amplitude[-1]
    if before:
        change = top.value / before[0].amplitude[-1].value - 1.0
        yield (
            f"from {before[0].samples} to {last.samples} samples the 95 % quantile of the amplitude changes by "
            f"{100.0 * change:+.2g} %"
        )
    if _is_close(result):
        return
    if top.low is None or top.high is None:
        yield f"{last.samples} samples do not bound the 95 % quantile of the amplitude: take more"
    elif (top.high - top.low) / 2.0 > LARGE * top.value:
        half = 50.0 * (top.high - top.low) / top.value
        yield f"the 95 % quantile of the amplitude is known to {half:.2g} % only: take more samples"


def _is_close(result: UncertaintyResult) -> bool:
    """Whether the polynomial through the samples tells the quantiles of the amplitude better than these."""
    return result.polynomial is not None and result.polynomial.leave_one_out <= CLOSE


def _polynomial(result: UncertaintyResult) -> Iterator[str]:
    """How far the polynomial through the samples can be trusted, and what it says."""
    polynomial = result.polynomial
    if polynomial is None:
        return
    missed = f"misses {100.0 * polynomial.leave_one_out:.2g} % of the variance of the amplitude (leave-one-out)"
    if polynomial.leave_one_out <= CLOSE:
        factor, unit = prefixed(polynomial.at(LEVELS[-1]), "m")
        low, middle, high = (f"{polynomial.at(level) * factor:.4g} {unit}" for level in LEVELS)
        yield f"a polynomial through the samples, which {missed}, has the median {middle}, 5 % {low}, 95 % {high}"
    elif polynomial.leave_one_out > MISSED:
        yield f"a polynomial through the samples {missed}: its sensitivities tell the order of magnitude at most"


def _exchange(result: UncertaintyResult) -> Iterator[str]:
    """Samples whose worst motion is of another kind than that at the centre."""
    n, branch = result.samples, result.branch
    detached, moving = int((branch > 0).sum()), int((~result.periodic & (branch >= 0)).sum())
    if detached:
        yield f"{detached} of {n} worst motions lie on a detached branch"
    if moving:
        yield f"{moving} of {n} worst motions are quasi-periodic"


def _disagreement(result: UncertaintyResult) -> Iterator[str]:
    """Quantiles of the linear model outside the confidence intervals of the sampled ones."""
    linear = result.first_order
    assert linear is not None
    pairs = (("amplitude", result.amplitude, linear.amplitude), ("frequency", result.frequency, linear.frequency))
    for name, sampled, first in pairs:
        outside = []
        for level, found, value in zip(result.levels, sampled.quantiles, first.quantiles, strict=True):
            below, above = found.low is not None and value < found.low, found.high is not None and value > found.high
            if below or above:
                outside.append(f"{percent(level)} {100.0 * (value / found.value - 1.0):+.2g} %")
        if outside:
            yield (
                f"first order and samples disagree on the quantiles of the {name} ({', '.join(outside)}): it is not "
                "linear in the parameters over their distributions"
            )


def _residual(result: UncertaintyResult) -> str:
    assert result.residual is not None
    factor, unit = prefixed(result.residual.highest_m, "m")
    low, high = result.residual.lowest_m * factor, result.residual.highest_m * factor
    return (
        f"residual tractions alone leave {low:.4g} to {high:.4g} {unit} open at the centre of the distributions "
        "(mean deflection included): a band of its own, no part of the scatter"
    )


def distribution_said(marginal: Marginal) -> str:
    """A parameter with its distribution."""
    named = quantity(marginal.key)
    if marginal.kind == "uniform":
        return f"{named.symbol} {named.value(marginal.low)} to {named.value(marginal.high)} (uniform)"
    centre = named.value(marginal.centre)
    if marginal.kind == "lognormal":
        return f"{named.symbol} median {centre}, factor {marginal.spread:g} (lognormal)"
    return f"{named.symbol} {centre}, deviation {named.value(marginal.spread)} (normal)"
