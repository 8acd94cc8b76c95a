"""An elastic damper as a third body of a mesh: the stiffer, the nearer to a rigid body between the platforms."""

from dataclasses import fields, replace

import numpy as np
import pytest

from benchmarks.root_mesh import N_BLADES, root_mesh
from geometry import SectorMesh
from geometry.own_mesh.own_sector import sector_from_mesh
from geometry.own_mesh.sector_choice import InterfaceChoice
from geometry.own_mesh.sector_choice import SectorChoice as Choice
from rom import (
    BoundaryChoice,
    ContactInterface,
    FullModel,
    Material,
    ReducedModel,
    ReductionOptions,
    assemble,
    modal_model,
    natural_frequencies,
    reduce_sector,
    with_interfaces,
)
from rom.cyclic.reduced_model import interfaces_of
from rom.cyclic_sector.cyclic_faces import cyclic_faces
from rom.cyclic_sector.interface_motion import interface_motion
from rom.reduction.contact_dofs import contact_nodes
from rom.reduction.rigid_body import RigidBody, with_rigid_body

SETS = {"root": "BORE", "tip": "TIP", "cyclic_right": "CYCLIC_HIGH", "cyclic_left": "CYCLIC_LOW"}
FACES = {
    "root": InterfaceChoice("BLADE_FLANKS", "DISK_FLANKS", "inside"),
    "damper": InterfaceChoice("PLATFORM_RIGHT", "DAMPER_OWN", "inside"),
    "next": InterfaceChoice("DAMPER_NEXT", "PLATFORM_LEFT"),
}
NODES = {"root": 8, "damper": 4, "next": 4}


@pytest.fixture(scope="module")
def sector() -> SectorMesh:
    return sector_from_mesh(
        root_mesh(damper=True), Choice(N_BLADES, sets=SETS, contact_grid=(2, 2), interfaces=FACES)
    ).sector


def reduced(sector: SectorMesh, factor: float) -> tuple[FullModel, ReducedModel]:
    """With a damper stiffer than steel by a factor."""
    steel = Material(2.1e11, 0.3, 7850.0)
    materials = {"STEEL": steel, "DAMPER": Material(factor * 2.1e11, 0.3, 7850.0)}
    full = assemble(sector, materials, element=None)
    boundary = interface_motion(full, sector, cyclic_faces(full, sector), BoundaryChoice())
    return full, reduce_sector(full, sector, ReductionOptions(20), boundary).model


def rigid_body(full: FullModel) -> RigidBody:
    """The damper: its mass, centre and moments of inertia by the mass matrix of the mesh."""
    nodes = min(full.floating, key=len)
    dofs = (3 * nodes[:, None] + np.arange(3)).ravel()
    mass, at = full.mass[dofs][:, dofs], full.positions[nodes]
    along = np.tile(np.eye(3)[0], len(nodes))
    total = along @ mass @ along
    centre = np.array([np.tile(axis, len(nodes)) @ mass @ at.ravel() for axis in np.eye(3)]) / total
    turning = [np.cross(axis, at - centre).ravel() for axis in np.eye(3)]
    return RigidBody(float(total), centre, np.array([turn @ mass @ turn for turn in turning]))


def with_rigid_damper(sector: SectorMesh, full: FullModel, model: ReducedModel) -> ReducedModel:
    """The model without the contact dofs of the damper, and with a rigid body that has these instead."""
    right, left = 3 * (NODES["root"] + NODES["damper"]), 3 * (sum(NODES.values()) + NODES["root"])
    gone = np.concatenate([right + np.arange(12), left + np.arange(12)])
    keep, changed = np.setdiff1d(np.arange(model.size), gone), {}
    for each in fields(model):
        value = getattr(model, each.name)
        if isinstance(value, np.ndarray) and value.shape[-1] == model.size:
            square = value.shape == (model.size, model.size)
            changed[each.name] = value[np.ix_(keep, keep)] if square else value[..., keep]
    outputs = {name: row[keep] for name, row in model.outputs.items()}
    body = rigid_body(full)
    wider = with_rigid_body(replace(model, **changed, outputs=outputs), body)
    known, nodes = {each.name: each for each in interfaces_of(wider)}, contact_nodes(sector, "mortar").split()
    own, ahead = np.zeros((2, 12, wider.size))
    own[:, -6:] = body.rows(nodes["damper"].position, nodes["damper"].frame)
    ahead[:, -6:] = body.rows(nodes["next"].position, nodes["next"].frame)
    inside = ContactInterface(known["damper"].right, known["damper"].position, own, inside=True, name="damper")
    following = ContactInterface(ahead, known["next"].position, known["next"].left, name="next")
    return with_interfaces(wider, replace(known["root"], area=None), inside, following)


def test_a_stiff_damper_is_a_rigid_body(sector):
    springs = np.repeat([1e8 / 8.0, 2e8 / 4.0, 2e8 / 4.0], [NODES[name] for name in NODES])
    full, model = reduced(sector, 1.0)
    assert model.interfaces == NODES
    assert [modal_model(model, damping_ratio=0.01).at(n).floating for n in (0, 3, 20)] == [12] * 3
    rigid, stiffer = with_rigid_damper(sector, full, model), [reduced(sector, 10.0**k)[1] for k in (2, 3, 5)]
    for diameter in (0, 3, 12):
        phase = 2.0 * np.pi * diameter / N_BLADES
        found = [
            natural_frequencies(each, phase, normal=springs, tangential=springs, count=6)
            for each in (*stiffer, rigid)
        ]
        assert found[2] == pytest.approx(found[3], rel=1e-4)  # products of inertia are left out
        slow, fast = (np.abs(each / found[2] - 1.0).max() for each in found[:2])
        assert slow / fast == pytest.approx(10.0, rel=0.1)  # its compliance falls as 1 / E
