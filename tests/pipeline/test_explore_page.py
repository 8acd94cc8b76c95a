"""The page of `shroud explore`: in a browser, at its port, and what it computes for whom."""

from __future__ import annotations

import asyncio
import json
import os
import signal
import socket
import subprocess
import sys
import threading
import time
import tomllib
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any
from urllib.error import HTTPError
from urllib.parse import urlsplit
from urllib.request import ProxyHandler, Request, build_opener, url2pathname

import pytest
from pipeline_support import small_scene, write_scene

from pipeline import run_scene
from pipeline.errors import InputError
from pipeline.explore.charts import Scale
from pipeline.explore.knobs import Knob
from pipeline.explore.live import edited
from pipeline.explore.start import MOST_CONNECTIONS, local_server, page_server
from pipeline.explore.words import KnobWords
from pipeline.explore.workshop import Cancelled, Kind, Workshop

pytestmark = pytest.mark.xdist_group("explore")  # one worker: one server and one browser
pytest.importorskip("bokeh")
PROJECT = Path(__file__).parents[2]
WAITING = 60.0  # seconds after which something is not waited for
NONSENSE = (
    "",
    "no json",
    "[]",
    "{}",
    '{"number": 1}',
    '{"number": "x", "undo": 1}',
    '{"number": 1, "_close": 1}',
    '{"number": 1, "undo": 1, "redo": 1}',
    '{"number": 1, "save": "../../etc/passwd"}',
    '{"number": 1, "turn": {"name": {"shown": "x"}}}',
    '{"number": 1, "turn": 5}',
    '{"number": 1, "node": "x"}',
    '{"number": 1, "step": []}',
)
FRICTION, INTERFERENCE = "contact.friction", "contact.interference"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("explored")


@pytest.fixture(scope="module")
def scene(folder: Path) -> Path:
    """The small scene with contacts that slip."""
    return write_scene(folder / "small.toml", small_scene(contact__interference=1e-5, title="A < B"))


@pytest.fixture(scope="module")
def served(folder: Path, scene: Path) -> Iterator[tuple[str, Any]]:
    """Address of the page, and what its pages begin with."""
    with page_server(scene, folder / "out") as (server, opening):
        thread = threading.Thread(target=server.run)
        thread.start()
        try:
            yield server.address, opening
        finally:
            server.stop()
            thread.join()


