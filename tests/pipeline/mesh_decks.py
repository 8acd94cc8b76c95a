"""Small decks of bricks in mm, t, s about the engine axis z, as another program would write them."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

STEEL = "*MATERIAL, NAME=steel\n*ELASTIC\n210000., .3\n*DENSITY\n7.85e-9\n*SOLID SECTION, ELSET=all, MATERIAL=steel\n"
_CORNERS = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))
Ends = tuple[float, float]


@dataclass(frozen=True)
class Body:
    """Bricks between two radii, angles (degrees) and axial places, so many along each."""

    radius: Ends
    angle: Ends
    axial: Ends
    divisions: tuple[int, int, int]


def write_deck(
    path: Path, bodies: list[Body], sets: Mapping[str, Callable[..., np.ndarray]], *, joined: bool = False
) -> Path:
    """A deck; `sets`: node sets, each by a function of body, radius, angle in degrees and axial place of a node.

    Nodes of different bodies at one place are one where the bodies are `joined`.
    """
    rows, cells, start = [], [], 0
    for number, body in enumerate(bodies):
        ends = (body.radius, body.angle, body.axial)
        lines = [np.linspace(*each, n + 1) for each, n in zip(ends, body.divisions, strict=True)]
        grid = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1)
        index = start + np.arange(grid[..., 0].size).reshape(grid.shape[:3])
        n = body.divisions
        cells.append(
            np.stack([index[i : i + n[0], j : j + n[1], k : k + n[2]].ravel() for i, j, k in _CORNERS], axis=1)
        )
        rows.append(np.column_stack([np.full(grid[..., 0].size, number), grid.reshape(-1, 3)]))
        start += grid[..., 0].size
    table = np.concatenate(rows)
    if joined:
        _, first, place = np.unique(table[:, 1:].round(6), axis=0, return_index=True, return_inverse=True)
        table, cells = table[first], [place.ravel()[each] for each in cells]
    body, radius, angle, axial = table.T
    turn = np.radians(angle)
    text = "*NODE\n" + "".join(
        f"{k}, {r * np.cos(t):.12g}, {r * np.sin(t):.12g}, {z:.12g}\n"
        for k, (r, t, z) in enumerate(zip(radius, turn, axial, strict=True), 1)
    )
    text += "*ELEMENT, TYPE=C3D8, ELSET=all\n"
    for k, cell in enumerate(np.concatenate(cells), 1):
        text += f"{k}, " + ", ".join(map(str, cell + 1)) + "\n"
    for name, chosen in sets.items():
        nodes = np.flatnonzero(chosen(body, radius, angle, axial)) + 1
        text += f"*NSET, NSET={name}\n" + ",\n".join(map(str, nodes)) + "\n"
    path.write_text(text + STEEL)
    return path
