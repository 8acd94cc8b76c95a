"""Runs that are killed, stopped or left by their terminal: nothing stays behind, and the same command goes on."""

import json
import os
import random
import signal
import subprocess
import sys
from collections.abc import Callable
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import pytest
from faults_support import alive, broken_entries, end_of, entries, heeding_hang_up, start, wait_until
from pipeline_support import ground_scene, shroud, small_scene, statuses, summary_of, write_ground_model, write_scene

import pipeline.stages.model.model_chain
from pipeline import Results, read_results, run_scene
from pipeline.errors import ExecutorLost
from pipeline.stages.curve.sweep_curves import SweepCurves

FRICTIONS = [0.1 + 0.001 * i for i in range(300)]  # more than are solved before it is seen that some are


def numbers(out: Path) -> list[dict[str, object]]:
    """Curves and models of summary.json without times, and without where the model was found."""
    summary = summary_of(out)
    without = ("seconds", "rom")
    return [{k: v for k, v in item.items() if k not in without} for item in summary["curves"] + summary["models"]]


@pytest.mark.long
def test_killed_again_and_again(finished: Path, tmp_path: Path) -> None:
    changes = {"render": {"modes": [1]}, "sweep": {"contact.interference": [1e-5, 1e-3]}}
    scene, out = write_scene(tmp_path / "s.toml", small_scene(**changes)), tmp_path / "out"
    chance, kills = random.Random(20261121), 0
    for number in range(2):
        mark = f"{tmp_path}-{number}"
        process = start("report", scene, "--out", out, "--jobs", "2", "--quiet", mark=mark)
        try:
            process.communicate(timeout=chance.uniform(0.6, 2.0))
        except subprocess.TimeoutExpired:
            process.kill()
            process.communicate()
        kills += process.returncode == -signal.SIGKILL
        wait_until(lambda mark=mark: not alive(mark), "the end of what a killed run had started")
        assert not out.exists() or broken_entries(out) == []
    assert kills >= 1
    status, said, error = shroud("report", scene, "--out", out, "--jobs", "2", "--quiet")
    assert (status, said, error) == (0, "", "")
    assert (out / "response.csv").read_bytes() == (finished / "response.csv").read_bytes()
    assert numbers(out) == numbers(finished)
    assert entries(out, "tmp") == []
    assert (out / "report.html").is_file()
    assert (out / "renders" / "mode_1.png").is_file()


def test_killed_and_resumed(copied: Path) -> None:
    """What was solved before is taken, of the killed run and of one before it."""
    frictions = [0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4]  # the last one is that of the run that was copied
    scene = write_scene(copied.parent / "s.toml", small_scene(sweep={"contact.friction": frictions}))
    before = {path.name for path in entries(copied, "curve")}
    process = start("run", scene, "--out", copied, "--until", "respond", "--jobs", 1, "--quiet")
    wait_until(lambda: len(entries(copied, "curve")) >= len(before) + 2, "the first curves")
    process.kill()
    process.communicate()
    done = [path.name for path in entries(copied, "curve") if path.name not in before]
    assert 2 <= len(done) < len(frictions) - 1
    assert broken_entries(copied) == []
    status, _, error = shroud("run", scene, "--out", copied, "--until", "respond", "--quiet")
    assert (status, error) == (0, "")
    respond = summary_of(copied)["stages"]["respond"]
    assert (respond["reused"], respond["ran"]) == (len(done) + 1, len(frictions) - len(done) - 1)
    assert statuses(copied)["reduce"] == "reused"
    assert entries(copied, "tmp") == []
    assert all(curve["complete"] for curve in summary_of(copied)["curves"])


