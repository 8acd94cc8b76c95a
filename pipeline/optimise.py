"""`shroud optimise`: the optimum of a scene over keys of the command line; only its file and figure are written.

A key of the command line without a range, `--over KEY`, gets one from the scene. Interference and preload get static
ranges, from contacts that never touch to contacts that always stick, by linear responses over the frequency range.
With a wide gap the faces of neighbours approach each other by at most max abs(d_n): a larger gap changes nothing.
With a deep interference all nodes stick as long as mu (kn v0 - abs(N1)) >= abs(T1), with the amplitudes T1 and N1 of
the contact forces: a deeper one changes nothing.
"""

from __future__ import annotations

import math
import shlex
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any, cast, get_args

from pipeline.errors import InputError, input_error, shown
from pipeline.figures.figure_stage import look_of
from pipeline.process.interrupts import Stopped
from pipeline.process.progress import Reporter
from pipeline.results.closure import static_ranges
from pipeline.run import solved_members
from pipeline.scene.dotted_keys import of_contact
from pipeline.scene.labels import value_label
from pipeline.scene.plausibility import far_beyond
from pipeline.scene.reading import SceneFile, derived_member, given_scene
from pipeline.scene.schema import has_role, meaning_of
from pipeline.scene.sweep import key_value, swept_keys
from pipeline.scene.validation_errors import meant
from pipeline.stages.curve.curve_file import read_curve
from pipeline.stages.request import Request
from pipeline.stress.stress_stage import worst_stress
from pipeline.studies.optimum.checks import OPTIMISED_KEYS, PLACE, unfit_optimum_keys
from pipeline.studies.optimum.checks import TOLERANCE as TOLERANCE_PLACE
from pipeline.studies.optimum.section import LIFE, MOST_KEYS, Objective, Optimum, Range
from pipeline.studies.study import StudyContext, StudyError
from pipeline.study_reply import StudyReply, reply_of_study

if TYPE_CHECKING:
    from nonlinear.response_curve import ResponseCurve
    from pipeline.stages.curve.respond import CurveResult


COMMAND, OPTION = "shroud", "--over"
WRITTEN = "KEY=LOW:HIGH with numbers, LOW below HIGH, or KEY"
MOST_DAMPING = 0.99
SHARE = 0.2  # of the value, on each side, for all other keys
OVER, TOLERANCE, LIFETIME = "--over", "--tolerance", "--life"  # how messages name them
TOLERANCES = "KEY=NUMBER above 0, uncertainty, or uncertainty=QUANTILE, 0.5 to 0.999"
HALF, QUANTILES = (1e-12, 1e15), (0.5, 0.999)
STUDY = "optimum"


def asked_ranges(options: Sequence[str]) -> dict[str, Range | None]:
    """The keys of the options with their ranges; None where the range is left to the program."""
    found: dict[str, Range | None] = {}
    for text in options:
        key, given, limits = text.partition("=")
        key = key.strip()
        if of_contact(key) not in OPTIMISED_KEYS:
            raise _error(key, "not a design parameter" if key in swept_keys(key) else _unknown(key))
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


def check_units(file: SceneFile, over: Mapping[str, Range | None], half: Mapping[str, float], rom: bool) -> None:
    """Refuse ends of ranges and tolerances that are nonsense in the units of the scene, as um in place of m."""
    values = [(PLACE, key, end) for key, limits in over.items() for end in limits or ()]
    for place, key, value in [*values, *((TOLERANCE_PLACE, key, width) for key, width in half.items())]:
        member = derived_member(file, {key: value}, place, rom)
        for error in far_beyond(replace(file, members=(member,)), {}):
            if error.key == member.key_in_file(key):
                raise _of_command_line(error)


