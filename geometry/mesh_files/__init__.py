"""Mesh files of other programs: Abaqus, CalculiX, Nastran, Ansys, Gmsh, VTK, MED."""

from geometry.mesh_files.read import read_mesh
from geometry.mesh_files.write import write_mesh

__all__ = ["read_mesh", "write_mesh"]
