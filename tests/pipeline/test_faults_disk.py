"""A full disk, a folder that cannot be written, things in the way: one line, nothing torn, and on it goes."""

import errno
import os
import pickle
import shutil
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest
from faults_support import broken_entries, entries, largest_file
from pipeline_support import ground_scene, shroud, small_scene, statuses, summary_of, write_ground_model, write_scene

import pipeline.stages.curve.sweep_curves
from pipeline.store.disk_errors import storage_error
from rom.files.hdf5 import new_hdf5

SWEEP = {"contact.interference": [1e-5, 1e-3]}  # of the finished run


@pytest.fixture
def small_disk(tmp_path: Path):
    """A file system of 300 kB, and what makes it larger; where this process may make one."""
    place = tmp_path / "disk"
    place.mkdir()
    if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=300k", "tmpfs", place], capture_output=True).returncode:
        pytest.skip("no file system may be mounted here")
    yield place
    subprocess.run(["umount", place], check=True)


def remount(place: Path, options: str) -> None:
    subprocess.run(["mount", "-o", f"remount,{options}", place], check=True)


@pytest.mark.parametrize(
    ("lost", "jobs"),
    [
        (["mesh"], 1),
        (["assemble", "reduce"], 1),
        (["curve"], 1),
        (["curve"], 2),
        (["frequencies"], 1),
        (["figures"], 1),
    ],
)
@pytest.mark.long
def test_no_room_at_a_stage(copied: Path, lost: list[str], jobs: int, blank_figures: pytest.MonkeyPatch) -> None:
    if "figures" in lost:
        blank_figures.undo()  # of one pixel they find room
    scene = write_scene(copied.parent / "small.toml", small_scene(sweep=SWEEP))
    results = {name: (copied / name).read_bytes() for name in ("response.csv", "response.h5")}
    largest = max(path.stat().st_size for path in (copied / "store" / lost[0]).rglob("*") if path.is_file())
    for kind in lost:
        shutil.rmtree(copied / "store" / kind)
    with largest_file(largest // 2):
        status, said, error = shroud("run", scene, "--out", copied, "--jobs", jobs, "--quiet")
    assert (status, said, error.count("\n")) == (1, "", 1)
    # NumPy, which writes mesh.msh, does not say which of the two it was
    assert error.startswith((f"{copied}: a file would get larger than allowed here", f"{copied}: no space left"))
    assert "run the same command again" in error
    assert broken_entries(copied) == []
    assert entries(copied, "tmp") == []
    assert all((copied / name).read_bytes() == content for name, content in results.items())
    assert summary_of(copied)["scene"] == "small"

    assert shroud("run", scene, "--out", copied, "--jobs", jobs, "--quiet") == (0, "", "")
    assert (copied / "response.csv").read_bytes() == results["response.csv"]
    assert summary_of(copied)["complete"]


def test_no_room_for_the_results_themselves(copied: Path) -> None:
    """The old ones stay, all of them: they are replaced together."""
    names = ("response.csv", "response.h5", "summary.json")
    before = {name: (copied / name).read_bytes() for name in names}
    frictions = small_scene(sweep={"contact.friction": [0.4, 0.35]}, contact__interference=1e-5)
    scene = write_scene(copied.parent / "s.toml", frictions)
    shutil.copytree(copied, copied.parent / "other")
    assert shroud("run", scene, "--out", copied.parent / "other", "--quiet")[0] == 0
    for key in entries(copied.parent / "other", "curve"):
        if not (copied / "store" / "curve" / key.name).exists():
            shutil.copytree(key, copied / "store" / "curve" / key.name)
    with largest_file(len(before["response.h5"]) // 2):
        status, _, error = shroud("run", scene, "--out", copied, "--quiet")
    assert (status, error.count("\n")) == (1, 1)
    assert {name: (copied / name).read_bytes() for name in names} == before


def test_no_room_for_a_picture_drawn_apart(copied: Path) -> None:
    scene = write_scene(copied.parent / "small.toml", small_scene(sweep=SWEEP, render={"modes": [1]}))
    assert shroud("run", scene, "--out", copied, "--quiet", "--until", "respond")[0] == 0  # a model with its basis
    with largest_file(3000):
        status, _, error = shroud("run", scene, "--out", copied, "--quiet", "--until", "render")
    assert (status, error.count("\n")) == (1, 1)
    assert error.startswith(f"{copied}: a file would get larger than allowed here")
    assert broken_entries(copied) == []


def test_a_disk_that_is_really_full(small_disk: Path, finished: Path, tmp_path: Path) -> None:
    scene, out = write_scene(tmp_path / "small.toml", small_scene(sweep=SWEEP)), small_disk / "out"
    status, said, error = shroud("run", scene, "--out", out, "--until", "respond", "--quiet")
    message = "no space left on the disk: free some and run the same command again; what is done is kept"
    assert (status, said, error) == (1, "", f"{out}: {message}\n")
    assert broken_entries(out) == []
    assert entries(out, "tmp") == []
    remount(small_disk, "size=20m")
    assert shroud("run", scene, "--out", out, "--until", "respond", "--quiet") == (0, "", "")
    assert (out / "response.csv").read_bytes() == (finished / "response.csv").read_bytes()


def test_a_folder_that_may_only_be_read(small_disk: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    remount(small_disk, "ro")
    monkeypatch.setattr(
        pipeline.stages.curve.sweep_curves, "models_of_blade", lambda *_: pytest.fail("worked for nothing")
    )
    scene = write_scene(tmp_path / "small.toml", small_scene())
    status, said, error = shroud("run", scene, "--out", small_disk / "out")
    assert (status, said, error.count("\n")) == (2, "", 1)
    assert error.startswith(f"--out: {small_disk / 'out'}: cannot be written: Read-only file system")


def test_hdf5_on_a_full_disk_fails_once_and_cleanly(tmp_path: Path) -> None:
    """In a process: HDF5 by itself crashes at the end of it."""
    program = (
        "import resource, sys, numpy as np; from rom.files.hdf5 import new_hdf5\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (5000, -1))\n"
        "try:\n"
        "    with new_hdf5(sys.argv[1]) as file:\n"
        "        for i in range(50): file[f'group/{i}'] = np.arange(100.0)\n"
        "except OSError as error: print(error.errno)\n"
    )
    command = [sys.executable, "-c", program, str(tmp_path / "x.h5")]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, "27\n", "")


def test_hdf5_files_are_read_as_they_were_written(tmp_path: Path) -> None:
    values = np.random.default_rng(1).standard_normal((300, 40))
    with new_hdf5(tmp_path / "x.h5") as file:
        file.create_dataset("a/b", data=values, track_times=False)
        file.create_dataset("packed", data=values, compression="gzip")
        file.attrs["format"] = "1"
    with h5py.File(tmp_path / "x.h5", "r") as file:
        assert np.array_equal(file["a/b"][()], values)
        assert np.array_equal(file["packed"][()], values)
        assert file.attrs["format"] == "1"


def test_kernels_that_cannot_be_kept_work_all_the_same(tmp_path: Path) -> None:
    (tmp_path / "kernel.py").write_text(
        "import resource\n"
        "from nonlinear.contact.numba_cache import compiled\n"
        "@compiled\n"
        "def twice(x): return 2.0 * x\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (10, -1))\n"
        "print(twice(21.0))\n"
    )
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache"), "PYTHONPATH": str(Path.cwd())}
    command = [sys.executable, str(tmp_path / "kernel.py")]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, "42.0\n", "")
    assert list((tmp_path / "cache").rglob("*.nbi")) == []


@pytest.mark.parametrize(
    ("error", "said"),
    [
        (OSError(errno.ENOSPC, "x"), "{0}: no space left on the disk: free some and run"),
        (OSError(errno.EDQUOT, "x"), "{0}: the disk quota is used up: free some space and run"),
        (OSError(errno.EROFS, "x", "{0}/store/a"), "{0}: Read-only file system: make it writable and run"),
        (OSError(errno.ENOSPC, "x", "/elsewhere/cache/a"), "/elsewhere/cache: no space left"),
        (RuntimeError("file write failed: errno = 28, error message = 'No'"), "{0}: no space left"),
        (RuntimeError("OSError: [Errno 122] Disk quota exceeded"), "{0}: the disk quota"),
        (OSError("566 requested and 121 written"), "{0}: no space left"),
        (OSError(errno.ENOENT, "x"), None),
        (RuntimeError("566 requested and 121 written"), None),
        (ValueError("28"), None),
    ],
)
@pytest.mark.parametrize("wrapped", [False, True])
def test_what_counts_as_a_disk_that_takes_no_more(
    tmp_path: Path, error: Exception, said: str | None, wrapped: bool
) -> None:
    if isinstance(error, OSError) and error.filename:
        error = OSError(error.errno, "x", error.filename.format(tmp_path))
    if wrapped:
        cause, error = error, ValueError("something else")
        error.__cause__ = cause
    told = storage_error(error, tmp_path)
    if said is None:
        assert told is None
    else:
        assert str(told).startswith(said.format(tmp_path))
        assert str(told).endswith("run the same command again; what is done is kept")
        assert str(pickle.loads(pickle.dumps(told))) == str(told)  # it comes from workers


@pytest.mark.parametrize("way", ["dangling", "process", "summary.json", "figures"])
def test_places_that_are_none(tmp_path: Path, way: str, monkeypatch: pytest.MonkeyPatch) -> None:
    out = tmp_path / "out"
    expected = str(out)
    if way == "dangling":
        out.symlink_to(tmp_path / "nowhere" / "at all")
        expected = f"a symbolic link to {tmp_path / 'nowhere' / 'at all'}, which does not exist"
    elif way == "process":
        out = Path("/proc/shroud")
        expected = "/proc/shroud: cannot be written"
    elif way == "summary.json":
        (out / way).mkdir(parents=True)
    else:
        out.mkdir()
        (out / way).write_text("in the way")
    monkeypatch.setattr(
        pipeline.stages.curve.sweep_curves, "models_of_blade", lambda *_: pytest.fail("worked for nothing")
    )
    status, said, error = shroud("run", write_scene(tmp_path / "s.toml", small_scene()), "--out", out)
    assert (status, said, error.count("\n")) == (2, "", 1)
    assert expected in error


def test_missing_parents_are_made(tmp_path: Path) -> None:
    scene, rom = write_scene(tmp_path / "s.toml", ground_scene()), write_ground_model(tmp_path / "g.h5")
    out = tmp_path / "a" / "b" / "c"
    assert shroud("respond", scene, "--rom", rom, "--out", out, "--quiet") == (0, "", "")
    assert summary_of(out)["complete"]


def test_no_room_for_an_export(finished: Path, tmp_path: Path) -> None:
    target = tmp_path / "x.mat"
    target.write_text("old")
    with largest_file(1000):
        status, _, error = shroud("export", finished / "response.h5", "--to", target)
    assert (status, error.count("\n")) == (1, 1)
    assert error.startswith(f"{tmp_path}: a file would get larger")
    assert [path.name for path in tmp_path.iterdir()] == ["x.mat"]
    assert target.read_text() == "old"
    assert shroud("export", finished / "response.h5", "--to", target, "--quiet") == (0, "", "")


def test_output_that_nobody_can_take(tmp_path: Path) -> None:
    scene = write_scene(tmp_path / "s.toml", small_scene())
    command = [sys.executable, "-m", "pipeline", "validate", str(scene)]
    with open("/dev/full", "w") as full:
        done = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert (done.returncode, done.stderr.count("\n")) == (1, 1)
    assert done.stderr.startswith("shroud: ")
    assert "No space left on device" in done.stderr


def test_times_of_files_mean_nothing(copied: Path) -> None:
    scene = write_scene(copied.parent / "small.toml", small_scene(sweep=SWEEP))
    assert shroud("run", scene, "--out", copied, "--quiet") == (0, "", "")  # figures name the scene in their data
    for number, path in enumerate(sorted(copied.rglob("*"))):
        os.utime(path, (0, 0) if number % 2 else (4e9, 4e9))
    assert shroud("run", scene, "--out", copied, "--quiet") == (0, "", "")
    assert set(statuses(copied).values()) == {"reused", "skipped"}
