"""Writes a mesh for other programs, by the suffix of the file."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

from geometry.errors import MeshFileError
from geometry.imported_mesh import ImportedMesh
from geometry.mesh_files.write_abaqus import abaqus_lines
from geometry.mesh_files.write_ansys import ansys_lines
from geometry.mesh_files.write_gmsh import gmsh_lines
from geometry.mesh_files.write_nastran import nastran_lines
from geometry.mesh_files.write_vtu import write_vtu
from geometry.mesh_files.written_mesh import WrittenMesh, written_mesh
from geometry.sector import SectorMesh

LINES: dict[str, Callable[[WrittenMesh], Iterator[str]]] = {
    ".inp": abaqus_lines,
    ".bdf": nastran_lines,
    ".cdb": ansys_lines,
    ".msh": gmsh_lines,
}
GRID = ".vtu"


def write_mesh(
    path: str | Path,
    mesh: SectorMesh | ImportedMesh,
    materials: Mapping[str, Mapping[str, float]] | None = None,
) -> None:
    """Write a mesh with its node sets, surfaces and materials for another program; `read_mesh` reads it back.

    Nastran and Ansys have no surfaces: the nodes of each surface are written as a set. Points are exact in .msh,
    .vtu and .cdb. Relative errors: in .inp (20 characters) 1e-14; in .bdf (16 characters) 1e-12 from 0.01 to 1000 and
    1e-10 elsewhere.

    Parameters
    ----------
    path : str or path
        The file: .inp, .bdf, .cdb, .msh (version 2.2) or .vtu.
    mesh : SectorMesh or ImportedMesh
        The mesh; nodes and elements of a sector are numbered from 1.
    materials : mapping of str to mapping of str to float, optional
        Properties by the name of the material of a block, as in `ImportedMesh.materials`; by default those of the
        mesh, which a sector has not.

    Raises
    ------
    MeshFileError
        The suffix is none of these, or the file cannot be written.

    Examples
    --------
    >>> from geometry import BladeParameters, MeshParameters, ShroudParameters, build_sector, read_mesh, write_mesh
    >>> blade, shroud = BladeParameters(40, 0.3, 0.1, 0.02, 0.008), ShroudParameters(45.0, 0.01, 0.04, 0.01)
    >>> sector = build_sector(blade, shroud, MeshParameters(size=0.02))
    >>> write_mesh("sector.inp", sector)
    >>> mesh = read_mesh("sector.inp")
    >>> mesh.n_elements == sector.n_elements, len(mesh.surfaces["face_right"])
    (True, 16)
    """
    suffix = Path(path).suffix.lower()
    if suffix not in (*LINES, GRID):
        raise MeshFileError(path, f"the suffix must be one of {', '.join((*LINES, GRID))}")
    written = written_mesh(mesh, materials)
    try:
        if suffix == GRID:
            write_vtu(path, written)
            return
        with open(path, "w", encoding="ascii", errors="replace") as file:
            file.writelines(line + "\n" for line in LINES[suffix](written))
    except OSError as error:
        raise MeshFileError(path, f"cannot be written: {error.strerror}") from None
