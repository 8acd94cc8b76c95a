#!/usr/bin/env bash
# meshio 5.3.5 and gmsh 4.15.2, Nastran .bdf: the third field of GRID, the coordinate system in which a node is given,
# is read over without a word. Bladed disks are often written in a cylindrical system (CORD2C): radius, angle in
# degrees and axial position are then taken as x, y and z, and a node at 10 mm and 90 degrees stands at y = 90.
# pyNastran 1.4.1 turns them.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install -q --disable-pip-version-check meshio==5.3.5 gmsh==4.15.2 pyNastran==1.4.1 "numpy<2"
cd "$folder"
"$folder/venv/bin/python" - <<'PY'
import gmsh
import meshio
from pyNastran.bdf.bdf import read_bdf

text = """CEND
BEGIN BULK
CORD2C,7,0,0.,0.,0.,0.,0.,1.
,1.,0.,0.
GRID,1,7,10.,0.,0.
GRID,2,7,10.,90.,0.
GRID,3,7,12.,0.,0.
GRID,4,7,10.,0.,5.
CTETRA,1,1,1,2,3,4
PSOLID,1,1
MAT1,1,2.1+11,,.3,7800.
ENDDATA
"""
open("sector.bdf", "w").write(text)
by_meshio = meshio.read("sector.bdf").points[1]
gmsh.initialize(interruptible=False)
gmsh.option.setNumber("General.Terminal", 0)
gmsh.open("sector.bdf")
by_gmsh = gmsh.model.mesh.getNode(2)[0]
gmsh.finalize()
by_pynastran = read_bdf("sector.bdf", debug=False).nodes[2].get_position()
for name, point in (("meshio", by_meshio), ("gmsh", by_gmsh), ("pyNastran", by_pynastran)):
    print(f"{name}: node 2 at", [round(float(x), 6) for x in point])
assert abs(by_meshio - [10.0, 90.0, 0.0]).max() < 1e-9, "meshio turns local systems now"
assert abs(by_gmsh - [10.0, 90.0, 0.0]).max() < 1e-9, "gmsh turns local systems now"
assert abs(by_pynastran - [0.0, 10.0, 0.0]).max() < 1e-9
PY
