"""Nonlinear forced response: contact element, harmonic balance and continuation on a modal model.

The sub-packages, each built on those before it: `contact` (contact forces), `harmonic_balance` (the equations),
`stability` (Floquet exponents), `time_integration` (rings of blades in time), `continuation` (points along a curve),
`branches` (whole branches with peaks and bifurcations), `harmonic_selection` (truncation error),
`residual_tractions` (bounds of the peak), `worst_motion` (the highest motion that persists), `nonlinear_modes`
(frequency and damping over the amplitude), `mistuned_ring` (rings of blades that differ). `response_solver` puts
them together; `mode_agreement` compares nonlinear modes with a response curve.

A name is imported from its file when it is first asked for: options and limits need neither NumPy nor numba.

References
----------
A. Gulisano, C. M. Firrone, S. Zucca, "Forced response of shrouded blades with a coupled static/dynamic approach",
Proc. 7th European Nonlinear Dynamics Conference (ENOC 2011), Rome, 2011. Cited as "Gulisano et al. 2011".
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
        raise AttributeError(f"module 'nonlinear' has no attribute {name!r}")
    return getattr(import_module(_PLACES[name]), name)


def __dir__() -> list[str]:
    return sorted([*globals(), *__all__])
