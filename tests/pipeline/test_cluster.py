"""Sweeps on a cluster of dask.distributed, by real schedulers and workers: the same bits as on this machine."""

import json
import os
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from threading import Event, Thread
from typing import Any

import h5py
import pytest
from faults_support import broken_entries, end_of, entries, wait_until
from pipeline_support import ground_scene, shroud, small_scene, write_ground_model, write_scene

import pipeline.executor.cluster
from pipeline import run_scene
from pipeline.executor.cluster import ClusterExecutor, version_line
from pipeline.executor.cluster_task import other_versions
from pipeline.stages.worker_start import versions

distributed = pytest.importorskip("distributed")
PROJECT = Path(__file__).parents[2]
FRICTIONS = [0.3, 0.35, 0.4, 0.45, 0.5, 0.55, 0.6, 0.65]
TIMES = ("seconds",)


def write_case(folder: Path, frictions: list[float] | None = None) -> tuple[Path, Path]:
    """A scene of a cheap sweep, with branches carried, and its reduced model."""
    response = {"frequency": [0.15, 0.25], "rayleigh": [0.0, 0.02], "stability": "folds", "search": "off"}
    contents = ground_scene() | {"response": response, "sweep": {"contact.friction": frictions or FRICTIONS}}
    return write_scene(folder / "scene.toml", contents), write_ground_model(folder / "model.h5")


def numbers(out: Path) -> dict[str, Any]:
    """Every dataset and attribute of response.h5 as bytes, without times, and response.csv."""
    found: dict[str, Any] = {"table": (out / "response.csv").read_bytes()}

    def note(name: str, item: h5py.Group | h5py.Dataset) -> None:
        if isinstance(item, h5py.Dataset) and not name.endswith(TIMES):
            found[name] = repr(item[()].tolist()) if item.dtype.hasobject else item[()].tobytes()
        found.update({f"{name}@{key}": repr(value) for key, value in item.attrs.items() if key not in TIMES})

    with h5py.File(out / "response.h5") as file:
        file.visititems(note)
    return found


@contextmanager
def programs(folder: Path, count: int, *options: str) -> Iterator[tuple[Path, list[subprocess.Popen[bytes]]]]:
    """A scheduler and workers as programs of their own, each in a folder of its own."""
    file, processes = folder / "scheduler.json", []
    try:
        processes.append(program(folder, "dask_scheduler", "--scheduler-file", file, "--port", "0"))
        wait_until(lambda: file.is_file() and file.read_text().endswith("}"), "the scheduler")
        for number in range(count):
            (folder / f"{number}").mkdir()
            processes.append(start_worker(folder / f"{number}", file, *options))
        yield file, processes
    finally:
        for process in processes:
            process.kill()
            process.wait()


def start_worker(folder: Path, file: Path, *options: object) -> subprocess.Popen[bytes]:
    """A worker without a nanny."""
    address = json.loads(file.read_text())["address"]
    return program(
        folder, "dask_worker", address, "--no-nanny", "--nthreads", "1", "--local-directory", folder, *options
    )


def program(folder: Path, name: str, *options: object) -> subprocess.Popen[bytes]:
    """A program of dask.distributed on this machine only."""
    environment = {**os.environ, "PYTHONPATH": str(PROJECT), "OPENBLAS_NUM_THREADS": "1"}
    command = [sys.executable, "-m", f"distributed.cli.{name}", "--host", "127.0.0.1", "--no-dashboard"]
    command += [str(option) for option in options]
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    return subprocess.Popen(command, cwd=folder, env=environment, **quiet)


def listening(root: int) -> set[str | int]:
    """Ports, and names of Unix sockets, at which a process or one below it listens; as Linux tells."""
    parents = {}
    for status in Path("/proc").glob("[0-9]*/stat"):
        with suppress(OSError):
            parents[int(status.parent.name)] = int(status.read_text().rpartition(")")[2].split()[1])
    tree, before = {root}, 0
    while len(tree) > before:
        before = len(tree)
        tree |= {pid for pid, parent in parents.items() if parent in tree}
    held = set()
    for pid in tree:
        with suppress(OSError):
            for file in Path(f"/proc/{pid}/fd").iterdir():
                with suppress(OSError):
                    held.add(os.readlink(file))
    found: set[str | int] = set()
    for table in (Path("/proc/net/tcp"), Path("/proc/net/tcp6")):
        for row in table.read_text().splitlines()[1:] if table.exists() else ():
            cells = row.split()
            if cells[3] == "0A" and f"socket:[{cells[9]}]" in held:
                found.add(int(cells[1].rpartition(":")[2], 16))
    for row in Path("/proc/net/unix").read_text().splitlines()[1:]:
        cells = row.split()
        if int(cells[3], 16) & 0x10000 and f"socket:[{cells[6]}]" in held:
            found.add(cells[7])
    return found


