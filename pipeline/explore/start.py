"""A page on a scene: the model is built, the first curve computed, and a server waits for browsers."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pipeline.explore.live import LiveScene
from pipeline.explore.page import Opening
from pipeline.explore.server import LocalServer, check_bokeh, local_server, serve_aside
from pipeline.explore.workshop import Workshop

if TYPE_CHECKING:
    from collections.abc import Iterator
    from contextlib import AbstractContextManager

    from pipeline.process.progress import Reporter
    from pipeline.scene.reading import SceneFile
    from rom.cyclic.reduced_model import ReducedModel


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


HEIGHT = 860  # pixels of the page in a notebook


class Explorer:
    """The open page of a scene. A notebook shows it; elsewhere `address` is to be opened in a browser.

    Parameters
    ----------
    block : context manager
        Gives the server and what its pages begin with, and ends what computes for them: `page_server`.

    Attributes
    ----------
    address : str
        Of the page, with the token without which there is no answer. It works on this machine alone.

    Examples
    --------
    >>> from pipeline import explore_scene
    >>> with explore_scene("scenes/dummy.toml", "out/try", overrides={"mesh.size": 0.008}) as page:
    ...     page.address.startswith("http://127.0.0.1:")
    True
    """

    address: str

    def __init__(self, block: AbstractContextManager[tuple[LocalServer, Opening]]) -> None:
        self._stack = ExitStack()
        server, _ = self._stack.enter_context(block)
        thread = serve_aside(server)
        self._stack.callback(thread.join)
        self._stack.callback(server.stop)
        self.address = server.address

    def close(self) -> None:
        """Close the page and end what computes for it, as the end of Python does."""
        self._stack.close()

    def __enter__(self) -> Explorer:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"Explorer({self.address!r})"

    def _repr_html_(self) -> str:
        return f'<iframe src="{self.address}" width="100%" height="{HEIGHT}" style="border: 0"></iframe>'
