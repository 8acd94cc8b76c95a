#!/usr/bin/env bash
# gmsh 4.15.2, Nastran .bdf: named physical surfaces come out as CTRIA3 shells whose property number is that of the
# geometric surface, not of the physical group, and no name is written anywhere. Faces that a user named in gmsh cannot be
# told apart by name, and solids with such shells on them look like a model with plates.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install -q --disable-pip-version-check gmsh==4.15.2
"$folder/venv/bin/python" - "$folder/box.bdf" <<'PY'
import sys

import gmsh

gmsh.initialize(interruptible=False)
gmsh.option.setNumber("General.Terminal", 0)
gmsh.model.occ.addBox(0.0, 0.0, 0.0, 1.0, 1.0, 1.0)
gmsh.model.occ.synchronize()
gmsh.model.addPhysicalGroup(2, [3, 5], tag=77, name="root")
gmsh.model.addPhysicalGroup(3, [1], tag=88, name="body")
gmsh.option.setNumber("Mesh.MeshSizeMax", 0.7)
gmsh.model.mesh.generate(3)
gmsh.write(sys.argv[1])
gmsh.finalize()
text = open(sys.argv[1]).read()
cards = [line.replace(",", " ").split() for line in text.splitlines()]
shells = {card[2] for card in cards if card and card[0].startswith("CTRIA")}
print("property numbers of the triangles:", sorted(shells), "- name in the file:", "root" in text)
assert shells == {"3", "5"}, "the property numbers are no longer those of the geometric surfaces"
assert "root" not in text, "names of physical groups are written now"
PY