def reached_by_another_user(addresses: set[str | int]) -> int:
    """Number of these sockets to which the user nobody can connect."""
    child = os.fork()
    if child == 0:
        reached = 0
        os.setgroups([])
        os.setgid(65534)
        os.setuid(65534)
        for address in addresses:
            family = socket.AF_INET if isinstance(address, int) else socket.AF_UNIX
            place: Any = ("127.0.0.1", address) if isinstance(address, int) else address.replace("@", "\0", 1)
            with suppress(OSError), socket.socket(family) as client:
                client.connect(place)
                reached += 1
        os._exit(reached)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])


@contextmanager
def watched(look: Callable[[], set[str | int]]) -> Iterator[set[str | int]]:
    """All that `look` gives while the block runs."""
    found: set[str | int] = set()
    over = Event()

    def watch() -> None:
        while not over.wait(0.3):  # looking through all processes takes time
            found.update(look())

    thread = Thread(target=watch)
    thread.start()
    try:
        yield found
    finally:
        over.set()
        thread.join()


@pytest.fixture(scope="module")
def local(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a finished run in this process: scene.toml, model.h5 and `out`."""
    folder = tmp_path_factory.mktemp("local")
    scene, rom = write_case(folder)
    assert run_scene(scene, folder / "out", rom=rom, until="respond").complete
    return folder


def test_a_cluster_started_here_gives_the_same_bits(
    local: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """And listens nowhere: whoever can connect to a scheduler has its workers run what they like."""
    scene, rom = local / "scene.toml", local / "model.h5"
    options = {"rom": rom, "until": "respond"}
    before = listening(os.getpid())
    with watched(lambda: listening(os.getpid()) - before) as places:
        found = run_scene(scene, tmp_path / "out", scheduler="local:2", quiet=False, **options)
    assert places == set()
    assert found.complete
    assert numbers(tmp_path / "out") == numbers(local / "out")
    said = capsys.readouterr().err
    assert "2 workers on this machine: one task and one BLAS thread each, at most " in said
    assert f"curves, {len(FRICTIONS)} of {len(FRICTIONS)} done: " in said
    assert entries(tmp_path / "out", "tmp") == []
    # another engine, on the same folder: nothing is computed; with one more value only what depends on it
    assert run_scene(scene, tmp_path / "out", **options).summary["stages"]["respond"]["ran"] == 0
    more = write_case(tmp_path, [*FRICTIONS, 0.7])[0]
    before = set(entries(tmp_path / "out", "curve"))
    run_scene(more, tmp_path / "out", **options)
    assert len(set(entries(tmp_path / "out", "curve")) - before) == 1


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can become another user")
def test_a_socket_that_another_user_reaches_is_seen() -> None:
    """What the test above would find: a port and an abstract Unix socket, as dask and forkserver have them."""
    before = listening(os.getpid())
    with socket.socket() as port, socket.socket(socket.AF_UNIX) as abstract:
        port.bind(("127.0.0.1", 0))
        abstract.bind(f"\0shroud-test-{os.getpid()}")
        for one in (port, abstract):
            one.listen()
        places = listening(os.getpid()) - before
        assert places == {port.getsockname()[1], f"@shroud-test-{os.getpid()}"}
        assert reached_by_another_user(places) == 2


@pytest.mark.long
def test_workers_and_schedulers_that_are_lost(local: Path, tmp_path: Path) -> None:
    """Programs apart, without a common folder: the client is killed, then a worker, then the scheduler."""
    out, scene, rom = tmp_path / "out", local / "scene.toml", local / "model.h5"
    code = (
        "import sys, pipeline.cli, pipeline.executor.cluster\n"
        "pipeline.executor.cluster.PATIENCE = 2.0\n"
        "sys.exit(pipeline.cli.command(sys.argv[1:]))\n"
    )
    command = [sys.executable, "-c", code, "respond", scene, "--rom", rom, "--out", out, "--quiet"]
    environment = {**os.environ, "PYTHONPATH": str(PROJECT)}

    def client(file: Path) -> subprocess.Popen[str]:
        arguments = [str(part) for part in [*command, "--scheduler", file]]
        return subprocess.Popen(arguments, stderr=subprocess.PIPE, text=True, env=environment)

    def stored() -> int:
        return len(entries(out, "curve"))

    with programs(tmp_path, 2) as (file, processes):
        process = client(file)
        wait_until(lambda: stored() >= 1, "the first curve")
        process.kill()
        process.communicate()
        before, process = stored(), client(file)
        wait_until(lambda: stored() > before, "a curve of the next client")
        processes[1].kill()
        before = stored()
        wait_until(lambda: stored() > before, "a curve of the other worker")
        processes[0].kill()
        _, error = end_of(process)
        assert process.returncode == 1
        assert error.startswith("the scheduler at tcp://127.0.0.1:")
        assert error.endswith(" is lost; what is done is kept, the same command goes on from there\n")
    assert broken_entries(out) == []
    assert before < stored() < len(FRICTIONS)
    assert run_scene(scene, out, rom=rom, until="respond").complete
    assert numbers(out) == numbers(local / "out")


@pytest.mark.long
def test_reduced_models_are_built_by_workers_too(tmp_path: Path) -> None:
    """To the same bits, and each once; what cannot be built is told of as without them."""
    swept = {"shroud.angle": [70.0, 80.0], "load.speed_rpm": [0.0]}
    scene = write_scene(tmp_path / "scene.toml", small_scene(sweep=swept, mesh__size=0.018))
    outs = {name: tmp_path / name for name in ("one", "two", "cluster")}
    runs = {
        "one": run_scene(scene, outs["one"], until="respond"),
        "two": run_scene(scene, outs["two"], until="respond", jobs=2),
        "cluster": run_scene(scene, outs["cluster"], until="respond", scheduler="local:2"),
    }
    for name, found in runs.items():
        stages = found.summary["stages"]
        assert [stages[stage]["ran"] for stage in ("mesh", "assemble", "reduce", "respond")] == [2, 2, 2, 2], name
        assert [stages[stage]["reused"] for stage in ("mesh", "reduce")] == [0, 0], name
        assert numbers(outs[name]) == numbers(outs["one"])
        for entry in entries(outs["one"], "reduce"):
            assert (outs[name] / "store" / "reduce" / entry.name / "rom.h5").read_bytes() == (
                entry / "rom.h5"
            ).read_bytes()
    assert [len(entries(outs[name], "assemble")) for name in outs] == [2, 0, 0]  # they stay with the workers


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (
            ["--scheduler", "here:8786"],
            '--scheduler: "here:8786", allowed: tcp://HOST:PORT, tls://HOST:PORT or a sch',
        ),
        (
            ["--scheduler", "none.json"],
            "--scheduler: none.json: No such file or directory, allowed: the file that `da",
        ),
        (
            ["--scheduler", "empty.json"],
            "--scheduler: empty.json: no scheduler file, allowed: the file that `dask sch",
        ),
        (["--scheduler", "device.json"], "--scheduler: device.json: not a file, allowed: the file that `dask sched"),
        (["--scheduler", "tcp://127.0.0.1:1"], "--scheduler: no scheduler at tcp://127.0.0.1:1 (no answer, within "),
        (["--cluster", "local:0"], '--cluster: "local:0", allowed: local:N, a number N of workers from 1 to 256'),
        (["--cluster", "slurm:4"], '--cluster: "slurm:4", allowed: local:N, a number N of workers from 1 to 256'),
        (["--cluster", "local:2", "--jobs", "2"], "--jobs: 2 beside --cluster, allowed: one of the two"),
        (["--cluster", "local:2", "--scheduler", "a"], '--cluster: "local:2" beside --scheduler, allowed: one of t'),
    ],
)
def test_a_cluster_that_is_none_is_one_line(
    local: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, options: list[str], said: str
) -> None:
    monkeypatch.setattr(pipeline.executor.cluster, "PATIENCE", 0.5)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "empty.json").write_text("{}")
    (tmp_path / "device.json").symlink_to("/dev/zero")
    arguments = ["respond", local / "scene.toml", "--rom", local / "model.h5", "--out", tmp_path / "out", "--quiet"]
    status, _, error = shroud(*arguments, *options)
    assert (status, error.count("\n")) == (2, 1)
    assert error.startswith(said)
    assert not (tmp_path / "out").exists()


def test_workers_that_do_not_come_or_run_several_tasks_are_refused(
    local: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(pipeline.executor.cluster, "WAIT_FOR_WORKERS", 0.5)
    arguments = ["respond", local / "scene.toml", "--rom", local / "model.h5", "--out", tmp_path / "out", "--quiet"]
    with programs(tmp_path, 0) as (file, processes):
        status, _, error = shroud(*arguments, "--scheduler", file)
        assert (status, error.count("\n")) == (2, 1)
        assert "no worker at tcp://127.0.0.1:" in error
        processes.append(start_worker(tmp_path, file, "--nthreads", "2"))
        monkeypatch.setattr(pipeline.executor.cluster, "WAIT_FOR_WORKERS", 30.0)
        status, _, error = shroud(*arguments, "--scheduler", file)
        assert (status, error.count("\n")) == (2, 1)
        assert "runs 2 tasks at the same time, allowed: one: start it with --nthreads 1" in error
    assert not (tmp_path / "out").exists()


def test_a_worker_with_another_version_is_named_with_it() -> None:
    here = versions()
    assert {"program", "Python", "numpy", "scipy", "numba", "distributed", "processor"} <= set(here)
    assert version_line("tcp://w:1", here, dict(here)) is None
    assert version_line("tcp://w:1", here, here | {"processor": "another"}) is None  # warned of, not refused
    line = version_line("tcp://w:1", here, here | {"numpy": "1.0", "program": "0"})
    assert line is not None
    assert line.startswith(
        f"worker tcp://w:1: other versions than here: program 0 (here {here['program']}), numpy 1.0 "
    )
    without = {name: version for name, version in here.items() if name != "scipy"}
    assert other_versions(here, without) == {"scipy": "absent"}


@pytest.mark.long
def test_a_full_disk_of_a_worker_is_one_line_and_other_workers_go_on(
    local: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One worker may write files of 2 kB at most: its tasks are begun again on the other one."""
    with programs(tmp_path, 1) as (file, processes):
        small = tmp_path / "small"
        small.mkdir()
        address = json.loads(file.read_text())["address"]
        limited = f"ulimit -f 4; exec {sys.executable} -m distributed.cli.dask_worker {address} --no-nanny"
        quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        environment = {**os.environ, "PYTHONPATH": str(PROJECT)}
        options = f" --nthreads 1 --no-dashboard --host 127.0.0.1 --local-directory {small}"
        processes.append(subprocess.Popen(["sh", "-c", limited + options], cwd=small, env=environment, **quiet))
        with distributed.Client(address, set_as_default=False) as client:
            client.wait_for_workers(2, timeout=30)
        rom, out = local / "model.h5", tmp_path / "out"
        found = run_scene(local / "scene.toml", out, rom=rom, until="respond", scheduler=str(file))
    assert [curve.reason for curve in found.curves if not curve.complete] == []
    assert numbers(out) == numbers(local / "out")


@pytest.mark.long
def test_a_task_meant_for_a_worker_that_leaves_is_begun_on_another(
    local: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The only worker is killed while a task is sent to it, and another worker comes."""
    with programs(tmp_path, 1) as (file, processes):
        send, killed = ClusterExecutor._send, []

        def deadly_send(self: ClusterExecutor, job: Any) -> None:
            if not killed and self._workers:
                job.preferred = next(iter(self._workers))
                send(self, job)
                killed.append(processes[1].kill())
                (tmp_path / "next").mkdir()
                processes.append(start_worker(tmp_path / "next", file))
            else:
                send(self, job)

        monkeypatch.setattr(ClusterExecutor, "_send", deadly_send)
        rom, out = local / "model.h5", tmp_path / "out"
        found = run_scene(local / "scene.toml", out, rom=rom, until="respond", scheduler=str(file))
    assert killed
    assert found.complete
    assert numbers(out) == numbers(local / "out")