@pytest.mark.parametrize(
    ("number", "jobs", "word"),
    [(signal.SIGINT, 2, "interrupted"), pytest.param(signal.SIGTERM, 1, "terminated", marks=pytest.mark.long)],
)
def test_stopped_from_outside(copied: Path, number: signal.Signals, jobs: int, word: str) -> None:
    scene = write_scene(copied.parent / "s.toml", small_scene(sweep={"contact.friction": FRICTIONS}))
    before, mark = len(entries(copied, "curve")), str(copied)
    arguments = ["run", scene, "--out", copied, "--until", "respond", "--quiet", "--jobs", jobs]
    process = start(*arguments, mark=mark)
    wait_until(lambda: len(entries(copied, "curve")) > before + 1, "the first curves")
    os.killpg(process.pid, number)  # as a terminal does it: the workers get it too
    said, error = end_of(process)
    assert process.returncode == 128 + number
    assert (said, error) == ("", f"shroud: {word}; what is done is kept, the same command goes on from there\n")
    wait_until(lambda: not alive(mark), "the end of the workers")
    assert entries(copied, "tmp") == []
    assert broken_entries(copied) == []
    assert len(entries(copied, "curve")) < before + len(FRICTIONS)
    summary, results = summary_of(copied), read_results(copied)
    done = [curve for curve in results.curves if curve.complete]
    said = f"{word}: {len(done)} of {len(FRICTIONS)} curves are done; the same command goes on from there"
    assert (summary["complete"], summary["problems"]) == (False, [said])
    assert 1 <= len(done) < len(results.curves) == len(FRICTIONS)
    assert {curve.reason for curve in results.curves if not curve.complete} == {"not computed"}
    assert all(curve.frequency_hz.size for curve in done)


LONG = {  # what is prepared, and what takes long
    "a long point of many steps": ("pass", "while True: sum(range(100))"),
    "eigenvalues of a large matrix": (
        "import numpy; from nonlinear.stability.general_eigenvalues import general_eigenvalues",
        "general_eigenvalues(numpy.random.default_rng(0).normal(size=(6000, 6000)))",
    ),
    "a long call in C": ("import hashlib", "hashlib.pbkdf2_hmac('sha256', b'', b'', 2**31 - 1)"),
}


@pytest.mark.parametrize(
    ("work", "number", "word"),
    [
        ("a long point of many steps", signal.SIGTERM, "terminated"),
        ("a long call in C", signal.SIGHUP, "hung up"),
        ("eigenvalues of a large matrix", signal.SIGTERM, "terminated"),
    ],
)
def test_a_signal_is_heeded_within_a_long_point(tmp_path: Path, work: str, number: signal.Signals, word: str) -> None:
    """Where nothing looks for signals: an exception between two steps, the end of the process within a long call."""
    program = tmp_path / "program.py"
    program.write_text(
        "import sys\n"
        "from pipeline import cli\n"
        "from pipeline.terminal import stoppable\n"
        "from pipeline.process import interrupts\n"
        "interrupts.PATIENCE = 0.3\n"
        "@cli.app.command()\n"
        "def work():\n"
        "    with stoppable() as found, found.looking():\n"
        f"        {LONG[work][0]}\n"
        "        print('begun', flush=True)\n"
        f"        {LONG[work][1]}\n"
        "sys.exit(cli.command(['work']))\n"
    )
    environment = {**os.environ, "PYTHONPATH": str(Path.cwd())}
    pipes: dict[str, Any] = {"text": True, "stdout": -1, "stderr": -1, "preexec_fn": heeding_hang_up}
    process = subprocess.Popen([sys.executable, program], env=environment, **pipes)
    try:
        assert process.stdout is not None
        assert process.stdout.readline() == "begun\n"
        process.send_signal(number)
        _, error = end_of(process)
    finally:
        process.kill()
    assert error == f"shroud: {word}; what is done is kept, the same command goes on from there\n"
    assert process.returncode == 128 + number


