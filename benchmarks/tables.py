"""What the benchmarks share: their options, tables as CSV and Markdown, the machine, and processes of their own."""

from __future__ import annotations

import argparse
import csv
import json
import os
import platform
import subprocess
import sys
import time
from collections.abc import Iterable, Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
OUT = ROOT / "out" / "bench"
LIBRARIES = ("numpy", "scipy", "numba", "scikit-fem", "gmsh")

Row = Mapping[str, Any]


def options_of(description: str | None, name: str, scene: str = "dummy.toml") -> argparse.ArgumentParser:
    """A parser with what every benchmark takes: the scene whose blade is used, and the output folder."""
    form = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(description=description, formatter_class=form)
    parser.add_argument("--scene", type=Path, default=ROOT / "scenes" / scene, help="whose blade to use")
    parser.add_argument("--out", type=Path, default=OUT / name, help="output folder")
    return parser


def markdown_table(header: Iterable[object], rows: Iterable[Iterable[object]]) -> str:
    """Lines of a table, without a line break at its end."""
    header = list(header)
    lines = [header, ["---"] * len(header), *rows]
    return "\n".join("| " + " | ".join(str(value) for value in line) + " |" for line in lines)


def table_of(rows: Sequence[Row]) -> str:
    """Rows of equal keys as they are, the keys as head of the table."""
    return markdown_table(rows[0], (row.values() for row in rows))


def write_rows(file: Path, rows: Sequence[Row]) -> None:
    """Write rows of equal keys as CSV; a run that is stopped meanwhile leaves the last complete file."""
    file.parent.mkdir(parents=True, exist_ok=True)
    new = file.with_suffix(".new")
    with new.open("w", newline="", encoding="utf-8") as target:
        writer = csv.DictWriter(target, fieldnames=list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)
    new.replace(file)


def write_results(out: Path, name: str, rows: Sequence[Row], text: str) -> None:
    """Write `name`.csv and `name`.md into the folder `out`, and print the Markdown."""
    write_rows(out / f"{name}.csv", rows)
    (out / f"{name}.md").write_text(text, encoding="utf-8")
    print(text)


def today() -> str:
    """The date as year-month-day."""
    return time.strftime("%Y-%m-%d")


def hardware() -> str:
    """Processors and Python, `2 x x86_64, Python 3.11.2`."""
    return f"{os.cpu_count()} x {platform.machine()}, Python {platform.python_version()}"


def load() -> float:
    """Mean number of runnable processes in the last minute; above the number of processors, times are too long."""
    return os.getloadavg()[0]


def machine_line() -> str:
    """Date, hardware and load, for the line above a table."""
    return f"{today()}, {hardware()}, load of the machine {load():.1f} at the end"


def machine_facts(blas_threads: int = 1) -> dict[str, str]:
    """Name -> text: date, hardware, operating system, library versions, BLAS threads and load."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    processor = next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), "")
    return {
        "date": today(),
        "machine": hardware() + (f", {processor}" if processor else ""),
        "system": f"{platform.system()} {platform.release()}",
        "versions": ", ".join(f"{library} {version(library)}" for library in LIBRARIES),
        "BLAS threads": str(blas_threads),
        "load of the machine at the end": f"{load():.1f}",
    }


def peak_memory_gb() -> float:
    """Largest resident memory of this process so far, GB."""
    import resource

    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20


def in_a_process(script: str, *arguments: Any) -> Any:
    """`script.measure(*arguments)` in a process of its own, for its memory; arguments and result pass as JSON."""
    code = f"import json, sys, {script} as s; print(json.dumps(s.measure(*json.loads(sys.argv[1]))))"
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(Path(__file__).parent), str(ROOT)])}
    command = [sys.executable, "-c", code, json.dumps(arguments, default=str)]
    done = subprocess.run(command, env=environment, cwd=ROOT, check=True, stdout=subprocess.PIPE, text=True)
    return json.loads(done.stdout.splitlines()[-1])
