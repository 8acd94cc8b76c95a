"""The study `optimum`: which search fits the keys, and its result in the units of the scene.

Peaks are followed over keys of the solver. Over other keys, with tolerances and with several load cases single curves
are compared: with a tolerance the worst within it, over one key by `WindowSearch`; else and over further keys by
`UnitSearch`.
"""

from __future__ import annotations

import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import Any

import numpy as np

from nonlinear.options import NEARLY_LOWEST, NO_PEAK
from nonlinear.peak_curves.optimum_result import JointOptimum, Optimum
from nonlinear.peak_curves.worst_envelope import range_below
from pipeline.codec import plain
from pipeline.process.interrupts import Stopped
from pipeline.process.progress import seconds_since
from pipeline.scene.contact_section import Contact
from pipeline.scene.dotted_keys import CONTACT, INTERFACE
from pipeline.scene.sweep import key_value
from pipeline.stages.code_fingerprint import code_fingerprint
from pipeline.stages.scene_to_solver import resolved_contacts
from pipeline.studies.optimum.checks import KEYS, solver_keys
from pipeline.studies.optimum.result import (
    OptimumResult,
    Robust,
    Trial,
    candidate_said,
    message_of,
    result_lines,
    shown,
    value_said,
)
from pipeline.studies.optimum.search import EVALUATIONS, GRID, TOLERANCE, Point, UnitSearch, WindowSearch
from pipeline.studies.optimum.section import BY_STRESS, LIFE
from pipeline.studies.optimum.section import Optimum as SectionOptimum
from pipeline.studies.optimum.trials import (
    CurveTrials,
    FollowedPeaks,
    Tolerance,
    highest,
    load_cases,
    objective_of,
    per_unit,
    tolerance_of,
    trial_of,
    worn_by,
)
from pipeline.studies.study import StudyContext, StudyError

Ranges = Mapping[str, tuple[float, float]]
STRESS_CODE, WEAR_CODE = "pipeline.stress.operating_stress", "pipeline.studies.wear.life"
FLAT = 1e-3  # relative variation that counts as none
MOST_FOLLOWED = 3  # keys of the solver, which `nonlinear.find_joint_optimum` takes
COARSE = 2e-2  # tolerance of keys at each of whose values a window slides, as a share of the range
CLOSE = 1e-2  # relative gain that is not worth a further curve there
LARGE_MEAN = 0.25  # share of a static mean in the height from which it is said
ROUGH, FINE = 24, 80  # values of a window at most, of single values of the other keys and of the best
DRAWN = 401  # places of the envelope that are kept
PEAKS, CURVES, BOTH = "peaks", "curves", "both"


def _not_counted(trials: Sequence[Trial]) -> list[str]:
    """How many of some trials are no candidates, and why."""
    lost, ends = [each for each in trials if each.reason], sum(each.at_end for each in trials)
    found = [f"at {ends} of {len(trials)} values {NO_PEAK}: they are no candidates"] * bool(ends)
    return found + [f"{len(lost)} of {len(trials)} curves are missing: {each.reason}" for each in lost[:1]]


class OptimumStudy:
    """Values of keys at which the worst motion is lowest, as `Study`."""

    name = "optimum"
    result = OptimumResult

    def key(self, context: StudyContext) -> Mapping[str, Any]:
        """The load cases, and the distributions where they are the tolerances."""
        section, scene = context.scene.optimum, context.scene
        assert section is not None
        laws = scene.uncertainty if section.tolerance == "uncertainty" else None
        own = {"cases": load_cases(context), "laws": None if laws is None else laws.model_dump()["parameter"]}
        if section.objective == LIFE:
            return {
                **own,
                "wear": worn_by(context.scene, section.life).model_dump(),
                "life": code_fingerprint(WEAR_CODE),
            }
        if section.objective not in BY_STRESS:
            return own
        limits = None if scene.fatigue is None else scene.fatigue.model_dump()
        return {**own, "fatigue": limits, "stress": code_fingerprint(STRESS_CODE)}

    def compute(self, context: StudyContext) -> OptimumResult:
        """The optimum over the keys of the section; of a search that is stopped the best so far is left with it."""
        section = context.scene.optimum
        assert section is not None  # the study is asked for
        start, search = time.perf_counter(), _Search(context, section.ranges)
        try:
            return replace(search.result(), seconds=seconds_since(start))
        except Stopped as stop:
            found = search.so_far()
            if found is not None:
                stop.summary = plain(replace(found, seconds=seconds_since(start)))
            raise

    def lines(self, result: OptimumResult) -> Sequence[str]:
        """The table and what was left open."""
        return result_lines(result)


