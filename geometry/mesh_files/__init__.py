"""Mesh files of other programs: Abaqus, CalculiX, Nastran, Ansys, Gmsh, VTK, MED."""

from geometry.mesh_files.read import read_mesh

__all__ = ["read_mesh"]
