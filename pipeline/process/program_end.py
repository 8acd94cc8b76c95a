"""The end of a program, without the time that Python takes to forget what it has loaded."""

from __future__ import annotations

import atexit
import os
import sys
import threading
from contextlib import suppress
from typing import NoReturn


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
