"""A blade that contacts alone hold in the slot of a disk: against merged nodes, closed forms and a clamped root."""

from functools import cache

import numpy as np
import pytest

from benchmarks.root_mesh import FLANK, N_BLADES, root_mesh
from geometry import ElementBlock, ImportedMesh
from geometry.own_mesh.own_sector import sector_from_mesh
from geometry.own_mesh.sector_choice import InterfaceChoice, SectorChoice
from nonlinear import ContactParameters, SolverOptions
from nonlinear.harmonic_balance.initial_solution import on_support, static_displacement
from rom import (
    BoundaryChoice,
    FullModel,
    Material,
    ReducedModel,
    ReductionOptions,
    assemble,
    modal_model,
    natural_frequencies,
    reduce_sector,
)
from rom.cyclic.natural_frequencies import coupled_frequencies
from rom.cyclic.receptance import RelativeReceptance
from rom.cyclic_sector.cyclic_faces import cyclic_faces
from rom.cyclic_sector.cyclic_modes import cyclic_modes, static_motion
from rom.cyclic_sector.interface_motion import interface_motion
from rom.finite_elements.rotation import stiffen_by_rotation
from rom.reduction.floating_bodies import stuck_springs
from rom.reduction.reference_model import held_frequencies

STEEL = {"STEEL": Material(2.1e11, 0.3, 7850.0)}
SETS = {"root": "BORE", "tip": "TIP", "cyclic_right": "CYCLIC_HIGH", "cyclic_left": "CYCLIC_LOW"}
ROOT = InterfaceChoice("BLADE_FLANKS", "DISK_FLANKS", "inside")
SPEED = 6000.0
pytestmark = pytest.mark.xdist_group("root")  # one worker: models are made once


@cache
def whole(along_flank: int = 2, speed: float = 0.0, merged: bool = False) -> tuple[FullModel, ReducedModel | None]:
    """Full and reduced model of blade and disk; without the latter where the nodes of the flanks are merged."""
    faces = {"tip": InterfaceChoice("TIP", kind="ground")} if merged else {"root": ROOT}
    choice = SectorChoice(N_BLADES, "m", sets=SETS, contact_grid=(4, 3), interfaces=faces)
    sector = sector_from_mesh(root_mesh(along_flank=along_flank, merged=merged), choice).sector
    full = assemble(sector, STEEL, element=None)
    cuts = cyclic_faces(full, sector)
    if speed:
        motion, springs = static_motion(full, cuts), stuck_springs(full, sector)
        full = stiffen_by_rotation(full, sector, STEEL, speed, motion=motion, springs=springs)
    if merged:
        return full, None
    boundary = interface_motion(full, sector, cuts, BoundaryChoice())
    return full, reduce_sector(full, sector, ReductionOptions(40), boundary).model


def stuck(model: ReducedModel, diameter: int, total: float) -> np.ndarray:
    modal = modal_model(model, damping_ratio=0.01).at(diameter)
    springs = total * model.contact_area / model.contact_area.sum()
    phase = 2.0 * np.pi * diameter / N_BLADES
    return coupled_frequencies(modal, phase, normal=springs, tangential=springs)[:10] / (2.0 * np.pi)


@pytest.mark.parametrize("along_flank", [2, 3])
def test_the_blade_keeps_its_rigid_motions_and_nothing_else_of_the_disk_is_lost(along_flank):
    _, model = whole(along_flank)
    assert model.interfaces == {"root": 24}
    assert model.contact_left is None
    modes = modal_model(model, damping_ratio=0.01)
    assert [modes.at(n).floating for n in (0, 1, 5, 20)] == [6] * 4
    elastic = modes.at(5).angular_frequency[6:10] / (2.0 * np.pi)
    assert natural_frequencies(model, 2.0 * np.pi * 5 / N_BLADES, count=4) == pytest.approx(elastic, rel=1e-9)


@pytest.mark.parametrize("along_flank", [2, 3])
def test_stuck_flanks_become_merged_nodes_as_the_springs_stiffen(along_flank):
    """Ten frequencies at two nodal diameters; the compliance of the springs falls as 1 / kn."""
    full, model = whole(merged=True)[0], whole(along_flank)[1]
    for diameter in (0, 5):
        tied = cyclic_modes(full, cyclic_faces(full, _cut_sector()), diameter, 10).frequency_hz
        found = {total: stuck(model, diameter, total) for total in (1e12, 1e13, 1e14)}
        assert found[1e14] == pytest.approx(tied, rel=0.015)  # a mortar of 4 x 3 nodes ties less than all nodes
        ratio = ((found[1e14] - found[1e12]) / (found[1e14] - found[1e13]))[:5]
        assert ratio == pytest.approx(11.0, rel=0.05)


