"""Memory, open files or processes that run out: one line with what to do, in place of a number of the system."""

import errno
import os
import resource
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from faults_support import PATIENCE, start
from pipeline_support import ground_scene, shroud, small_scene, write_ground_model, write_scene

import pipeline.process.workers
from pipeline.errors import StageError, advice_on, reason_of
from pipeline.process.workers import Call, workers
from rom.linear_algebra.threads import require_memory

MEMORY = "out of memory; fewer jobs (--jobs), a larger mesh.size, fewer modes or harmonics need less"


@pytest.mark.parametrize(
    ("error", "expected"),
    [
        (MemoryError(), MEMORY),
        (OSError(errno.ENOMEM, "Cannot allocate memory"), f"{MEMORY} ([Errno 12] Cannot allocate memory)"),
        (ImportError("lib.so: failed to map segment from shared object"), f"{MEMORY} (lib.so: failed to map"),
        (
            OSError(errno.EMFILE, "Too many open files"),
            "too many open files; raise the limit (ulimit -n) or use fewer",
        ),
        (
            BlockingIOError(errno.EAGAIN, "try again"),
            "no further process can start; raise the limit (ulimit -u) or use",
        ),
    ],
)
def test_what_has_run_out_comes_with_advice(error: Exception, expected: str) -> None:
    assert reason_of(error).startswith(expected)
    assert str(StageError("reduce", error)).startswith(f"reduce: {expected}")


def test_numpy_out_of_memory_and_other_errors() -> None:
    with pytest.raises(MemoryError) as caught:
        np.empty((1 << 30, 1 << 20))
    assert reason_of(caught.value).startswith(f"{MEMORY} (Unable to allocate")
    assert advice_on(FileNotFoundError(errno.ENOENT, "none")) == advice_on(ValueError("x")) == ""


def test_open_files_that_run_out(tmp_path: Path) -> None:
    """A command that finds no number for one more file; `validate` opens no other than the scene."""
    write_scene(tmp_path / "s.toml", ground_scene())
    program = (
        "import os, resource\n"
        "from pipeline.cli import command\n"
        "assert command(['validate', 's.toml']) == 2\n"  # imports what it needs; a scene without a blade
        "resource.setrlimit(resource.RLIMIT_NOFILE, (20, resource.getrlimit(resource.RLIMIT_NOFILE)[1]))\n"
        "try:\n    while True:\n        os.open(os.devnull, os.O_RDONLY)\n"
        "except OSError:\n    pass\n"
        "raise SystemExit(command(['validate', 's.toml']))\n"
    )
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])}
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=False, cwd=tmp_path, env=environment
    )
    assert done.returncode == 2
    advice = "cannot be read: too many open files; raise the limit (ulimit -n) or use fewer jobs (--jobs)"
    assert done.stderr.splitlines()[-1:] == [f"s.toml: {advice}, allowed: a readable scene file in TOML"]


def test_a_run_without_memory_says_so_for_each_curve(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def none(*_: object) -> None:
        raise MemoryError("Unable to allocate 8.0 GiB")

    monkeypatch.setattr("pipeline.stages.curve.respond.solve_curve", none)
    scene, rom = write_scene(tmp_path / "s.toml", ground_scene()), write_ground_model(tmp_path / "g.h5")
    status, _, error = shroud("respond", scene, "--rom", rom, "--out", tmp_path / "out", "--quiet")
    expected = f"1 of 1 curves not completed: {MEMORY} (Unable to allocate 8.0 GiB)\n"
    assert (status, error) == (1, expected)


def test_where_one_more_process_cannot_start_those_that_run_go_on(monkeypatch: pytest.MonkeyPatch) -> None:
    real, started = pipeline.process.workers._start, []

    def start() -> object:
        if started:
            raise BlockingIOError(errno.EAGAIN, "Resource temporarily unavailable")
        started.append(real())
        return started[0]

    monkeypatch.setattr(pipeline.process.workers, "_start", start)
    with workers(4) as pool:
        found = {key: future.result() for key, future in pool.completed({k: Call(abs, (-k,)) for k in range(6)})}
    assert found == {k: k for k in range(6)}
    with pytest.raises(BlockingIOError), workers(2) as pool:
        list(pool.completed({1: Call(abs, (1,))}))


@pytest.mark.parametrize(("size", "jobs"), [(300, 1), (550, 2)])
def test_little_address_space_is_said_before_a_library_crashes_or_loops(tmp_path: Path, size: int, jobs: int) -> None:
    """As under `ulimit -v`: OpenBLAS asks for ever for a buffer that it cannot get, others end with a signal."""

    def limit() -> None:
        resource.setrlimit(resource.RLIMIT_AS, (size << 20, size << 20))

    scene, out = write_scene(tmp_path / "s.toml", small_scene()), tmp_path / "out"
    run = start("run", scene, "--out", out, "--jobs", jobs, "--quiet", preexec_fn=limit)
    said, error = run.communicate(timeout=PATIENCE)
    assert (run.returncode, said) == (1, "")
    missing = f"no room for 450 MB more: raise ulimit -v ({size} MB), the limit of each process"
    assert error == f"shroud: {MEMORY} ({missing})\n"


def test_memory_that_is_there_is_not_refused() -> None:
    require_memory(64)
    with pytest.raises(MemoryError, match="no room for 1073741824 MB more"):
        require_memory(1 << 30)
