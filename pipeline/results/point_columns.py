"""Columns of points: names in response.csv, which end with their units, for the datasets of response.h5."""

from __future__ import annotations

from pipeline.scene.units import with_unit
from pipeline.stages.curve_file import COLUMNS

_UNITS = {"growth_rate": "1/s"}  # of datasets whose names do not say it
WHOLE = ("stable", "sticking", "slipping", "separating", "iterations", "kept_harmonics", "growth_nodal_diameter")


def csv_names(harmonics: int) -> dict[str, str]:
    """Names of the columns of a point by the names of its datasets, in their order."""
    first, *rest = (name for name in COLUMNS if name != "amplitude_m")
    names = [first, "amplitude_m", *(f"harmonic_{h + 1}_m" for h in range(harmonics)), *rest]
    return {name: with_unit(name, _UNITS.get(name, "")) for name in names}
