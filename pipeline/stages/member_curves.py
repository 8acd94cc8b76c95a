"""The reduced model and the curve of every member of a scene, in the order of the members."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from pipeline.stages.cache_keys import curve_key
from pipeline.stages.matrix_models import models_of_matrices
from pipeline.stages.request import Run, RunOutcome
from pipeline.stages.respond import CurveJob, CurveResult
from pipeline.stages.stage_names import Stage
from pipeline.stages.sweep_curves import SweepCurves
from pipeline.stages.sweep_models import Models, models_from_file, models_of_blade

if TYPE_CHECKING:
    from rom import ReducedModel

INTERRUPTED = "interrupted"  # reason of a curve that a run did not come to


def member_models(run: Run, outcome: RunOutcome, given: ReducedModel | None) -> Models:
    """The reduced model of every member: given, of matrices, or of a blade."""
    if given is not None:
        return models_from_file(run, given)
    if run.request.scene.first.model is not None:
        return models_of_matrices(run, outcome)
    return models_of_blade(run, outcome)


def member_curves(run: Run, models: Models, found: list[CurveResult]) -> Sequence[str]:
    """Add the response of every member to `found`; returns what else could not be computed, one line each.

    Where an exception ends this, `found` gets the curves that are there, and the others as interrupted.
    """
    jobs = {}
    for member in run.request.scene.members:
        model = models[member.index]
        if model is not None:
            jobs[member.index] = CurveJob(member, curve_key(member.scene, model.key), model.rom)
    curves = SweepCurves(run, list(jobs.values()))
    solved = curves.solved
    try:
        with run.log.timed(Stage.RESPOND):
            solved = curves.results()
    finally:
        for curve in solved.values():
            run.log.note(Stage.RESPOND, curve.ran)
        for member in run.request.scene.members:
            job = jobs.get(member.index)
            if job is None:
                found.append(CurveResult(member, None, None, None, "its reduced model could not be made"))
            elif job.key in solved:
                found.append(replace(solved[job.key], member=member))
            else:
                found.append(CurveResult(member, job.rom, None, None, INTERRUPTED))
    return curves.problems
