"""Table of the curves in response.h5: a column for every number of a curve's summary, a row for every curve.

With it many curves are opened and compared without their points.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pipeline.codec import attributes_of, from_attributes
from pipeline.stages.curve.curve_summary import CurveSummary
from pipeline.store.fingerprints import content_fingerprint
from pipeline.store.output_folder import relative_path

if TYPE_CHECKING:
    import h5py

    from pipeline.stages.curve.respond import CurveResult


NOT_COMPUTED = "not computed"  # reason of a curve that a run did not, or has not yet, come to
TABLE = "table"  # group in response.h5
_PARAMETERS = "parameters"
Array = NDArray[Any]
_DTYPES: dict[str, Any] = {"float": np.float64, "int": np.int64, "bool": np.bool_}
_TYPES = {field.name: str(field.type) for field in fields(CurveSummary)}
_NONE: dict[str, Any] = {"float": float("nan"), "int": 0, "bool": False, "str": ""}  # of a curve without a result
TUPLES = tuple(name for name, kind in _TYPES.items() if kind not in _NONE)  # as JSON texts in the table


_OTHERS = ("solved", "rom", "carried_from")  # columns that are no fields of the summary


class LazyArrays(Mapping[str, Array]):
    """Arrays of an HDF5 group by the names of its datasets, each read when it is first asked for."""

    def __init__(self, names: Sequence[str], read: Callable[[str], Array]) -> None:
        self._names, self._read = dict.fromkeys(names), read
        self._known: dict[str, Array] = {}

    def __reduce__(self) -> tuple[Any, ...]:
        return dict, (dict(self),)

    def __getitem__(self, name: str) -> Array:
        if name not in self._names:
            raise KeyError(name)
        if name not in self._known:
            self._known[name] = self._read(name)
        return self._known[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)

    def __repr__(self) -> str:
        return f"<arrays {', '.join(self._names)}>"


@dataclass(frozen=True, repr=False, eq=False)
class CurveTable:
    """Numbers of n curves."""

    # (n,), the fields of `CurveSummary` (those of `TUPLES` as JSON texts), `solved` (whether there is a result),
    # `rom` (file of the reduced model, relative to the output folder, "" without) and `carried_from` (JSON text)
    columns: Mapping[str, Array]
    # (n,), the swept keys with their values: numbers, or JSON texts where not all are
    parameters: Mapping[str, Array]

    def __len__(self) -> int:
        return len(self.columns["solved"])

    def __repr__(self) -> str:
        return f"<table of {len(self)} curves over {', '.join(self.parameters) or 'no keys'}>"

    def parameters_of(self, curve: int) -> dict[str, Any]:
        """The swept keys with their values on a curve, as the scene has them."""
        return {key: plain_value(values[curve]) for key, values in self.parameters.items()}

    def summary_of(self, curve: int) -> CurveSummary | None:
        """The summary of a curve; None without a result."""
        return self.row(curve) if self.columns["solved"][curve] else None

    def row(self, curve: int) -> CurveSummary:
        """The numbers of a curve; without a result nan, zeros and empty texts, and the reason."""
        return from_attributes(CurveSummary, {name: self.columns[name][curve] for name in _TYPES})

    @property
    def lower_bounds(self) -> NDArray[np.bool_]:
        """Whether the height of each curve may be higher: an end of the range, or an open search; (n,)."""
        worst = self.columns["worst_amplitude_m"]
        at_end = np.where(np.isfinite(worst), self.columns["worst_at_end"], self.columns["peak_at_end"]).astype(bool)
        found: NDArray[np.bool_] = at_end | np.array([bool(said) for said in self.columns["worst_unresolved"]], bool)
        return found

    @property
    def heights(self) -> Array:
        """Worst motion of each curve, m; where it is not known the peak of the main branch; nan without either."""
        worst = self.columns["worst_amplitude_m"]
        return np.where(np.isfinite(worst), worst, self.columns["peak_amplitude_m"])

    def fingerprint(self) -> str:
        """Hash of all columns."""
        columns = {**self.columns, **{f"{_PARAMETERS}/{key}": values for key, values in self.parameters.items()}}
        parts = [f"{name}\0".encode() + _as_bytes(values) for name, values in sorted(columns.items())]
        return content_fingerprint(b"\0".join(parts))


def plain_value(value: Any) -> Any:
    """A value of a parameter's column as the scene has it."""
    return json.loads(value) if isinstance(value, str) else _plain(value)


