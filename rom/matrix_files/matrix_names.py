"""Which of several matrices of a file is meant."""

from __future__ import annotations

import os

from rom.errors import MatrixFileError

# of Nastran: a-set, external superelements (EXTSEOUT writes KAAX, MAAX), direct input, g-set, and its other sets
_OF_NASTRAN = ("{}AA", "{}AAX", "{}2GG", "{}GG", "{}LL", "{}XX", "{}TT", "{}NN", "{}JJ")
STIFFNESS = ("K", "stiffness", *(name.format("K") for name in _OF_NASTRAN), "Kred", "K_red", "Kr", "STIFF")
MASS = ("M", "mass", *(name.format("M") for name in _OF_NASTRAN), "Mred", "M_red", "Mr", "MASS")
TRANSFORMATION = ("T", "transformation", "basis", "Phi", "Psi", "GOA")
FORCE = ("f", "force", "centrifugal", "force_centrifugal", "PG", "PAX")
_LISTED = 8


def chosen_name(
    path: str | os.PathLike[str], wanted: str | None, held: tuple[str, ...], usual: tuple[str, ...]
) -> str:
    """The name of a matrix in a file: the wanted one, the only one, or the first usual one; letter case is free.

    Raises MatrixFileError where there is none, or it is not clear which; the message lists the names of the file.
    """
    listed = ", ".join(held[:_LISTED]) + (", ..." if len(held) > _LISTED else "") if held else "no matrix"
    folded = {name.casefold(): name for name in reversed(held)} | {name: name for name in held}
    for name in usual if wanted is None else (wanted,):
        found = folded.get(name) or folded.get(name.casefold())
        if found is not None:
            return found
    if wanted is not None:
        raise MatrixFileError(path, f"has no matrix {wanted!r}", listed)
    if len(held) == 1:
        return held[0]
    raise MatrixFileError(path, f"holds {listed}: which one is meant is not clear", f"a name, such as {usual[0]}")
