"""Columns of points: names in response.csv, which end with their units, for the datasets of response.h5."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from pipeline.scene.units import with_unit
from pipeline.stages.curve_file import AMPLITUDE, COLUMNS

if TYPE_CHECKING:
    from pipeline.stages.curve_summary import CurveSummary

_UNITS = {"growth_rate": "1/s"}  # of datasets whose names do not say it
WHOLE = ("stable", "sticking", "slipping", "separating", "iterations", "kept_harmonics", "growth_nodal_diameter")


def csv_names(harmonics: int, outputs: Sequence[str] = ()) -> dict[str, str]:
    """Names of the columns of a point by the names of its datasets, in their order; `outputs`: further ones."""
    first, *rest = (name for name in COLUMNS if name != "amplitude_m")
    names = [first, "amplitude_m", *(f"harmonic_{h + 1}_m" for h in range(harmonics)), *rest]
    known = {name: with_unit(name, _UNITS.get(name, "")) for name in names}
    return known | {f"{AMPLITUDE}{name}": f"{AMPLITUDE}{name}" for name in outputs}


def recorded_outputs(summaries: Iterable[CurveSummary | None]) -> tuple[str, ...]:
    """Names of the further outputs of some curves, each once."""
    found = [output["name"] for facts in summaries if facts is not None for output in facts.outputs]
    return tuple(dict.fromkeys(found))
