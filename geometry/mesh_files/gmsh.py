"""Gmsh files (.msh), versions 2.2 to 4.1, read by gmsh itself: physical groups become sets and surfaces.

gmsh runs a file that does not start exactly as a mesh as a script, which can call programs, and so a file of options
of the same name beside it. So a copy in a folder of its own is read, whose first bytes have been checked.
"""

from __future__ import annotations

import os
import re
import shutil
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from geometry.elements import ELEMENT_KINDS
from geometry.errors import MeshFileError
from geometry.gmsh_start import start_gmsh
from geometry.mesh_files.file_mesh import FileElements, FileMesh
from geometry.sector import IntArray

HEAD = b"$MeshFormat"  # the first line
KINDS = {4: "tet4", 5: "hex8", 6: "wedge6", 11: "tet10", 12: "hex20", 13: "wedge15", 17: "hex20", 18: "wedge15"}
EXTRA_NODES = {12: "hex27", 13: "wedge18"}  # nodes in faces and inside are left out
PYRAMIDS = (7, 14, 19)
FACE_CORNERS = {2: 3, 9: 3, 3: 4, 10: 4, 16: 4}
# the two corners of each mid-side node, in the order of gmsh
EDGES = {
    "tet10": ((0, 1), (1, 2), (2, 0), (3, 0), (3, 2), (3, 1)),
    "wedge15": ((0, 1), (0, 2), (0, 3), (1, 2), (1, 4), (2, 5), (3, 4), (3, 5), (4, 5)),
    "hex20": (
        *((0, 1), (0, 3), (0, 4), (1, 2), (1, 5), (2, 3)),
        *((2, 6), (3, 7), (4, 5), (4, 7), (5, 6), (6, 7)),
    ),
}
SHAPES = ("Triangles", "Quadrangles", "Tetrahedra", "Hexahedra", "Prisms", "Pyramids")
_TURN = 1e-6  # twice the sine of an angle
_CONTACT = re.compile(r"contact|shroud|snubber", re.IGNORECASE)  # faces made periodic to have one mesh
DIMENSIONS = ("point", "curve", "surface", "volume")


def read_gmsh(path: str | Path) -> FileMesh:
    """Nodes, elements and physical groups of a file of gmsh."""
    import gmsh

    running = bool(gmsh.isInitialized())
    if not running:
        start_gmsh(gmsh)
    before = gmsh.model.getCurrent() if running else ""
    try:
        with tempfile.TemporaryDirectory() as folder:
            copy = os.path.join(folder, "mesh.msh")
            shutil.copyfile(path, copy)
            _check_head(path, copy)
            gmsh.option.setNumber("General.Terminal", 0)
            gmsh.model.add("mesh file")
            gmsh.merge(copy)
        return _from_model(path, gmsh)
    except MeshFileError:
        raise
    except Exception as error:  # what gmsh says of a bad file
        raise MeshFileError(path, f"cannot be read: {str(error) or type(error).__name__}") from None
    finally:
        if running:
            gmsh.model.remove()
            gmsh.model.setCurrent(before)
        else:
            gmsh.finalize()


def _check_head(path: str | Path, copy: str) -> None:
    """Refuse what gmsh would not take for a mesh: also a blank before the first word makes a script of a file."""
    with open(copy, "rb") as file:
        head = file.readline(200).rstrip()
    if head != HEAD:
        raise MeshFileError(path, "does not start with $MeshFormat: a mesh of gmsh, version 2.2 to 4.1, is needed")


def columns_from_gmsh(kind: str) -> list[int]:
    """Place in an element of gmsh of each node of an element here."""
    element = ELEMENT_KINDS[kind]
    columns = list(range(element.corners))
    if element.quadratic:
        places = {frozenset(edge): element.corners + k for k, edge in enumerate(EDGES[kind])}
        columns += [places[frozenset(edge)] for edge in element.edges]
    return columns


def _from_model(path: str | Path, gmsh: Any) -> FileMesh:
    mesh = FileMesh(str(path))
    labels, positions, _ = gmsh.model.mesh.getNodes()
    mesh.node_labels = labels.astype(np.int64)
    mesh.points = positions.reshape(-1, 3)
    # not getElementsByType, which writes beyond its arrays where an entity has elements of several types
    for _, entity in gmsh.model.getEntities(3):
        for code, elements, nodes in zip(*gmsh.model.mesh.getElements(3, entity), strict=True):
            _add_elements(mesh, gmsh, int(code), elements.astype(np.int64), nodes.astype(np.int64))
    given = sum(len(labels) for d, e in gmsh.model.getEntities() if d > 1 for labels in _labels(gmsh, d, e))
    if given != sum(
        int(gmsh.option.getNumber(f"Mesh.Nb{shape}")) for shape in SHAPES
    ):  # of a shape it gives one order
        raise mesh.refuse("has linear and quadratic elements in one entity: give each order an entity of its own")
    mesh.elements = [_listed_once(elements) for elements in mesh.elements]
    for dimension, tag in gmsh.model.getPhysicalGroups():
        name = gmsh.model.getPhysicalName(dimension, tag) or f"{DIMENSIONS[dimension]}_{tag}"
        _add_group(mesh, gmsh, name, dimension, tag)
    _add_periodic(mesh, gmsh)
    return mesh


