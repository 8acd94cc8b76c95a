"""The output files of a run: response.h5, response.csv, curves.csv and summary.json, each replaced in one step."""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pipeline.codec import plain
from pipeline.results.frames import WHOLE, csv_names, number_columns, recorded_outputs, swept_columns
from pipeline.results.run_folder import TABLE_HASH
from pipeline.scene.units import column_name
from pipeline.stages.code_fingerprint import code_fingerprint
from pipeline.stages.curve.curve_file import ADDED, BRANCHES, cell_value
from pipeline.stages.curve.curve_summary import NO_RESIDUAL, NO_STATIC, NO_WORST
from pipeline.stages.curve.curve_table import TABLE, CurveTable, write_table
from pipeline.stages.curve.respond import CurveResult
from pipeline.store.content_store import Store
from pipeline.store.fingerprints import file_sha256, fingerprint
from pipeline.store.output_folder import relative_path

if TYPE_CHECKING:
    import h5py

    from pipeline.stages.curve.curve_summary import CurveSummary

_RESPONSE = ("response.h5", "response.csv", "curves.csv")
_KIND, _HASHES = "response", "sha256.json"  # kind of the store entry, and its file
LISTED = 1000  # curves that summary.json lists


def write_results(
    store: Store,
    out: Path,
    curves: Sequence[CurveResult],
    table: CurveTable,
    summary: dict[str, Any],
    provenance: Mapping[str, str],
    keep: bool = True,
) -> dict[str, str]:
    """Write response.h5, response.csv, curves.csv and summary.json, replaced together.

    Curves are read and written one by one, whatever their number. `keep`: the next run is to know these files.
    """
    key = _results_key(curves, table)
    there = _written_before(store, out, key)
    if there is not None:
        write_summary(store, out, summary | {"response": there})
        return there
    targets = [out / name for name in (*_RESPONSE, "summary.json")]
    with store.replacing(*targets) as (binary, points, rows, text):
        _write_binary(binary, curves, table, provenance)
        _write_points(points, curves, table)
        write_rows(rows, table)
        response = {path.name: file_sha256(path) for path in (binary, points, rows)}
        _write_summary(text, summary | {"response": response})
    if keep:
        with store.temporary() as folder:  # in place of an earlier entry: these files have another date
            (folder / _HASHES).write_text(json.dumps(response), encoding="utf-8")
            store.keep(_KIND, key, folder, 0.0)
    return response


def _results_key(curves: Sequence[CurveResult], table: CurveTable) -> str:
    """Hash of all that the files are made of; a file of a curve counts by its size and time."""
    entries = []
    for curve in curves:
        status = None if curve.file is None else curve.file.stat()
        place = None if curve.file is None or status is None else [str(curve.file.parent.name), status.st_size]
        entries.append([place, None if status is None else status.st_mtime_ns])
    return fingerprint({"curves": entries, "table": table.fingerprint(), "code": code_fingerprint(__name__)})


def _written_before(store: Store, out: Path, key: str) -> dict[str, str] | None:
    """SHA-256 of the files in the output folder, if an earlier run has written just these."""
    entry = store.find(_KIND, key)
    if entry is None or not all((out / name).is_file() for name in _RESPONSE):
        return None
    written: dict[str, str] = json.loads(entry.file(_HASHES).read_text(encoding="utf-8"))
    return written if {name: file_sha256(out / name) for name in _RESPONSE} == written else None


def _write_binary(
    path: Path, curves: Sequence[CurveResult], table: CurveTable, provenance: Mapping[str, str]
) -> None:
    """response.h5: the table of curves, and a group for every curve with a result."""
    import h5py

    from rom.files.hdf5 import new_hdf5

    with new_hdf5(path) as target:
        target.attrs["format"] = "1"
        target.attrs[TABLE_HASH] = table.fingerprint()
        for name, value in provenance.items():
            target.attrs[name] = value
        write_table(target.create_group(TABLE), table)
        groups = target.create_group("curve")
        for index, curve in enumerate(curves):
            if curve.file is not None:
                with h5py.File(curve.file, "r") as source:
                    source.copy(source["/"], groups, name=str(index))
                _complete(groups[str(index)], curve)


def _complete(group: h5py.Group, curve: CurveResult) -> None:
    """Add to the copied group of a curve what its file in the store does not know."""
    detached = curve.facts.detached if curve.facts else ()
    if detached:
        group.attrs["detached"] = json.dumps(list(detached))
    for number, branch in enumerate(detached, start=1):
        attributes = group[f"{BRANCHES}/{number}"].attrs
        attributes["born_between"] = json.dumps(branch["born_between"])
        attributes.pop(ADDED, None)  # of use in the store only
    # a cached curve may belong to another scene, which swept other keys
    for key, value in curve.member.parameters.items():
        if key not in group.attrs:
            group.attrs[key] = value


def _write_points(path: Path, curves: Sequence[CurveResult], table: CurveTable) -> None:
    """response.csv: a row for every point."""
    highest = max((curve.facts.harmonics for curve in curves if curve.facts), default=1)
    swept = tuple(table.parameters)
    names = csv_names(highest, recorded_outputs(curve.facts for curve in curves))
    with path.open("w", newline="", encoding="utf-8") as text:
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(csv_header(swept, names))
        for index, curve in enumerate(curves):
            head = [index, *(cell_value(curve.member.parameters[key]) for key in swept)]
            writer.writerows(_curve_rows(curve, head, names))


