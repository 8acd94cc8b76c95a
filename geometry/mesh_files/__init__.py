"""Mesh files of other programs: Abaqus, CalculiX, Nastran, Ansys, Gmsh, VTK, MED."""
