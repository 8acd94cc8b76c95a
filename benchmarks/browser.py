"""Chromium without a window, driven through its DevTools protocol: for tests, benchmarks and pictures of pages."""

from __future__ import annotations

import asyncio
import base64
import json
import shutil
import subprocess
import tempfile
import time
from collections.abc import Coroutine, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from urllib.request import ProxyHandler, Request, build_opener

from pipeline.bootstrap import TEST_PROGRAMS

CHROMIUM = next(filter(None, map(shutil.which, TEST_PROGRAMS["chromium"])), None)
OPTIONS = [
    "--headless", "--no-sandbox", "--disable-dev-shm-usage",
    "--disable-background-networking", "--no-first-run", "--disable-extensions", "--remote-debugging-port=0",
    "--disable-background-timer-throttling", "--disable-renderer-backgrounding", "--hide-scrollbars",
]  # fmt: skip
WEBGL, NO_WEBGL = ["--use-angle=swiftshader", "--enable-unsafe-swiftshader"], ["--disable-gpu"]
STARTS_WITHIN, ANSWERS_WITHIN = 30.0, 60.0  # seconds
KEYS = {"ArrowLeft": 37, "ArrowUp": 38, "ArrowRight": 39, "ArrowDown": 40, "Tab": 9, "Enter": 13, "Escape": 27}
KEYS |= {"Home": 36, "End": 35, "PageUp": 33, "PageDown": 34, " ": 32}
TEXTS = {"Enter": "\r", " ": " "}  # keys that type something


