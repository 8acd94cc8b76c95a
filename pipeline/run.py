"""A run: only the stages that the asked-for outputs need, in their order, and their summary."""

from __future__ import annotations

import os
import time
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pipeline.checks import check_scene, check_scene_for_model
from pipeline.curve import modal_of
from pipeline.errors import InputError, input_error, reason_of
from pipeline.keys import Versions, curve_key
from pipeline.model_stage import Models, blade_models, given_models, summarise_models
from pipeline.outputs import curve_summary, write_response, write_summary
from pipeline.progress import Reporter
from pipeline.reading import read_given_model
from pipeline.request import Outcome, Request, Run
from pipeline.respond import CurveSolver, Solved, Wanted
from pipeline.slips import slips
from pipeline.stage_log import StageLog
from pipeline.store import Store

if TYPE_CHECKING:
    from rom import ReducedModel


def execute(request: Request, reporter: Reporter) -> Outcome:
    """Run what is asked for and write it into the output folder.

    Raises
    ------
    InputError : the scene or the reduced model is not usable; nothing was written.
    """
    start = time.perf_counter()
    given = _check(request)
    for line in slips(request.scene):
        reporter.line(f"warning: {line}")
    was_there = os.path.lexists(request.out)
    store = open_store(request)
    try:
        return _execute(Run(request, store, StageLog(), reporter, Versions.current()), given, start)
    except KeyboardInterrupt:
        store.sweep_up(own=True)  # the interrupt may have come before or amid a clean-up
        raise
    except InputError:
        if not was_there:
            _remove_where_empty(store.root / "tmp", store.root, request.out)
        raise


def _remove_where_empty(*folders: Path) -> None:
    """Remove folders, inner ones first, as far as nothing is in them."""
    for folder in folders:
        with suppress(OSError):
            folder.rmdir()


def _execute(run: Run, given: ReducedModel | None, start: float) -> Outcome:
    request, outcome = run.request, Outcome()
    models = blade_models(run, outcome) if given is None else given_models(run, given)
    if "respond" in request.wanted:
        _respond(run, models, outcome)
    outcome.models = summarise_models(run, models, outcome)
    _draw(run, models, outcome)
    _report(run, models, outcome)
    outcome.seconds = time.perf_counter() - start
    write_summary(run.store, request.out, _summary(run, outcome))
    return outcome


def _check(request: Request) -> ReducedModel | None:
    """Refuse what can be refused before anything is written; returns the given reduced model, where there is one."""
    if request.rom is None:
        check_scene(request.scene)
        return None
    from rom import ReducedModelError

    model = read_given_model(request.rom)
    check_scene_for_model(request.scene, model.n_contacts, model.contact_area is not None)
    tried = set()
    for member in request.scene.members:
        response, load = member.scene.response, member.scene.load
        case = (response.damping_ratio, response.rayleigh, load.speed_rpm)
        if case not in tried:
            tried.add(case)
            try:
                modal_of(model, member.scene)
            except ReducedModelError as error:
                raise InputError(f"{request.scene.path} on {request.rom}: {reason_of(error)}") from None
    return model


def open_store(request: Request) -> Store:
    """The store in the output folder, free of what dead processes left.

    Raises
    ------
    InputError : the folder cannot be written.
    """
    store = Store(request.out / "store", force=request.force)
    try:
        with store.temporary():
            pass
    except (OSError, ValueError) as error:
        found = f"cannot be written: {getattr(error, 'strerror', None) or reason_of(error)}"
        raise input_error("--out", str(request.out), found, "a folder that can be written") from None
    store.sweep_up()
    return store


def _respond(run: Run, models: Models, outcome: Outcome) -> None:
    """The response of every member, and the files that hold them."""
    wanted = {}
    for member in run.request.scene.members:
        model = models[member.index]
        if model is not None:
            wanted[member.index] = Wanted(member, curve_key(member.scene, model.key, run.versions), model.rom)
    solver = CurveSolver(run.store, run.log, run.reporter, run.request.jobs)
    solved = solver.solve(list(wanted.values()))
    for member in run.request.scene.members:
        if member.index in wanted:
            curve = solved[wanted[member.index].key]
            outcome.curves.append(Solved(member, curve.rom, curve.file, curve.facts, curve.reason))
        else:
            outcome.curves.append(Solved(member, None, None, None, "its reduced model could not be made"))
    write_response(run.store, run.request.out, outcome.curves, run.request.scene.swept)


def _draw(run: Run, models: Models, outcome: Outcome) -> None:
    """Renders and figures, where they are wanted and there is something to show."""
    drawable = {"render": any(models.values()), "figures": any(curve.file for curve in outcome.curves)}
    for stage, possible in drawable.items():
        if stage not in run.request.wanted or not possible:
            continue
        try:
            with run.log.timed(stage):
                files = _renders(run, models, outcome) if stage == "render" else _figures(run, outcome)
            outcome.pictures.extend(path.relative_to(run.request.out).as_posix() for path in files)
        except Exception as error:  # the numbers stand without the pictures
            outcome.problems.append(f"{stage}: {reason_of(error)}")


def _renders(run: Run, models: Models, outcome: Outcome) -> list[Path]:
    from pipeline.render.stage import render_stage

    return render_stage(run, models, outcome.curves)


def _figures(run: Run, outcome: Outcome) -> list[Path]:
    from pipeline.figures.stage import figure_stage

    return figure_stage(run, outcome.curves)


def _report(run: Run, models: Models, outcome: Outcome) -> None:
    """The page about all that, where it is wanted."""
    if "report" not in run.request.wanted:
        return
    from pipeline.report.stage import report_stage

    try:
        with run.log.timed("report"):
            outcome.report = report_stage(run, models, outcome).relative_to(run.request.out).as_posix()
    except Exception as error:  # the results stand without the page
        outcome.problems.append(f"report: {reason_of(error)}")


def _summary(run: Run, outcome: Outcome) -> dict[str, Any]:
    out = run.request.out
    return {
        "scene": run.request.scene.first.name,
        "accuracy": None if run.request.scene.accuracy is None else run.request.scene.accuracy.plain(),
        "complete": outcome.complete,
        "problems": outcome.problems,
        "seconds": round(outcome.seconds, 4),
        "stages": run.log.summary(),
        "curves": [curve_summary(curve, out) for curve in outcome.curves],
        "models": outcome.models,
        "pictures": outcome.pictures,
        "report": outcome.report,
    }
