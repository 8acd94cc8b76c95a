"""Sweeps by processes and on clusters: `python benchmarks/cluster.py` from the project folder.

    python benchmarks/cluster.py                        # 1 000 curves by each engine, faults, overhead, costs
    python benchmarks/cluster.py --curves 200 --kills 5

A small model with H = 1 and without any extras; friction and interference are swept. Every case starts from nothing
and ends with a hash of all numbers in response.h5 and of response.csv. Writes cluster.csv and cluster.md into
out/bench/cluster.
"""

from __future__ import annotations

import csv
import hashlib
import json
import math
import os
import random
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from tables import machine_line, markdown_table, options_of, table_of, write_results

from pipeline.stages.warm_up import small_model
from rom import write_reduced_model

INTERFERENCES = 25  # the other parameter is the friction coefficient
SCENE = """name = "many"
[contact]
normal_stiffness = 1.6
tangential_stiffness = 0.8
[excitation]
engine_order = 1
force = 0.6
[response]
frequency = [0.10, 0.20]
damping_ratio = 0.05
harmonics = 1
stability = "folds"
detached = false
truncation = false
search = "off"
[sweep]
"contact.friction" = {frictions}
"contact.interference" = {interferences}
"""
TIMES = "seconds"  # the only values that differ from run to run
PARTS = ("engines", "faults", "reuse", "workers")
LIMIT = 1800.0  # seconds for a case


def main(arguments: list[str] | None = None) -> int:
    """Run all cases and write the tables; 1 where two of them differ."""
    parser = options_of(__doc__, "cluster")
    parser.add_argument("--curves", type=int, default=1000)
    parser.add_argument("--kills", type=int, default=20)
    parser.add_argument("--workers", type=int, nargs="+", default=[1, 2, 4])
    parser.add_argument("--parts", nargs="+", default=PARTS, choices=PARTS)
    options = parser.parse_args(arguments)
    rows: list[dict[str, Any]] = []
    texts = []
    with tempfile.TemporaryDirectory(prefix="shroud-cluster-") as name:
        scene = write_case(Path(name), options.curves)
        if "engines" in options.parts:
            rows += engine_rows(scene)
            client = rows[-1]["client s"] / rows[-1]["curves"]
            texts += cost_texts(client, size_of_results(scene) / rows[-1]["curves"])
        if "faults" in options.parts:
            rows += fault_rows(scene, options.kills)
        if "reuse" in options.parts:
            rows += reuse_rows(scene)
        if "workers" in options.parts:
            texts = ["Workers on one machine:", table_of(efficiency_rows(scene, options.workers)), *texts]
    same = len({row["bits"] for row in rows if row["bits"]}) <= 1
    title = f"# {options.curves} curves by processes and on clusters\n\n{machine_line()}."
    texts = [title, *([table_of(rows), "The same bits." if same else "CASES DIFFER."] if rows else []), *texts]
    write_results(options.out, "cluster", rows or [{}], "\n\n".join(texts) + "\n")
    return 0 if same else 1


def write_case(folder: Path, curves: int) -> Path:
    """The scene and its reduced model, a ring of four blades of three masses each; returns the scene."""
    write_reduced_model(folder / "model.h5", small_model())
    return write_scene(folder / "scene.toml", curves)


