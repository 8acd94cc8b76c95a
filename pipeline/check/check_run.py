"""The command `shroud check`: curves from the store or solved, the check, its figure and its files in OUT/check."""

from __future__ import annotations

import re
from collections.abc import Sequence
from concurrent.futures import Future
from dataclasses import dataclass, replace
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING, Any

import numpy as np

from pipeline.check.check_point import (
    Check,
    CheckedPoint,
    WorstCheck,
    answer_lines,
    check_point,
    check_worst,
    is_open,
    printed,
    refuse,
    refuse_curve,
    verdict,
    worst_lines,
    worst_values,
)
from pipeline.errors import reason_of
from pipeline.executor.task import TaskFailed, TaskResult
from pipeline.figures.figure_stage import look_of
from pipeline.figures.style import ordered_colours, save, scale, styled, subplots, write_heading
from pipeline.process.progress import Reporter
from pipeline.process.workers import WorkerDied
from pipeline.results.outputs import as_json
from pipeline.run import solved_curves
from pipeline.scene.labels import member_label
from pipeline.stages.curve.curve_file import CURVE
from pipeline.stages.curve.respond import CurveJob, CurveResult, curve_task, result_from_file
from pipeline.stages.curve.sweep_curves import with_search
from pipeline.stages.request import Request, Run
from pipeline.stages.worker_start import prepare_workers

if TYPE_CHECKING:
    from matplotlib.figure import Figure


CHARACTERS = 90  # in a line below the axis
MOST_NAMED = 8  # blades with a name in the legend
HEADROOM = 1.12  # a motion that is kept stays clear of the frame


def envelope_figure(check: Check, title: str) -> Figure:
    """Largest displacement of each period and blade, and the amplitude of the solution that the ring started from."""
    motion, stored = check.motion, check.checked.amplitude_m
    figure, axes = subplots(size=(8.4, 4.2))
    others = [each.amplitude_m for n, each in enumerate(check.solutions, 1) if n != check.point.solution]
    factor, unit = scale(np.append(motion.envelope_m.max(axis=1), stored), "m")
    periods = np.arange(1, len(motion.envelope_m) + 1)
    for blade, colour in enumerate(ordered_colours(motion.n_blades)):
        name = f"{'' if motion.n_blades <= MOST_NAMED else '_'}blade {blade + 1}"
        axes.plot(periods, motion.envelope_m[:, blade] * factor, color=colour, linewidth=0.9, label=name)
    solution: dict[str, Any] = {"color": "0.75", "linewidth": 4.0, "zorder": 1.5}  # wide, behind: both are seen
    axes.axhline(stored * factor, label="amplitude of the solution", **solution)
    for number, amplitude in enumerate(others):
        label = f"{'_' * (number > 0)}other solutions"
        axes.axhline(amplitude * factor, color="0.6", linestyle=(0, (1, 1.5)), linewidth=1.0, label=label)
    write_heading(axes, title)
    said = fill(re.sub(r"(\d) (?=[nµm]?m\b)", "\\1\u00a0", verdict(check)), CHARACTERS, break_on_hyphens=False)
    axes.set(xlabel=f"period\n{said}", ylabel=f"largest displacement of a period [{unit}]")
    axes.set_xlim(0, len(periods))
    axes.set_ylim(0.0, HEADROOM * factor * max(stored, *others, float(motion.envelope_m.max())) or 1.0)
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize=9)
    return figure


FOLDER = "check"
THOROUGH, SEARCHED = "thorough", "thorough-search"  # the search, and the kind of its results in the store


@dataclass(frozen=True)
class CheckOutcome:
    """What a check prints: lines of text, values for JSON, and problems of the run, one line each."""

    lines: list[str]
    values: dict[str, Any]
    problems: list[str]


def run_check(request: Request, point: CheckedPoint, reporter: Reporter) -> CheckOutcome:
    """Check one motion of a scene, computing what is missing of its results."""
    refuse(request, point)
    with solved_curves(request, reporter) as (run, outcome):
        curve = outcome.curves[point.curve]
        with reporter.working("integrating the ring in time"):
            check = check_point(point, curve, _label(curve))
        files = _written(run, check)
    values = printed(check) | {"files": [path.relative_to(request.out).as_posix() for path in files]}
    return CheckOutcome([*answer_lines(check), f"{files[0]}"], values, outcome.problems)


