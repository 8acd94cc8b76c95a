"""Worker processes that die: only their own call is begun again, at most twice, and the others keep their results."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Mapping
from pathlib import Path

import pytest
import worker_tasks
from faults_support import entries
from pipeline_support import ground_scene, write_ground_model, write_scene
from worker_tasks import attempts_in, beside, fail, fail_stubbornly, work

import pipeline.stages.curve.respond
from pipeline import run_scene
from pipeline.process.workers import ATTEMPTS, Call, WorkerDied, call_apart, kept_workers, workers
from pipeline.stages.curve.solve_curve import solve_curve


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


def test_the_attempts_are_as_many_as_the_calls_assume() -> None:
    assert worker_tasks.ATTEMPTS == ATTEMPTS


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


def test_kept_processes_serve_one_use_after_another() -> None:
    with kept_workers() as kept:
        kept.count = 2
        kept.prepare(Call(abs, (-1,)))
        assert kept.started == 2
        found = []
        for _ in range(2):
            with workers(2) as pool:
                found += [f.result() for _, f in pool.completed({k: Call(os.getpid) for k in range(4)})]
        assert len(set(found)) <= kept.started == 2
        with workers(2) as pool:
            assert next(pool.completed({"soon": Call(abs, (-1,)), "never": Call(time.sleep, (60.0,))}))[0] == "soon"
        with workers(2) as pool:  # those that were busy have ended
            assert [f.result() for _, f in pool.completed({1: Call(abs, (-1,))})] == [1]
        assert call_apart(os.getpid) not in found


def test_a_process_that_dies_in_its_preparation_is_replaced() -> None:
    with kept_workers() as kept:
        kept.count = 2
        kept.prepare(Call(os.abort))
        with workers(2) as pool:
            assert [f.result() for _, f in pool.completed({1: Call(abs, (-1,))})] == [1]


def die_for_friction(folder: Path, rom: Path, scene: object, *rest: object) -> None:
    """`solve_curve` in a worker that the kernel kills for one curve always and for another one once."""
    attempt = 0
    friction = scene.contact.friction  # type: ignore[attr-defined]
    if friction in (0.32, 0.34):
        attempt = attempts_in(Path(os.environ["SHROUD_TEST_FOLDER"]), str(friction))
    if friction == 0.32 or attempt == 1:
        os.kill(os.getpid(), signal.SIGKILL)
    solve_curve(folder, rom, scene, *rest)  # type: ignore[arg-type]


def deadly_solve(folder: Path, files: Mapping[str, Path], *rest: object, progress: object = None) -> None:
    die_for_friction(folder, files["rom"], *rest)


@pytest.mark.long
def test_a_run_loses_the_curve_of_a_killed_worker_only(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    frictions = [0.31, 0.32, 0.34]
    scene = write_scene(tmp_path / "s.toml", ground_scene() | {"sweep": {"contact.friction": frictions}})
    rom, out = write_ground_model(tmp_path / "g.h5"), tmp_path / "out"
    monkeypatch.setenv("SHROUD_TEST_FOLDER", str(tmp_path))
    with monkeypatch.context() as deadly:
        deadly.setattr(pipeline.stages.curve.respond, "_solve", deadly_solve)
        found = run_scene(scene, out, rom=rom, until="respond", jobs=2, quiet=False)
    assert capsys.readouterr().err.count("begun again in another process") == 3
    assert [curve.parameters["contact.friction"] for curve in found.curves] == frictions
    assert [curve.complete for curve in found.curves] == [True, False, True]
    assert found.curves[1].reason.startswith(
        "its process was killed by signal 9 (SIGKILL), most likely for want of mem"
    )
    assert found.curves[1].reason.endswith("(3 attempts)")
    assert entries(out, "tmp") == []
    assert len(entries(out, "curve")) == 2

    again = run_scene(scene, out, rom=rom, until="respond")
    assert [curve.complete for curve in again.curves] == [True] * 3


def test_a_script_is_not_run_again_by_the_workers(tmp_path: Path) -> None:
    """Without `if __name__ == "__main__":`, from a file and as a module."""
    (tmp_path / "script.py").write_text(
        "from pipeline.process.workers import Call, workers\n"
        "print('script')\n"
        "with workers(2) as pool:\n"
        "    list(pool.completed({1: Call(len, ('x',)), 2: Call(len, ('x',))}))\n"
        "print(__file__, __spec__ is None)\n"
    )
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(Path.cwd()), str(tmp_path)])}
    for command, alone in (([tmp_path / "script.py"], True), (["-m", "script"], False)):
        done = subprocess.run([sys.executable, *command], capture_output=True, text=True, check=True, env=environment)
        assert done.stdout.splitlines() == ["script", f"{tmp_path / 'script.py'} {alone}"]
