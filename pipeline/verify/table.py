"""The table of `shroud verify`: one row a natural frequency or receptance."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from pipeline.labels import quantity
from pipeline.verify.advice import percent
from pipeline.verify.model_errors import JointErrors, ModelErrors
from pipeline.verify.stage import Case

if TYPE_CHECKING:
    from rich.table import Table


def heading(case: Case) -> str:
    """What is compared: scene and sizes of the reduced model, its mesh and the other one."""
    errors, size = case.errors, quantity("mesh.size")
    order = case.member.scene.excitation.engine_order
    here = f"{errors.modes} fixed-interface modes, {size.value(errors.size)} {errors.element}, {errors.dofs} dofs"
    if errors.other is None:
        other = f"no other mesh ({errors.reason})"
    else:
        other = f"other mesh {size.value(errors.other.size)} {errors.other.element}, {errors.other.dofs} dofs"
    return f"{case.label}, engine order {order}: {here}; {other}"


def error_table(errors: ModelErrors) -> Table:
    """Natural frequencies of reduced, full and other full model with their errors, receptances, statics."""
    from rich.table import Table

    table = Table(header_style="bold", pad_edge=False)
    table.add_column("contact")
    table.add_column("")
    for name in ("reduced\n[Hz]", "full\n[Hz]", "error by\nmodes", "other mesh\n[Hz]", "error by\nmesh"):
        table.add_column(name, justify="right")
    for joint in errors.joints:
        _add_joint(table, joint, errors.convergence)
    table.add_row("", "static flexibility", "", "", percent(errors.static), "", "")
    return table


def _add_joint(table: Table, joint: JointErrors, convergence: float) -> None:
    modes, mesh = joint.modes_error, joint.mesh_error(convergence)
    for index, full in enumerate(joint.full_hz):
        name = f"mode {joint.first_mode + index}" + ("" if joint.within[index] else " (above range)")
        other = "-" if joint.other_hz is None else f"{joint.other_hz[index]:.6g}"
        table.add_row(
            joint.joint if index == 0 else "",
            name,
            f"{joint.reduced_hz[index]:.6g}",
            f"{full:.6g}",
            percent(modes[index]),
            other,
            "-" if math.isnan(mesh[index]) else percent(mesh[index]),
        )
    for name, error in (("receptance, contact nodes", joint.contact), ("receptance, output", joint.output)):
        table.add_row("", name, "", "", percent(error), "", "")
    table.add_section()
