"""What this package raises when it is given something it cannot work with."""

from __future__ import annotations


class RomParameterError(ValueError):
    """A parameter of the finite element or reduced model is out of range; the message is one line.

    Attributes name the scene table and key, the value found and what is allowed, so that a caller who
    knows the file can say where to look.
    """

    def __init__(self, table: str, parameter: str, value: object, allowed: str) -> None:
        self.table = table
        self.parameter = parameter
        self.value = value
        self.allowed = allowed
        super().__init__(f"{table}.{parameter} = {value!r}: {allowed}")


class FactorisationError(ArithmeticError):
    """A stiffness matrix could not be factorised; the message is one line and names the likely cause."""


class FullModelFileError(ValueError):
    """A file that is not a full model; the message names the file."""