@dataclass
class Tab:
    """A page in the browser."""

    socket: Any
    loop: asyncio.AbstractEventLoop
    console: list[str] = field(default_factory=list)  # errors and messages of the page
    requested: list[str] = field(default_factory=list)  # addresses that the page has asked for
    _last: int = 0

    def call(self, method: str, **parameters: Any) -> dict[str, Any]:
        """The answer to one command of the protocol."""
        self._last += 1
        return self._run(self._answer({"id": self._last, "method": method, "params": parameters}))

    def evaluate(self, expression: str) -> Any:
        """The value of an expression of the page, awaited if it is a promise."""
        found = self.call("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        if "exceptionDetails" in found:
            raise RuntimeError(f"{expression}: {found['exceptionDetails']}")
        return found["result"].get("value")

    def wait(self, expression: str, seconds: float = ANSWERS_WITHIN) -> Any:
        """The value of an expression once it is true.

        Raises
        ------
        TimeoutError
            It does not become true.
        """
        end = time.monotonic() + seconds
        while not (found := self.evaluate(expression)):
            if time.monotonic() > end:
                raise TimeoutError(f"{expression}; the page says {self.console}")
            time.sleep(0.02)
        return found

    def press(self, key: str, times: int = 1, modifiers: int = 0) -> None:
        """Press a key; `modifiers`: 1 alt, 2 control, 8 shift."""
        code = KEYS.get(key, ord(key[0].upper()))
        known = {"key": key, "windowsVirtualKeyCode": code, "modifiers": modifiers}
        text = TEXTS.get(key, key if len(key) == 1 else "")
        for _ in range(times):
            typed = {"text": text} if text and not modifiers & 7 else {}
            self.call("Input.dispatchKeyEvent", type="keyDown" if typed else "rawKeyDown", **known, **typed)
            self.call("Input.dispatchKeyEvent", type="keyUp", **known)

    def type(self, selector: str, text: str) -> None:
        """Replace what a field holds, and press Enter."""
        self.evaluate(f"(() => {{ const f = document.querySelector({selector!r}); f.focus(); f.select(); }})()")
        self.call("Input.insertText", text=text)
        self.press("Enter")

    def click(self, x: float, y: float) -> None:
        """Click at a place of the window, pixels."""
        for kind in ("mouseMoved", "mousePressed", "mouseReleased"):
            self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", clickCount=1)

    def size(self, width: int, height: int, phone: bool = False, scale: float = 1.0) -> None:
        """Make the window so large, pixels."""
        self.call(
            "Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=scale, mobile=phone
        )

    def screenshot(self, path: Path, whole: bool = False) -> None:
        """A picture of what the window shows, or of the whole page."""
        found = self.call("Page.captureScreenshot", format="png", captureBeyondViewport=whole)
        path.write_bytes(base64.b64decode(found["data"]))

    def close(self) -> None:
        """Close the page."""
        self.call("Page.close")
        self.socket.close()

    def _run(self, answer: Coroutine[Any, Any, Any]) -> Any:
        return self.loop.run_until_complete(asyncio.wait_for(answer, ANSWERS_WITHIN))

    async def _answer(self, asked: dict[str, Any]) -> dict[str, Any]:
        await self.socket.write_message(json.dumps(asked))
        while True:
            told = await self.socket.read_message()
            if told is None:
                raise ConnectionError("the page is gone")
            message = json.loads(told)
            if message.get("id") == asked["id"]:
                if "error" in message:
                    raise RuntimeError(message["error"]["message"])
                return dict(message["result"])
            self._note(message)

    def _note(self, message: dict[str, Any]) -> None:
        method, found = message.get("method"), message.get("params", {})
        if method == "Runtime.exceptionThrown":
            details = found["exceptionDetails"]
            self.console.append(details.get("exception", {}).get("description", details["text"]))
        elif method == "Log.entryAdded":
            self.console.append(f"{found['entry']['level']}: {found['entry']['text']}")
        elif method == "Runtime.consoleAPICalled" and found["type"] in ("error", "warning", "assert"):
            self.console.append(" ".join(str(part.get("value", part.get("description"))) for part in found["args"]))
        elif method == "Network.requestWillBeSent":
            self.requested.append(found["request"]["url"])


@dataclass
class Browser:
    """A running browser."""

    port: int
    loop: asyncio.AbstractEventLoop

    def open(self, address: str, width: int = 1280, height: int = 800) -> Tab:
        """Open a page of this size, pixels."""
        from tornado.websocket import websocket_connect

        request = Request(f"http://127.0.0.1:{self.port}/json/new?about:blank", method="PUT")
        with build_opener(ProxyHandler({})).open(request, timeout=ANSWERS_WITHIN) as answer:
            target = json.load(answer)["webSocketDebuggerUrl"]

        async def connected() -> Any:
            return await websocket_connect(target, max_message_size=100_000_000)

        tab = Tab(self.loop.run_until_complete(connected()), self.loop)
        for domain in ("Page", "Runtime", "Log", "Network"):
            tab.call(f"{domain}.enable")
        tab.size(width, height)
        tab.call("Page.navigate", url=address)
        return tab


@contextmanager
def browser(webgl: bool = True) -> Iterator[Browser]:
    """A browser that is ended with the block, with all that it has kept.

    With `webgl` a processor without a graphics card draws everything by a library for it, which takes longer.

    Raises
    ------
    TimeoutError
        It does not start.
    """
    assert CHROMIUM is not None, "no chromium here"
    loop = asyncio.new_event_loop()
    with tempfile.TemporaryDirectory(prefix="shroud-browser-", ignore_cleanup_errors=True) as folder:
        command = [CHROMIUM, *OPTIONS, *(WEBGL if webgl else NO_WEBGL), f"--user-data-dir={folder}", "about:blank"]
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            port = _port(Path(folder) / "DevToolsActivePort")
            yield Browser(port, loop)
        finally:
            process.terminate()
            process.wait()
            loop.close()


def _port(file: Path) -> int:
    end = time.monotonic() + STARTS_WITHIN
    while time.monotonic() < end:
        if file.is_file() and (lines := file.read_text().splitlines()):
            return int(lines[0])
        time.sleep(0.05)
    raise TimeoutError("the browser does not start")