def test_sighup_stays_ignored_under_nohup(finished: Path, tmp_path: Path) -> None:
    program = (
        "import signal, sys\n"
        "signal.signal(signal.SIGHUP, signal.SIG_IGN)\n"
        "from pipeline.process.interrupts import handling_interrupts\n"
        "with handling_interrupts():\n"
        "    signal.raise_signal(signal.SIGHUP); print('goes on')\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout == "goes on\n"


def test_a_drawing_process_ends_with_its_parent(tmp_path: Path) -> None:
    (tmp_path / "endless.py").write_text(
        "import sys, threading, pathlib\n"
        "from pipeline.render.drawing_process import end_with_parent\n"
        "end_with_parent()\n"
        "pathlib.Path(sys.argv[1]).write_text('drawing')\n"
        "threading.Event().wait()\n"
    )
    started = tmp_path / "started"
    program = f"from pipeline.render.drawing_process import draw_apart; draw_apart('endless', {str(started)!r}, [])"
    environment = {**os.environ, "PYTHONPATH": f"{tmp_path}:{Path.cwd()}", "SHROUD_TEST_MARK": str(tmp_path)}
    with subprocess.Popen([sys.executable, "-c", program], env=environment) as process:
        wait_until(started.exists, "the drawing process")
        processes = len(alive(str(tmp_path)))
        process.kill()
    assert processes == 2
    wait_until(lambda: not alive(str(tmp_path)), "the end of the drawing process")


def test_a_drawing_process_that_waits_loads_its_libraries_then_draws_or_ends_with_its_parent(tmp_path: Path) -> None:
    (tmp_path / "library.py").write_text(f"import pathlib; pathlib.Path({str(tmp_path / 'loaded')!r}).touch()\n")
    (tmp_path / "patient.py").write_text(
        "from dataclasses import dataclass\n"
        "import pathlib\n"
        "from pipeline.render.drawing_process import drawing_main\n"
        "from pipeline.render.drawing_process import Job\n"
        "@dataclass(frozen=True)\n"
        "class Patient(Job):\n"
        "    place: str\n"
        "drawing_main(lambda job: pathlib.Path(job.place).touch(), Patient, ('library', 'no_such_library'))\n"
    )
    (tmp_path / "program.py").write_text(
        "import json, sys, pathlib\n"
        "from pipeline.render.drawing_process import Drawing\n"
        "drawing = Drawing('patient', None)\n"
        "if sys.stdin.readline() == 'draw\\n':\n"
        "    picture = pathlib.Path(sys.argv[1])\n"
        "    drawing.begin(json.dumps({'place': str(picture)}))\n"
        "    drawing.finish([picture])\n"
    )
    environment = {**os.environ, "PYTHONPATH": f"{tmp_path}:{Path.cwd()}", "SHROUD_TEST_MARK": str(tmp_path)}
    command = [sys.executable, tmp_path / "program.py", tmp_path / "picture"]
    with subprocess.Popen(command, env=environment, stdin=subprocess.PIPE, text=True) as process:
        wait_until((tmp_path / "loaded").exists, "the library")
        assert not (tmp_path / "picture").exists()
        process.communicate("draw\n")
        assert process.returncode == 0
    assert (tmp_path / "picture").exists()
    with subprocess.Popen(command, env=environment, stdin=subprocess.PIPE, text=True) as process:
        wait_until(lambda: len(alive(str(tmp_path))) == 2, "the process that waits")
        process.kill()
    wait_until(lambda: not alive(str(tmp_path)), "the end of the process that waits")


def test_a_large_reduction_is_the_same_in_a_process_of_its_own(
    finished: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(pipeline.stages.model.model_chain, "LARGE", 0)
    scene, out = write_scene(tmp_path / "s.toml", small_scene()), tmp_path / "out"
    assert shroud("run", scene, "--out", out, "--until", "reduce", "--quiet") == (0, "", "")
    (made,), (expected,) = entries(out, "reduce"), entries(finished, "reduce")
    assert made.name == expected.name
    assert (made / "rom.h5").read_bytes() == (expected / "rom.h5").read_bytes()

    monkeypatch.setattr(pipeline.stages.model.model_chain, "make_reduced_model", died)
    status, _, error = shroud("run", scene, "--out", tmp_path / "b", "--until", "reduce", "--quiet")
    assert status == 1
    assert error.startswith("reduce: its process was killed by signal 9 (SIGKILL), most likely for want of memory")


def died(*_: object, **__: object) -> None:
    """Ends a process as the kernel does that runs out of memory."""
    os.kill(os.getpid(), signal.SIGKILL)


def test_an_unfinished_summary_says_so(copied: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What a run that dies while it draws leaves: new numbers that belong together, and the truth about them."""
    scene = write_scene(copied.parent / "s.toml", small_scene(contact__friction=0.31))

    def stop(*_: object) -> None:
        signal.raise_signal(signal.SIGTERM)

    monkeypatch.setattr("pipeline.run._draw", stop)
    assert shroud("run", scene, "--out", copied, "--quiet")[0] == 128 + signal.SIGTERM
    summary = json.loads((copied / "summary.json").read_text())
    assert summary["complete"] is False
    assert summary["problems"] == ["terminated: 1 of 1 curves are done; the same command goes on from there"]
    assert [curve["complete"] for curve in summary["curves"]] == [True]


def stopping_after(count: int, stop: Callable[[], object], monkeypatch: pytest.MonkeyPatch) -> None:
    """Have `stop` called when so many curves are there."""
    real = SweepCurves._note

    def note(self: SweepCurves, *arguments: Any) -> Any:
        found = real(self, *arguments)
        if len(self.solved) == count:
            stop()
        return found

    monkeypatch.setattr(SweepCurves, "_note", note)


def stopped_scene(tmp_path: Path) -> tuple[dict[str, Any], Path]:
    """A scene of four curves that are solved at once, and its reduced model."""
    return ground_scene() | {"sweep": {"contact.friction": [0.3, 0.4, 0.5, 0.6]}}, write_ground_model(
        tmp_path / "g.h5"
    )


def half_done(results: Results) -> list[bool]:
    """Which curves are there, of results that belong together."""
    assert [curve.reason for curve in results.curves][2:] == ["not computed"] * 2
    assert len((results.folder / "curves.csv").read_text().splitlines()) == 5
    return [bool(curve.frequency_hz.size) for curve in results.curves]


def test_a_killed_run_leaves_results_and_the_next_one_solves_the_rest(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Curves written while others are solved are those of the finished run, bit by bit."""
    scene, rom = stopped_scene(tmp_path)
    monkeypatch.setattr("pipeline.stages.curve.sweep_curves.PAUSE", 0.0)
    monkeypatch.setattr("pipeline.stages.curve.sweep_curves.SHARE", 0.0)
    stopping_after(3, died, monkeypatch)
    run = get_context("fork").Process(
        target=run_scene, args=(scene, tmp_path / "out"), kwargs={"rom": rom, "jobs": 1}
    )
    run.start()
    run.join()
    killed = read_results(tmp_path / "out")
    assert run.exitcode == -signal.SIGKILL
    assert half_done(killed) == [True, True, False, False]
    assert killed.problems[0].startswith("2 of 4 curves so far; ")
    first = [curve.amplitude_m for curve in killed[:2]]
    monkeypatch.undo()
    finished = run_scene(scene, tmp_path / "out", rom=rom, until="respond")
    respond = finished.summary["stages"]["respond"]
    assert (finished.complete, respond["reused"], respond["ran"]) == (True, 3, 1)
    assert all((curve.amplitude_m == found).all() for curve, found in zip(finished[:2], first, strict=True))


def stop_by_hand(folder: Path) -> None:
    """In a process of its own, whose signals no other test has handled."""
    scene, rom = stopped_scene(folder)
    with pytest.MonkeyPatch.context() as patch:
        stopping_after(2, lambda: signal.raise_signal(signal.SIGINT), patch)
        with pytest.raises(KeyboardInterrupt):
            run_scene(scene, folder / "out", rom=rom)


def test_python_stopped_by_hand_leaves_results_and_figures(tmp_path: Path) -> None:
    scene, rom = stopped_scene(tmp_path)
    code = "import sys, pathlib, test_faults_stopped as t; t.stop_by_hand(pathlib.Path(sys.argv[1]))"
    paths = os.pathsep.join([str(Path(__file__).parents[2]), *map(str, Path(__file__).parents[:1]), *sys.path])
    command, own = [sys.executable, "-c", code, str(tmp_path)], {**os.environ, "PYTHONPATH": paths}
    subprocess.run(command, env=own, check=True, timeout=120)
    results = read_results(tmp_path / "out")
    assert results.problems == ("interrupted: 2 of 4 curves are done; the same command goes on from there",)
    assert half_done(results) == [True, True, False, False]
    assert results.summary["pictures"] == ["figures/peaks.png", "figures/response.png"]
    assert all((tmp_path / "out" / name).is_file() for name in results.summary["pictures"])
    finished = run_scene(scene, tmp_path / "out", rom=rom, until="respond")
    assert (finished.complete, finished.summary["stages"]["respond"]["ran"]) == (True, 2)


def test_a_second_signal_ends_at_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """While the figures of what is done are drawn; numbers and JSON are there by then."""
    scene, rom = stopped_scene(tmp_path)
    stopping_after(2, lambda: signal.raise_signal(signal.SIGINT), monkeypatch)
    monkeypatch.setattr("pipeline.run._main_figures", lambda *_: signal.raise_signal(signal.SIGTERM))
    file, out = write_scene(tmp_path / "s.toml", scene), tmp_path / "out"
    status, _, error = shroud("respond", file, "--rom", rom, "--out", out, "--quiet")
    assert (status, error.count("\n")) == (128 + signal.SIGTERM, 1)
    assert half_done(read_results(out)) == [True, True, False, False]
    assert not (out / "figures").exists()


def test_a_stopped_run_prints_its_summary_as_json(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    scene, rom = stopped_scene(tmp_path)
    stopping_after(2, lambda: signal.raise_signal(signal.SIGTERM), monkeypatch)
    file, out = write_scene(tmp_path / "s.toml", scene), tmp_path / "out"
    status, said, _ = shroud("respond", file, "--rom", rom, "--out", out, "--json")
    assert status == 128 + signal.SIGTERM
    assert json.loads(said) == summary_of(out)
    assert half_done(read_results(out)) == [True, True, False, False]


def test_an_exception_leaves_what_is_done_and_a_run_without_a_curve_leaves_earlier_results(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail() -> None:
        raise ExecutorLost("every worker is lost")

    scene, rom = stopped_scene(tmp_path)
    stopping_after(2, fail, monkeypatch)
    with pytest.raises(ExecutorLost):
        run_scene(scene, tmp_path / "out", rom=rom, until="respond")
    results = read_results(tmp_path / "out")
    assert half_done(results) == [True, True, False, False]
    (problem,) = results.problems
    assert problem.startswith("interrupted (every worker is lost): 2 of 4 curves are done")
    monkeypatch.setattr("pipeline.run._respond", lambda *_: fail())
    with pytest.raises(ExecutorLost):
        run_scene(scene | {"sweep": {"contact.friction": [0.7]}}, tmp_path / "out", rom=rom, until="respond")
    assert read_results(tmp_path / "out").summary == results.summary


def test_a_run_stopped_before_its_first_result_leaves_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("pipeline.stages.model.model_chain.make_mesh", lambda *_: signal.raise_signal(signal.SIGINT))
    scene, out = write_scene(tmp_path / "s.toml", small_scene()), tmp_path / "out"
    assert shroud("run", scene, "--out", out, "--quiet")[0] == 128 + signal.SIGINT
    assert not out.exists()
