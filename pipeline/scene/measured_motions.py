"""Measured motions of [identify]: rows of a CSV file, curves of a universal file, tables of the scene."""

from __future__ import annotations

import contextlib
import csv
import importlib.util
import io
import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pydantic import ValidationError

from pipeline.errors import InputError, reason_of, shown, system_reason
from pipeline.scene.fields import allowed_of
from pipeline.scene.input_files import csv_rows, decimal_point, read_bytes
from pipeline.scene.sweep import column_name, swept_keys
from pipeline.studies.identify.section import MOST_MEASURED, MeasuredMotion

if TYPE_CHECKING:
    from pipeline.scene.schema import Scene

AMPLITUDES = {  # columns of amplitudes: unit and factor to it
    "amplitude_m": ("m", 1.0),
    "amplitude_mm": ("m", 1e-3),
    "amplitude_um": ("m", 1e-6),
    "strain": ("1", 1.0),
    "microstrain": ("1", 1e-6),
}
NUMBERS = {  # other columns of numbers and the keys of [[identify.measured]]
    "frequency_hz": "frequency",
    "amplitude_deviation": "amplitude_deviation",
    "frequency_deviation_hz": "frequency_deviation",
    "rate_hz_per_s": "rate",
}
WORDS = ("output", "curve")
COLUMNS = f"{', '.join((*NUMBERS, *WORDS))}, one of {', '.join(AMPLITUDES)}, or a key of the scene"
UNIVERSAL = (".uff", ".unv")
MOST_POINTS, LOWEST = 25, 0.3  # of a curve of a universal file: points at most, and above which part of the highest
FUNCTION_58, RESPONSE_FUNCTION, UNKNOWN, FREQUENCY = 58, 4, 0, 18
OVER_OMEGA = {UNKNOWN: 0, 8: 0, 11: 1, 12: 2}  # kind of the ordinate: unknown, displacement, velocity, acceleration
FORCE = "excitation.force"
LARGEST = 1e6  # m


def measured_motions(scene: Scene) -> tuple[MeasuredMotion, ...]:
    """All measured motions of a scene, those of its file first. Raises InputError."""
    section = scene.identify
    assert section is not None  # the study is asked for
    if section.data is None:
        return section.measured
    universal = Path(section.data).suffix.lower() in UNIVERSAL
    rows = _universal(scene, section.data) if universal else _csv(scene, section.data)
    found = (*rows, *section.measured)
    if len(found) > MOST_MEASURED:
        raise _refused(section.data, f"{len(found)} rows", f"{MOST_MEASURED} at most")
    return found


def _csv(scene: Scene, file: str) -> list[MeasuredMotion]:
    try:
        text = read_bytes(file, scene.contents).decode("utf-8-sig")
        rows = [(number, [cell.strip() for cell in row]) for number, row in csv_rows(text) if any(row)]
    except OSError as error:
        raise _refused(file, f"cannot be read: {system_reason(error)}", "a CSV file") from None
    except (UnicodeDecodeError, csv.Error) as error:
        raise _refused(file, f"not CSV: {reason_of(error)}", "a CSV file in UTF-8") from None
    return motions_of_rows(scene, file, rows)


def motions_of_rows(scene: Scene, file: str, rows: Sequence[tuple[int, list[str]]]) -> list[MeasuredMotion]:
    """Measured motions of numbered rows, the names of the columns in front. Raises InputError."""
    if len(rows) < 2:
        raise _refused(file, "no rows", f"a line of column names ({COLUMNS}), then a line for each measured motion")
    keys = [_key(file, name) for name in rows[0][1]]
    _check_columns(file, rows[0][1], keys)
    units = {item.name: item.unit for item in scene.output}
    whole = _whole(file, rows[1:], len(keys))
    return [_motion(file, number, dict(zip(keys, cells, strict=True)), units) for number, cells in whole]


def _whole(file: str, rows: Sequence[tuple[int, list[str]]], count: int) -> Iterator[tuple[int, list[str]]]:
    for number, cells in rows:
        if len(cells) != count:
            allowed = f"{count}, one for each column; decimal commas only with semicolons between"
            raise _refused(file, f"line {number}: {len(cells)} values", allowed)
        yield number, cells


def _key(file: str, name: str) -> str:
    """The column as it is called here; a key of the scene with its dot."""
    low = name.lower()
    if low in AMPLITUDES or low in NUMBERS or low in WORDS:
        return low
    found = next((key for key in swept_keys(name) if name in (key, column_name(key))), None)
    if found is None:
        raise _refused(file, f"column {shown(name)}", COLUMNS)
    return found


def _check_columns(file: str, names: Sequence[str], keys: Sequence[str]) -> None:
    if len(set(keys)) < len(keys):
        raise _refused(file, "a column twice", "each column once")
    if "frequency_hz" not in keys:
        raise _refused(file, f"columns {', '.join(names)}", "frequency_hz among them (Hz)")
    amplitudes = [key for key in keys if key in AMPLITUDES]
    if len(amplitudes) != 1:
        raise _refused(file, f"{len(amplitudes)} columns of amplitudes", f"one of {', '.join(AMPLITUDES)}")


