"""Export and import of a sector as .msh (gmsh) or .vtu (ParaView), by meshio.

Both formats hold points, elements and fields, so everything else is stored as fields. On the points: ``set_NAME``
for a node set (0 outside the set, else 1 + place in it, which keeps the order of the contact nodes); ``right_t1``,
``right_t2``, ``right_n`` (3-vectors) and ``right_area`` for the faces, likewise ``left_...``, zero off the contact
nodes; and ``n_blades``. For a further pair ``NAME``, the K-th, ``pair_K_NAME_`` stands before these names, and
``main_NAME`` is 1 where the first pair is no shroud; ``kind_KIND``, likewise, is 1 where a pair is not one between
neighbours. On the elements of .vtu: ``material_NAME``, 1 where they have
the material; in .msh materials are physical groups. Surfaces are left out: those of the contact faces are the sides
between the nodes of their sets.
"""

from pathlib import Path
from typing import Any

import numpy as np

from geometry.elements import ELEMENT_KINDS, ElementBlock
from geometry.errors import SectorFileError
from geometry.sector import ContactFace, FacePair, IntArray, SectorMesh, check_sector

FORMATS = {".msh": "gmsh22", ".vtu": "vtu"}
AXES = ("t1", "t2", "n")
SET = "set_"
MATERIAL = "material_"
PAIR = "pair_"
MAIN = "main_"
KIND = "kind_"
FACE_SETS = ("contact_right", "contact_left", "face_right", "face_left")


def _format(path: str | Path) -> str:
    suffix = Path(path).suffix.lower()
    if suffix not in FORMATS:
        raise SectorFileError(f"{path}: the suffix must be one of {', '.join(FORMATS)}")
    return FORMATS[suffix]


def export_sector(path: str | Path, sector: SectorMesh) -> None:
    """Write a sector as .msh or .vtu; ``import_sector`` reads either back identically."""
    file_format = _format(path)
    count = len(sector.points)
    fields: dict[str, np.ndarray] = {}
    prefixes = ["", *(f"{PAIR}{k}_{name}_" for k, name in enumerate(sector.pairs))]
    for before, view in zip(prefixes, sector.views.values(), strict=True):
        for name, nodes in view.node_sets.items():
            if not before or name in FACE_SETS:
                fields[before + SET + name] = np.zeros(count)
                fields[before + SET + name][nodes] = 1 + np.arange(len(nodes))
        for side, face in (("right", view.right), ("left", view.left)):
            for k, axis in enumerate(AXES):
                fields[f"{before}{side}_{axis}"] = np.zeros((count, 3))
                fields[f"{before}{side}_{axis}"][face.nodes] = face.frame[:, k]
            fields[f"{before}{side}_area"] = np.zeros(count)
            fields[f"{before}{side}_area"][face.nodes] = face.area
        if view.kind != "neighbours":
            fields[before + KIND + view.kind] = np.ones(count)
    if sector.main != "shroud":
        fields[MAIN + sector.main] = np.ones(count)
    fields["n_blades"] = np.full(count, float(sector.n_blades))
    names = ["", *sorted({block.material for block in sector.blocks} - {""})]
    cell_fields: dict[str, Any] = {}
    groups: dict[str, Any] = {}
    if file_format == "gmsh22":
        tags = [np.full(len(block), 1 + names.index(block.material), dtype=np.int32) for block in sector.blocks]
        cell_fields = {"gmsh:physical": tags, "gmsh:geometrical": tags}
        groups = {name: np.array([1 + tag, 3]) for tag, name in enumerate(names) if name}
    else:
        for name in names[1:]:
            has = [np.full(len(block), float(block.material == name)) for block in sector.blocks]
            cell_fields[MATERIAL + name] = has
    elements = [(block.topology.meshio_name, block.nodes) for block in sector.blocks]
    library = cell_library(sector)
    mesh = library.Mesh(sector.points, elements, fields, cell_fields, groups)
    library.write(path, mesh, file_format=file_format)


def cell_library(sector: SectorMesh) -> Any:
    """The library that writes the elements of a sector: meshio, or for 15-node wedges, which it lacks, meshlane."""
    if any(block.kind == "wedge15" for block in sector.blocks):
        import meshlane

        return meshlane
    import meshio

    return meshio


