"""Sectors as HDF5 files, bit for bit."""

from pathlib import Path
from typing import Any

import numpy as np

from geometry.elements import ElementBlock, ElementSides
from geometry.errors import SectorFileError
from geometry.sector import ContactFace, FacePair, SectorMesh, check_sector
from rom.files.hdf5 import UNREADABLE, new_hdf5, opened, stored_array, why_unreadable

FORMAT = "2"
FACE_FIELDS = ("nodes", "position", "frame", "area")
SIDE_FIELDS = ("block", "element", "side")


def save_sector(path: str | Path, sector: SectorMesh) -> None:
    """Write a sector to an HDF5 file: `points` and the groups `blocks`, `node_sets`, `surfaces`, `right` and `left`.

    Further pairs of faces stand in the group `pairs`, numbered; their names are attributes.

    The file is written in place; an interrupted call leaves a partial file.
    """
    with new_hdf5(path) as file:
        file.attrs["format"] = FORMAT
        file.attrs["n_blades"] = sector.n_blades
        file["points"] = sector.points
        if sector.temperature is not None:
            file["temperature"] = sector.temperature
        for k, block in enumerate(sector.blocks):
            file[f"blocks/{k}/nodes"] = block.nodes
            file[f"blocks/{k}"].attrs.update(kind=block.kind, material=block.material)
        for name, surface in sector.surfaces.items():
            for field in SIDE_FIELDS:
                file[f"surfaces/{name}/{field}"] = getattr(surface, field)
        for name, nodes in sector.node_sets.items():
            file[f"node_sets/{name}"] = nodes
        _write_faces(file, sector)
        if sector.main != "shroud":
            file.attrs["main"] = sector.main
        if sector.kind != "neighbours":
            file.attrs["kind"] = sector.kind
        for k, (name, pair) in enumerate(sector.pairs.items()):
            group = file.create_group(f"pairs/{k}")
            group.attrs["name"] = name
            group.attrs["kind"] = pair.kind
            group["face_right"], group["face_left"] = pair.face_right, pair.face_left
            _write_faces(group, pair)


def _write_faces(group: Any, pair: SectorMesh | FacePair) -> None:
    for side, face in (("right", pair.right), ("left", pair.left)):
        for field in FACE_FIELDS:
            group[f"{side}/{field}"] = getattr(face, field)


def load_sector(path: str | Path) -> SectorMesh:
    """Read a sector written by `save_sector`."""
    try:
        with opened(path) as file:
            if file.attrs.get("format") != FORMAT:
                raise SectorFileError(f"{path}: not a sector of format {FORMAT}")
            sets = {name: _integers(nodes) for name, nodes in file["node_sets"].items()}
            sector = SectorMesh(
                points=_reals(file["points"]),
                blocks=tuple(_block(file[f"blocks/{k}"]) for k in range(len(file["blocks"]))),
                node_sets=sets,
                right=_face(file["right"]),
                left=_face(file["left"]),
                n_blades=int(file.attrs["n_blades"]),
                surfaces={name: _surface(group) for name, group in file.get("surfaces", {}).items()},
                pairs=dict(_pair(file[f"pairs/{k}"]) for k in range(len(file.get("pairs", ())))),
                main=str(file.attrs.get("main", "shroud")),
                kind=str(file.attrs.get("kind", "neighbours")),
                temperature=_reals(file["temperature"]) if "temperature" in file else None,
            )
    except SectorFileError:
        raise
    except UNREADABLE as error:
        raise SectorFileError(f"{path}: not a sector: {why_unreadable(error)}") from error
    check_sector(path, sector)
    return sector


def _block(group: Any) -> ElementBlock:
    return ElementBlock(str(group.attrs["kind"]), _integers(group["nodes"]), str(group.attrs["material"]))


def _surface(group: Any) -> ElementSides:
    return ElementSides(*(_integers(group[field]) for field in SIDE_FIELDS))


def _face(group: Any) -> ContactFace:
    return ContactFace(
        _integers(group["nodes"]), _reals(group["position"]), _reals(group["frame"]), _reals(group["area"])
    )


def _pair(group: Any) -> tuple[str, FacePair]:
    right, left = (_integers(group[name]) for name in ("face_right", "face_left"))
    kind = str(group.attrs.get("kind", "neighbours"))
    return str(group.attrs["name"]), FacePair(_face(group["right"]), _face(group["left"]), right, left, kind)


def _integers(dataset: Any) -> np.ndarray:
    values = stored_array(dataset)
    if values.dtype.kind not in "iu":
        raise TypeError(f"{dataset.name} holds no integers")
    return values.astype(np.int64)


def _reals(dataset: Any) -> np.ndarray:
    values = stored_array(dataset)
    if values.dtype.kind != "f":
        raise TypeError(f"{dataset.name} holds no real numbers")
    return values.astype(np.float64)
