"""Sampled lives: times until a limit for uncertain wear coefficients and the distributions of [uncertainty]."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from pipeline.scene.sweep import as_in_scene, key_value
from pipeline.studies.study import StudyContext
from pipeline.studies.uncertainty.quantiles import LEVELS, quantile, sampled_values
from pipeline.studies.uncertainty.section import Marginal, marginal_of
from pipeline.studies.wear.life import HOUR, Life
from pipeline.studies.wear.result import LifeQuantile, Numbers, SampledLives

if TYPE_CHECKING:
    from pipeline.scene.schema import Scene
    from pipeline.studies.wear.section import Wear

COEFFICIENT = "wear.coefficient"
FARTHEST = 1e3  # factor on the wear coefficient beyond which a lognormal distribution is truncated


def marginals_of(scene: Scene, section: Wear) -> list[Marginal]:
    """The distributions: a factor on the wear coefficient, and the parameters of [uncertainty]."""
    found = []
    if section.coefficient_factor is not None:
        spread = section.coefficient_factor
        found.append(Marginal(COEFFICIENT, "lognormal", 1.0, spread, 1.0 / FARTHEST, FARTHEST))
    laws = () if scene.uncertainty is None else scene.uncertainty.parameter
    return [*found, *(marginal_of(item, key_value(scene, item.key) or 0.0) for item in laws)]


def sampled_lives(context: StudyContext, section: Wear) -> SampledLives | None:
    """The times until the first limit of some lives; None where none are asked for."""
    if section.samples is None:
        return None
    marginals = marginals_of(context.scene, section)
    keys = [marginal.key for marginal in marginals]
    drawn, _ = sampled_values(marginals, section.samples, section.seed)
    context.progress(f"wear: {len(drawn)} sampled lives")
    if keys == [COEFFICIENT]:
        hours, reached = _times_of_one(context, section, drawn[:, 0])
    else:
        rows = [dict(zip(keys, row.tolist(), strict=True)) for row in drawn]
        hours, reached = _times(context, [_sample(context, section, row) for row in rows])
    estimates = [(level, quantile(hours, level, ~reached)) for level in LEVELS]
    return SampledLives(
        values={key: drawn[:, k] for k, key in enumerate(keys)},
        hours=hours,
        reached=reached.astype(np.int64),
        quantiles=tuple(LifeQuantile(level, e.value, e.low, e.high, e.at_most is not None) for level, e in estimates),
    )


def _times_of_one(context: StudyContext, section: Wear, factors: Numbers) -> tuple[Numbers, NDArray[np.bool_]]:
    """Times until the first limit with factors on the wear coefficient: twice as much wears twice as fast."""
    given = {name: value for name in ("hours", "cycles") if (value := getattr(section, name)) is not None}
    longest = {name: value * factors.max() for name, value in given.items()}
    history = Life(context, section.model_copy(update=longest)).history()
    first = min((event.time_s for event in history.events if event.kind == "limit"), default=np.inf)
    span = section.hours * HOUR * factors if section.hours is not None else (section.cycles or 0.0) * factors
    ends = span if section.hours is not None else np.interp(span, history.cycles, history.time_s)
    return np.minimum(first, ends) / factors / HOUR, first <= ends


def _times(context: StudyContext, lives: Sequence[Life]) -> tuple[Numbers, NDArray[np.bool_]]:
    """Hours until the first limit of each life, else those of the life, and whether a limit was reached."""
    context.curves([member for life in lives for member in life.members()])  # all at once, into the store
    hours, reached = np.empty(len(lives)), np.empty(len(lives), dtype=bool)
    for number, life in enumerate(lives):
        history = life.history(one_of_many=True)
        limits = [event.time_s for event in history.events if event.kind == "limit"]
        reached[number] = bool(limits)
        hours[number] = (limits[0] if limits else float(history.time_s[-1])) / HOUR
        if (number + 1) % (len(lives) // 4) == 0:
            context.progress(f"wear: {number + 1} of {len(lives)} sampled lives")
    return hours, reached


def _sample(context: StudyContext, section: Wear, at: dict[str, float]) -> Life:
    """A life with some values of the uncertain parameters."""
    factor = at.pop(COEFFICIENT, 1.0)
    given = section.coefficient
    scaled = {k: v * factor for k, v in given.items()} if isinstance(given, dict) else given * factor
    values = {key: as_in_scene(context.scene, key, value) for key, value in at.items()}
    return Life(context, section.model_copy(update={"coefficient": scaled}), values)
