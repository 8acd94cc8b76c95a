"""Drawing in a process of its own: without a GL library VTK does not raise, it crashes."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from pipeline.errors import one_line

_REMEDY = "apt-get install -y libegl1 libgl1 libxrender1"


class RenderError(Exception):
    """The drawing process did not come back with its pictures."""


def draw_apart(module: str, job: str, pictures: Sequence[Path]) -> None:
    """Run `python -m module job`, which is to make the pictures.

    Raises
    ------
    RenderError : the process died or a picture is missing; the message says what usually mends it.
    """
    result = subprocess.run([sys.executable, "-m", module, job], capture_output=True, text=True, check=False)
    if result.returncode < 0:
        raise RenderError(f"the drawing process crashed, most likely for want of a GL library: {_REMEDY}")
    if result.returncode > 0 or not all(picture.is_file() for picture in pictures):
        said = one_line((result.stderr.strip().splitlines() or ["no picture"])[-1])
        raise RenderError(f"{said} (if a GL library is missing: {_REMEDY})")
