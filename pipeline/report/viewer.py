"""Data of the interactive viewer: surfaces and shapes as compact arrays in base64.

The outer surface of a mesh is a set of triangles, coarsened by vertex clustering where it is fine.
"""

from __future__ import annotations

import base64
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pipeline.render.operating_shapes import OperatingShape, operating_shape
from pipeline.scene.labels import prefixed
from pipeline.stages.model.build_mesh import SECTOR

if TYPE_CHECKING:
    from geometry.elements import ElementBlock
    from geometry.sector import FacePair, SectorMesh
    from pipeline.scene.schema import Scene
    from pipeline.stages.curve.respond import CurveResult
    from pipeline.stages.model.model_chain import BuiltModel


Array = NDArray[np.float64]
Indices = NDArray[np.int64]
MOST_TRIANGLES = 6000
SHARP = np.cos(np.radians(30.0))  # of the angle between the normals on both sides of a drawn edge
# triangles of a side by its nodes: corners, then the mid-side node after each corner
_TRIANGLES = {
    3: ((0, 1, 2),),
    4: ((0, 1, 2), (0, 2, 3)),
    6: ((0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5)),
    8: ((0, 4, 7), (4, 1, 5), (5, 2, 6), (6, 3, 7), (4, 5, 6), (4, 6, 7)),
}


@dataclass(frozen=True)
class Surface:
    """Triangles on vertices of the mesh."""

    vertices: Indices  # (n,), rows of the points of the mesh; the last ones are the right and the left contact nodes
    triangles: Indices  # (t, 3), rows of `vertices`, as in the next four
    edges: Indices  # (e, 2), edges of the mesh; none where it was coarsened
    sharp: Indices  # (s, 2), sharp edges
    # `right`, `left`: (n_c,), contact nodes
    right: Indices
    left: Indices


def outer_surface(sector: SectorMesh, most: int = MOST_TRIANGLES) -> Surface:
    """The boundary of the mesh with at most `most` triangles; a finer one is coarsened by vertex clustering."""
    sides = boundary_sides(sector.blocks)
    triangles = _triangles(sides)
    edges = _unique_edges(np.concatenate([_outline(side) for side in sides]))
    if len(triangles) > most:
        triangles = _clustered(sector.points, triangles, most)
        edges = np.empty((0, 2), dtype=np.int64)  # the edges of the mesh are lost
    sharp = sharp_edges(sector.points, triangles)
    used = np.unique(triangles)
    row = np.full(len(sector.points), -1)
    row[used] = np.arange(len(used))
    pairs: list[SectorMesh | FacePair] = [sector, *sector.pairs.values()]
    right, left = [pair.right.nodes for pair in pairs], [pair.left.nodes for pair in pairs]
    n_c = sum(map(len, right))
    contacts = len(used) + np.arange(2 * n_c)
    vertices = np.concatenate([used, *right, *left])
    return Surface(vertices, row[triangles], row[edges], row[sharp], contacts[:n_c], contacts[n_c:])


def triangles_of(blocks: tuple[ElementBlock, ...]) -> Indices:
    """The boundary of elements as triangles (t, 3), anticlockwise from outside."""
    return _triangles(boundary_sides(blocks))


def _triangles(sides: list[Indices]) -> Indices:
    return np.concatenate([side[:, list(corners)] for side in sides for corners in _TRIANGLES[side.shape[1]]])


def boundary_sides(blocks: tuple[ElementBlock, ...]) -> list[Indices]:
    """Sides that belong to one element only, anticlockwise from outside, grouped by their number of nodes.

    Each group (s, n) has the corners first and then the mid-side nodes between each corner and the next.
    """
    groups: dict[int, list[Indices]] = {}
    for block in blocks:
        for side in range(len(block.topology.sides)):
            nodes = list(block.topology.side_nodes(side))
            groups.setdefault(len(nodes), []).append(block.nodes[:, nodes])
    found = []
    for count, parts in sorted(groups.items()):
        sides = _in_element_order(parts, blocks)
        corners = np.sort(sides[:, : 3 if count in (3, 6) else 4], axis=1)
        _, first, times = np.unique(corners, axis=0, return_index=True, return_counts=True)
        found.append(sides[np.sort(first[times == 1])])
    return found


def _in_element_order(parts: list[Indices], blocks: tuple[ElementBlock, ...]) -> Indices:
    """Sides of one block element by element, as they were stored before; of several blocks one after the other."""
    together: Indices = (
        np.concatenate(parts) if len(blocks) > 1 else np.stack(parts, axis=1).reshape(-1, parts[0].shape[1])
    )
    return together


def _outline(sides: Indices) -> Indices:
    """Edges (e, 2) around sides (s, n), mid-side nodes included."""
    n = sides.shape[1]
    corners = n if n in (3, 4) else n // 2
    around = sides[:, np.arange(n).reshape(-1, corners).T.ravel()]
    return np.stack([around, np.roll(around, -1, axis=1)], axis=2).reshape(-1, 2)


