"""Commands as a user starts them: a scene from nothing, again, and in one and two processes."""

from __future__ import annotations

import json
import re
import shutil
import statistics
import tempfile
from pathlib import Path
from typing import Any

from before_after.state import PACKAGES, CaseError, State

REPEATS = 5
SWEEP = (-20e-6, 5e-6, 10e-6, 20e-6, 40e-6, 60e-6, 100e-6, 400e-6)  # m
TIMES = {"seconds", "date", "table_hash"}  # datasets and attributes of response.h5 that depend on the time


def from_nothing(state: State, scene: str, limit: float) -> dict[str, Any]:
    """A scene into an empty folder, kernels compiled before; then what is asked for when nothing has changed."""
    with tempfile.TemporaryDirectory(prefix="shroud-times-") as name:
        file, out = str(state.root / "scenes" / f"{scene}.toml"), str(Path(name) / "out")
        answer: dict[str, Any] = {"whole": _run(state, ["run", file, "--out", out], limit)}
        summary = json.loads((Path(out) / "summary.json").read_text(encoding="utf-8"))
        answer["stages"] = {key: stage["seconds"] for key, stage in summary["stages"].items()}
        answer["solving"] = sum(curve["seconds"] for curve in summary["curves"])
        again = [_run(state, ["run", file, "--out", out], limit) for _ in range(REPEATS)]
        checks = [_run(state, ["validate", file], limit) for _ in range(REPEATS)]
    return answer | {"unchanged": _medians(again), "validate": _medians(checks)}


def fresh_clone(state: State, scene: str, limit: float) -> dict[str, Any]:
    """The same from a copy of the sources without kernels, after the command of `make setup` that compiles them.

    With how many kernels the run had to compile all the same.
    """
    with tempfile.TemporaryDirectory(prefix="shroud-times-") as name:
        copy = Path(name) / "clone"
        for package in PACKAGES:
            shutil.copytree(state.root / package, copy / package, ignore=shutil.ignore_patterns("__pycache__"))
        shutil.copy(state.root / "pyproject.toml", copy)
        compiled = state.command(["warm-up"], limit, copy)  # an older state has no such command
        before = _kernels(copy)
        file = str(copy / "scenes" / f"{scene}.toml")
        whole = _run(state, ["run", file, "--out", str(Path(name) / "out")], limit, copy)
        found = {"whole": whole, "compiled": _kernels(copy) - before}
    return {"setup": compiled.figures() if compiled.status == 0 else None, **found}


def _kernels(copy: Path) -> int:
    """Compiled kernels that a copy keeps: files of numba."""
    return sum(1 for _ in copy.rglob("*.nbc"))


def one_and_two_workers(state: State, limit: float, values: tuple[float, ...] = SWEEP) -> dict[str, Any]:
    """Seconds of the stage respond for a sweep of 8 with one and with two processes, and whether all bits agree.

    The loss is the share of the time of both processes beyond what one process needs: 1 - t1 / (2 t2).
    """
    with tempfile.TemporaryDirectory(prefix="shroud-times-") as name:
        text = (state.root / "scenes" / "dummy.toml").read_text(encoding="utf-8")
        text, count = re.subn(r'(?m)^"contact.interference" = .*$', f'"contact.interference" = {list(values)}', text)
        assert count == 1
        scene = Path(name) / "sweep.toml"
        scene.write_text(text, encoding="utf-8")
        _run(state, ["run", str(scene), "--out", f"{name}/1", "--until", "reduce"], limit)
        shutil.copytree(f"{name}/1", f"{name}/2")
        answer: dict[str, Any] = {}
        for jobs in ("1", "2"):
            command = ["run", str(scene), "--out", f"{name}/{jobs}", "--until", "respond", "--jobs", jobs]
            answer[jobs] = _run(state, command, limit)
            summary = json.loads((Path(name) / jobs / "summary.json").read_text(encoding="utf-8"))
            answer[jobs]["respond"] = summary["stages"]["respond"]["seconds"]
        first, second = (results(Path(name) / jobs) for jobs in ("1", "2"))
    loss = 1.0 - answer["1"]["respond"] / (2.0 * answer["2"]["respond"])
    return {"one": answer["1"], "two": answer["2"], "loss": loss, "identical": first == second}


def results(out: Path) -> dict[str, bytes]:
    """All numbers of response.csv and response.h5 as they are stored, but the times."""
    import h5py
    import numpy as np

    def stored(value: Any) -> bytes:
        array = np.asarray(value)
        return repr(array.tolist()).encode() if array.dtype.hasobject else array.tobytes()

    found = {"csv": (out / "response.csv").read_bytes()}

    def visit(name: str, item: Any) -> None:
        if isinstance(item, h5py.Dataset) and name.rpartition("/")[2] not in TIMES:
            found[name] = stored(item[()])
        found.update({f"{name}@{key}": stored(item.attrs[key]) for key in item.attrs if key not in TIMES})

    with h5py.File(out / "response.h5", "r") as file:
        visit("", file)
        file.visititems(visit)
    return found


def _run(state: State, arguments: list[str], limit: float, root: Path | None = None) -> dict[str, float]:
    used = state.command(arguments, limit, root)
    if used.status != 0:
        raise CaseError(f"shroud {arguments[0]}: exit status {used.status}: {used.output.strip()[-300:]}")
    return used.figures()


def _medians(runs: list[dict[str, float]]) -> dict[str, float]:
    return {name: statistics.median(run[name] for run in runs) for name in runs[0]}
