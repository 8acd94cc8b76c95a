"""Scene files, stages and their cached results, sweeps, figures, renders and the command line; no equations.

The Python interface: `run_scene`, `read_results` and what they return. A name is imported from its module when it is
first asked for, so `import pipeline` costs nothing.
"""

from importlib import import_module
from pathlib import Path
from re import findall
from typing import Any

# The stub beside lists the public names, once: type checkers read it, and here it says where each is defined.
_STUB = Path(__file__).with_suffix(".pyi").read_text(encoding="utf-8")
_PLACES = {name: module for module, name in findall(r"from ([\w.]+) import (\w+) as", _STUB)}
__version__ = "0.4.0"
__all__ = list(_PLACES)


def __getattr__(name: str) -> Any:
    if name not in _PLACES:
        raise AttributeError(f"module 'pipeline' has no attribute {name!r}")
    return getattr(import_module(_PLACES[name]), name)


def __dir__() -> list[str]:
    return sorted([*globals(), *__all__])
