"""Mode shapes drawn offscreen: `python -m pipeline.render.mode_shapes JOB` with the job as JSON."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pipeline.render import ring
from pipeline.render.drawing_process import drawing_main
from pipeline.render.job import RenderJob

if TYPE_CHECKING:
    from geometry import SectorMesh

Array = NDArray[np.float64]
WINDOW = (1900, 1050)
SPLIT = 0.62  # share of the width that the first view has
TIP_VIEW_ASPECT = (1.0 - SPLIT) * WINDOW[0] / WINDOW[1]


def draw(job: RenderJob) -> None:
    """One picture for every mode of the job, `<prefix>mode_<number>.png` in its folder."""
    from rom import load_sector, mode_shapes, read_reduced_model

    sector, model = load_sector(job.sector), read_reduced_model(job.rom)
    frequency, shapes = mode_shapes(
        model,
        job.phase,
        normal=np.asarray(job.normal),
        tangential=np.asarray(job.tangential),
        count=min(max(job.modes), model.size),
    )
    names = names_of(sector, shapes)
    for mode in job.modes:
        if mode > len(frequency):
            raise ValueError(f"mode {mode}: the reduced model has {len(frequency)}")
        shape = at_largest(shapes[mode - 1, : len(sector.points)])
        heading = (
            f"{job.title}: mode {mode} ({names[mode - 1]}), shrouds {job.contact}, {frequency[mode - 1]:.1f} Hz\n"
            f"largest drawn displacement {1e3 * job.deformation:.3g} mm; x axial, z radial"
        )
        _picture(job, sector, shape, heading, Path(job.folder) / f"{job.prefix}mode_{mode}.png")


def names_of(sector: SectorMesh, shapes: NDArray[np.complex128]) -> list[str]:
    """Names 1F, 1E, 1T, ... of mode shapes (M, at least N, 3), by the motion of the airfoil."""
    from rom import mode_names

    below = min(float(sector.points[face.nodes, 2].min()) for face in (sector.right, sector.left))
    airfoil = np.flatnonzero(sector.points[:, 2] < below)
    return mode_names(sector.points[airfoil], shapes[:, airfoil])


def at_largest(shape: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """The shape (N, 3) at the instant of its largest displacement, scaled to 1 there."""
    largest = shape.reshape(-1)[np.argmax(np.abs(shape))]
    turned = shape * (np.abs(largest) / largest)
    return turned / np.linalg.norm(np.real(turned), axis=1).max()


def _picture(job: RenderJob, sector: SectorMesh, shape: NDArray[np.complex128], heading: str, path: Path) -> None:
    """Two views: the blade with its neighbours from the side, and the shrouds from the tip with the contact nodes."""
    import pyvista as pv

    plotter: Any = pv.Plotter(
        off_screen=True, window_size=list(WINDOW), shape="1|1", splitting_position=SPLIT, border=False
    )
    plotter.set_background("white", all_renderers=True)
    for view in (0, 1):
        plotter.subplot(view)
        plotter.enable_anti_aliasing("ssaa")
        _add_ring(plotter, job, sector, shape, from_tip=view == 1)
    plotter.subplot(0)
    ring.add_outline(plotter, sector)
    ring.add_axes(plotter, sector, 17)
    plotter.add_text(heading, position="upper_left", font_size=15, color="black")
    ring.aim_from_side(plotter, sector)
    plotter.subplot(1)
    plotter.add_text("at rest, from the tip", position="upper_left", font_size=13, color="black")
    _aim_from_tip(plotter, sector, job.blades)
    plotter.screenshot(str(path))
    plotter.close()


def _add_ring(
    plotter: Any, job: RenderJob, sector: SectorMesh, shape: NDArray[np.complex128], from_tip: bool
) -> None:
    """The fundamental blade coloured by displacement, between its pale neighbours."""
    pitch = 2.0 * np.pi / sector.n_blades
    for blade in ring.blades_of(job.blades):
        motion = np.real(shape * np.exp(1j * blade * job.phase))
        # the view from the tip shows the undeformed shrouds: exaggerated motion would draw them through each other
        mesh = ring.grid(sector, motion, 0.0 if from_tip else job.deformation, blade * pitch)
        surface = mesh.extract_surface(algorithm="dataset_surface")
        if blade == 0:
            _add_own(plotter, surface, from_tip)
            ring.add_contacts(plotter, sector, mesh.points)
            ring.label_faces(plotter, sector, mesh.points, 18)
        else:
            ring.add_neighbour(plotter, surface)


def _add_own(plotter: Any, surface: Any, from_tip: bool) -> None:
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
        scalar_bar_args=ring.scalar_bar("displacement / largest"),
    )
    plotter.add_mesh(ring.edges(surface), color="black", line_width=2.0)


def _aim_from_tip(plotter: Any, sector: SectorMesh, blades: int) -> None:
    """Camera along -z without perspective, circumference upwards, as for the shroud angle; legend below."""
    low, high = sector.points.min(axis=0), sector.points.max(axis=0)
    pitch = 2.0 * np.pi / sector.n_blades * high[2]
    height = (blades - 1) * pitch + (high[1] - low[1])
    scale = max(0.5 * height / 0.76, 0.55 * (high[0] - low[0]) / TIP_VIEW_ASPECT)
    upwards = 0.5 * pitch if blades % 2 == 0 else 0.0  # an even number has one more neighbour on the +y side
    middle = np.array([(low[0] + high[0]) / 2.0, (low[1] + high[1]) / 2.0 + upwards - 0.12 * scale, high[2]])
    plotter.enable_parallel_projection()
    plotter.camera_position = [middle + np.array([0.0, 0.0, 1.0]), middle, (0.0, 1.0, 0.0)]
    plotter.reset_camera_clipping_range()
    plotter.camera.parallel_scale = scale


if __name__ == "__main__":
    drawing_main(draw, RenderJob)
