"""Exceptions of this package."""

from __future__ import annotations

from geometry import ParameterError


class RomParameterError(ParameterError):
    """A parameter of the finite element model or of the reduction is out of its range; the message is one line."""


class ReducedModelError(ValueError):
    """A reduced model that is inconsistent; the message names the quantity, its value and what is allowed."""


class FactorisationError(ArithmeticError):
    """A stiffness matrix that cannot be factorised; the message is one line and names the likely cause."""


class FullModelFileError(ValueError):
    """A file that does not hold a full model; the message names the file."""