def write_rows(path: Path, table: CurveTable) -> None:
    """curves.csv: a row for every curve; a cell is empty where the number is not known."""
    columns = {column_name(key): values for key, values in swept_columns(table).items()} | number_columns(table)
    with path.open("w", newline="", encoding="utf-8") as text:
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(["curve", *columns])
        cells = [_cells(values.tolist()) for values in columns.values()]
        writer.writerows(zip(range(len(table)), *cells, strict=True))


def _cells(values: list[Any]) -> list[Any]:
    """A column as cells: true and false as 1 and 0, unknown numbers empty."""
    if values and isinstance(values[0], bool):
        return [int(value) for value in values]
    return ["" if isinstance(value, float) and math.isnan(value) else value for value in values]


def csv_header(swept: Iterable[str], names: Mapping[str, str]) -> list[str]:
    """Names of the columns of response.csv: curve, the swept keys, the quantities of a point, and its branch."""
    return ["curve", *(column_name(key) for key in swept), *names.values(), "branch"]


def _curve_rows(curve: CurveResult, head: list[Any], names: Iterable[str]) -> Iterator[list[Any]]:
    """The points of a curve and of its detached branches."""
    import h5py

    if curve.file is None:
        return
    with h5py.File(curve.file, "r") as source:
        yield from _rows(head, 0, source, names)
        for number in sorted(source.get(BRANCHES, ()), key=int):
            yield from _rows(head, int(number), source[f"{BRANCHES}/{number}"], names)


def _rows(head: list[Any], branch: int, source: h5py.Group, names: Iterable[str]) -> Iterator[list[Any]]:
    """The points of a curve (branch 0) or of one of its detached branches."""
    points = len(source["frequency_hz"])
    columns: list[list[Any]] = []
    for name in names:
        if name not in source:  # a curve with fewer harmonics than the others of its sweep
            columns.append([""] * points)
            continue
        values = source[name][()]
        columns.append(values.astype(int).tolist() if name in WHOLE else values.astype(float).tolist())
    for row in zip(*columns, strict=True):
        yield [*head, *row, branch]


# Keys of an entry of `curves` in summary.json by name, and their values where there is no curve.
_NUMBERS: dict[str, Any] = {
    **dict.fromkeys(("peak_frequency_hz", "peak_amplitude_m", "energy_error")),
    **dict.fromkeys(("truncation_error", "sampling_error", "sampling_frequency_error")),
    **dict.fromkeys(("truncation_branch", "truncation_frequency_hz", "motion_truncation_error")),
    "peak_at_end": False,
    "peak_stable": None,
    "points": 0,
    "iterations": 0,
    "seconds": 0.0,
    "harmonics": 0,
    "bifurcations": (),
    "detached": (),
    **{name: None for name in NO_WORST if name != "worst_index"},
    "free_nodes": None,
    **dict.fromkeys(NO_RESIDUAL),
    **dict.fromkeys(NO_STATIC),
    "mean_m": None,
}
# What is said of the search stands there even where no motion is known to persist.
_OF_SEARCH = (
    "worst_searched",
    "worst_unresolved",
    "worst_open_kinds",
    "worst_at_end",
    "worst_not_counted",
    "worst_truncation_error",
    "worst_unstable",
)


def curve_summary(curve: CurveResult, out: Path) -> dict[str, Any]:
    """One entry of `curves` in summary.json; what is not known is null."""
    found = {"harmonics": curve.member.scene.response.harmonics} if curve.facts is None else _known(curve.facts)
    numbers = {name: found.get(name, none) for name, none in _NUMBERS.items()}
    if curve.facts is not None and curve.facts.outputs:
        units = {output.name: output.unit for output in curve.member.scene.output}
        numbers["outputs"] = [{**item, "unit": units.get(item["name"], "m")} for item in curve.facts.outputs]
    if curve.facts is not None and curve.facts.interfaces:
        names = (each["name"] for each in curve.facts.interfaces)
        values = ({key: each[key] for key in each if key != "name"} for each in curve.facts.interfaces)
        numbers["interfaces"] = dict(zip(names, values, strict=True))
    entry = {
        "parameters": curve.member.parameters,
        "carried_from": list(curve.carried_from),
        "rom": None if curve.rom is None else relative_path(curve.rom, out),
        **numbers,
        "complete": curve.complete,
        "reason": curve.reason,
    }
    return {name: plain(value) for name, value in entry.items()}


def _known(facts: CurveSummary) -> dict[str, Any]:
    """The numbers of a curve that are known, by their keys in summary.json."""
    values = {
        **vars(facts),
        "iterations": facts.total_iterations,
        "truncation_branch": facts.truncation_branch or None,
    }
    unknown: set[str] = set()
    if not facts.worst_searched:
        unknown |= set(NO_WORST)
    elif not math.isfinite(facts.worst_amplitude_m):
        unknown |= set(NO_WORST) - set(_OF_SEARCH)
    if facts.free_nodes < 0:
        unknown.add("free_nodes")
    if not math.isfinite(facts.static_force_n):
        unknown |= set(NO_STATIC)
    if not math.isfinite(facts.mean_m):
        unknown.add("mean_m")
    return {name: value for name, value in values.items() if name not in unknown}


def write_summary(store: Store, out: Path, summary: dict[str, Any]) -> None:
    """summary.json, replaced in one step."""
    with store.replacing(out / "summary.json") as (path,):
        _write_summary(path, summary)


def as_json(summary: Any) -> str:
    """JSON text of plain values, as in the files and with `--json`; NaN is not allowed."""
    return json.dumps(summary, indent=1, allow_nan=False)


def _write_summary(path: Path, summary: dict[str, Any]) -> None:
    path.write_text(as_json(summary) + "\n", encoding="utf-8")
