"""What the posterior of identified keys says: intervals, what the data cannot tell, the measurement to make next."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from nonlinear.peak_curves.parameter_fit import PRIOR, Fit, Ranges
from pipeline.scene.labels import quantity
from pipeline.studies.identify.result import MISFITS, IdentifiedKey, Numbers

NORMAL = 1.959964  # 95 %
TOLD = 0.5  # part of the prior's deviation that the data take away at least where they tell a key
TOGETHER = 0.9  # correlation from which on two keys are told together only
AT_END = 1e-4  # in shares
PRIOR_DEVIATION = PRIOR**-0.5


def misfit_probability(misfit: float, degrees: int) -> float:
    """Probability that scatter alone makes a misfit as large; NaN without degrees of freedom."""
    from scipy.stats import chi2

    return float(chi2.sf(misfit, degrees)) if degrees > 0 else float("nan")


def misfit_said(misfit: float, degrees: int) -> str:
    """The misfit in words."""
    return f"misfit {misfit:.4g} with {degrees} degree{'' if degrees == 1 else 's'} of freedom"


def widening(misfit: float, degrees: int) -> float:
    """Factor on all standard deviations: the misfit is too large for them."""
    return float(np.sqrt(misfit / degrees)) if misfit_probability(misfit, degrees) < MISFITS else 1.0


def identified_keys(
    keys: Sequence[str], ranges: Ranges, units: Numbers, fit: Fit, covariance: Numbers
) -> tuple[IdentifiedKey, ...]:
    """The keys with their intervals, within their ranges. `units` (n,): units of the scene for one of the solver."""
    deviations = np.sqrt(np.diag(covariance))
    ends = [np.clip(fit.place + side * NORMAL * deviations, 0.0, 1.0) for side in (-1.0, 1.0)]
    value, low, high = (ranges.values(place) * units for place in (fit.place, *ends))
    return tuple(
        IdentifiedKey(
            key=key,
            value=float(value[k]),
            low=float(low[k]),
            high=float(high[k]),
            range_low=float(ranges.low[k] * units[k]),
            range_high=float(ranges.high[k] * units[k]),
            logarithmic=bool(ranges.logarithmic[k]),
            share=float(fit.place[k]),
            deviation=float(deviations[k]),
            told=float(max(1.0 - deviations[k] / PRIOR_DEVIATION, 0.0)),
            end="low" if fit.place[k] < AT_END else "high" if fit.place[k] > 1.0 - AT_END else "",
        )
        for k, key in enumerate(keys)
    )


def rounded(key: str, value: float) -> str:
    """A value with its unit, four digits of it."""
    return quantity(key).value(float(f"{value:.4g}"))


def correlation_of(covariance: Numbers) -> tuple[tuple[float, ...], ...]:
    """Correlations of a covariance matrix."""
    scale = 1.0 / np.sqrt(np.diag(covariance))
    found = 0.5 * (covariance + covariance.T) * np.outer(scale, scale)
    np.fill_diagonal(found, 1.0)
    return tuple(tuple(float(value) for value in row) for row in found)


def untold(
    keys: Sequence[IdentifiedKey], correlation: Sequence[Sequence[float]], model_fits: bool = True
) -> tuple[str, ...]:
    """What the data cannot tell: single keys, and pairs that are known together only."""
    verdict = "fits" if model_fits else "is as likely"
    lines = [
        f"the data do not tell {item.key}: anything between {rounded(item.key, item.low)} and "
        f"{rounded(item.key, item.high)} {verdict}"
        for item in keys
        if item.told < TOLD
    ]
    for k, one in enumerate(keys):
        for j, other in enumerate(keys[:k]):
            rho = correlation[k][j]
            if abs(rho) > TOGETHER:
                way = "a larger one of both" if rho > 0.0 else "a larger one with a smaller other"
                lines.append(
                    f"{other.key} and {one.key} are told together only (correlation {rho:+.2f}): {way} {verdict}"
                    f"{' as well' * model_fits}"
                )
    return tuple(lines)


def gains(today: Numbers, rows: Numbers) -> tuple[Numbers, float]:
    """Standard deviations beside those of a covariance (n, n) once rows (m, n) of a Jacobian are added, and the
    factor by which the volume shrinks.
    """
    after = np.linalg.inv(np.linalg.inv(today) + rows.T @ rows)
    ratio = np.sqrt(np.diag(after) / np.diag(today))
    return ratio, float(np.sqrt(np.linalg.det(today) / np.linalg.det(after)))
