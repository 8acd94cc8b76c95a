"""Worker processes started while the reduced models are built: their imports and kernels are then there in time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from pipeline.executor.task import ROOM, Preparation
from pipeline.process.deferred_modules import defer_unused
from pipeline.process.garbage_collection import loading
from pipeline.process.workers import Call
from pipeline.stages.cache_keys import curve_key, model_keys
from pipeline.stages.number_versions import versions
from pipeline.stages.respond import KIND
from pipeline.stages.stage_names import Stage
from pipeline.stages.warm_up import warm_up
from pipeline.stages.worker_count import worker_count
from rom import require_memory

if TYPE_CHECKING:
    from pipeline.scene.schema import Scene
    from pipeline.stages.request import Run


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
    return run.store.find(KIND, key, thorough=False) is not None


def _cases(scenes: Sequence[Scene]) -> tuple[tuple[str, str], ...]:
    return tuple(sorted({(scene.contact.law, scene.contact.integration) for scene in scenes}))