def _motion(file: str, number: int, cells: Mapping[str, str], units: Mapping[str, str]) -> MeasuredMotion:
    """A row as a table of the scene; empty cells are left out."""
    values: dict[str, Any] = {}
    at: dict[str, Any] = {}
    for key, cell in cells.items():
        if cell == "":
            continue
        if key in AMPLITUDES:
            unit, factor = AMPLITUDES[key]
            known = units.get(cells.get("output", ""), "m")
            if known != unit:
                allowed = " or ".join(name for name, (own, _) in AMPLITUDES.items() if own == known)
                output = cells.get("output") or "the default output"
                raise _refused(file, f"line {number}: {key} of {output}", allowed)
            values["amplitude"] = _number(file, number, key, cell) * factor
        elif key in NUMBERS:
            values[NUMBERS[key]] = _number(file, number, key, cell)
        elif key in WORDS:
            values[key] = cell
        else:
            at[key] = _value(cell)
    try:
        return MeasuredMotion(**values, at=at)
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(map(str, first["loc"]))
        found = shown(first.get("input")) if first["type"] != "missing" else "missing"
        allowed = allowed_of(MeasuredMotion, str(first["loc"][0]))
        raise _refused(file, f"line {number}: {place}: {found}", allowed) from None


def _number(file: str, number: int, key: str, cell: str) -> float:
    with contextlib.suppress(ValueError):
        value = float(decimal_point(cell))
        if math.isfinite(value) and "_" not in cell:  # 1_0 is 10 in Python alone
            return value
    raise _refused(file, f"line {number}: {key}: {shown(cell)}", "a number")


def _value(cell: str) -> Any:
    for kind in (int, float) if "_" not in cell else ():
        with contextlib.suppress(ValueError):
            return kind(decimal_point(cell))
    return cell


def _universal(scene: Scene, file: str) -> list[MeasuredMotion]:
    """Points near the top of each curve, data set 58; of a response function times the force of the scene."""
    if importlib.util.find_spec("pyuff") is None:
        raise _refused(file, "needs the package pyuff", "pip install 'shroud[uff]', or a CSV file")
    import pyuff

    try:
        with contextlib.redirect_stdout(io.StringIO()):
            sets = pyuff.UFF(file).read_sets()
    except Exception as error:  # whatever its reader meets
        raise _refused(file, f"no universal file: {reason_of(error)}", "data sets 58") from None
    curves = [item for item in (sets if isinstance(sets, list) else [sets]) if item.get("type") == FUNCTION_58]
    curves = [item for item in curves if item["abscissa_spec_data_type"] in (UNKNOWN, FREQUENCY)]
    for number, item in enumerate(curves):
        if item["ordinate_spec_data_type"] not in OVER_OMEGA:
            kind = f"ordinates of kind {item['ordinate_spec_data_type']} in curve {number + 1}"
            raise _refused(file, kind, "displacements, velocities or accelerations (8, 11, 12)")
    force = scene.excitation.force
    is_sought = scene.identify is not None and FORCE in scene.identify.ranges
    if is_sought and any(item["func_type"] == RESPONSE_FUNCTION for item in curves):
        allowed = f"spectra, or other keys in identify.over than {FORCE}"
        raise _refused(file, "response functions, which count times the force of the scene", allowed)
    found = [motion for k, item in enumerate(curves) for motion in _points(item, f"{k + 1}", force)]
    if not found:
        raise _refused(file, "no data set 58 with values", "response functions or spectra over the frequency")
    return found


def _points(item: Mapping[str, Any], label: str, force: float) -> list[MeasuredMotion]:
    import numpy as np

    heights = np.abs(np.asarray(item["data"])) * (force if item["func_type"] == RESPONSE_FUNCTION else 1.0)
    places = np.asarray(item["x"], dtype=float)
    heights = heights / np.maximum(2.0 * np.pi * places, 1e-300) ** OVER_OMEGA[item["ordinate_spec_data_type"]]
    heights = np.where(heights < LARGEST, heights, 0.0)  # what was not measured: NaN, infinity
    shown_ones = np.flatnonzero((heights >= LOWEST * heights.max(initial=0.0)) & (heights > 0.0) & (places > 0.0))
    chosen = np.unique(np.linspace(0, len(shown_ones) - 1, min(MOST_POINTS, len(shown_ones))).round().astype(int))
    return [
        MeasuredMotion(frequency=float(places[k]), amplitude=float(heights[k]), curve=label)
        for k in shown_ones[chosen].tolist()
    ]


def _refused(file: str, found: str, allowed: str) -> InputError:
    return InputError(f"{file}: {found}, allowed: {allowed}")
