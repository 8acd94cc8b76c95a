"""The table of `shroud verify`: the natural frequencies of one case, or a row for each contact condition of many."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from pipeline.results.tables import screen_table
from pipeline.scene.labels import quantity
from pipeline.verify.advice import percent
from pipeline.verify.model_errors import JointErrors, ModelErrors
from pipeline.verify.stage import VerifiedCase

if TYPE_CHECKING:
    from rich.table import Table


def heading(errors: ModelErrors) -> str:
    """Sizes of the models compared: the reduced one, the full one on its mesh and on the other mesh."""
    size = quantity("mesh.size")
    errors = replace(errors, size=float(f"{errors.size:.4g}"))  # of a mesh from a file the mean of its edges
    here = f"{errors.modes} fixed-interface modes, {size.value(errors.size)} {errors.element}, {errors.dofs} dofs"
    if errors.other is None:
        return f"{here}; no other mesh ({errors.reason})"
    rounded = float(f"{errors.other.size:.3g}")
    return f"{here}; other mesh {size.value(rounded)} {errors.other.element}, {errors.other.dofs} dofs"


def error_table(errors: ModelErrors, highest_hz: float) -> Table:
    """Natural frequencies of the reduced model and of the two full ones, errors, receptances, statics.

    `highest_hz` is the end of the frequency range.
    """
    headings = ["contact", "", "reduced\n[Hz]", "full\n[Hz]", "modal trunc.\nerror"]
    headings += ["contact dofs\nerror", "other mesh\n[Hz]", "mesh\nerror"]
    rows = [row for joint in errors.joints for row in _joint_rows(joint, errors.factors(joint), highest_hz)]
    static = ["", "static flexibility", "", "", percent(errors.static), "", "", ""]
    return screen_table(headings, [*rows, static], headings[:2])


def equilibrium_lines(cases: Sequence[VerifiedCase]) -> list[str]:
    """One line on each case with the linear equilibrium at speed: its error against the nonlinear one."""
    said = 'load.equilibrium = "linear" instead of "nonlinear" changes a frequency by'
    return [
        f"{case.label}: {said} {percent(errors.equilibrium)}"
        for case, errors in cases
        if errors.equilibrium is not None
    ]


def overview(cases: Sequence[VerifiedCase]) -> Table:
    """One row for each case and contact condition: lowest frequency in the range, largest errors."""
    headings = ["case", "contact", "lowest\n[Hz]", "modal trunc.\nerror", "receptance"]
    headings += ["contact dofs\nerror", "other mesh\n[Hz]", "mesh\nerror"]
    rows: list[Sequence[str] | None] = []
    for case, errors in cases:
        for index, joint in enumerate(errors.joints):
            mesh = joint.mesh_error(errors.factors(joint))
            row = [
                case.label if index == 0 else "",
                joint.joint,
                f"{joint.full_hz[0]:.6g}",
                _or_dash(_largest(joint.modes_error, joint.within)),
                percent(max(joint.contact, joint.output)),
                _or_dash(_largest(joint.contact_error, joint.within)),
                "-" if joint.other_hz is None else f"{joint.other_hz[0]:.6g}",
                _or_dash(_largest(mesh, joint.within)),
            ]
            rows.append(row)
        rows.append(None)
    return screen_table(headings, rows, headings[:2])


def _joint_rows(joint: JointErrors, factors: Sequence[float], highest_hz: float) -> Iterator[Sequence[str] | None]:
    modes, mesh = joint.modes_error, joint.mesh_error(factors)
    for index, full in enumerate(joint.full_hz):
        yield [
            joint.joint if index == 0 else "",
            f"mode {joint.first_mode + index}" + (" (above range)" if full > highest_hz else ""),
            f"{joint.reduced_hz[index]:.6g}",
            f"{full:.6g}",
            percent(modes[index]),
            _or_dash(joint.contact_error[index]),
            "-" if joint.other_hz is None else f"{joint.other_hz[index]:.6g}",
            percent(mesh[index]),
        ]
    for name, error in (("receptance, contact nodes", joint.contact), ("receptance, output", joint.output)):
        yield ["", name, "", "", percent(error), "", "", ""]
    yield None


def _largest(errors: Sequence[float], within: Sequence[bool]) -> float:
    """Largest error that counts; NaN where none does."""
    return max((abs(e) for e, counts in zip(errors, within, strict=True) if counts), default=math.nan)


def _or_dash(error: float) -> str:
    return "-" if math.isnan(error) else percent(error)
