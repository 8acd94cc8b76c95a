"""Worker processes started while the reduced models are built: their imports and kernels are then there in time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from pipeline.process.deferred_modules import defer_unused
from pipeline.process.garbage_collection import loading
from pipeline.process.workers import Call, Workers
from pipeline.stages.cache_keys import curve_key, model_keys
from pipeline.stages.respond import KIND
from pipeline.stages.stage_names import Stage
from pipeline.stages.warm_up import warm_up
from pipeline.stages.worker_count import worker_count

if TYPE_CHECKING:
    from pipeline.scene.schema import Scene
    from pipeline.stages.request import Run


def start_workers(run: Run, pool: Workers) -> None:
    """Start the processes that the curves of the run need, if they need any; nothing is waited for."""
    if Stage.RESPOND not in run.request.wanted:
        return
    missing = [member.scene for member in run.request.scene.members if not _is_stored(run, member.scene)]
    pool.count = worker_count(run.request.jobs, missing)
    if pool.count > 1:
        pool.prepare(Call(prepare, (_cases(missing), Stage.FIGURES in run.request.wanted)))


def prepare(cases: Sequence[tuple[str, str]], figures: bool) -> None:
    """In a worker: load what curves with these friction laws and integrations need, and what figures need."""
    with loading():
        defer_unused()
        for law, integration in cases:
            warm_up(law, integration)
        if figures:
            import matplotlib.backends.backend_agg
            import matplotlib.figure  # noqa: F401


def _is_stored(run: Run, scene: Scene) -> bool:
    """Whether the curve of a scene is in the store; not known where the reduced model comes from elsewhere."""
    if run.request.rom is not None:
        return False
    return run.store.find(KIND, curve_key(scene, model_keys(scene).reduce), thorough=False) is not None


def _cases(scenes: Sequence[Scene]) -> list[tuple[str, str]]:
    return sorted({(scene.contact.law, scene.contact.integration) for scene in scenes})
