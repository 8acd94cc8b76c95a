"""A page on a scene: the model is built, the first curve computed, and a server waits for browsers.

Browsers of this machine that know its address are served, one computation at a time. Bokeh serves the page, its
scripts and the connection to it. The address has a random token, under which everything lies: without it nothing but
"not found" is answered. Requests that name another host, as those of a page that had its name pointed to this
machine, and connections from pages of another origin are refused.
"""

from __future__ import annotations

import asyncio
import logging
import secrets
import tempfile
import threading
import webbrowser
from collections.abc import Callable, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from pipeline.errors import InputError, input_error
from pipeline.explore.live import LiveScene
from pipeline.explore.page import Opening
from pipeline.explore.workshop import Workshop

if TYPE_CHECKING:
    from collections.abc import Iterator
    from contextlib import AbstractContextManager

    from bokeh.document import Document
    from bokeh.server.server import BaseServer

    from pipeline.process.progress import Reporter
    from pipeline.scene.reading import SceneFile
    from rom.cyclic.reduced_model import ReducedModel
ADDRESS = "127.0.0.1"
NAMES = (ADDRESS, "localhost")  # by which a browser may call this machine
LOOKED_FOR = 2000  # milliseconds between two looks for pages that were closed
CLOSED_AFTER = 20_000  # milliseconds without a connection after which a page counts as closed, one that loads too
LARGEST_MESSAGE = 1_000_000  # bytes of one from a page, which holds a few numbers
IDLE = 20.0  # seconds that a connection may wait with its request, or for a next one
MOST_CONNECTIONS = 64  # at a time; those of open pages do not count
# All the page's scripts, styles and pictures are its own; nothing of another origin is loaded or told.
HEADERS = {
    "Content-Security-Policy": (
        "default-src 'none'; script-src 'self' 'unsafe-inline'; style-src 'self' 'unsafe-inline'; "
        "font-src 'self' data:; img-src 'self' data: blob:; connect-src 'self' ws://127.0.0.1:* ws://localhost:*; "
        "base-uri 'none'; form-action 'none'; frame-ancestors 'self' http://localhost:* http://127.0.0.1:*"
    ),
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "Cache-Control": "no-store",
    "Cross-Origin-Resource-Policy": "same-origin",
}


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


class Pages(Protocol):
    """Makes pages, and is told of those that were left."""

    def __call__(self, doc: Document) -> None: ...
    def left(self, doc: Document) -> None: ...


@dataclass(frozen=True)
class LocalServer:
    """A server that listens; `run` serves until it is stopped."""

    server: BaseServer
    address: str  # of the page, with its token

    def run(self, in_browser: bool = False) -> None:
        """Serve until `stop`, or until an exception, as that of a signal, ends the loop; open a browser if asked."""
        with ExitStack() as kept:
            if in_browser:
                page = redirect_file(Path(kept.enter_context(tempfile.TemporaryDirectory())), self.address)
                # in a thread: a browser command that stays in the foreground would block the page
                threading.Thread(target=webbrowser.open, args=(page.as_uri(),), daemon=True).start()
            try:
                self.server.io_loop.start()
            finally:
                self.server.stop(wait=False)
                self.server.io_loop.run_sync(_end_tasks)
                self.server.io_loop.close()

    def stop(self) -> None:
        """End `run`, from any thread."""
        self.server.io_loop.add_callback(self.server.io_loop.stop)


def redirect_file(folder: Path, address: str) -> Path:
    """A page that leads to the address, for its owner alone: a command line with the token is read by other users."""
    path = folder / "explore.html"
    path.touch(mode=0o600)
    head = f'<meta charset="utf-8"><meta http-equiv="refresh" content="0; url={address}">'
    path.write_text(f'<!DOCTYPE html>{head}<a href="{address}">the page</a>\n', encoding="utf-8")
    return path


