"""Modules of NumPy for tests and for Fortran, not loaded before they are used.

SciPy copies every name of NumPy when it is imported, and with them loads these two, which nothing here uses: a fifth
to a third of the time that SciPy takes to load, in every process of a run.
"""

from __future__ import annotations

import sys
from importlib import import_module
from types import ModuleType
from typing import Any

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
