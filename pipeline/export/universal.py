"""Response functions as a universal file (data set 58), the format of modal analysis programs."""

from __future__ import annotations

import importlib.util
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from pipeline.errors import input_error
from pipeline.export.source import Kind, curves, kind_of

DISPLACEMENT, FORCE, FREQUENCY = 8, 13, 18  # specific data types
RESPONSE_FUNCTION = 4
SCALAR = 0  # direction: of the excitation, whichever it is


def write_universal(source: Path, target: Path) -> str:
    """Write x^(h) / F (m/N) of every curve, branch and harmonic h of the output; returns a summary in words.

    A curve with folds has several values at a frequency, so the abscissa is uneven and not monotonic.
    """
    if kind_of(source) is not Kind.response:
        raise input_error(source, "", "a reduced model", "a response (response.h5)")
    if importlib.util.find_spec("pyuff") is None:
        raise input_error(target.suffix, "", "needs the package pyuff", "pip install 'shroud[uff]', or a .mat file")
    import pyuff

    sets = list(_sets(source))
    with target.open("w", encoding="ascii"):
        pass  # pyuff ignores a folder that does not exist
    pyuff.UFF(str(target)).write_sets(sets, mode="overwrite")
    return f"{len(sets)} response function{'s' if len(sets) != 1 else ''}, data set 58, m/N over Hz"


def _sets(source: Path) -> Iterator[dict[str, Any]]:
    import pyuff

    for name, datasets, attributes in curves(source):
        force = float(attributes["excitation.force"])
        if len(datasets["frequency_hz"]) < 2:
            continue  # no function
        for harmonic in range(1, datasets["output"].shape[1]):
            yield pyuff.prepare_58(
                func_type=RESPONSE_FUNCTION,
                rsp_node=1,
                rsp_dir=SCALAR,
                ref_node=1,
                ref_dir=SCALAR,
                rsp_ent_name="tip",
                ref_ent_name="force",
                load_case_id=0,
                ver_num=harmonic,
                id1=f"curve {name}, harmonic {harmonic}"[:80],
                id2=_parameters(attributes)[:80],
                id3="NONE",
                id4="displacement of the harmonic over the force",
                id5="NONE",
                data=np.asarray(datasets["output"][:, harmonic]) / force,
                x=np.asarray(datasets["frequency_hz"]),
                abscissa_spacing=0,
                abscissa_spec_data_type=FREQUENCY,
                ordinate_spec_data_type=DISPLACEMENT,
                orddenom_spec_data_type=FORCE,
                abscissa_axis_units_lab="Hz",
                ordinate_axis_units_lab="m",
                orddenom_axis_units_lab="N",
                binary=0,
            )


def _parameters(attributes: dict[str, Any]) -> str:
    """The parameters in which curves usually differ."""
    names = {"contact.interference": "v0", "contact.friction": "mu", "excitation.engine_order": "EO"}
    known = {short: attributes.get(key) for key, short in names.items()}
    return ", ".join(f"{short} {value:.6g}" for short, value in known.items() if isinstance(value, int | float))
