"""A page on a scene: the model is built, the first curve computed, and a server waits for browsers."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pipeline.explore.live import LiveScene
from pipeline.explore.page import Opening
from pipeline.explore.server import LocalServer, check_bokeh, local_server
from pipeline.explore.workshop import Workshop

if TYPE_CHECKING:
    from collections.abc import Iterator

    from pipeline.process.progress import Reporter
    from pipeline.scene.reading import SceneFile
    from rom import ReducedModel


@contextmanager
def page_server(
    scene: SceneFile | Mapping[str, Any] | str | Path,
    out: Path | None = None,
    rom: Path | ReducedModel | None = None,
    port: int = 0,
    reporter: Reporter | None = None,
) -> Iterator[tuple[LocalServer, Opening]]:
    """A server of pages on a scene, not yet running, and what its pages begin with.

    All that computes for them ends with the block.
    """
    check_bokeh()
    live = LiveScene.open(scene, out, rom=rom, reporter=reporter)
    workshop = Workshop()
    try:
        opening = Opening(live, live.curve(), workshop)
        yield local_server(opening, port), opening
    finally:
        workshop.close()
        live.close()
