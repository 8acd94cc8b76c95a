"""Number of worker processes for the curves of a sweep."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence

from pipeline.scene.schema import Scene

_WORTH = 3.0  # seconds of work above which starting processes (about one second) pays
_MOST = 16  # each needs some 200 MB
_AUTO = 7  # harmonics assumed for "auto"


def worker_count(jobs: int | None, scenes: Sequence[Scene]) -> int:
    """Processes for a curve of each scene: `jobs`, or with None one for each core if the work is worth it."""
    if jobs is None:
        worth_it = sum(_expected(scene) for scene in scenes) > _WORTH
        jobs = min(_cores(), _MOST) if worth_it else 1
    return max(1, min(jobs, len(scenes)))


def _expected(scene: Scene) -> float:
    """Estimated seconds for a curve of this scene, within a factor of about three (docs/performance.md)."""
    harmonics = scene.response.harmonics
    number = _AUTO if isinstance(harmonics, str) else harmonics
    nodes = 9 if scene.mesh is None else math.prod(scene.mesh.contact_grid)
    return 0.07 * number**1.7 * (nodes / 9.0) ** 2


def _cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
