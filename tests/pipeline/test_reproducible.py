"""The same scene gives the same numbers, bit for bit, whatever the threads, processes, folders and the clock."""

import os
import subprocess
import sys
import time
from pathlib import Path

import h5py
import numpy as np
import pytest
from pipeline_support import ground_scene, shroud, small_scene, statuses, summary_of, write_ground_model, write_scene

import pipeline.process.progress

SWEEP = {"contact.interference": [1e-5, 1e-3]}
NOT_NUMBERS_OF_THE_SOLUTION = {"seconds"}


def contents(path: Path) -> dict[str, object]:
    """Every dataset and attribute of response.h5 but the times."""
    found: dict[str, object] = {}

    def visit(name: str, item: h5py.Group | h5py.Dataset) -> None:
        if isinstance(item, h5py.Dataset) and name.rpartition("/")[2] not in NOT_NUMBERS_OF_THE_SOLUTION:
            text = h5py.check_string_dtype(item.dtype)
            found[name] = item.asstr()[()].tolist() if text else item[()].tobytes()
        for key, value in item.attrs.items():
            if key not in NOT_NUMBERS_OF_THE_SOLUTION:
                found[f"{name}@{key}"] = repr(np.asarray(value).tolist())  # nan is nan here

    with h5py.File(path, "r") as file:
        file.visititems(visit)
    return found


@pytest.mark.long
def test_from_nothing_in_other_surroundings(finished: Path, tmp_path: Path) -> None:
    scene = write_scene(tmp_path / "other.toml", small_scene(sweep=SWEEP))
    out = tmp_path / "a folder with another name"
    command = [sys.executable, "-m", "pipeline", "run", scene, "--out", out, "--until", "respond", "--jobs", "2"]
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "2", "OMP_NUM_THREADS": "2", "PYTHONHASHSEED": "2"}
    subprocess.run([*command, "--quiet"], env=environment, check=True)
    assert (out / "response.csv").read_bytes() == (finished / "response.csv").read_bytes()
    assert contents(out / "response.h5") == contents(finished / "response.h5")
    assert summary_of(out)["models"] == summary_of(finished)["models"]
    for name in ("mesh/*/sector.h5", "assemble/*/full.h5", "reduce/*/rom.h5"):
        (one,), (other,) = (list(folder.glob(f"store/{name}")) for folder in (out, finished))
        assert one.relative_to(out) == other.relative_to(finished)
        assert one.read_bytes() == other.read_bytes()


def times(summary: dict) -> list[float]:
    """Every time in a summary."""
    items = [summary, *summary["curves"], *summary["stages"].values()]
    return [item["seconds"] for item in items]


def test_a_clock_that_jumps(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Both clocks, at every look; results are found by content all the same."""
    scene, rom = write_scene(tmp_path / "s.toml", ground_scene()), write_ground_model(tmp_path / "g.h5")
    arguments = ("respond", scene, "--rom", rom, "--out", tmp_path / "out", "--quiet")
    assert shroud(*arguments) == (0, "", "")
    before = (tmp_path / "out" / "response.csv").read_bytes()
    looks = [time.time()]

    def jumping() -> float:
        looks.append(looks[-1] - 1e6)
        return looks[-1]

    monkeypatch.setattr(pipeline.process.progress.time, "perf_counter", jumping)
    monkeypatch.setattr(pipeline.process.progress.time, "time", jumping)
    assert shroud(*arguments) == (0, "", "")
    assert statuses(tmp_path / "out")["respond"] == "reused"
    assert shroud(*arguments, "--recompute") == (0, "", "")
    assert statuses(tmp_path / "out")["respond"] == "ran"
    assert (tmp_path / "out" / "response.csv").read_bytes() == before
    assert min(times(summary_of(tmp_path / "out"))) >= 0.0
    assert len(looks) > 5
