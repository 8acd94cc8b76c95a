"""Consistency of the arrays of a sector."""

from pathlib import Path

import numpy as np

from geometry.elements import ELEMENT_KINDS
from geometry.errors import SectorFileError
from geometry.sector import SectorMesh


def check_sector(path: str | Path, sector: SectorMesh) -> None:
    """Check that the arrays of a sector read from a file are consistent.

    Parameters
    ----------
    path : str or path
        The file, named in the error.
    sector : SectorMesh
        The mesh.

    Raises
    ------
    SectorFileError
        A shape is wrong, a point is not finite, or a node number is out of range.

    Examples
    --------
    >>> from dataclasses import replace
    >>> from geometry import BladeParameters, MeshParameters, ShroudParameters, build_sector, check_sector
    >>> blade, shroud = BladeParameters(40, 0.3, 0.1, 0.02, 0.008), ShroudParameters(45.0, 0.01, 0.04, 0.01)
    >>> sector = build_sector(blade, shroud, MeshParameters(size=0.02))
    >>> check_sector("sector.vtu", replace(sector, points=np.nan * sector.points))
    Traceback (most recent call last):
    geometry.errors.SectorFileError: sector.vtu: not a sector: a point is not finite
    """
    points, count = sector.points, len(sector.points)
    shapes = points.ndim == 2 and points.shape[1] == 3 and len(sector.blocks) > 0
    tables = [*(block.nodes for block in sector.blocks), *sector.node_sets.values()]
    for block in sector.blocks:
        if block.kind not in ELEMENT_KINDS:
            raise SectorFileError(f'{path}: not a sector: elements of the unknown kind "{block.kind}"')
        shapes &= block.nodes.ndim == 2 and block.nodes.shape[1] == block.topology.n_nodes
    for face in (sector.right, sector.left):
        n = len(face.nodes)
        shapes &= face.position.shape == (n, 3) and face.frame.shape == (n, 3, 3) and face.area.shape == (n,)
        tables.append(face.nodes)
    if not shapes or len(sector.right.nodes) != len(sector.left.nodes):
        raise SectorFileError(f"{path}: not a sector: arrays of the wrong shape")
    if not np.isfinite(points).all():
        raise SectorFileError(f"{path}: not a sector: a point is not finite")
    if any(table.size and (table.min() < 0 or table.max() >= count) for table in tables):
        raise SectorFileError(f"{path}: not a sector: a node number beyond the {count} points")
