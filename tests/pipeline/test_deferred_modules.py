"""Modules that nothing here uses are not loaded with SciPy, and are what they always are for those who use them."""

import subprocess
import sys

import pytest

SCIPY = "from pipeline.process.program import defer_unused; defer_unused(); import scipy.linalg, sys, numpy\n"
LOADED = "assert any(name.startswith('numpy.{}.') for name in sys.modules)\n"


def test_scipy_loads_neither() -> None:
    run(SCIPY + "assert not [name for name in sys.modules if name.startswith(('numpy.testing.', 'numpy.f2py.'))]")


@pytest.mark.parametrize(
    "use",
    [
        "numpy.testing.assert_allclose(1.0, 1.0)\n" + LOADED.format("testing"),
        "from numpy.testing import assert_equal; assert_equal(1, 1)",
        "import numpy.testing as t; t.assert_equal(1, 1); import numpy.testing; numpy.testing.assert_(True)",
        "import numpy.testing.overrides as o; assert o.__name__ == 'numpy.testing.overrides'",
        "assert numpy.f2py.get_include()\n" + LOADED.format("f2py"),
        "import numpy.f2py; assert sys.modules['numpy.f2py'].__file__ and numpy.f2py.__doc__",
    ],
)
def test_it_is_there_when_it_is_used(use: str) -> None:
    run(SCIPY + use)


def test_a_loaded_module_stays() -> None:
    run("import numpy.testing as before\n" + SCIPY + "assert numpy.testing is before is sys.modules['numpy.testing']")


def run(program: str) -> None:
    """Run a program of Python; it must end well."""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
