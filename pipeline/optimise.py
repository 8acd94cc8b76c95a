"""`shroud optimise`: the optimum of a scene over keys of the command line; only its file and figure are written.

A key of the command line without a range, `--over KEY`, gets one from the scene. Interference and preload get static
ranges, from contacts that never touch to contacts that always stick, by linear responses over the frequency range.
With a wide gap the faces of neighbours approach each other by at most max abs(d_n): a larger gap changes nothing.
With a deep interference all nodes stick as long as mu (kn v0 - abs(N1)) >= abs(T1), with the amplitudes T1 and N1 of
the contact forces: a deeper one changes nothing.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast, get_args

import numpy as np

from pipeline.errors import InputError, input_error, shown
from pipeline.figures.figure_stage import study_figures
from pipeline.process.progress import Reporter
from pipeline.results.publishing import PicturesMissing
from pipeline.run import solved_members
from pipeline.scene.reading import SceneFile, given_scene
from pipeline.scene.sweep import SWEPT_KEYS, as_in_scene, key_value
from pipeline.scene.validation_errors import meant
from pipeline.stages.curve.curve_file import read_curve
from pipeline.stages.request import Request
from pipeline.stages.scene_to_solver import contact_on_model
from pipeline.studies.optimum.checks import OPTIMISED_KEYS, PLACE, unfit_optimum_keys
from pipeline.studies.optimum.section import MOST_KEYS, Objective, Optimum, Range
from pipeline.studies.registry import study_named
from pipeline.studies.study import StudyContext, StudyError
from pipeline.studies.study_stage import studied

if TYPE_CHECKING:
    from nonlinear import ResponseCurve
    from pipeline.stages.curve.respond import CurveResult


COMMAND, OPTION = "shroud", "--over"
WRITTEN = "KEY=LOW:HIGH with numbers, LOW below HIGH, or KEY"
STATIC = ("contact.interference", "contact.preload")  # their ranges come from linear responses
DECADE = (
    "contact.normal_stiffness",
    "contact.tangential_stiffness",
    "excitation.force",
    "response.damping_ratio",
    "material.young_modulus",
)
FIXED = {"contact.friction": (0.05, 1.0)}
MOST_DAMPING = 0.99
SHARE = 0.2  # of the value, on each side, for all other keys
APART = -1e3  # interference of contacts that never touch, m
PRESSED = 1e7  # preload of contacts that always stick, by the force of the excitation
LEAST_PRELOAD = 0.01  # of that at which all nodes stick
OVER = "--over"  # how messages name it
STUDY = "optimum"


def asked_ranges(options: Sequence[str]) -> dict[str, Range | None]:
    """The keys of the options with their ranges; None where the range is left to the program."""
    found: dict[str, Range | None] = {}
    for text in options:
        key, given, limits = text.partition("=")
        key = key.strip()
        if key not in OPTIMISED_KEYS:
            raise _error(key, "not a design parameter" if key in SWEPT_KEYS else _unknown(key))
        if key in found:
            raise _error(key, "given twice", "each key once")
        found[key] = _limits(text, limits) if given else None
    if len(found) > MOST_KEYS:
        raise input_error(COMMAND, OPTION, f"{len(found)} keys", f"{MOST_KEYS} at most")
    return found


def check_ranges(file: SceneFile, given_model: bool) -> None:
    """Refuse ranges of the command line that do not fit the scene."""
    for error in unfit_optimum_keys(file, given_model):
        raise _of_command_line(error)


def default_range(file: SceneFile, key: str, now: float | None, static: Range | None) -> Range:
    """The range of a key that was given none."""
    swept = [key_value(member.scene, key) for member in file.members] if key in file.swept else []
    values = [value for value in swept if value is not None]
    if len(set(values)) > 1:
        return min(values), max(values)
    if key in FIXED:
        return FIXED[key]
    if key in STATIC and static is not None:
        return static
    if not now:
        raise _error(key, "no range, and the scene's value tells none", WRITTEN)
    if key in DECADE:
        high = 10.0 * now
        return 0.1 * now, min(high, MOST_DAMPING) if key == "response.damping_ratio" else high
    highest = 180.0 if key == "shroud.angle" else math.inf
    low, high = sorted(((1.0 - SHARE) * now, (1.0 + SHARE) * now))
    return low, min(high, highest)


def with_ranges(file: SceneFile, ranges: dict[str, Range], objective: Objective = "displacement") -> SceneFile:
    """The scene with the section [optimum] over these ranges."""
    optimum = Optimum(over=dict(ranges), objective=objective)
    changed = [replace(m, scene=m.scene.model_copy(update={"optimum": optimum})) for m in file.members]
    return replace(file, members=tuple(changed))


def _limits(text: str, limits: str) -> Range:
    try:
        low, high = (float(part) for part in limits.split(":"))
    except ValueError:
        raise input_error(COMMAND, OPTION, shown(text), WRITTEN) from None
    if not (math.isfinite(low) and math.isfinite(high) and low < high):
        raise input_error(COMMAND, OPTION, shown(text), WRITTEN)
    return low, high


def _unknown(key: str) -> str:
    near = meant(key, OPTIMISED_KEYS, "")
    return f"unknown key, did you mean {near}?" if near else "unknown key"


def _error(key: str, found: str, allowed: str = "") -> InputError:
    return input_error(COMMAND, f"{OPTION} {key}", found, allowed or ", ".join(OPTIMISED_KEYS))


def _of_command_line(error: InputError) -> InputError:
    """An error of [optimum] in the words of the command line."""
    said = str(error).removeprefix(f"{error.source}: ").removeprefix(f"{error.key}: ")
    key = error.key.removeprefix(f"{PLACE}.").strip('"')
    changed = InputError(f"{COMMAND}: {OPTION} {key}: {said}")
    changed.source, changed.key = COMMAND, f"{OPTION} {key}"
    return changed


_QUICK: dict[str, Any] = {  # what the linear responses do without
    "response.detached": False,
    "response.truncation": False,
    "response.time_integration": False,
    "response.stability": "folds",
    "response.residual_tractions": "projected",
}


def static_ranges(context: StudyContext) -> dict[str, Range]:
    """The ranges of `contact.interference`, m, and `contact.preload`, N, in which the contacts are not linear.

    The range of a key that does nothing, as of the interference without a normal stiffness, is left out.
    """
    from rom import read_reduced_model

    scene = context.scene
    contact = contact_on_model(scene, read_reduced_model(context.model.rom, with_basis=False))
    apart = _linear(context, {"contact.preload": 0.0, "contact.interference": APART})
    stuck = _linear(context, {"contact.preload": PRESSED * scene.excitation.force})
    rates = np.abs(stuck.contact_force[:, 1:]).sum(axis=1)  # (P, n_c, 3), amplitudes of the forces
    friction = np.maximum(contact.friction, np.finfo(float).tiny)
    sliders = np.hypot(rates[..., 0], rates[..., 1]) / friction
    needed = (np.where(contact.friction > 0.0, sliders, 0.0) + rates[..., 2]).max(axis=0)
    found = {}
    if np.all(contact.normal_stiffness > 0.0):
        gap = float(np.abs(apart.relative_displacement[:, 1:, :, 2]).sum(axis=1).max())
        found["contact.interference"] = (-gap, float((needed / contact.normal_stiffness).max()))
    found["contact.preload"] = (LEAST_PRELOAD * float(needed.max()), float(needed.max()))
    return {key: limits for key, limits in found.items() if limits[1] > limits[0]}


def _linear(context: StudyContext, closure: Mapping[str, float]) -> ResponseCurve:
    """The response with this interference and preload, and as few harmonics as the excitation has."""
    given = {key: as_in_scene(context.scene, key, value) for key, value in closure.items()}
    member = context.member(
        {**_QUICK, "response.harmonics": context.scene.excitation.highest_harmonic, **given}, OVER
    )
    found: CurveResult = context.curves([replace(member, parameters=given)])[0]
    if found.file is None:
        raise StudyError(found.reason)
    return read_curve(found.file)


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
