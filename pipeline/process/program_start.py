"""Settings of libraries for a program that is to start quickly, made before any of them is loaded."""

from __future__ import annotations

import os

# OpenBLAS: one thread, as all that is computed here uses; others would be started, and wait for work. pydantic: no
# search for plugins of other packages, which reads the files of all installed ones.
_SETTINGS = {"OPENBLAS_NUM_THREADS": "1", "PYDANTIC_DISABLE_PLUGINS": "__all__"}


def prepare_libraries() -> None:
    """Set what is not set yet in the environment of this process; for the start of a program."""
    for name, value in _SETTINGS.items():
        os.environ.setdefault(name, value)
