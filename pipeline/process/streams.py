"""Standard streams that are closed, full or cannot write every character: none of that stops a command."""

from __future__ import annotations

import codecs
import os
import sys
from contextlib import suppress

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