@dataclass
class _Search:
    """The search over the keys of one scene.

    Peaks are followed over the keys of the solver, where there are no more than three, one load case, no tolerance,
    and the method is "coupled". Over one optimised key with a tolerance a window slides. Over all other keys single
    values are compared: their curves, or their optima over the former.
    """

    context: StudyContext
    ranges: Ranges
    trials: dict[Point, Trial] = field(default_factory=dict)
    searches: dict[Point, Optimum | JointOptimum] = field(default_factory=dict)
    windows: dict[Point, WindowSearch] = field(default_factory=dict)
    responses: list[Trial] = field(default_factory=list)  # of followed peaks

    @property
    def section(self) -> SectionOptimum:
        """The section of the scene."""
        found = self.context.scene.optimum
        assert found is not None
        return found

    @cached_property
    def tolerance(self) -> Tolerance | None:
        """The tolerances."""
        laws = self.context.scene.uncertainty if self.section.tolerance == "uncertainty" else None
        keys = self.section.tolerances if laws is None else [item.key for item in laws.parameter]
        return tolerance_of(self.context, self._own_values(list(keys)))

    @cached_property
    def curves(self) -> CurveTrials:
        """Single curves."""
        if self.tolerance is None:
            return CurveTrials(self.context)
        keys = self.tolerance.around[0]
        return CurveTrials(self.context, self._own_values(list(keys)), self.tolerance.around)

    @cached_property
    def peaks(self) -> dict[str, tuple[float, float]]:
        """The keys over which peaks are followed, with their ranges."""
        keys = solver_keys(self.context.scene)
        solver = {key: limits for key, limits in self.ranges.items() if key in keys}
        coupled = self.context.scene.response.method == "coupled"
        alone = self.tolerance is None and len(load_cases(self.context)) == 1 and self.section.follows_peaks
        return solver if alone and coupled and len(solver) <= MOST_FOLLOWED else {}

    @property
    def window(self) -> str:
        """The key over which a window slides; "" without one."""
        return self.tolerance.key if self.tolerance is not None else ""

    @property
    def outer(self) -> list[str]:
        """The keys over which single values are compared."""
        return [key for key in self.ranges if key not in self.peaks and key != self.window]

    def result(self) -> OptimumResult:
        """The result; its time is not known here."""
        best: Point = self._compared(self.outer) if self.outer else ()
        if self.peaks:
            self._follow(best, rough=False)
        elif self.window:
            self._slide(best, rough=False)
        return self._result(self.trials[best], best)

    def so_far(self) -> OptimumResult | None:
        """The best found so far; None where nothing is known yet."""
        covered = [point for point, search in self.windows.items() if search.covered]
        ended = [*self.searches] or covered
        if ended:
            best = min(ended, key=lambda point: self.trials[point].height if point in self.trials else math.inf)
            found = self._result(self._worst_within(best) if covered else self.trials[best], best)
        else:
            known = [*self.trials.values(), *self.responses, *self.curves.known.values()]
            lowest = min(known, key=lambda trial: trial.height, default=None)
            if lowest is None or not math.isfinite(lowest.height):
                return None
            found = self._result(lowest)
        found = replace(found, complete=False, remarks=("stopped: the best so far", *found.remarks))
        return replace(found, message=f"so far {message_of(found)}")

    def _compared(self, keys: Sequence[str]) -> Point:
        """The lowest point over keys whose single values are compared."""
        function = self._followed if self.peaks else self._slid if self.window else self._solved
        if self.window:
            self.search = UnitSearch(function, len(keys), GRID // 2 + 1, EVALUATIONS // 3, COARSE, gain=CLOSE)
        elif self.peaks:
            self.search = UnitSearch(function, len(keys), GRID // 2 + 1, 2 * EVALUATIONS // 3)
        else:
            self.search = UnitSearch(function, len(keys))
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
        values = [self._values(point) for point in points]
        found = self.curves(values)
        if self.tolerance is not None and math.isfinite(self.tolerance.level):
            rows = self.curves.scattered(values)
            heights = [self.tolerance.of_one([trial.height for trial in row]) for row in rows]
            found = [trial.with_value(height) for trial, height in zip(found, heights, strict=True)]
        self.trials |= dict(zip(points, found, strict=True))
        return [trial.height for trial in found]

    def _slid(self, points: Sequence[Point]) -> list[float]:
        """Lowest worst amplitudes within the tolerance at these points; infinite where there is none."""
        for point in sorted(points, key=partial(math.dist, points[0])):  # each beside one that is known
            self._slide(point, rough=True)
            self.context.progress(candidate_said(self.section.objective, self.trials[point]))
        return [self.trials[point].height for point in points]

    def _expected(self, point: Point) -> float | None:
        """The best value of the key of the window at the nearest point known."""
        known = [other for other, trial in self.trials.items() if math.isfinite(trial.value) and other != point]
        return self.windows[min(known, key=partial(math.dist, point))].best() if known else None

    def _slide(self, point: Point, rough: bool) -> None:
        """The optimum over the key of the window at a point."""
        key, values, tolerance = self.window, self._values(point), self.tolerance
        assert tolerance is not None

        def heights(at: Sequence[float]) -> list[tuple[float, ...]]:
            self._say(point, len(at))
            places = {value: {**values, key: value} for value in at}
            try:
                rows = self.curves.scattered(list(places.values()))
            except Stopped:
                done = {value: place for value, place in places.items() if self.curves.are_known(place)}
                rows = self.curves.scattered(list(done.values()))
                search.known |= dict(zip(done, map(samples, rows), strict=True))
                raise
            return [samples(row) for row in rows]

        def samples(row: Sequence[Trial]) -> tuple[float, ...]:
            return tolerance.of_samples([trial.height for trial in row])

        low, high = self.ranges[key]
        search = self.windows.get(point) or WindowSearch(
            heights, low, high, tolerance.half[key], tolerance.shifts, tolerance.level
        )
        search.most = ROUGH if rough else FINE
        search.enough = min((trial.height for trial in self.trials.values()), default=math.inf) if rough else math.inf
        search.close, search.expected = (CLOSE, self._expected(point)) if rough else (0.0, None)
        self.windows[point] = search
        if search.minimise() is None:
            if not self.outer:
                reason = next((t.reason for t in self.curves.known.values() if t.reason), NO_PEAK)
                raise StudyError(f"no values in the ranges have a motion: {reason}")
            self.trials[point] = Trial(values, reason=NO_PEAK)
            return
        if not rough:
            self._check_others(search, values)
        trial, used = self._worst_within(point), self.curves.of(values)
        cost: dict[str, Any] = {
            name: sum(getattr(each, name) for each in used) for name in ("curves", "seconds", "model_seconds")
        }
        self.trials[point] = replace(trial, **cost)

    def _check_others(self, search: WindowSearch, values: Mapping[str, float]) -> None:
        """Solve the ends of the tolerance around the lowest single value and the scene's own."""
        low, high = self.ranges[self.window]
        inside = [value for value in search.known if low <= value <= high]
        lowest = min(inside, key=lambda value: max(search.known[value]))
        own = self._own_values([self.window])[self.window]
        for value in (lowest, math.nan if self.outer else own):
            if low <= value <= high:
                search.check(value)

    def _worst_within(self, point: Point) -> Trial:
        """The worst motion within the tolerance of the best value of the key of the window, so far."""
        search, values = self.windows[point], self._values(point)
        best = search.best()
        near = search.inside(best) or sorted(search.known, key=lambda value: abs(value - best))[:1]
        trial = highest(values, self.curves([{**values, self.window: value} for value in near]))
        at, values = trial.values[self.window], {**values, self.window: best}
        if search.shifts is not None or best not in search.checked:
            return replace(trial, values=values, where={}).with_value(search.value_at(best))
        where = trial.where if at == best else {**trial.where, self.window: at}
        return replace(trial, values=values, where=where)

    def _say(self, point: Point, count: int) -> None:
        """What is solved next, and the best so far."""
        search = self.windows[point]
        text = f"{len(search.known)} curves known, {count} to solve"
        if search.known:
            best, height = search.lowest(hopeful=False)
            said = value_said(self.section.objective, height)
            text += f"; so far {shown(self.window, best)}: {said} within the tolerance"
        others = ", ".join(f"{key} = {shown(key, value)}" for key, value in self._values(point).items())
        self.context.progress(f"{others}: {text}" if others else text)

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
            found = FollowedPeaks(self.context, self.peaks, values, rough, self.responses).optimum()
        except StudyError as error:
            if not values:
                raise
            self.trials.setdefault(point, Trial(values, reason=str(error)))
            return
        best = found.optimum
        at = self._of_solver(best.values)
        self.searches[point] = best
        motion, earlier = (best.amplitude_m, best.frequency_hz, best.motion), self.trials.get(point)
        making = max(found.model_seconds, 0.0 if earlier is None else earlier.model_seconds)
        trial = Trial(values | at, *motion, truncation_error=best.truncation_error)
        spent: dict[str, Any] = {
            "curves": len(best.responses),
            "seconds": making + best.seconds,
            "model_seconds": making,
        }
        self.trials[point] = replace(trial, **spent)

    def _of_solver(self, values: Mapping[str, float]) -> dict[str, float]:
        """Values of parameters of the solver as those of the scene's keys."""
        return {KEYS[name]: value * self._per_unit(KEYS[name]) for name, value in values.items()}

    def _tried(self) -> tuple[Trial, ...]:
        """The values tried in their order: of the outer keys, or the path of a joint optimum."""
        found = self.searches.get(())
        if isinstance(found, JointOptimum):
            return tuple(Trial(self._of_solver(values), height) for values, height in found.path)
        return tuple(self.trials.values()) if self.outer else ()

    def _result(self, trial: Trial, point: Point | None = None) -> OptimumResult:
        """The result at a trial: the best of the search at a point, or without one of the curves known so far."""
        method = CURVES if point is None or not self.peaks else BOTH if self.outer else PEAKS
        said: dict[str, Any] = {"kind": "sampled"} if point is None else self._said_at(point, trial)
        found = OptimumResult(
            ranges=dict(self.ranges),
            values={key: trial.values[key] for key in self.ranges},
            amplitude_m=trial.amplitude_m,
            frequency_hz=trial.frequency_hz,
            motion=trial.motion,
            base=self._base(),
            method=method,
            trials=self._tried(),
            responses=sum(len(each.responses) for each in self.searches.values())
            or len(self.curves.known)
            or len(self.responses),
            solved=self._solved_curves(),
            objective=objective_of(self.context),
            output=self.section.output or "",
            goal=trial.goal,
            harmonics=self._harmonics(),
            truncation_error=trial.truncation_error,
            where=trial.where,
            **said,
        )
        found = replace(found, remarks=(*found.remarks, *self._notes(found)))
        return replace(found, message=message_of(found))

    def _said_at(self, point: Point, trial: Trial) -> dict[str, Any]:
        """Kind, ranges, what was left open and further fields of the result at a point."""
        if point in self.searches:
            said = self._of_peaks(self.searches[point])
        elif point in self.windows:
            said = self._of_window(point, trial)
        else:
            opened = [f"at the optimum: {trial.unresolved}"] if trial.unresolved else []
            said = {"kind": "sampled", "remarks": (*_not_counted([*self.trials.values()]), *opened)}
            if self.tolerance is not None:
                said["robust"] = Robust(tolerance=dict(self.tolerance.half), quantile=self.tolerance.level)
        if not self.outer:
            return said
        within = {**self._within_outer(point), **said.get("within", {})}
        return {**said, "kind": self._kind(point, said["kind"]), "within": within}

    def _of_peaks(self, found: Optimum | JointOptimum) -> dict[str, Any]:
        """What followed peaks tell of their optimum."""
        own = {KEYS[name]: value / self._per_unit(KEYS[name]) for name, value in found.derivatives.items()}
        if self.context.scene.response.rayleigh is not None:
            own.pop("response.damping_ratio", None)
        said = {"kind": found.kind, "followed": found, "derivatives": own, "remarks": found.remarks}
        if isinstance(found, JointOptimum):
            return said
        key, factor = KEYS[found.name], self._per_unit(KEYS[found.name])
        low, high = found.within
        within = {key: (low * factor, high * factor)}
        return {**said, "curvature": found.curvature / factor**2, "within": within, "per_unit": factor}

    def _of_window(self, point: Point, trial: Trial) -> dict[str, Any]:
        """What a window over one key tells of its optimum."""
        search, tolerance, key, height = self.windows[point], self.tolerance, self.window, trial.value
        assert tolerance is not None
        low, high = self.ranges[key]
        computed = self.curves([{**self._values(point), key: value} for value in sorted(search.known)])
        inside = [each for each in computed if low <= each.values[key] <= high]
        lowest = min(inside, key=lambda each: each.height)
        own = self._own_values([key])[key]
        kept = np.unique(np.linspace(0, len(search.centres) - 1, DRAWN).astype(int))
        robust = Robust(
            tolerance=dict(tolerance.half),
            quantile=tolerance.level,
            key=key,
            bracket=search.bracket(height),
            bound=search.lowest()[1],
            nominal=next((each for each in computed if each.values[key] == trial.values[key]), None),
            lowest=lowest,
            around_lowest=search.value_at(lowest.values[key]),
            around_own=search.value_at(own) if low <= own <= high and not self.outer else math.nan,
            computed=tuple(computed),
            value=search.centres[kept],
            worst=search.heights_of()[kept],
        )
        within, remarks = {key: search.around(NEARLY_LOWEST * height)}, self._remarks_on(computed, search)
        return {"kind": search.kind(), "within": within, "remarks": remarks, "robust": robust}

    def _remarks_on(self, computed: Sequence[Trial], search: WindowSearch) -> tuple[str, ...]:
        """What the curves of a window leave open."""
        inside = [each for each in computed if each.values[self.window] in search.inside(search.best())]
        left = [each for each in inside if each.unresolved]
        found = [f"after {len(search.known)} values parts of the range are not refined"] * search.exhausted
        found += self._rests_on(search) if self.outer else []
        found += _not_counted(computed)
        if left:
            count = f"{len(left)} of {len(inside)} curves"
            found.append(f"within the tolerance {count} count by their highest solution: {left[0].unresolved}")
        return tuple(found)

    def _rests_on(self, search: WindowSearch) -> list[str]:
        """How the values of the outer keys were compared."""
        named, reach = ", ".join(self.outer), shown(self.window, 2.0 * search.tolerance)
        best = "" if search.close else " and the best"  # which is not reached where the search was stopped
        return [
            f"{named}: to {100 * self.search.tolerance:g} % of the range or {100 * CLOSE:g} % of the height; values "
            "tried that cannot be the best are not refined",
            f"the whole range of {self.window} was searched with the first value of {named}{best}; with others "
            f"around the optimum of the nearest, further out in steps that double from {reach}: a lower valley "
            "between two of them would be missed",
        ]

    def _notes(self, found: OptimumResult) -> list[str]:
        """What a reader of any result has to know."""
        swept = [key for key in self.context.file.swept if key in self.ranges]
        notes = [f"{key} is swept: the scene's own value is its first" for key in swept]
        cases = load_cases(self.context)
        if len(cases) > 1:
            names = ", ".join(cases[0])
            notes.append(f"the highest of {len(cases)} load cases counts ({names})")
        if self.outer and not self.window:
            notes.append(f"{', '.join(self.outer)}: to {100 * self.search.tolerance:g} % of the range")
        own = found.base
        if found.objective == "displacement" and not found.output and own.mean_m > LARGE_MEAN * own.amplitude_m:
            mean = f"of the scene's own {found.said(own.amplitude_m)}, {found.said(own.mean_m)} is the static mean"
            notes.append(f'{mean}, which objective "harmonic_1" leaves out')
        return notes

    def _solved_curves(self) -> tuple[Trial, ...]:
        """All single curves of a search over several keys, each at the highest of its load cases and deviations."""
        if len(self.ranges) < 2:
            return ()
        if self.peaks:
            return tuple(self.responses)
        places = [{key: trial.values[key] for key in self.ranges} for trial in self.curves.known.values()]
        different = [place for number, place in enumerate(places) if place not in places[:number]]
        return tuple(self.curves([place for place in different if self.curves.are_known(place)]))

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

    def _within_outer(self, best: Point) -> dict[str, tuple[float, float]]:
        """Values around the optimum of one outer key up to which it is 10 % higher, between those known."""
        if len(self.outer) != 1 or len(self.trials) < 2 or best not in self.trials:
            return {}
        ((low, high),) = (self.ranges[key] for key in self.outer)
        points = sorted(self.trials)
        shares, heights = np.array(points)[:, 0], np.array([self.trials[point].height for point in points])
        first, last = range_below(shares, heights, best[0], NEARLY_LOWEST * self.trials[best].height)
        return {self.outer[0]: (low + first * (high - low), low + last * (high - low))}

    def _base(self) -> Trial:
        """The worst motion with the scene's own values, in the highest of the load cases."""
        cases, curves = load_cases(self.context), self.context.outcome.curves
        own = {key: value for key, value in self._own_values(list(self.ranges)).items() if math.isfinite(value)}
        keys = [key for key in self.context.file.swept if key not in cases[0]]
        found = []
        for curve in curves:
            first = curves[0].member.parameters
            if all(curve.member.parameters[key] == first[key] for key in keys):
                found.append(trial_of(own, curve, self.context))
        return highest(own, found) if found else Trial(own, reason="not computed")

    def _own_values(self, keys: Sequence[str]) -> dict[str, float]:
        """The scene's own values; NaN where there is none."""
        from rom.files.reduced_model_file import read_reduced_model
        from rom.reduction.contact_dofs import ContactNodes

        scene = self.context.scene
        contacts: dict[str, Contact] = {}
        if scene.punch_key:
            model = read_reduced_model(self.context.model.rom, with_basis=False)
            resolved = resolved_contacts(scene, ContactNodes.of(model))
            contacts = {f"{INTERFACE}.{each.name}": each.contact for each in resolved}
            contacts[CONTACT] = next((e.contact for e in resolved if e.name not in scene.interface), scene.contact)
        found = {key: key_value(scene, key, contacts) for key in keys}
        return {key: math.nan if value is None else value for key, value in found.items()}

    def _per_unit(self, key: str) -> float:
        facts, scene = self.context.model.facts, self.context.scene
        return per_unit(key, scene, facts["n_contacts"] / len(scene.contact.interfaces or facts["interfaces"]))
