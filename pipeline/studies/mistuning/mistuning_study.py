"""The study `mistuning`: the tuned ring, sampled mistuned rings, and many with linear contacts."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from pipeline.errors import reason_of
from pipeline.scene.labels import prefixed
from pipeline.studies.mistuning.factor_quantiles import factor_quantiles
from pipeline.studies.mistuning.mistuning_result import FactorQuantile, MistuningResult
from pipeline.studies.mistuning.sampled_rings import RingProblem, sampled_rings
from pipeline.studies.study import StudyError

if TYPE_CHECKING:
    from pipeline.studies.study import StudyContext


class MistuningStudy:
    """Responses of mistuned rings, as `Study`."""

    name = "mistuning"
    result = MistuningResult

    def key(self, context: StudyContext) -> Mapping[str, Any]:
        """Nothing more than its section and the first curve of the scene."""
        return {}

    def compute(self, context: StudyContext) -> MistuningResult:
        """The rings, one after another."""
        from nonlinear import MistuningError, OptionsError, whitehead_bound
        from rom import one_blas_thread

        section = context.scene.mistuning
        assert section is not None  # the study is asked for
        try:
            with one_blas_thread():
                problem = RingProblem.of(context.scene, section, context.model.rom)
                tuned = problem.tuned()
                rings, highest = sampled_rings(problem, tuned.peak_m, context.progress)
                linear = problem.linear_rings() if section.linear_samples else None
        except (ArithmeticError, MistuningError, OptionsError) as error:
            raise StudyError(reason_of(error)) from None
        return MistuningResult(
            n_blades=problem.n_blades,
            engine_order=problem.excitation.engine_order,
            harmonics=section.harmonics,
            output=problem.options.output,
            drawn=section.frequency is None,
            bound=whitehead_bound(problem.n_blades),
            tuned=tuned,
            rings=rings,
            quantiles=factor_quantiles(np.array([ring.factor for ring in rings])),
            highest=highest,
            linear=linear,
        )

    def lines(self, result: MistuningResult) -> Sequence[str]:
        """The largest amplification, its distribution, and what is missing."""
        return [f"mistuning: {line}" for line in (headline(result), *remarks(result))]


def headline(result: MistuningResult) -> str:
    """The largest amplification factor in one line."""
    top = max((ring for ring in result.rings if math.isfinite(ring.factor)), key=lambda ring: ring.factor)
    factor, unit = prefixed(top.amplitude_m, "m")
    count = f"{len(result.rings)} rings" if len(result.rings) > 1 else "1 ring"
    return (
        f"amplification factor {top.factor:.4g} at most of {count}: {top.amplitude_m * factor:.4g} {unit} at "
        f"{top.frequency_hz:.5g} Hz, blade {top.blade}, seed {top.seed}; tuned "
        f"{result.tuned.peak_m * factor:.4g} {unit} at {result.tuned.peak_hz:.5g} Hz"
    )


def remarks(result: MistuningResult) -> tuple[str, ...]:
    """Quantiles, the linear rings, and what is missing, a line each."""
    said = [f"nonlinear contacts: {quantile_text(result.quantiles)}"] if len(result.rings) > 1 else []
    if result.linear is not None:
        many = len(result.linear.factor)
        values = quantile_text(result.linear.quantiles) if many > 1 else f"factor {result.linear.factor[0]:.4g}"
        said.append(f"{result.linear.state} contacts, {many} rings: {values}; Whitehead's bound {result.bound:.4g}")
    if not result.tuned.complete:
        said.append("the tuned curve does not span the range")
    partial = [ring for ring in result.rings if not ring.complete]
    if partial:
        said.append(f"{len(partial)} of {len(result.rings)} rings are not complete: {partial[0].message}")
    return tuple(said)


def quantile_text(quantiles: Sequence[FactorQuantile]) -> str:
    """Quantiles with their intervals as text."""
    parts = []
    for each in quantiles:
        low, high = ("?" if end is None else f"{end:.4g}" for end in (each.low, each.high))
        name = "median" if each.level == 0.5 else f"{100.0 * each.level:g} %"
        parts.append(f"{name} {each.value:.4g} ({low} to {high})")
    return ", ".join(parts)
