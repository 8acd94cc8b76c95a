"""Contents of an HDF5 file of this program or of a run, as values for JSON and as lines of text."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pipeline.codec import plain
from pipeline.errors import InputError, input_error, one_line, reason_of
from pipeline.process.isolated_reading import read_apart, read_model
from pipeline.results.overview import MOST_ROWS, end_lines, statistics
from pipeline.results.worst import END_MARK, UNSTABLE_MARK, truncation_mark
from pipeline.stages.curve.curve_summary import CurveSummary, read_summary
from pipeline.stages.curve.curve_table import TABLE, CurveTable, read_table

if TYPE_CHECKING:
    import h5py

    from rom import ReducedModel

WAVES = "nodal_diameter"  # group of a reduced model with a superelement for each nodal diameter
_ALLOWED = "an HDF5 file with a response (response.h5) or a reduced model (rom.h5)"


def contents(path: Path) -> dict[str, Any]:
    """Contents of a response, a reduced model or a run as values for JSON; `kind` says which (null: not known)."""
    if path.is_dir():
        return _run(path)
    found = read_apart(path, _ALLOWED, lambda: _read(path))
    return found if isinstance(found, dict) else _reduced_model(path, found)


def _read(path: Path) -> dict[str, Any] | ReducedModel:
    """The contents of a response, or the reduced model."""
    from rom import UNREADABLE, opened, why_unreadable

    if not path.is_file():
        raise input_error(path, "", "no such file", _ALLOWED)
    try:
        with opened(path) as file:
            if "curve" in file:
                return {"file": str(path), "kind": "response", **_response(file)}
            if not {"mass", WAVES} & set(file):
                raise input_error(path, "", f"holds {', '.join(list(file)[:8]) or 'nothing'}", _ALLOWED)
    except UNREADABLE as error:
        raise input_error(path, "", f"cannot be read: {why_unreadable(error)}", _ALLOWED) from None
    return read_model(path)


def described(found: dict[str, Any]) -> list[str]:
    """The result of `contents` as lines of text."""
    if found["kind"] == "response":
        lines = [line for curve in found["curves"][:MOST_ROWS] for line in _curve_lines(curve)]
        if (more := len(found["curves"]) - MOST_ROWS) > 0:
            lines.append(f"{more} more curves: --json, or curves.csv beside the file")
        head = f"{found['file']}: response, {len(found['curves'])} curves"
        return [head, *end_lines(found["statistics"]), *lines]
    if found["kind"] == "run":
        return [one_line(line) for line in _run_lines(found)]
    blades = found["n_blades"]
    lines = [
        f"{found['file']}: reduced model by {found['producer']}, {found['coordinates']} coordinates",
        f"ring: {'single structure' if blades is None else f'{blades} blades'}",
        f"contact: {found['contact_nodes']} nodes {'against ground' if found['against'] == 'ground' else 'a face'}",
        f"outputs: {', '.join(found['outputs'])}",
        f"optional: {', '.join(found['optional']) or 'none'}",
        *_joined_lines(found),
        f"free natural frequencies [Hz]{_at(found)}: {', '.join(f'{hz:.6g}' for hz in found['free_hz'])}",
    ]
    return [one_line(line) for line in lines]


def _joined_lines(found: dict[str, Any]) -> list[str]:
    """A line about the cut faces, where there are any."""
    if waves := found["nodal_diameters"]:
        return [f"nodal diameters, a superelement for each: {', '.join(map(str, waves))}"]
    motions = found["cut_face_motions"]
    return (
        [f"joined to its neighbours at cut faces: {motions} motion{'s' * (motions > 1)} of each"] if motions else []
    )


def _at(found: dict[str, Any]) -> str:
    return " at nodal diameter 0" if found["cut_face_motions"] or found["nodal_diameters"] else ""


def _run(folder: Path) -> dict[str, Any]:
    """Contents of a run: of its summary, and of its response where it has one."""
    from pipeline.results.run_folder import RESPONSE, read_run_summary

    summary, response = read_run_summary(folder), folder / RESPONSE
    has_curves = summary["response"] is not None and response.is_file()
    held = contents(response) if has_curves else {"curves": [], "statistics": None}
    named = ("scene", "complete", "problems", "seconds", "stages", "models")
    found = {name: summary[name] for name in named if name in summary}
    return {**held, "file": str(folder), "kind": "run", **found}


def _run_lines(found: dict[str, Any]) -> Iterator[str]:
    end = "complete" if found.get("complete") else "not complete"
    yield f"{found['file']}: run, {end}; reduced models: {len(found['models'])}; curves: {len(found['curves'])}"
    for problem in found.get("problems", ()):
        yield f"problem: {problem}"
    for model in found["models"]:
        free = ", ".join(f"{hz:.6g}" for hz in model.get("free_hz") or ())
        yield f"{model.get('rom')}: reduced model, free natural frequencies [Hz]: {free}"
        yield f"  mesh: {model.get('mesh')}"
    yield from described({**found, "kind": "response"})[1:]


def _response(file: h5py.File) -> dict[str, Any]:
    """Curves of a response, of many curves with their swept keys only; with their statistics."""
    if TABLE not in file:  # written by an earlier version
        return {"curves": list(_curves(file["curve"])), "statistics": None}
    table = read_table(file[TABLE])
    many = len(table) > MOST_ROWS
    curves = _rows(table) if many else _curves(file["curve"])
    return {"curves": list(curves), "statistics": statistics(table) if many else None}


def _rows(table: CurveTable) -> Iterator[dict[str, Any]]:
    """The curves of a table that have a result."""
    for number in range(len(table)):
        facts = table.summary_of(number)
        if facts is not None:
            yield {"curve": str(number), "parameters": table.parameters_of(number), **plain(facts)}


def _curves(group: h5py.Group) -> Iterator[dict[str, Any]]:
    names = set(CurveSummary.__dataclass_fields__)
    for name in sorted(group, key=lambda n: (len(n), n)):
        attributes = group[name].attrs
        values = {key: _value(attributes[key]) for key in sorted(attributes) if key not in names}
        yield {"curve": name, "parameters": values, **plain(read_summary(group[name]))}


def _curve_lines(curve: dict[str, Any]) -> Iterator[str]:
    end = "complete" if curve["complete"] else f"incomplete ({curve['reason']})"
    names = ("peak_amplitude_m", "peak_frequency_hz", "worst_amplitude_m", "worst_frequency_hz")
    height, frequency, worst, worst_at = (math.nan if curve[name] is None else curve[name] for name in names)
    yield one_line(
        f"curve/{curve['curve']}: {end}, {curve['points']} points, {curve['harmonics']} harmonics, "
        f"peak {height:.6g} m at {frequency:.6g} Hz{END_MARK * bool(curve.get('peak_at_end'))}"
    )
    if math.isfinite(worst):
        yield one_line(
            f"  worst motion: {worst:.6g} m at {worst_at:.6g} Hz{END_MARK * bool(curve.get('worst_at_end'))}"
            f"{UNSTABLE_MARK * bool(curve.get('worst_unstable'))}, {curve['worst_motion']}, "
            f"branch {curve['worst_branch']} (0: main){_harmonics_said(curve)}"
        )
    yield one_line("  " + ", ".join(f"{key} = {value}" for key, value in curve["parameters"].items()))


def _harmonics_said(curve: dict[str, Any]) -> str:
    error = curve.get("worst_truncation_error")
    return truncation_mark(math.nan if error is None else error)


def _value(attribute: Any) -> Any:
    """An attribute as a value for JSON."""
    return attribute.decode("utf-8", errors="replace") if isinstance(attribute, bytes) else plain(attribute)


def _reduced_model(path: Path, model: ReducedModel) -> dict[str, Any]:
    from rom import ReducedModelError, natural_frequencies

    try:
        free = natural_frequencies(model, 0.0, count=min(10, model.size))
    except ReducedModelError as error:
        raise InputError(f"{path}: {reason_of(error)}") from None
    return {
        "file": str(path),
        "kind": "reduced model",
        "producer": model.producer,
        "coordinates": model.size,
        "n_blades": model.n_blades,
        "contact_nodes": model.n_contacts,
        "against": "ground" if model.contact_left is None else "neighbour",
        "outputs": list(model.outputs),
        "optional": _optional(model),
        "cut_face_motions": 0 if model.cyclic_right is None else len(model.cyclic_right),
        "nodal_diameters": sorted(model.wave_blocks),
        "free_hz": [float(hz) for hz in free],
    }


def _optional(model: ReducedModel) -> list[str]:
    arrays = {
        "basis": model.basis,
        "contact/area": model.contact_area,
        "force/centrifugal": model.force_centrifugal,
        "force/static": model.force_static,
        "coriolis": model.coriolis,
        "blade_stiffness": model.blade_stiffness,
    }
    return [name for name, array in arrays.items() if array is not None]