def import_sector(path: str | Path) -> SectorMesh:
    """Read a sector written by ``export_sector``."""
    file_format = _format(path)
    try:
        mesh = _read(str(path), file_format)
    except Exception as error:  # meshio raises whatever its parsers stumble over
        raise SectorFileError(
            f"{path}: cannot be read: {' '.join(str(error).split()) or type(error).__name__}"
        ) from error
    try:
        fields = mesh.point_data
        sets = {name.removeprefix(SET): _members(field) for name, field in fields.items() if name.startswith(SET)}
        right, left = (_face(fields, mesh.points, side, sets[f"contact_{side}"]) for side in ("right", "left"))
        pairs = _pairs(fields, mesh.points)
        main, kind = _marked(fields, MAIN, "shroud"), _marked(fields, KIND, "neighbours")
        blocks = _blocks(mesh)
        of_cells = mesh.cell_data["n_blades"][0] if "n_blades" in mesh.cell_data else fields["n_blades"]  # until 0.2
        n_blades = round(float(np.ravel(of_cells)[0]))
    except KeyError as error:
        raise SectorFileError(f"{path}: not a sector: {error} is missing") from error
    points = np.ascontiguousarray(mesh.points, dtype=np.float64)
    sector = SectorMesh(points, blocks, sets, right, left, n_blades, pairs=pairs, main=main, kind=kind)
    check_sector(path, sector)
    return sector


def _read(path: str, file_format: str) -> Any:
    """The mesh in a file; not by meshio.read, which ends the program on a bad file."""
    import meshio

    try:
        return (meshio.gmsh if file_format == "gmsh22" else meshio.vtu).read(path)
    except KeyError as error:
        if error.args != ("wedge15",):
            raise
        import meshlane  # meshio has no 15-node wedges

        return (meshlane.gmsh if file_format == "gmsh22" else meshlane.vtu).read(path)


def _blocks(mesh: Any) -> tuple[ElementBlock, ...]:
    """The elements by kind and material, in their order."""
    kinds = {kind.meshio_name: name for name, kind in ELEMENT_KINDS.items()}
    named = {name.removeprefix(MATERIAL): data for name, data in mesh.cell_data.items() if name.startswith(MATERIAL)}
    if tags := mesh.cell_data.get("gmsh:physical"):
        named = {name: [tag == group[0] for tag in tags] for name, group in mesh.field_data.items()}
    blocks = []
    for index, cells in enumerate(mesh.cells):
        if cells.type not in kinds:
            continue
        names = np.full(len(cells.data), "", dtype=object)
        for name, data in named.items():
            names[np.asarray(data[index]).ravel() > 0.0] = name
        ends = np.flatnonzero(names[1:] != names[:-1]) + 1
        for rows in np.split(np.arange(len(names)), ends):  # .vtu joins blocks of one kind that follow each other
            blocks.append(ElementBlock(kinds[cells.type], cells.data[rows].astype(np.int64), str(names[rows[0]])))
    if not blocks:
        raise KeyError("elements")
    return tuple(blocks)


def _pairs(fields: dict[str, np.ndarray], points: np.ndarray) -> dict[str, FacePair]:
    """Further pairs of faces by name, in their order."""
    end = "_right_area"
    marks = [name.removesuffix(end) for name in fields if name.startswith(PAIR) and name.endswith(end)]
    found = {}
    for mark in sorted(marks, key=lambda mark: int(mark.split("_")[1])):
        own = {name.removeprefix(f"{mark}_"): field for name, field in fields.items() if name.startswith(f"{mark}_")}
        sets = {name: _members(own[SET + name]) for name in FACE_SETS}
        right, left = (_face(own, points, side, sets[f"contact_{side}"]) for side in ("right", "left"))
        found[mark.split("_", 2)[2]] = FacePair(
            right, left, sets["face_right"], sets["face_left"], _marked(own, KIND, "neighbours")
        )
    return found


def _marked(fields: dict[str, np.ndarray], mark: str, otherwise: str) -> str:
    """What stands behind a mark in the name of a field."""
    return next((name.removeprefix(mark) for name in fields if name.startswith(mark)), otherwise)


def _members(field: np.ndarray) -> IntArray:
    place = np.asarray(field).ravel()
    nodes = np.flatnonzero(place)
    return nodes[np.argsort(place[nodes], kind="stable")].astype(np.int64)


def _face(fields: dict[str, np.ndarray], points: np.ndarray, side: str, nodes: IntArray) -> ContactFace:
    frame = np.stack([fields[f"{side}_{axis}"][nodes] for axis in AXES], axis=1)
    area = fields[f"{side}_area"].ravel()[nodes]
    return ContactFace(nodes, np.ascontiguousarray(points[nodes]), frame, area)
