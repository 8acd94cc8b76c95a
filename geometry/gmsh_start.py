"""Start of gmsh without a home: no settings of the user are read, and none are written.

At its first start in a process gmsh reads, whatever its options say, the settings of its user interface (FLTK) and of
its solvers (PETSc), and writes those of FLTK: `~/.fltk` and, for the superuser, `/etc/fltk`.
"""

import ctypes
import os
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

# PETSc reads `.petscrc` of the working folder too; gmsh would warn of an option that is not its own
ARGUMENTS = ("gmsh", "-v", "0", "-skip_petscrc")
_NOBODY = 65534


def start_gmsh(gmsh: Any) -> None:
    """Initialise gmsh."""
    with _no_home(), _no_system_files():
        # interruptible=False: gmsh would install a signal handler, which Python allows in the main thread only
        gmsh.initialize(argv=list(ARGUMENTS), readConfigFiles=False, interruptible=False)


@contextmanager
def _no_home() -> Iterator[None]:
    """HOME below a device, where nothing can be, so that nothing is found or made there."""
    before = os.environ.get("HOME")
    os.environ["HOME"] = os.devnull
    try:
        yield
    finally:
        if before is None:
            del os.environ["HOME"]
        else:
            os.environ["HOME"] = before


@contextmanager
def _no_system_files() -> Iterator[None]:
    """For the superuser: files are opened with the rights of nobody, in this thread alone."""
    set_user = getattr(ctypes.CDLL(None), "setfsuid", None)  # Linux
    if set_user is None or os.geteuid() != 0:
        yield
        return
    before = set_user(_NOBODY)
    try:
        yield
    finally:
        set_user(before)
