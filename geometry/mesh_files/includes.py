"""Files that a mesh file includes."""

from __future__ import annotations

from pathlib import Path

from geometry.mesh_files.abaqus_keywords import abaqus_includes
from geometry.mesh_files.nastran_cards import nastran_includes
from geometry.mesh_files.text_files import plain_name, text_lines

_RULES = {
    ".inp": abaqus_includes,
    ".bdf": nastran_includes,
    ".nas": nastran_includes,
    ".dat": nastran_includes,
}


def included_names(path: str | Path, suffix: str) -> tuple[str, ...]:
    """Names of the files that a mesh file includes directly, with slashes, by the rule of its reader.

    Parameters
    ----------
    path : str or path
        The mesh file, or a file that it includes.
    suffix : str
        Suffix of the mesh file, which tells the format: ".inp", ".bdf", ...

    Returns
    -------
    tuple of str
        The names; those of another folder and of files that are not there too.

    Raises
    ------
    MeshFileError
        The file cannot be read, or is no text.

    Examples
    --------
    >>> from geometry import included_names
    >>> _ = open("main.inp", "w").write("*Include, Input = nodes.inc\\n*NODE\\n1, 0., 0., 0.\\n")
    >>> included_names("main.inp", ".inp")
    ('nodes.inc',)
    """
    rule = _RULES.get(suffix.lower())
    return () if rule is None else tuple(map(plain_name, rule(text_lines(path))))
