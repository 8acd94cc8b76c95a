"""Which key of the scene to change for a tolerance: the last line of `shroud verify`."""

from __future__ import annotations

import math

from pipeline.labels import quantity
from pipeline.scene import Rom
from pipeline.verify.compare import ORDER
from pipeline.verify.model_errors import ModelErrors

_MARGIN = 0.9  # the size asked for is to leave less than the tolerance although the order is assumed


def advice(errors: ModelErrors, rom: Rom, tolerance: float) -> str:
    """What dominates the error of the natural frequencies, and what to change so that all errors stay within."""
    changes = [*_mesh_changes(errors, tolerance), *_mode_changes(errors, rom, tolerance)]
    return f"{_dominant(errors)}; {_asked(tolerance)}: {' and '.join(changes) or 'nothing to do'}"


def settled(errors: ModelErrors, tolerance: float) -> bool:
    """Whether all errors that are known stay within the tolerance."""
    return not max(errors.modes_frequency, errors.receptance) > tolerance and not errors.mesh_frequency > tolerance


def percent(error: float) -> str:
    """A relative error as people read it."""
    return "unknown" if math.isnan(error) else f"{100.0 * abs(error):.2g} %"


def finer_size(errors: ModelErrors, tolerance: float) -> float:
    """Element size in m, two digits, whose estimated error is within the tolerance."""
    wanted = errors.size * (_MARGIN * tolerance / errors.mesh_frequency) ** (1.0 / ORDER)
    unit = 10.0 ** (math.floor(math.log10(wanted)) - 1)
    return float(f"{math.floor(wanted / unit + 1e-9) * unit:.2g}")


def _asked(tolerance: float) -> str:
    return f"for a tolerance of {100.0 * tolerance:.3g} %"


def _dominant(errors: ModelErrors) -> str:
    """What of the two puts the natural frequencies wrong by more."""
    mesh, modes = errors.mesh_frequency, errors.modes_frequency
    if math.isnan(mesh):
        return (
            f"the modes left out put frequencies wrong by {percent(modes)}, the mesh is not known ({errors.reason})"
        )
    larger, smaller = ("mesh", "modes left out") if mesh >= modes else ("modes left out", "mesh")
    verb = "puts" if larger == "mesh" else "put"
    most, least = max(mesh, modes), min(mesh, modes)
    return f"the {larger} {verb} frequencies wrong by {percent(most)}, the {smaller} by {percent(least)}"


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


def _mode_changes(errors: ModelErrors, rom: Rom, tolerance: float) -> list[str]:
    worst = max(errors.modes_frequency, errors.receptance)
    if not worst > tolerance:
        return []
    because = f"(receptance wrong by {percent(errors.receptance)})"
    if rom.modes == "auto":
        return [f"lower rom.tolerance from {rom.tolerance:g} to {tolerance:g} {because}"]
    if errors.needed_modes is None:
        return [f'set rom.modes = "auto" with a larger rom.tolerance: 1000 modes do not reach this one {because}']
    if rom.frequency_limit is not None:
        return [f"set rom.modes = {errors.needed_modes} in place of rom.frequency_limit {because}"]
    return [f"raise rom.modes from {errors.modes} to {errors.needed_modes} {because}"]
