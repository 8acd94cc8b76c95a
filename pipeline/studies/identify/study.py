"""The study `identify`: parameters from measured motions, with intervals, and what the data do not tell."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from nonlinear.peak_curves.measured_motion import APART, Measured, vibration
from nonlinear.peak_curves.parameter_fit import Fit, ParameterFit, Ranges, distinct, starting_places
from nonlinear.problem import Problem
from pipeline.scene.dotted_keys import flattened_keys
from pipeline.scene.labels import quantity, value_label
from pipeline.scene.measured_motions import measured_motions
from pipeline.scene.sweep import as_in_scene, key_value
from pipeline.stages.curve.curve_file import read_curve
from pipeline.stages.scene_to_solver import nonlinear_problem
from pipeline.studies.identify.posterior import (
    correlation_of,
    gains,
    identified_keys,
    misfit_probability,
    misfit_said,
    rounded,
    untold,
    widening,
)
from pipeline.studies.identify.result import (
    Compared,
    ComputedCurve,
    Identification,
    IdentifiedKey,
    NextMeasurement,
    OtherValues,
)
from pipeline.studies.identify.sweeps import with_sweep
from pipeline.studies.optimum.checks import solver_keys
from pipeline.studies.optimum.trials import per_unit
from pipeline.studies.study import StudyError

if TYPE_CHECKING:
    from nonlinear.response_curve import ResponseCurve
    from pipeline.scene.reading import Member
    from pipeline.scene.schema import Scene
    from pipeline.studies.identify.result import Numbers
    from pipeline.studies.identify.section import MeasuredMotion
    from pipeline.studies.study import StudyContext

PLACE, SAMPLE = "identify", "place"
ROUGH = {  # of responses that are solved to find places only
    "response.search": "off",
    "response.stability": "folds",
    "response.detached": False,
    "response.truncation": False,
    "response.residual_tractions": "projected",
}
ROUGH_HARMONICS = 3  # where the scene leaves them to the program
FITS = 4  # places from which the fit starts
ROUNDS = 4  # of fits with responses of all options, until these have the motions that were carried
SAME = 0.3  # standard deviations between a carried motion and that of a solved response
TELLS = 0.95  # part of a deviation that a measurement must leave at most to be proposed
AS_GOOD = 6.0  # larger misfit with which other values are told too
OTHER_UNITS = 100.0  # factor between measured and computed amplitudes at all places
FORCE, FACTORS = "excitation.force", (0.25, 4.0)


class IdentifyStudy:
    """Values of keys from measured motions, as `Study`."""

    name = "identify"
    result = Identification

    def key(self, context: StudyContext) -> Mapping[str, Any]:
        """What was measured."""
        return {"measured": [motion.model_dump() for motion in measured_motions(context.scene)]}

    def compute(self, context: StudyContext) -> Identification:
        """The values with the least misfit, and what follows."""
        return _Identification(context).result()

    def lines(self, result: Identification) -> Sequence[str]:
        """The values with their intervals, and what qualifies them."""
        head = f"identify: {misfit_said(result.misfit, result.degrees)}"
        lines = [head, *(key_said(item) for item in result.keys)]
        return [*lines, *(f"identify: {line}" for line in (*result.untold, *result.remarks))]


def key_said(item: IdentifiedKey) -> str:
    """A key with its interval in a line."""
    value, low, high = (rounded(item.key, value) for value in (item.value, item.low, item.high))
    end = f"; at the {item.end} end of its range" if item.end else ""
    return f"identify: {quantity(item.key).symbol} {value}, 95 %: {low} to {high}{end}"


@dataclass(frozen=True)
class _Condition:
    """What was measured with the same values of all keys."""

    values: Mapping[str, Any]  # of the keys that differ from the scene
    rows: tuple[MeasuredMotion, ...]
    member: Member
    problem: Problem
    label: str


class _Identification:
    """One computation of the study."""

    def __init__(self, context: StudyContext) -> None:
        self.context, self.scene = context, context.scene
        section = self.scene.identify
        assert section is not None  # the study is asked for
        self.section, self.keys = section, tuple(section.ranges)
        motions = measured_motions(self.scene)
        if not motions:
            raise StudyError(
                "nothing was measured: identify.data, [[identify.measured]], or shroud identify SCENE DATA"
            )
        self.conditions = [self._condition(values, rows) for values, rows in self._grouped(motions)]
        known, nodes = solver_keys(self.scene), self._nodes
        self.units = np.array([per_unit(key, self.scene, nodes) for key in self.keys])
        low, high = np.array(list(section.ranges.values())).T / self.units
        self.ranges = Ranges(tuple(known[key] for key in self.keys), low, high)
        self.responses, self.remarks = 0, list[str]()
        self.default_output = self.conditions[0].problem.options.output
        self.units_of = {item.name: item.unit_said for item in self.scene.output}

    def _grouped(
        self, motions: Sequence[MeasuredMotion]
    ) -> Iterator[tuple[Mapping[str, Any], tuple[MeasuredMotion, ...]]]:
        """Measured motions by the scenes under which they were measured, in their order: 1, 1.0 and no value where
        the scene has 1 are one.
        """
        by_values: dict[str, list[MeasuredMotion]] = {}
        for motion in motions:
            by_values.setdefault(repr(sorted(motion.conditions.items())), []).append(motion)
        groups: list[tuple[Scene, Mapping[str, Any], list[MeasuredMotion]]] = []
        for rows in by_values.values():
            values = rows[0].conditions
            scene = self.context.member(values, PLACE).scene
            same = next((kept for own, _, kept in groups if own == scene), None)
            if same is None:
                groups.append((scene, values, rows))
            else:
                same += rows
        return ((values, tuple(rows)) for _, values, rows in groups)

    def _condition(self, values: Mapping[str, Any], rows: tuple[MeasuredMotion, ...]) -> _Condition:
        from rom.files.reduced_model_file import read_reduced_model

        member = self.context.member(values, PLACE)
        model = read_reduced_model(self.context.model_of(member).rom, with_basis=False)
        self._nodes = model.n_contacts / len(model.interfaces)
        label = ", ".join(value_label(key, value) for key, value in values.items()) or "the scene"
        return _Condition(values, rows, member, Problem(*nonlinear_problem(member.scene, model)), label)

    def result(self) -> Identification:
        """Everything, from the first responses on."""
        from rom.linear_algebra.threads import one_blas_thread

        with one_blas_thread():
            fit = ParameterFit(self.ranges, [c.problem for c in self.conditions], self._measured(), self._rough)
            first = self._first_fits(fit)
            best, curves, fit = self._settled(first[0], fit)
            best, curves, fit = self._with_residual_tractions(best, curves, fit)
            others = self._others(first[1:], best)
            return self._concluded(best, curves, fit, others)

    def _measured(self) -> list[tuple[Measured, ...]]:
        return [tuple(self._as_measured(row) for row in condition.rows) for condition in self.conditions]

    def _as_measured(self, row: MeasuredMotion) -> Measured:
        return Measured(
            output=row.output or self.default_output,
            amplitude=row.amplitude,
            frequency_hz=row.frequency,
            amplitude_deviation=row.amplitude_deviation or self.section.amplitude_deviation,
            frequency_deviation=row.frequency_deviation or self.section.frequency_deviation * row.frequency,
            is_peak=row.curve is None,
            rate_hz_per_s=row.rate or 0.0,
        )

    # responses

    def _rough(self, place: Numbers) -> list[ResponseCurve | None]:
        return self._curves([place], rough=True)[0]

    def _curves(
        self, places: Sequence[Numbers], rough: bool, more: Mapping[str, Any] | None = None
    ) -> list[list[ResponseCurve | None]]:
        """The response under each condition at each place; None where there is none."""
        options: dict[str, Any] = {}
        if rough:
            options |= ROUGH
            if self.scene.response.harmonics == "auto":
                options["response.harmonics"] = ROUGH_HARMONICS
        options |= more or {}
        members = [self._member(place, condition, options) for place in places for condition in self.conditions]
        found = [None if c.file is None else read_curve(c.file) for c in self.context.curves(members)]
        self.responses += len(found)
        count = len(self.conditions)
        return [found[k : k + count] for k in range(0, len(found), count)]

    def _member(self, place: Numbers, condition: _Condition, options: Mapping[str, Any]) -> Member:
        values = dict(zip(self.keys, (self.ranges.values(place) * self.units).tolist(), strict=True))
        given = {key: as_in_scene(condition.member.scene, key, value) for key, value in values.items()}
        said = ", ".join(value_label(key, value) for key, value in values.items())
        member = self.context.member({**condition.values, **given, **options}, PLACE)
        return replace(member, parameters={SAMPLE: f"{said}; {condition.label}"})

    # fits

    def _first_fits(self, fit: ParameterFit) -> list[Fit]:
        """Fits from the best of the places whose responses are solved first, the best one in front."""
        own = [key_value(self.scene, key) for key in self.keys]
        middle = self.ranges.low * self.units
        values = [low if value is None else value for value, low in zip(own, middle, strict=True)]
        places = starting_places(self.ranges.place(np.array(values) / self.units), self.section.places)
        self.context.progress(f"identify: responses at {len(places)} places of {', '.join(self.keys)}")
        scores = []
        for place, curves in zip(places, self._curves(places, rough=True), strict=True):
            if fit.start(place, curves):
                scores.append((fit.score(place), place, fit.amplitude_ratio(place)))
        if not scores:
            raise StudyError(
                "at none of the places in the ranges do all measured motions exist: peaks at an end of "
                "response.frequency, no stable peak, or fewer peaks than were measured (under one row of "
                "conditions those 5 % apart are several modes); widen response.frequency or the ranges"
            )
        ratios = np.array([ratio for *_, ratio in scores])
        if (ratios.min() > OTHER_UNITS) or (ratios.max() < 1.0 / OTHER_UNITS):
            found = f"{np.exp(np.abs(np.log(ratios)).min()):.3g}"
            raise StudyError(f"measured and computed amplitudes differ by a factor of {found} or more: other units?")
        fits: list[Fit] = []
        for _, place, _ in sorted(scores, key=lambda item: item[0])[:FITS]:
            found_fit = fit.fit(place)
            if found_fit is not None:
                if not fits or found_fit.misfit < min(fit.misfit for fit in fits) - 0.01:
                    self.context.progress(f"identify: {self._said(found_fit)}")
                fits.append(found_fit)
        if not fits:
            raise StudyError("no values were found under which all measured motions exist")
        return distinct(fits)

    def _said(self, fit: Fit) -> str:
        values = zip(self.keys, (self.ranges.values(fit.place) * self.units).tolist(), strict=True)
        return f"misfit {fit.misfit:.4g} at {', '.join(value_label(key, value) for key, value in values)}"

    def _settled(self, best: Fit, fit: ParameterFit) -> tuple[Fit, list[ResponseCurve], ParameterFit]:
        """The fit to the motions of responses with all options of the scene, sweeps of the frequency included."""
        place = best.place
        for _ in range(ROUNDS):
            curves = self._curves([place], rough=False)[0]
            known = [curve for curve in curves if curve is not None]
            measured = self._swept(fit.measured, best)
            new = ParameterFit(self.ranges, fit.problems, measured, self._rough)
            if len(known) < len(curves) or not new.start(place, known):
                raise StudyError(
                    "a measured motion does not persist, or has left response.frequency, at the best values, "
                    f"{self._said(best)}"
                )
            start = new.fit_at(place)
            assert start is not None  # its motions are there
            settled = bool(np.abs(start.residuals - best.residuals).max() < SAME)
            best, fit = (start if settled else new.fit(place) or start), new
            if settled:
                return best, known, fit
            self.context.progress(f"identify: {self._said(best)}, with all options of the scene")
            place = best.place
        self.remarks.append("the motions of the last responses are others than those of the fit: not settled")
        return best, known, fit

    def _swept(self, measured: Sequence[tuple[Measured, ...]], best: Fit) -> list[tuple[Measured, ...]]:
        """The measured motions with what the sweep that has them does to their peaks at the best values."""
        motions, values = iter(best.motions), self.ranges.values(best.place)
        changed = []
        for items, condition in zip(measured, self.conditions, strict=True):
            rows = []
            for item in items:
                steady = next(motions)
                if item.rate_hz_per_s:
                    label = f"{condition.label}: {item.rate_hz_per_s:+.4g} Hz/s"
                    self.context.progress(f"identify: the ring in time, {label}")
                    item = with_sweep(condition.problem, self.ranges.names, values, item, steady)
                rows.append(item)
            changed.append(tuple(rows))
        return changed

    def _with_residual_tractions(
        self, best: Fit, curves: list[ResponseCurve], fit: ParameterFit
    ) -> tuple[Fit, list[ResponseCurve], ParameterFit]:
        """The fit with deviations that the residual tractions of sticking nodes widen."""
        if not any(curve.free_nodes for curve in curves):
            return best, curves, fit
        bounds = {"response.residual_tractions": "bounds"}
        bounded = self._curves([best.place], rough=True, more=bounds)[0]
        measured, widened = [], False
        for items, curve in zip(fit.measured, bounded, strict=True):
            band = None if curve is None else curve.residual_bounds
            if band is not None:
                low, high = band.least_vibration, band.most_vibration
                spread = float(np.log(high.vibration_m / low.vibration_m)) / np.sqrt(12.0)
                shift = abs(high.frequency_hz - low.frequency_hz) / np.sqrt(12.0)
                widened |= spread > 0.0
                items = tuple(
                    replace(
                        item,
                        amplitude_deviation=float(np.hypot(item.amplitude_deviation, spread)),
                        frequency_deviation=float(np.hypot(item.frequency_deviation, shift)),
                    )
                    for item in items
                )
            measured.append(items)
        if not widened:
            return best, curves, fit
        self.remarks.append("residual tractions of nodes that stick are not known: they widen the intervals")
        fit = fit.with_measured(measured)
        best = fit.fit(best.place) or best
        return best, curves, fit

    def _others(self, fits: Sequence[Fit], best: Fit) -> tuple[OtherValues, ...]:
        near = [fit for fit in fits if fit.misfit < best.misfit + AS_GOOD]
        near = [fit for fit in near if np.abs(fit.place - best.place).max() > 0.05]
        return tuple(
            OtherValues(
                dict(zip(self.keys, (self.ranges.values(fit.place) * self.units).tolist(), strict=True)), fit.misfit
            )
            for fit in near
        )

    # conclusions

    def _concluded(
        self, best: Fit, curves: Sequence[ResponseCurve], fit: ParameterFit, others: tuple[OtherValues, ...]
    ) -> Identification:
        degrees = len(best.residuals) - len(self.keys)
        factor = widening(best.misfit, degrees)
        covariance = best.covariance(factor)
        keys = identified_keys(self.keys, self.ranges, self.units, best, covariance)
        correlation = correlation_of(covariance)
        probability = misfit_probability(best.misfit, degrees)
        if factor > 1.0:
            wider = "".join(f"a wider range of {item.key}, " for item in keys if item.end)
            self.remarks.insert(
                0,
                f"the model does not fit the data ({misfit_said(best.misfit, degrees)}, "
                f"probability {probability:.2g}): {wider}another law of friction, a parameter "
                f"that is not sought, or more scatter than given; all intervals are {factor:.3g} times as wide",
            )
        compared = tuple(self._compared(best, fit))
        self.remarks += (_other_mode_said(item) for item in compared if _of_another_mode(item))
        if degrees == 0:
            self.remarks.append("as many keys as measured numbers: whether the model fits cannot be said")
        for other in others:
            said = ", ".join(value_label(key, value) for key, value in other.values.items())
            self.remarks.append(f"other values fit as well: {said} (misfit {other.misfit:.4g})")
        following = self._following(best.place, covariance)
        if following and min(following[0].deviations.values()) < TELLS:
            self.remarks.append(_next_said(following[0]))
        return Identification(
            keys=keys,
            correlation=correlation,
            misfit=best.misfit,
            degrees=degrees,
            probability=probability,
            factor=factor,
            compared=compared,
            others=others,
            untold=untold(keys, correlation, factor == 1.0),
            following=following,
            remarks=tuple(self.remarks),
            curves=tuple(self._drawn(curves)),
            responses=self.responses,
        )

    def _compared(self, best: Fit, fit: ParameterFit) -> Iterator[Compared]:
        rows = [(condition, row) for condition in self.conditions for row in condition.rows]
        for (condition, row), item, motion in zip(rows, fit.all_measured, best.motions, strict=True):
            yield Compared(
                label=condition.label,
                output=row.output or "",
                unit=self.units_of.get(row.output or "", "m"),
                curve=row.curve or "",
                frequency_hz=item.frequency_hz,
                amplitude=item.amplitude,
                frequency_deviation_hz=item.frequency_deviation,
                amplitude_deviation=item.amplitude_deviation,
                computed_hz=motion.frequency_hz + item.sweep_shift_hz,
                computed_amplitude=motion.amplitude * item.sweep_factor,
                rate_hz_per_s=row.rate or 0.0,
                sweep_factor=item.sweep_factor,
            )

    def _drawn(self, curves: Sequence[ResponseCurve]) -> Iterator[ComputedCurve]:
        for condition, curve in zip(self.conditions, curves, strict=True):
            for output in dict.fromkeys(row.output for row in condition.rows):
                for branch in (curve, *curve.detached):
                    heights = vibration(branch, output or self.default_output)
                    yield ComputedCurve(condition.label, output or "", branch.frequency_hz, heights)

    def _following(self, place: Numbers, covariance: Numbers) -> tuple[NextMeasurement, ...]:
        """Peaks that could be measured next, the one that tells most first."""
        found = []
        for values in self._candidates():
            try:
                condition = self._condition(values, self.conditions[0].rows[:1])
            except StudyError as error:
                self.remarks.append(f"no response at {values}: {error}")
                continue
            item = replace(self._as_measured(condition.rows[0]), is_peak=True)
            options = {**ROUGH, "response.harmonics": self._harmonics}
            (curve,) = self.context.curves([self._member(place, condition, options)])
            self.responses += 1
            if curve.file is None:
                continue
            one = ParameterFit(self.ranges, [condition.problem], [(item,)], self._rough)
            if not one.start(place, [read_curve(curve.file)]):
                continue
            frequency = one.motions[0][0].known[-1][1].frequency_hz
            item = replace(item, frequency_deviation=self.section.frequency_deviation * frequency)
            rows = one.with_measured([(item,)]).jacobian(place)
            ratio, gain = gains(covariance, rows)
            found.append(NextMeasurement(condition.label, dict(zip(self.keys, ratio.tolist(), strict=True)), gain))
        return tuple(sorted(found, key=lambda item: -item.gain))

    @property
    def _harmonics(self) -> int:
        number = self.scene.response.harmonics
        return ROUGH_HARMONICS if number == "auto" else int(number)

    def _candidates(self) -> Iterator[dict[str, Any]]:
        asked = flattened_keys(self.section.candidates)
        if not asked and FORCE not in self.keys:
            own = [float(condition.member.scene.excitation.force) for condition in self.conditions]
            asked = {FORCE: [min(own) * FACTORS[0], max(own) * FACTORS[1]]}
        base = self.conditions[0].values
        for key, values in asked.items():
            for value in values:
                yield {**base, key: value}


def _next_said(item: NextMeasurement) -> str:
    key, ratio = min(item.deviations.items(), key=lambda pair: pair[1])
    return (
        f"of the measurements that could come next a peak at {item.label} tells most: it leaves "
        f"{100.0 * ratio:.2g} % of the deviation of {key}"
    )


def _of_another_mode(item: Compared) -> bool:
    """Whether a measured peak is so far from the computed one as two modes are."""
    ratio = item.computed_hz / item.frequency_hz
    return not item.curve and not 1.0 / (1.0 + APART) < ratio < 1.0 + APART


def _other_mode_said(item: Compared) -> str:
    return (
        f"{item.label}: the peak measured at {item.frequency_hz:.5g} Hz is compared with the highest one computed, "
        f"at {item.computed_hz:.5g} Hz: if that is another mode, response.frequency around the measured one alone"
    )
