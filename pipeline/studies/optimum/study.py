"""The study `optimum`: which search fits the keys, and its result in the units of the scene.

Peaks are followed over keys of the solver. Over other keys the lowest value is sought without derivatives
(`UnitSearch`): of one key on a grid, then by Brent's bounded method around the lowest local minima; of several on a
Latin hypercube, then by the simplex method of Nelder and Mead, whose minima may be kinks, from the lowest points.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Any

import numpy as np

from nonlinear import NEARLY_LOWEST, NO_PEAK, JointOptimum, Optimum
from pipeline.process.progress import seconds_since
from pipeline.scene.sweep import key_value
from pipeline.stages.scene_to_solver import face_area, resolved_contact
from pipeline.studies.optimum.checks import SOLVER_KEYS
from pipeline.studies.optimum.result import OptimumResult, Trial, message_of, result_lines
from pipeline.studies.optimum.trials import CurveTrials, FollowedPeaks, objective_of, per_unit, trial_of
from pipeline.studies.study import StudyContext, StudyError

Point = tuple[float, ...]
GRID = 9  # points of the grid of one variable
MINIMA = 2  # that are refined
TOLERANCE = 5e-3  # of a variable, as a share of its range
EVALUATIONS = 20  # of a refinement for each variable
WORTH = 1.3  # ratio to the lowest value above which a second start is not refined
APART = 0.25  # of a second start from the first, in the unit cube
_DIGITS = 6  # of a share of the range, by which points are known again
Ranges = Mapping[str, tuple[float, float]]
FLAT = 1e-3  # relative variation that counts as none
MOST_FOLLOWED = 3  # keys of the solver, which `nonlinear.find_joint_optimum` takes
PEAKS, CURVES, BOTH = "peaks", "curves", "both"


@dataclass
class UnitSearch:
    """Values of a function on the unit cube, each computed once, and its minimum."""

    # gives the values at a list of points of the unit cube; infinity where there is none
    function: Callable[[Sequence[Point]], Sequence[float]]
    size: int  # number of variables
    grid: int = GRID  # points of the grid of one variable
    evaluations: int = EVALUATIONS  # largest number of evaluations of a refinement for each variable
    known: dict[Point, float] = field(default_factory=dict)

    def minimise(self, first: Sequence[Point] = ()) -> Point | None:
        """The lowest point found; None where the function has no value at any of the first points."""
        self._evaluate([*(_rounded(point) for point in first), *(self._grid() if self.size == 1 else self._sample())])
        if not any(map(math.isfinite, self.known.values())):
            return None
        if self.size == 1:
            for bracket in self._brackets():
                self._brent(bracket)
        else:
            for start in self._starts():
                self._simplex(start)
        return min(self.known, key=self.known.__getitem__)

    @property
    def spread(self) -> float:
        """Largest over smallest value found, less 1."""
        finite = [value for value in self.known.values() if math.isfinite(value)]
        return max(finite) / min(finite) - 1.0 if finite and min(finite) > 0.0 else math.inf

    def _grid(self) -> list[Point]:
        return [_rounded((float(share),)) for share in np.linspace(0.0, 1.0, self.grid)]

    def _sample(self) -> list[Point]:
        from scipy.stats import qmc

        count = 4 * self.size + 4
        unit = qmc.LatinHypercube(self.size, rng=np.random.default_rng(0), optimization="random-cd").random(count)
        return [(0.5,) * self.size, *(_rounded(row) for row in unit.tolist())]

    def _evaluate(self, points: Sequence[Point]) -> None:
        missing = [point for point in dict.fromkeys(points) if point not in self.known]
        if missing:
            self.known |= dict(zip(missing, self.function(missing), strict=True))

    def _at(self, point: Sequence[float]) -> float:
        """The value at a point; where there is none, one above all others."""
        place = _rounded([min(max(share, 0.0), 1.0) for share in point])
        self._evaluate([place])
        value = self.known[place]
        return value if math.isfinite(value) else 2.0 * max(filter(math.isfinite, self.known.values()))

    def _brackets(self) -> list[tuple[float, float]]:
        """Intervals around the lowest local minima, the lowest first."""
        shares = sorted(point[0] for point in self.known)
        heights = [self.known[(share,)] for share in shares]
        found = []
        for k in range(len(shares)):
            beside = [heights[j] for j in (k - 1, k + 1) if 0 <= j < len(shares)]
            if math.isfinite(heights[k]) and heights[k] <= min(beside):
                found.append((heights[k], shares[max(k - 1, 0)], shares[min(k + 1, len(shares) - 1)]))
        return [(left, right) for _, left, right in sorted(found)[:MINIMA]]

    def _brent(self, bracket: tuple[float, float]) -> None:
        from scipy.optimize import minimize_scalar

        options = {"xatol": TOLERANCE, "maxiter": self.evaluations}
        minimize_scalar(lambda share: self._at([share]), bounds=bracket, method="bounded", options=options)

    def _starts(self) -> list[Point]:
        """The lowest point, and the lowest one apart from it that is not much higher."""
        ordered = sorted(self.known, key=self.known.__getitem__)
        best = ordered[0]
        apart = [point for point in ordered if max(abs(a - b) for a, b in zip(point, best, strict=True)) > APART]
        second = [point for point in apart[:1] if self.known[point] <= WORTH * self.known[best]]
        return [best, *second]

    def _simplex(self, start: Point) -> None:
        from scipy.optimize import minimize

        corners = np.tile(np.array(start), (self.size + 1, 1))
        for k, share in enumerate(start):
            corners[k + 1, k] += -0.15 if share > 0.5 else 0.15
        options = {
            "initial_simplex": corners,
            "xatol": TOLERANCE,
            "fatol": math.inf,
            "maxfev": self.evaluations * self.size,
        }
        minimize(self._at, start, method="Nelder-Mead", bounds=[(0.0, 1.0)] * self.size, options=options)


def _rounded(point: Sequence[float]) -> Point:
    return tuple(round(float(share), _DIGITS) for share in point)


KEYS = {name: key for key, name in SOLVER_KEYS.items()}


class OptimumStudy:
    """Values of keys at which the worst motion is lowest, as `Study`."""

    name = "optimum"
    result = OptimumResult

    def key(self, context: StudyContext) -> Mapping[str, Any]:
        """Nothing more than its section and the scene."""
        return {}

    def compute(self, context: StudyContext) -> OptimumResult:
        """The optimum over the keys of the section."""
        section = context.scene.optimum
        assert section is not None  # the study is asked for
        start = time.perf_counter()
        found = _Search(context, section.ranges).result()
        return replace(found, seconds=seconds_since(start))

    def lines(self, result: OptimumResult) -> Sequence[str]:
        """The table and what was left open."""
        return result_lines(result)


@dataclass
class _Search:
    """The search over the keys of one scene.

    Peaks are followed over the keys of the solver, where there are no more than three and the method is "coupled".
    Over all other keys single values are compared: their curves, or their optima over the followed keys.
    """

    context: StudyContext
    ranges: Ranges
    trials: dict[Point, Trial] = field(default_factory=dict)
    searches: dict[Point, Optimum | JointOptimum] = field(default_factory=dict)
    responses: int = 0

    @property
    def peaks(self) -> dict[str, tuple[float, float]]:
        """The keys over which peaks are followed, with their ranges."""
        solver = {key: limits for key, limits in self.ranges.items() if key in SOLVER_KEYS}
        coupled = self.context.scene.response.method == "coupled"
        return solver if coupled and len(solver) <= MOST_FOLLOWED else {}

    @property
    def outer(self) -> list[str]:
        """The keys over which single values are compared."""
        return [key for key in self.ranges if key not in self.peaks]

    def result(self) -> OptimumResult:
        """The result; its time is not known here."""
        outer = self.outer
        if not outer:
            self._followed([()])
            best: Point = ()
        else:
            best = self._compared(outer)
            if self.peaks:
                self._follow(best, rough=False)
        return self._of_peaks(best) if self.peaks else self._of_curves(best)

    def _compared(self, keys: Sequence[str]) -> Point:
        """The lowest point over keys whose single values are compared."""
        function = self._solved if not self.peaks else self._followed
        grid, evaluations = (GRID // 2 + 1, EVALUATIONS // 3) if self.peaks else (GRID, EVALUATIONS)
        self.search = UnitSearch(function, len(keys), grid, evaluations)
        best = self.search.minimise(self._own_point(keys))
        if best is None:
            reasons = [trial.reason or NO_PEAK for trial in self.trials.values() if trial.reason or trial.at_end]
            raise StudyError(f"no values in the ranges have a motion: {reasons[0]}")
        return best

    def _own_point(self, keys: Sequence[str]) -> list[Point]:
        """The scene's own values in the unit cube, where they lie in the ranges."""
        values = self._own_values(keys)
        point = [(values[key] - low) / (high - low) for key, (low, high) in self._limits(keys)]
        return [tuple(point)] if all(0.0 <= share <= 1.0 for share in point) else []

    def _limits(self, keys: Sequence[str]) -> list[tuple[str, tuple[float, float]]]:
        return [(key, self.ranges[key]) for key in keys]

    def _values(self, point: Point) -> dict[str, float]:
        """Values of the outer keys at a point of the unit cube."""
        return {
            key: float(f"{low + share * (high - low):.12g}")
            for share, (key, (low, high)) in zip(point, self._limits(self.outer), strict=True)
        }

    def _solved(self, points: Sequence[Point]) -> list[float]:
        """Worst amplitudes of the curves at these points; infinite where there is none."""
        found = CurveTrials(self.context)([self._values(point) for point in points])
        self.trials |= dict(zip(points, found, strict=True))
        return [trial.height for trial in found]

    def _followed(self, points: Sequence[Point]) -> list[float]:
        """Lowest worst amplitudes over the followed key at these points; infinite where there is none."""
        for point in points:
            self._follow(point, rough=bool(point))
        return [self.trials[point].height for point in points]

    def _follow(self, point: Point, rough: bool) -> None:
        """The optimum over the followed keys at a point; with none of the other keys a failure is raised."""
        values = self._values(point)
        if values:
            self.context.progress(", ".join(f"{key} = {value:.6g}" for key, value in values.items()))
        try:
            found = FollowedPeaks(self.context, self.peaks, values, rough).optimum()
        except StudyError as error:
            if not values:
                raise
            self.trials.setdefault(point, Trial(values, reason=str(error)))
            return
        self.responses += len(found.responses)
        at = values | {KEYS[name]: value * self._per_unit(KEYS[name]) for name, value in found.values.items()}
        self.searches[point] = found
        motion = found.amplitude_m, found.frequency_hz, found.motion
        self.trials[point] = Trial(at, *motion, truncation_error=found.truncation_error)

    def _of_peaks(self, best: Point) -> OptimumResult:
        """The result where peaks were followed over keys of the solver."""
        found, trial = self.searches[best], self.trials[best]
        own = {KEYS[name]: value / self._per_unit(KEYS[name]) for name, value in found.derivatives.items()}
        if self.context.scene.response.rayleigh is not None:
            own.pop("response.damping_ratio", None)
        said: dict[str, Any] = {"kind": self._kind(best, found.kind) if self.outer else found.kind}
        if isinstance(found, Optimum):
            key, factor = KEYS[found.name], self._per_unit(KEYS[found.name])
            low, high = found.within
            said |= {
                "curvature": found.curvature / factor**2,
                "within": {key: (low * factor, high * factor)},
                "per_unit": factor,
            }
        return self._result(
            trial,
            followed=found,
            derivatives=own,
            method=BOTH if self.outer else PEAKS,
            responses=self.responses,
            remarks=found.remarks,
            **said,
        )

    def _of_curves(self, best: Point) -> OptimumResult:
        """The result where curves at single values were compared."""
        trial = self.trials[best]
        within = {self.outer[0]: self._within(best)} if len(self.outer) == 1 else {}
        count = sum(each.at_end for each in self.trials.values())
        ends = [f"at {count} of {len(self.trials)} values {NO_PEAK}: they are no candidates"] if count else []
        opened = [f"at the optimum: {trial.unresolved}"] if trial.unresolved else []
        missing = [each for each in self.trials.values() if each.reason]
        lost = [f"{len(missing)} of {len(self.trials)} curves are missing: {each.reason}" for each in missing[:1]]
        return self._result(
            trial,
            kind=self._kind(best, "sampled"),
            method=CURVES,
            within=within,
            responses=len(self.trials),
            remarks=(*ends, *opened, *lost),
        )

    def _result(self, trial: Trial, **said: Any) -> OptimumResult:
        """The result at a trial, with what is said of it."""
        found = OptimumResult(
            ranges=dict(self.ranges),
            values={key: trial.values[key] for key in self.ranges},
            amplitude_m=trial.amplitude_m,
            frequency_hz=trial.frequency_hz,
            motion=trial.motion,
            base=self._base(),
            trials=tuple(self.trials[point] for point in sorted(self.trials)) if self.outer else (),
            objective=objective_of(self.context),
            harmonics=self._harmonics(),
            truncation_error=trial.truncation_error,
            **said,
        )
        swept = [key for key in self.context.file.swept if key in self.ranges]
        notes = [f"{key} is swept: the scene's own value is its first" for key in swept]
        if self.outer:
            notes.append(f"keys compared by single curves are known to {100 * TOLERANCE:g} % of their ranges")
        found = replace(found, remarks=(*found.remarks, *notes))
        return replace(found, message=message_of(found))

    def _harmonics(self) -> int:
        """Number of harmonics of the followed peaks; of single curves that of the scene, where it is fixed."""
        asked = self.context.scene.response.harmonics
        return max((found.harmonics for found in self.searches.values()), default=asked if asked != "auto" else 0)

    def _kind(self, best: Point, inside: str) -> str:
        """Kind of an optimum at a point of the unit cube."""
        if self.search.spread < FLAT:
            return "flat"
        at_end = any(min(share, 1.0 - share) <= TOLERANCE for share in best)
        return "edge" if at_end or inside == "edge" else inside

    def _within(self, best: Point) -> tuple[float, float]:
        """Values around the optimum of one key up to which the worst motion is 10 % higher, between the curves."""
        ((low, high),) = (self.ranges[key] for key in self.outer)
        shares = sorted(point[0] for point in self.trials)
        heights = {point[0]: trial.height for point, trial in self.trials.items()}
        limit, ends = NEARLY_LOWEST * heights[best[0]], []
        for side in (-1.0, 1.0):
            beyond = sorted((s for s in shares if (s - best[0]) * side >= 0.0), reverse=side < 0.0)
            end = beyond[-1]
            for inner, outer in pairwise(beyond):
                rise = heights[outer] - heights[inner]
                if not heights[outer] <= limit:
                    end = inner + (outer - inner) * ((limit - heights[inner]) / rise if math.isfinite(rise) else 0.0)
                    break
            ends.append(low + end * (high - low))
        return ends[0], ends[1]

    def _base(self) -> Trial:
        """The worst motion with the scene's own values."""
        curves = self.context.outcome.curves
        own = {key: value for key, value in self._own_values(list(self.ranges)).items() if math.isfinite(value)}
        return trial_of(own, curves[0], objective_of(self.context)) if curves else Trial(own, reason="not computed")

    def _own_values(self, keys: Sequence[str]) -> dict[str, float]:
        """The scene's own values; NaN where there is none."""
        from rom import read_reduced_model

        scene = self.context.scene
        contact = scene.contact
        if contact.uses_punch:
            model = read_reduced_model(self.context.model.rom, with_basis=False)
            contact = resolved_contact(scene, face_area(model))
        found = {key: key_value(scene, key, contact) for key in keys}
        return {key: math.nan if value is None else value for key, value in found.items()}

    def _per_unit(self, key: str) -> float:
        return per_unit(key, self.context.scene, int(self.context.model.facts["n_contacts"]))
