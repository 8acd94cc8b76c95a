"""Mode shapes drawn offscreen: `python -m pipeline.render.mode_shapes JOB`, the job as JSON; without it, on stdin."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pipeline.render import ring
from pipeline.render.drawing_process import RenderJob, drawing_main
from pipeline.render.ring import ENLARGED, Window, aim, drawn_length, save_png, wheel, write_heading
from pipeline.stages.model.model_files import is_joined, read_families

if TYPE_CHECKING:
    from geometry.sector import SectorMesh
    from rom.cyclic.reduced_model import ReducedModel

Array = NDArray[np.float64]
WINDOW = (1900, 1050)
SPLITS = {1: (0.62, 0.38), 2: (0.38, 0.38, 0.24)}  # shares of the width, by the number of states of the shrouds
WITHOUT_CORIOLIS = "without Coriolis forces"
BESIDE_WHEEL = {1: (0.4, 0.6), 2: (0.28, 0.28, 0.44)}


@dataclass(frozen=True)
class Mode:
    """One mode as it is drawn: shape (N, 3), scaled to 1, and what the picture says of it."""

    shape: NDArray[np.complex128]
    heading: str


def draw(job: RenderJob) -> None:
    """One picture for every mode of the job, `<prefix>mode_<number>.png` in its folder."""
    from rom.files.reduced_model_file import read_reduced_model
    from rom.files.sector_file import load_sector

    sector, model = load_sector(job.sector), read_reduced_model(job.rom)
    states = [_modes(job, sector, model, job.contact, job.normal, job.tangential)]
    if job.stuck_normal:
        states.append(_modes(job, sector, model, "stuck", job.stuck_normal, job.stuck_tangential))
    window = Window(WINDOW, _widths(sector, len(states)))
    for mode in job.modes:
        if mode > len(states[0]):
            raise ValueError(f"mode {mode}: the reduced model has {len(states[0])}")
        _compose(window.plotter, job, sector, [state[mode - 1] for state in states])
        save_png(window.picture(), Path(job.folder) / f"{job.prefix}mode_{mode}.png")
    window.close()


def _widths(sector: SectorMesh, states: int) -> tuple[float, ...]:
    """Shares of the views in the width: each state of the shrouds, then the tips or the wheel."""
    return (BESIDE_WHEEL if is_joined(sector) else SPLITS)[states]


def _modes(
    job: RenderJob,
    sector: SectorMesh,
    model: ReducedModel,
    contact: str,
    normal: Sequence[float],
    tangential: Sequence[float],
) -> list[Mode]:
    """The lowest modes of one state of the shrouds."""
    springs: dict[str, Any] = {"normal": np.asarray(normal), "tangential": np.asarray(tangential)}
    frequency, shapes, names = named_shapes(Path(job.rom), model, job.phase, min(max(job.modes), model.size), springs)
    diameter = _diameter(job, sector)
    still = f"\n{WITHOUT_CORIOLIS}" if job.coriolis and model.has_coriolis else ""
    return [
        Mode(
            at_largest(shape[: len(sector.points)]),
            f"mode {number} ({name}), shrouds {contact}\n{value:.1f} Hz, nodal diameter {diameter}{still}",
        )
        for number, (name, value, shape) in enumerate(zip(names, frequency, shapes, strict=True), start=1)
    ]


def _diameter(job: RenderJob, sector: SectorMesh) -> int:
    """Nodal diameter of the wave."""
    folded = round(job.phase * sector.n_blades / (2.0 * np.pi)) % sector.n_blades
    return min(folded, sector.n_blades - folded)


def named_shapes(
    rom: Path, model: ReducedModel, phase: float, count: int, springs: dict[str, Any]
) -> tuple[NDArray[np.float64], NDArray[np.complex128], list[str]]:
    """Natural frequencies, mode shapes on the mesh and names of the lowest modes of a model made here."""
    from rom.cyclic.natural_frequencies import natural_modes
    from rom.cyclic.reduced_model import expand_to_mesh

    frequency, modes = natural_modes(model, phase, count=count, **springs)
    families = read_families(rom)
    assert families is not None  # a model with a mesh has them
    return frequency, expand_to_mesh(model, modes.T), families.names(frequency, modes)[0]


def at_largest(shape: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """The shape (N, 3) at the instant of its largest displacement, scaled to 1 there."""
    largest = shape.reshape(-1)[np.argmax(np.abs(shape))]
    turned = shape * (np.abs(largest) / largest)
    return turned / np.linalg.norm(np.real(turned), axis=1).max()


def _compose(plotter: Any, job: RenderJob, sector: SectorMesh, modes: Sequence[Mode]) -> None:
    """The blade with its neighbours from the side, in each state of the shrouds, and the shrouds from the tip.

    Of a sector of a disk the whole wheel in place of the latter.
    """
    for view, mode in enumerate(modes):
        plotter.subplot(0, view)
        _add_ring(plotter, job, sector, mode.shape, from_tip=False)
        ring.add_outline(plotter, sector)
        ring.add_axes(plotter, sector)
        if view == 0:
            ring.name_faces(plotter, sector, 0.17)
        write_heading(plotter, f"{job.title if view == 0 else ' '}\n{mode.heading}")
        ring.aim_from_side(plotter, sector)
        plotter.camera.zoom(1.0 if len(modes) == 1 else 1.2)  # the views are narrow, their labels stand inside
    plotter.subplot(0, len(modes))
    if is_joined(sector):
        _add_wheel(plotter, job, sector, modes[0].shape)
    else:
        _add_tips(plotter, job, sector, modes[0].shape, _widths(sector, len(modes))[-1])


def _add_wheel(plotter: Any, job: RenderJob, sector: SectorMesh, shape: NDArray[np.complex128]) -> None:
    """The wave all around the wheel."""
    largest = drawn_length(sector, job.phase, ENLARGED * job.deformation)
    surface = wheel(sector, lambda blade: np.real(shape * np.exp(1j * blade * job.phase)), largest)
    look: dict[str, Any] = {"scalars": "signed", "cmap": "coolwarm", "clim": (-1.0, 1.0)}
    bar = ring.scalar_bar("displacement with its sign / largest") | {"n_labels": 5}
    plotter.add_mesh(surface, scalar_bar_args=bar, **look)
    write_heading(plotter, f"\nthe wheel, shrouds {job.contact}, drawn {1e3 * largest:.3g} mm")
    aim(plotter, sector)


def _add_tips(plotter: Any, job: RenderJob, sector: SectorMesh, shape: NDArray[np.complex128], width: float) -> None:
    """The shrouds at rest from the tip, in a view with this share of the window's width."""
    _add_ring(plotter, job, sector, shape, from_tip=True)
    write_heading(plotter, " \nat rest, from the tip")
    ring.name_faces(plotter, sector, 0.06)
    _aim_from_tip(plotter, sector, job.blades, width)


