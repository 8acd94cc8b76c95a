#!/usr/bin/env bash
# gmsh 4.15.2 and meshio 5.3.5, Nastran .bdf: the file that gmsh writes has no BEGIN BULK, without which meshio
# refuses to read it; and its fields have eight columns unless Mesh.BdfFieldFormat is 2, so that coordinates keep
# seven digits at most (a sign and an exponent leave fewer), which two cut faces of a sector matched to 1e-8 do not
# survive.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install -q --disable-pip-version-check gmsh==4.15.2 meshio==5.3.5
cd "$folder"
"$folder/venv/bin/python" - <<'PY'
import gmsh
import meshio

gmsh.initialize(interruptible=False)
gmsh.option.setNumber("General.Terminal", 0)
gmsh.model.occ.addBox(0.123456789012, -0.123456789012, 0.0, 1.0, 1.0, 1.0)
gmsh.model.occ.synchronize()
gmsh.model.addPhysicalGroup(3, [1], name="body")
gmsh.option.setNumber("Mesh.MeshSizeMax", 2.0)
gmsh.model.mesh.generate(3)
gmsh.write("box.bdf")
_, coordinates, _ = gmsh.model.mesh.getNodes()
gmsh.finalize()
text = open("box.bdf").read()
grids = [line for line in text.splitlines() if line.startswith("GRID")]
written = sorted({line[24:32] for line in grids})
print("least x of the nodes:", written[0], "- BEGIN BULK:", "BEGIN BULK" in text)
assert "BEGIN BULK" not in text, "BEGIN BULK is written now"
assert all(abs(float(x) - 0.123456789012) > 1e-9 for x in written if "E" not in x.strip()[1:]), "more digits are written"
try:
    meshio.read("box.bdf")
except RuntimeError as error:
    print("meshio:", error)
else:
    raise AssertionError("meshio reads it now")
PY