def default_range(file: SceneFile, key: str, now: float | None, static: Range | None) -> Range:
    """The range of a key that was given none."""
    swept = [key_value(member.scene, key) for member in file.members] if key in file.swept else []
    values = [value for value in swept if value is not None]
    if len(set(values)) > 1:
        return min(values), max(values)
    searched = meaning_of(key).searched
    if isinstance(searched, tuple):
        return searched
    if searched == "static" and static is not None:
        return static
    if not now:
        raise _error(key, "no range, and the scene's value tells none", WRITTEN)
    if searched == "decade":
        high = 10.0 * now
        return 0.1 * now, min(high, MOST_DAMPING) if key == "response.damping_ratio" else high
    highest = 180.0 if key == "shroud.angle" else math.inf
    low, high = sorted(((1.0 - SHARE) * now, (1.0 + SHARE) * now))
    return low, min(high, highest)


def asked_tolerances(options: Sequence[str]) -> dict[str, Any]:
    """The options as keys of [optimum]; none without options."""
    half: dict[str, float] = {}
    for text in options:
        key, given, number = (part.strip() for part in text.partition("="))
        if key == "uncertainty":
            if len(options) > 1:
                raise input_error(COMMAND, TOLERANCE, "uncertainty beside other tolerances", "one of the two")
            level = {"quantile": _number(text, number, *QUANTILES)} if given else {}
            return {"tolerance": "uncertainty", **level}
        if key in half:
            raise input_error(COMMAND, f"{TOLERANCE} {key}", "given twice", "each key once")
        half[key] = _number(text, number, *HALF)
    return {"tolerance": half} if half else {}


def asked_life(asked: Asked) -> dict[str, Any]:
    """The life asked for, hours as `20000`, `20000h` or `20000 h`, as keys of [optimum]; none without the option."""
    if asked.life is None:
        return {}
    if asked.objective not in (None, LIFE):
        raise input_error(COMMAND, LIFETIME, f"beside --objective {asked.objective}", "one of the two")
    try:
        hours = float(asked.life.strip().removesuffix("h"))
    except ValueError:
        hours = math.nan
    if not HALF[0] <= hours <= HALF[1]:
        raise input_error(COMMAND, LIFETIME, shown(asked.life), "hours above 0, such as 20000h")
    return {"objective": LIFE, "life": hours}


def _number(text: str, number: str, least: float, most: float) -> float:
    try:
        found = float(number)
    except ValueError:
        found = math.nan
    if not least <= found <= most:
        raise input_error(COMMAND, TOLERANCE, shown(text), TOLERANCES)
    return found


def with_section(file: SceneFile, keys: Mapping[str, Any]) -> SceneFile:
    """The scene with a section [optimum] of these keys."""
    optimum = Optimum(**keys)
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
    option = TOLERANCE if error.key.startswith(TOLERANCE_PLACE) else OPTION
    key = error.key.removeprefix(PLACE).removeprefix(TOLERANCE_PLACE).removeprefix(".").strip('"')
    place = f"{option} {key}".strip()
    changed = InputError(f"{COMMAND}: {place}: {said}")
    changed.source, changed.key = COMMAND, place
    return changed


def _static_ranges(context: StudyContext) -> dict[str, Range]:
    """The static ranges from curves in the store. Their interferences are far beyond the usual on purpose."""
    from rom.files.reduced_model_file import read_reduced_model

    model = read_reduced_model(context.model.rom, with_basis=False)
    forced = replace(context.run, request=replace(context.run.request, force=True))
    return static_ranges(context.scene, model, partial(_linear, replace(context, run=forced)))


def _linear(context: StudyContext, given: Mapping[str, Any]) -> ResponseCurve:
    """The response with other values of some keys."""
    parameters = {key: value for key, value in given.items() if key.partition(".")[0] != "response"}
    member = replace(context.member(given, OVER), parameters=parameters)
    found: CurveResult = context.curves([member])[0]
    if found.file is None:
        raise StudyError(found.reason)
    return read_curve(found.file)


@dataclass(frozen=True)
class Asked:
    """Options of the command."""

    over: Sequence[str] = ()
    tolerance: Sequence[str] = ()
    objective: Objective | None = None
    output: str | None = None
    life: str | None = None

    @property
    def options(self) -> str:
        """The options as on the command line."""
        given = [word for text in self.over for word in (OVER, text)]
        given += [word for text in self.tolerance for word in (TOLERANCE, text)]
        for option, value in (("--objective", self.objective), ("--output", self.output), (LIFETIME, self.life)):
            given += [] if value is None else [option, value]
        return "".join(f" {shlex.quote(word)}" for word in given)


