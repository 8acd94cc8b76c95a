"""Export and import of a sector as .msh (gmsh) or .vtu (ParaView), by meshio.

Both formats hold points, hexahedra and fields, so everything else is stored as fields. On the points: ``set_NAME``
for a node set (0 outside the set, else 1 + place in it, which keeps the order of the contact nodes); ``right_t1``,
``right_t2``, ``right_n`` (3-vectors) and ``right_area`` for the faces, likewise ``left_...``, zero off the contact
nodes. On the hexahedra: ``n_blades``.
"""

from pathlib import Path
from typing import Any

import numpy as np

from geometry.elements import ElementBlock
from geometry.errors import SectorFileError
from geometry.sector import ContactFace, IntArray, SectorMesh
from geometry.sector_check import check_sector

FORMATS = {".msh": "gmsh22", ".vtu": "vtu"}
AXES = ("t1", "t2", "n")
SET = "set_"


def _format(path: str | Path) -> str:
    suffix = Path(path).suffix.lower()
    if suffix not in FORMATS:
        raise SectorFileError(f"{path}: the suffix must be one of {', '.join(FORMATS)}")
    return FORMATS[suffix]


def export_sector(path: str | Path, sector: SectorMesh) -> None:
    """Write a sector as .msh or .vtu; ``import_sector`` reads either back identically.

    Parameters
    ----------
    path : str or path
        The file; its suffix chooses the format.
    sector : SectorMesh
        The mesh.

    Raises
    ------
    SectorFileError
        The suffix is neither .msh nor .vtu.

    Examples
    --------
    >>> from geometry import BladeParameters, MeshParameters, ShroudParameters, build_sector, export_sector
    >>> blade, shroud = BladeParameters(40, 0.3, 0.1, 0.02, 0.008), ShroudParameters(45.0, 0.01, 0.04, 0.01)
    >>> sector = build_sector(blade, shroud, MeshParameters(size=0.02))
    >>> export_sector("sector.vtu", sector)
    >>> import meshio
    >>> len(meshio.read("sector.vtu").points) == len(sector.points)
    True
    """
    import meshio

    file_format = _format(path)
    count, cells = len(sector.points), len(sector.hexahedra)
    fields: dict[str, np.ndarray] = {}
    for name, nodes in sector.node_sets.items():
        fields[SET + name] = np.zeros(count)
        fields[SET + name][nodes] = 1 + np.arange(len(nodes))
    for side, face in (("right", sector.right), ("left", sector.left)):
        for k, axis in enumerate(AXES):
            fields[f"{side}_{axis}"] = np.zeros((count, 3))
            fields[f"{side}_{axis}"][face.nodes] = face.frame[:, k]
        fields[f"{side}_area"] = np.zeros(count)
        fields[f"{side}_area"][face.nodes] = face.area
    cell_fields: dict[str, Any] = {"n_blades": [np.full(cells, float(sector.n_blades))]}
    if file_format == "gmsh22":
        tags = np.ones(cells, dtype=np.int32)
        cell_fields |= {"gmsh:physical": [tags], "gmsh:geometrical": [tags]}
    mesh = meshio.Mesh(sector.points, [("hexahedron", sector.hexahedra)], fields, cell_fields)
    meshio.write(path, mesh, file_format=file_format)


def import_sector(path: str | Path) -> SectorMesh:
    """Read a sector written by ``export_sector``.

    Parameters
    ----------
    path : str or path
        The file, .msh or .vtu.

    Returns
    -------
    SectorMesh
        The mesh.

    Raises
    ------
    SectorFileError
        The file does not hold a sector.

    Examples
    --------
    >>> from geometry import BladeParameters, MeshParameters, ShroudParameters
    >>> from geometry import build_sector, export_sector, import_sector
    >>> blade, shroud = BladeParameters(40, 0.3, 0.1, 0.02, 0.008), ShroudParameters(45.0, 0.01, 0.04, 0.01)
    >>> sector = build_sector(blade, shroud, MeshParameters(size=0.02))
    >>> export_sector("sector.msh", sector)
    >>> bool(np.array_equal(import_sector("sector.msh").points, sector.points))
    True
    """
    import meshio

    # not meshio.read, which ends the program on a bad file
    read = meshio.gmsh.read if _format(path) == "gmsh22" else meshio.vtu.read
    try:
        mesh = read(str(path))
    except Exception as error:  # meshio raises whatever its parsers stumble over
        raise SectorFileError(
            f"{path}: cannot be read: {' '.join(str(error).split()) or type(error).__name__}"
        ) from error
    try:
        fields = mesh.point_data
        sets = {name.removeprefix(SET): _members(field) for name, field in fields.items() if name.startswith(SET)}
        right, left = (_face(fields, mesh.points, side, sets[f"contact_{side}"]) for side in ("right", "left"))
        blocks = (ElementBlock("hex8", mesh.cells_dict["hexahedron"].astype(np.int64)),)
        n_blades = round(float(mesh.cell_data_dict["n_blades"]["hexahedron"][0]))
    except KeyError as error:
        raise SectorFileError(f"{path}: not a sector: {error} is missing") from error
    sector = SectorMesh(np.ascontiguousarray(mesh.points, dtype=np.float64), blocks, sets, right, left, n_blades)
    check_sector(path, sector)
    return sector


def _members(field: np.ndarray) -> IntArray:
    place = np.asarray(field).ravel()
    nodes = np.flatnonzero(place)
    return nodes[np.argsort(place[nodes], kind="stable")].astype(np.int64)


def _face(fields: dict[str, np.ndarray], points: np.ndarray, side: str, nodes: IntArray) -> ContactFace:
    frame = np.stack([fields[f"{side}_{axis}"][nodes] for axis in AXES], axis=1)
    area = fields[f"{side}_area"].ravel()[nodes]
    return ContactFace(nodes, np.ascontiguousarray(points[nodes]), frame, area)
