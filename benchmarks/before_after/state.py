"""One state of the program: its folder, and processes and commands of it that are timed."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import tempfile
import time
import tomllib
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
WITHOUT_BYTECODE = "PYTHONDONTWRITEBYTECODE"  # some containers set it: every process compiles the sources
PACKAGES = ("geometry", "rom", "nonlinear", "pipeline", "scenes")


class CaseError(Exception):
    """A case could not be measured."""


@dataclass(frozen=True)
class Used:
    """What a command took with all its processes: seconds on the clock and of the processors, largest memory, GB."""

    wall: float
    cpu: float
    memory: float
    status: int
    output: str = ""

    def figures(self) -> dict[str, float]:
        """The three numbers by name."""
        return {"wall": self.wall, "cpu": self.cpu, "memory": self.memory}


@dataclass(frozen=True)
class State:
    """The root of a working copy. It is run by this interpreter: the libraries are the same for all states."""

    root: Path

    def commit(self) -> str:
        """Short name of its commit, with "+" where files differ from it; empty without git."""
        described = subprocess.run(
            ["git", "-C", str(self.root), "describe", "--always", "--dirty=+"],
            capture_output=True,
            text=True,
            check=False,
        )
        return described.stdout.strip()

    def measured(self, case: str, models: Path, limit: float, **arguments: Any) -> dict[str, Any]:
        """The answer of a case of `measured_process.py`, with one BLAS thread.

        Raises
        ------
        CaseError
            It failed, or took longer than `limit` seconds.
        """
        environment = _environment(self._path("benchmarks", "")) | dict.fromkeys(THREADS, "1")
        asked = json.dumps({"models": str(models.resolve()), **arguments})
        used = timed([sys.executable, str(HERE / "measured_process.py"), case, asked], self.root, environment, limit)
        lines = used.output.strip().splitlines()
        if used.status != 0 or not lines:
            raise CaseError(f"{case}: {_ending(used, limit)}")
        found: dict[str, Any] = json.loads(lines[-1])
        return found

    def command(self, arguments: Sequence[str], limit: float, root: Path | None = None) -> Used:
        """`shroud` with these arguments as a user starts it; of another folder with the same packages, if `root`.

        Raises
        ------
        CaseError
            It took longer than `limit` seconds.
        """
        environment = _environment(str(root or self.root))
        used = timed([sys.executable, "-P", "-c", self._entry(), *arguments], root or self.root, environment, limit)
        if used.status < 0:
            raise CaseError(f"shroud {arguments[0]}: {_ending(used, limit)}")
        return used

    def _entry(self) -> str:
        project = tomllib.loads((self.root / "pyproject.toml").read_text(encoding="utf-8"))
        module, _, function = project["project"]["scripts"]["shroud"].partition(":")
        return f"import sys; from {module} import {function}; sys.exit({function}())"

    def _path(self, *folders: str) -> str:
        return os.pathsep.join(str(self.root / folder) for folder in folders)


def _environment(path: str) -> dict[str, str]:
    """That of a user who has set nothing, with modules from `path`."""
    own = (*THREADS, WITHOUT_BYTECODE)
    return {name: value for name, value in os.environ.items() if name not in own} | {"PYTHONPATH": path}


def timed(command: Sequence[str], folder: Path, environment: Mapping[str, str], limit: float) -> Used:
    """Run a command and wait for it; what is still running after `limit` seconds is ended with all its processes."""
    with tempfile.TemporaryFile("w+", encoding="utf-8") as output:
        start = time.perf_counter()
        process = subprocess.Popen(
            command,
            cwd=folder,
            env=dict(environment),
            stdout=output,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )
        handler = signal.signal(signal.SIGALRM, lambda *_: _end(process))
        signal.setitimer(signal.ITIMER_REAL, limit)
        try:
            _, status, usage = os.wait4(process.pid, 0)
        except BaseException:
            _end(process)
            raise
        finally:
            signal.setitimer(signal.ITIMER_REAL, 0.0)
            signal.signal(signal.SIGALRM, handler)
        wall = time.perf_counter() - start
        process.returncode = os.waitstatus_to_exitcode(status)
        output.seek(0)
        cpu = usage.ru_utime + usage.ru_stime
        return Used(wall, cpu, usage.ru_maxrss / 2**20, process.returncode, output.read())


def _end(process: subprocess.Popen[bytes]) -> None:
    """End the process and those that it has started, which are one group."""
    with suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)


def _ending(used: Used, limit: float) -> str:
    if used.status == -signal.SIGKILL and used.wall >= limit:
        return f"over {limit:g} s"
    lines = used.output.strip().splitlines()
    return lines[-1] if lines else f"exit status {used.status}"
