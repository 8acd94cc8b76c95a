"""Drawing in a process of its own: without a GL library VTK does not raise, it crashes."""

from __future__ import annotations

import os
import stat
import subprocess
import sys
import threading
from collections.abc import Sequence
from pathlib import Path

from pipeline.errors import one_line
from pipeline.process.interrupts import kept_from_children

_REMEDY = "apt-get install -y libegl1 libgl1 libxrender1"


class RenderError(Exception):
    """The drawing process did not come back with its pictures."""


def draw_apart(module: str, job: str, pictures: Sequence[Path]) -> None:
    """Run `python -m module job`, which is to make the pictures. It ends when this process does.

    Raises
    ------
    RenderError : the process died or a picture is missing; the message says what usually mends it.
    """
    command = [sys.executable, "-m", module, job]
    with kept_from_children():
        process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    with process:
        try:
            assert process.stdout is not None
            # communicate() would close the input, by which the process knows that its parent is there
            output = process.stdout.read().decode(errors="replace")
            status = process.wait()
        except BaseException:
            process.kill()
            raise
    if status < 0:
        raise RenderError(f"the drawing process crashed, most likely for want of a GL library: {_REMEDY}")
    if status > 0 or not all(picture.is_file() for picture in pictures):
        said = one_line((output.strip().splitlines() or ["no picture"])[-1])
        raise RenderError(f"{said} (if a GL library is missing: {_REMEDY})")


def end_with_parent() -> None:
    """In the drawing process: end when the one that started it is gone, however that ended."""
    if not stat.S_ISFIFO(os.fstat(0).st_mode):
        return  # started by hand

    def watch() -> None:
        os.read(0, 1)
        os._exit(1)

    threading.Thread(target=watch, name="watch parent", daemon=True).start()