def table_of(curves: Sequence[CurveResult], swept: Sequence[str], out: Path) -> CurveTable:
    """The table of the curves of a run with the output folder `out`."""
    rows = [_row(curve) for curve in curves]
    columns = {name: _column(kind, [row[name] for row in rows]) for name, kind in _TYPES.items()}
    columns["solved"] = np.array([curve.facts is not None for curve in curves], dtype=bool)
    names = {rom: "" if rom is None else relative_path(rom, out) for rom in {curve.rom for curve in curves}}
    columns["rom"] = _column("str", [names[curve.rom] for curve in curves])
    columns["carried_from"] = _column("str", [json.dumps(list(curve.carried_from)) for curve in curves])
    return CurveTable(columns, {key: _swept([curve.member.parameters[key] for curve in curves]) for key in swept})


def write_table(group: h5py.Group, table: CurveTable) -> None:
    """Write the table into a group."""
    for name, values in table.columns.items():
        _write(group, name, values)
    parameters = group.create_group(_PARAMETERS, track_order=True)
    for key, values in table.parameters.items():
        _write(parameters, key, values)


def read_table(group: h5py.Group) -> CurveTable:
    """The table in a group; columns are read when they are first asked for."""
    parameters = group[_PARAMETERS]
    count = len(group["solved"])

    def column(name: str) -> Array:
        if name in group:
            return _read(group[name])
        if name == "peak_at_end":  # files of earlier versions
            return ~_read(group["peak_located"])
        none = _NONE.get(_TYPES[name], "[]")
        return np.full(count, none, dtype=object if isinstance(none, str) else None)

    columns = LazyArrays([*_TYPES, *_OTHERS], column)
    return CurveTable(columns, LazyArrays(list(parameters), lambda key: _read(parameters[key])))


def _row(curve: CurveResult) -> dict[str, Any]:
    """The summary of a curve as the table holds it."""
    if curve.facts is None:
        return {name: _NONE.get(kind, "[]") for name, kind in _TYPES.items()} | {"reason": curve.reason}
    return attributes_of(curve.facts)


def _column(kind: str, values: list[Any]) -> Array:
    if kind in _DTYPES:
        return np.array(values, dtype=_DTYPES[kind])
    column = np.empty(len(values), dtype=object)
    column[:] = values
    return column


def _swept(values: list[Any]) -> Array:
    """Values of a swept key: whole numbers, numbers, or JSON texts."""
    kinds = {type(value) for value in values}
    if kinds <= {int} and all(abs(value) < 2**63 for value in values):
        return np.array(values, dtype=np.int64)
    if kinds <= {int, float}:
        return np.array(values, dtype=float)
    return _column("str", [json.dumps(value) for value in values])


def _write(group: h5py.Group, name: str, values: Array) -> None:
    import h5py

    dtype = h5py.string_dtype() if values.dtype == object else values.dtype
    group.create_dataset(name, data=values, dtype=dtype, track_times=False)


def _read(item: Any) -> Array:
    import h5py

    found: Array = item.asstr()[()] if h5py.check_string_dtype(item.dtype) else item[()]
    return found


def _as_bytes(values: Array) -> bytes:
    return "\0".join(values).encode() if values.dtype == object else np.ascontiguousarray(values).tobytes()


def _plain(value: Any) -> Any:
    return value.item() if hasattr(value, "item") else value
