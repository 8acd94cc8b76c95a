#!/usr/bin/env bash
# meshio 5.3.5, Abaqus/CalculiX .inp: a set that is written in several *NSET blocks keeps only the last of them
# (Abaqus and CalculiX add them up), and *NODE, SYSTEM=C, nodes in cylindrical coordinates, is taken for x, y, z. Both
# without a word: a contact face loses most of its nodes, a blade stands elsewhere.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install -q --disable-pip-version-check meshio==5.3.5
cd "$folder"
"$folder/venv/bin/python" - <<'PY'
import meshio

text = """*NODE, SYSTEM=C
1, 10., 0., 0.
2, 10., 90., 0.
3, 12., 0., 0.
4, 10., 0., 5.
*ELEMENT, TYPE=C3D4, ELSET=BLADE
1, 1, 2, 3, 4
*NSET, NSET=FACE
1, 3
*NSET, NSET=FACE
4
"""
open("blade.inp", "w").write(text)
mesh = meshio.read("blade.inp")
face = sorted(int(row) + 1 for row in mesh.point_sets["FACE"])
print("nodes of FACE:", face, "- node 2 at", mesh.points[1].tolist())
assert face == [4], "blocks of one set are added up now"
assert mesh.points[1].tolist() == [10.0, 90.0, 0.0], "SYSTEM=C is turned now"
PY
