#!/usr/bin/env bash
# meshio 5.3.5 and medcoupling 9.15.0, MED files (Code_Aster, Salome): MED counts the corners of solids the other way
# round than VTK and meshio, and meshio does not reorder them. Whatever one of the two writes has negative volumes in
# the other, so that a Jacobian checked for its sign refuses a sound mesh, and unchecked assembly gives negative
# masses.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install -q --disable-pip-version-check meshio==5.3.5 h5py==3.14.0 medcoupling==9.15.0
cd "$folder"
"$folder/venv/bin/python" - <<'PY'
import medcoupling
import meshio
import numpy as np

corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
meshio.write("tetra.med", meshio.Mesh(corners, [("tetra", np.array([[0, 1, 2, 3]]))]))
volume = medcoupling.MEDFileUMesh("tetra.med")[0].getMeasureField(False).getArray().getValues()[0]

grid, axis = medcoupling.MEDCouplingCMesh(), medcoupling.DataArrayDouble([0.0, 1.0])
grid.setCoords(axis, axis, axis)
cube = grid.buildUnstructured()
cube.setName("cube")
cube.write("cube.med")
mesh = meshio.read("cube.med")
place = mesh.points[mesh.cells[0].data[0]]
determinant = np.linalg.det(place[[1, 3, 4]] - place[0])
own = cube.getMeasureField(False).getArray().getValues()[0]
print(f"tetrahedron of meshio in medcoupling: volume {volume:.4f}")
print(f"cube of medcoupling: volume {own:.1f}, Jacobian in the order of VTK {determinant:.1f}")
assert volume < 0.0, "the corners are reordered now"
assert own > 0.0
assert determinant < 0.0, "the corners are reordered now"
PY
