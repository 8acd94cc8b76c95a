"""Exceptions of this package, and the check of a single parameter."""

from __future__ import annotations

import math
import numbers
import os

from geometry.errors import ParameterError


class RomParameterError(ParameterError):
    """A parameter of the finite element model or of the reduction is out of its range; the message is one line.

    Examples
    --------
    >>> from rom import Material, RomParameterError
    >>> try:
    ...     Material(young_modulus=2e11, poisson_ratio=0.5, density=7800.0)
    ... except RomParameterError as error:
    ...     print(error)
    material.poisson_ratio = 0.5: must lie between -1 and 0.4999
    """


class ReducedModelError(ValueError):
    """A reduced model that is inconsistent; the message names the quantity, its value and what is allowed.

    Examples
    --------
    >>> from rom import ReducedModelError, read_reduced_model
    >>> try:
    ...     read_reduced_model("missing.h5")
    ... except ReducedModelError as error:
    ...     print(error)
    missing.h5: no such file
    """


class FactorisationError(ArithmeticError):
    """A stiffness matrix that cannot be factorised; the message is one line and names the likely cause.

    Examples
    --------
    >>> from rom import FactorisationError
    >>> from rom.linear_algebra.factorisation import factorise
    >>> from scipy.sparse import csr_matrix
    >>> try:
    ...     factorise(csr_matrix(np.zeros((2, 2))))
    ... except FactorisationError as error:
    ...     print(str(error).partition(":")[0])
    the stiffness matrix is not positive definite
    """


class FullModelFileError(ValueError):
    """A file that does not hold a full model; the message names the file."""


class MatrixFileError(ValueError):
    """A file with a matrix or a table of nodes that cannot be used; the message is one line.

    Parameters
    ----------
    path : str or path
        The file.
    found : str
        What is wrong with it.
    allowed : str
        What is allowed.

    Attributes
    ----------
    path, found, allowed : str
        As given.

    Examples
    --------
    >>> from rom import MatrixFileError, read_matrix
    >>> try:
    ...     read_matrix("missing.sti")
    ... except MatrixFileError as error:
    ...     print(str(error).partition(", allowed")[0])
    missing.sti: no such file or directory
    """

    def __init__(self, path: str | os.PathLike[str], found: str, allowed: str) -> None:
        self.path, self.found, self.allowed = os.fspath(path), " ".join(found.split()), allowed
        super().__init__(f"{self.path}: {self.found}, allowed: {allowed}")

    def __reduce__(self) -> tuple[type, tuple[str, str, str]]:
        return type(self), (self.path, self.found, self.allowed)


def require_between(table: str, parameter: str, value: object, low: float, high: float, allowed: str) -> None:
    """Raise RomParameterError unless value is a number strictly between low and high (so never NaN or infinite)."""
    number = float(value) if isinstance(value, numbers.Real) and not isinstance(value, bool) else math.nan
    if not low < number < high:
        raise RomParameterError(table, parameter, value, allowed)