def sharp_edges(points: Array, triangles: Indices) -> Indices:
    """Edges (s, 2) with an angle between the adjacent normals above that of `SHARP`, or with one triangle only."""
    corners = points[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    edges = np.sort(np.concatenate([triangles[:, [k, (k + 1) % 3]] for k in range(3)]), axis=1)
    unique, place, count = np.unique(edges, axis=0, return_inverse=True, return_counts=True)
    total = np.zeros((len(unique), 3))
    np.add.at(total, place.ravel(), np.tile(normals, (3, 1)))
    # |n1 + n2|^2 = 2 + 2 cos
    cosine = np.sum(total**2, axis=1) / 2.0 - 1.0
    found: Indices = unique[(count != 2) | (cosine < SHARP)]
    return found


def _unique_edges(edges: Indices) -> Indices:
    found: Indices = np.unique(np.sort(edges, axis=1), axis=0)
    return found


def _clustered(points: Array, triangles: Indices, most: int) -> Indices:
    """Triangles between the representatives of the cells of a lattice, just coarse enough."""
    used = np.unique(triangles)
    corners = points[triangles]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum() / 2.0
    cell = float(np.sqrt(area / most))
    # corners and sharp edges are preferred as representatives, otherwise the outline would be ragged
    sharp = np.bincount(sharp_edges(points, triangles).ravel(), minlength=len(points))
    rank = np.where(sharp >= 3, 2, np.where(sharp > 0, 1, 0))[used]
    while True:
        kept = _merged(points, triangles, used, rank, cell)
        if len(kept) <= most:
            return kept
        cell *= 1.15


def _merged(points: Array, triangles: Indices, used: Indices, rank: Indices, cell: float) -> Indices:
    """Triangles between the vertices that stand for their cells: of the highest rank, nearest to the cell's mean."""
    places = np.floor((points[used] - points[used].min(axis=0)) / cell).astype(np.int64)
    _, member = np.unique(places, axis=0, return_inverse=True)
    member = member.ravel()
    count = np.bincount(member)
    centre = np.stack([np.bincount(member, points[used, k]) / count for k in range(3)], axis=1)
    order = np.lexsort((np.linalg.norm(points[used] - centre[member], axis=1), -rank, member))
    first = np.searchsorted(member[order], np.arange(len(count)))
    representative = np.zeros(len(points), dtype=np.int64)
    representative[used] = used[order[first]][member]
    moved = representative[triangles]
    whole = (moved[:, 0] != moved[:, 1]) & (moved[:, 1] != moved[:, 2]) & (moved[:, 2] != moved[:, 0])
    moved = moved[whole]
    _, first_of = np.unique(np.sort(moved, axis=1), axis=0, return_index=True)
    kept: Indices = moved[np.sort(first_of)]
    return kept


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
        from pipeline.render.mode_shapes import WITHOUT_CORIOLIS, at_largest, named_shapes
        from pipeline.stages.scene_to_solver import coriolis_acts
        from rom.cyclic.cyclic_symmetry import inter_blade_phase
        from rom.files.reduced_model_file import read_reduced_model

        wanted = (1, 2, 3) if scene.render is None else scene.render.modes
        at, sector, surface = self._surface(model)
        reduced = read_reduced_model(model.rom)
        phase = inter_blade_phase(scene.excitation.engine_order, sector.n_blades)
        label = (f" {WITHOUT_CORIOLIS}" if coriolis_acts(scene, reduced) else "") + label
        for state, values in springs.items():
            count = min(max(wanted), reduced.size)
            frequency, found, names = named_shapes(model.rom, reduced, phase, count, values)
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

    def add_motion(self, points: Array, surface: Surface, ring: tuple[int, str], motion: OperatingShape) -> None:
        """The motion of a surface whose vertices lie at `points` (n, 3); `ring`: blades, and kind of the sector."""
        name, at = f"{motion.frequency_hz:.5g} Hz", len(self.surfaces)
        self.surfaces.append(_plain_surface(points, surface, *ring))
        self._add(name, "motion", at, motion.phase, motion.harmonics, "m")

    def _surface(self, model: BuiltModel) -> tuple[int, SectorMesh, Surface]:
        assert model.mesh is not None
        if model.key not in self._known:
            from rom.files.sector_file import load_sector

            sector = load_sector(model.mesh.parent / SECTOR)
            surface = outer_surface(sector)
            self._known[model.key] = len(self.surfaces), sector, surface
            self.surfaces.append(
                _plain_surface(sector.points[surface.vertices], surface, sector.n_blades, sector.kind)
            )
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


def _plain_surface(points: Array, surface: Surface, n_blades: int, kind: str) -> dict[str, Any]:
    """A surface whose vertices lie at `points` (n, 3)."""
    return {
        "points": _text(points.astype("<f4")),
        "triangles": _text(surface.triangles.astype("<u2")),
        "edges": _text(surface.edges.astype("<u2")),
        "sharp": _text(surface.sharp.astype("<u2")),
        "right": _text(surface.right.astype("<u2")),
        "left": _text(surface.left.astype("<u2")),
        "pitch": 2.0 * np.pi / n_blades,
        "between": kind == "neighbours",
        "height": float(np.ptp(points[:, 2])),
    }


def _quantised(values: NDArray[np.complex128]) -> dict[str, Any]:
    """Real and imaginary parts as 16-bit integers times one step, m."""
    step = float(max(np.abs(values.real).max(), np.abs(values.imag).max())) / STEPS
    parts = {"re": values.real, "im": values.imag}
    return {"step": step, **{name: _text(np.round(part / step).astype("<i2")) for name, part in parts.items()}}


def _text(array: NDArray[Any]) -> str:
    return base64.b64encode(np.ascontiguousarray(array).tobytes()).decode("ascii")
