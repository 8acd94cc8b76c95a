#!/usr/bin/env bash
# gmsh 4.15.2, MSH 4.1: with a physical group on the volume alone, the elements of the boundary surfaces are not saved, yet
# $Periodic still lists the periodic surfaces of the model with the tags of nodes on them. A reader that looks for the
# cut faces of a sector among surface elements finds none, although the file says node by node what is periodic.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install -q --disable-pip-version-check gmsh==4.15.2
"$folder/venv/bin/python" - "$folder/box.msh" <<'PY'
import sys

import gmsh

gmsh.initialize(interruptible=False)
gmsh.option.setNumber("General.Terminal", 0)
gmsh.model.occ.addBox(0.0, 0.0, 0.0, 1.0, 1.0, 1.0)
gmsh.model.occ.synchronize()
left, right = (gmsh.model.getEntitiesInBoundingBox(x - 0.01, -1, -1, x + 0.01, 2, 2, 2)[0][1] for x in (0.0, 1.0))
gmsh.model.mesh.setPeriodic(2, [right], [left], [1, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1])
gmsh.model.addPhysicalGroup(3, [1], name="body")
gmsh.option.setNumber("Mesh.MeshSizeMax", 0.5)
gmsh.model.mesh.generate(3)
gmsh.write(sys.argv[1])
gmsh.finalize()
text = open(sys.argv[1]).read()
elements = text.split("$Elements\n")[1].split("$EndElements")[0].splitlines()
dimensions, at = set(), 1
while at < len(elements):
    dimension, _, _, count = map(int, elements[at].split())
    dimensions.add(dimension)
    at += count + 1
periodic = text.split("$Periodic\n")[1].split("$EndPeriodic")[0].splitlines()
surfaces = [line for line in periodic if line.split() == ["2", str(right), str(left)]]
print("dimensions of the elements saved:", dimensions, "- periodic surfaces listed:", len(surfaces))
assert dimensions == {3}, "surface elements are saved now"
assert len(surfaces) == 1, "$Periodic no longer lists the surfaces"
PY
