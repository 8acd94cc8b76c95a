"""Errors of one reduced model, as numbers: plain data that goes into the store, the table and the JSON."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from typing import Any


@dataclass(frozen=True)
class OtherMesh:
    """The mesh that the one at hand is compared with: element size [m], element, dofs."""

    size: float
    element: str
    dofs: int


@dataclass(frozen=True)
class JointErrors:
    """One joint: `free`, `sliding` or `stuck`.

    full_hz, reduced_hz, other_hz: natural frequencies from number `first_mode`, of the full model, the reduced model
    and the full model on the other mesh (None: there is none); within: whether they lie in the range, or stand in for
    it where it holds none of any joint. contact, output: largest relative error of the receptances over the range.
    """

    joint: str
    first_mode: int
    full_hz: tuple[float, ...]
    reduced_hz: tuple[float, ...]
    within: tuple[bool, ...]
    contact: float
    output: float
    other_hz: tuple[float, ...] | None

    @property
    def modes_error(self) -> tuple[float, ...]:
        """Relative error of each natural frequency by the modes left out."""
        return tuple(found / exact - 1.0 for found, exact in zip(self.reduced_hz, self.full_hz, strict=True))

    def mesh_error(self, convergence: float) -> tuple[float, ...]:
        """Estimated relative error of each natural frequency by the mesh, see `ModelErrors`; NaN: not known."""
        if self.other_hz is None:
            return (math.nan,) * len(self.full_hz)
        absolute = [convergence * (here - other) for here, other in zip(self.full_hz, self.other_hz, strict=True)]
        return tuple(error / (here - error) for error, here in zip(absolute, self.full_hz, strict=True))


@dataclass(frozen=True)
class ModelErrors:
    """Errors of a reduced model in one operation.

    modes: fixed-interface modes kept; dofs, size [m], element: of the mesh at hand; other: the mesh it is compared
    with, None for the `reason`; convergence: error of the mesh at hand over its difference from the other; static:
    relative error of the contact flexibility.
    """

    modes: int
    dofs: int
    size: float
    element: str
    other: OtherMesh | None
    reason: str
    convergence: float
    static: float
    joints: tuple[JointErrors, ...]

    @property
    def modes_frequency(self) -> float:
        """Largest relative error of a natural frequency in the range by the modes left out."""
        return _largest((joint.modes_error, joint.within) for joint in self.joints)

    @property
    def receptance(self) -> float:
        """Largest relative error of a receptance over the range."""
        return max(max(joint.contact, joint.output) for joint in self.joints)

    @property
    def mesh_frequency(self) -> float:
        """Largest estimated relative error of a natural frequency in the range by the mesh; NaN where not known."""
        return _largest((joint.mesh_error(self.convergence), joint.within) for joint in self.joints)

    def plain(self) -> dict[str, Any]:
        """Plain lists and numbers, with the errors that follow from the frequencies."""
        values = asdict(self)
        for joint, table in zip(self.joints, values["joints"], strict=True):
            table["modes_error"] = list(joint.modes_error)
            table["mesh_error"] = list(joint.mesh_error(self.convergence))
        return values

    @classmethod
    def of_plain(cls, values: dict[str, Any]) -> ModelErrors:
        """What `plain` was made of."""
        joints = tuple(_joint(table) for table in values["joints"])
        other = values["other"]
        return cls(**{**values, "joints": joints, "other": None if other is None else OtherMesh(**other)})


def _joint(table: dict[str, Any]) -> JointErrors:
    names = JointErrors.__dataclass_fields__
    values: dict[str, Any] = {
        name: tuple(value) if isinstance(value, list) else value for name, value in table.items() if name in names
    }
    return JointErrors(**values)


def _largest(errors: Iterable[tuple[tuple[float, ...], tuple[bool, ...]]]) -> float:
    """Largest modulus of the errors that count."""
    counted = [abs(e) for values, within in errors for e, counts in zip(values, within, strict=True) if counts]
    return math.nan if any(math.isnan(error) for error in counted) else max(counted, default=0.0)
