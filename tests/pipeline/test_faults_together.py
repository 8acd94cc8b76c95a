"""Two runs at once on one output folder: one after the other, and never a mixture."""

import csv
import errno
import hashlib
import os
import signal
import socket
import subprocess
import threading
from pathlib import Path

import pytest
from faults_support import PATIENCE, broken_entries, end_of, entries, start, wait_until
from pipeline_support import ground_scene, shroud, summary_of, write_ground_model, write_scene

from pipeline.errors import InputError
from pipeline.store.content_store import Store
from pipeline.store.output_folder import check_output_folder, locked


def belong_together(out: Path) -> bool:
    """Whether summary.json and the response files are of one run."""
    hashes = {name: hashlib.sha256((out / name).read_bytes()).hexdigest() for name in summary_of(out)["response"]}
    return set(hashes) == {"response.csv", "response.h5", "curves.csv"} and summary_of(out)["response"] == hashes


@pytest.mark.long
def test_two_scenes_of_one_name(tmp_path: Path) -> None:
    rom, out = write_ground_model(tmp_path / "g.h5"), tmp_path / "out"
    values = {"a": [0.31, 0.32], "b": [0.41]}
    scenes = {
        name: write_scene(tmp_path / f"{name}.toml", ground_scene() | {"sweep": {"contact.friction": frictions}})
        for name, frictions in values.items()
    }
    runs = [start("respond", scenes[name], "--rom", rom, "--out", out, "--quiet") for name in ("a", "b", "a")]
    for run in runs:
        assert end_of(run) == ("", "")
        assert run.returncode == 0
    assert belong_together(out)
    frictions = [curve["parameters"]["contact.friction"] for curve in summary_of(out)["curves"]]
    assert frictions in values.values()
    with (out / "response.csv").open() as file:
        assert sorted({float(row["contact.friction"]) for row in csv.DictReader(file)}) == frictions
    assert len(entries(out, "curve")) == 3
    assert broken_entries(out) == []
    assert entries(out, "tmp") == []


def test_the_second_says_that_it_waits_and_can_be_stopped(tmp_path: Path) -> None:
    scene, rom = write_scene(tmp_path / "s.toml", ground_scene()), write_ground_model(tmp_path / "g.h5")
    out, waiting = tmp_path / "out", []
    with locked(out / "store" / "lock", waiting.append):
        run = start("respond", scene, "--rom", rom, "--out", out)
        assert run.stderr is not None
        said = run.stderr.readline()
        assert said == f"{out}: another run (process {os.getpid()}) is using this folder; waiting for it to end\n"
        run.send_signal(signal.SIGINT)
        end_of(run)
        assert run.returncode == 130
        other = start("respond", scene, "--rom", rom, "--out", out)
        assert other.stderr is not None
        assert "waiting for it to end" in other.stderr.readline()
        assert not (out / "summary.json").exists()
    end_of(other)
    assert other.returncode == 0
    assert belong_together(out)
    assert waiting == []


@pytest.mark.parametrize("number", ["99999999", "ours", "1", "", "not a number"])
def test_a_lock_that_nobody_holds_blocks_nobody(tmp_path: Path, number: str) -> None:
    """Its text, even the number of a process that lives, is only for people."""
    scene, rom = write_scene(tmp_path / "s.toml", ground_scene()), write_ground_model(tmp_path / "g.h5")
    lock, number = tmp_path / "out" / "store" / "lock", number.replace("ours", str(os.getpid()))
    lock.parent.mkdir(parents=True)
    lock.write_text(number)
    leftover = tmp_path / "out" / "store" / "tmp" / f"{number or os.getpid()}-x"
    leftover.mkdir(parents=True)
    status, _, error = shroud("respond", scene, "--rom", rom, "--out", tmp_path / "out", "--quiet")
    assert (status, error) == (0, "")
    assert not leftover.exists()


def test_a_lock_ends_with_its_process(tmp_path: Path) -> None:
    program_end, path = threading.Event(), tmp_path / "lock"
    child = os.fork()
    if child == 0:
        with locked(path, lambda _: None):
            (tmp_path / "held").touch()
            program_end.wait()
    try:
        wait_until((tmp_path / "held").exists, "the lock of the other process")
        told: list[str] = []

        def told_of(holder: str) -> None:
            told.append(holder)
            os.kill(child, signal.SIGKILL)

        with locked(path, told_of):
            assert told == [str(child)]
    finally:
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)


