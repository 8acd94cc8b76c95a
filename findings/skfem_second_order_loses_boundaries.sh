#!/usr/bin/env bash
# scikit-fem 12.0.2 with meshio 5.3.5: of a mesh with named faces the boundaries are read as long as its elements are
# linear. With quadratic ones (setOrder(2) in gmsh) `mesh.boundaries` is None, with a remark in the log only; the
# named bodies are still there. Loads and supports by name are then applied to nothing, or fail far from the cause.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install -q --disable-pip-version-check scikit-fem==12.0.2 meshio==5.3.5 gmsh==4.15.2
cd "$folder"
"$folder/venv/bin/python" - <<'PY'
import gmsh
import skfem

gmsh.initialize(interruptible=False)
gmsh.option.setNumber("General.Terminal", 0)
gmsh.model.occ.addBox(0, 0, 0, 1, 1, 1)
gmsh.model.occ.synchronize()
gmsh.model.addPhysicalGroup(2, [1], name="root")
gmsh.model.addPhysicalGroup(3, [1], name="body")
gmsh.model.mesh.generate(3)
gmsh.write("linear.msh")
gmsh.model.mesh.setOrder(2)
gmsh.write("quadratic.msh")
gmsh.finalize()
linear, quadratic = skfem.MeshTet.load("linear.msh"), skfem.MeshTet.load("quadratic.msh")
for name, mesh in (("linear", linear), ("quadratic", quadratic)):
    print(name, type(mesh).__name__, "boundaries:", sorted(mesh.boundaries or ()), "bodies:", sorted(mesh.subdomains or ()))
assert "root" in linear.boundaries
assert quadratic.boundaries is None, "boundaries of quadratic meshes are read now"
assert "body" in quadratic.subdomains
PY
