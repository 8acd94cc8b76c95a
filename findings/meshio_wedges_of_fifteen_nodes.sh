#!/usr/bin/env bash
# meshio 5.3.5: the quadratic wedge is in its tables of names ("wedge15", C3D15, PENTA15) but not in that of
# dimensions, so that no file with one can be read, and no mesh with one be made: KeyError. Layers of wedges around
# fillets and in extruded aerofoils are common in blades, and one of them stops the whole file, whatever its format.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install -q --disable-pip-version-check meshio==5.3.5 gmsh==4.15.2
cd "$folder"
"$folder/venv/bin/python" - <<'PY'
import gmsh
import meshio
from meshio._common import num_nodes_per_cell

gmsh.initialize(interruptible=False)
gmsh.option.setNumber("General.Terminal", 0)
geo = gmsh.model.geo
points = [geo.addPoint(x, y, 0) for x, y in ((0, 0), (1, 0), (0, 1))]
lines = [geo.addLine(points[k], points[(k + 1) % 3]) for k in range(3)]
face = geo.addPlaneSurface([geo.addCurveLoop(lines)])
for line in lines:
    geo.mesh.setTransfiniteCurve(line, 2)
body = geo.extrude([(2, face)], 0, 0, 1, numElements=[1], recombine=True)
geo.synchronize()
gmsh.model.addPhysicalGroup(3, [tag for dim, tag in body if dim == 3], name="body")
gmsh.option.setNumber("Mesh.SecondOrderIncomplete", 1)
gmsh.model.mesh.generate(3)
gmsh.model.mesh.setOrder(2)
names = ["wedge.msh", "wedge.vtk", "wedge.inp"]
for name in names:
    gmsh.write(name)
gmsh.finalize()
print("nodes of a wedge15 in the tables:", num_nodes_per_cell["wedge15"])
for name in names:
    try:
        meshio.read(name)
    except KeyError as error:
        print(name, "KeyError", error)
    else:
        raise AssertionError(f"{name} is read now")
PY