def _add_periodic(mesh: FileMesh, gmsh: Any) -> None:
    """Surfaces of $Periodic that a rotation turns into each other as cut faces; those named as contacts are none."""
    roles = ("cyclic_right", "cyclic_left")
    if {name.lower() for name in (*mesh.faces, *mesh.node_sets)} & set(roles):
        return
    first: Any = None
    for _, tag in gmsh.model.getEntities(2):
        master, nodes, others, affine = gmsh.model.mesh.getPeriodicNodes(2, tag)
        turn = np.reshape(affine, (-1, 4))[:3, :3] if len(affine) == 16 else np.eye(3)
        axis = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
        groups = [gmsh.model.getPhysicalName(2, g) for e in (tag, master) for g in _groups(gmsh, e)]
        if master == tag or np.linalg.norm(axis) < _TURN or any(_CONTACT.search(name) for name in groups):
            continue
        first = axis if first is None else first
        for role, found in zip(roles if axis @ first > 0.0 else roles[::-1], (nodes, others), strict=True):
            mesh.node_sets[role] = np.union1d(mesh.node_sets.get(role, []), found).astype(np.int64)
    if first is not None:
        mesh.notes.append("$Periodic: surfaces that a rotation turns into each other are the cut faces of a disk")


def _groups(gmsh: Any, entity: int) -> list[int]:
    found: list[int] = gmsh.model.getPhysicalGroupsForEntity(2, entity).tolist()
    return found


def _labels(gmsh: Any, dimension: int, entity: int) -> list[IntArray]:
    found: list[IntArray] = gmsh.model.mesh.getElements(dimension, entity)[1]
    return found


def _add_elements(mesh: FileMesh, gmsh: Any, code: int, elements: IntArray, nodes: IntArray) -> None:
    if code in PYRAMIDS:
        raise mesh.refuse(f"element {elements[0]} is a pyramid: only tetrahedra, wedges and hexahedra are read")
    if code not in KINDS:
        name, _, order = gmsh.model.mesh.getElementProperties(code)[:3]
        raise mesh.refuse(f"element {elements[0]} is a {name} of order {order}: must be of order 1 or 2")
    if code in EXTRA_NODES:
        mesh.notes.append(f"elements {EXTRA_NODES[code]} are taken as {KINDS[code]} without their inner nodes")
    table = nodes.reshape(len(elements), -1)[:, columns_from_gmsh(KINDS[code])]
    mesh.elements.append(FileElements(KINDS[code], elements, table))


def _listed_once(elements: FileElements) -> FileElements:
    """Without repetitions: version 2.2 lists an element again for each further group that it is in."""
    _, first = np.unique(elements.nodes, axis=0, return_index=True)
    first.sort()
    return FileElements(elements.kind, elements.labels[first], elements.nodes[first])


def _add_group(mesh: FileMesh, gmsh: Any, name: str, dimension: int, tag: int) -> None:
    entities = gmsh.model.getEntitiesForPhysicalGroup(dimension, tag)
    found = [gmsh.model.mesh.getElements(dimension, entity) for entity in entities]
    if dimension == 3:
        labels = [array.astype(np.int64) for _, arrays, _ in found for array in arrays]
        mesh.element_sets[name] = np.concatenate([np.empty(0, dtype=np.int64), *labels])
        return
    faces: list[IntArray] = []
    nodes: list[IntArray] = []
    for codes, labels, connected in found:
        for code, own, flat in zip(codes, labels, connected, strict=True):
            table = flat.reshape(len(own), -1).astype(np.int64)
            nodes.append(table.ravel())
            if code in FACE_CORNERS:
                faces.append(table[:, : FACE_CORNERS[code]])
    everything = np.concatenate([mesh.node_sets.get(name, np.empty(0, dtype=np.int64)), *nodes])
    mesh.node_sets[name] = everything[np.sort(np.unique(everything, return_index=True)[1])]
    if faces:
        mesh.faces[name] = faces
