"""Values of single parameters with which a blade and its shroud fit: the nearest accepted one that meshes."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from math import ceil, floor, log10
from typing import Any

import numpy as np

from geometry.blade.parameters import BladeParameters, ShroudParameters
from geometry.sector import FloatArray

ANGLE_STEPS = (5.0, 0.1)  # degrees: of the search, of suggested angles
SIGNIFICANT = 6  # digits of a suggested length where that is too coarse
LENGTH_STEP = 1e-5  # m: suggested lengths are multiples of it
BISECTIONS = 9
SECTION_STEPS = 60  # from the given section to one of a thousandth of its size
SENSIBLE, ANY = 0.4, 0.001  # smallest suggested lengths, relative to the given ones
LARGEST_FACTOR = 8.0  # of a length that has to grow
FURTHER = (0.0, 0.02, 0.05, 0.1, 0.2, 0.3)  # of an accepted length or number: how far beyond it a mesh is tried
ANGLES_FURTHER = (0.0, 1.0, 2.0, 4.0, 8.0)  # the same, degrees
BELOW = (0.97, 0.85, 0.6)  # of a largest value: where all of these are accepted as well, every lower one is

Accepts = Callable[[BladeParameters, ShroudParameters], bool]


@dataclass(frozen=True)
class Search:
    """Search for values of one parameter at a time."""

    # `blade`, `shroud`: the parameters that do not fit together
    blade: BladeParameters
    shroud: ShroudParameters
    accepts: Accepts  # whether a blade and a shroud pass all checks
    # whether a mesh can be made of a blade and a shroud that pass; much slower, asked of suggestions only
    meshes: Accepts
    least: float = SENSIBLE  # smallest length suggested, relative to the given one

    def works(self, table: str, parameter: str, value: float) -> bool:
        """Whether the parameters pass with this value."""
        return self.accepts(*self._with(table, parameter, value))

    def _with(self, table: str, parameter: str, value: float) -> tuple[BladeParameters, ShroudParameters]:
        change: dict[str, Any] = {parameter: value}
        if table == "blade":
            return replace(self.blade, **change), self.shroud
        return self.blade, replace(self.shroud, **change)

    def _meshing(self, table: str, parameter: str, values: Iterable[float]) -> float | None:
        """The first of some values that passes and can be meshed, or None."""
        for value in values:
            if self.works(table, parameter, value) and self.meshes(*self._with(table, parameter, value)):
                return value
        return None

    def all_below(self, table: str, parameter: str, value: float) -> bool:
        """Whether the parameters pass with lower values too, as far as a few of them tell."""
        lower = [factor * value for factor in BELOW]
        return all(self.works(table, parameter, int(v) if isinstance(value, int) else v) for v in lower)

    def largest(self, table: str, parameter: str, start: float) -> float | None:
        """A length below ``start`` (m), as large as possible, or None; printed with six digits it still works."""
        return self._length(table, parameter, start * np.linspace(1.0, self.least, 9), floor)

    def smallest(self, table: str, parameter: str, start: float) -> float | None:
        """A length above ``start`` (m), as small as possible, or None."""
        return self._length(table, parameter, np.geomspace(start, LARGEST_FACTOR * start, 9), ceil)

    def _length(self, table: str, parameter: str, samples: FloatArray, whole: Callable[[float], int]) -> float | None:
        found = next((k for k in range(1, len(samples)) if self.works(table, parameter, float(samples[k]))), None)
        if found is None:
            return None
        fails, works = float(samples[found - 1]), float(samples[found])
        for _ in range(BISECTIONS):
            middle = (fails + works) / 2
            fails, works = (fails, middle) if self.works(table, parameter, middle) else (middle, works)
        coarse = round(whole(works / LENGTH_STEP) * LENGTH_STEP, 12)
        for value in (coarse, rounded(works, SIGNIFICANT, whole)):
            if value > 0 and self.works(table, parameter, value):
                away = 1.0 if samples[-1] > samples[0] else -1.0
                further = (rounded(value * (1.0 + away * share), 4, whole) for share in FURTHER[1:])
                return self._meshing(table, parameter, (value, *further))
        return None

    def nearest_angle(self, table: str, parameter: str, limits: tuple[float, float]) -> float | None:
        """The angle between ``limits``, degrees, nearest to the given one that works, to 0.1 degrees; or None."""
        coarse, fine = ANGLE_STEPS
        start = float(getattr(self.blade if table == "blade" else self.shroud, parameter))
        found = self._first(table, parameter, _around(start, coarse, *limits))
        if found is None:
            return None
        works, fails = round(found / fine), round((found - coarse if found > start else found + coarse) / fine)
        fails = max(fails, round(start / fine)) if found > start else min(fails, round(start / fine))
        while abs(works - fails) > 1:
            middle = (works + fails) // 2
            works, fails = (
                (middle, fails) if self.works(table, parameter, round(middle * fine, 1)) else (works, middle)
            )
        away = fine if found > start else -fine
        values = (round(works * fine + away * round(step / fine), 1) for step in ANGLES_FURTHER)
        return self._meshing(table, parameter, (value for value in values if limits[0] <= value <= limits[1]))

    def _first(self, table: str, parameter: str, values: FloatArray) -> float | None:
        return next((float(value) for value in values if self.works(table, parameter, float(value))), None)

    def smaller_section(self) -> BladeParameters | None:
        """The blade with chord and thickness reduced alike until it works, or None."""
        names = ("chord", "thickness", "tip_thickness")
        sizes = {name: getattr(self.blade, name) for name in names if getattr(self.blade, name) is not None}
        for factor in np.geomspace(1.0, ANY, SECTION_STEPS)[1:]:
            reduced: dict[str, Any] = {name: rounded(size * factor, 3, floor) for name, size in sizes.items()}
            blade = replace(self.blade, **reduced)
            if self.accepts(blade, self.shroud) and self.meshes(blade, self.shroud):
                return blade
        return None

    def fewer_blades(self) -> int | None:
        """The largest number of blades below the given one that works, or None."""
        low, high = 3, self.blade.n_blades
        if high <= low or not self.works("blade", "n_blades", low):
            return None
        while high - low > 1:
            middle = (low + high) // 2
            low, high = (middle, high) if self.works("blade", "n_blades", middle) else (low, middle)
        count = self._meshing("blade", "n_blades", (max(3, int(low * (1.0 - share))) for share in FURTHER))
        return None if count is None else int(count)


def rounded(number: float, digits: int, whole: Callable[[float], int]) -> float:
    """A number with so many significant digits, rounded by ``floor`` or ``ceil``."""
    if number <= 0:
        return number
    places = digits - 1 - floor(log10(number))
    return float(f"{whole(number * 10.0**places) / 10.0**places:.{digits}g}")


def _around(start: float, step: float, low: float, high: float) -> FloatArray:
    """Multiples of ``step`` from ``low`` to ``high``, the nearest to ``start`` first."""
    values = np.round(np.arange(np.ceil(low / step), np.floor(high / step) + 1) * step, 1)
    return values[np.argsort(np.abs(values - start), kind="stable")]
