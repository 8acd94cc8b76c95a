"""Mode shapes of a reduced model on its mesh, as a VTU file."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np

from pipeline.errors import InputError, input_error, reason_of
from pipeline.export.source import Kind, kind_of
from pipeline.process.isolated_reading import read_apart, read_given_model

COUNT = 10


def write_shapes(source: Path, sector_file: Path | None, target: Path, count: int = COUNT) -> str:
    """Write the lowest mode shapes with free shrouds as point data, `mode_01_202.9_Hz`, ...; returns a summary.

    Of a disk those of nodal diameter 0.
    """
    from geometry import MESHIO_CELLS, SectorFileError, cell_library, import_sector
    from rom import ReducedModelError, load_sector, mode_shapes

    if kind_of(source) is not Kind.model:
        raise input_error(source, "", "a response", "a reduced model (rom.h5)")
    if sector_file is None:
        raise input_error(source, "", "its shapes need a mesh", "--mesh FILE, the mesh.vtu of the model")
    try:
        read = load_sector if sector_file.suffix == ".h5" else import_sector
        sector = read_apart(sector_file, "a mesh of this program", partial(read, sector_file))
    except SectorFileError as error:
        raise InputError(reason_of(error)) from None
    model = read_given_model(source)
    try:
        count = min(count, model.size)
        frequency, shapes = mode_shapes(model, 0.0, normal=0.0, tangential=0.0, count=count)
    except ReducedModelError as error:
        raise InputError(f"{source}: {reason_of(error)}") from None
    points = len(sector.points)
    if shapes.shape[1] < points:
        raise input_error(sector_file, "", f"{points} points", f"the mesh of the model, {shapes.shape[1]} nodes")
    names = [f"mode_{k + 1:02d}_{hz:.4g}_Hz" for k, hz in enumerate(frequency)]
    motion = {name: np.real(shape[:points]) for name, shape in zip(names, shapes, strict=True)}
    cells = [(MESHIO_CELLS[block.kind], block.nodes) for block in sector.blocks]
    mesh = cell_library(sector).Mesh(sector.points, cells, point_data=motion)
    mesh.write(target, file_format="vtu")
    wave = " of nodal diameter 0" if model.has_disk else ""
    return f"{count} mode shapes{wave}, {', '.join(f'{hz:.5g}' for hz in frequency)} Hz"
