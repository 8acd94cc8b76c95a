"""Rigid bodies that contacts alone hold: a damper under the platforms of two neighbouring blades.

A body has six coordinates, the displacement u of its centre of mass and a small rotation w. A point at p moves by
u + w x (p - c), so that the rows of a contact node with the frame F (rows t1, t2, n) are F [I, -(p - c)_x]. The body
belongs to the sector whose right flank it touches; the left flank that it touches is that of the next blade.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import pi
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from geometry import rotate_about_axis
from rom.cyclic.reduced_model import ContactInterface, ReducedModel, interfaces_of, with_interfaces
from rom.errors import ReducedModelError
from rom.reduction.contact_dofs import ContactDofs, averaged_dofs, nodal_dofs
from rom.reduction.mortar_dofs import Grid, contact_grid

if TYPE_CHECKING:
    from geometry import SectorMesh

Array = NDArray[np.float64]
COORDINATES = 6


@dataclass(frozen=True)
class RigidBody:
    """A rigid body.

    Attributes
    ----------
    mass : float
        Mass, kg.
    centre : (3,) array
        Centre of mass, m.
    inertia : (3,) array
        Moments of inertia about the axes x, y, z through the centre, kg m^2: principal axes.
    springs : (6,) array
        Stiffness of what locates it along and about x, y, z, N/m and N m/rad; 0 by default.

    Raises
    ------
    ReducedModelError
        Mass or inertia is not above 0, or a spring is below 0.

    Examples
    --------
    A point beside the centre moves when the body turns:

    >>> from rom import RigidBody
    >>> body = RigidBody(0.02, np.zeros(3), np.full(3, 1e-6))
    >>> body.rows(np.array([[0.0, 0.01, 0.0]]), np.eye(3)[None]).round(3)[0] @ np.eye(6)[5]  # about z
    np.float64(-0.01)
    """

    mass: float
    centre: ArrayLike
    inertia: ArrayLike
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

        Parameters
        ----------
        position : (n, 3) array
            Points, m.
        frame : (n, 3, 3) array
            Directions t1, t2, n at each.
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
    """The model with the coordinates of a rigid body behind its own; no contact touches it yet.

    Parameters
    ----------
    model : ReducedModel
        The model.
    body : RigidBody
        The body, one in each sector.

    Returns
    -------
    ReducedModel
        The model.

    Examples
    --------
    >>> from rom import ReducedModel, RigidBody, with_rigid_body
    >>> n, one = np.outer([0.0, 0.0, 1.0], np.ones(1)), np.ones(1)
    >>> model = ReducedModel(np.eye(1), np.eye(1), n, np.zeros((1, 3)), one, {"tip": one})
    >>> with_rigid_body(model, RigidBody(0.1, np.array([0.0, 0.0, 0.3]), np.full(3, 1e-6))).size
    7
    """
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


def with_damper(
    model: ReducedModel,
    sector: SectorMesh,
    body: RigidBody,
    *,
    element: str | None = None,
    contact_dofs: str = "mortar",
    pair: str = "platform",
    line: bool = False,
) -> ReducedModel:
    """The model with a rigid damper between the platforms of neighbours.

    The pair of faces of the platforms becomes two contact interfaces, of the own platform against the damper inside
    the sector, and of the next one's against it.

    Parameters
    ----------
    model : ReducedModel
        The model, with an interface of the pair of faces.
    sector : SectorMesh
        Its mesh.
    body : RigidBody
        The damper.
    element : str, optional
        Finite element of the mesh, as in `assemble`.
    contact_dofs : {"mortar", "patch", "nodal"}
        Contact dofs of the model.
    pair : str
        Name of the pair of faces.
    line : bool
        Whether only the middle line of the faces along the first tangent touches, as of a cylinder.

    Returns
    -------
    ReducedModel
        The model with the interfaces "damper_right" and "damper_left" in place of the pair, and with the
        displacements of the damper as outputs "damper_x", "damper_y" and "damper_z".

    Raises
    ------
    ReducedModelError
        The model has no such interface, or the faces have no middle line.

    Examples
    --------
    >>> from geometry import BladeParameters, MeshParameters, PlatformParameters, ShroudParameters, build_sector
    >>> from rom import Material, ReductionOptions, RigidBody, assemble, reduce_sector, with_damper
    >>> blade, shroud = BladeParameters(40, 0.3, 0.1, 0.02, 0.008), ShroudParameters(45.0, 0.01, 0.04, 0.01)
    >>> platform, mesh = PlatformParameters(0.32, 0.006), MeshParameters(size=0.005, contact_grid=(2, 2))
    >>> sector = build_sector(blade, shroud, mesh, platform=platform)
    >>> full = assemble(sector, Material(2e11, 0.3, 7800.0), element="hex8")
    >>> model = reduce_sector(full, sector, ReductionOptions(modes=4)).model
    >>> body = RigidBody(0.01, np.array([0.0, 0.0252, 0.317]), np.full(3, 1e-7))
    >>> dict(with_damper(model, sector, body, element="hex8").interfaces)
    {'shroud': 4, 'damper_right': 4, 'damper_left': 4}
    """
    if pair not in model.interfaces:
        raise ReducedModelError(f"contact/interfaces: no {pair}, allowed: {', '.join(model.interfaces)}")
    wider = with_rigid_body(model, body)
    known = {each.name: each for each in interfaces_of(wider)}
    view = sector.seen_from(pair)
    dofs = _flank_dofs(view, element, contact_dofs)
    chosen = _middle(contact_grid(view.right)) if line else np.arange(dofs.count)
    touching = _against_body(known[pair], dofs, chosen, body, 2.0 * pi / sector.n_blades)
    found = with_interfaces(wider, *(each for name, each in known.items() if name != pair), *touching)
    moving = {f"damper_{axis}": np.eye(wider.size)[model.size + k] for k, axis in enumerate("xyz")}
    return replace(found, outputs={**found.outputs, **moving})


def _flank_dofs(view: SectorMesh, element: str | None, kind: str) -> ContactDofs:
    """Contact dofs of the flanks."""
    if kind == "nodal":
        return nodal_dofs(view, np.arange(len(view.points)), len(view.points))
    return averaged_dofs(view, element, kind)


def _against_body(
    flank: ContactInterface, dofs: ContactDofs, chosen: NDArray[np.int64], body: RigidBody, pitch: float
) -> tuple[ContactInterface, ContactInterface]:
    """The chosen nodes of the right flank against the body, whose coordinates are the last ones, and of the left."""
    rows = (3 * chosen[:, None] + np.arange(3)).ravel()
    assert flank.left is not None
    frames = dofs.frames[: dofs.count], rotate_about_axis(dofs.frames[dofs.count :], pitch)
    places = dofs.position[chosen], _opposite(dofs.position[chosen], pitch)
    on_body = np.zeros((2, len(rows), flank.right.shape[1]))
    for found, frame, place in zip(on_body, frames, places, strict=True):
        found[:, -COORDINATES:] = body.rows(place, frame[chosen])
    area = None if flank.area is None else flank.area[chosen]
    return (
        ContactInterface(flank.right[rows], places[0], on_body[0], inside=True, area=area, name="damper_right"),
        ContactInterface(-on_body[1], places[1], -flank.left[rows], area=area, name="damper_left"),
    )


def _opposite(position: Array, pitch: float) -> Array:
    """Points (n, 3) on the left flank of the next blade: the mirror images in the plane midway between the blades."""
    normal = np.array([0.0, np.cos(pitch / 2.0), -np.sin(pitch / 2.0)])
    return np.asarray(position - 2.0 * np.outer(position @ normal, normal))


def _middle(grid: Grid) -> NDArray[np.int64]:
    """Nodes of the middle row of a grid of contact nodes."""
    along, rows = grid
    if rows % 2 == 0:
        raise ReducedModelError(f"damper: {rows} rows of contact nodes on a flank, allowed: an odd number for a line")
    return np.arange(along * rows).reshape(rows, along)[rows // 2]
