"""Number of worker processes for the curves of a sweep, and the order in which they begin them."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence

from pipeline.scene.schema import Scene

_WORTH = 1.0  # seconds of work above which processes pay, which start while the reduced model is built
_MOST = 16  # each needs some 200 MB
_AUTO = 7  # harmonics assumed for "auto"
_GAP = 5.0  # a gap so many times as large takes as long as an interference
_EXTRAS = 3.0  # times as long with stability, detached branches and the truncation error


def worker_count(jobs: int | None, scenes: Sequence[Scene]) -> int:
    """Processes for a curve of each scene: `jobs`, or with None one for each core if the work is worth it."""
    if jobs is None:
        worth_it = sum(_expected(scene) for scene in scenes) > _WORTH
        jobs = min(_cores(), _MOST) if worth_it else 1
    return max(1, min(jobs, len(scenes)))


def longest_first(scene: Scene) -> tuple[float, float]:
    """Sort key of curves: those that take longest come first, so that no process is left with one at the end.

    Contacts near the transition from gap to interference take longest: they stick, slip and open. Those with a gap
    open up to gaps as large as the vibration, those with an interference stick soon.
    """
    interference = scene.contact.interference
    values = interference if isinstance(interference, tuple) else (interference,)
    mean = sum(values) / len(values)
    return -_expected(scene), mean if mean >= 0.0 else -mean / _GAP


def _expected(scene: Scene) -> float:
    """Estimated seconds for a curve of this scene, within a factor of about three."""
    response = scene.response
    number = _AUTO if isinstance(response.harmonics, str) else response.harmonics
    nodes = 9 if scene.mesh is None else math.prod(scene.mesh.contact_grid)
    extras = _EXTRAS if response.stability != "folds" or response.detached else 1.0
    return 0.07 * extras * number**1.7 * (nodes / 9.0) ** 2


def _cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
