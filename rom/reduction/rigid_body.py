"""Rigid bodies that contacts alone hold: a damper under the platforms of two neighbouring blades.

A body has six coordinates, the displacement u of its centre of mass and a small rotation w. A point at p moves by
u + w x (p - c), so that the rows of a contact node with the frame F (rows t1, t2, n) are F [I, -(p - c)_x]. The body
belongs to the sector whose right flank it touches; the left flank that it touches is that of the next blade.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import cos, pi, sin, sqrt
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rom.cyclic.reduced_model import ContactInterface, ReducedModel, interfaces_of, with_interfaces
from rom.errors import ReducedModelError
from rom.reduction.mortar_dofs import contact_grid

if TYPE_CHECKING:
    from geometry.sector import SectorMesh

Array = NDArray[np.float64]
COORDINATES = 6


@dataclass(frozen=True)
class RigidBody:
    """A rigid body."""

    mass: float  # mass, kg
    centre: ArrayLike  # (3,) centre of mass, m
    inertia: ArrayLike  # (3,) moments of inertia about the axes x, y, z through the centre, kg m^2: principal axes
    # (6,) stiffness of what locates it along and about x, y, z, N/m and N m/rad; 0 by default
    springs: ArrayLike = (0.0,) * COORDINATES

    def __post_init__(self) -> None:
        """Check the signs."""
        for name, values, least in (
            ("mass", [self.mass], np.nextafter(0.0, 1.0)),
            ("inertia", self.inertia, np.nextafter(0.0, 1.0)),
            ("springs", self.springs, 0.0),
        ):
            if not np.all(np.asarray(values) >= least) or not np.all(np.isfinite(np.asarray(values))):
                raise ReducedModelError(
                    f"rigid body: {name}: {values}, allowed: {'0 or more' if not least else 'above 0'}"
                )

    def rows(self, position: Array, frame: Array) -> Array:
        """Displacement t1, t2, n of points for unit coordinates, (3 n, 6).

        `position` (n, 3): points, m; `frame` (n, 3, 3): directions t1, t2, n at each.
        """
        arm = position - np.asarray(self.centre, dtype=float)
        turning = np.cross(np.eye(3)[None], arm[:, None, :])  # row a: of a rotation about axis a
        motion = np.concatenate([np.tile(np.eye(3), (len(arm), 1, 1)), turning.transpose(0, 2, 1)], axis=2)
        return np.asarray((frame @ motion).reshape(-1, COORDINATES))

    @property
    def centrifugal(self) -> Array:
        """Centrifugal force at 1 rad/s about the engine axis x, (6,), N."""
        _, y, z = np.asarray(self.centre, dtype=float)
        return self.mass * np.array([0.0, y, z, 0.0, 0.0, 0.0])


def with_rigid_body(model: ReducedModel, body: RigidBody) -> ReducedModel:
    """The model with the coordinates of a rigid body behind its own; no contact touches it yet."""
    if model.wave_blocks:
        raise ReducedModelError("rigid body: given with nodal_diameter/N, allowed: a model with one set of matrices")

    def wider(rows: NDArray[Any] | None) -> Any:
        return None if rows is None else np.pad(rows, [*[(0, 0)] * (rows.ndim - 1), (0, COORDINATES)])

    def larger(matrix: Array | None, own: ArrayLike = (0.0,) * COORDINATES) -> Any:
        if matrix is None:
            return None
        found = np.pad(matrix, (0, COORDINATES))
        place = np.arange(model.size, model.size + COORDINATES)
        found[place, place] = own
        return found

    centrifugal = wider(np.zeros(model.size) if model.force_centrifugal is None else model.force_centrifugal)
    centrifugal[model.size :] = body.centrifugal
    return replace(
        model,
        mass=larger(model.mass, [*[body.mass] * 3, *np.asarray(body.inertia, dtype=float)]),
        stiffness=larger(model.stiffness, body.springs),
        coriolis=larger(model.coriolis),
        blade_stiffness=larger(model.blade_stiffness),
        force_centrifugal=centrifugal,
        outputs={name: wider(row) for name, row in model.outputs.items()},
        force_harmonics={h: wider(row) for h, row in model.force_harmonics.items()},
        **{
            name: wider(getattr(model, name))
            for name in (
                "contact_right",
                "contact_left",
                "force_excitation",
                "force_static",
                "cyclic_right",
                "cyclic_left",
                "basis",
            )
        },
    )


def platform_damper(
    sector: SectorMesh,
    form: Literal["wedge", "cylinder"],
    mass: float,
    *,
    radius: float | None = None,
    inertia: ArrayLike | None = None,
    axial_stiffness: float = 0.0,
    pair: str = "platform",
) -> RigidBody:
    """A damper between the flanks of platforms: a wedge that fills their roof, or a cylinder on their middle lines.

    The flanks rise towards the plane midway between two blades, where the ridge of the roof would be. The section of
    the wedge is the triangle below it, of base b and height h; its centre lies h / 3 above the base.

    `mass`: kg; `radius`: radius of its centre of mass, m; by default that of the form; `inertia` (3,): moments of
    inertia about x, the circumference and the radius, kg m^2; by default those of the form.
    """
    view, middle = sector.seen_from(pair), pi / sector.n_blades
    across = np.array([0.0, -cos(middle), sin(middle)])  # from the plane midway towards the blade
    upward = np.array([0.0, sin(middle), cos(middle)])
    points = sector.points[view.node_sets["face_right"]]
    normal = view.right.frame[:, 2].mean(axis=0)
    length, slope = float(np.ptp(points[:, 0])), abs(float(normal @ across) / float(normal @ upward))
    half, outer = float((points @ across).max()), float((points @ upward).min())
    if form == "wedge":
        b, h = 2.0 * half, half * slope
        natural = outer + h / 3.0
        moments = [h**2 / 18.0 + b**2 / 24.0, length**2 / 12.0 + h**2 / 18.0, length**2 / 12.0 + b**2 / 24.0]
    else:
        line = view.right.position.mean(axis=0)
        a = float(line @ across) * sqrt(1.0 + 1.0 / slope**2)
        natural = float(line @ upward) - a / sqrt(1.0 + slope**2)
        moments = [a**2 / 2.0, *[(3.0 * a**2 + length**2) / 12.0] * 2]
    centre = (natural if radius is None else radius) * upward
    centre[0] = points[:, 0].mean()
    given = mass * np.array(moments) if inertia is None else inertia
    return RigidBody(mass, centre, given, [axial_stiffness, *[0.0] * 5])


def with_damper(model: ReducedModel, body: RigidBody, *, pair: str = "platform", line: bool = False) -> ReducedModel:
    """The model with a rigid damper between the platforms of neighbours.

    The pair of faces of the platforms becomes two contact interfaces, of the own platform against the damper inside
    the sector, and of the next one's against it. The faces are mirror images in the plane midway between two blades.

    Returns the model with the interfaces "damper_right" and "damper_left" in place of the pair, and with the
    displacements of the damper as outputs "damper_x", "damper_y" and "damper_z".
    """
    if pair not in model.interfaces:
        raise ReducedModelError(f"contact/interfaces: no {pair}, allowed: {', '.join(model.interfaces)}")
    wider = with_rigid_body(model, body)
    known = {each.name: each for each in interfaces_of(wider)}
    flank = known[pair]
    if flank.frame is None or flank.left is None or model.n_blades is None:
        missing = "contact/frame" if flank.frame is None else "contact/left" if flank.left is None else "n_blades"
        raise ReducedModelError(f"{missing}: missing, allowed with a damper: a ring with frames of its contact nodes")
    chosen = _middle(flank) if line else np.arange(len(flank.position))
    touching = _against_body(flank, chosen, body, pi / model.n_blades)
    found = with_interfaces(wider, *(each for name, each in known.items() if name != pair), *touching)
    moving = {f"damper_{axis}": np.eye(wider.size)[model.size + k] for k, axis in enumerate("xyz")}
    return replace(found, outputs={**found.outputs, **moving})


def _against_body(
    flank: ContactInterface, chosen: NDArray[np.int64], body: RigidBody, middle: float
) -> tuple[ContactInterface, ContactInterface]:
    """The chosen nodes of the right flank against the body, whose coordinates are the last ones, and of the next left
    flank: the mirror image in the plane at the angle `middle` between the blades.
    """
    rows = (3 * chosen[:, None] + np.arange(3)).ravel()
    assert flank.left is not None
    assert flank.frame is not None
    normal = np.array([0.0, cos(middle), -sin(middle)])
    mirror = np.eye(3) - 2.0 * np.outer(normal, normal)
    place, frame = flank.position[chosen], flank.frame[chosen]
    sides = (place, frame), (place @ mirror, frame @ mirror)
    on_body = np.zeros((2, len(rows), flank.right.shape[1]))
    for found, side in zip(on_body, sides, strict=True):
        found[:, -COORDINATES:] = body.rows(*side)
    area = None if flank.area is None else flank.area[chosen]
    return (
        ContactInterface(
            flank.right[rows], place, on_body[0], inside=True, area=area, name="damper_right", frame=frame
        ),
        ContactInterface(
            -on_body[1], sides[1][0], -flank.left[rows], area=area, name="damper_left", frame=sides[1][1]
        ),
    )


def _middle(flank: ContactInterface) -> NDArray[np.int64]:
    """Nodes of the middle row of a grid of contact nodes."""
    assert flank.frame is not None
    along, rows = contact_grid(flank.position, flank.frame)
    if rows % 2 == 0:
        raise ReducedModelError(f"damper: {rows} rows of contact nodes on a flank, allowed: an odd number for a line")
    return np.arange(along * rows).reshape(rows, along)[rows // 2]
