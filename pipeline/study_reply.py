"""A study as a command of its own: its result, table and figure in the output folder."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pipeline.codec import restored
from pipeline.errors import input_error
from pipeline.figures.figure_stage import Look, look_of, study_figures
from pipeline.process.interrupts import Stopped
from pipeline.results.publishing import PicturesMissing
from pipeline.run import unsolved_members
from pipeline.scene.labels import value_label
from pipeline.stress.stress_stage import worst_stress
from pipeline.studies.registry import study_named
from pipeline.studies.study import StudyContext, StudyError, TabledStudy
from pipeline.studies.study_stage import remove_study, studied, write_study

if TYPE_CHECKING:
    from pipeline.process.progress import Reporter
    from pipeline.stages.request import Request

CROSSINGS, SPEED, ORDER = "crossings", "load.speed_rpm", "excitation.engine_order"


@dataclass(frozen=True)
class StudyReply:
    """What such a command prints."""

    lines: tuple[str, ...] = ()  # the result in words; empty where there is none
    values: dict[str, Any] = field(default_factory=dict)  # content of its file; empty where there is none
    files: tuple[str, ...] = ()  # files written, by their names in the output folder
    problems: tuple[str, ...] = ()  # what could not be computed, one line each
    stopped: Stopped | None = None  # the signal that ended it before its end
    result: Any = None  # of a study that came to its end

    def text(self, out: Path) -> str:
        """The lines of the result and where its files are."""
        return "\n".join([*self.lines, ", ".join(str(out / name) for name in self.files)])


def reply_of_study(context: StudyContext, name: str, look: Look) -> StudyReply:
    """Find or compute a study of a scene; its file and figure are written."""
    out, outcome = context.run.request.out, context.outcome
    try:
        found = studied(context, study_named(name))
    except StudyError as error:
        remove_study(out, name)
        return StudyReply(problems=(*outcome.problems, f"{name}: {error}"))
    except Stopped as stop:
        return _so_far(context, name, stop)
    problems, pictures = list(outcome.problems), []
    try:
        pictures = study_figures(context.run, {name: found}, look)
    except PicturesMissing as missing:
        problems += missing.problems
    values = json.loads((out / found.file).read_text(encoding="utf-8"))
    shown = [path.relative_to(out).as_posix() for path in pictures]
    return StudyReply(found.lines, values, (*_files(name), *shown), tuple(problems), result=found.result)


def _files(name: str) -> Sequence[str]:
    """The files of the result of a study."""
    return [f"{name}.json", *([f"{name}.csv"] if isinstance(study_named(name), TabledStudy) else [])]


def _so_far(context: StudyContext, name: str, stop: Stopped) -> StudyReply:
    """What a study has found that a signal has ended, in its file as well."""
    if stop.summary is None:
        return StudyReply(stopped=stop)
    run, study = context.run, study_named(name)
    lines = tuple(study.lines(restored(study.result, stop.summary)))
    with run.store.replacing(*(run.request.out / file for file in _files(name))) as paths:
        values = write_study(paths[0], context, study, stop.summary)
    return StudyReply(lines, values, tuple(_files(name)), stopped=stop)


def find_crossings(request: Request, reporter: Reporter) -> StudyReply:
    """The table of resonance crossings of a scene; of a sweep that of its first values. No other curve is solved."""
    file = request.scene
    if file.first.crossings is None:
        raise input_error(
            file.path, CROSSINGS, "missing", "a table [crossings] with speed = [LOW, HIGH] in the scene"
        )
    for key, value in file.members[0].parameters.items():
        if key == SPEED or (key == ORDER and file.first.excitation.order):
            continue  # those of the rows
        reporter.line(f"note: {key} is swept; the crossings are those of its first value, {value_label(key, value)}")
    first = replace(request, scene=replace(file, members=file.members[:1]))
    with unsolved_members(first, reporter) as (run, models, outcome):
        context = StudyContext(run, models, outcome, worst_stress)
        return reply_of_study(context, CROSSINGS, look_of(run, CROSSINGS, ""))
