"""Worker processes that die: only their own call is begun again, at most twice, and the others keep their results."""

import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest
from faults_support import entries
from pipeline_support import ground_scene, shroud, summary_of, write_ground_model, write_scene

import pipeline.stages.respond
from pipeline.process.workers import ATTEMPTS, Call, WorkerDied, call_apart, workers
from pipeline.stages.respond import CurveJob
from pipeline.stages.solve_curve import solve_curve


def attempts_in(folder: Path, name: str) -> int:
    """Number of this attempt, counted in files that outlive a process."""
    made = len(list(folder.glob(f"{name}-*")))
    (folder / f"{name}-{made}").touch()
    return made + 1


def work(folder: Path, name: str, deaths: int, number: int) -> str:
    """A call whose process dies in the first attempts; others take long enough to be under way meanwhile."""
    if attempts_in(folder, name) <= deaths:
        os.kill(os.getpid(), number)
    time.sleep(0.05)
    return name


def fail(message: str) -> None:
    raise ValueError(message)


class Stubborn(Exception):
    """An exception that cannot be sent from one process to another."""

    def __init__(self) -> None:
        super().__init__("stubborn")
        self.lock = threading.Lock()


def fail_stubbornly() -> None:
    raise Stubborn


def test_only_the_call_of_a_dead_process_is_begun_again(tmp_path: Path) -> None:
    deaths = {"a": (0, 0), "killed once": (1, signal.SIGKILL), "killed always": (9, signal.SIGKILL), "b": (0, 0)}
    deaths |= {"crashes always": (9, signal.SIGSEGV), "c": (0, 0)}
    calls = {name: Call(work, (tmp_path, name, *how)) for name, how in deaths.items()}
    calls["raises"] = Call(fail, ("of itself",))
    calls["raises stubbornly"] = Call(fail_stubbornly)
    told: list[str] = []
    with workers(2) as pool:
        found = dict(pool.completed(calls, retried=lambda name, reason: told.append(name)))
    assert set(found) == set(calls)
    assert [found[name].result() for name in ("a", "b", "c", "killed once")] == ["a", "b", "c", "killed once"]
    assert sorted(told) == sorted(["killed once", *["killed always", "crashes always"] * 2])
    attempts = {name: len(list(tmp_path.glob(f"{name}-*"))) for name in deaths}
    assert attempts == {"a": 1, "b": 1, "c": 1, "killed once": 2, "killed always": 3, "crashes always": 3}
    for name, said in (
        ("killed always", "signal 9 (SIGKILL), most likely for want of memory"),
        ("crashes always", "signal 11"),
    ):
        with pytest.raises(WorkerDied, match=rf"killed by {said[:8]}.*\(3 attempts\)$") as died:
            found[name].result()
        assert said in str(died.value)
    with pytest.raises(ValueError, match="of itself"):
        found["raises"].result()
    with pytest.raises(RuntimeError, match="stubborn"):
        found["raises stubbornly"].result()


def beside(folder: Path, name: str) -> int:
    """How many calls are under way, this one included; the last attempt of `name` begins after its deaths."""
    mark = folder / f"under-way-{os.getpid()}"
    mark.touch()
    if name == "greedy" and attempts_in(folder, name) < ATTEMPTS:
        mark.unlink()
        os.kill(os.getpid(), signal.SIGKILL)
    count = len(list(folder.glob("under-way-*")))
    time.sleep(0.02)
    count = max(count, len(list(folder.glob("under-way-*"))))
    mark.unlink()
    return count


def test_the_last_attempt_has_the_machine_to_itself(tmp_path: Path) -> None:
    """What the kernel killed for want of memory may fit where nothing else runs."""
    names = ["greedy", *(f"modest {k}" for k in range(12))]
    with workers(2) as pool:
        found = {n: f.result() for n, f in pool.completed({n: Call(beside, (tmp_path, n)) for n in names})}
    assert found["greedy"] == 1


def test_a_process_of_its_own_that_dies_says_how() -> None:
    assert call_apart(len, "four") == 4
    with pytest.raises(WorkerDied, match=r"^its process ended with exit status 3$"):
        call_apart(os._exit, 3)


def die_for_friction(folder: Path, rom: Path, scene: object, *rest: object) -> None:
    """`solve_curve` in a worker that the kernel kills for one curve always and for another one once."""
    attempt = 0
    friction = scene.contact.friction  # type: ignore[attr-defined]
    if friction in (0.32, 0.34):
        attempt = attempts_in(Path(os.environ["SHROUD_TEST_FOLDER"]), str(friction))
    if friction == 0.32 or attempt == 1:
        os.kill(os.getpid(), signal.SIGKILL)
    solve_curve(folder, rom, scene, *rest)  # type: ignore[arg-type]


def deadly_solve_into(store: object, item: CurveJob, progress: object = None) -> str:
    pipeline.stages.respond.solve_curve = die_for_friction  # type: ignore[assignment]
    return REAL(store, item, progress)  # type: ignore[arg-type]


REAL = pipeline.stages.respond._solve_into


def test_a_run_loses_the_curve_of_a_killed_worker_only(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    frictions = [0.31, 0.32, 0.33, 0.34, 0.35]
    scene = write_scene(tmp_path / "s.toml", ground_scene() | {"sweep": {"contact.friction": frictions}})
    rom, out = write_ground_model(tmp_path / "g.h5"), tmp_path / "out"
    monkeypatch.setenv("SHROUD_TEST_FOLDER", str(tmp_path))
    monkeypatch.setattr(pipeline.stages.respond, "_solve_into", deadly_solve_into)
    status, _, error = shroud("respond", scene, "--rom", rom, "--out", out, "--jobs", 2)
    assert status == 1
    assert "killed by signal 9 (SIGKILL), most likely for want of memory" in error.splitlines()[-1]
    assert error.splitlines()[-1].startswith("1 of 5 curves not completed: its process was killed")
    assert error.count("begun again in another process") == 3
    curves = summary_of(out)["curves"]
    assert [c["parameters"]["contact.friction"] for c in curves] == frictions
    assert [c["complete"] for c in curves] == [f != 0.32 for f in frictions]
    assert "(3 attempts)" in curves[1]["reason"]
    assert entries(out, "tmp") == []

    monkeypatch.undo()
    assert shroud("respond", scene, "--rom", rom, "--out", out, "--quiet", "--jobs", 2)[0] == 0
    assert all(c["complete"] for c in summary_of(out)["curves"])
    assert len(entries(out, "curve")) == 5


def test_a_script_without_a_guard_is_told_so(tmp_path: Path) -> None:
    script = tmp_path / "script.py"
    script.write_text(
        "from pipeline.process.workers import Call, workers\n"
        "with workers(2) as pool:\n"
        "    list(pool.completed({1: Call(len, ('x',)), 2: Call(len, ('x',))}))\n"
    )
    environment = {**os.environ, "PYTHONPATH": str(Path.cwd())}
    done = subprocess.run([sys.executable, script], capture_output=True, text=True, check=False, env=environment)
    assert done.returncode == 1
    assert done.stderr.splitlines()[-1].startswith(
        "RuntimeError: worker processes end with exit status 1 before they"
    )
    assert 'if __name__ == "__main__":' in done.stderr.splitlines()[-1]
