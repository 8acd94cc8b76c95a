"""Errors of one reduced model: plain data for the store, the table and the JSON output."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from typing import Any


@dataclass(frozen=True)
class OtherMesh:
    """The mesh that the scene's mesh is compared with: element size [m], element, dofs."""

    size: float
    element: str
    dofs: int


@dataclass(frozen=True)
class JointErrors:
    """Errors with the shrouds in one contact condition.

    Attributes
    ----------
    joint : str
        The contact condition: free, sliding or stuck.
    first_mode : int
        Number of the first mode compared.
    full_hz, reduced_hz : tuple of float
        Natural frequencies of the full and the reduced model, Hz.
    within : tuple of bool
        Whether a frequency counts: it lies in the range, or is the first above a range that holds none.
    contact, output : float
        Largest relative error of the receptances of the contact nodes and of the output over the range.
    face_hz : tuple of float or None
        Natural frequencies of the full model with its springs spread over the face; None where a stiffness is given
        node by node.
    other_hz : tuple of float or None
        Natural frequencies of the full model on the other mesh, None without such a mesh; with springs spread over
        the face where `face_hz` has them.
    """

    joint: str
    first_mode: int
    full_hz: tuple[float, ...]
    reduced_hz: tuple[float, ...]
    within: tuple[bool, ...]
    contact: float
    output: float
    face_hz: tuple[float, ...] | None
    other_hz: tuple[float, ...] | None

    @property
    def modes_error(self) -> tuple[float, ...]:
        """Modal truncation error of each natural frequency, relative."""
        return tuple(found / exact - 1.0 for found, exact in zip(self.reduced_hz, self.full_hz, strict=True))

    @property
    def contact_error(self) -> tuple[float, ...]:
        """Error of each natural frequency due to the contact dofs, relative; NaN: not known."""
        if self.face_hz is None:
            return (math.nan,) * len(self.full_hz)
        if self.joint == "free":  # without springs: the rest is round-off
            return (0.0,) * len(self.full_hz)
        return tuple(found / exact - 1.0 for found, exact in zip(self.full_hz, self.face_hz, strict=True))

    def mesh_error(self, convergence: float) -> tuple[float, ...]:
        """Estimated relative mesh error of each natural frequency, NaN: not known (`convergence`: `ModelErrors`)."""
        if self.other_hz is None:
            return (math.nan,) * len(self.full_hz)
        meshed = self.full_hz if self.face_hz is None else self.face_hz
        absolute = [convergence * (here - other) for here, other in zip(meshed, self.other_hz, strict=True)]
        return tuple(error / (here - error) for error, here in zip(absolute, meshed, strict=True))


@dataclass(frozen=True)
class ModelErrors:
    """Errors of a reduced model in one operation.

    Attributes
    ----------
    modes : int
        Fixed-interface modes.
    dofs, size, element : int, float, str
        Degrees of freedom, element size [m] and element of the scene's mesh; of a mesh from a file the mean length of
        its edges and its kinds of elements.
    contact_grid : (int, int)
        Contact nodes of the scene along the segment and along the radius.
    other : OtherMesh or None
        The mesh it is compared with.
    reason : str
        Why there is no other mesh, otherwise "".
    convergence : float
        Error of the scene's mesh over its difference from the other mesh.
    static : float
        Relative error of the contact flexibility.
    equilibrium : float or None
        Largest relative error of a natural frequency in the range by the linear equilibrium at speed; None where the
        nonlinear one is used or nothing rotates.
    joints : tuple of JointErrors
        Errors in each contact condition.
    """

    modes: int
    dofs: int
    size: float
    element: str
    contact_grid: tuple[int, int]
    other: OtherMesh | None
    reason: str
    convergence: float
    static: float
    equilibrium: float | None
    joints: tuple[JointErrors, ...]

    @property
    def modes_frequency(self) -> float:
        """Largest modal truncation error of a natural frequency in the range, relative."""
        return _largest((joint.modes_error, joint.within) for joint in self.joints)

    @property
    def receptance(self) -> float:
        """Largest relative error of a receptance over the range."""
        return max(max(joint.contact, joint.output) for joint in self.joints)

    @property
    def contact_frequency(self) -> float:
        """Largest error of a natural frequency in the range due to the contact dofs, relative; NaN: not known."""
        return _largest((joint.contact_error, joint.within) for joint in self.joints)

    @property
    def mesh_frequency(self) -> float:
        """Largest estimated mesh error of a natural frequency in the range, relative; NaN: not known."""
        return _largest((joint.mesh_error(self.convergence), joint.within) for joint in self.joints)

    def plain(self) -> dict[str, Any]:
        """The errors as lists and numbers, for JSON."""
        values = asdict(self)
        for joint, table in zip(self.joints, values["joints"], strict=True):
            table["modes_error"] = list(joint.modes_error)
            table["contact_error"] = list(joint.contact_error)
            table["mesh_error"] = list(joint.mesh_error(self.convergence))
        return values

    @classmethod
    def of_plain(cls, values: dict[str, Any]) -> ModelErrors:
        """The inverse of `plain`."""
        joints = tuple(_joint(table) for table in values["joints"])
        other = values["other"]
        read = {
            "joints": joints,
            "contact_grid": tuple(values["contact_grid"]),
            "other": None if other is None else OtherMesh(**other),
        }
        return cls(**(values | read))


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