def _add_ring(
    plotter: Any, job: RenderJob, sector: SectorMesh, shape: NDArray[np.complex128], from_tip: bool
) -> None:
    """The fundamental blade coloured by displacement, between its pale neighbours."""
    pitch, largest = 2.0 * np.pi / sector.n_blades, drawn_length(sector, job.phase, job.deformation)
    for blade in ring.blades_of(job.blades):
        motion = np.real(shape * np.exp(1j * blade * job.phase))
        # the view from the tip shows the undeformed shrouds: exaggerated motion would draw them through each other
        mesh = ring.grid(sector, motion, 0.0 if from_tip else largest, blade * pitch)
        surface = ring.surface_of(mesh)
        if blade == 0:
            _add_own(plotter, surface, from_tip, f"displacement / largest, drawn {1e3 * largest:.3g} mm")
            ring.add_contacts(plotter, sector, mesh.points)
        else:
            ring.add_neighbour(plotter, surface)


def _add_own(plotter: Any, surface: Any, from_tip: bool, of_bar: str) -> None:
    plotter.add_mesh(
        surface,
        scalars="displacement",
        cmap="viridis",
        clim=(0.0, 1.0),
        show_edges=not from_tip,
        edge_color="#404040",
        line_width=0.5,
        opacity=0.45 if from_tip else 1.0,
        show_scalar_bar=not from_tip,
        scalar_bar_args=ring.scalar_bar(of_bar) | {"width": 0.75},  # its title is wider than that of a motion
    )
    plotter.add_mesh(ring.edges(surface), color="black", line_width=2.0)


def _aim_from_tip(plotter: Any, sector: SectorMesh, blades: int, width: float) -> None:
    """Camera along -z without perspective, circumference upwards; the view has this share of the window's width."""
    low, high = sector.points.min(axis=0), sector.points.max(axis=0)
    pitch = 2.0 * np.pi / sector.n_blades * high[2]
    height = (blades - 1) * pitch + (high[1] - low[1])
    scale = max(0.5 * height / 0.76, 0.55 * (high[0] - low[0]) / (width * WINDOW[0] / WINDOW[1]))
    upwards = 0.5 * pitch if blades % 2 == 0 else 0.0  # an even number has one more neighbour on the +y side
    middle = np.array([(low[0] + high[0]) / 2.0, (low[1] + high[1]) / 2.0 + upwards - 0.12 * scale, high[2]])
    plotter.enable_parallel_projection()
    plotter.camera_position = [middle + np.array([0.0, 0.0, 1.0]), middle, (0.0, 1.0, 0.0)]
    plotter.reset_camera_clipping_range()
    plotter.camera.parallel_scale = scale


if __name__ == "__main__":
    drawing_main(draw, RenderJob, ("pyvista.plotting", "scipy.linalg"))
