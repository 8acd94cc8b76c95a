"""The executor of a run, this machine or a cluster, and its workers, started while the reduced models are built.

The versions that decide numbers are compared between machines.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

from pipeline.executor.cluster_address import local_workers
from pipeline.executor.task import ROOM, Executor, LocalExecutor, Preparation
from pipeline.process.program import defer_unused, loading
from pipeline.process.workers import Call, kept_workers
from pipeline.stages.cache_keys import CURVE_CODE, EXTENSION_CODE, REDUCED_MODEL_CODE, curve_key, model_keys
from pipeline.stages.code_fingerprint import code_versions
from pipeline.stages.curve.respond import KIND, worker_count
from pipeline.stages.stage import Stage
from pipeline.stages.warm_up import warm_up
from rom.linear_algebra.threads import require_memory

if TYPE_CHECKING:
    from pipeline.process.progress import Reporter
    from pipeline.scene.schema import Scene
    from pipeline.stages.request import Request, Run
    from pipeline.store.content_store import Store


MODULES = "pipeline.stages.model.build_mesh", "pipeline.stages.model.build_full_model"
TRANSPORT = "distributed"  # decides no number, but two versions of it may not understand each other


def versions() -> dict[str, str]:
    """Versions by name: `program` (a hash of its source), `Python`, `processor`, and the packages."""
    return code_versions(CURVE_CODE, EXTENSION_CODE, REDUCED_MODEL_CODE, *MODULES, further=(TRANSPORT,))


@contextmanager
def open_executor(request: Request, store: Store, reporter: Reporter) -> Iterator[Executor]:
    """What runs the tasks of a run within the block; worker processes and a cluster are started when needed."""
    scratch = store.root / "tmp"
    with kept_workers() as pool:
        executor: Executor
        if request.scheduler is None:
            fixed = None if request.cluster is None else local_workers(request.cluster)
            executor = LocalExecutor(pool, scratch, reporter.interrupts, reporter.line, fixed)
        else:
            from pipeline.executor.cluster import ClusterExecutor

            executor = ClusterExecutor(request.scheduler, scratch, reporter.interrupts, reporter.line)
        try:
            yield executor
        finally:
            executor.close()


def start_workers(run: Run, given: str | None = None) -> None:
    """Have the workers started that the curves of the run need, if they need any; nothing is waited for."""
    if Stage.RESPOND not in run.request.wanted:
        return
    missing = [member.scene for member in run.request.scene.members if not _is_stored(run, member.scene, given)]
    if missing:
        prepare_workers(run, missing)


def prepare_workers(run: Run, scenes: Sequence[Scene]) -> None:
    """Have the workers started that curves of these scenes need; nothing is waited for."""
    preparation = Preparation(Call(prepare, (_cases(scenes), Stage.FIGURES in run.request.wanted)), versions)
    run.executor.prepare(worker_count(run.request.jobs, scenes), preparation)


def prepare(cases: Sequence[tuple[str, str]], figures: bool) -> None:
    """In a worker: load what curves with these friction laws and integrations need, and what figures need."""
    require_memory(ROOM)
    with loading():
        defer_unused()
        for law, integration in cases:
            warm_up(law, integration)
        if figures:
            import matplotlib.backends.backend_agg
            import matplotlib.figure  # noqa: F401


def _is_stored(run: Run, scene: Scene, given: str | None) -> bool:
    """Whether the curve of a scene is in the store."""
    key = curve_key(scene, given or model_keys(scene).reduce)
    return run.store.lists(KIND, key)


def _cases(scenes: Sequence[Scene]) -> tuple[tuple[str, str], ...]:
    return tuple(sorted({(law, scene.contact.integration) for scene in scenes for law in scene.laws}))
