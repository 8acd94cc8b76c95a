"""Numbers of curves and of points as columns with units: for CSV, pandas, xarray and notebooks."""

from __future__ import annotations

import html
import json
import math
from collections.abc import Iterable, Iterator, Sequence
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import InputError
from pipeline.results.tables import bare_value
from pipeline.scene.labels import prefixed, quantity
from pipeline.scene.sweep import grid_values
from pipeline.scene.units import column_name, key_unit, unit_of, with_unit
from pipeline.stages.curve.curve_file import AMPLITUDE, COLUMNS
from pipeline.stages.curve.curve_table import TUPLES, CurveTable, plain_value

if TYPE_CHECKING:
    import pandas
    import xarray

    from pipeline.results.curves import Curve
    from pipeline.stages.curve.curve_summary import CurveSummary


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


Array = NDArray[Any]
COUNTED = ("bifurcations", "detached")  # of which a column has the number
_HIDDEN = (*TUPLES, "peak_index", "worst_index", "solved", "carried_from")
_FIRST = ("worst_amplitude_m", "worst_frequency_hz", "peak_amplitude_m", "peak_frequency_hz")
_SHOWN = 10  # rows in a notebook


def number_columns(table: CurveTable) -> dict[str, Array]:
    """Columns (n,) with the numbers and words of n curves, by names that end with their units."""
    names = [*_FIRST, *(name for name in table.columns if name not in (*_FIRST, *_HIDDEN))]
    columns = {name: table.columns[name] for name in names}
    for name in COUNTED:
        columns[name] = np.array([0 if text == "[]" else len(json.loads(text)) for text in table.columns[name]], int)
    return columns


def swept_columns(table: CurveTable) -> dict[str, Array]:
    """Columns (n,) of the swept keys: numbers, words, or lists as text, by the dotted keys."""
    return {key: _cells(values) for key, values in table.parameters.items()}


def curves_frame(table: CurveTable | None) -> pandas.DataFrame:
    """A row for each curve."""
    frame = _optional("pandas").DataFrame
    if table is None:
        return frame()
    swept = {column_name(key): values for key, values in swept_columns(table).items()}
    found: pandas.DataFrame = frame({"curve": np.arange(len(table)), **swept, **number_columns(table)})
    return found


def points_frame(curves: Sequence[Curve], table: CurveTable | None) -> pandas.DataFrame:
    """A row for each point of each curve and its detached branches."""
    pandas = _optional("pandas")
    if table is None:
        return pandas.DataFrame()
    swept = {column_name(key): values for key, values in swept_columns(table).items()}
    highest = max((int(h) for h in table.columns["harmonics"]), default=1)
    names = csv_names(highest, recorded_outputs(table.summary_of(number) for number in range(len(table))))
    pieces = []
    for curve in curves:
        head = {"curve": curve.number} | {name: values[curve.number] for name, values in swept.items()}
        for branch, source in enumerate((curve, *curve.detached)):
            columns = {column: source.datasets.get(name) for name, column in names.items()}
            count = source.frequency_hz.size
            there = {name: np.full(count, np.nan) if values is None else values for name, values in columns.items()}
            pieces.append(pandas.DataFrame({**head, **there, "branch": branch}, index=range(count)))
    return pandas.concat(pieces, ignore_index=True) if pieces else pandas.DataFrame()


def curves_dataset(table: CurveTable | None) -> xarray.Dataset:
    """Labelled arrays: over the swept keys of a grid, otherwise over "curve"."""
    xarray = _optional("xarray")
    if table is None:
        return xarray.Dataset()
    swept, numbers = swept_columns(table), number_columns(table)
    numbers["curve"] = np.arange(len(table))
    axes = grid_values({key: values.tolist() for key, values in swept.items()})
    coordinates: dict[str, Any]
    data: dict[str, Any]
    if axes is None:
        coordinates = {key: ("curve", values, _units(key_unit(key))) for key, values in swept.items()}
        data = {name: ("curve", values, _units(unit_of(name))) for name, values in numbers.items() if name != "curve"}
        return xarray.Dataset(data, coords={**coordinates, "curve": numbers["curve"]})
    shape = [len(values) for values in axes.values()]
    indices = [np.array([places[v] for v in swept[key].tolist()]) for key, places in _indexed(axes)]
    order = np.ravel_multi_index(indices, shape)
    coordinates = {key: (key, values, _units(key_unit(key))) for key, values in axes.items()}
    data = {}
    for name, values in numbers.items():
        laid = np.empty(len(table), dtype=values.dtype)
        laid[order] = values
        data[name] = (tuple(axes), laid.reshape(shape), _units(unit_of(name)))
    return xarray.Dataset(data, coords=coordinates)


def html_rows(table: CurveTable) -> str:
    """The first curves as rows of an HTML table, in the units of the figures."""
    heights = table.heights[np.isfinite(table.heights)]
    factor, unit = prefixed(float(heights.max()) if heights.size else 0.0, "m")
    shown = {"worst_amplitude_m": f"worst motion [{unit}]", "worst_frequency_hz": "at [Hz]"}
    shown |= {"peak_amplitude_m": f"main peak [{unit}]", "peak_frequency_hz": "at [Hz]"}
    rows = [["curve", *(quantity(key).axis() for key in table.parameters), *shown.values()]]
    for number in range(min(len(table), _SHOWN)):
        values = [bare_value(key, value) for key, value in table.parameters_of(number).items()]
        numbers = [float(table.columns[name][number]) * (factor if name.endswith("_m") else 1.0) for name in shown]
        rows.append([str(number), *values, *(f"{value:.5g}" if math.isfinite(value) else "-" for value in numbers)])
    cells = [
        "".join(f"<{tag}>{html.escape(cell)}</{tag}>" for cell in row)
        for tag, row in zip(["th", *["td"] * (len(rows) - 1)], rows, strict=True)
    ]
    more = len(table) - _SHOWN
    lines = "".join(f"<tr>{row}</tr>" for row in cells)
    return f"<table>{lines}</table>" + (f"and {more} more: to_dataframe()" if more > 0 else "")


def _indexed(axes: dict[str, list[Any]]) -> Iterator[tuple[str, dict[Any, int]]]:
    yield from ((key, {value: place for place, value in enumerate(values)}) for key, values in axes.items())


def _units(unit: str) -> dict[str, str]:
    return {"units": unit} if unit else {}


def _cells(values: Array) -> Array:
    """Values of a swept key: words plain, lists as text."""
    if values.dtype != object:
        return values
    plain = [plain_value(text) for text in values]
    if all(isinstance(value, int | float) and not isinstance(value, bool) for value in plain):
        return np.array(plain, dtype=float)
    column = np.empty(len(values), dtype=object)
    column[:] = [json.dumps(value) if isinstance(value, list) else value for value in plain]
    return column


def _optional(name: str) -> Any:
    """A package that is no requirement of this one."""
    try:
        return import_module(name)
    except ImportError:
        raise InputError(f"the package {name} is missing: pip install 'shroud[tables]'") from None
