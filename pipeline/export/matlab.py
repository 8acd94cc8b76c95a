"""Responses and reduced models as MATLAB files (level 5)."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from pipeline.errors import input_error, shown
from pipeline.export.matrices import single_model
from pipeline.export.source import Kind, curves, kind_of

LONGEST_NAME = 63


def write_matlab(source: Path, target: Path) -> str:
    """Write a response or a reduced model as a MATLAB file; returns a summary in words.

    A response becomes the cell array `curve`: structures with the name of a curve or branch (`0`, `0/branch/1`), its
    datasets and, in `parameter`, its attributes with underscores for dots. A reduced model becomes variables named
    as in `ReducedModel`.
    """
    from scipy.io import savemat

    if kind_of(source) is Kind.response:
        found = [_structure(*curve) for curve in curves(source)]
        cells = np.empty(len(found), dtype=object)
        cells[:] = found
        savemat(target, {"curve": cells}, oned_as="column", long_field_names=True, do_compression=True)
        return f"{len(found)} curve{'s' if len(found) != 1 else ''}, in the cell array curve"
    model = single_model(source)
    named = {field.name: getattr(model, field.name) for field in fields(model) if field.name != "wave_blocks"}
    for name in model.outputs:
        if not (name.isascii() and name.isidentifier() and name[0] != "_" and len(name) <= LONGEST_NAME):
            allowed = f"letters, digits and _, a letter first, {LONGEST_NAME} at most, as MATLAB has them"
            raise input_error(source, "output", shown(name), allowed)
    content = {name: value for name, value in named.items() if value is not None}
    savemat(target, content, oned_as="column", long_field_names=True)
    return f"a reduced model of {model.size} coordinates"


def _structure(name: str, datasets: dict[str, Any], attributes: dict[str, Any]) -> dict[str, Any]:
    parameter = {key.replace(".", "_"): value for key, value in attributes.items()}
    return {"name": name, **datasets, "parameter": parameter}
