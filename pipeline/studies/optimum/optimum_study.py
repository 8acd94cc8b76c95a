"""The study `optimum`: which search fits the keys, and its result in the units of the scene."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any

from pipeline.process.clock import seconds_since
from pipeline.scene.key_values import key_value
from pipeline.scene.optimum_checks import SOLVER_KEYS
from pipeline.stages.scene_to_solver import face_area, resolved_contact
from pipeline.studies.optimum.derivative_free import TOLERANCE, Point, UnitSearch
from pipeline.studies.optimum.description import message_of, result_lines
from pipeline.studies.optimum.followed_peaks import FollowedPeaks, per_unit
from pipeline.studies.optimum.optimum_result import OptimumResult, Trial
from pipeline.studies.optimum.trials import CurveTrials, trial_of
from pipeline.studies.study import StudyContext, StudyError

if TYPE_CHECKING:
    from nonlinear import Optimum

Ranges = Mapping[str, tuple[float, float]]
WITHIN = 1.1  # factor on the lowest amplitude that bounds the range told of
FLAT = 1e-3  # relative variation that counts as none
PEAKS, CURVES, BOTH = "peaks", "curves", "both"


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

    `peaks` is the key over which peaks are followed: the only key of the solver, with the method "coupled". Over all
    other keys the curves at single values are compared.
    """

    context: StudyContext
    ranges: Ranges
    trials: dict[Point, Trial] = field(default_factory=dict)
    searches: dict[Point, Optimum] = field(default_factory=dict)

    @property
    def peaks(self) -> str | None:
        """The key over which peaks are followed, if any."""
        solver = [key for key in self.ranges if key in SOLVER_KEYS]
        return solver[0] if len(solver) == 1 and self.context.scene.response.method == "coupled" else None

    @property
    def outer(self) -> list[str]:
        """The keys over which single values are compared."""
        return [key for key in self.ranges if key != self.peaks]

    def result(self) -> OptimumResult:
        """The result; its time is not known here."""
        outer = self.outer
        if not outer:
            self._followed([()])
            best: Point = ()
        else:
            best = self._compared(outer)
        return self._of_peaks(best) if self.peaks is not None else self._of_curves(best)

    def _compared(self, keys: Sequence[str]) -> Point:
        """The lowest point over keys whose single values are compared."""
        function = self._solved if self.peaks is None else self._followed
        self.search = UnitSearch(function, len(keys))
        best = self.search.minimise(self._own_point(keys))
        if best is None:
            reasons = [trial.reason for trial in self.trials.values() if trial.reason]
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
        return [_height(trial.amplitude_m) for trial in found]

    def _followed(self, points: Sequence[Point]) -> list[float]:
        """Lowest worst amplitudes over the followed key at these points; infinite where there is none."""
        assert self.peaks is not None
        for point in points:
            values = self._values(point)
            inner = FollowedPeaks(self.context, self.peaks, self.ranges[self.peaks], values)
            if values:
                self.context.progress(", ".join(f"{key} = {value:.6g}" for key, value in values.items()))
            try:
                found = inner.optimum()
            except StudyError as error:
                if not values:
                    raise
                self.trials[point] = Trial(values, reason=str(error))
                continue
            self.searches[point] = found
            at = values | {self.peaks: found.value * self._per_unit(self.peaks)}
            self.trials[point] = Trial(at, found.amplitude_m, found.frequency_hz, found.motion)
        return [_height(self.trials[point].amplitude_m) for point in points]

    def _of_peaks(self, best: Point) -> OptimumResult:
        """The result where peaks were followed over one key."""
        assert self.peaks is not None
        found, trial = self.searches[best], self.trials[best]
        factor = self._per_unit(self.peaks)
        names = {name: key for key, name in SOLVER_KEYS.items()}
        derivatives = {
            names[name]: value / self._per_unit(names[name])
            for name, value in found.derivatives.items()
            if names[name] != "response.damping_ratio" or self.context.scene.response.rayleigh is None
        }
        low, high = found.within
        kind = found.kind if not self.outer else self._kind(best, found.kind)
        responses = sum(len(search.responses) for search in self.searches.values())
        return self._result(
            trial,
            kind=kind,
            curvature=found.curvature / factor**2,
            within={self.peaks: (low * factor, high * factor)},
            derivatives=derivatives,
            search=found,
            per_unit=factor,
            method=BOTH if self.outer else PEAKS,
            responses=responses,
            remarks=found.remarks,
        )

    def _of_curves(self, best: Point) -> OptimumResult:
        """The result where curves at single values were compared."""
        trial = self.trials[best]
        within = {self.outer[0]: self._within(best)} if len(self.outer) == 1 else {}
        ends = ["the worst motion lies at an end of the frequency range"] if trial.at_end else []
        opened = [f"at the optimum: {trial.unresolved}"] if trial.unresolved else []
        missing = [each for each in self.trials.values() if each.reason]
        lost = [f"{len(missing)} of {len(self.trials)} curves are missing, the first: {missing[0].reason}"]
        return self._result(
            trial,
            kind=self._kind(best, "sampled"),
            within=within,
            responses=len(self.trials),
            remarks=(*ends, *opened, *(lost if missing else ())),
        )

    def _result(self, trial: Trial, **said: Any) -> OptimumResult:
        """The result at a trial, with what is said of it."""
        values: dict[str, Any] = {
            "ranges": dict(self.ranges),
            "values": {key: trial.values[key] for key in self.ranges},
            "amplitude_m": trial.amplitude_m,
            "frequency_hz": trial.frequency_hz,
            "motion": trial.motion,
            "curvature": math.nan,
            "derivatives": {},
            "base": self._base(),
            "search": None,
            "per_unit": 1.0,
            "method": CURVES,
            "trials": tuple(self.trials[point] for point in sorted(self.trials)) if self.outer else (),
            "seconds": 0.0,
            "message": "",
            **said,
        }
        found = OptimumResult(**values)
        if self.outer:
            accuracy = f"keys compared by single curves are known to {100 * TOLERANCE:g} % of their ranges"
            found = replace(found, remarks=(*found.remarks, accuracy))
        return replace(found, message=message_of(found))

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
        heights = {point[0]: trial.amplitude_m for point, trial in self.trials.items()}
        limit, ends = WITHIN * heights[best[0]], []
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
        return trial_of(own, curves[0]) if curves else Trial(own, reason="not computed")

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


def _height(amplitude: float) -> float:
    """The amplitude, infinite where there is none."""
    return amplitude if math.isfinite(amplitude) else math.inf
