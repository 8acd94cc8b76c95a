"""A run that is killed leaves no half-written file, and the same command goes on from what was done."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

from pipeline_support import shroud, small_scene, statuses, summary_of, write_scene

from pipeline.store.content_store import Store

FRICTIONS = [0.1 + 0.01 * i for i in range(14)]


def entries(out: Path, kind: str) -> list[Path]:
    """Entries of one kind in the store."""
    folder = out / "store" / kind
    return sorted(folder.iterdir()) if folder.is_dir() else []


def test_killed_and_resumed(copied: Path) -> None:
    scene = write_scene(copied.parent / "s.toml", small_scene(sweep={"contact.friction": FRICTIONS}))
    before = {path.name for path in entries(copied, "curve")}
    command = [sys.executable, "-m", "pipeline", "run", scene, "--out", copied, "--until", "respond", "--quiet"]
    process = subprocess.Popen(command, env={**os.environ, "OPENBLAS_NUM_THREADS": "1"})
    deadline = time.monotonic() + 60.0
    while len(entries(copied, "curve")) < len(before) + 3 and time.monotonic() < deadline:
        time.sleep(0.002)
    process.send_signal(signal.SIGKILL)
    assert process.wait() == -signal.SIGKILL
    done = [path.name for path in entries(copied, "curve") if path.name not in before]
    assert 3 <= len(done) < len(FRICTIONS)
    store = Store(copied / "store")
    assert all(store.find("curve", key) for key in done)

    status, _, error = shroud("run", scene, "--out", copied, "--until", "respond", "--quiet")
    assert (status, error) == (0, "")
    respond = summary_of(copied)["stages"]["respond"]
    # the curve at friction 0.4 belongs to the run that was copied
    assert respond["reused"] in (len(done), len(done) + 1)
    assert respond["ran"] + respond["reused"] == len(FRICTIONS)
    assert statuses(copied)["reduce"] == "reused"
    assert entries(copied, "tmp") == []
    assert all(curve["complete"] for curve in summary_of(copied)["curves"])


def test_workers_solve_the_same_curves(copied: Path) -> None:
    scene = write_scene(copied.parent / "s.toml", small_scene(sweep={"contact.friction": FRICTIONS[:4]}))
    results = []
    for jobs in ("1", "2"):
        assert (
            shroud("run", scene, "--out", copied, "--until", "respond", "--jobs", jobs, "--force", "--quiet")[0] == 0
        )
        results.append([(c["peak_frequency_hz"], c["peak_amplitude_m"]) for c in summary_of(copied)["curves"]])
        assert summary_of(copied)["stages"]["respond"]["ran"] == 4
    assert results[0] == results[1]


def test_interrupted_from_the_keyboard(copied: Path) -> None:
    frictions = [0.1 + 0.001 * i for i in range(300)]  # more than are solved before it is seen that some are
    scene = write_scene(copied.parent / "s.toml", small_scene(sweep={"contact.friction": frictions}))
    before = len(entries(copied, "curve"))
    command = [sys.executable, "-m", "pipeline", "run", scene, "--out", copied, "--until", "respond", "--quiet"]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    deadline = time.monotonic() + 60.0
    while len(entries(copied, "curve")) < before + 2 and time.monotonic() < deadline:
        time.sleep(0.002)
    process.send_signal(signal.SIGINT)
    _, error = process.communicate(timeout=60)
    assert process.returncode == 130
    assert error == "shroud: interrupted; what is done is kept, the same command goes on from there\n"
    assert entries(copied, "tmp") == []
    assert len(entries(copied, "curve")) < before + len(frictions)
