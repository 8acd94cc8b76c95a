"""`shroud optimise`: the optimum of a scene over keys of the command line; only its file and figure are written."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, cast, get_args

from pipeline.errors import input_error
from pipeline.figures.figure_stage import study_figures
from pipeline.optimise.asked_ranges import STATIC, asked_ranges, check_ranges, default_range, with_ranges
from pipeline.optimise.static_range import static_ranges
from pipeline.process.progress import Reporter
from pipeline.results.publishing import PicturesMissing
from pipeline.run import solved_members
from pipeline.scene.given_in_python import given_scene
from pipeline.scene.key_values import key_value
from pipeline.scene.optimum_section import Objective, Range
from pipeline.scene.reading import SceneFile
from pipeline.stages.request import Request
from pipeline.studies.registry import study_named
from pipeline.studies.study import StudyContext, StudyError
from pipeline.studies.study_stage import studied

STUDY = "optimum"


@dataclass(frozen=True)
class Optimised:
    """What the command prints."""

    lines: tuple[str, ...]  # the optimum in words; empty where there is none
    values: dict[str, Any]  # content of optimum.json; empty where there is none
    files: tuple[str, ...]  # files written, by their names in the output folder
    problems: tuple[str, ...]  # what could not be computed, one line each


def optimise(
    request: Request, over: Sequence[str], reporter: Reporter, objective: Objective | None = None
) -> Optimised:
    """Find the optimum of a scene, and write optimum.json and its figure."""
    file, asked = request.scene, asked_ranges(over)
    if not asked and file.first.optimum is None:
        allowed = "a table [optimum] in the scene, or --over KEY=LOW:HIGH"
        raise input_error(file.path, STUDY, "missing", allowed)
    given_model = request.rom is not None
    base = _base(file, given_model)
    own = file.first.optimum
    if objective is None:
        objective = "displacement" if own is None else own.objective
    elif own is not None and not asked:
        base = with_ranges(base, own.ranges, objective)
    if asked:
        known = {key: limits or (0.5, 1.0) for key, limits in asked.items()}
        check_ranges(with_ranges(base, {key: known[key] for key in asked if asked[key]} or known), given_model)
        base = replace(base, members=tuple(replace(m, scene=_without_optimum(m.scene)) for m in base.members))
    keys = asked or (file.first.optimum.ranges if file.first.optimum else {})
    for key in [key for key in file.swept if key in keys]:
        reporter.line(f"note: {key} is swept; compared with its first value, {file.members[0].parameters[key]:g}")
    with solved_members(replace(request, scene=base), reporter) as (run, models, outcome):
        context = StudyContext(run, models, outcome)
        try:
            if asked:
                ranged = with_ranges(base, _ranges(context, file, asked), objective)
                check_ranges(ranged, given_model)
                context = replace(context, run=replace(run, request=replace(run.request, scene=ranged)))
            found = studied(context, study_named(STUDY))
        except StudyError as error:
            return Optimised((), {}, (), (*outcome.problems, f"{STUDY}: {error}"))
        problems, pictures = list(outcome.problems), []
        try:
            first = base.first
            pictures = study_figures(run, {STUDY: found}, first.title or first.name, first.figures.formats)
        except PicturesMissing as missing:
            problems += missing.problems
        values = json.loads((request.out / found.file).read_text(encoding="utf-8"))
        files = (found.file, *(path.relative_to(request.out).as_posix() for path in pictures))
        return Optimised(found.lines, values, files, tuple(problems))


def _base(file: SceneFile, given_model: bool) -> SceneFile:
    """The scene with the values of its first member, without a sweep."""
    if not file.swept:
        return file
    return given_scene(file, {"sweep": None, **file.members[0].parameters}, given_model)


def _without_optimum(scene: Any) -> Any:
    return scene.model_copy(update={STUDY: None})


def _ranges(context: StudyContext, file: SceneFile, asked: dict[str, Range | None]) -> dict[str, Range]:
    """The ranges asked for, and those of keys that were given none."""
    open_keys = [key for key, limits in asked.items() if limits is None]
    static = static_ranges(context) if set(open_keys) & set(STATIC) - set(file.swept) else {}
    found = {}
    for key, limits in asked.items():
        now = key_value(context.scene, key)
        found[key] = limits or default_range(file, key, now, static.get(key))
        if limits is None:
            low, high = found[key]
            context.run.reporter.line(f"note: {key} from {low:.6g} to {high:.6g}, where nothing else is asked for")
    return found


def optimum_text(found: Optimised, out: Path) -> str:
    """The lines of the optimum and where its files are."""
    names = ", ".join(str(out / name) for name in found.files)
    return "\n".join([*found.lines, names])


def objective_asked(text: str | None) -> Objective | None:
    """The objective of the command line."""
    if text is not None and text not in get_args(Objective):
        raise input_error("shroud", "--objective", text, " or ".join(get_args(Objective)))
    return cast("Objective | None", text)