def run_worst_checks(request: Request, only: int | None, reporter: Reporter) -> CheckOutcome:
    """Check the worst motions of all curves of a scene, or of one."""
    numbers = range(len(request.scene.members)) if only is None else [only]
    for number in numbers:
        refuse_curve(request, number)
    lines, checked, files = list[str](), [], list[str]()
    with solved_curves(request, reporter) as (run, outcome):
        curves = [outcome.curves[number] for number in numbers]
        left_open = _left_open(run, curves)
        for number, curve in zip(numbers, curves, strict=True):
            found = left_open.get(number)
            if found is None:
                with reporter.working(f"checking the worst motion of curve {number}"):
                    found = check_worst(number, curve, _label(curve))
            lines += worst_lines(found)
            checked.append(worst_values(found))
            if found.check is not None:
                files += [path.relative_to(request.out).as_posix() for path in _written(run, found.check)]
    return CheckOutcome(lines, {"curves": checked, "files": files}, outcome.problems)


def _label(curve: CurveResult) -> str:
    return member_label(curve.member) if curve.member.parameters else ""


def _left_open(run: Run, curves: Sequence[CurveResult]) -> dict[int, WorstCheck]:
    """Worst motions that were left open, with those of thorough searches, by the numbers of their curves."""
    found, jobs = dict[int, WorstCheck](), list[CurveJob]()
    for curve in curves:
        worst = None if curve.facts is None else curve.facts.worst
        scene, number = curve.member.scene, curve.member.index
        if worst is None or curve.file is None or curve.rom is None or not is_open(worst):
            continue
        found[number] = WorstCheck(number, _label(curve), worst)
        if scene.response.search == THOROUGH:
            reason = f"the search was thorough, and left open: {worst.unresolved}"
            found[number] = replace(found[number], reason=reason)
        else:
            member = replace(curve.member, scene=with_search(scene, THOROUGH))
            jobs.append(CurveJob(member, curve.file.parent.name, curve.rom, base=curve.file))
    for number, result in _searched(run, jobs).items():
        longer = None if result.facts is None else result.facts.worst
        found[number] = replace(found[number], longer=longer, reason="" if longer else result.reason)
    return found


def _searched(run: Run, jobs: Sequence[CurveJob]) -> dict[int, CurveResult]:
    """The curves with longer searches, found in the store or computed, by their numbers."""
    found, tasks = dict[int, CurveResult](), dict[Future[TaskResult], CurveJob]()
    for item in jobs:
        if entry := run.store.find(SEARCHED, item.key):
            found[item.member.index] = result_from_file(item, entry.file(CURVE))
    missing = [item for item in jobs if item.member.index not in found]
    if not missing:
        return found
    prepare_workers(run, [item.member.scene for item in missing])
    with run.reporter.counting("thorough searches", len(missing), run.executor.count) as counter:
        for item in missing:
            tasks[run.executor.submit(curve_task(run.store, item))] = item
        for future in run.executor.completed(counter.within):
            item = tasks.pop(future)
            try:
                result = future.result()
                entry = run.store.keep(SEARCHED, item.key, result.folder, result.seconds)
                found[item.member.index] = result_from_file(item, entry.file(CURVE), ran=True)
                said = f"{result.seconds:.0f} s"
            except (TaskFailed, WorkerDied) as error:
                said = reason_of(error)
                found[item.member.index] = CurveResult(item.member, item.rom, None, None, said, ran=True)
            counter.done(f"{member_label(item.member)}: {said}")
    return found


def _written(run: Run, check: Check) -> list[Path]:
    """Write the picture and the values, replaced together."""
    point, first, out = check.point, run.request.scene.first, run.request.out
    name = f"curve_{point.curve}_{point.frequency_hz:.10g}_Hz_solution_{point.solution}"
    options = f" --curve {point.curve} --frequency {point.frequency_hz:.10g} --solution {point.solution}"
    if point.branch is not None:
        name, options = f"{name}_branch_{point.branch}", f"{options} --branch {point.branch}"
    heading = f"{first.title or first.name}: curve {point.curve}{f', {check.label}' if check.label else ''}"
    targets = [out / FOLDER / f"{name}.{suffix}" for suffix in ("png", "svg", "csv", "json")]
    redraw = look_of(run, "check", options).redraw
    with run.store.replacing(*targets) as paths:
        with styled():
            figure = envelope_figure(check, f"{heading}, {point.frequency_hz:.6g} Hz")
            save(figure, paths[0].parent, name, ("png", "svg"), redraw)
        paths[3].write_text(as_json(printed(check)) + "\n", encoding="utf-8")
    return targets
