"""The study `run_up`: envelopes of the ring in sweeps of the excitation, beside the steady curve."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from pipeline.process.progress import duration, seconds_since, time_left
from pipeline.results.worst import with_unit
from pipeline.scene.labels import member_label
from pipeline.stages.curve.curve_file import read_curve
from pipeline.stages.scene_to_solver import nonlinear_problem
from pipeline.studies.run_up.result import CurveRunUps, Numbers, RunUpResult, SweepFacts
from pipeline.studies.study import StudyError

if TYPE_CHECKING:
    from nonlinear.time_integration.ring import Ring
    from nonlinear.time_integration.run_up import RunUp
    from nonlinear.time_integration.tip_timing import TipTiming
    from pipeline.scene.schema import Scene
    from pipeline.stages.curve.respond import CurveResult
    from pipeline.studies.study import SolvedCurve, StudyContext

MOST_POINTS = 2000  # of a stored envelope
PAUSE = 5.0  # s between two lines of progress
NOTHING = np.empty(0)
TABLE_HEAD = "curve,rate_hz_per_s,revolution,probe,blade,time_s,speed_rpm,displacement_m\n"


class RunUpStudy:
    """Sweeps of the curves of a scene, as `Study`."""

    name = "run_up"
    result = RunUpResult

    def __init__(self) -> None:
        self.passages: list[str] = []  # of tips at probes, as rows of the table

    def key(self, context: StudyContext) -> Mapping[str, Any]:
        """The curves that it is about: each file is named after all that the curve depends on."""
        return {"curves": [[number, file.parent.name] for number, _, file, _ in _curves(context)]}

    def compute(self, context: StudyContext) -> RunUpResult:
        """The sweeps of one curve after another."""
        curves = [_sweeps(context, self.passages, *curve) for curve in _curves(context)]
        if not curves:
            raise StudyError("there is no curve with points beside which a sweep could be shown")
        return RunUpResult(tuple(curves))

    def table(self, result: RunUpResult) -> str:
        """The passages, which the result only counts."""
        return TABLE_HEAD + "".join(self.passages) if self.passages else ""

    def lines(self, result: RunUpResult) -> Sequence[str]:
        """Peaks of the sweeps over the steady ones."""
        return [f"run-up, {sweep_said(curve, sweep)}" for curve in result.curves for sweep in curve.sweeps]


def _curves(context: StudyContext) -> Iterator[SolvedCurve]:
    """The curves asked for."""
    section = context.scene.run_up
    assert section is not None  # the study is asked for
    return context.solved_curves(section.curves)


def _sweeps(
    context: StudyContext, rows: list[str], number: int, result: CurveResult, file: Path, rom: Path
) -> CurveRunUps:
    """All sweeps of one curve."""
    from nonlinear.time_integration.ring import Ring
    from nonlinear.time_integration.ring_integrator import with_more_harmonics
    from nonlinear.time_integration.run_up import half_bandwidth
    from nonlinear.worst_motion.ring_integration import Solution
    from rom.files.reduced_model_file import read_reduced_model

    section, scene, branch = context.scene.run_up, result.member.scene, read_curve(file)
    assert section is not None  # the study is asked for
    modal, contact, excited, options = nonlinear_problem(scene, read_reduced_model(rom, with_basis=False))
    ring = Ring(modal, contact, excited, section.output or options.output)
    heights = branch.amplitude_m if section.output is None else branch.amplitude_of(section.output)
    units = {item.name: item.unit_said for item in scene.output}
    low, high = section.frequency or scene.response.frequency
    steady_hz, steady_m = _highest(branch.frequency_hz, heights, (low, high))
    sweeps = []
    for rate in section.rates_hz(scene.excitation.engine_order):
        for ends in ((low, high), (high, low)):
            if section.direction in ("both", "up" if ends[0] < ends[1] else "down"):
                near = Solution.of(branch, int(np.argmin(np.abs(branch.frequency_hz - ends[0]))))
                start = with_more_harmonics(ring, 2.0 * np.pi * ends[0], near.displacement)
                label = member_label(result.member)
                timing = _timing(scene, ring)
                sweeps.append(_sweep(context, ring, ends, rate, start, (label, timing)))
                if timing is not None:
                    sweeps[-1] = _with_passages(context, rows, sweeps[-1], timing, number)
    curve = CurveRunUps(
        curve=number,
        label=member_label(result.member),
        parameters=dict(result.member.parameters),
        n_blades=ring.blades(0),
        half_bandwidth_hz=half_bandwidth(ring),
        steady_m=steady_m,
        steady_hz=steady_hz,
        branch_hz=branch.frequency_hz,
        branch_m=heights,
        sweeps=tuple(sweeps),
        output=section.output or "",
        unit=units.get(section.output or "", "m"),
    )
    for sweep in curve.sweeps:
        context.progress(f"run-up, {sweep_said(curve, sweep)}, {sweep.seconds:.2f} s")
    return curve


def _highest(frequency_hz: Numbers, amplitude_m: Numbers, ends: tuple[float, float]) -> tuple[float, float]:
    """Frequency and height of the highest point of a branch between two frequencies, crossings included."""
    places = [(float(f), float(a)) for f, a in zip(frequency_hz, amplitude_m, strict=True) if ends[0] <= f <= ends[1]]
    for end in ends:
        share = (end - frequency_hz[:-1]) / np.diff(frequency_hz)
        crossed = np.flatnonzero((share >= 0.0) & (share <= 1.0))
        places += [(end, float(amplitude_m[k] + share[k] * (amplitude_m[k + 1] - amplitude_m[k]))) for k in crossed]
    return max(places, key=lambda place: place[1])


def _sweep(
    context: StudyContext,
    ring: Ring,
    ends: tuple[float, float],
    rate: float,
    displacement: Numbers,
    seen: tuple[str, TipTiming | None],
) -> SweepFacts:
    """One sweep; where it has no result its message says why. `seen`: its curve in words, and what reads its tips."""
    from nonlinear.time_integration.run_up import run_up
    from rom.linear_algebra.threads import one_blas_thread

    start = told = time.perf_counter()
    label, timing = seen
    signed = rate if ends[1] > ends[0] else -rate

    def progress(share: float) -> None:
        nonlocal told
        context.run.reporter.interrupts.check()
        if seconds_since(told) > PAUSE:
            told = time.perf_counter()
            left = duration(time_left(seconds_since(start), round(1e4 * share), 10_000))
            context.progress(f"run-up, {label}: {signed:+.3g} Hz/s, {100.0 * share:.0f} % done; about {left} left")

    try:
        with one_blas_thread():
            observe = {} if timing is None else {"observe": timing}
            sweep = run_up(ring, ends, rate, displacement, progress, **observe)
    except ArithmeticError as error:
        nan, none = math.nan, (NOTHING,) * 5
        return SweepFacts(signed, nan, nan, *none, seconds_since(start), str(error))
    columns = _grouped(sweep)
    return SweepFacts(
        rate_hz_per_s=sweep.rate_hz_per_s,
        peak_m=float(sweep.envelope_m[sweep.peak]),
        peak_hz=float(sweep.frequency_hz[sweep.peak]),
        frequency_hz=columns[0],
        envelope_m=columns[1],
        place_hz=sweep.place_hz,
        open_share=sweep.open_share,
        slip_share=sweep.slip_share,
        seconds=seconds_since(start),
    )


def _timing(scene: Scene, ring: Ring) -> TipTiming | None:
    """What reads the passages of the tips; None without probes."""
    from nonlinear.time_integration.tip_timing import TipTiming

    probes = None if scene.run_up is None else scene.run_up.probes
    if probes is None:
        return None
    n_blades = ring.modal.n_blades or 1
    if probes.blades > n_blades:
        raise StudyError(f"run_up.probes.blades = {probes.blades}: the reduced model has {n_blades}")
    radius = probes.radius
    if radius is None:
        assert scene.blade is not None  # the checks see to it
        radius = scene.blade.hub_radius + scene.blade.length
    return TipTiming(
        angles=np.radians(probes.angles),
        radius=radius,
        engine_order=scene.excitation.engine_order,
        n_blades=n_blades,
        blades=probes.blades,
        speed=scene.load.speed_rpm * np.pi / 30.0,
    )


def _with_passages(
    context: StudyContext, rows: list[str], sweep: SweepFacts, timing: TipTiming, number: int
) -> SweepFacts:
    """The sweep with what the probes read; the passages go to a table."""
    from nonlinear.time_integration.tip_timing import fitted_amplitudes, tells_amplitude

    assert context.scene.run_up is not None
    probes = context.scene.run_up.probes
    assert probes is not None
    passages = timing.passages(probes.resolution, probes.noise, probes.seed)
    columns = zip(
        passages.revolution.tolist(),
        passages.probe.tolist(),
        passages.blade.tolist(),
        passages.time_s.tolist(),
        (passages.speed * 30.0 / np.pi).tolist(),
        passages.displacement_m.tolist(),
        strict=True,
    )
    head = f"{number},{sweep.rate_hz_per_s:.6g}"
    rows += (
        f"{head},{turn},{probe},{blade},{when:.12g},{speed:.9g},{moved:.6g}\n"
        for turn, probe, blade, when, speed, moved in columns
    )
    if not (timing.engine_order and tells_amplitude(timing.angles, timing.engine_order)):
        return replace(sweep, passages=len(passages.time_s))
    read_hz, read_m = fitted_amplitudes(passages, timing.angles, timing.engine_order)
    return replace(sweep, passages=len(passages.time_s), read_hz=read_hz, read_m=read_m)


def _grouped(sweep: RunUp) -> tuple[Numbers, Numbers]:
    """Mean frequencies of groups of periods, and the largest displacement in each."""
    edges = np.unique(np.linspace(0, len(sweep.time_s), min(MOST_POINTS, len(sweep.time_s)) + 1).astype(int))
    mean = np.add.reduceat(sweep.frequency_hz, edges[:-1]) / np.diff(edges)
    return mean, np.maximum.reduceat(sweep.envelope_m, edges[:-1])


def sweep_said(curve: CurveRunUps, sweep: SweepFacts) -> str:
    """A sweep in one line."""
    label = f"{curve.label}, {curve.output}" if curve.output else curve.label
    head = f"{label}: {abs(sweep.rate_hz_per_s):.4g} Hz/s {sweep.direction}"
    if sweep.message:
        return f"{head}: no result: {sweep.message}"
    peak, steady = (with_unit(height, curve.unit) for height in (sweep.peak_m, curve.steady_m))
    said = f"{head}: {peak} at {sweep.peak_hz:.5g} Hz, {100.0 * curve.share(sweep):.3g} % of the"
    said = f"{said} steady {steady} at {curve.steady_hz:.5g} Hz"
    if not sweep.passages:
        return said
    if not sweep.read_m.size:
        return f"{said}; {sweep.passages} passages, from which no amplitude follows"
    height, turns = with_unit(float(sweep.read_m.max()), curve.unit), sweep.read_m.size
    return f"{said}; probes tell a vibration of {height} (the highest of {turns} revolution{'s' * (turns > 1)})"
