"""On what and when something was measured: every table of the benchmarks says it in the same words."""

from __future__ import annotations

import os
import platform
import time
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

LIBRARIES = ("numpy", "scipy", "numba", "scikit-fem", "gmsh")


def hardware() -> str:
    """Processors and Python, `2 x x86_64, Python 3.11.2`."""
    return f"{os.cpu_count()} x {platform.machine()}, Python {platform.python_version()}"


def processor() -> str:
    """What the processor calls itself, empty where the system does not say."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return ""
    return next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), "")


def today() -> str:
    """The date as year-month-day."""
    return time.strftime("%Y-%m-%d")


def load() -> float:
    """Processes that wanted a processor in the last minute: above the number of processors times are too long."""
    return os.getloadavg()[0]


@dataclass(frozen=True)
class Machine:
    """Date, hardware, operating system, library versions, BLAS threads and load of a measurement."""

    date: str
    hardware: str
    system: str
    versions: str
    blas_threads: int
    load: float

    def short(self) -> str:
        """One line for people."""
        return f"{self.date}; {self.hardware}; {self.system}; {self.versions}; one BLAS thread."

    def facts(self) -> dict[str, str]:
        """Name -> text, for the head of a table."""
        return {
            "date": self.date,
            "machine": self.hardware,
            "system": self.system,
            "versions": self.versions,
            "BLAS threads": str(self.blas_threads),
            "load of the machine at the end": f"{self.load:.1f}",
        }


def this_machine(blas_threads: int, libraries: Sequence[str] = LIBRARIES) -> Machine:
    """The machine as it is now.

    Raises
    ------
    PackageNotFoundError : a library is not installed.
    """
    name = processor()
    return Machine(
        today(),
        hardware() + (f", {name}" if name else ""),
        f"{platform.system()} {platform.release()}",
        ", ".join(f"{library} {version(library)}" for library in libraries),
        blas_threads,
        load(),
    )
