#!/usr/bin/env bash
# pyNastran 1.4.1: volume, mass and mass properties of CHEXA with 20 nodes are those of its eight corners. A quarter
# of a ring in one such element weighs 1.5 in place of 2.356. Of a disk or a cambered blade meshed with few curved
# elements the mass that is checked against the solver is off by the curvature, with no remark.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install -q --disable-pip-version-check pyNastran==1.4.1 "numpy<2"
cd "$folder"
"$folder/venv/bin/python" - <<'PY'
import numpy as np
from pyNastran.bdf.bdf import BDF
from pyNastran.bdf.mesh_utils.mass_properties import mass_properties

corners = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)], float)
# in the order of Nastran: bottom, upright, top
edges = [(0, 1), (1, 2), (2, 3), (3, 0), (0, 4), (1, 5), (2, 6), (3, 7), (4, 5), (5, 6), (6, 7), (7, 4)]
nodes = np.vstack([corners, [(corners[a] + corners[b]) / 2 for a, b in edges]])
radius, angle = 1.0 + nodes[:, 0], 0.5 * np.pi * nodes[:, 1]
model = BDF(debug=False)
for number, (r, a, z) in enumerate(zip(radius, angle, nodes[:, 2]), 1):
    model.add_grid(number, [r * np.cos(a), r * np.sin(a), z])
model.add_chexa(1, 1, list(range(1, 21)))
model.add_psolid(1, 1)
model.add_mat1(1, 2.1e11, None, 0.3, rho=1.0)
model.cross_reference()
mass = mass_properties(model)[0]
print(f"mass {mass:.4f}, of the ring {0.75 * np.pi:.4f}, of the hexahedron of the corners 1.5")
assert abs(mass - 1.5) < 1e-9, "mid nodes count now"
PY
