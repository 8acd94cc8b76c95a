"""The reduced model and the curve of every member of a scene, in the order of the members.

Curves are found in the store, or computed by tasks; each is stored as soon as it is there.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Future
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, get_args

from pipeline.errors import reason_of
from pipeline.executor.task import Task, TaskFailed, TaskResult
from pipeline.process.progress import Counter
from pipeline.process.workers import WorkerDied
from pipeline.scene.response_section import Response
from pipeline.scene.schema import Scene
from pipeline.stages.cache_keys import curve_key
from pipeline.stages.curve.carry_branches import EXTENDED, BranchCarrier, Extension, added_branches, extension_task
from pipeline.stages.curve.curve_file import CURVE
from pipeline.stages.curve.curve_table import NOT_COMPUTED
from pipeline.stages.curve.respond import (
    KIND,
    CurveJob,
    CurveResult,
    curve_line,
    curve_task,
    result_from_file,
    stored_curve,
)
from pipeline.stages.model.sweep_models import Models, models_from_file, models_of_blade, models_of_matrices
from pipeline.stages.request import Run, RunOutcome
from pipeline.stages.stage import Stage
from pipeline.stages.worker_start import prepare_workers
from pipeline.store.content_store import Entry

if TYPE_CHECKING:
    from rom.cyclic.reduced_model import ReducedModel


CURVES, BRANCHES = "curves", "branches"  # what progress counts
PAUSE, SHARE = 3.0, 20.0  # s between two intermediate results, and times as long as the last of them took


@dataclass
class Intermediate:
    """Has intermediate results written, so seldom that this takes a twentieth of the time at most.

    It is asked when a curve is solved and while others are being solved, so the last one waits for no other.
    """

    write: Callable[[], None]
    written: int = 0  # curves of the last ones
    due: float = field(default_factory=lambda: time.monotonic() + PAUSE)

    def offer(self, solved: int) -> None:
        """So many curves are solved, and the run goes on."""
        start = time.monotonic()
        if solved > self.written and start >= self.due:
            self.write()
            end = time.monotonic()
            self.written, self.due = solved, end + max(PAUSE, SHARE * (end - start))


# until the first point is solved: the state of the curves in a first run
COMPILING = "no point solved yet; a first run compiles the kernels, for minutes (`shroud warm-up` does it beforehand)"


class SweepCurves:
    """Finds or computes the curves of a sweep, with the branches of their neighbours.

    A curve that fails carries its reason and does not stop the others. It is extended as soon as its neighbours are
    there, while others are still being solved.
    """

    def __init__(
        self, run: Run, jobs: Sequence[CurveJob], so_far: Callable[[int], None] = lambda solved: None
    ) -> None:
        self._run, self._so_far = run, so_far  # the latter gets the number of solved curves while the run goes on
        self._jobs: dict[str, CurveJob] = {}
        for item in jobs:
            self._jobs.setdefault(item.key, item)
        self._carrier = BranchCarrier(run.store, jobs)
        self.solved: dict[str, CurveResult] = {}  # so far, without branches of neighbours
        self._tasks: dict[Future[TaskResult], tuple[Task, CurveJob | Extension]] = {}
        self._submitted = 0  # extensions
        self._added: list[int] = []  # branches that each of them has found
        self._counters: Mapping[str, Counter] = {}

    @property
    def problems(self) -> list[str]:
        """What could not be done, one line each."""
        return self._carrier.problems

    def results(self) -> dict[str, CurveResult]:
        """The curve of every key."""
        stored = self._carrier.stored()
        if stored is not None:
            return stored
        missing, extensions = [], []
        for key, item in self._jobs.items():
            found = stored_curve(self._run.store, item)
            if found is None:
                missing.append(item)
            else:
                extensions += self._note(key, found)
        extensions = self._not_stored(extensions)
        if missing or extensions:
            self._compute(missing, extensions)
        return self._carrier.results({key: self.solved[key] for key in self._jobs})

    def _compute(self, missing: Sequence[CurveJob], extensions: Sequence[Extension]) -> None:
        executor, reporter = self._run.executor, self._run.reporter
        pieces = max(len(missing) + len(extensions), self._carrier.waiting)
        scenes = [item.member.scene for item in self._jobs.values()][:pieces]
        prepare_workers(self._run, scenes)
        totals = {CURVES: len(missing), BRANCHES: self._carrier.waiting}
        with reporter.counting_several(totals, executor.count) as self._counters:
            self._counters[CURVES].within(COMPILING)
            for item in missing:
                self._submit(curve_task(self._run.store, item), item)
            for extension in extensions:
                self._submit(extension_task(extension), extension)
            for future in executor.completed(self._within):
                for extension in self._not_stored(self._finished(future)):
                    self._submit(extension_task(extension), extension)
                if self._tasks:
                    self._so_far(len(self.solved))
        if self._added:
            found, curves = sum(self._added) or "none", f"{len(self._added)} curve{'s' * (len(self._added) > 1)}"
            reporter.line(f"detached branches of neighbouring curves tried on {curves}: {found} found")

    def _within(self, detail: str) -> None:
        solving = any(not isinstance(item, Extension) for _, item in self._tasks.values())
        self._counters[CURVES if solving else BRANCHES].within(detail)
        self._so_far(len(self.solved))

    def _submit(self, task: Task, item: CurveJob | Extension) -> None:
        self._tasks[self._run.executor.submit(task)] = task, item
        if isinstance(item, Extension):
            self._submitted += 1
            self._counters[BRANCHES].grow(self._submitted)

    def _not_stored(self, extensions: Sequence[Extension]) -> list[Extension]:
        """Those extensions, and what follows from the others, that have to be computed."""
        waiting, missing = list(extensions), []
        while waiting:
            item = waiting.pop(0)
            entry = self._run.store.find(EXTENDED, item.key)
            if entry is None:
                missing.append(item)
            else:
                waiting += self._carrier.extended(item, entry)
        return missing

    def _finished(self, future: Future[TaskResult]) -> list[Extension]:
        """Store the result of a task; returns the extensions that can be begun."""
        task, item = self._tasks.pop(future)
        try:
            result, reason = future.result(), ""
        except (TaskFailed, WorkerDied) as error:
            result, reason = None, reason_of(error)
        if isinstance(item, Extension):
            return self._extended(task, item, result, reason)
        if result is None:
            found = CurveResult(item.member, item.rom, None, None, reason, ran=True)
            self._counters[CURVES].done(f"{task.label}: {reason}")
        else:
            file = self._kept(KIND, item.key, result).file(CURVE)
            found = result_from_file(item, file, ran=True)
            self._counters[CURVES].done(f"{task.label}: {curve_line(found)}")
        return self._note(item.key, found)

    def _extended(self, task: Task, item: Extension, result: TaskResult | None, reason: str) -> list[Extension]:
        entry = None if result is None else self._kept(EXTENDED, item.key, result)
        added = 0 if entry is None else added_branches(entry)
        said = reason if entry is None else f"{added or 'none'} further"
        self._added.append(added)
        self._counters[BRANCHES].done(f"{task.label}: {said}", notable=bool(added or reason))
        return self._carrier.extended(item, entry, reason)

    def _kept(self, kind: str, key: str, result: TaskResult) -> Entry:
        return self._run.store.keep(kind, key, result.folder, result.seconds)

    def _note(self, key: str, found: CurveResult) -> list[Extension]:
        self.solved[key] = found
        return self._carrier.solved(key, found)


def with_shorter_searches(scene: Scene) -> Iterator[Scene]:
    """The scene with each search that is shorter than its own, the longest first."""
    searches = get_args(Response.model_fields["search"].annotation)
    for search in reversed(searches[: searches.index(scene.response.search)]):
        yield with_search(scene, search)


def with_search(scene: Scene, search: str) -> Scene:
    """The scene with another search for the worst motion."""
    return scene.model_copy(update={"response": scene.response.model_copy(update={"search": search})})


def member_models(run: Run, outcome: RunOutcome, given: ReducedModel | None) -> Models:
    """The reduced model of every member: given, of matrices, or of a blade."""
    if given is not None:
        return models_from_file(run, given)
    if run.request.scene.first.model is not None:
        return models_of_matrices(run, outcome)
    return models_of_blade(run, outcome)


def member_curves(
    run: Run,
    models: Models,
    found: list[CurveResult],
    so_far: Callable[[list[CurveResult]], None] = lambda curves: None,
) -> Sequence[str]:
    """Add the response of every member to `found`; returns what else could not be computed, one line each.

    Where an exception ends this, `found` gets the curves that are there, and the others as not computed. `so_far`
    gets them from time to time while others are being solved.
    """
    jobs = {}
    for member in run.request.scene.members:
        model = models[member.index]
        if model is not None:
            shorter = tuple(curve_key(each, model.key) for each in with_shorter_searches(member.scene))
            jobs[member.index] = CurveJob(member, curve_key(member.scene, model.key), model.rom, shorter)

    def of_members(solved: Mapping[str, CurveResult]) -> Iterator[CurveResult]:
        for member in run.request.scene.members:
            job = jobs.get(member.index)
            if job is None:
                yield CurveResult(member, None, None, None, "its reduced model could not be made")
            elif job.key in solved:
                yield replace(solved[job.key], member=member)
            else:
                yield CurveResult(member, job.rom, None, None, NOT_COMPUTED)

    seldom = Intermediate(lambda: so_far([*of_members(curves.solved)]))
    curves = SweepCurves(run, list(jobs.values()), seldom.offer)
    solved = curves.solved
    try:
        with run.log.timed(Stage.RESPOND):
            solved = curves.results()
    finally:
        for curve in solved.values():
            run.log.note(Stage.RESPOND, curve.ran)
        found.extend(of_members(solved))
    return curves.problems
