"""Drawing in a process of its own, because VTK crashes where there is no GL library.

A job is JSON on the command line of the process.
"""

from __future__ import annotations

import json
import os
import signal
import stat
import subprocess
import sys
import threading
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from importlib import import_module
from pathlib import Path
from typing import Self, TypeVar

from pipeline.bootstrap import missing_packages
from pipeline.errors import one_line
from pipeline.process.interrupts import kept_from_children
from pipeline.process.program import defer_unused, loading


@dataclass(frozen=True)
class Job:
    """What the drawing process draws."""

    def to_json(self) -> str:
        """The job on one line."""
        return json.dumps(asdict(self))

    @classmethod
    def from_json(cls, text: str) -> Self:
        """The job that `to_json` wrote."""
        return cls(**{key: tuple(v) if isinstance(v, list) else v for key, v in json.loads(text).items()})


@dataclass(frozen=True)
class RenderJob(Job):
    """Mode shapes of one reduced model."""

    # `sector`, `rom`: files of the mesh and of the reduced model
    sector: str
    rom: str
    # `folder`, `prefix`: pictures are `<prefix>mode_<number>.png` in `folder`
    folder: str
    prefix: str
    title: str  # first part of the heading
    modes: tuple[int, ...]  # mode numbers, from 1
    deformation: float  # largest drawn displacement, m
    contact: str  # state of the shrouds: free, sliding or stuck
    blades: int  # blades drawn side by side
    phase: float  # inter-blade phase angle, rad
    # `normal`, `tangential`: contact springs of each node, N/m
    normal: tuple[float, ...]
    tangential: tuple[float, ...]
    # those of stuck shrouds, whose modes are drawn too; empty where they are not
    stuck_normal: tuple[float, ...] = ()
    stuck_tangential: tuple[float, ...] = ()
    coriolis: bool = False  # whether these forces act in the response


@dataclass(frozen=True)
class OperatingJob(Job):
    """The operating deflection shape of one curve: `<name>.png` and `<name>.gif` in `folder`."""

    # `sector`, `rom`, `curve`: files of the mesh, of the reduced model and of the curve
    sector: str
    rom: str
    curve: str
    # `folder`, `name`: folder and base name of the pictures
    folder: str
    name: str
    title: str  # heading
    deformation: float  # largest drawn displacement, m
    blades: int  # blades drawn side by side
    frames: int  # frames of the animation, one period


J = TypeVar("J", bound=Job)
_PROJECT = Path(__file__).parents[2]
_ASIDE, _NICENESS = "SHROUD_DRAWING_ASIDE", 5  # the niceness leaves it a seventh of two busy cores
_DRAWING_PACKAGES = ("libgl1", "libxrender1", "libegl1")  # of those that the bootstrap looks for


class RenderError(Exception):
    """The drawing process did not come back with its pictures."""


def draw_apart(module: str, job: str, pictures: Sequence[Path]) -> None:
    """Run `python -m module job`, which draws the pictures. It ends when this process does."""
    Drawing(module, job).finish(pictures)


class Drawing:
    """A process `python -m module job` that has started; it ends when this process does."""

    def __init__(self, module: str, job: str | None, aside: bool = False) -> None:
        command, pipe = [sys.executable, "-m", module, *([] if job is None else [job])], subprocess.PIPE
        with kept_from_children():
            search = os.pathsep.join(filter(None, (str(_PROJECT), os.environ.get("PYTHONPATH"))))
            environment = os.environ | {"PYTHONPATH": search}  # of this program, wherever it was started
            environment |= {_ASIDE: "1"} if aside else {}
            self._process = subprocess.Popen(
                command, bufsize=0, env=environment, stdin=pipe, stdout=pipe, stderr=subprocess.STDOUT
            )

    def begin(self, job: str) -> None:
        """Give the job, on one line, to a process that waits for it."""
        assert self._process.stdin is not None
        # not closed: by its end the process knows that its parent has ended
        self._process.stdin.write(f"{job}\n".encode())

    def finish(self, pictures: Sequence[Path]) -> None:
        """Wait for the pictures."""
        with self._process as process:
            try:
                assert process.stdout is not None
                # communicate() would close the input, by which the process knows that its parent is there
                output = process.stdout.read().decode(errors="replace")
                status = process.wait()
            except BaseException:
                process.kill()
                raise
        if status < 0:
            raise RenderError(f"the drawing process crashed ({_signal_name(-status)}){_remedy()}")
        if status > 0 or not all(picture.is_file() for picture in pictures):
            last_line = one_line((output.strip().splitlines() or ["no picture"])[-1])
            raise RenderError(f"{last_line}{_remedy()}")

    def end(self) -> None:
        """Kill the process, where it still runs."""
        with self._process as process:
            process.kill()


def _signal_name(number: int) -> str:
    """Name of the signal that ended a process."""
    with suppress(ValueError):
        return signal.Signals(number).name
    return f"signal {number}"


def _remedy() -> str:
    """How to install the libraries for drawing that are missing here; nothing where none is."""
    missing = [package for package in missing_packages() if package in _DRAWING_PACKAGES]
    return f"; missing on this machine: apt-get install -y {' '.join(missing)}" if missing else ""


def end_with_parent() -> None:
    """In the drawing process: end when the process that started it has ended."""
    if not stat.S_ISFIFO(os.fstat(0).st_mode):
        return  # started by hand

    def watch() -> None:
        os.read(0, 1)
        os._exit(1)

    threading.Thread(target=watch, name="watch parent", daemon=True).start()


def drawing_main(draw: Callable[[J], None], kind: type[J], libraries: Sequence[str] = ()) -> None:
    """Entry point of the drawing process: draw the job on the command line; an error is one line on stderr.

    Without a job there the `libraries` that drawing takes are loaded, and the job is awaited on stdin.
    """
    if os.environ.get(_ASIDE):
        os.nice(_NICENESS)
    job = sys.argv[1] if len(sys.argv) > 1 else _awaited_job(libraries)
    end_with_parent()
    try:
        draw(kind.from_json(job))
    except Exception as error:  # the calling process shows the last line
        sys.exit(one_line(f"{type(error).__name__}: {error}"))


def _awaited_job(libraries: Sequence[str]) -> str:
    """The job that comes on stdin; the process ends where its parent does before that."""
    with loading(), suppress(ImportError):  # drawing will tell
        defer_unused()
        for library in libraries:
            import_module(library)
    return sys.stdin.readline() or sys.exit("no job")
