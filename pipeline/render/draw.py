"""Draw mode shapes offscreen: `python -m pipeline.render.draw JOB` with the job as JSON."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import one_line
from pipeline.render.job import RenderJob

if TYPE_CHECKING:
    from geometry import SectorMesh

Array = NDArray[np.float64]
HEXAHEDRON = 12  # VTK's cell type
RIGHT_COLOUR, LEFT_COLOUR = "#D55E00", "#56B4E9"
WINDOW = (1900, 1050)
SPLIT = 0.62  # share of the width that the first view has
TIP_VIEW_ASPECT = (1.0 - SPLIT) * WINDOW[0] / WINDOW[1]
VIEW = (-0.62, -0.38, 0.68)  # from the fundamental blade to the camera


def draw(job: RenderJob) -> None:
    """One picture for every mode of the job, `<prefix>mode_<number>.png` in its folder."""
    from geometry import load_sector
    from rom import mode_shapes, read_reduced_model

    sector, model = load_sector(job.sector), read_reduced_model(job.rom)
    frequency, shapes = mode_shapes(
        model,
        job.phase,
        normal=np.asarray(job.normal),
        tangential=np.asarray(job.tangential),
        count=min(max(job.modes), model.size),
    )
    for mode in job.modes:
        if mode > len(frequency):
            raise ValueError(f"mode {mode}: the reduced model has {len(frequency)}")
        shape = at_largest(shapes[mode - 1, : len(sector.points)])
        heading = f"{job.title}: mode {mode}, shrouds {job.contact}, {frequency[mode - 1]:.1f} Hz"
        _picture(job, sector, shape, heading, Path(job.folder) / f"{job.prefix}mode_{mode}.png")


def at_largest(shape: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """The shape (N, 3) at the instant of its largest displacement, scaled to 1 there."""
    largest = shape.reshape(-1)[np.argmax(np.abs(shape))]
    turned = shape * (np.abs(largest) / largest)
    return turned / np.linalg.norm(np.real(turned), axis=1).max()


def turned(vectors: Array, angle: float) -> Array:
    """Vectors (..., 3) turned about the engine axis x by `angle` rad from z (radial) towards +y."""
    cosine, sine = np.cos(angle), np.sin(angle)
    x, y, z = np.moveaxis(vectors, -1, 0)
    return np.stack([x, y * cosine + z * sine, z * cosine - y * sine], axis=-1)


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
    _add_outline(plotter, sector)
    plotter.add_text(heading, position="upper_left", font_size=15, color="black")
    _aim_from_side(plotter, sector)
    plotter.subplot(1)
    plotter.add_text("at rest, from the tip", position="upper_left", font_size=13, color="black")
    entries = [["right contact nodes", RIGHT_COLOUR], ["left contact nodes", LEFT_COLOUR]]
    plotter.add_legend(entries, bcolor="white", face="circle", size=(0.36, 0.09), loc="lower left")
    _aim_from_tip(plotter, sector, job.blades)
    plotter.screenshot(str(path))
    plotter.close()


def _add_ring(
    plotter: Any, job: RenderJob, sector: SectorMesh, shape: NDArray[np.complex128], from_tip: bool
) -> None:
    """The fundamental blade coloured by displacement between its neighbours, pale so that nothing is hidden."""
    pitch = 2.0 * np.pi / sector.n_blades
    first = -((job.blades - 1) // 2)
    for blade in range(first, first + job.blades):
        motion = np.real(shape * np.exp(1j * blade * job.phase))
        # from the tip the shrouds are shown at rest: exaggerated motion would draw them through each other
        grid = _grid(sector, motion, 0.0 if from_tip else job.deformation, blade * pitch)
        surface = grid.extract_surface(algorithm="dataset_surface")
        if blade == 0:
            _add_own(plotter, surface, from_tip)
            _add_contacts(plotter, sector, grid.points)
        else:
            plotter.add_mesh(surface, color="#9aa7b5", opacity=0.25)
            plotter.add_mesh(_edges(surface), color="#708090", line_width=1.5)


def _grid(sector: SectorMesh, motion: Array, deformation: float, angle: float) -> Any:
    """The deformed mesh of one blade, with the displacement relative to the largest as point data."""
    import pyvista as pv

    cells = np.column_stack([np.full(len(sector.hexahedra), 8), sector.hexahedra]).ravel()
    kinds = np.full(len(sector.hexahedra), HEXAHEDRON, dtype=np.uint8)
    points = turned(sector.points + deformation * motion, angle)
    grid = pv.UnstructuredGrid(cells, kinds, points)
    grid.point_data["displacement"] = np.linalg.norm(motion, axis=1)
    return grid


def _add_own(plotter: Any, surface: Any, from_tip: bool) -> None:
    bar = {
        "title": "displacement / largest\n",
        "color": "black",
        "vertical": False,
        "position_x": 0.2,
        "position_y": 0.03,
        "height": 0.1,
        "width": 0.6,
        "title_font_size": 20,
        "label_font_size": 18,
        "n_labels": 6,
        "fmt": "%.1f",
    }
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
        scalar_bar_args=bar,
    )
    plotter.add_mesh(_edges(surface), color="black", line_width=2.0)


def _edges(surface: Any) -> Any:
    """Sharp edges of a surface."""
    return surface.extract_feature_edges(feature_angle=40.0, boundary_edges=False, manifold_edges=False)


def _add_contacts(plotter: Any, sector: SectorMesh, points: Array) -> None:
    """Spheres on the contact nodes, sized to stay apart from each other."""
    import pyvista as pv

    for face, colour in ((sector.right, RIGHT_COLOUR), (sector.left, LEFT_COLOUR)):
        radius = 0.25 * float(np.sqrt(np.min(face.area)))
        spheres = pv.PolyData(points[face.nodes]).glyph(geom=pv.Sphere(radius=radius), scale=False, orient=False)
        plotter.add_mesh(spheres, color=colour, ambient=0.3)


def _add_outline(plotter: Any, sector: SectorMesh) -> None:
    """Sharp edges of the blade at rest, to see the deformation against."""
    rest = _grid(sector, np.zeros_like(sector.points), 0.0, 0.0)
    plotter.add_mesh(_edges(rest.extract_surface(algorithm="dataset_surface")), color="#808080", line_width=1.0)


def _aim_from_side(plotter: Any, sector: SectorMesh) -> None:
    """From the side and above, so that the airfoil and the Z of the shroud are both seen."""
    low, high = sector.points.min(axis=0), sector.points.max(axis=0)
    middle = (low + high) / 2.0
    plotter.camera_position = [middle + np.asarray(VIEW), middle, (0.0, 0.0, 1.0)]
    plotter.camera.view_angle = 15.0
    plotter.reset_camera()
    plotter.camera.zoom(0.97)


def _aim_from_tip(plotter: Any, sector: SectorMesh, blades: int) -> None:
    """Along -z without perspective, circumference upwards, as the shroud angle is defined; the legend below."""
    low, high = sector.points.min(axis=0), sector.points.max(axis=0)
    pitch = 2.0 * np.pi / sector.n_blades * high[2]
    height = (blades - 1) * pitch + (high[1] - low[1])
    scale = max(0.5 * height / 0.76, 0.55 * (high[0] - low[0]) / TIP_VIEW_ASPECT)
    upwards = 0.5 * pitch if blades % 2 == 0 else 0.0  # an even number has one neighbour more on the +y side
    middle = np.array([(low[0] + high[0]) / 2.0, (low[1] + high[1]) / 2.0 + upwards - 0.12 * scale, high[2]])
    plotter.enable_parallel_projection()
    plotter.camera_position = [middle + np.array([0.0, 0.0, 1.0]), middle, (0.0, 1.0, 0.0)]
    plotter.reset_camera_clipping_range()
    plotter.camera.parallel_scale = scale


if __name__ == "__main__":
    try:
        draw(RenderJob.from_json(sys.argv[1]))
    except Exception as error:  # the caller shows the last line to its user
        sys.exit(one_line(f"{type(error).__name__}: {error}"))
