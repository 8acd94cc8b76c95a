"""How far the worst motion of a crossing moves within tolerances, and how probably it exceeds a limit.

The peak is followed to other values of parameters, each time an exact solution: no response curve is traced, but
where the peak is lost. A polynomial through the logarithms of some heights tells at once on which side of the limit
most of 131072 samples lie: all but those nearer to it than its leave-one-out error. These are divided into strata by
height, and some of each are solved: the shares that exceed the limit, with the deviation of a binomial law, give the
rest of the probability. Followed peaks know nothing of other branches and of motions that do not persist: where the
probability is between 0.1 and 99.9 %, whole curves near the limit are solved too, and their difference widens the
interval.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from nonlinear.peak_curves.joint_optimum import CarriedPeak
from nonlinear.peak_curves.parameter_family import ParameterFamily, parameter_value
from nonlinear.peak_curves.peak_curve import LARGEST_CHANGE, PeakContinuation, PeakPoint, Stationary, stationary_near
from nonlinear.peak_curves.peak_search import stored_point
from nonlinear.problem import Problem
from pipeline.scene.labels import value_label
from pipeline.scene.sweep import as_in_scene, key_value
from pipeline.stages.curve.curve_file import read_curve
from pipeline.stages.scene_to_solver import nonlinear_problem
from pipeline.studies.crossings.meetings import FORCE, PLACE, RUN
from pipeline.studies.crossings.result import Exceedance, Scatter
from pipeline.studies.optimum.checks import SOLVER_KEYS
from pipeline.studies.optimum.trials import per_unit
from pipeline.studies.study import StudyError
from pipeline.studies.uncertainty.quantiles import sampled_values, unit_points
from pipeline.studies.uncertainty.section import Marginal, marginal_of
from pipeline.studies.uncertainty.sensitivities import fitted_polynomial

if TYPE_CHECKING:
    from pipeline.scene.schema import Scene
    from pipeline.stages.curve.respond import CurveResult
    from pipeline.studies.study import StudyContext

Array = NDArray[np.float64]
DAMPING = "response.damping_ratio"
SOLVED, CURVES = 64, 8  # samples anywhere; whole curves near the limit beside followed peaks
MATTERS = 1e-3  # probability that is not checked by whole curves, of a limit that is, or is not, exceeded
MOST_CURVES = 128  # in place of peaks that are lost
STRATA, IN_STRATUM = 16, 8  # of the samples near the limit by height, and samples in each
SAMPLES = 2**17
CONFIDENCE = 1.96  # standard deviations of an interval of 95 %
SAFETY = 2.0  # of the largest leave-one-out error


@dataclass
class PeakOverKeys:
    """The peak of a curve at other values of some keys of the solver."""

    keys: tuple[str, ...]
    units: Array  # of the keys, for each unit of the solver
    carried: CarriedPeak
    known: list[tuple[Array, Stationary | PeakPoint]]  # where it was solved for

    @classmethod
    def of(cls, curve: CurveResult, keys: Sequence[str], scene: Scene) -> PeakOverKeys:
        """The peak that is the worst motion of a curve; values of the force are those of `scene`."""
        from rom.files.reduced_model_file import read_reduced_model

        facts, own = curve.facts, curve.member.scene
        assert facts is not None
        assert curve.file is not None
        assert curve.rom is not None
        if facts.worst_motion != "periodic" or facts.worst_branch < 0:
            raise StudyError(
                f"the worst motion is {facts.worst_motion or 'not known'}, on no branch that is followed"
            )
        response, model = read_curve(curve.file), read_reduced_model(curve.rom, with_basis=False)
        branch = (response, *response.detached)[facts.worst_branch]
        if not any(peak.located and peak.index == facts.worst_index for peak in branch.peaks):
            raise StudyError("the worst motion is no peak: it stands at the end of stable motion or of the range")
        problem = Problem(*nonlinear_problem(own, model)).with_harmonics(branch.harmonics)
        names = tuple(SOLVER_KEYS[key] for key in keys)
        nodes = model.n_contacts / len(model.interfaces)
        units = [key_value(own, key) or 1.0 if key == DAMPING else per_unit(key, own, nodes) for key in keys]
        if FORCE in keys:  # of the scene, relative to which that of the order varies
            units[list(keys).index(FORCE)] = scene.excitation.force / own.excitation.force
        now = tuple(parameter_value(problem, name) for name in names)
        box = ParameterFamily(problem, names, now, tuple(value + (abs(value) or 1.0) for value in now))
        origin = np.zeros(len(names))
        follower = PeakContinuation(box.line(origin, np.ones(len(names))))
        peak = follower.peak_near(0.0, stored_point(follower.continuation(0.0), branch, facts.worst_index))
        if peak is None or not peak.is_maximum:
            raise StudyError("the peak is not found again by its own equations")
        return cls(tuple(keys), np.array(units), CarriedPeak(box, "", [(origin, peak)]), [(origin, peak)])

    @property
    def own(self) -> Array:
        """The values of the keys at the peak itself."""
        return np.asarray(self.units * np.array(self.carried.box.first))

    @property
    def amplitude_m(self) -> float:
        """Amplitude of the peak itself."""
        return self.carried.known[0][1].amplitude

    def at(self, values: Array) -> Array:
        """Amplitudes at values (n, keys) of the keys, (n,), m; NaN where the peak is lost on the way."""
        box = self.carried.box
        places = (values / self.units - np.array(box.first)) / box.spans
        found = np.full(len(values), np.nan)
        for k in np.argsort(np.abs(places).max(axis=1)):  # each from one that is known
            found[k] = self._amplitude(places[k])
        return found

    def _amplitude(self, place: Array) -> float:
        """Amplitude at a place, in one step from the nearest known one where that leads to a similar peak."""
        start, peak = min(self.known, key=lambda item: float(np.abs(item[0] - place).max()))
        continuation = self.carried.box.line(start, place).continuation(1.0)
        try:
            found = stationary_near(continuation, replace(peak.point, balance=continuation.balance))
            if (
                found is not None
                and found.is_maximum
                and abs(found.amplitude / peak.amplitude - 1.0) <= LARGEST_CHANGE
            ):
                self.known.append((place, found))
                return found.amplitude
            carried = self.carried.at(place)
        except ArithmeticError:
            return math.nan
        return math.nan if carried is None else carried.amplitude


def tolerance_effect(peak: PeakOverKeys, half: Mapping[str, float]) -> tuple[float, float]:
    """Lowest and highest amplitude over that of the peak, less 1: each key alone, and all of them the worse way."""
    width = np.array([half.get(key, 0.0) for key in peak.keys])
    steps = np.vstack([np.diag(width), -np.diag(width)])
    alone = peak.at(peak.own + steps).reshape(2, -1)
    if not np.isfinite(alone).all():
        raise StudyError("the peak is lost within the tolerances")
    rising = np.where(alone[0] > alone[1], 1.0, -1.0)
    ends = peak.at(peak.own + np.outer([1.0, -1.0], rising * width))
    change = np.append(alone.ravel(), ends) / peak.amplitude_m - 1.0
    return float(np.nanmin(change)), float(np.nanmax(change))


@dataclass(frozen=True)
class SampledHeights:
    """The worst motion over the distributions of its keys, by a polynomial through the logarithms of some heights."""

    heights: Callable[[Array], Array]  # of values (n, keys) of the keys, (n,), m; NaN where there is none
    limit_m: float
    values: Array  # (SAMPLES, keys)
    above: Array  # (SAMPLES,), logarithm of the height over the limit, by the polynomial
    error: float  # of it
    lost: float  # share of the samples without a height

    @classmethod
    def of(
        cls, heights: Callable[[Array], Array], marginals: Sequence[Marginal], limit_m: float, seed: int
    ) -> SampledHeights:
        """Heights of some samples, the polynomial at many."""
        points, _ = sampled_values(marginals, SOLVED, seed)
        found = np.log(heights(points))
        known = np.isfinite(found)
        if known.sum() < SOLVED // 2:
            raise StudyError(f"{SOLVED - known.sum()} of {SOLVED} samples have no motion")
        shares = unit_points(SAMPLES, len(marginals), seed)
        values = np.column_stack([m.quantile(shares[:, k]) for k, m in enumerate(marginals)])
        fit = fitted_polynomial(marginals, points[known], found[known])
        shown = np.full(SAMPLES, found[known][0]) if fit is None else fit.at(values)
        error = 0.0 if fit is None else SAFETY * float(np.abs(fit.missed).max())
        return cls(heights, limit_m, values, shown - math.log(limit_m), error, 1.0 - float(known.mean()))

    def exceedance(self) -> Exceedance:
        """The probability that the worst motion exceeds the limit."""
        inside = np.flatnonzero(np.abs(self.above) <= self.error)
        strata = np.array_split(inside[np.argsort(self.above[inside])], STRATA) if len(inside) else []
        chosen = [stratum[_spread(len(stratum), IN_STRATUM)] for stratum in strata]
        found = np.split(self.heights(self.values[np.concatenate(chosen)]), STRATA) if strata else []
        sure, weight = float(np.mean(self.above > self.error)), len(inside) / SAMPLES / STRATA
        counts = np.array([(np.sum(near > self.limit_m), np.sum(np.isfinite(near))) for near in found]).reshape(-1, 2)
        share = (counts[:, 0] + 0.5) / (counts[:, 1] + 1.0)
        deviation = float(np.sqrt(np.sum(share * (1.0 - share) / (counts[:, 1] + 2.0))))
        known = np.divide(counts[:, 0], counts[:, 1], out=np.full(len(counts), 0.5), where=counts[:, 1] > 0)
        ends = sorted((float(share.sum()), float(known.sum())))
        ends = [max(ends[0] - CONFIDENCE * deviation, 0.0), min(ends[1] + CONFIDENCE * deviation, STRATA)]
        return Exceedance(
            limit_m=self.limit_m,
            probability=sure + weight * float(known.sum()),
            low=(sure + weight * ends[0]) * (1.0 - self.lost),
            high=min(sure + weight * ends[1] + self.lost, 1.0),
            samples=SOLVED + sum(map(len, chosen)),
            error=math.expm1(self.error),
        )

    @property
    def near_limit(self) -> Array:
        """Values nearest to the limit, at which whole curves are solved, (CURVES, keys)."""
        nearest = np.argsort(np.abs(self.above))[: CURVES * CURVES]
        return self.values[nearest[np.argsort(self.above[nearest])][_spread(len(nearest), CURVES)]]

    def widened(self, found: Exceedance, difference: float) -> Exceedance:
        """The probability where a whole curve may be higher or lower than the followed peak by a ratio, less 1."""
        size, middle = math.log1p(difference), float(np.mean(self.above > 0.0))
        low, high = float(np.mean(self.above > size)) - middle, float(np.mean(self.above > -size)) - middle
        low, high = max(found.low + low, 0.0), min(found.high + high, 1.0)
        return replace(found, low=low, high=high, curves=CURVES, curve_error=difference)


def _spread(size: int, count: int) -> NDArray[np.int64]:
    """Some of so many places, evenly spread."""
    return np.unique(np.linspace(0, size - 1, min(count, size)).astype(int))


def scatter_of(context: StudyContext, curve: CurveResult, values: Mapping[str, Any], margin: float) -> Scatter:
    """The effect of tolerances on the worst motion of a crossing, and the probability that its limit is exceeded.

    `values`: keys of the scene in its run; `margin`: its fatigue margin. What is not known has a remark.
    """
    section, laws = context.scene.crossings, context.scene.uncertainty
    assert section is not None  # the study is asked for
    assert curve.facts is not None
    remarks, tolerance, found = [], None, None
    try:
        if half := section.tolerances:
            tolerance = tolerance_effect(PeakOverKeys.of(curve, list(half), context.scene), half)
    except (ArithmeticError, StudyError) as error:
        remarks.append(f"effect of the tolerances not known: {error}")
    limits = [] if section.limit is None else [section.limit]
    limits += [] if section.margin is None else [curve.facts.height * margin / section.margin]
    if limits and laws is not None:
        try:
            found = _probability(context, curve, values, min(limits))
        except (ArithmeticError, StudyError) as error:
            remarks.append(f"probability not known: {error}")
    return Scatter(tolerance, found, tuple(remarks))


def _probability(context: StudyContext, curve: CurveResult, values: Mapping[str, Any], limit_m: float) -> Exceedance:
    """The probability that a limit is exceeded; whole curves near it beside, where some sample exceeds it."""
    laws, scene = context.scene.uncertainty, context.scene
    assert laws is not None
    if not math.isfinite(limit_m):
        raise StudyError("the fatigue margin is not known")
    marginals = [marginal_of(item, key_value(scene, item.key) or 0.0) for item in laws.parameter]
    solver = _Heights(context, curve, values, tuple(marginal.key for marginal in marginals))
    sampled = SampledHeights.of(solver, marginals, limit_m, laws.seed)
    found = replace(sampled.exceedance(), replaced=solver.replaced)
    if found.high < MATTERS or found.low > 1.0 - MATTERS:
        return found
    points = sampled.near_limit
    followed = solver.peak.at(points)
    ratio = np.abs(np.log(solver.curves(points) / followed))[np.isfinite(followed)]
    if ratio.size and not np.isfinite(ratio).any():
        raise StudyError("no curve near the limit has a solution")
    return sampled.widened(found, math.expm1(float(np.nanmax(ratio, initial=0.0))))


class _Heights:
    """Heights of followed peaks; where a peak is lost on the way that of a whole curve."""

    def __init__(
        self, context: StudyContext, curve: CurveResult, values: Mapping[str, Any], keys: tuple[str, ...]
    ) -> None:
        self.context, self.run, self.values, self.keys = context, curve, values, keys
        self.peak = PeakOverKeys.of(curve, keys, context.scene)
        self.replaced = 0  # lost peaks in whose place a curve was solved

    def __call__(self, values: Array) -> Array:
        """Heights at values (n, keys) of the keys, (n,), m."""
        self.context.progress(f"{self.run.member.parameters[RUN]}: peak followed to {len(values)} samples")
        found = self.peak.at(values)
        if (lost := np.flatnonzero(np.isnan(found))).size:
            self.replaced += lost.size
            if self.replaced > MOST_CURVES:
                raise StudyError(f"the peak is lost at more than {MOST_CURVES} samples")
            found[lost] = self.curves(values[lost])
        return found

    def curves(self, values: Array) -> Array:
        """Worst motions of whole curves at values (n, keys) of the keys, (n,), m; NaN without one."""
        scene, members = self.context.scene, []
        for row in values:
            at = dict(zip(self.keys, row.tolist(), strict=True))
            if FORCE in at:
                at[FORCE] *= self.values[FORCE] / scene.excitation.force
            given = {**self.values, **{key: as_in_scene(scene, key, value) for key, value in at.items()}}
            said = ", ".join(value_label(key, value) for key, value in at.items())
            label = {RUN: f"{self.run.member.parameters[RUN]}, {said}"}
            members.append(replace(self.context.member(given, PLACE), parameters=label))
        facts = [curve.facts for curve in self.context.curves(members)]
        return np.array([math.nan if each is None else each.height for each in facts])
