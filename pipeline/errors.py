"""Exceptions of the pipeline; every message is one line."""

from __future__ import annotations

import errno
import os
from contextlib import suppress
from typing import Any

SAVES_MEMORY = "fewer jobs (--jobs), a larger mesh.size, fewer modes or harmonics need less"
_LONGEST_VALUE = 80
_LONGEST_KEY = 60
_NO_ROOM = "failed to map segment"  # of the loader of shared libraries
_NO_THREAD = "can't start new thread"  # of Python
_REMEDIES = {
    errno.EMFILE: "too many open files; raise the limit (ulimit -n) or use fewer jobs (--jobs)",
    errno.ENFILE: "the system has too many open files; end other programs or use fewer jobs (--jobs)",
    errno.EAGAIN: "no further process can start; raise the limit (ulimit -u) or use fewer jobs (--jobs)",
}
_SYSTEM_LIBRARIES = "python -m pipeline.bootstrap installs the system libraries or names the command that does"


class InputError(Exception):
    """Bad input; the message names the file, the dotted key, the value found and the values allowed.

    Attributes
    ----------
    source, key : str
        The file and the dotted key as in the message; empty where it names none.

    Examples
    --------
    >>> from pipeline import read_scene
    >>> try:
    ...     read_scene("nowhere.toml")
    ... except InputError as error:
    ...     print(error)
    nowhere.toml: no such file
    """

    source = key = ""


class ExecutorLost(Exception):
    """No further task can run: the scheduler or all workers are gone, or a worker has another version."""


class StageError(Exception):
    """A stage that could not compute its result."""

    def __init__(self, stage: str, cause: Exception) -> None:
        self.cause = cause  # the exception behind it
        missing = isinstance(cause, OSError) and "shared object file" in str(cause)
        super().__init__(f"{stage}: {reason_of(cause)}" + (f"; {_SYSTEM_LIBRARIES}" if missing else ""))

    @property
    def is_input(self) -> bool:
        """Whether the cause names a key of the scene, or is a file that cannot be used."""
        names = ("table", "parameter", "value", "allowed")
        return isinstance(self.cause, InputError) or all(hasattr(self.cause, name) for name in names)


def input_error(source: str | os.PathLike[str], key: str, found: str, allowed: str = "") -> InputError:
    """An InputError with the one line of all messages about input: `source: key: found, allowed: ...`.

    A file that is not there needs no list of what is allowed.
    """
    place = f"{os.fspath(source)}: {key}" if key else os.fspath(source)
    error = InputError(one_line(f"{place}: {found}" + (f", allowed: {allowed}" if allowed else "")))
    error.source, error.key = one_line(os.fspath(source)), one_line(key)
    return error


def shown(value: Any) -> str:
    """The value as a user typed it, on one line and of bounded length."""
    try:
        text = f'"{value}"' if isinstance(value, str) else repr(value)
    except ValueError:  # Python refuses to print whole numbers of thousands of digits
        text = "a number of thousands of digits"
    text = {"True": "true", "False": "false"}.get(text, text)
    text = one_line(text)
    return text if len(text) <= _LONGEST_VALUE else text[: _LONGEST_VALUE - 3] + "..."


def shown_file(file: str) -> str:
    """The name of a file on one line; of a long one its end, which tells it from others."""
    text = one_line(file)
    return f'"{text}"' if len(text) + 2 <= _LONGEST_VALUE else f'"...{text[5 - _LONGEST_VALUE :]}"'


def one_line(text: str) -> str:
    """`text` with line breaks, tabs and other unprintable characters turned into spaces.

    Bytes of a file name that the locale does not know, which Python holds as surrogates, are read as UTF-8.
    """
    with suppress(UnicodeEncodeError):  # other surrogates
        text = text.encode("utf-8", "surrogateescape").decode("utf-8", "backslashreplace")
    return " ".join("".join(c if c.isprintable() else " " for c in text).split())


def reason_of(error: BaseException) -> str:
    """The message of an exception on one line, its type where it has none; with advice where there is some."""
    said = one_line(str(error))
    advice = advice_on(error)
    if advice:
        return f"{advice} ({said})" if said else advice
    return said or type(error).__name__


def advice_on(error: BaseException) -> str:
    """What to do where memory, open files or processes have run out (the disk: `pipeline.store.disk_errors`)."""
    number = error.errno if isinstance(error, OSError) else None
    causes = [error, error.__cause__, error.__context__]
    if any(_NO_THREAD in str(cause) for cause in causes):
        return f"no further thread can start; raise the limit (ulimit -u), or there is no memory: {SAVES_MEMORY}"
    if isinstance(error, MemoryError) or number == errno.ENOMEM or any(_NO_ROOM in str(cause) for cause in causes):
        return f"out of memory; {SAVES_MEMORY}"
    return _REMEDIES.get(number, "") if number is not None else ""


def system_reason(error: OSError) -> str:
    """The words of the operating system for an error, with advice where it has no more of something."""
    return advice_on(error) or error.strerror or reason_of(error)


def shown_key(key: str) -> str:
    """A key as TOML would write it: bare where it can be, quoted where it must."""
    bare = key != "" and all(c.isascii() and (c.isalnum() or c in "_-") for c in key)
    return key if bare and len(key) <= _LONGEST_KEY else shown(key)