@pytest.mark.parametrize("number", [errno.ENOLCK, errno.ENOSYS])
def test_a_file_system_without_flock(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: int) -> None:
    """A soft lock: it holds, names its process, is gone afterwards, and one of a dead process blocks nobody."""

    def none(*_: object) -> None:
        raise OSError(number, "no locks available")

    monkeypatch.setattr("fcntl.flock", none)
    waiting: list[str] = []
    release = threading.Event()

    def second() -> None:
        with locked(tmp_path / "lock", lambda holder: (waiting.append(holder), release.set())):
            pass

    thread = threading.Thread(target=second)
    with locked(tmp_path / "lock", waiting.append):
        thread.start()
        assert release.wait(PATIENCE)
    thread.join(PATIENCE)
    assert waiting == [str(os.getpid())]
    assert not (tmp_path / "lock.soft").exists()

    store = tmp_path / "out" / "store"
    (store / "tmp" / "left").mkdir(parents=True)
    ended = subprocess.Popen(["true"])
    ended.wait()
    (store / "lock.soft").write_text(f"{ended.pid}\n{socket.gethostname()}\n")
    scene, rom = write_scene(tmp_path / "s.toml", ground_scene()), write_ground_model(tmp_path / "g.h5")
    assert shroud("respond", scene, "--rom", rom, "--out", tmp_path / "out", "--quiet") == (0, "", "")
    assert not (store / "tmp" / "left").exists()


def test_a_store_deleted_under_a_waiting_run_is_no_obstacle(tmp_path: Path) -> None:
    path = tmp_path / "store" / "lock"

    def gone(_: str) -> None:
        path.unlink()
        path.parent.rmdir()

    with locked(path, lambda _: None), locked(path, gone):
        assert path.is_file()


@pytest.mark.parametrize("kind", ["hard link", "link", "pipe", "folder"])
def test_what_is_no_lock_is_left_as_it_is(tmp_path: Path, kind: str) -> None:
    scene, rom = write_scene(tmp_path / "s.toml", ground_scene()), write_ground_model(tmp_path / "g.h5")
    lock, other = tmp_path / "out" / "store" / "lock", tmp_path / "thesis.tex"
    lock.parent.mkdir(parents=True)
    other.write_text("years of work")
    make = {"hard link": os.link, "link": os.symlink}
    if kind in make:
        make[kind](other, lock)
    else:
        {"pipe": os.mkfifo, "folder": os.mkdir}[kind](lock)
    status, _, error = shroud("respond", scene, "--rom", rom, "--out", tmp_path / "out", "--quiet")
    assert (status, error.count("\n")) == (2, 1)
    assert f"{lock} is " in error
    assert "not the lock of a run; delete it" in error
    assert other.read_text() == "years of work"


def test_a_text_that_is_no_number_stays_in_the_lock(tmp_path: Path) -> None:
    (tmp_path / "lock").write_text("notes that somebody keeps here")
    with locked(tmp_path / "lock", lambda _: None):
        pass
    assert (tmp_path / "lock").read_text() == "notes that somebody keeps here"


def test_a_folder_of_a_run_that_wrote_no_summary_stays_its_own(tmp_path: Path) -> None:
    """Without its lock, and with what a killed run has begun; not with files of others in the store."""
    out = tmp_path / "out"
    store = Store(out / "store")
    entry = store.get("curve", "0" * 24, lambda folder: (folder / "curve.h5").touch())
    (out / "store" / "tmp" / ("0" * 32)).mkdir(parents=True)
    check_output_folder(out)
    (out / "store" / "tmp" / "notes").touch()
    with pytest.raises(InputError, match='holds "store" and no earlier results'):
        check_output_folder(out)
    store.remove_temporary()
    check_output_folder(out)
    entry.file("entry.json").rename(out / "store" / "curve" / "notes.txt")
    with pytest.raises(InputError, match='holds "store" and no earlier results'):
        check_output_folder(out)
