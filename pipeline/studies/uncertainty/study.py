"""The study `uncertainty`: the curves of all samples, and what follows from their worst motions."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import reason_of
from pipeline.results.worst import number_error
from pipeline.scene.schema import Scene
from pipeline.scene.sweep import as_in_scene, key_value
from pipeline.stages.curve.respond import CurveResult
from pipeline.studies.optimum.checks import solver_keys
from pipeline.studies.optimum.trials import per_unit
from pipeline.studies.study import StudyError
from pipeline.studies.uncertainty.quantiles import (
    CONVERGENCE,
    LEVELS,
    REPLICATES,
    Estimate,
    exceedance,
    levels_of,
    mixed_values,
    quantile,
    sampled_values,
)
from pipeline.studies.uncertainty.random_field import random_field
from pipeline.studies.uncertainty.remarks import headline, remarks_on
from pipeline.studies.uncertainty.result import (
    Centre,
    Convergence,
    ResidualBand,
    Spread,
    UncertaintyResult,
)
from pipeline.studies.uncertainty.section import marginal_of
from pipeline.studies.uncertainty.sensitivities import (
    FirstOrder,
    PolynomialChaos,
    SobolIndex,
    first_order,
    polynomial_chaos,
    sobol_indices,
)

if TYPE_CHECKING:
    from pipeline.scene.reading import Member
    from pipeline.studies.study import StudyContext


Array = NDArray[np.float64]
DAMPING = "response.damping_ratio"  # in the solver a factor, 1 at the centre
RESIDUAL = "response.residual_tractions"
PLACE = "uncertainty.parameter"
SAMPLE = "sample"  # the parameter by which samples differ: a word, so that no branch is carried from one to another


@dataclass(frozen=True)
class _Heights:
    """Worst motions of some curves (n,), in their order; NaN and -1 without one."""

    amplitude: Array
    frequency: Array
    branch: NDArray[np.int64]
    periodic: NDArray[np.bool_]
    incomplete: NDArray[np.bool_]
    unresolved: NDArray[np.bool_]
    at_end: NDArray[np.bool_]
    truncation_error: Array

    @property
    def lower_bound(self) -> NDArray[np.bool_]:
        """Which of them may be higher."""
        return self.incomplete | self.unresolved | self.at_end


class UncertaintyStudy:
    """Distribution of the worst motion for uncertain parameters, as `Study`."""

    name = "uncertainty"
    result = UncertaintyResult

    def key(self, context: StudyContext) -> Mapping[str, Any]:
        """Nothing more than its section and the scene."""
        return {}

    def compute(self, context: StudyContext) -> UncertaintyResult:
        """The curves of all samples and their statistics."""
        return _Computation(context).result()

    def lines(self, result: UncertaintyResult) -> Sequence[str]:
        """The result in a line, and what qualifies it."""
        return [f"uncertainty: {result.message}", *(f"uncertainty: {remark}" for remark in result.remarks)]


class _Computation:
    """One computation of the study."""

    def __init__(self, context: StudyContext) -> None:
        section = context.scene.uncertainty
        assert section is not None  # the study is asked for
        self.context, self.section = context, section
        scene, rom = context.scene, context.model.rom
        self.fields = [random_field(item, scene, rom) for item in section.parameter if item.correlation_length]
        plain = [item for item in section.parameter if not item.correlation_length]
        self.marginals = [marginal_of(item, key_value(scene, item.key) or 0.0) for item in plain]
        self.marginals += [each for field in self.fields for each in field.coordinates]
        self.keys = [marginal.key for marginal in self.marginals]
        self.mixes = (
            section.sensitivities and len(self.keys) > 1 and not section.correlation
        )  # the index of a single parameter is 1
        self.first, self.second = sampled_values(self.marginals, section.samples, section.seed, section.correlation)

    def result(self) -> UncertaintyResult:
        """Everything, from the curves on."""
        curves = self._curves()
        n = self.section.samples
        centre, base = curves[0], curves[1 : n + 1]
        heights = _heights(base)
        known = np.isfinite(heights.amplitude)
        if known.sum() < max(n // 2, 2 * REPLICATES):
            reason = next((curve.reason for curve in base if curve.facts is None), "no motion is known to persist")
            raise StudyError(f"only {known.sum()} of {n} samples have a worst motion: {reason}")
        levels = levels_of(n)
        linear = self._first_order(centre, levels)
        values = {key: tuple(self.first[:, k].tolist()) for k, key in enumerate(self.keys)}
        limit = self.section.limit
        found = UncertaintyResult(
            samples=n,
            seed=self.section.seed,
            curves=len(curves),
            marginals=tuple(self.marginals),
            values=values,
            amplitude_m=heights.amplitude,
            frequency_hz=heights.frequency,
            lower_bound=heights.lower_bound,
            branch=heights.branch,
            periodic=heights.periodic,
            missing=int(sum(curve.facts is None for curve in base)),
            incomplete=int(heights.incomplete.sum()),
            unresolved=int(heights.unresolved.sum()),
            levels=levels,
            amplitude=_spread(heights.amplitude, levels, heights.lower_bound),
            frequency=_spread(heights.frequency, levels),
            convergence=_convergence(heights),
            limit_m=limit,
            exceedance=None if limit is None else exceedance(heights.amplitude, limit, heights.lower_bound),
            centre=self._centre(centre),
            first_order=linear if isinstance(linear, FirstOrder) else None,
            residual=self._residual(centre),
            polynomial=self._polynomial(heights.amplitude),
            frequency_polynomial=self._polynomial(heights.frequency),
            sobol=self._sobol(heights.amplitude, curves[n + 1 :]),
            message="",
            remarks=(),
            at_end=int(heights.at_end.sum()),
            truncation_error=heights.truncation_error,
            correlation=self.section.correlation,
        )
        said = remarks_on(found, "" if isinstance(linear, FirstOrder) else linear, self.mixes)
        return replace(found, message=headline(found), remarks=said)

    def _polynomial(self, values: Array) -> PolynomialChaos | None:
        """The polynomial through samples of a quantity; None of correlated parameters, which it does not know."""
        if self.section.correlation:
            return None
        return polynomial_chaos(self.marginals, self.first, values, self.section.seed)

    def _curves(self) -> list[CurveResult]:
        """The curves at the centre, of all samples, and those of the sensitivities."""
        rows = [("centre", np.array([marginal.centre for marginal in self.marginals]))]
        rows += [(str(number), row) for number, row in enumerate(self.first)]
        if self.mixes:
            rows += [(f"{number} of B", row) for number, row in enumerate(self.second)]
            for k, key in enumerate(self.keys):
                mixed = mixed_values(self.first, self.second, k)
                rows += [(f"{number} of A with {key} of B", row) for number, row in enumerate(mixed)]
        return self.context.curves([self._member(name, row) for name, row in rows])

    def _member(self, name: str, values: Array, **others: Any) -> Member:
        """The scene with some values of the parameters; it differs from all others by a word alone."""
        scene = self.context.scene
        at = dict(zip(self.keys, values.tolist(), strict=True))
        given: dict[str, Any] = {}
        for field in self.fields:
            given[field.key] = field.values([at.pop(each.key) for each in field.coordinates])
        given |= {key: as_in_scene(scene, key, value) for key, value in at.items()}
        if scene.response.residual_tractions == "bounds":  # 5 to 20 times the time of a curve: at the centre alone
            given[RESIDUAL] = "projected"
        return replace(self.context.member({**given, **others}, PLACE), parameters={SAMPLE: name})

    def _centre(self, curve: CurveResult) -> Centre | None:
        heights = _heights([curve])
        if not math.isfinite(heights.amplitude[0]):
            return None
        values = {marginal.key: marginal.centre for marginal in self.marginals}
        motion = "periodic" if heights.periodic[0] else "quasi-periodic"
        found = float(heights.amplitude[0]), float(heights.frequency[0])
        return Centre(values, *found, int(heights.branch[0]), motion)

    def _first_order(self, curve: CurveResult, levels: Sequence[float]) -> FirstOrder | str:
        """The linear answer, or why there is none."""
        facts = curve.facts
        if facts is None or not math.isfinite(facts.worst_amplitude_m):
            return "no worst motion is known at the centre of the distributions"
        if facts.worst_motion != "periodic" or facts.worst_branch < 0:
            return f"the worst motion at the centre is {facts.worst_motion}, on no branch that was followed"
        try:
            rates = self._rates(curve)
        except ArithmeticError as error:
            return reason_of(error)
        if rates is None:
            return "the worst motion at the centre is no peak: it stands at the end of stable motion or of the range"
        missing = [key for key in self.keys if key not in rates]
        if missing:
            modes = {each.key for field in self.fields for each in field.coordinates}
            zero = [each.key for each in self.marginals if each.centre == 0.0 and each.key not in modes]
            return _without_derivative(missing, zero)
        peak = facts.worst_amplitude_m, facts.worst_frequency_hz
        return first_order(self.marginals, peak, rates, levels, self.section.seed, self.section.correlation)

    def _rates(self, curve: CurveResult) -> dict[str, tuple[float, float]] | None:
        """Derivatives of amplitude and frequency of the worst motion of a curve, per unit of each key."""
        from nonlinear.peak_curves.peak_sensitivity import peak_sensitivity
        from pipeline.stages.curve.curve_file import read_curve
        from pipeline.stages.scene_to_solver import nonlinear_problem
        from rom.files.reduced_model_file import read_reduced_model
        from rom.linear_algebra.threads import one_blas_thread

        facts, scene = curve.facts, curve.member.scene
        assert facts is not None
        assert curve.file is not None
        assert curve.rom is not None
        with one_blas_thread():
            response, model = read_curve(curve.file), read_reduced_model(curve.rom, with_basis=False)
            branch = (response, *response.detached)[facts.worst_branch]
            if not any(peak.located and peak.index == facts.worst_index for peak in branch.peaks):
                return None
            nodes, known = model.n_contacts / len(model.interfaces), solver_keys(scene)
            names = [known[key] for key in self.keys if key in known]
            found = peak_sensitivity(nonlinear_problem(scene, model), branch, facts.worst_index, names)
        if found is None:
            return None
        factors = {m.key: m.centre if m.key == DAMPING else per_unit(m.key, scene, nodes) for m in self.marginals}
        return {
            key: (found.amplitude[known[key]] / factor, found.frequency[known[key]] / factor)
            for key, factor in factors.items()
            if known.get(key) in found.amplitude and known.get(key) in found.frequency
        }

    def _residual(self, curve: CurveResult) -> ResidualBand | None:
        """The bounds over residual tractions at the centre, from a curve of its own."""
        if curve.facts is None or curve.facts.free_nodes < 1 or not _takes_bounds(curve.member.scene):
            return None
        values = np.array([marginal.centre for marginal in self.marginals])
        bounds = {RESIDUAL: "bounds"}
        (bounded,) = self.context.curves([self._member("residual tractions", values, **bounds)])
        facts = bounded.facts
        if facts is None or not math.isfinite(facts.residual_lowest_m + facts.residual_highest_m):
            return None
        lowest, highest = facts.residual_lowest_m, facts.residual_highest_m
        return ResidualBand(lowest, facts.residual_lowest_hz, highest, facts.residual_highest_hz)

    def _sobol(self, base: Array, curves: Sequence[CurveResult]) -> tuple[SobolIndex, ...]:
        """Sobol indices of the worst amplitude, from the samples of which all curves are there."""
        if not self.mixes:
            return ()
        others = _heights(curves).amplitude.reshape(len(self.keys) + 1, -1)
        every = np.vstack([base, others])
        every = every[:, np.isfinite(every).all(axis=0)]
        if every.shape[1] < 2 * REPLICATES or np.ptp(every) <= 1e-12 * every.max():
            return ()
        return sobol_indices(self.keys, every[0], every[1], every[2:], self.section.seed)


def _without_derivative(missing: Sequence[str], zero: Sequence[str]) -> str:
    """Why there is no first-order answer: keys without a derivative, those among them whose centre is `zero`."""
    there = [key for key in missing if key in zero]
    why = f" ({', '.join(there)} is 0 there)" if there else ""
    return f"the derivative with respect to {', '.join(missing)} is not available at the centre{why}"


def _takes_bounds(scene: Scene) -> bool:
    """Whether the method of a scene knows bounds over residual tractions."""
    return scene.response.method == "coupled"


def _heights(curves: Sequence[CurveResult]) -> _Heights:
    """The worst motion of each curve; the peak of the main branch, as a lower bound, where none is known."""
    facts = [curve.facts for curve in curves]
    worst = np.array([math.nan if f is None else f.worst_amplitude_m for f in facts])
    peak = np.array([math.nan if f is None else f.peak_amplitude_m for f in facts])
    at = [math.nan if f is None else (f.worst_frequency_hz, f.peak_frequency_hz) for f in facts]
    frequency = [
        pair if isinstance(pair, float) else pair[not math.isfinite(w)] for pair, w in zip(at, worst, strict=True)
    ]
    return _Heights(
        amplitude=np.where(np.isfinite(worst), worst, peak),
        frequency=np.array(frequency),
        branch=np.array([-1 if f is None else f.worst_branch for f in facts], dtype=np.int64),
        periodic=np.array([f is not None and f.worst_motion == "periodic" for f in facts], dtype=bool),
        incomplete=np.array([f is not None and not f.complete for f in facts], dtype=bool),
        unresolved=np.array(
            [f is not None and (bool(f.worst_unresolved) or not math.isfinite(f.worst_amplitude_m)) for f in facts],
            dtype=bool,
        ),
        at_end=np.array([f is not None and f.at_end for f in facts], dtype=bool),
        truncation_error=np.array([math.nan if f is None else number_error(f) for f in facts]),
    )


def _spread(values: Array, levels: Sequence[float], open_above: NDArray[np.bool_] | None = None) -> Spread:
    known = values[np.isfinite(values)]
    quantiles = tuple(quantile(values, level, open_above) for level in levels)
    return Spread(float(known.mean()), float(known.std(ddof=1)), quantiles)


def _convergence(heights: _Heights) -> tuple[Convergence, ...]:
    """Quantiles from the first samples, where these are two of each scrambling or more."""
    rows = []
    for part in CONVERGENCE:
        count = len(heights.amplitude) // part
        values, frequency, open_above = (
            heights.amplitude[:count],
            heights.frequency[:count],
            heights.lower_bound[:count],
        )
        if count < 2 * REPLICATES or np.isfinite(values).sum() < 2 * REPLICATES:
            continue
        amplitudes: tuple[Estimate, ...] = tuple(quantile(values, level, open_above) for level in LEVELS)
        rows.append(Convergence(count, amplitudes, tuple(quantile(frequency, level) for level in LEVELS)))
    return tuple(rows)
