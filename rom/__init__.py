"""Reduced-order model of the blade: from mesh and material to the receptance of the relative contact displacement.

`finite_elements` assembles stiffness and mass, `reduction` condenses them by the Craig-Bampton method, `cyclic` holds
the reduced model and its modes, receptance and natural frequencies under cyclic symmetry, `linear_algebra` the sparse
factorisation and the eigenvalue solver, `stress` the stress on the mesh, `files` the HDF5 files. Docstrings cite the
paper by equation number.

A public name is imported from its file when it is first asked for: reading HDF5 needs neither SciPy nor scikit-fem.

References
----------
A. Gulisano, C. M. Firrone, S. Zucca, Forced response of shrouded blades with a coupled static/dynamic approach,
7th European Nonlinear Dynamics Conference (ENOC 2011), Rome, Italy, 2011.
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
        raise AttributeError(f"module 'rom' has no attribute {name!r}")
    return getattr(import_module(_PLACES[name]), name)


def __dir__() -> list[str]:
    return sorted([*globals(), *__all__])