def local_server(pages: Pages, port: int = 0) -> LocalServer:
    """A server of pages on a port of this machine, by default a free one; each visit makes a page of its own."""
    check_bokeh()
    from bokeh.application import Application
    from bokeh.application.handlers.function import FunctionHandler
    from bokeh.server.server import BaseServer
    from tornado.ioloop import IOLoop
    from tornado.netutil import bind_sockets

    for name in ("bokeh", "tornado"):
        logging.getLogger(name).setLevel(logging.CRITICAL)  # the address with its token is no one's business
    try:
        sockets = bind_sockets(port, ADDRESS)
    except OSError as error:
        reason = f"{port}: {error.strerror or error}"
        raise input_error("shroud explore", "--port", reason, "a free port, 0 for any") from None
    number = sockets[0].getsockname()[1]
    token = secrets.token_urlsafe(24)
    loop = IOLoop(make_current=False)
    application = _application_class(pages.left)(
        Application(FunctionHandler(pages.__call__)),
        prefix=token,
        extra_websocket_origins=[f"{name}:{number}" for name in NAMES],
        secret_key=secrets.token_bytes(32),
        sign_sessions=True,
        check_unused_sessions_milliseconds=LOOKED_FOR,
        unused_session_lifetime_milliseconds=CLOSED_AFTER,
        stats_log_frequency_milliseconds=3_600_000,
        websocket_max_message_size_bytes=LARGEST_MESSAGE,
        log_function=lambda handler: None,
        transforms=[_headers_class()],
    )
    http = _http_class()(
        application, max_buffer_size=LARGEST_MESSAGE, idle_connection_timeout=IDLE, body_timeout=IDLE
    )
    server = BaseServer(loop, application, http)

    async def listen() -> None:  # on this loop, whichever runs around it
        http.add_sockets(sockets)
        server.start()

    loop.run_sync(listen)
    return LocalServer(server, f"http://{ADDRESS}:{number}/{token}/")


async def _end_tasks() -> None:
    """End what is still being sent."""
    tasks = asyncio.all_tasks() - {asyncio.current_task()}
    for task in tasks:
        task.cancel()
    await asyncio.gather(*tasks, return_exceptions=True)


def check_bokeh() -> None:
    """Refuse where Bokeh is not installed, before anything is computed."""
    if find_spec("bokeh") is None:
        raise InputError("shroud explore: Bokeh is not installed, allowed: after pip install 'shroud[explore]'")


def serve_aside(server: LocalServer) -> threading.Thread:
    """Serve in a thread that ends with the process, as beside a notebook."""
    thread = threading.Thread(target=server.run, name="page", daemon=True)
    thread.start()
    return thread


def _application_class(left: Callable[[Document], None]) -> Any:
    from bokeh.server.tornado import BokehTornado
    from tornado.web import ErrorHandler

    class LocalApplication(BokehTornado):
        """Bokeh's application, for requests that name this machine as their host."""

        def find_handler(self, request: Any, **found: Any) -> Any:
            if request.host.rpartition(":")[0] in NAMES:
                return super().find_handler(request, **found)
            return self.get_handler_delegate(request, ErrorHandler, {"status_code": 403})

        def resources(self, absolute_url: Any = None) -> Any:
            """The scripts that the page uses, without those of tables and formulas."""
            return super().resources(absolute_url).clone(components=["bokeh", "bokeh-widgets"])

        def client_lost(self, connection: Any) -> None:
            """Tell of sessions without a browser at once; they are kept for a while, as connections come back."""
            super().client_lost(connection)
            for session in self.get_sessions("/"):
                if session.connection_count == 0:
                    left(session.document)

    return LocalApplication


def _http_class() -> Any:
    from tornado.httpserver import HTTPServer

    class LimitedServer(HTTPServer):
        """A server with so many connections at a time; one that is upgraded, as that of a page, counts no more."""

        def handle_stream(self, stream: Any, address: Any) -> None:
            if len(self._connections) >= MOST_CONNECTIONS:
                stream.close()
            else:
                super().handle_stream(stream, address)

    return LimitedServer


def _headers_class() -> Any:
    from tornado.web import OutputTransform

    class Headers(OutputTransform):
        """Headers of every answer."""

        def transform_first_chunk(
            self, status_code: int, headers: Any, chunk: bytes, finishing: bool
        ) -> tuple[int, Any, bytes]:
            for name, value in HEADERS.items():
                headers[name] = value
            return status_code, headers, chunk

    return Headers