def write_scene(path: Path, curves: int, more: Sequence[float] = ()) -> Path:
    """The scene with so many curves; `more`: further friction coefficients."""
    number = min(INTERFERENCES, curves)
    frictions = np.linspace(0.1, 0.6, max(1, curves // number)).round(6).tolist()
    interferences = np.linspace(0.05, 0.3, number).round(6).tolist()
    path.write_text(SCENE.format(frictions=[*frictions, *more], interferences=interferences), encoding="utf-8")
    return path


def engine_rows(scene: Path) -> Iterator[dict[str, Any]]:
    """The same sweep by each engine."""
    for name, options in (("this process", ["--jobs", "1"]), ("2 processes", ["--jobs", "2"])):
        yield run_case(scene, name, options)
    with programs(scene.parent, 2) as (file, _):
        yield run_case(scene, "scheduler and 2 workers apart", ["--scheduler", str(file)])


def fault_rows(scene: Path, kills: int) -> Iterator[dict[str, Any]]:
    """Workers killed at random, the scheduler killed, the client killed; the same command each time."""
    chance = random.Random(20261122)
    shutil.rmtree(scene.parent / "out", ignore_errors=True)
    with programs(scene.parent, 2) as (file, workers):
        process, start, done = client(scene, file), time.perf_counter(), 0
        while not os.waitid(os.P_PID, process.pid, os.WEXITED | os.WNOHANG | os.WNOWAIT):
            time.sleep(chance.uniform(0.5, 1.5))
            if done < kills:
                number = chance.randrange(len(workers))
                workers[number].kill()  # a worker without a nanny
                workers[number] = worker(scene.parent, file, f"again-{done}")
                done += 1
        yield ended(scene, f"{done} workers killed", process, start)
    shutil.rmtree(scene.parent / "out", ignore_errors=True)
    start = time.perf_counter()
    with programs(scene.parent, 2) as (file, _):
        process = client(scene, file)
        wait_for_results(scene, 20)
    code = process.wait(LIMIT)  # 1: the scheduler is lost
    with programs(scene.parent, 2) as (file, _):
        yield ended(scene, f"scheduler killed (exit status {code}), started again", client(scene, file), start)
        shutil.rmtree(scene.parent / "out", ignore_errors=True)
        start, process = time.perf_counter(), client(scene, file)
        wait_for_results(scene, 20)
        process.kill()
        process.wait()
        yield ended(scene, "client killed, started again", client(scene, file), start)


def reuse_rows(scene: Path) -> Iterator[dict[str, Any]]:
    """A second run by another engine, and one more value of a parameter, on the results that are there."""
    if not (scene.parent / "out").exists():
        run_case(scene, "first run", ["--jobs", "2"])
    again = run_case(scene, "second run, 2 processes", ["--jobs", "2"], fresh=False)
    original = scene.read_text(encoding="utf-8")
    write_scene(scene, again["curves"], more=[0.7])
    more = run_case(scene, "one more friction coefficient", ["--cluster", "local:2"], fresh=False) | {"bits": ""}
    scene.write_text(original, encoding="utf-8")
    yield from (again, more)


def efficiency_rows(scene: Path, workers: Sequence[int]) -> list[dict[str, Any]]:
    """The stage respond with 1, 2, 4 workers: its loss against the seconds that the tasks themselves ran."""
    rows = []
    for number in workers:
        row = run_case(scene, f"local:{number}", ["--cluster", f"local:{number}"])
        tasks = sum(seconds_of_tasks(scene))
        busy = min(number, os.cpu_count() or 1)
        rows.append(
            {
                "workers": number,
                "seconds": row["seconds"],
                "of tasks": round(tasks, 1),
                "efficiency": round(tasks / (busy * row["seconds"]), 2),
                "overhead a task ms": round(1e3 * (busy * row["seconds"] - tasks) / row["curves"], 1),
                "result kB": round(size_of_results(scene) / row["curves"] / 1e3, 1),
            }
        )
    return rows


def cost_texts(client: float, size: float) -> list[str]:
    """Time and traffic of large sweeps, from the seconds of the client and the bytes of the result of a curve."""
    table = []
    for curves in (10_000, 1_000_000):
        for cores in (100, 1000):
            for seconds in (0.1, 2.0, 60.0):
                at_workers, at_client = curves * seconds / cores, curves * client
                table.append(
                    (
                        f"{curves:.0e}",
                        cores,
                        seconds,
                        duration(max(at_workers, at_client)),
                        "client" if at_client > at_workers else "workers",
                        f"{curves * size / 1e9:.3g}",
                        f"{curves * size / 1e6 / max(at_workers, at_client):.3g}",
                        math.ceil(client * cores / seconds) if client * cores > seconds else "",
                    )
                )
    head = "curves", "cores", "s a curve", "time", "limit", "traffic GB", "MB/s", "clients needed"
    said = (
        f"Calculated, with {1e3 * client:.1f} ms of the client and {size / 1e3:.0f} kB a curve. The client is the "
        f"limit above 1 / {1e3 * client:.1f} ms = {1 / client:.0f} curves a second."
    )
    return [said, markdown_table(head, table)]


def duration(seconds: float) -> str:
    """A time in the unit that suits it."""
    for limit, unit, name in ((120.0, 1.0, "s"), (7200.0, 60.0, "min"), (172800.0, 3600.0, "h")):
        if seconds < limit:
            return f"{seconds / unit:.3g} {name}"
    return f"{seconds / 86400.0:.3g} d"


def run_case(scene: Path, name: str, options: Sequence[str], fresh: bool = True) -> dict[str, Any]:
    """Run the scene and look at what came of it; `fresh`: from nothing."""
    if fresh:
        shutil.rmtree(scene.parent / "out", ignore_errors=True)
    start = time.perf_counter()
    return ended(scene, name, begun(scene, options), start)


def begun(scene: Path, options: Sequence[str]) -> subprocess.Popen[str]:
    """The command, in a process of its own."""
    out, rom = scene.parent / "out", scene.parent / "model.h5"
    command = [sys.executable, "-m", "pipeline", "respond", scene, "--rom", rom, "--out", out, "--quiet", *options]
    return subprocess.Popen([str(part) for part in command], stderr=subprocess.PIPE, text=True)


def client(scene: Path, file: Path) -> subprocess.Popen[str]:
    """The command on the cluster of a scheduler file; from nothing where no client was there before."""
    return begun(scene, ["--scheduler", str(file)])


def ended(scene: Path, name: str, process: subprocess.Popen[str], start: float) -> dict[str, Any]:
    """A row of the table, after the end of a command."""
    _, status, usage = os.wait4(process.pid, 0)  # with quiet there are a few lines on stderr at most
    if status:
        raise RuntimeError(f"{name}: exit status {os.waitstatus_to_exitcode(status)}: {process.stderr.read()}")
    process.returncode = 0
    summary = json.loads((scene.parent / "out" / "summary.json").read_text(encoding="utf-8"))
    stage = summary["stages"]["respond"]
    with (scene.parent / "out" / "curves.csv").open(encoding="utf-8", newline="") as file:
        curves = list(csv.DictReader(file))
    print(f"{name}: {stage['seconds']:.1f} s", file=sys.stderr)
    return {
        "case": name,
        "curves": len(curves),
        "computed": stage["ran"],
        "complete": sum(curve["complete"] == "1" for curve in curves),
        "seconds": round(stage["seconds"], 1),
        "whole": round(time.perf_counter() - start, 1),
        "client s": round(usage.ru_utime + usage.ru_stime, 1),
        "bits": bits(scene.parent / "out"),
    }


def bits(out: Path) -> str:
    """Hash of all numbers of a run but its times."""
    digest = hashlib.sha256((out / "response.csv").read_bytes())

    def add(name: str, item: h5py.Group | h5py.Dataset) -> None:
        digest.update(name.encode())
        if isinstance(item, h5py.Dataset) and not name.endswith(TIMES):
            digest.update(repr(item[()].tolist()).encode() if item.dtype.hasobject else item[()].tobytes())
        for key, value in sorted(item.attrs.items()):
            digest.update(b"" if key == TIMES else f"{key} {value!r}".encode())

    with h5py.File(out / "response.h5") as file:
        file.visititems(add)
    return digest.hexdigest()[:12]


def wait_for_results(scene: Path, count: int) -> None:
    """Wait until the store holds so many more curves than now."""
    folder = scene.parent / "out" / "store" / "curve"

    def number() -> int:
        return len(list(folder.iterdir())) if folder.is_dir() else 0

    wanted, deadline = number() + count, time.monotonic() + LIMIT
    while number() < wanted and time.monotonic() < deadline:
        time.sleep(0.1)


def seconds_of_tasks(scene: Path) -> Iterator[float]:
    """How long the task of each curve ran."""
    for path in (scene.parent / "out" / "store" / "curve").glob("*/entry.json"):
        yield json.loads(path.read_text(encoding="utf-8"))["seconds"]


def size_of_results(scene: Path) -> int:
    """Bytes of all curves in the store."""
    return sum(path.stat().st_size for path in (scene.parent / "out" / "store" / "curve").glob("*/curve.h5"))


@contextmanager
def programs(folder: Path, count: int) -> Iterator[tuple[Path, list[subprocess.Popen[bytes]]]]:
    """A scheduler and workers as programs of their own, in folders of their own; all are killed at the end."""
    place = Path(tempfile.mkdtemp(prefix="scheduler-", dir=folder))
    file = place / "scheduler.json"
    scheduler = started("dask_scheduler", place, ["--scheduler-file", file, "--host", "127.0.0.1", "--port", "0"])
    deadline = time.monotonic() + 60.0
    while not (file.is_file() and file.read_text().endswith("}")) and time.monotonic() < deadline:
        time.sleep(0.05)
    workers = [worker(folder, file, f"worker-{number}") for number in range(count)]
    try:
        yield file, workers
    finally:
        for process in (scheduler, *workers):
            process.kill()
            process.wait()


def worker(folder: Path, file: Path, name: str) -> subprocess.Popen[bytes]:
    """A worker in a folder of its own, which it shares with nobody."""
    place = Path(tempfile.mkdtemp(prefix=f"{name}-", dir=folder))
    address = json.loads(file.read_text(encoding="utf-8"))["address"]
    options = [address, "--nthreads", "1", "--no-nanny", "--no-dashboard", "--local-directory", place]
    return started("dask_worker", place, [*options, "--host", "127.0.0.1"])


def started(program: str, place: Path, options: Sequence[object]) -> subprocess.Popen[bytes]:
    """A program of dask.distributed that runs in a folder."""
    paths = [str(Path(__file__).resolve().parents[1]), os.environ.get("PYTHONPATH", "")]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, paths)), "OPENBLAS_NUM_THREADS": "1"}
    command = [sys.executable, "-m", f"distributed.cli.{program}", *(str(option) for option in options)]
    return subprocess.Popen(command, cwd=place, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


if __name__ == "__main__":
    sys.exit(main())
