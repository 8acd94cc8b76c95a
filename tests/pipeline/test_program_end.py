"""Start and end of a program: settings of libraries, and an end that leaves nothing undone."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

PROJECT = Path(__file__).parents[2]


def ended(code: str, **settings: str) -> subprocess.CompletedProcess[str]:
    environment = {key: value for key, value in os.environ.items() if key not in ("OPENBLAS_NUM_THREADS",)}
    environment |= {"PYTHONPATH": str(PROJECT), **settings}
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False, env=environment)


@pytest.mark.parametrize("status", [0, 3])
def test_output_is_complete_and_what_was_registered_is_done(status: int) -> None:
    code = (
        "import atexit, sys\nfrom pipeline.process.program import end_program\n"
        "atexit.register(lambda: print('registered'))\n"
        "sys.stdout.write('x' * 100_000 + '\\n'); sys.stderr.write('error')\n"
        f"end_program({status})\nprint('never')"
    )
    result = ended(code)
    assert result.returncode == status
    assert result.stdout.split() == ["x" * 100_000, "registered"]
    assert result.stderr == "error"


def test_other_threads_are_waited_for() -> None:
    code = (
        "import threading, time\nfrom pipeline.process.program import end_program\n"
        "threading.Thread(target=lambda: (time.sleep(0.2), print('done'))).start()\nend_program(4)"
    )
    result = ended(code)
    assert (result.returncode, result.stdout) == (4, "done\n")


def test_threads_of_blas_are_set_before_numpy_is_loaded_unless_the_user_has_set_them() -> None:
    code = (
        "import os, sys\nfrom pipeline.process.program import prepare_libraries\nprepare_libraries()\n"
        "assert 'numpy' not in sys.modules\nimport numpy\nfrom threadpoolctl import threadpool_info\n"
        "print({each['num_threads'] for each in threadpool_info() if each['user_api'] == 'blas'})\n"
        "print(os.environ['OPENBLAS_NUM_THREADS'])"
    )
    assert ended(code).stdout.split() == ["{1}", "1"]
    assert ended(code, OPENBLAS_NUM_THREADS="2").stdout.split()[1] == "2"