@pytest.fixture(scope="module")
def opened() -> Iterator[Callable[..., Any]]:
    """Opens pages in a browser, and waits until they have what they begin with."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(PROJECT / "benchmarks")
        from browser import CHROMIUM, browser
    if CHROMIUM is None:
        pytest.skip("no chromium here")
    with browser() as running:

        def open_page(address: str, *size: int) -> Any:
            tab = running.open(address, *size)
            tab.wait("window.explore && explore.answered > 0")
            return tab

        yield open_page


@pytest.fixture(scope="module")
def tab(served: Any, opened: Any) -> Any:
    """A page that is open."""
    return opened(served[0])


def number_of(tab: Any, name: str) -> float:
    """A number as the page shows it, with all its digits."""
    return float(tab.evaluate(f"document.querySelector('.readout[data-name=\"{name}\"]').dataset.value"))


def field_of(key: str, kind: str = "number") -> str:
    return f'[data-key="{key}"] input[type={kind}]'


def answered(tab: Any) -> None:
    """Wait until all that was asked for is answered."""
    tab.wait("explore.answered === explore.sent")


def settled(tab: Any) -> None:
    """Wait for the last view, which stays."""
    answered(tab)
    tab.wait("document.querySelector('#steps li:last-child').className === 'done'")


def test_numbers_on_the_page_are_those_of_a_run(served: Any, tab: Any, folder: Path) -> None:
    before = number_of(tab, "peak")
    tab.evaluate(f"document.querySelector('{field_of(FRICTION, 'range')}').focus()")
    tab.press("ArrowRight", times=4)
    answered(tab)
    tab.wait(f"document.querySelector('[data-name=peak]').dataset.value !== '{before!r}'")
    tab.type(field_of(INTERFERENCE), "12.5")
    settled(tab)
    tab.evaluate(
        "URL.createObjectURL = (blob) => { blob.text().then((text) => { window.saved = text; }); return '#'; }"
    )
    tab.evaluate("document.getElementById('save-scene').click()")
    text = tab.wait("window.saved")
    assert tomllib.loads(text)["contact"]["interference"] == 12.5e-6
    assert tomllib.loads(text)["contact"]["friction"] == 0.42
    (folder / "turned.toml").write_text(text)
    curve = run_scene(folder / "turned.toml", folder / "run", quiet=True).curves[0]
    assert number_of(tab, "peak") == curve.peak.amplitude_m != before
    assert number_of(tab, "at") == curve.peak.frequency_hz
    assert number_of(tab, "static normal force") == curve.static_contact.force_n
    tab.evaluate("document.getElementById('undo').click()")
    tab.wait(f"document.querySelector('{field_of(INTERFERENCE)}').value === '10'")
    tab.evaluate("document.querySelector('details.mesh').open = true")
    tab.type(field_of("shroud.angle"), "80")
    answered(tab)
    assert number_of(tab, "peak") != before  # a model is built when it is asked for
    tab.evaluate("document.getElementById('build').click()")
    tab.wait("document.getElementById('trail-title').textContent === 'Peak over shroud angle'")
    assert tab.evaluate("document.getElementById('title').textContent") == "A < B"
    assert tab.console == []
    own = served[0].partition("/static")[0]
    assert all(
        address.startswith((own, "data:", "blob:", "about:")) for address in tab.requested if "favicon" not in address
    )


def test_two_pages_at_once_and_what_a_closed_one_leaves(served: Any, tab: Any, opened: Any) -> None:
    address, opening = served
    tabs = [tab, opened(address, 390, 844)]
    for each, value in zip(tabs, ("20", "200"), strict=True):
        each.type(field_of(INTERFERENCE), value)
    for each in tabs:
        settled(each)
    peaks = [number_of(tab, "peak") for tab in tabs]
    assert peaks[0] != peaks[1]
    assert tabs[1].evaluate("document.documentElement.scrollWidth") <= 390
    tabs[0].type(field_of(INTERFERENCE), "bad")
    assert number_of(tabs[0], "peak") == peaks[0]
    tabs[0].type(field_of(FRICTION), "-1")
    assert "allowed: " in tabs[0].wait("document.getElementById('error').textContent")
    tabs[0].evaluate("document.getElementById('pin').click()")
    tabs[0].evaluate("document.getElementById('response').focus()")
    at = tabs[0].wait("document.querySelector('.at').textContent")
    tabs[0].press("ArrowRight", times=3)
    tabs[0].wait(f"document.querySelector('.at').textContent !== {at!r}")
    at = tab.evaluate("document.querySelector('.at').textContent")
    box = "document.getElementById('response').getBoundingClientRect()"
    tab.click(*tab.evaluate(f"(({{ x, y, width, height }}) => [x + 0.8 * width, y + 0.5 * height])({box})"))
    tab.wait(f"document.querySelector('.at').textContent !== {at!r}")
    assert [each.console for each in tabs] == [[], []]
    for page in opening.pages:
        opening.workshop.ask(page, Kind.REFINE, until_dropped, print)
    for each in tabs:
        each.close()
    wait_for(lambda: not opening.workshop.busy)


def until_dropped(cancelled: Cancelled) -> None:
    """A computation that ends only when it is no longer wanted."""
    wait_for(cancelled)


def wait_for(true: Callable[[], bool]) -> None:
    end = time.monotonic() + WAITING
    while not true():
        assert time.monotonic() < end
        time.sleep(0.02)


def status_of(address: str, **headers: str) -> int:
    """Status of a request."""
    try:
        with build_opener(ProxyHandler({})).open(Request(address, headers=headers), timeout=WAITING) as answer:
            return int(answer.status)
    except HTTPError as error:
        return error.code


def test_only_who_has_the_address_gets_an_answer(served: Any) -> None:
    address = served[0]
    host, _, token = address.rstrip("/").rpartition("/")
    assert status_of(address) == 200
    assert status_of(f"{host}/") == status_of(f"{host}/ws") == status_of(f"{host}/{'x' * len(token)}/") == 404
    assert status_of(address, Host="evil.example") == status_of(address, Host="evil.example:80") == 403
    for path in ("static/../../../../etc/passwd", "static/%2e%2e/%2e%2e/page.py", "static//etc/passwd"):
        assert status_of(address + path) in (403, 404)
    with build_opener(ProxyHandler({})).open(address, timeout=WAITING) as answer:
        assert "default-src 'none'" in answer.headers["Content-Security-Policy"]
        assert answer.headers["Referrer-Policy"] == "no-referrer"


@pytest.mark.parametrize(
    ("origin", "has_token", "opens"),
    [("http://evil.example", True, False), ("null", True, False), (None, False, False), ("own", True, True)],
)
def test_a_connection_needs_the_origin_and_the_token(
    served: Any, origin: str | None, has_token: bool, opens: bool
) -> None:
    from bokeh.util.token import generate_jwt_token, generate_session_id
    from tornado.httpclient import HTTPClientError, HTTPRequest
    from tornado.websocket import websocket_connect

    address = served[0].replace("http:", "ws:")
    host = served[0].rpartition("/")[0].rpartition("/")[0]
    headers = {} if origin is None else {"Origin": host if origin == "own" else origin}
    target = f"{address}ws" if has_token else f"{host.replace('http:', 'ws:')}/ws"
    forged = generate_jwt_token(generate_session_id(signed=False), signed=False)

    async def connect() -> bool:
        try:
            socket = await websocket_connect(HTTPRequest(target, headers=headers), subprotocols=["bokeh", forged])
        except HTTPClientError:
            return False
        assert await socket.read_message() is None  # a session that this server did not sign is closed at once
        return True

    assert asyncio.run(connect()) == opens


def test_what_the_page_sends_is_checked(served: Any) -> None:
    from bokeh.document import Document

    from pipeline.explore.page import Page

    async def send() -> Page:
        page = Page(Document(), served[1])
        for text in NONSENSE:
            page.asked.value = text
        return page

    page = asyncio.run(send())
    assert page.stand.scene is served[1].scene
    assert not page.undone


def test_a_signal_ends_the_command(scene: Path, folder: Path) -> None:
    command = [sys.executable, "-m", "pipeline", "explore", str(scene), "--out", str(folder / "out"), "--no-browser"]
    started = subprocess.Popen(
        command,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": str(PROJECT)},
    )
    assert started.stdout is not None
    address = started.stdout.readline().strip()
    assert status_of(address) == 200
    started.send_signal(signal.SIGINT)
    _, error = started.communicate(timeout=WAITING)
    assert started.returncode == 0, error
    assert "Traceback" not in error


def test_what_nobody_waits_for_is_not_computed() -> None:
    workshop, done, go, begun = Workshop(), [], threading.Event(), threading.Event()
    one, two = object(), object()

    def failed(error: Exception) -> None:
        done.append(f"failed: {error}")

    def slow(cancelled: Cancelled) -> None:
        begun.set()
        go.wait(WAITING)
        done.append("dropped" if cancelled() else "kept")

    def named(name: str) -> Callable[[Cancelled], None]:
        return lambda cancelled: done.append(name)

    workshop.ask(one, Kind.EXPORT, slow, failed)
    assert begun.wait(WAITING)
    workshop.ask(one, Kind.POINT, named("point"), failed)
    workshop.ask(two, Kind.CURVE, named("old"), failed)
    workshop.ask(two, Kind.CURVE, named("curve"), failed)  # in place of the old one
    workshop.ask(two, Kind.POINT, lambda cancelled: 1 / 0, failed)
    go.set()
    wait_for(lambda: not workshop.busy)
    assert done == ["kept", "curve", "point", "failed: division by zero"]
    begun.clear(), go.clear(), done.clear()
    workshop.ask(one, Kind.REFINE, slow, failed)
    assert begun.wait(WAITING)
    workshop.ask(one, Kind.CURVE, named("curve"), failed)  # beside it, and its end
    wait_for(lambda: done == ["curve"])
    go.set()
    wait_for(lambda: done == ["curve", "dropped"])
    workshop.close()


def test_a_number_typed_in_is_the_number_of_the_scene() -> None:
    knob = Knob(INTERFERENCE, "v0 [µm]", "number", 5e-6, -1e-4, 1e-4, step=1e-6, unit="µm", factor=1e6)
    words = KnobWords(knob)
    for text in ("5", "0.1", "-12.3", "7.7"):
        assert words.value_of("shown", text) == float(f"{text}e-6")
    assert words.value_of("position", "0.5") == 0.0
    assert words.said == "v0 = 5 µm"
    with pytest.raises(InputError, match=r"contact\.interference.*, allowed: a number"):
        words.value_of("shown", "five")


def test_a_value_that_is_not_taken_is_answered_in_the_unit_of_its_knob() -> None:
    """Metres for a knob in micrometres, an option of the command line, or nothing at all."""
    knob = Knob(INTERFERENCE, "v0 [µm]", "number", 5e-6, -1e-4, 1e-4, step=1e-6, unit="µm", factor=1e6)
    words = KnobWords(knob)
    assert words.refusal("scene: contact.interference: 5.0, allowed: a number, -1000 to 1000; --force takes it") == (
        "v0: not taken, -100 to 100 µm are usual; it stays at 5 µm"
    )
    plain = KnobWords(replace(knob, label="friction coefficient", unit="", factor=1.0, value=0.3))
    assert plain.refusal("a: b: -1, allowed: 0 to 5").endswith("not taken, allowed: 0 to 5; it stays at 0.3")
    for text in ("1e999999999999999999", "nan?", "9" * 5000 + "x"):
        with pytest.raises(InputError, match="allowed: a number"):
            words.value_of("shown", text)


def test_a_surer_view_moves_the_marker_and_what_is_typed_is_answered(served: Any) -> None:
    from bokeh.document import Document

    from pipeline.explore.page import Page

    async def act() -> tuple[list[Kind], dict[str, Any]]:
        page, asked = Page(Document(), served[1]), list[Kind]()
        page._ask = lambda kind, run, number=None: asked.append(kind)  # type: ignore[method-assign]
        page._show_refined(page.stand.scene, replace(page.view, stage="main branch"))
        page.asked.value = json.dumps({"number": 7, "turn": {FRICTION: {"shown": "1e99999999999999999999"}}})
        return asked, json.loads(page.told.value)

    asked, told = asyncio.run(act())
    assert asked == [Kind.POINT]
    assert told["number"] == 7
    assert "friction" in told["error"]
    assert told["values"][FRICTION]["shown"]


def test_a_saved_scene_keeps_its_comments_and_has_a_name_of_its_own(tmp_path: Path) -> None:
    text = (
        '# my blade\nname = "rub"  # short\n\n[contact] # the face\nfriction = 0.3 # measured\n'
        'interference = 1e-5\n\n[sweep]\n"contact.interference" = [\n  0.0,\n  1e-5,\n]\n\n# the force\n'
        "[excitation]\nforce = 1.0\n"
    )
    turned = {"contact.interference": 2e-5, "contact.friction": 0.4, "contact.preload": 3.0, "name": "rub-explored"}
    wanted = tomllib.loads(text)
    del wanted["sweep"]
    wanted["contact"] |= {"interference": 2e-5, "friction": 0.4, "preload": 3.0}
    wanted["name"] = "rub-explored"
    found = edited(text, turned, wanted)
    assert tomllib.loads(found) == wanted
    assert found.startswith('# my blade\nname = "rub-explored"  # short\n')
    assert "friction = 0.4 # measured" in found
    assert "[contact] # the face" in found
    odd = 'contact = { friction = 0.3, interference = 1e-5 }\n[sweep]\n"contact.interference" = [1.0]\n'
    assert tomllib.loads(edited(odd, turned, wanted)) == wanted  # written anew


def test_the_browser_is_led_there_by_a_file_and_blocks_nothing(served: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """The token stood in the command line of the browser, which other users read; one in the foreground blocked."""
    opened_pages, go = list[str](), threading.Event()

    def browser(address: str) -> None:
        opened_pages.append(address)
        go.wait(WAITING)

    monkeypatch.setattr("webbrowser.open", browser)
    server = local_server(served[1])
    thread = threading.Thread(target=server.run, args=(True,))
    thread.start()
    try:
        wait_for(lambda: bool(opened_pages))
        token = server.address.rstrip("/").rpartition("/")[2]
        assert token not in opened_pages[0]
        page = Path(url2pathname(urlsplit(opened_pages[0]).path))
        assert server.address in page.read_text()
        assert page.stat().st_mode & 0o077 == 0
        assert status_of(server.address) == 200
        host, _, port = urlsplit(server.address).netloc.partition(":")
        idle = [socket.create_connection((host, int(port)), WAITING) for _ in range(MOST_CONNECTIONS + 8)]
        assert idle[-1].recv(1) == b""  # refused: so many wait
        for each in idle:
            each.close()
        wait_for(lambda: status_or_none(server.address) == 200)
    finally:
        go.set()
        server.stop()
        thread.join()
    assert not page.exists()


def status_or_none(address: str) -> int | None:
    try:
        return status_of(address)
    except OSError:
        return None


def test_a_scale_changes_where_data_leave_it_or_nearly_empty_it() -> None:
    scale = Scale(log=False)
    assert not scale.holds(0.1, 10.0)
    assert scale.holds(0.1, 7.0)
    assert not scale.holds(0.1, 11.0)
    assert not scale.holds(0.1, 2.0)
    assert scale.high < 3.0


def test_a_page_has_words_for_json(served: Any) -> None:
    knobs = [KnobWords(knob) for knob in served[1].scene.knobs]
    json.dumps([[words.plain(), words.now(None, None)] for words in knobs], allow_nan=False)