def optimise(request: Request, asked: Asked, reporter: Reporter) -> StudyReply:
    """Find the optimum of a scene, and write optimum.json and its figure."""
    file, ranges, given_model = request.scene, asked_ranges(asked.over), request.rom is not None
    own = file.first.optimum
    if not ranges and own is None:
        allowed = "a table [optimum] in the scene, or --over KEY=LOW:HIGH"
        raise input_error(file.path, STUDY, "missing", allowed)
    keys = {} if own is None else own.model_dump()
    chosen = {"objective": asked.objective, "output": asked.output}
    keys |= (
        asked_life(asked)
        | asked_tolerances(asked.tolerance)
        | {key: value for key, value in chosen.items() if value is not None}
    )
    over: Mapping[str, Range | None] = ranges or (own.ranges if own is not None else {})
    base = _base(file, over, given_model)
    known = {key: limits for key, limits in over.items() if limits}
    unknown = {"over": dict.fromkeys(over, (0.5, 1.0)), "tolerance": {}}  # the keys alone can be checked
    check_ranges(with_section(base, keys | ({"over": known} if known else unknown)), given_model)
    if not request.force:
        check_units(base, over, Optimum(**keys | {"over": dict.fromkeys(over, (0.5, 1.0))}).tolerances, given_model)
    for key in [key for key in file.swept if key not in base.swept]:
        said = value_label(key, file.members[0].parameters[key])
        reporter.line(f"note: {key} is swept; the optimum is compared with its first value, {said}")
    base = replace(base, members=tuple(replace(m, scene=_without_optimum(m.scene)) for m in base.members))
    with solved_members(replace(request, scene=base), reporter) as (run, models, outcome):
        context = StudyContext(run, models, outcome, worst_stress)
        try:
            ranged = with_section(base, {**keys, "over": _ranges(context, file, over)})
            check_ranges(ranged, given_model)
            context = replace(context, run=replace(run, request=replace(run.request, scene=ranged)))
        except StudyError as error:
            return StudyReply(problems=(*outcome.problems, f"{STUDY}: {error}"))
        except Stopped as stop:
            return StudyReply(stopped=stop)
        return reply_of_study(context, STUDY, look_of(run, "optimise", asked.options))


def _base(file: SceneFile, over: Iterable[str], given_model: bool) -> SceneFile:
    """The scene without a sweep but of its load cases, which are not optimised; the first values of all others."""
    if not file.swept:
        return file
    cases = [key for key in file.swept if has_role(key, "condition") and key not in over]
    first = {key: value for key, value in file.members[0].parameters.items() if key not in cases}
    points: list[dict[str, Any]] = []
    for member in file.members:
        point = {key: member.parameters[key] for key in cases}
        if point not in points:
            points.append(point)
    single = given_scene(file, {"sweep": None, **first, **points[0]}, given_model)
    return given_scene(single, {"sweep": {"points": points}}, given_model) if len(points) > 1 else single


def _without_optimum(scene: Any) -> Any:
    return scene.model_copy(update={STUDY: None})


def _ranges(context: StudyContext, file: SceneFile, asked: Mapping[str, Range | None]) -> dict[str, Range]:
    """The ranges asked for, and those of keys that were given none."""
    open_keys = [key for key, limits in asked.items() if limits is None]
    linear = [key for key in open_keys if meaning_of(key).searched == "static" and key not in file.swept]
    static = _static_ranges(context) if linear else {}
    found = {}
    for key, limits in asked.items():
        now = key_value(context.scene, key)
        found[key] = limits or default_range(file, key, now, static.get(key))
        if limits is None:
            low, high = found[key]
            context.run.reporter.line(f"note: {key} from {low:.6g} to {high:.6g}, where nothing else is asked for")
    return found


def objective_asked(text: str | None) -> Objective | None:
    """The objective of the command line."""
    if text is not None and text not in get_args(Objective):
        raise input_error("shroud", "--objective", text, " or ".join(get_args(Objective)))
    return cast("Objective | None", text)
