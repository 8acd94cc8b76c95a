"""Data of the interactive viewer: surfaces and shapes as compact arrays in base64."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pipeline.report.surface import Surface, outer_surface
from pipeline.scene.labels import prefixed
from pipeline.stages.build_mesh import SECTOR
from pipeline.stages.operating_shape import operating_shape

if TYPE_CHECKING:
    from geometry import SectorMesh
    from pipeline.scene.schema import Scene
    from pipeline.stages.model_chain import BuiltModel
    from pipeline.stages.respond import CurveResult

ROOM = 2_400_000  # characters for all shapes
MOST_MODELS = 3  # models with mode shapes
NEGLIGIBLE = 2e-3  # of the largest displacement: smaller harmonics are omitted
STEPS = 32_000  # range of a 16-bit integer


@dataclass
class ViewerData:
    """Surfaces and shapes collected so far; shapes that exceed `ROOM` are omitted and counted."""

    deformation: float = 0.08
    surfaces: list[dict[str, Any]] = field(default_factory=list)
    shapes: list[dict[str, Any]] = field(default_factory=list)
    left_out: int = 0
    _size: int = 0
    _known: dict[str, tuple[int, SectorMesh, Surface]] = field(default_factory=dict)

    def plain(self) -> dict[str, Any]:
        """The values for JSON."""
        return {"deformation": self.deformation, "surfaces": self.surfaces, "shapes": self.shapes}

    def add_modes(self, model: BuiltModel, scene: Scene, springs: dict[str, dict[str, Any]], label: str) -> None:
        """Mode shapes of a model; `springs`: for each contact condition the springs of the nodes, N/m."""
        from pipeline.render.mode_shapes import at_largest, mode_names_of
        from rom import inter_blade_phase, mode_shapes, read_reduced_model

        wanted = (1, 2, 3) if scene.render is None else scene.render.modes
        at, sector, surface = self._surface(model)
        reduced = read_reduced_model(model.rom)
        phase = inter_blade_phase(scene.excitation.engine_order, sector.n_blades)
        for state, values in springs.items():
            frequency, found = mode_shapes(reduced, phase, count=min(max(wanted), reduced.size), **values)
            names = mode_names_of(model.rom, (reduced, sector, phase), found, values)
            for mode in wanted:
                if mode <= len(frequency):
                    shape = at_largest(found[mode - 1][surface.vertices])
                    name = f"mode {mode} ({names[mode - 1]}), shrouds {state}, {frequency[mode - 1]:.1f} Hz{label}"
                    harmonics = np.stack([np.zeros_like(shape), shape])
                    self._add(name, "modes", at, phase, harmonics, None)

    def add_operating(self, model: BuiltModel, curve: CurveResult, name: str) -> None:
        """The motion at the peak of a curve, static part included, if it has a peak."""
        if curve.file is None:
            return
        at, sector, surface = self._surface(model)
        shape = operating_shape(curve.file, model.rom, len(sector.points))
        if shape is not None:
            label = f"{name}, {shape.frequency_hz:.1f} Hz"
            self._add(label, "motion at the peak", at, shape.phase, shape.harmonics[:, surface.vertices], "m")

    def _surface(self, model: BuiltModel) -> tuple[int, SectorMesh, Surface]:
        assert model.mesh is not None
        if model.key not in self._known:
            from rom import load_sector

            sector = load_sector(model.mesh.parent / SECTOR)
            surface = outer_surface(sector)
            self._known[model.key] = len(self.surfaces), sector, surface
            self.surfaces.append(_plain_surface(sector, surface))
        return self._known[model.key]

    def _add(
        self, name: str, group: str, surface: int, phase: float, harmonics: NDArray[np.complex128], unit: str | None
    ) -> None:
        """Add a shape; `unit` is that of the displacement, None for a mode shape, whose scale is arbitrary."""
        angles = 2.0 * np.pi * np.arange(96) / 96
        turns = np.exp(1j * np.outer(angles, np.arange(len(harmonics))))
        motion = np.real(np.tensordot(turns, harmonics, axes=1))
        sizes = np.linalg.norm(motion, axis=2).max(axis=1)
        largest, angle = float(sizes.max()), float(angles[np.argmax(sizes)])
        factor, shown = prefixed(largest, unit) if unit else (1.0, "")
        table = [
            {"order": order, **_quantised(values)}
            for order, values in enumerate(harmonics)
            if np.abs(values).max() > NEGLIGIBLE * largest
        ]
        size = sum(len(row["re"]) + len(row["im"]) for row in table)
        if self._size + size > ROOM:
            self.left_out += 1
            return
        self._size += size
        self.shapes.append(
            {
                "name": name,
                "group": group,
                "surface": surface,
                "phase": phase,
                "largest": largest,
                "angle": angle,
                "shown": f"{largest * factor:.3g} {shown}" if unit else "",
                "harmonics": table,
            }
        )


def chosen_evenly(count: int, most: int, also: Sequence[int] = ()) -> list[int]:
    """About `most` of `count` indices, evenly spread with both ends, and those of `also`."""
    if count <= most:
        return list(range(count))
    spread = np.linspace(0, count - 1, most).round().astype(int).tolist()
    return sorted({*spread, *also})


def _plain_surface(sector: SectorMesh, surface: Surface) -> dict[str, Any]:
    points = sector.points[surface.vertices]
    return {
        "points": _text(points.astype("<f4")),
        "triangles": _text(surface.triangles.astype("<u2")),
        "edges": _text(surface.edges.astype("<u2")),
        "sharp": _text(surface.sharp.astype("<u2")),
        "right": _text(surface.right.astype("<u2")),
        "left": _text(surface.left.astype("<u2")),
        "pitch": 2.0 * np.pi / sector.n_blades,
        "height": float(np.ptp(sector.points[:, 2])),
    }


def _quantised(values: NDArray[np.complex128]) -> dict[str, Any]:
    """Real and imaginary parts as 16-bit integers times one step, m."""
    step = float(max(np.abs(values.real).max(), np.abs(values.imag).max())) / STEPS
    parts = {"re": values.real, "im": values.imag}
    return {"step": step, **{name: _text(np.round(part / step).astype("<i2")) for name, part in parts.items()}}


def _text(array: NDArray[Any]) -> str:
    return base64.b64encode(np.ascontiguousarray(array).tobytes()).decode("ascii")
