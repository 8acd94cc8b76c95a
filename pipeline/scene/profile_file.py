"""The sections of an airfoil from a CSV file: blocks of lines, one for each section from the root to the tip."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from itertools import pairwise
from typing import TYPE_CHECKING

from pipeline.errors import InputError
from pipeline.scene.input_files import Contents, content_hash
from pipeline.scene.loads_section import check_readable, csv_columns

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from geometry.blade.profiles import ProfileStack

    Columns = dict[str, NDArray[np.float64]]

COLUMNS = ("section", "radius", "height", "x", "y", "z", "side")
HEIGHTS = ("radius", "height", "z")  # one of these
SIDES = {"suction": "1", "pressure": "0"}
ALLOWED = "x, y and one of radius, height and z; section with z; side where wanted"


def profile_stack_of(file: str, hub_radius: float, contents: Contents) -> ProfileStack:
    """The sections in a file as a stack; `hub_radius`, m, is where a column `height` begins. Raises InputError."""
    check_readable(file)
    return _stack(file, hub_radius, contents.get(file) or content_hash(file))


@lru_cache(maxsize=16)
def _stack(file: str, hub_radius: float, content: str) -> ProfileStack:
    from geometry.blade.profiles import profile_stack
    from geometry.errors import GeometryError

    columns = csv_columns(file, COLUMNS, {file: content}, SIDES)
    try:
        return profile_stack(file, [*_sections(file, columns, hub_radius)])
    except GeometryError as error:
        raise InputError(f"{file}: {error.allowed}") from None


def _sections(file: str, columns: Columns, hub_radius: float) -> Iterator[NDArray[np.float64]]:
    """Points (n, 3) of each section, round its outline: x, arc length at the radius of the point, radius, m."""
    import numpy as np

    heights = [name for name in HEIGHTS if name in columns]
    kind = "section" if "section" in columns else heights[0] if heights else ""
    if len(heights) != 1 or kind == "z" or not {"x", "y"} <= set(columns):
        raise InputError(f"{file}: columns {', '.join(columns)}, allowed: {ALLOWED}")
    number, x, y, radius = (columns[name] for name in (kind, "x", "y", heights[0]))
    if heights == ["z"]:
        radius, y = np.hypot(y, radius), np.hypot(y, radius) * np.arctan2(y, radius)
    elif heights == ["height"]:
        radius = radius + hub_radius
    if not (radius > 0.0).all():
        raise InputError(f"{file}: a radius of {radius.min():.6g} m, allowed: above 0")
    starts = [0, *(np.flatnonzero(np.diff(number)) + 1), len(number)]
    seen: set[float] = set()
    for first, last in pairwise(starts):
        if float(number[first]) in seen:
            told = f"{kind} {number[first]:.6g} again after another one"
            raise InputError(f"{file}: {told}, allowed: the lines of a section together, radii rising")
        seen.add(float(number[first]))
        points = np.stack([x, y, radius], axis=1)[first:last]
        yield points if "side" not in columns else _closed(points, columns["side"][first:last])


def _closed(points: NDArray[np.float64], side: NDArray[np.float64]) -> NDArray[np.float64]:
    """The outline of the points of two sides, each along x in either direction."""
    import numpy as np

    sides = [part for part in (points[side < 0.5], points[side > 0.5]) if len(part)]
    ahead = [part if part[0, 0] <= part[-1, 0] else part[::-1] for part in sides]
    return np.vstack([*ahead[:1], *(part[::-1] for part in ahead[1:])])
