"""A run: the stages that the requested outputs need, in their order, and the summary of their results."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from copy import deepcopy
from dataclasses import replace
from pathlib import Path
from signal import SIGINT
from typing import TYPE_CHECKING, Any

from pipeline.errors import InputError, input_error, reason_of
from pipeline.executor.cluster_address import check_cluster
from pipeline.process.interrupts import Stopped
from pipeline.process.isolated_reading import read_given_model
from pipeline.process.progress import Reporter, seconds_since
from pipeline.report.published_page import PAGE, results_fingerprint, retire_page
from pipeline.results.conclusion import ROW, known_of
from pipeline.results.frequency_range import held_said, missing_warnings, stored_resonances
from pipeline.results.outputs import LISTED, curve_summary, write_results, write_summary
from pipeline.results.overview import statistics
from pipeline.results.publishing import PicturesMissing
from pipeline.results.resonances import Resonance
from pipeline.results.run_folder import SUMMARY, TABLE_HASH, provenance
from pipeline.scene.consistency import check_scene, check_scene_for_model, free_bore
from pipeline.scene.plausibility import plausibility_warnings
from pipeline.scene.schema import STUDIES
from pipeline.stages.cache_keys import rotation_of_response
from pipeline.stages.code_fingerprint import remember_code
from pipeline.stages.curve.curve_table import NOT_COMPUTED, table_of
from pipeline.stages.curve.respond import CurveResult
from pipeline.stages.curve.sweep_curves import member_curves, member_models
from pipeline.stages.model.modal_truncation import HELD, stored_truncation_error
from pipeline.stages.model.sweep_models import (
    Models,
    campbell_summary,
    given_model_key,
    model_summaries,
)
from pipeline.stages.request import Request, Run, RunOutcome
from pipeline.stages.scene_to_solver import scene_modes, touching
from pipeline.stages.stage import Stage, StageLog
from pipeline.stages.worker_start import open_executor, start_workers
from pipeline.store.disk_errors import StorageError
from pipeline.store.output_folder import working_store

if TYPE_CHECKING:
    from pipeline.render.render_stage import RenderingAhead
    from pipeline.results.modes import ModelModes
    from pipeline.scene.reading import Member
    from rom.cyclic.reduced_model import ReducedModel

    Drawn = Callable[[Run, Models, RunOutcome], list[Path]]

INTERRUPTED, GOES_ON = "interrupted", "the same command goes on from there"
UNFINISHED = f"the run has not come to its end; {GOES_ON}"


def execute(request: Request, reporter: Reporter) -> RunOutcome:
    """Run what is asked for and write it into the output folder."""
    start = time.perf_counter()
    remember_code()
    given = _check(request)
    for line in request.scene.notes:
        reporter.line(f"note: {line}")
    for line in plausibility_warnings(request.scene):
        reporter.line(f"warning: {line}")
    for line in _nothing_to_do(request):
        reporter.line(f"note: {line}")
    with _running(request, reporter, given) as run:
        return _execute(run, given, start)


@contextmanager
def solved_curves(request: Request, reporter: Reporter) -> Iterator[tuple[Run, RunOutcome]]:
    """The curves of a scene, found in the store or solved; nothing but the store is written.

    The output folder stays locked within the block.
    """
    with solved_members(request, reporter) as (run, _, outcome):
        yield run, outcome


@contextmanager
def solved_members(request: Request, reporter: Reporter) -> Iterator[tuple[Run, Models, RunOutcome]]:
    """The reduced models and the curves of a scene, as `solved_curves`."""
    with built_models(request, reporter) as (run, models, outcome):
        _respond(run, models, outcome)
        yield run, models, outcome


@contextmanager
def built_models(request: Request, reporter: Reporter) -> Iterator[tuple[Run, Models, RunOutcome]]:
    """The reduced models of a scene, as `solved_curves`."""
    with _begun(request, reporter) as (run, given):
        outcome = RunOutcome()
        yield run, member_models(run, outcome, given), outcome


@contextmanager
def unsolved_members(request: Request, reporter: Reporter) -> Iterator[tuple[Run, Models, RunOutcome]]:
    """The members of a scene without models, but for a given one, and without curves; else as `solved_curves`."""
    with _begun(request, reporter) as (run, given):
        outcome = RunOutcome()
        none: Models = {member.index: None for member in request.scene.members}
        yield run, none if given is None else member_models(run, outcome, given), outcome


@contextmanager
def _begun(request: Request, reporter: Reporter) -> Iterator[tuple[Run, ReducedModel | None]]:
    """The context of a run whose scene has been checked, with the model that was given."""
    remember_code()
    given = _check(request)
    with _running(request, reporter, given) as run:
        yield run, given


@contextmanager
def _running(request: Request, reporter: Reporter, given: ReducedModel | None) -> Iterator[Run]:
    """The context of a run: its output folder is locked, and its workers live, within the block."""
    with (
        working_store(request.out, request.recompute, reporter) as store,
        open_executor(request, store, reporter) as found,
    ):
        run = Run(request, store, StageLog(), reporter, found)
        start_workers(run, None if given is None else given_model_key(touching(request.scene.first, given)))
        yield run


def _execute(run: Run, given: ReducedModel | None, start: float) -> RunOutcome:
    models: Models = {}
    outcome = RunOutcome()
    try:
        _do_stages(run, given, models, outcome)
    except InputError:
        raise
    except BaseException as end:
        outcome.seconds = seconds_since(start)
        _leave_what_is_done(run, models, outcome, end)
        raise
    outcome.seconds = seconds_since(start)
    outcome.summary = _summary(run, outcome)
    write_summary(run.store, run.request.out, outcome.summary)
    return outcome


def _do_stages(run: Run, given: ReducedModel | None, models: Models, outcome: RunOutcome) -> None:
    request = run.request
    with _rendering(run) as ahead:
        models.update(member_models(run, outcome, given))
        if ahead is not None:
            ahead.begin(models)
        if Stage.RESPOND in request.wanted:
            _respond(run, models, outcome, lambda curves: _write_so_far(run, models, outcome, curves))
        outcome.models = model_summaries(run, models, outcome)
        outcome.campbell = campbell_summary(run, models, outcome)
        if Stage.REDUCE in request.wanted and not request.wanted & {Stage.RESPOND, Stage.RENDER}:
            outcome.modes = _modes(run, models, outcome)
        if Stage.RESPOND in request.wanted:
            _publish(run, models, outcome)
        _study(run, models, outcome)
        _draw(run, models, outcome, _DRAWN)
    _report(run, models, outcome)


def _modes(run: Run, models: Models, outcome: RunOutcome) -> list[ModelModes]:
    from pipeline.results.modes import modes_of_scene

    return modes_of_scene(run, models, outcome.problems)


def _leave_what_is_done(run: Run, models: Models, outcome: RunOutcome, end: BaseException) -> None:
    """Write the results of a run that something ends; another signal meanwhile ends it at once.

    Numbers come first. Figures are drawn where a user has stopped the run, who can stop that too. Results of an
    earlier run stay where no curve of this one is done.
    """
    done, by_user = sum(curve.facts is not None for curve in outcome.curves), isinstance(end, KeyboardInterrupt)
    reason = str(end) or INTERRUPTED if by_user else f"{INTERRUPTED} ({reason_of(end)})"
    said = f": {done} of {len(run.request.scene.members)} curves are done" if outcome.curves else ""
    outcome.problems.append(f"{reason}{said}; {GOES_ON}")
    outcome.summary = _summary(run, outcome)
    if done or not (run.store.is_empty or (run.request.out / SUMMARY).exists()):
        with suppress(Exception):  # the reason of the end is what counts
            _write_what_is_done(run, models, outcome)
            if done and by_user and getattr(end, "signal", SIGINT) == SIGINT:
                _draw_what_is_done(run, models, outcome)
    if isinstance(end, Stopped):
        end.summary = outcome.summary


def _write_what_is_done(run: Run, models: Models, outcome: RunOutcome) -> None:
    """Response and summary, then the summary with the models, which may take longer."""
    wanted = Stage.RESPOND in run.request.wanted
    if wanted and not outcome.curves:
        members = run.request.scene.members
        outcome.curves = [CurveResult(member, None, None, None, NOT_COMPUTED) for member in members]
    if wanted and outcome.response is None:
        _publish(run, models, outcome)
    if not outcome.models and all(member.index in models for member in run.request.scene.members):
        outcome.models = model_summaries(run, models, outcome)
    outcome.summary = _summary(run, outcome)
    write_summary(run.store, run.request.out, outcome.summary)


def _draw_what_is_done(run: Run, models: Models, outcome: RunOutcome) -> None:
    """The main figures of the curves, where they are asked for and not drawn yet."""
    if Stage.FIGURES not in run.request.wanted or outcome.pictures:
        return
    run.reporter.interrupts.noticed = 0  # for the next one
    run.reporter.line(f"{run.request.out}: numbers of what is done; figures follow, Ctrl-C leaves them out")
    _draw(run, models, outcome, {Stage.FIGURES: _main_figures})
    outcome.summary = _summary(run, outcome)
    write_summary(run.store, run.request.out, outcome.summary)


def _check(request: Request) -> ReducedModel | None:
    """Refuse what can be refused before anything is written; returns the given reduced model, where there is one."""
    check_cluster(request.scheduler, request.cluster, request.jobs)
    if request.rom is None:
        check_scene(request.scene, request.force)
    _check_until(request)
    if request.rom is None:
        return None
    from rom.errors import ReducedModelError

    model = read_given_model(request.rom) if isinstance(request.rom, Path) else request.rom
    if model.n_contacts == 0:
        allowed = "one contact node or more: without contact the response is linear"
        raise input_error(request.rom_said, "contact/right", "no contact nodes", allowed)
    has_area, has_frame = model.contact_area is not None, model.contact_frame is not None
    check_scene_for_model(request.scene, model.interfaces, model.n_blades, has_area, has_frame)
    tried = set()
    for member in request.scene.members:
        response, aero = member.scene.response, json.dumps(member.scene.aero_inputs())
        case = (response.damping_ratio, response.rayleigh, *rotation_of_response(member.scene).values(), aero)
        if case not in tried:
            tried.add(case)
            try:
                scene_modes(member.scene, model)
            except ReducedModelError as error:
                raise InputError(f"{request.scene.path} on {request.rom_said}: {reason_of(error)}") from None
    return model


def _check_until(request: Request) -> None:
    """Refuse a last stage that the model of the scene does not allow, whatever sections the scene has."""
    stage, scene = request.until, request.scene.first
    if stage in (Stage.RENDER, Stage.STRESS) and request.without_mesh:
        what = "[model]" if request.rom is None else request.rom_said
        found, allowed = f"asked for beside {what}", "a scene with a mesh: matrices have no elements to show it on"
        raise input_error(request.scene.path, stage, found, allowed)
    if stage == Stage.STRESS and (part := free_bore(scene)):
        raise input_error(
            request.scene.path, stage, f'asked for with {part}.bore = "free"', f'{part}.bore = "clamped"'
        )


def _nothing_to_do(request: Request) -> Iterator[str]:
    """Stages that the scene or the command asks for and that have nothing to do, one line each."""
    scene = request.scene.first
    if request.rom is None and scene.render is not None and request.without_mesh:
        yield "render: skipped, [model] has no elements that could be drawn"
    if request.until == Stage.STUDY and not scene.studies:
        sections = " or ".join(f"[{name}]" for name in STUDIES)
        yield f"study: the scene asks for none (no {sections}); only its curves are computed"
    if request.until == Stage.STRESS and scene.stress is not None and scene.stress.curves is False:
        yield "stresses: the scene asks for none (stress.curves = false)"


def _respond(
    run: Run, models: Models, outcome: RunOutcome, so_far: Callable[[list[CurveResult]], None] = lambda curves: None
) -> None:
    """The response of every member; resonances that the frequency range leaves out are said before."""
    for line in [*_left_out(run, models, outcome), *_held(run, models)]:
        run.reporter.line(f"warning: {line}")
    outcome.problems.extend(member_curves(run, models, outcome.curves, so_far))


def _left_out(run: Run, models: Models, outcome: RunOutcome) -> list[str]:
    """Lines on resonances outside the frequency range, from the reduced models."""

    def of(member: Member) -> list[Resonance]:
        model = models[member.index]
        return [] if model is None else stored_resonances(run.store, model.key, member.scene, model.rom)

    try:
        return missing_warnings(run.request.scene.members, of)
    except StorageError:
        raise
    except Exception as error:  # the curves stand without them
        outcome.problems.append(f"natural frequencies: {reason_of(error)}")
        return []


def _held(run: Run, models: Models) -> list[str]:
    """A line where stuck shrouds hold the loaded point, before any curve is solved."""
    member = run.request.scene.members[0]
    model, scene = models[member.index], member.scene
    if model is None or scene.excitation.load:
        return []
    try:
        said = held_said(stored_truncation_error(run.store, model, scene)[HELD])
    except StorageError:
        raise
    except Exception:  # said with the summary of the models
        said = ""
    return [said] if said else []


def _publish(run: Run, models: Models, outcome: RunOutcome) -> None:
    """Write the response with a summary of it, before the stages that follow, which may fail."""
    out = run.request.out
    _write_response(run, models, outcome)
    _retire_studies(run, models, outcome)
    if retire_page(out, results_fingerprint(models, outcome)) and Stage.REPORT not in run.request.wanted:
        run.reporter.line(f"{out / PAGE}: was about other results, removed; `shroud report` writes it again")


def _write_response(run: Run, models: Models, outcome: RunOutcome, said: str = "") -> None:
    """Response and its summary; `said`: how far the run has come, where curves are still being solved."""
    out, scene = run.request.out, run.request.scene
    outcome.table = table_of(outcome.curves, scene.swept, out)
    outcome.known = _known(run, models, outcome)
    outcome.entries = _entries(outcome, out)
    unfinished = replace(outcome, problems=[*outcome.problems, f"{said}{UNFINISHED}"])
    summary, origin = _summary(run, unfinished), provenance(scene)
    outcome.response = write_results(run.store, out, outcome.curves, outcome.table, summary, origin, keep=not said)


def _write_so_far(run: Run, models: Models, outcome: RunOutcome, curves: list[CurveResult]) -> None:
    """The curves that are done, for who looks while others are being solved, or after the run has been killed.

    Studies and page of earlier results stay: the end of the run says whether they are outdated. What cannot be
    written now is tried again later, at the latest at the end.
    """
    done, log = sum(curve.facts is not None for curve in curves), deepcopy(run.log)
    if not done:
        return
    for curve in curves:
        if curve.file is not None or curve.ran:
            log.note(Stage.RESPOND, curve.ran)
    now = replace(outcome, curves=curves, problems=[*outcome.problems])  # problems are said at the end
    with suppress(Exception):
        _write_response(replace(run, log=log), models, now, f"{done} of {len(curves)} curves so far; ")


def _known(run: Run, models: Models, outcome: RunOutcome) -> dict[str, Any]:
    """What the screen says beside the numbers of the curves; the curves stand without it."""
    try:
        return known_of(run, models, outcome)
    except StorageError:
        raise
    except Exception as error:
        outcome.problems.append(f"resonances and contacts: {reason_of(error)}")
        return {}


def _retire_studies(run: Run, models: Models, outcome: RunOutcome) -> None:
    """Remove results and figures of studies about other curves; nothing is imported where there are none."""
    if any((run.request.out / f"{name}.json").is_file() for name in STUDIES):
        from pipeline.studies.study import StudyContext
        from pipeline.studies.study_stage import remove_outdated_studies

        remove_outdated_studies(StudyContext(run, models, outcome))


def _study(run: Run, models: Models, outcome: RunOutcome) -> None:
    """The studies that the scene asks for."""
    if Stage.STUDY not in run.request.wanted:
        return
    from pipeline.stress.stress_stage import worst_stress
    from pipeline.studies.study import StudyContext
    from pipeline.studies.study_stage import study_stage

    with run.log.timed(Stage.STUDY):
        study_stage(StudyContext(run, models, outcome, worst_stress))


def _draw(run: Run, models: Models, outcome: RunOutcome, drawn: Mapping[Stage, Drawn]) -> None:
    """Stress, renders and figures, where they are asked for and there is something to show."""
    solved = any(curve.file for curve in outcome.curves)
    drawable = {Stage.STRESS: solved, Stage.FIGURES: solved, Stage.RENDER: any(models.values())}
    for stage, possible in drawable.items():
        if stage not in drawn or stage not in run.request.wanted or not possible:
            continue
        try:
            with run.log.timed(stage):
                files = drawn[stage](run, models, outcome)
        except PicturesMissing as missing:
            files = missing.files
            outcome.problems.extend(f"{stage}: {problem}" for problem in missing.problems)
        except StorageError:
            raise
        except Exception as error:  # the numbers stand without the pictures
            files = []
            outcome.problems.append(f"{stage}: {reason_of(error)}")
        pictures = [path for path in files if path.suffix not in (".vtu", ".csv")]
        outcome.pictures.extend(path.relative_to(run.request.out).as_posix() for path in pictures)


def _stress(run: Run, models: Models, outcome: RunOutcome) -> list[Path]:
    from pipeline.stress.stress_stage import StressMissing, stress_stage

    try:
        files, outcome.stress = stress_stage(run, models, outcome.curves)
    except StressMissing as missing:
        outcome.stress = missing.entries
        raise
    return files


def _rendering(run: Run) -> AbstractContextManager[RenderingAhead | None]:
    """Where renders are asked for, a block beside which they are drawn."""
    if Stage.RENDER not in run.request.wanted:
        return nullcontext()
    from pipeline.render.render_stage import rendering_ahead

    return rendering_ahead(run)


def _renders(run: Run, models: Models, outcome: RunOutcome) -> list[Path]:
    from pipeline.render.render_stage import render_stage

    return render_stage(run, models, outcome.curves)


def _figures(run: Run, models: Models, outcome: RunOutcome) -> list[Path]:
    from pipeline.figures.figure_stage import figure_stage

    return figure_stage(run, outcome.curves, outcome.studies)


def _main_figures(run: Run, models: Models, outcome: RunOutcome) -> list[Path]:
    from pipeline.figures.figure_stage import MAIN, figure_stage

    return figure_stage(run, outcome.curves, {}, MAIN)


_DRAWN: dict[Stage, Drawn] = {Stage.STRESS: _stress, Stage.RENDER: _renders, Stage.FIGURES: _figures}


def _report(run: Run, models: Models, outcome: RunOutcome) -> None:
    """The report page, where it is asked for."""
    if Stage.REPORT not in run.request.wanted:
        return
    from pipeline.report.report_stage import report_stage

    try:
        with run.log.timed(Stage.REPORT):
            report_stage(run, models, outcome)
        outcome.report = PAGE
    except PicturesMissing as missing:
        outcome.report = PAGE
        outcome.problems.extend(f"report: {problem}" for problem in missing.problems)
    except StorageError:
        raise
    except Exception as error:  # the results stand without the page
        outcome.problems.append(f"report: {reason_of(error)}")


def _entries(outcome: RunOutcome, out: Path) -> list[dict[str, Any]]:
    """Entries of `curves` in summary.json; none where they are too many."""
    rows = outcome.known.get("rows", {})
    curves = outcome.curves if len(outcome.curves) <= LISTED else []
    return [
        {**curve_summary(curve, out), **{name: rows.get(number, {}).get(name) for name in ROW}}
        for number, curve in enumerate(curves)
    ]


def _summary(run: Run, outcome: RunOutcome) -> dict[str, Any]:
    out, table, many = run.request.out, outcome.table, len(outcome.curves) > LISTED
    return {
        "scene": run.request.scene.first.name,
        "accuracy": None if run.request.scene.accuracy is None else run.request.scene.accuracy.plain(),
        "complete": outcome.complete,
        "problems": outcome.problems,
        "seconds": round(outcome.seconds, 4),
        "stages": run.log.summary(),
        "subject": outcome.known.get("subject"),
        "linear": outcome.known.get("linear", []),
        "curves": None if many else outcome.entries or _entries(outcome, out),
        "statistics": None if table is None else statistics(table),
        "response": outcome.response,
        TABLE_HASH: None if table is None else table.fingerprint(),
        "models": outcome.models,
        "campbell": outcome.campbell,
        "pictures": outcome.pictures,
        "stress": outcome.stress,
        "studies": {name: {"file": study.file, "seconds": study.seconds} for name, study in outcome.studies.items()},
        "report": outcome.report,
        "provenance": provenance(run.request.scene),
    }
