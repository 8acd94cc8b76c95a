"""Which keys of the scene to change for a tolerance: the last line of `shroud verify`."""

from __future__ import annotations

import math
from collections.abc import Sequence

from pipeline.scene.labels import quantity
from pipeline.scene.schema import Rom
from pipeline.verify.compare import ORDER
from pipeline.verify.model_errors import ModelErrors

_MARGIN = 0.8  # the size asked for is to leave less than the tolerance: the order is assumed, meshes change in steps
_MORE_MODES = 1.15  # on another mesh the mode that makes the difference may stand a few places further up


def within(errors: Sequence[ModelErrors], tolerance: float) -> bool:
    """Whether all errors are known and none is above the tolerance."""
    return all(
        max(each.modes_frequency, each.receptance) <= tolerance and each.mesh_frequency <= tolerance
        for each in errors
    )


def advice(errors: Sequence[ModelErrors], rom: Rom, tolerance: float, needed: int | None) -> str:
    """What dominates the error of the natural frequencies, and what to change so that all errors stay within.

    errors: of models with one choice of mesh and modes; needed: fixed-interface modes that the tolerance needs on
    this mesh, None where they are enough or not known.
    """
    # NaN (no other mesh) compares as not larger, so a known error is found beside an unknown one
    mesh = max(errors, key=lambda each: -1.0 if math.isnan(each.mesh_frequency) else each.mesh_frequency)
    changes = _mesh_changes(mesh, tolerance)
    if changes and needed is not None:
        needed = math.ceil(_MORE_MODES * needed)
    changes += _mode_changes(errors, rom, tolerance, needed)
    todo = " and ".join(changes) or "nothing to do"
    return f"{_dominant(errors, mesh)}; for a tolerance of {100.0 * tolerance:.3g} %: {todo}"


def percent(error: float) -> str:
    """A relative error as people read it."""
    return "unknown" if math.isnan(error) else f"{100.0 * abs(error):.2g} %"


def finer_size(errors: ModelErrors, tolerance: float) -> float:
    """Element size in m, two digits, whose estimated error is within the tolerance."""
    wanted = errors.size * (_MARGIN * tolerance / errors.mesh_frequency) ** (1.0 / ORDER)
    unit = 10.0 ** (math.floor(math.log10(wanted)) - 1)
    return float(f"{math.floor(wanted / unit + 1e-9) * unit:.2g}")


def _dominant(errors: Sequence[ModelErrors], worst_mesh: ModelErrors) -> str:
    """What of the two puts the natural frequencies wrong by more."""
    mesh, modes = worst_mesh.mesh_frequency, max(each.modes_frequency for each in errors)
    if math.isnan(mesh):
        unknown = f"what the mesh does is not known ({worst_mesh.reason})"
        return f"the modes left out put frequencies wrong by {percent(modes)}, {unknown}"
    larger, smaller = ("mesh puts", "modes left out") if mesh >= modes else ("modes left out put", "mesh")
    most, least = percent(max(mesh, modes)), percent(min(mesh, modes))
    return f"the {larger} frequencies wrong by {most}, the {smaller} by {least}"


def _mesh_changes(errors: ModelErrors, tolerance: float) -> list[str]:
    if not errors.mesh_frequency > tolerance or errors.other is None:
        return []
    if errors.other.element != errors.element:
        return [f'set mesh.element = "{errors.other.element}"']
    size, wanted = quantity("mesh.size"), finer_size(errors, tolerance)
    # dofs grow with the size as they do between the two meshes
    growth = math.log(errors.other.dofs / errors.dofs) / math.log(errors.size / errors.other.size)
    dofs = float(f"{errors.dofs * (errors.size / wanted) ** growth:.2g}")
    return [f"lower mesh.size from {size.value(errors.size)} to {size.value(wanted)} (some {dofs:.0f} dofs)"]


def _mode_changes(errors: Sequence[ModelErrors], rom: Rom, tolerance: float, needed: int | None) -> list[str]:
    receptance = max(each.receptance for each in errors)
    frequency = max(each.modes_frequency for each in errors)
    if max(receptance, frequency) <= tolerance:
        return []
    worst = "receptance" if receptance > frequency else "frequencies"
    because = f"({worst} wrong by {percent(max(receptance, frequency))})"
    if rom.modes == "auto":
        return [f"lower rom.tolerance from {rom.tolerance:g} to {tolerance:g} {because}"]
    if needed is None:
        return [f'set rom.modes = "auto" and rom.tolerance above this: it needs over 1000 modes {because}']
    if rom.frequency_limit is not None:
        return [f"set rom.modes = {needed} in place of rom.frequency_limit {because}"]
    return [f"raise rom.modes from {errors[0].modes} to {needed} {because}"]
