"""Stress fields drawn offscreen: `python -m pipeline.stress.field_pictures JOB`, the job as JSON."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np

from pipeline.render.drawing_process import drawing_main
from pipeline.render.ring import VIEW, edges, scalar_bar
from pipeline.scene.labels import prefixed
from pipeline.stress.job import COLOURS, MARGINS, StressJob

WIDTH, HEIGHT = 650, 1050  # of one view, pixels
INTERVALS = 4  # of the numbers beside the colours
STEPS = (1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0)


def draw(job: StressJob) -> None:
    """Amplitude, static stress and, with limits, the margin, side by side: `<name>.png`."""
    import pyvista as pv

    mesh = pv.read(job.fields)
    views = [
        ("von_mises_amplitude_pa", "von Mises amplitude", job.largest_amplitude, "viridis"),
        ("von_mises_static_pa", "static von Mises", abs(job.largest_mean), "viridis"),
    ]
    if job.required:
        views.append(("margin", "margin", MARGINS * job.required, COLOURS))
    size = [WIDTH * len(views), HEIGHT]
    plotter: Any = pv.Plotter(off_screen=True, window_size=size, shape=(1, len(views)), border=False)
    plotter.set_background("white", all_renderers=True)
    for place, (name, said, top, colours) in enumerate(views):
        plotter.subplot(0, place)
        plotter.enable_anti_aliasing("ssaa")
        _view(plotter, mesh, (name, said, top, colours), job)
        plotter.add_text(job.title if place == 0 else " ", position="upper_left", font_size=13, color="black")
    plotter.screenshot(str(Path(job.folder) / f"{job.name}.png"))
    plotter.close()


def round_top(largest: float) -> float:
    """The end of colours with `INTERVALS` round steps, at the largest value or a little above."""
    power = 10.0 ** math.floor(math.log10(largest / INTERVALS))
    return INTERVALS * power * next(step for step in STEPS if step * power >= largest / INTERVALS * (1.0 - 1e-9))


def _view(plotter: Any, mesh: Any, view: tuple[str, str, float, str], job: StressJob) -> None:
    """One field with the hot spots, in colours that end at its largest value outside of singular places."""
    import pyvista as pv

    name, said, top, colours = view
    shown = mesh.copy(deep=False)
    factor, unit = (1.0, "") if name == "margin" else prefixed(top or 1.0, "Pa")
    shown.point_data["shown"] = np.asarray(mesh.point_data[name]) * factor
    surface = shown.extract_surface(algorithm="dataset_surface")
    title = f"{said} [{unit}]" if unit else f"{said} (required {job.required:g})"
    bar = scalar_bar(title, "%.3g") | {"n_labels": INTERVALS + 1, "width": 0.8, "position_x": 0.1}
    margin = name == "margin"  # the required one in the middle of the colours
    limits = (job.required / MARGINS, top) if margin else (0.0, round_top(top * factor or 1.0))
    light = {"ambient": 0.55, "diffuse": 0.5}  # colours stay those of the bar
    given: dict[str, Any] = {"cmap": colours, "clim": limits, "log_scale": margin, "scalar_bar_args": bar, **light}
    plotter.add_mesh(surface, scalars="shown", **given)
    plotter.add_mesh(edges(surface), color="black", line_width=1.0)
    if job.hot_spots:
        points = np.array(job.hot_spots)
        numbers = [str(k) for k in range(1, len(points) + 1)]
        radius = 0.006 * float(np.linalg.norm(np.ptp(mesh.points, axis=0)))
        plotter.add_mesh(
            pv.PolyData(points).glyph(geom=pv.Sphere(radius=radius), scale=False, orient=False), color="#D55E00"
        )
        plotter.add_point_labels(
            points,
            numbers,
            shape_opacity=0.6,
            always_visible=True,
            font_size=16,
            text_color="black",
            show_points=False,
        )
    low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
    middle = (low + high) / 2.0
    plotter.camera_position = [middle + np.asarray(VIEW), middle, (0.0, 0.0, 1.0)]
    plotter.camera.view_angle = 15.0
    plotter.reset_camera()
    plotter.camera.zoom(1.35)


if __name__ == "__main__":
    drawing_main(draw, StressJob)
