"""What this package raises when it is given something it cannot work with."""

from __future__ import annotations


class RomParameterError(ValueError):
    """A parameter of the finite element or reduced model is out of range; the message is one line.

    Attributes name the scene table and key, the value found and what is allowed, so that a caller who
    knows the file can say where to look.
    """

    def __init__(self, table: str, parameter: str, value: object, allowed: str) -> None:
        super().__init__(table, parameter, value, allowed)  # all of them, so that it passes between processes
        self.table = table
        self.parameter = parameter
        self.value = value
        self.allowed = allowed

    def __str__(self) -> str:
        return f"{self.table}.{self.parameter} = {self.value!r}: {self.allowed}"


class FactorisationError(ArithmeticError):
    """A stiffness matrix could not be factorised; the message is one line and names the likely cause."""


class FullModelFileError(ValueError):
    """A file that is not a full model; the message names the file."""
