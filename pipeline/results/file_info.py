"""Contents of an HDF5 file of this program or of a run, as values for JSON and as lines of text."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pipeline.codec import from_attributes, plain
from pipeline.errors import InputError, input_error, one_line, reason_of
from pipeline.process.isolated_reading import read_apart, read_model
from pipeline.results.certainty import (
    bifurcation_sentences,
    branch_sentences,
    error_sentences,
    open_sentences,
    residual_sentences,
    search_sentences,
)
from pipeline.results.conclusion import (
    ROW,
    ShownCurve,
    conclusion_table,
    interface_lines,
    lines_of,
    lowest_line,
    open_lines,
    shown_numbers,
    table_lines,
    technical_table,
    wrapped,
)
from pipeline.results.overview import MOST_ROWS, abbreviated, end_lines, statistics
from pipeline.results.tables import measured_errors
from pipeline.results.worst import STARRED, sentence
from pipeline.scene.presets import Accuracy
from pipeline.stages.curve.curve_summary import CurveSummary, read_summary
from pipeline.stages.curve.curve_table import TABLE, CurveTable, read_table

if TYPE_CHECKING:
    import h5py

    from rom.cyclic.reduced_model import ContactInterface, ReducedModel

WAVES = "nodal_diameter"  # group of a reduced model with a superelement for each nodal diameter
_ALLOWED = "an HDF5 file with a response (response.h5) or a reduced model (rom.h5)"


def contents(path: Path) -> dict[str, Any]:
    """Contents of a response, a reduced model or a run as values for JSON; `kind` says which (null: not known)."""
    if path.is_dir():
        return _run(path)
    if path.suffix == ".toml":
        raise input_error(path, "", "a scene", f"the output folder of its run (out/NAME), or {_ALLOWED}")
    found = read_apart(path, _ALLOWED, lambda: _read(path))
    return found if isinstance(found, dict) else _reduced_model(path, found)


def _read(path: Path) -> dict[str, Any] | ReducedModel:
    """The contents of a response, or the reduced model."""
    from rom.files.hdf5 import UNREADABLE, opened, why_unreadable

    if not path.is_file():
        raise input_error(path, "", "no such file")
    try:
        with opened(path) as file:
            if "curve" in file:
                return {"file": str(path), "kind": "response", **_response(file)}
            if not {"mass", WAVES} & set(file):
                raise input_error(path, "", f"holds {', '.join(list(file)[:8]) or 'nothing'}", _ALLOWED)
    except UNREADABLE as error:
        raise input_error(path, "", f"cannot be read: {why_unreadable(error)}", _ALLOWED) from None
    return read_model(path)


def described(found: dict[str, Any], width: int = 120) -> list[str]:
    """The result of `contents` as lines of text, of at most `width` characters where words allow that.

    Raises InputError where a value of the file is not of its kind.
    """
    if found["kind"] in ("response", "run"):
        try:
            return _described_curves(found, width)
        except (AttributeError, LookupError, TypeError, ValueError) as error:
            raise input_error(found["file"], "", f"cannot be read: {reason_of(error)}", _ALLOWED) from None
    blades = found["n_blades"]
    lines = [
        f"{found['file']}: reduced model by {found['producer']}, {found['coordinates']} "
        f"coordinate{'' if found['coordinates'] == 1 else 's'}",
        f"ring: {'single structure' if blades is None else f'{blades} blades'}",
        f"contact: {found['contact_nodes']} nodes {'against ground' if found['against'] == 'ground' else 'a face'}",
        *_interface_lines(found["interfaces"]),
        f"outputs: {', '.join(found['outputs'])}",
        f"optional: {', '.join(found['optional']) or 'none'}",
        *_joined_lines(found),
        f"free natural frequencies [Hz]{_at(found)}: {', '.join(f'{hz:.6g}' for hz in found['free_hz'])}",
    ]
    return [one_line(line) for line in lines]


def _described_curves(found: dict[str, Any], width: int) -> list[str]:
    """A response, or a run."""
    if found["kind"] == "response":
        return [f"{found['file']}: response, {len(found['curves'])} curves", *_curve_lines(found, width)]
    return [*map(one_line, _run_lines(found)), *_curve_lines(found, width)]


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
    named = (
        "scene",
        "complete",
        "problems",
        "seconds",
        "stages",
        "models",
        "subject",
        "linear",
        "accuracy",
        "studies",
    )
    found = {name: summary[name] for name in named if name in summary}
    listed = summary.get("curves") or []
    for entry in held["curves"]:
        if int(entry["curve"]) < len(listed):
            entry |= {name: listed[int(entry["curve"])].get(name) for name in ROW}
    solved = {int(entry["curve"]) for entry in held["curves"]}
    failed = [
        {"curve": number, "parameters": entry["parameters"], "reason": entry["reason"]}
        for number, entry in enumerate(listed)
        if number not in solved
    ]
    return {**held, "failed": failed, "file": str(folder), "kind": "run", **found}


def _run_lines(found: dict[str, Any]) -> Iterator[str]:
    end = "complete" if found.get("complete") else "not complete"
    models = f"reduced models: {len(found['models'])}; " if found["models"] or found.get("complete") else ""
    count = len(found["curves"])
    of = f" of {count + len(found['failed'])}" if found["failed"] else ""
    yield f"{found['file']}: run, {end}; {models}curves: {count}{of}"
    for problem in found.get("problems", ()):
        yield f"problem: {problem}"
    for model in found["models"]:
        free = ", ".join(f"{hz:.6g}" for hz in model.get("free_hz") or ())
        yield f"{model.get('rom')}: reduced model, free natural frequencies [Hz]: {free}"
        yield f"  mesh: {model.get('mesh')}"


def _curve_lines(found: dict[str, Any], width: int) -> Iterator[str]:
    """The curves: what the screen says at the end of the run, a table of what it leaves out, errors and search."""
    curves = sorted([*map(_shown, found["curves"]), *map(_failed, found.get("failed", ()))], key=lambda c: c.number)
    if not curves:
        return
    facts = {curve.number: curve.facts for curve in curves if curve.facts is not None}
    settings = found["curves"][0]["parameters"] if found["curves"] else {}
    loads = found["subject"]["static_loads"] if found.get("subject") else bool(settings.get("load.speed_rpm"))
    shown = shown_numbers([curve.height for curve in curves])
    yield from lines_of(found)
    yield from table_lines(conclusion_table(curves, shown, loads), width)
    yield from interface_lines([curves[place] for place in shown], width, loads)
    if len(shown) < len(curves):
        yield f"... {len(curves)} curves: --json, or curves.csv beside the file"
        yield from end_lines(found["statistics"])
    open_ = open_lines(found, curves, settings.get("response.search"))
    yield from wrapped(filter(None, [lowest_line(curves), *open_]), width)
    if not facts:
        return
    yield "\nPoints and errors"
    yield from table_lines(technical_table([curves[place] for place in shown], loads), width)
    if any(item.worst_motion in STARRED for item in facts.values()):
        yield "*: the worst motion does not repeat (quasi-periodic or irregular); the branch is where it departs from"
    asked = settings.get("response.residual_tractions") == "bounds"
    laws = {value for key, value in settings.items() if key.endswith(".law")}
    paragraphs = {
        "Parameters of every curve (SI units, angles in degrees)": _shared(found["curves"]),
        "How sure": [*error_sentences(facts, found.get("models", ())), *_accuracy(found)],
        "Search for the worst motion": [*search_sentences(facts), *open_sentences(facts), *branch_sentences(facts)],
        "Bifurcations of the main branches": bifurcation_sentences(facts),
        "Static tractions": residual_sentences(facts, asked, "cone" in laws),
    }
    for heading, sentences in paragraphs.items():
        if sentences:
            yield f"\n{heading}"
            yield from wrapped(abbreviated(sentences), width)


def _shared(entries: Sequence[dict[str, Any]]) -> list[str]:
    """Parameters that all curves share, in one line."""
    first = entries[0]["parameters"]
    same = [
        key for key in first if "." in key and all(entry["parameters"].get(key) == first[key] for entry in entries)
    ]
    return [", ".join(f"{key} = {first[key]}" for key in same)] if same else []


def _shown(entry: dict[str, Any]) -> ShownCurve:
    """A curve of `contents`."""
    facts = from_attributes(CurveSummary, _known(entry))
    row = {name: entry.get(name) for name in ROW}
    return ShownCurve(int(entry["curve"]), entry.get("swept", entry["parameters"]), facts, entry["reason"], **row)


def _known(entry: dict[str, Any]) -> dict[str, Any]:
    return {name: math.nan if value is None else value for name, value in entry.items()}


def _failed(entry: dict[str, Any]) -> ShownCurve:
    return ShownCurve(entry["curve"], entry["parameters"], None, entry["reason"])


def _accuracy(found: dict[str, Any]) -> list[str]:
    entry = found.get("accuracy")
    if entry is None:
        return []
    accuracy = Accuracy(entry["preset"], entry["values"], tuple(entry["not_by_preset"]))
    return [sentence(accuracy.text(measured_errors(found.get("models", ()))))]


def _response(file: h5py.File) -> dict[str, Any]:
    """Curves of a response, of many curves with their swept keys only; with their statistics."""
    if TABLE not in file:  # written by an earlier version
        return {"curves": list(_curves(file["curve"])), "statistics": None}
    table = read_table(file[TABLE])
    if len(table) > MOST_ROWS:
        return {"curves": list(_rows(table)), "statistics": statistics(table)}
    curves = [{**curve, "swept": table.parameters_of(int(curve["curve"]))} for curve in _curves(file["curve"])]
    return {"curves": curves, "statistics": None}


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


def _value(attribute: Any) -> Any:
    """An attribute as a value for JSON."""
    return attribute.decode("utf-8", errors="replace") if isinstance(attribute, bytes) else plain(attribute)


def _reduced_model(path: Path, model: ReducedModel) -> dict[str, Any]:
    from rom.cyclic.natural_frequencies import natural_frequencies
    from rom.cyclic.reduced_model import interfaces_of
    from rom.errors import ReducedModelError

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
        "interfaces": {each.name: {"nodes": len(each.position), **_against(each)} for each in interfaces_of(model)},
        "against": "ground" if model.contact_left is None else "neighbour",
        "outputs": list(model.outputs),
        "optional": _optional(model),
        "cut_face_motions": 0 if model.cyclic_right is None else len(model.cyclic_right),
        "nodal_diameters": sorted(model.wave_blocks),
        "free_hz": [float(hz) for hz in free],
    }


def _against(interface: ContactInterface) -> dict[str, str]:
    """What an interface touches; of the same sector or the ground the file does not tell which."""
    return {"against": "ground or sector" if interface.left is None else "neighbour"}


def _interface_lines(interfaces: Mapping[str, Mapping[str, Any]]) -> list[str]:
    """A line about the contact interfaces, where there are several."""
    said = (f"{name} {each['nodes']} (against {each['against']})" for name, each in interfaces.items())
    return [f"contact interfaces, with their nodes: {', '.join(said)}"] if len(interfaces) > 1 else []


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
