"""How a program starts quickly and ends: settings of libraries, standard streams, rare garbage collection.

Standard streams that are closed, full or cannot write every character stop no command. Garbage collection while
modules are loaded finds nothing, and takes a tenth of the time. SciPy copies every name of NumPy when it is imported,
and so loads two modules that nothing here uses: a fifth to a third of the time that SciPy takes to load, in every
process of a run; they are deferred.
"""

from __future__ import annotations

import atexit
import codecs
import gc
import os
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from importlib import import_module
from types import ModuleType
from typing import Any, NoReturn


def end_program(status: int) -> NoReturn:
    """End this process with an exit status, once its streams are flushed and what was registered for its end is done.

    Other threads that Python would wait for are waited for: the interpreter then ends as it always does.
    """
    if any(not thread.daemon for thread in threading.enumerate() if thread is not threading.main_thread()):
        sys.exit(status)
    atexit._run_exitfuncs()
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError, ValueError, AttributeError):
            stream.flush()
    os._exit(status)


# what stands for characters of tables, units and names where a terminal has ASCII only
_PLAIN = {
    "µ": "u",
    "°": " deg",
    "²": "^2",
    "³": "^3",
    "–": "-",
    "…": "...",
    **dict.fromkeys("─━═╴╶╸╺", "-"),
    **dict.fromkeys("│┃║", "|"),
    **dict.fromkeys("┌┐└┘├┤┬┴┼┏┓┗┛┣┫┳┻╋┡┩╇╈┢┪", "+"),
}
_ERRORS = "shroud-plain"


def prepare_streams() -> None:
    """Make the standard streams usable, whatever they were given as; for the start of a program.

    A closed one becomes the null device, so that no file opened later gets its number and the output with it.
    Characters that the encoding of a stream lacks are written by similar ones of ASCII.
    """
    for number, mode in ((0, os.O_RDONLY), (1, os.O_WRONLY), (2, os.O_WRONLY)):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, mode)  # takes the lowest free number, which is this one
    codecs.register_error(_ERRORS, _plain)
    for name, number in (("stdout", 1), ("stderr", 2)):
        if getattr(sys, name) is None:
            setattr(sys, name, os.fdopen(number, "w", encoding="utf-8", closefd=False))
        with suppress(AttributeError, ValueError):  # another kind of stream: its own matter
            getattr(sys, name).reconfigure(errors=_ERRORS)


def flush_stdout() -> OSError | None:
    """Flush stdout at the end; the error where that fails, after which nothing more is written there."""
    try:
        sys.stdout.flush()
    except OSError as error:
        with suppress(OSError, ValueError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return error
    return None


def _plain(error: UnicodeError) -> tuple[bytes, int]:
    """An error handler of codecs; bytes of file names that are no text are written as they are."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    return b"".join(map(_ascii, error.object[error.start : error.end])), error.end


def _ascii(character: str) -> bytes:
    if character in _PLAIN:
        return _PLAIN[character].encode("ascii")
    try:
        return character.encode("ascii", "surrogateescape")
    except UnicodeEncodeError:
        return character.encode("ascii", "backslashreplace")


_THRESHOLDS = 20_000, 10, 10  # Python's own first one, 700, is for programs that make less than libraries at import


def collect_rarely() -> None:
    """Look for garbage in this process after 20 000 new objects and not after 700: for a command, which soon ends."""
    gc.set_threshold(*_THRESHOLDS)


@contextmanager
def loading() -> Iterator[None]:
    """Do not look for garbage within the block, nor ever among what was loaded there: for a process that lives on."""
    gc.disable()
    try:
        yield
    finally:
        gc.freeze()
        gc.enable()


UNUSED = ("testing", "f2py")  # of NumPy


class _Deferred(ModuleType):
    """Stands for a module until an attribute of it is asked for; the module then takes its place."""

    def __getattr__(self, name: str) -> Any:
        if sys.modules.get(self.__name__) is self:
            del sys.modules[self.__name__]
        return getattr(import_module(self.__name__), name)


def defer_unused() -> None:
    """Defer the loading of `UNUSED` in this process, where they are not loaded yet."""
    import numpy

    for name in UNUSED:
        module = f"numpy.{name}"
        if module not in sys.modules:
            sys.modules[module] = _Deferred(module)
            setattr(numpy, name, sys.modules[module])


# OpenBLAS: one thread, as all that is computed here uses; others would be started, and wait for work. pydantic: no
# search for plugins of other packages, which reads the files of all installed ones.
_SETTINGS = {"OPENBLAS_NUM_THREADS": "1", "PYDANTIC_DISABLE_PLUGINS": "__all__"}


def prepare_libraries() -> None:
    """Set what is not set yet in the environment of this process; for the start of a program."""
    for name, value in _SETTINGS.items():
        os.environ.setdefault(name, value)
