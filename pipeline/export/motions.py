"""Motions on the mesh for other programs: mode shapes of a wave, motion at the peak of a curve, the whole ring."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import InputError, input_error, reason_of
from pipeline.export.source import Kind, kind_of
from pipeline.process.isolated_reading import read_apart, read_given_model

if TYPE_CHECKING:
    from geometry.sector import SectorMesh
    from rom.cyclic.reduced_model import ReducedModel

COUNT = 10  # mode shapes
FRAMES = 24  # instants of a period in an animation of the ring


@dataclass(frozen=True)
class MotionChoice:
    """What is asked for."""

    engine_order: int | None = None  # of the wave; None: that of the scene, or 0 where it is not known
    mode: int | None = None  # number of a mode, from 1, of an animation; None: the first
    curve: int | None = None  # number of a curve whose motion at the peak is asked for; None: modes
    response: Path | None = None  # file of the curves


@dataclass(frozen=True)
class MeshMotion:
    """Motions of the vertices of a mesh."""

    sector: SectorMesh
    phase: float  # inter-blade phase angle, rad
    shapes: dict[str, NDArray[np.complex128]]  # (H+1, N, 3) by name: harmonics, from 0, m
    said: str


def mesh_motion(source: Path, sector_file: Path | None, choice: MotionChoice) -> MeshMotion:
    """The motions that are asked for, of a reduced model and its mesh."""
    model, sector = _on_mesh(source, sector_file)
    if choice.curve is not None:
        return _operating(source, sector, choice)
    return _modes(model, sector, choice)


def _on_mesh(source: Path, sector_file: Path | None) -> tuple[ReducedModel, SectorMesh]:
    from geometry.errors import SectorFileError
    from geometry.exchange import import_sector
    from rom.files.sector_file import load_sector

    if kind_of(source) is not Kind.model:
        raise input_error(source, "", "a response", "a reduced model (rom.h5)")
    if sector_file is None:
        raise input_error(source, "", "its shapes need a mesh", "--mesh FILE, the mesh.vtu of the model")
    try:
        read = load_sector if sector_file.suffix == ".h5" else import_sector
        sector = read_apart(sector_file, "a mesh of this program", partial(read, sector_file))
    except SectorFileError as error:
        raise InputError(reason_of(error)) from None
    return read_given_model(source), sector


def _modes(model: ReducedModel, sector: SectorMesh, choice: MotionChoice) -> MeshMotion:
    """The lowest mode shapes with free shrouds, which feel the wave where a disk joins the sectors."""
    from rom.cyclic.cyclic_symmetry import inter_blade_phase
    from rom.cyclic.natural_frequencies import mode_shapes
    from rom.cyclic.resonance_crossings import excited_nodal_diameter
    from rom.errors import ReducedModelError

    order, points = choice.engine_order or 0, len(sector.points)
    phase = inter_blade_phase(order, model.n_blades)
    count = min(max(COUNT, choice.mode or 1), model.size)
    if choice.mode is not None and not 1 <= choice.mode <= count:
        raise input_error("--mode", "", str(choice.mode), f"1 to {count}")
    try:
        at = phase if model.has_disk else 0.0
        frequency, shapes = mode_shapes(model, at, normal=0.0, tangential=0.0, count=count)
    except ReducedModelError as error:
        raise InputError(f"the reduced model: {reason_of(error)}") from None
    if shapes.shape[1] < points:
        raise input_error("--mesh", "", f"{points} points", f"the mesh of the model, {shapes.shape[1]} nodes")
    names = [f"mode_{k + 1:02d}_{hz:.4g}_Hz" for k, hz in enumerate(frequency)]
    still = np.zeros((points, 3), complex)
    found = {name: np.stack([still, shape[:points]]) for name, shape in zip(names, shapes, strict=True)}
    wave = ""
    if model.has_disk and model.n_blades is not None:
        wave = f" of nodal diameter {excited_nodal_diameter(order, model.n_blades)} (engine order {order})"
    wave += " without Coriolis forces" if model.has_coriolis else ""
    said = f"{count} mode shapes{wave}, {', '.join(f'{hz:.5g}' for hz in frequency)} Hz"
    return MeshMotion(sector, phase, found, said)


def _operating(rom: Path, sector: SectorMesh, choice: MotionChoice) -> MeshMotion:
    """The motion at the peak of a curve."""
    import h5py

    from pipeline.render.operating_shapes import operating_shape_of

    if choice.response is None:
        raise input_error("--curve", "", str(choice.curve), "with the output folder of a run")
    with h5py.File(choice.response, "r") as file:
        group = file.get(f"curve/{choice.curve}")
        if group is None:
            raise input_error("--curve", "", str(choice.curve), f"0 to {len(file['curve']) - 1}")
        try:
            shape = operating_shape_of(group, rom, len(sector.points))
        except InputError:
            raise
        except ValueError as error:
            raise InputError(f"{rom}: {reason_of(error)}") from None
    if shape is None:
        raise input_error("--curve", "", str(choice.curve), "a curve with a peak")
    said = f"motion at the peak of curve {choice.curve}, {shape.frequency_hz:.6g} Hz"
    return MeshMotion(sector, shape.phase, {"displacement": shape.harmonics}, said)


def write_motion(found: MeshMotion, target: Path) -> str:
    """Write motions as point data of the mesh of a sector; returns a summary.

    A mode is one array, and a second one, `_imag`, where its points do not move in phase. The harmonics of a motion
    are `displacement_0_m`, `displacement_1_real_m`, `displacement_1_imag_m`, ...
    """
    from geometry.exchange import cell_library

    data: dict[str, NDArray[np.float64]] = {}
    for name, harmonics in found.shapes.items():
        if name != "displacement":
            data[name] = np.real(harmonics[1])
            data |= {f"{name}_imag": np.imag(harmonics[1])} if np.imag(harmonics[1]).any() else {}
            continue
        data[f"{name}_0_m"] = np.real(harmonics[0])
        for h, values in enumerate(harmonics[1:], start=1):
            data |= {f"{name}_{h}_real_m": np.real(values), f"{name}_{h}_imag_m": np.imag(values)}
    cells = [(block.topology.meshio_name, block.nodes) for block in found.sector.blocks]
    mesh = cell_library(found.sector).Mesh(found.sector.points, cells, point_data=data)
    mesh.write(target, file_format="vtu")
    return found.said


def write_ring(found: MeshMotion, choice: MotionChoice, beside: Path, stem: str) -> tuple[str, list[Path]]:
    """Write the surface of all sectors over a period, a file for each instant and the list of them (.pvd).

    Points lie at rest; the vectors `displacement` move them (in ParaView: Warp By Vector).
    """
    from pipeline.render.ring import wheel

    name, harmonics = list(found.shapes.items())[(choice.mode or 1) - 1]
    order, files, lines = np.arange(len(harmonics)), [], []
    for frame in range(FRAMES):
        angle = 2.0 * np.pi * frame / FRAMES

        def moved(blade: int, at: float = angle) -> NDArray[Any]:
            turned = np.exp(1j * order * (at + blade * found.phase))
            return np.asarray(np.real(np.tensordot(turned, harmonics, axes=1)))

        surface = wheel(found.sector, moved, 0.0)
        surface.point_data["displacement"] = surface.point_data.pop("motion")
        files.append(beside.with_name(f"{beside.stem}_{frame:02d}.vtp"))
        surface.save(files[-1])
        lines.append(f'<DataSet timestep="{frame / FRAMES:.6g}" file="{stem}_{frame:02d}.vtp"/>')
    head = '<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1">\n<Collection>\n'
    beside.write_text(f"{head}{chr(10).join(lines)}\n</Collection>\n</VTKFile>\n", encoding="utf-8")
    what = found.said if choice.curve is not None else f"{name} of {found.said}"
    return f"the ring of {found.sector.n_blades} blades at {FRAMES} instants of a period: {what}", [beside, *files]
