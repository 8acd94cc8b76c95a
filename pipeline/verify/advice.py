"""Keys of the scene to change for a tolerance: the last line of `shroud verify`."""

from __future__ import annotations

import math
from collections.abc import Sequence

from pipeline.scene.labels import quantity
from pipeline.scene.schema import Rom
from pipeline.verify.compare import ORDER
from pipeline.verify.model_errors import ModelErrors

_MARGIN = 0.8  # the advised size aims below the tolerance: the order is assumed, and meshes change in steps
_MORE_MODES = 1.15  # on another mesh the decisive mode may have a somewhat higher number


def within(errors: Sequence[ModelErrors], tolerance: float) -> bool:
    """Whether all errors are known and none is above the tolerance."""
    return all(
        max(each.modes_frequency, each.receptance) <= tolerance and each.mesh_frequency <= tolerance
        for each in errors
    )


def advice(errors: Sequence[ModelErrors], rom: Rom, tolerance: float, needed: int | None) -> str:
    """The two errors of the natural frequencies, and the keys to change so that all errors stay within the tolerance.

    Parameters
    ----------
    errors : sequence of ModelErrors
        Errors of the models with one choice of mesh and modes.
    rom : Rom
        That choice of modes.
    tolerance : float
        Relative error allowed.
    needed : int or None
        Fixed-interface modes that the tolerance needs on this mesh, None where the present ones are enough or the
        number is not known.
    """
    # an unknown error (NaN, no other mesh) ranks below any known one
    mesh = max(errors, key=lambda each: -1.0 if math.isnan(each.mesh_frequency) else each.mesh_frequency)
    changes = _mesh_changes(mesh, tolerance)
    if changes and needed is not None:
        needed = math.ceil(_MORE_MODES * needed)
    changes += _mode_changes(errors, rom, tolerance, needed)
    todo = " and ".join(changes) or "nothing to do"
    return f"{_dominant(errors, mesh)}; for a tolerance of {100.0 * tolerance:.3g} %: {todo}"


def percent(error: float) -> str:
    """A relative error in percent."""
    return "unknown" if math.isnan(error) else f"{100.0 * abs(error):.2g} %"


def finer_size(errors: ModelErrors, tolerance: float) -> float:
    """Element size in m, two digits, whose estimated error is within the tolerance."""
    size = errors.size * (_MARGIN * tolerance / errors.mesh_frequency) ** (1.0 / ORDER)
    unit = 10.0 ** (math.floor(math.log10(size)) - 1)
    return float(f"{math.floor(size / unit + 1e-9) * unit:.2g}")


def _dominant(errors: Sequence[ModelErrors], worst_mesh: ModelErrors) -> str:
    """Mesh error and modal truncation error of the natural frequencies, the larger one first."""
    mesh, modes = worst_mesh.mesh_frequency, max(each.modes_frequency for each in errors)
    if math.isnan(mesh):
        return f"modal truncation error {percent(modes)} of a frequency, mesh error not known ({worst_mesh.reason})"
    ranked = sorted([(mesh, "mesh error"), (modes, "modal truncation error")], key=lambda each: -each[0])
    (larger, first), (smaller, second) = ranked
    return f"{first} {percent(larger)} of a frequency, {second} {percent(smaller)}"


def _mesh_changes(errors: ModelErrors, tolerance: float) -> list[str]:
    if not errors.mesh_frequency > tolerance or errors.other is None:
        return []
    if errors.other.element != errors.element:
        return [f'set mesh.element = "{errors.other.element}"']
    size, finer = quantity("mesh.size"), finer_size(errors, tolerance)
    # dofs grow with the size as they do between the two meshes
    growth = math.log(errors.other.dofs / errors.dofs) / math.log(errors.size / errors.other.size)
    dofs = float(f"{errors.dofs * (errors.size / finer) ** growth:.2g}")
    return [f"lower mesh.size from {size.value(errors.size)} to {size.value(finer)} (some {dofs:.0f} dofs)"]


def _mode_changes(errors: Sequence[ModelErrors], rom: Rom, tolerance: float, needed: int | None) -> list[str]:
    receptance = max(each.receptance for each in errors)
    frequency = max(each.modes_frequency for each in errors)
    if max(receptance, frequency) <= tolerance:
        return []
    worst = "receptance" if receptance > frequency else "frequency"
    because = f"({worst} error {percent(max(receptance, frequency))})"
    if rom.modes == "auto":
        return [f"lower rom.tolerance from {rom.tolerance:g} to {tolerance:g} {because}"]
    if needed is None:
        return [f'set rom.modes = "auto" and a larger rom.tolerance: this one needs over 1000 modes {because}']
    if rom.frequency_limit is not None:
        return [f"set rom.modes = {needed} in place of rom.frequency_limit {because}"]
    return [f"raise rom.modes from {errors[0].modes} to {needed} {because}"]
