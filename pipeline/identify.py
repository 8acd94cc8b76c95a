"""`shroud identify`: keys of a scene from measured motions; the scene with their values is written too."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from pipeline.errors import input_error
from pipeline.figures.figure_stage import look_of
from pipeline.optimise import asked_ranges, default_range
from pipeline.run import built_models
from pipeline.scene.labels import value_label
from pipeline.scene.measured_motions import motions_of_rows
from pipeline.scene.reading import SceneFile, given_scene, input_files
from pipeline.scene.schema import STUDIES
from pipeline.scene.sweep import key_value
from pipeline.scene.toml_text import parsed
from pipeline.stress.stress_stage import worst_stress
from pipeline.studies.identify.checks import unfit_identify_keys
from pipeline.studies.identify.result import IdentifiedKey
from pipeline.studies.identify.section import Identify
from pipeline.studies.study import StudyContext
from pipeline.studies.study_stage import SCENES
from pipeline.study_reply import StudyReply, reply_of_study

if TYPE_CHECKING:
    from pipeline.process.progress import Reporter
    from pipeline.stages.request import Request
    from pipeline.studies.identify.result import Identification

STUDY = "identify"
(SCENE,) = SCENES[STUDY]
DATA = "DATA"


def identify(request: Request, data: Any, over: Sequence[str], reporter: Reporter) -> StudyReply:
    """Find the values of keys with which a scene vibrates as was measured; write them, their figure and their scene.

    `data`: a file, columns by their names, or None for what the scene names itself.
    """
    file = _with_data(_unswept(request), data, over)
    for key, value in request.scene.members[0].parameters.items():
        if file.first.identify is None or key not in file.first.identify.ranges:
            first = value_label(key, value)
            reporter.line(f"note: {key} is swept; what was measured without a value of it is of its first, {first}")
    for error in unfit_identify_keys(file, request.rom is not None):
        raise error
    with built_models(replace(request, scene=file), reporter) as (run, models, outcome):
        context = StudyContext(run, models, outcome, worst_stress)
        reply = reply_of_study(context, STUDY, look_of(run, STUDY, " ".join(over)))
        if reply.stopped is not None:
            raise reply.stopped
        if reply.result is None:
            return reply
        with run.store.replacing(request.out / SCENE) as (path,):
            path.write_text(identified_scene(file, reply.result, request.rom is not None), encoding="utf-8")
        first, *others = reply.files
        return replace(reply, files=(first, SCENE, *others))


def _unswept(request: Request) -> SceneFile:
    """The scene with the first values of what it sweeps."""
    file = request.scene
    if not file.swept:
        return file
    return given_scene(file, {"sweep": None, **file.members[0].parameters}, request.rom is not None)


def _with_data(file: SceneFile, data: Any, over: Sequence[str]) -> SceneFile:
    """The scene with what was measured, and the keys of the command line with their ranges."""
    own = file.first.identify
    if own is None and not over:
        raise input_error(file.path, STUDY, "missing", "a table [identify] in the scene, or --over KEY=LOW:HIGH")
    keys: dict[str, Any] = {} if own is None else own.model_dump()
    if over:
        asked = asked_ranges(over)
        keys["over"] = {
            key: limits or default_range(file, key, key_value(file.first, key), None) for key, limits in asked.items()
        }
    if isinstance(data, str | os.PathLike):
        keys |= {"data": os.path.abspath(data), "measured": ()}
        if not os.path.isfile(data):
            raise input_error(Path(data), "", "no such file", "a CSV file, or a universal file with curves")
    elif data is not None:
        keys |= {"data": None, "measured": _of_columns(file, data)}
    section = Identify(**keys)
    members = tuple(replace(m, scene=m.scene.model_copy(update={STUDY: section})) for m in file.members)
    return replace(file, members=members)


def _of_columns(file: SceneFile, data: Mapping[str, Any]) -> tuple[Any, ...]:
    """Measured motions of columns by their names: numbers, or texts; NaN: no value."""
    names = [str(name) for name in data]
    columns = [np.atleast_1d(np.asarray(data[name])).tolist() for name in data]
    if len({len(column) for column in columns}) != 1:
        raise input_error(DATA, "", "columns of different lengths", "columns of one length")
    rows = [
        ["" if value is None or value != value else str(value) for value in row] for row in zip(*columns, strict=True)
    ]
    return tuple(motions_of_rows(file.first, DATA, [(0, names), *enumerate(rows, 1)]))


def identified_scene(file: SceneFile, result: Identification, given_model: bool = False) -> str:
    """The text of the scene with the identified values, and their posterior as its [uncertainty]."""
    tables = parsed(file.path, file.text)
    gone = {name: None for name in STUDIES if name in tables}
    uncertainty = {
        "parameter": [_distribution(item) for item in result.keys],
        "correlation": [list(row) for row in result.correlation],
    }
    kept = {name: table for name, table in tables.items() if name not in gone}
    paths = dict(_full_paths(kept, file.path.parent, set(input_files(file.first)), ""))
    found = given_scene(file, {**gone, **paths, **result.values}, given_model)
    return given_scene(found, {"uncertainty": uncertainty}, given_model).text


def _distribution(item: IdentifiedKey) -> dict[str, Any]:
    """The posterior of a key as a table of [uncertainty]."""
    width = item.deviation
    ends = {"low": item.range_low, "high": item.range_high}
    if item.logarithmic:
        factor = float(np.exp(width * np.log(item.range_high / item.range_low)))
        return {"key": item.key, "distribution": "lognormal", "factor": max(factor, 1.0001), **ends}
    return {
        "key": item.key,
        "distribution": "normal",
        "deviation": width * (item.range_high - item.range_low),
        **ends,
    }


def _full_paths(tables: Any, folder: Path, known: set[str], place: str) -> Iterable[tuple[str, str]]:
    """Dotted keys of files that are relative to the scene file, with their full paths."""
    for key, value in tables.items():
        dotted = f"{place}.{key}" if place else key
        if isinstance(value, Mapping):
            yield from _full_paths(value, folder, known, dotted)
        elif isinstance(value, str) and os.path.abspath(folder / value) in known:
            yield dotted, os.path.abspath(folder / value)