@cache
def _cut_sector():
    choice = SectorChoice(N_BLADES, "m", sets=SETS, interfaces={"tip": InterfaceChoice("TIP", kind="ground")})
    return sector_from_mesh(root_mesh(merged=True), choice).sector


def test_rotation_stiffens_a_blade_in_its_slot_as_it_stiffens_one_that_is_part_of_the_disk():
    """The share of the contacts in the frequencies is that at rest, and so is what rotation adds."""
    for diameter in (0, 5):
        at_rest, turning = (
            stuck(whole(speed=speed)[1], diameter, 1e13)[:5]
            / cyclic_modes(
                whole(speed=speed, merged=True)[0],
                cyclic_faces(whole(merged=True)[0], _cut_sector()),
                diameter,
                5,
            ).frequency_hz
            for speed in (0.0, SPEED)
        )
        assert turning == pytest.approx(at_rest, rel=3e-4)


@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_flanks_bear_the_centrifugal_force(friction):
    """The root moves outward: N (sin b + mu cos b) = F, b the angle of the flanks to the radius."""
    full, model = whole(speed=SPEED)
    count, options = model.n_contacts, SolverOptions((100.0, 2000.0))
    values = {"normal_stiffness": 4e8, "tangential_stiffness": 3e8, "friction": friction}
    contact = ContactParameters.shared(count, **values, area=model.contact_area)
    modal = modal_model(model, damping_ratio=0.01, speed_rpm=SPEED)
    receptance = on_support(RelativeReceptance(modal, 0.0, (0,), 0.0), contact, options)
    load = contact.normal_load(static_displacement(receptance, contact, options)[:, 2])
    speed = 2.0 * np.pi * SPEED / 60.0
    blade = full.floating[0]
    pull = speed**2 * (full.mass @ (full.positions * [0.0, 1.0, 1.0]).ravel()).reshape(-1, 3)[blade, 2].sum()
    (y0, z0), (y1, z1) = FLANK
    sine, cosine = np.array([y0 - y1, z1 - z0]) / np.hypot(y0 - y1, z1 - z0)
    flanks = load.reshape(2, -1).sum(axis=1)
    assert flanks == pytest.approx([pull / (sine + friction * cosine) / 2.0] * 2, rel=1e-4)


def test_flanks_stuck_on_the_ground_hold_the_blade_as_a_clamped_root_does():
    mesh = root_mesh()
    cells = mesh.blocks[0].nodes
    chosen = cells[(cells < 974).all(axis=1)]  # the blade comes first
    used = np.unique(chosen)
    place = np.full(len(mesh.points), -1)
    place[used] = np.arange(len(used))
    flanks = {name: place[mesh.node_sets[name]] for name in ("BLADE_FLANKS", "TIP")}
    block = (ElementBlock("hex20", place[chosen], "STEEL"),)
    blade = ImportedMesh("blade.inp", mesh.points[used], np.arange(len(used)), block, (), flanks)
    root = InterfaceChoice("BLADE_FLANKS", kind="ground", contact_grid=(4, 3))
    choice = SectorChoice(N_BLADES, sets={"tip": "TIP"}, bore="free", interfaces={"root": root}, other_faces="free")
    sector = sector_from_mesh(blade, choice).sector
    model = reduce_sector(assemble(sector, STEEL, element=None), sector, ReductionOptions(30)).model
    assert model.contact_left is None
    springs = 1e14 * model.contact_area / model.contact_area.sum()
    found = natural_frequencies(model, 0.0, normal=springs, tangential=springs, count=6)
    root = {"root": "BLADE_FLANKS", "tip": "TIP"}
    tip = {"tip": InterfaceChoice("TIP", kind="ground")}
    clamped = sector_from_mesh(blade, SectorChoice(N_BLADES, sets=root, interfaces=tip, other_faces="free")).sector
    assert found == pytest.approx(held_frequencies(assemble(clamped, STEEL, element=None), 6), rel=0.03)
