"""Workers forked from one prepared process: prepared once, each on its own, and none is left behind."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from pipeline.process.worker_processes import can_fork, fork_workers
from pipeline.process.workers import Call, WorkerDied, Workers, kept_workers, workers

pytestmark = pytest.mark.skipif(not can_fork(), reason="processes are forked on Linux only")


def note(folder: Path) -> None:
    """A preparation that says where it was made and leaves something loaded."""
    import fractions  # noqa: F401

    (folder / str(os.getpid())).touch()


def loaded_here(name: str) -> tuple[int, bool]:
    """In a worker: its process, and whether a module is loaded there."""
    time.sleep(0.2)  # so that one worker does not take both calls
    return os.getpid(), name in sys.modules


def two_calls(pool: Workers, name: str) -> list[tuple[int, bool]]:
    return [future.result() for _, future in pool.completed({k: Call(loaded_here, (name,)) for k in range(2)})]


def test_all_workers_have_what_one_process_has_loaded(tmp_path: Path) -> None:
    with kept_workers() as kept:
        kept.count = 2
        kept.prepare(Call(note, (tmp_path,)))
        with workers(2) as pool:
            found = two_calls(pool, "fractions")
    prepared = {int(path.name) for path in tmp_path.iterdir()}
    assert len(prepared) == 1
    pids = {pid for pid, _ in found}
    assert len(pids) == 2
    assert not pids & {*prepared, os.getpid()}
    assert all(loaded for _, loaded in found)


def test_a_killed_one_says_so_and_the_other_one_goes_on() -> None:
    with kept_workers() as kept:
        kept.count = 2
        kept.prepare(Call(abs, (-1,)))
        with workers(2) as pool:
            other, killed = (pid for pid, _ in two_calls(pool, "os"))
            os.kill(killed, signal.SIGKILL)
            again = {pid for pid, _ in two_calls(pool, "os")}
            assert other in again
            assert killed not in again
        with workers(2) as pool:
            ((_, future),) = pool.completed({1: Call(os._exit, (3,))}, attempts=1)
            with pytest.raises(WorkerDied, match=r"^its process ended with exit status 3$"):
                future.result()


def test_where_the_prepared_process_dies_its_workers_go_on() -> None:
    ((worker, pipe),) = fork_workers(1, abs, (-1,), True)
    assert [pipe.recv(), pipe.recv()] == [(None, None), (True, None)]
    worker.parent.process.kill()
    worker.parent.process.join()
    pipe.send((abs, (-2,), {}, False))
    assert pipe.recv() == (True, 2)
    worker.kill()
    worker.join()
    with pytest.raises(EOFError):
        pipe.recv()


def test_they_end_with_the_process_that_started_them(tmp_path: Path) -> None:
    code = (
        "import os, sys\nfrom pathlib import Path\nfrom pipeline.process.worker_processes import fork_workers\n"
        "found = fork_workers(2, abs, (-1,), True)\n"
        "pids = []\n"
        "for worker, pipe in found:\n"
        "    pipe.recv(), pipe.recv(), pipe.send((os.getpid, (), {}, False))\n"
        "    pids.append(pipe.recv()[1])\n"
        "print(*pids, found[0][0].parent.process.pid, flush=True)\n"
        "os.kill(os.getpid(), 9)"
    )
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])}
    result = subprocess.run(
        [sys.executable, "-c", code], stdout=subprocess.PIPE, text=True, check=False, env=environment, cwd=tmp_path
    )
    pids = [int(each) for each in result.stdout.split()]
    assert len(pids) == 3
    deadline = time.monotonic() + 20.0
    while any(runs(pid) for pid in pids):
        assert time.monotonic() < deadline
        time.sleep(0.02)


def runs(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] not in "ZX"
    except OSError:
        return False
