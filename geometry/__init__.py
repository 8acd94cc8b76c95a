"""Blade and shroud geometry and its mesh: no material, no matrices, no frequencies.

A name is imported from its module when it is first asked for.
"""

from importlib import import_module
from pathlib import Path
from re import findall
from typing import Any

# The stub beside lists the public names, once: type checkers read it, and here it says where each is defined.
_STUB = Path(__file__).with_suffix(".pyi").read_text(encoding="utf-8")
_PLACES = {name: module for module, name in findall(r"from ([\w.]+) import (\w+) as", _STUB)}
__all__ = list(_PLACES)


def __getattr__(name: str) -> Any:
    if name not in _PLACES:
        raise AttributeError(f"module 'geometry' has no attribute {name!r}")
    return getattr(import_module(_PLACES[name]), name)


def __dir__() -> list[str]:
    return sorted([*globals(), *__all__])
