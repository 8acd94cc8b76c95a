"""Errors of one reduced model: plain data for the store, the table and the JSON output."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from pipeline.codec import plain

# Order of the error of the frequencies in the element size where three meshes tell none. Quadratic elements have
# fourth order on smooth solutions; the singularities at re-entrant corners reduce it to little more than one.
ORDER = 1.0
_HIGHEST = 4.0
_FITS = 24  # bisections


def fitted_order(sizes: Sequence[float], frequencies: Sequence[float]) -> float:
    """Order p of f = f0 + c h^p through three element sizes; `ORDER` where there is none from it to 4.

    References
    ----------
    I. B. Celik et al., Journal of Fluids Engineering 130 (2008) 078001: the apparent order.
    """
    (h1, h2, h3), (f1, f2, f3) = zip(*sorted(zip(sizes, frequencies, strict=True)), strict=True)
    if not (f3 - f2) * (f2 - f1) > 0.0:  # not monotone
        return ORDER

    def excess(order: float) -> float:
        return (h3**order - h2**order) / (h2**order - h1**order) - (f3 - f2) / (f2 - f1)

    low, high = ORDER, _HIGHEST
    if excess(low) >= 0.0:
        return ORDER
    if excess(high) <= 0.0:  # faster than the elements converge: the coarse meshes are not in the asymptotic range
        return ORDER
    for _ in range(_FITS):
        middle = (low + high) / 2.0
        low, high = (middle, high) if excess(middle) < 0.0 else (low, middle)
    return low


@dataclass(frozen=True)
class OtherMesh:
    """The mesh that the scene's mesh is compared with: element size [m], element, dofs."""

    size: float
    element: str
    dofs: int


@dataclass(frozen=True)
class JointErrors:
    """Errors with the shrouds in one contact condition."""

    joint: str  # the contact condition: free, sliding or stuck
    first_mode: int  # number of the first mode compared
    # `full_hz`, `reduced_hz`: natural frequencies of the full and the reduced model, Hz
    full_hz: tuple[float, ...]
    reduced_hz: tuple[float, ...]
    # whether a frequency counts: it lies in the range, or is the first above a range that holds none
    within: tuple[bool, ...]
    contact: float  # largest relative error of the receptances of the contact nodes and of the output over the range
    output: float  # largest relative error of the receptances of the contact nodes and of the output over the range
    # natural frequencies of the full model with its springs spread over the face; None where a stiffness is given
    # node by node
    face_hz: tuple[float, ...] | None
    # natural frequencies of the full model on the other mesh, None without such a mesh; with springs spread over the
    # face where `face_hz` has them
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

    def mesh_error(self, factors: Sequence[float]) -> tuple[float, ...]:
        """Estimated relative mesh error of each natural frequency, NaN: not known (`factors`: of `ModelErrors`)."""
        if self.other_hz is None:
            return (math.nan,) * len(self.full_hz)
        meshed = self.full_hz if self.face_hz is None else self.face_hz
        pairs = zip(factors, meshed, self.other_hz, strict=True)
        absolute = [factor * (here - other) for factor, here, other in pairs]
        return tuple(error / (here - error) for error, here in zip(absolute, meshed, strict=True))


@dataclass(frozen=True)
class ModelErrors:
    """Errors of a reduced model in one operation."""

    modes: int  # fixed-interface modes
    # degrees of freedom, element size [m] and element of the scene's mesh; of a mesh from a file the mean length of
    # its edges and its kinds of elements
    dofs: int
    # degrees of freedom, element size [m] and element of the scene's mesh; of a mesh from a file the mean length of
    # its edges and its kinds of elements
    size: float
    # degrees of freedom, element size [m] and element of the scene's mesh; of a mesh from a file the mean length of
    # its edges and its kinds of elements
    element: str
    contact_grid: tuple[int, int]  # contact nodes of the scene along the segment and along the radius
    other: OtherMesh | None  # the mesh it is compared with
    reason: str  # why there is no other mesh, otherwise ""
    static: float  # relative error of the contact flexibility
    # largest relative error of a natural frequency in the range by the linear equilibrium at speed; None where the
    # nonlinear one is used or nothing rotates
    equilibrium: float | None
    joints: tuple[JointErrors, ...]  # errors in each contact condition
    # order of the error of each mode with free contacts in the element size, the lowest mode first: fitted to the
    # natural frequencies on a third mesh, and `ORDER` where they tell none; empty without a third mesh
    orders: tuple[float, ...] = ()
    third: OtherMesh | None = None  # that mesh

    def order(self, mode: int) -> float:
        """Order of the error of a mode by its number from 1: its own with free contacts, or else the lowest known."""
        known = self.orders[mode - 1 : mode] or self.orders
        return min(known, default=ORDER)

    def factors(self, joint: JointErrors) -> tuple[float, ...]:
        """Error of the mesh over its difference from the other one, for each mode, by Richardson extrapolation."""
        if self.other is None:
            return (math.nan,) * len(joint.full_hz)
        if self.other.element != self.element:  # so much more accurate that it stands for the limit
            return (1.0,) * len(joint.full_hz)
        ratio = self.other.size / self.size
        modes = range(joint.first_mode, joint.first_mode + len(joint.full_hz))
        return tuple(1.0 / (1.0 - ratio ** self.order(mode)) for mode in modes)

    @property
    def worst_order(self) -> float:
        """Order of the mode with the largest mesh error in the range."""
        found = [
            (abs(error), self.order(joint.first_mode + k))
            for joint in self.joints
            for k, error in enumerate(joint.mesh_error(self.factors(joint)))
            if joint.within[k] and not math.isnan(error)
        ]
        return max(found, default=(0.0, ORDER))[1]

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
        return _largest((joint.mesh_error(self.factors(joint)), joint.within) for joint in self.joints)

    def printed(self) -> dict[str, Any]:
        """The errors as values for JSON, with those of each joint that follow from its frequencies."""
        values: dict[str, Any] = plain(self)
        for joint, table in zip(self.joints, values["joints"], strict=True):
            table["modes_error"] = plain(joint.modes_error)
            table["contact_error"] = plain(joint.contact_error)
            table["mesh_error"] = plain(joint.mesh_error(self.factors(joint)))
        return values


def _largest(errors: Iterable[tuple[tuple[float, ...], tuple[bool, ...]]]) -> float:
    """Largest modulus of the errors that count."""
    counted = [abs(e) for values, within in errors for e, counts in zip(values, within, strict=True) if counts]
    return math.nan if any(math.isnan(error) for error in counted) else max(counted, default=0.0)
