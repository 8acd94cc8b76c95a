"""Operating deflection shapes: the motion of the whole blade at the peak of a curve, from the contact forces there.

Drawn offscreen by `python -m pipeline.render.operating_shapes JOB`, the job as JSON.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pipeline.render import ring
from pipeline.render.drawing_process import OperatingJob, drawing_main
from pipeline.render.ring import ENLARGED, Window, aim, drawn_length, save_png, wheel, write_heading
from pipeline.scene.labels import prefixed
from pipeline.scene.loads_section import Excitation
from pipeline.stages.curve.curve_file import modes_of_curve, section_from_attributes
from pipeline.stages.model.model_files import is_joined
from pipeline.stages.scene_to_solver import section_excitation

if TYPE_CHECKING:
    import h5py

    from geometry.sector import SectorMesh
    from nonlinear.options import Excitation as Wave
    from rom.cyclic.reduced_model import ReducedModel
    from rom.cyclic.sector_modes import RingModes


Array = NDArray[np.float64]


@dataclass(frozen=True)
class OperatingShape:
    """Periodic motion of the mesh vertices at one solved point."""

    # `frequency_hz`, `amplitude_m`: of the point
    frequency_hz: float
    amplitude_m: float
    phase: float  # inter-blade phase angle psi, rad
    # (H+1, N, 3), Fourier coefficients u^(h) of the N vertices, m; harmonic 0 real-valued
    harmonics: NDArray[np.complex128]

    def at(self, angle: float, blade: int = 0) -> Array:
        """Displacement (N, 3), m, of blade j in its own axes at theta: Re sum_h u^(h) exp(i h (theta + j psi))."""
        order = np.arange(len(self.harmonics))
        turned = np.exp(1j * order * (angle + blade * self.phase))
        return np.real(np.tensordot(turned, self.harmonics, axes=1))

    def largest(self, samples: int = 96) -> tuple[float, float]:
        """Largest displacement of a vertex over a period, m, and the angle, rad, where it is reached."""
        angles = 2.0 * np.pi * np.arange(samples) / samples
        sizes = [float(np.linalg.norm(self.at(angle), axis=1).max()) for angle in angles]
        top = int(np.argmax(sizes))
        return sizes[top], float(angles[top])


def operating_shape(curve: Path, rom: Path, n_vertices: int) -> OperatingShape | None:
    """Motion of the mesh vertices at the peak of a stored curve, from the excitation and the contact forces there."""
    import h5py

    with h5py.File(curve, "r") as file:
        return operating_shape_of(file, rom, n_vertices)


def operating_shape_of(group: h5py.Group, rom: Path, n_vertices: int) -> OperatingShape | None:
    """The same of the group of a curve."""
    from rom.files.reduced_model_file import read_reduced_model

    excitation, attributes = section_from_attributes(Excitation, group.attrs), dict(group.attrs)
    peak = int(group.attrs["peak_index"])
    if peak < 0:
        return None
    force = group["contact_force"][peak]
    point = float(group["frequency_hz"][peak]), float(group["amplitude_m"][peak])
    model = read_reduced_model(rom)
    wave = modes_of_curve(model, attributes), section_excitation(excitation)
    return shape_at(model, wave, point, force, n_vertices)


def shape_at(
    model: ReducedModel,
    wave: tuple[RingModes, Wave],
    point: tuple[float, float],
    contact_force: NDArray[np.complex128],
    n_vertices: int,
) -> OperatingShape:
    """Motion of the mesh vertices at a point of a curve.

    `wave`: damped modes and excitation. `point`: frequency, Hz, and amplitude, m. `contact_force` (H+1, n_c, 3), N.
    """
    from rom.cyclic.receptance import RelativeReceptance
    from rom.cyclic.reduced_model import expand_to_mesh

    (modal, exciting), harmonics = wave, tuple(range(len(contact_force)))
    phase = modal.phase(exciting.engine_order)
    receptance = RelativeReceptance(modal, phase, harmonics, exciting.force, exciting.factors)
    coordinates, _ = receptance.modal_response(2.0 * np.pi * point[0], contact_force.reshape(len(contact_force), -1))
    vertices = expand_to_mesh(model, receptance.reduced_coordinates(coordinates))[:, :n_vertices]
    return OperatingShape(*point, phase, vertices)


STILL, ANIMATED = (1400, 1050), (700, 525)
PERIOD = 2.0  # seconds that a period takes in the animation
SPLIT, BROADER = (0.4, 0.6), 1.5  # beside a wheel: shares of the width, and a wider window
COLOURS = 256  # of the animation's palette


def draw(job: OperatingJob) -> None:
    """The instant of the largest displacement as `<name>.png`, one period as `<name>.gif`."""
    from rom.files.sector_file import load_sector

    sector = load_sector(Path(job.sector))
    shape = operating_shape(Path(job.curve), Path(job.rom), len(sector.points))
    if shape is None:
        raise ValueError(f"{job.title}: the curve has no peak")
    largest, angle = shape.largest()
    folder = Path(job.folder)
    angles = angle + 2.0 * np.pi * np.arange(job.frames) / job.frames
    (still,) = _pictures(job, sector, (shape, largest), [angle], STILL)
    save_png(still, folder / f"{job.name}.png")
    _write_animation(folder / f"{job.name}.gif", _pictures(job, sector, (shape, largest), angles, ANIMATED))


def _write_animation(path: Path, frames: list[Any]) -> None:
    """An endless GIF with one palette, so that colours do not flicker."""
    from PIL import Image

    images = [Image.fromarray(frame) for frame in frames]
    palette = images[0].quantize(COLOURS, method=Image.Quantize.MAXCOVERAGE)
    reduced = [image.quantize(palette=palette, dither=Image.Dither.NONE) for image in images]
    duration = round(1000.0 * PERIOD / len(frames))
    reduced[0].save(path, save_all=True, append_images=reduced[1:], duration=duration, loop=0, optimize=False)


def _pictures(
    job: OperatingJob,
    sector: SectorMesh,
    motion: tuple[OperatingShape, float],
    angles: Iterable[float],
    size: tuple[int, int],
) -> list[Any]:
    """The ring at some instants, and beside the sector of a disk the whole wheel; `motion`: shape and largest."""
    shape, largest = motion
    small, beside = size[0] / STILL[0], is_joined(sector)
    width = round(size[0] * BROADER) if beside else size[0]
    window, found = Window((width, size[1]), SPLIT if beside else (1.0,)), []
    for angle in angles:
        at = (shape, float(angle), largest)
        window.plotter.subplot(0, 0)
        _add_ring(window.plotter, job, sector, at, small)
        if beside:
            window.plotter.subplot(0, 1)
            _add_wheel(window.plotter, job, sector, at, small)
        found.append(window.picture())
    window.close()
    return found


def _add_wheel(
    plotter: Any, job: OperatingJob, sector: SectorMesh, motion: tuple[OperatingShape, float, float], small: float
) -> None:
    """All sectors coloured by displacement; `motion`: shape, angle, largest displacement."""
    shape, angle, largest = motion
    factor, _ = prefixed(largest, "m")
    scale = drawn_length(sector, shape.phase, ENLARGED * job.deformation) / largest if largest > 0.0 else 0.0
    surface = wheel(sector, lambda blade: shape.at(angle, blade) * factor, scale / factor)
    limits = (0.0, largest * factor or 1.0)
    plotter.add_mesh(surface, scalars="displacement", cmap="viridis", clim=limits, show_scalar_bar=False)
    write_heading(plotter, f" \nthe wheel, drawn {_rounded(scale)} times as large", small)
    aim(plotter, sector)


def _add_ring(
    plotter: Any, job: OperatingJob, sector: SectorMesh, motion: tuple[OperatingShape, float, float], small: float
) -> None:
    """The fundamental blade coloured by displacement, pale neighbours, undeformed edges.

    `motion`: shape, angle, largest displacement.
    """
    shape, angle, largest = motion
    factor, unit = prefixed(largest, "m")
    scale = drawn_length(sector, shape.phase, job.deformation) / largest if largest > 0.0 else 0.0
    pitch = 2.0 * np.pi / sector.n_blades
    for blade in ring.blades_of(job.blades):
        # the colours show the motion itself, the drawn positions are exaggerated
        moved = shape.at(angle, blade) * factor
        mesh = ring.grid(sector, moved, scale / factor, blade * pitch)
        surface = ring.surface_of(mesh)
        if blade == 0:
            bar = ring.scalar_bar(f"displacement [{unit}]", "%.3g", small)
            limits = (0.0, largest * factor or 1.0)
            plotter.add_mesh(surface, scalars="displacement", cmap="viridis", clim=limits, scalar_bar_args=bar)
            plotter.add_mesh(ring.edges(surface), color="black", line_width=2.0 * small)
            ring.add_contacts(plotter, sector, mesh.points)
        else:
            ring.add_neighbour(plotter, surface)
    ring.add_outline(plotter, sector)
    ring.add_axes(plotter, sector, small)
    ring.name_faces(plotter, sector, 0.17, small)
    heading = f"{job.title}\n{shape.frequency_hz:.1f} Hz, drawn {_rounded(scale)} times as large"
    write_heading(plotter, heading, small)
    ring.aim_from_side(plotter, sector)
    plotter.reset_camera(bounds=_bounds(job, sector))  # the same in every frame


def _bounds(job: OperatingJob, sector: SectorMesh) -> list[float]:
    """Bounding box (x, y, z from and to, m) of the undeformed ring and of the drawn motion."""
    pitch = 2.0 * np.pi / sector.n_blades
    points = np.concatenate([ring.turned(sector.points, blade * pitch) for blade in ring.blades_of(job.blades)])
    low, high = points.min(axis=0) - 0.5 * job.deformation, points.max(axis=0) + 0.5 * job.deformation
    return np.column_stack([low, high]).ravel().tolist()


def _rounded(number: float) -> str:
    """Three digits, never with a power of ten."""
    return f"{float(f'{number:.3g}'):.10g}"


if __name__ == "__main__":
    drawing_main(draw, OperatingJob)
