"""Garbage collection is off while a process loads its modules, and back afterwards."""

import gc
import subprocess
import sys

import pytest

from pipeline.process.program import loading


def test_garbage_is_collected_again_after_loading_though_that_failed() -> None:
    with loading():
        assert not gc.isenabled()
    assert gc.isenabled()
    with pytest.raises(ImportError), loading():
        import no_such_module  # noqa: F401
    assert gc.isenabled()
    gc.unfreeze()


def test_a_command_collects_rarely() -> None:
    program = "import gc, pipeline.cli as cli; cli.command = lambda _: print(gc.get_threshold()[0]) or 0; cli.main()"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert int(done.stdout) >= 10_000
