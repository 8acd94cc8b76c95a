"""The study `flutter`: limit cycles of the waves that the flow feeds, curve by curve of a scene."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from pipeline.process.progress import duration, seconds_since, time_left
from pipeline.results.worst import with_unit
from pipeline.scene.labels import member_label
from pipeline.stages.curve.curve_file import read_curve
from pipeline.stages.model.flutter import stored_flutter
from pipeline.stages.scene_to_solver import nonlinear_problem
from pipeline.studies.flutter.result import CurveFlutter, CycleFacts, FlutterResult, RingInTime, WaveCycles
from pipeline.studies.flutter.section import Flutter
from pipeline.studies.study import StudyError

if TYPE_CHECKING:
    from nonlinear.contact.parameters import ContactParameters
    from nonlinear.nonlinear_modes.limit_cycles import SelfExcitation
    from nonlinear.options import Excitation, SolverOptions
    from pipeline.stages.curve.respond import CurveResult
    from pipeline.studies.study import SolvedCurve, StudyContext
    from rom.cyclic.sector_modes import RingModes

    Problem = tuple[RingModes, ContactParameters, Excitation, SolverOptions]

PAUSE = 5.0  # s between two lines of progress in time
SEEN = 0.05  # amplitude over the largest, from which a wave is told


class FlutterStudy:
    """Limit cycles of the waves of a scene, as `Study`."""

    name = "flutter"
    result = FlutterResult

    def key(self, context: StudyContext) -> Mapping[str, Any]:
        """The curves that it is about: each file is named after all that the curve depends on."""
        return {"curves": [[number, file.parent.name] for number, _, file, _ in _curves(context)]}

    def compute(self, context: StudyContext) -> FlutterResult:
        """The waves of one curve after another."""
        from rom.files.reduced_model_file import read_reduced_model

        section, found = context.scene.flutter, []
        assert section is not None  # the study is asked for
        for number, result, file, rom in _curves(context):
            problem = nonlinear_problem(result.member.scene, read_reduced_model(rom, with_basis=False))
            found.append(_flutter(number, result, read_curve(file).harmonics, problem, context))
            context.progress(f"flutter, {found[-1].label}: {said_of_waves(found[-1])}, {found[-1].seconds:.2f} s")
            if section.periods and number in (section.in_time or (found[0].curve,)):
                ring = _in_time(found[-1], problem, section, context)
                found[-1] = replace(found[-1], ring=ring)
                context.progress(f"flutter in time, {found[-1].label}: {said_in_time(ring)}, {ring.seconds:.2f} s")
        if not found:
            raise StudyError("there is no curve whose waves could be looked at")
        return FlutterResult(section.mode, tuple(found))

    def lines(self, result: FlutterResult) -> Sequence[str]:
        """What becomes of the waves, and of the ring in time."""
        said = [f"flutter, {curve.label}: {said_of_waves(curve)}" for curve in result.curves]
        rings = [(curve.label, curve.ring) for curve in result.curves if curve.ring is not None]
        return said + [f"flutter in time, {label}: {said_in_time(ring)}" for label, ring in rings]


def _curves(context: StudyContext) -> Iterator[SolvedCurve]:
    """The curves asked for."""
    section = context.scene.flutter
    assert section is not None  # the study is asked for
    return context.solved_curves(section.curves)


def _flutter(
    number: int, result: CurveResult, harmonics: int, problem: Problem, context: StudyContext
) -> CurveFlutter:
    """The waves of one curve."""
    from rom.linear_algebra.threads import one_blas_thread

    start, section, (modal, contact, _, options) = time.perf_counter(), context.scene.flutter, problem
    assert section is not None  # the study is asked for
    with one_blas_thread():
        # without the stability of the ring none is known to last
        own = replace(options, harmonics=section.harmonics or harmonics, stability="ring")
        waves = []
        for n in section.nodal_diameters or _fluttering(context, result, section.mode):
            context.run.reporter.interrupts.check()
            waves.append(_wave(modal, contact, n, own, section))
    return CurveFlutter(
        curve=number,
        label=member_label(result.member),
        parameters=dict(result.member.parameters),
        n_blades=modal.n_blades or 1,
        harmonics=own.fixed_harmonics,
        waves=tuple(sorted(waves, key=lambda wave: wave.nodal_diameter)),
        seconds=time.perf_counter() - start,
    )


def _in_time(curve: CurveFlutter, problem: Problem, section: Flutter, context: StudyContext) -> RingInTime:
    """The ring of one curve in time; where it has no result its message says why."""
    from nonlinear.nonlinear_modes.ring_in_flow import ring_in_flow
    from nonlinear.options import OptionsError

    start, (modal, contact, _, options) = time.perf_counter(), problem
    options, told = replace(options, harmonics=curve.harmonics), start

    def progress(done: int) -> None:
        nonlocal told
        context.run.reporter.interrupts.check()
        if seconds_since(told) > PAUSE:
            told = time.perf_counter()
            left = duration(time_left(seconds_since(start), done, section.periods))
            text = f"{done} of {section.periods} periods done; about {left} left, less if the motion settles"
            context.progress(f"flutter in time, {curve.label}: {text}")

    march = partial(ring_in_flow, number=section.mode, disturbance=section.disturbance, progress=progress)
    none = np.empty(0)
    try:
        found = march(modal, contact, options, section.periods)
    except (ArithmeticError, OptionsError) as error:
        return RingInTime("", math.nan, none, none, (), (), none, seconds_since(start), str(error))
    return RingInTime(
        ending=found.ending,
        frequency_hz=found.omega / (2.0 * np.pi),
        periods=found.periods,
        largest_m=found.largest_m,
        nodal_diameter=tuple(found.nodal_diameter.tolist()),
        amplitude_m=tuple(found.amplitude_m.T),
        final_hz=found.frequency_hz,
        seconds=seconds_since(start),
        message="",
    )


def _fluttering(context: StudyContext, result: CurveResult, mode: int) -> list[int]:
    """Nodal diameters of the waves that flutter with free, sliding or stuck contacts."""
    model = context.models[result.member.index]
    assert model is not None  # the curve was solved on it
    found = stored_flutter(context.run.store, model, result.member.scene)
    assert found is not None  # there is a flow
    rows = [state.damping_ratio[mode - 1] for state in found.states if mode <= len(state.damping_ratio)]
    return [n for place, n in enumerate(found.nodal_diameter) if any(row[place] < 0.0 for row in rows)]


def _wave(
    modal: RingModes, contact: ContactParameters, n: int, options: SolverOptions, section: Flutter
) -> WaveCycles:
    """One wave; where it has no result its message says why."""
    from nonlinear.nonlinear_modes.limit_cycles import self_excitation
    from nonlinear.options import OptionsError

    none = np.empty(0)
    try:
        found = self_excitation(modal, contact, n, options, number=section.mode, reach=section.reach)
    except (ArithmeticError, OptionsError) as error:
        nan = math.nan
        return WaveCycles(n, nan, nan, _free_damping(modal, n, section.mode), nan, none, none, (), "", str(error))
    mode = found.mode
    return WaveCycles(
        nodal_diameter=n,
        frequency_hz=found.frequency_hz,
        damping_ratio=found.damping_ratio,
        free_damping_ratio=_free_damping(modal, n, section.mode),
        linear_limit_m=found.linear_limit_m,
        vibration_m=none if mode is None else mode.vibration_m,
        mode_damping_ratio=none if mode is None else mode.damping_ratio,
        cycles=_facts(found),
        outcome=found.outcome,
        message="" if mode is None or mode.complete else mode.message,
    )


def _facts(found: SelfExcitation) -> tuple[CycleFacts, ...]:
    """The cycles of a wave as records."""
    names = [name for name in CycleFacts.__annotations__ if name != "persists"]
    return tuple(
        CycleFacts(persists=cycle.persists, **{name: getattr(cycle, name) for name in names})
        for cycle in found.cycles
    )


def _free_damping(modal: RingModes, n: int, mode: int) -> float:
    """Damping ratio of a mode with free contacts; NaN without such a mode."""
    own = modal.at(n)
    if mode > own.angular_frequency.size:
        return math.nan
    if own.turns:
        poles = own.turning.poles[own.turning.poles.imag > 0.0]
        pole = poles[np.argsort(poles.imag)[mode - 1]]
        return float(-pole.real / abs(pole))
    stiffness, damping = complex(own.total_stiffness[mode - 1]), complex(own.total_damping[mode - 1])
    half = damping / 2.0
    pole = max(-half + np.sqrt(half**2 - stiffness), -half - np.sqrt(half**2 - stiffness), key=lambda s: s.imag)
    return float(-pole.real / abs(pole))


def said_of_waves(curve: CurveFlutter) -> str:
    """How many waves grow, where they are held, which cycles persist, and from where motions grow for ever."""
    failed = [wave for wave in curve.waves if wave.message and not wave.vibration_m.size]
    known = [wave for wave in curve.waves if wave not in failed]
    growing = [wave for wave in known if wave.damping_ratio < 0.0]
    held = [(wave, wave.held) for wave in growing if wave.held is not None]
    if not known:
        return "no wave flutters" if not failed else f"{len(failed)} waves without a result: {failed[0].message}"
    parts = [f"{len(growing)} of {curve.n_blades} waves grow from rest" if growing else "no wave grows from rest"]
    if held:
        sizes = [cycle.vibration_m for _, cycle in held if cycle is not None]
        lasting = [wave.nodal_diameter for wave, cycle in held if cycle is not None and cycle.persists]
        sized = with_unit(min(sizes)) + (f" to {with_unit(max(sizes))}" if len(sizes) > 1 else "")
        parts.append(f"{len(held)} are held by friction at {sized}")
        parts.append(
            f"lasting in the ring: nodal diameter {_ranges(lasting)}" if lasting else "none lasts in the ring"
        )
    if lost := [wave for wave in growing if wave.held is None]:
        parts.append(f"{len(lost)} grow for ever, nodal diameter {_ranges([w.nodal_diameter for w in lost])}")
    limits = [(wave.threshold.vibration_m, wave.nodal_diameter) for wave in known if wave.threshold is not None]
    if limits:
        least, n = min(limits)
        parts.append(f"beyond {with_unit(least)} (nodal diameter {n}) motions grow for ever")
    if failed:
        parts.append(f"{len(failed)} waves without a result: {failed[0].message}")
    return "; ".join(parts)


def said_in_time(ring: RingInTime) -> str:
    """How the ring ends up, with which waves."""
    if ring.message:
        return f"no result: {ring.message}"
    if ring.ending == "decays":
        return "no wave grows from rest, a small disturbance decays"
    if not ring.periods.size:
        return "a wave grows for ever that contacts do not feel, not integrated"
    after, ends = f"after {ring.periods[-1]:.0f} periods", ring.final_m
    waves = [(n, size) for n, size in ends.items() if size > SEEN * max(ends.values())]
    said = " and ".join(f"nodal diameter {n} at {with_unit(size)}" for n, size in waves[:3])
    if ring.ending == "grows for ever":
        return f"grows for ever, {after} {said}"
    if ring.ending == "one wave":
        return f"settled {after}: {said}, {ring.final_hz[ring.nodal_diameter.index(waves[0][0])]:.5g} Hz"
    several = "several waves at once, " if ring.ending == "several waves" else ""
    state = "settled" if several else "not settled"
    share = f"{100.0 * ring.share:.3g} % of the squares in the first" if len(waves) > 1 else "others below 5 %"
    return f"{state} {after}: {several}{said}, {share}; largest displacement {with_unit(ring.largest_m[-1])}"


def _ranges(numbers: Sequence[int]) -> str:
    """Whole numbers as ranges: 3, 5 to 8."""
    found: list[list[int]] = []
    for number in sorted(numbers):
        if found and number == found[-1][-1] + 1:
            found[-1].append(number)
        else:
            found.append([number])
    return ", ".join(str(each[0]) if len(each) == 1 else f"{each[0]} to {each[-1]}" for each in found)
