"""Reads mesh files of other programs, by their suffix, and names the files that they include."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

from geometry.errors import MeshFileError
from geometry.imported_mesh import ImportedMesh
from geometry.mesh_files.abaqus import read_abaqus
from geometry.mesh_files.abaqus_blocks import abaqus_includes
from geometry.mesh_files.ansys import read_ansys
from geometry.mesh_files.file_mesh import FileMesh
from geometry.mesh_files.gmsh import read_gmsh
from geometry.mesh_files.med import read_med
from geometry.mesh_files.nastran import read_nastran
from geometry.mesh_files.nastran_cards import nastran_includes
from geometry.mesh_files.resolve import imported_mesh
from geometry.mesh_files.text_files import check_file, plain_name, text_lines
from geometry.mesh_files.vtu import read_vtu

_RULES = {
    ".inp": abaqus_includes,
    ".bdf": nastran_includes,
    ".nas": nastran_includes,
    ".dat": nastran_includes,
}
_APDL = re.compile(
    rb"^\s*(/(PREP7|COM|BATCH|CLEAR|TITLE|NOPR|UNITS|WB)\b|(NBLOCK|ET),)", re.IGNORECASE | re.MULTILINE
)
READERS: dict[str, Callable[[str | Path], FileMesh]] = {
    ".inp": read_abaqus,
    ".bdf": read_nastran,
    ".nas": read_nastran,
    ".dat": read_nastran,
    ".cdb": read_ansys,
    ".msh": read_gmsh,
    ".vtu": read_vtu,
    ".med": read_med,
}


def included_names(path: str | Path, suffix: str) -> tuple[str, ...]:
    """Names of the files that a mesh file includes directly, with slashes, by the rule of its reader.

    Names of another folder and of files that are not there count too.
    """
    rule = _RULES.get(suffix.lower())
    return () if rule is None else tuple(map(plain_name, rule(text_lines(path))))


def read_mesh(path: str | Path) -> ImportedMesh:
    """Read the solid elements of a mesh file of another program, with sets, surfaces and materials.

    Collapsed hexahedra become the wedges or tetrahedra that they are. Nodes and elements keep their labels; nodes of
    no solid element are left out. The units and axes are those of the file.

    Parameters
    ----------
    path : str or path
        The file: .inp (Abaqus, CalculiX), .bdf, .nas or .dat (Nastran), .cdb (Ansys), .msh (Gmsh), .vtu or .med.

    Returns
    -------
    ImportedMesh
        The mesh.

    Raises
    ------
    MeshFileError
        The file is none of these, or cannot be used: nodes missing, defined twice or not finite, pyramids, mid-side
        nodes missing, elements inside out.

    Examples
    --------
    >>> from geometry import read_mesh
    >>> deck = '''*NODE
    ... 1, 0., 0., 0.
    ... 2, 1., 0., 0.
    ... 3, 0., 1., 0.
    ... 4, 0., 0., 1.
    ... *ELEMENT, TYPE=C3D4, ELSET=blade
    ... 1, 1, 2, 3, 4
    ... *NSET, NSET=root
    ... 1, 2, 3
    ... '''
    >>> _ = open("blade.inp", "w").write(deck)
    >>> mesh = read_mesh("blade.inp")
    >>> mesh.blocks[0].kind, mesh.node_sets["root"].tolist()
    ('tet4', [0, 1, 2])
    """
    suffix = Path(path).suffix.lower()
    if suffix not in READERS:
        raise MeshFileError(path, f"the suffix must be one of {', '.join(READERS)}")
    check_file(path)
    reader = READERS[suffix]
    if suffix in (".inp", ".dat") and _is_apdl(path):  # Ansys calls its decks so too
        reader = read_ansys
    try:
        return imported_mesh(reader(path))
    except MemoryError:
        raise MeshFileError(path, "is too large for the memory of this process") from None


def _is_apdl(path: str | Path) -> bool:
    """Whether a text starts with commands of Ansys."""
    try:
        with open(path, "rb") as file:
            return _APDL.search(file.read(100_000)) is not None
    except OSError:
        return False
