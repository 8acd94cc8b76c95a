"""Disks under cyclic symmetry: CalculiX, the whole wheel without symmetry, plates, and limits of the disk."""

from dataclasses import replace
from functools import cache

import calculix_blocks
import numpy as np
import pytest
from calculix import PROGRAM
from scipy.sparse.linalg import eigsh
from wheels import bladed_sector, solid_disk, whole_wheel

from geometry import BladeParameters, DiskParameters, MeshParameters, ShroudParameters, build_sector
from rom import (
    BoundaryChoice,
    Material,
    ReductionOptions,
    RomParameterError,
    assemble,
    modal_model,
    natural_frequencies,
    read_reduced_model,
    reduce_sector,
    write_reduced_model,
)
from rom.cyclic_sector.cyclic_faces import CyclicFaces, cyclic_faces
from rom.cyclic_sector.cyclic_modes import cyclic_modes
from rom.cyclic_sector.interface_motion import InterfaceOptions, interface_motion
from rom.cyclic_sector.wave_reference import wave_errors

STEEL = Material(2.1e11, 0.3, 7850.0)
needs_calculix = pytest.mark.skipif(PROGRAM is None, reason="CalculiX (ccx) is not installed")


@cache
def bladed(n_sectors, held=True, stiffer=1.0):
    """Sector, full model and cut faces."""
    sector = bladed_sector(n_sectors, held)
    materials = {"": STEEL, "disk": replace(STEEL, young_modulus=stiffer * STEEL.young_modulus)}
    full = assemble(sector, materials, None)
    return sector, full, cyclic_faces(full, sector)


def calculix_hz(sector, materials, diameter, folder):
    """Ten frequencies that CalculiX prints, each twice for the two directions of a wave."""
    lines = calculix_blocks.body(sector, materials, sector.node_sets["root"])
    for name in ("right", "left"):
        free = np.setdiff1d(sector.node_sets[f"cyclic_{name}"], sector.node_sets["root"])
        lines += [f"*SURFACE, NAME={name}, TYPE=NODE", *[f"{node + 1}," for node in free]]
    lines += ["*TIE, CYCLIC SYMMETRY, NAME=FACES, POSITION TOLERANCE=1.e-6", "left, right"]
    lines += [f"*CYCLIC SYMMETRY MODEL, N={sector.n_blades}"]
    lines += ["0., 0., 0., 1., 0., 0.", "*STEP", "*FREQUENCY", "20"]
    lines += [f"*SELECT CYCLIC SYMMETRY MODES, NMIN={diameter}, NMAX={diameter}", "*END STEP"]
    rows = [line.split() for line in calculix_blocks.run(folder, "\n".join(lines) + "\n").splitlines()]
    return np.array([float(row[4]) for row in rows if len(row) >= 5 and row[0] == str(diameter) and row[1].isdigit()])


@needs_calculix
@pytest.mark.parametrize("diameter", [0, 1, 3, 6])
def test_frequencies_of_a_bladed_disk_are_those_of_calculix(diameter, tmp_path):
    sector, full, faces = bladed(12)
    printed = calculix_hz(sector, {"": STEEL, "disk": STEEL}, diameter, tmp_path)
    assert len(printed) == 20
    np.testing.assert_allclose(cyclic_modes(full, faces, diameter, 10).frequency_hz, printed[::2], rtol=1e-6)


@pytest.mark.parametrize("sector", [bladed_sector(6), solid_disk(6)], ids=["bladed", "no bore"])
def test_all_nodal_diameters_together_are_the_wheel(sector):
    """Every frequency of the wheel once; a wave of one nodal diameter is a mode of it, in its direction."""
    full = assemble(sector, {"": STEEL, "disk": STEEL}, None)
    faces = cyclic_faces(full, sector)
    stiffness, mass, held, expanded = whole_wheel(full, faces)
    free = np.setdiff1d(np.arange(mass.shape[0]), held)
    k, m = (matrix[free][:, free].tocsc() for matrix in (stiffness, mass))
    squared = np.sort(eigsh(k, 24, m, sigma=-1e6, return_eigenvectors=False))
    exact = np.sqrt(np.maximum(squared, 0.0)) / (2.0 * np.pi)
    found, phase = [], 2.0 * np.pi / 6
    for diameter in range(4):
        modes = cyclic_modes(full, faces, diameter, 10)
        found += [*modes.frequency_hz] * (1 if diameter in (0, 3) else 2)
        wave = expanded(modes.shapes[:, -1], diameter * phase)[free]
        residual = k @ wave - modes.omega[-1] ** 2 * (m @ wave)
        assert np.abs(residual).max() < 1e-6 * np.abs(k @ wave).max()
        if diameter in (1, 2):  # the wave in the other direction is none of this shape
            other = expanded(modes.shapes[:, -1], -diameter * phase)[free]
            assert np.abs(k @ other - modes.omega[-1] ** 2 * (m @ other)).max() > 1e-2 * np.abs(k @ other).max()
    rigid = exact < 1.0
    found = np.sort(found)[: len(exact)]
    assert rigid.sum() == (0 if len(full.fixed) else 6)
    assert found[rigid].max(initial=0.0) < 1.0
    np.testing.assert_allclose(found[~rigid], exact[~rigid], rtol=1e-8)


@pytest.mark.parametrize(("diameter", "rigid"), [(0, 2), (1, 2), (2, 0)])
def test_a_disk_that_nothing_holds_has_its_rigid_motions(diameter, rigid):
    """Along and about the axis; across it and tilting."""
    _, full, faces = bladed(12, held=False)
    found = cyclic_modes(full, faces, diameter, 5).frequency_hz
    assert np.all(found[:rigid] < 0.1)
    assert found[rigid] > 50.0


@pytest.mark.parametrize("held", [True, False])
def test_one_reduction_serves_all_nodal_diameters(held, tmp_path):
    """Also between the nodal diameters that its motions of the faces were taken from."""
    sector, full, faces = bladed(24, held)
    errors = []
    for modes, tolerance in ((15, 1e-3), (60, 1e-5)):
        choice = interface_motion(
            full, sector, faces, BoundaryChoice(contact_dofs="nodal"), InterfaceOptions(tolerance=tolerance)
        )
        model = reduce_sector(full, sector, ReductionOptions(modes=modes, store_basis=False), choice).model
        largest = 0.0
        for diameter in (0, 1, 4, 9):
            exact = cyclic_modes(full, faces, diameter, 6).frequency_hz
            found = natural_frequencies(model, 2.0 * np.pi * diameter / 24, count=6)
            elastic = exact > 1.0
            largest = max(largest, np.abs(found[elastic] / exact[elastic] - 1.0).max())
        errors.append(largest)
    assert errors[1] < 2e-4
    assert errors[1] < 0.3 * errors[0]
    said = wave_errors(model, choice.interface, 6)
    assert dict(zip(said.nodal_diameters, said.sampled, strict=True)) == dict.fromkeys((0, 2, 8, 12), True) | {
        4: False
    }
    exact = cyclic_modes(full, faces, 4, 6).frequency_hz
    assert said.largest_unsampled == pytest.approx(
        np.max(natural_frequencies(model, np.pi / 3.0, count=6) / exact - 1.0), rel=1e-3
    )
    assert said.largest_unsampled <= said.largest < 2e-4
    write_reduced_model(tmp_path / "rom.h5", model)
    again = read_reduced_model(tmp_path / "rom.h5")
    assert np.array_equal(natural_frequencies(again, 0.5), natural_frequencies(model, 0.5))
    modes = modal_model(again, damping_ratio=0.01)
    for diameter in (-3, 0, 5, 12, 22):
        every = np.sort(modes.at(diameter).angular_frequency / (2.0 * np.pi))[:6]
        np.testing.assert_allclose(every, natural_frequencies(again, np.pi * diameter / 12, count=6), 1e-7, 0.3)
    np.testing.assert_array_equal(modes.at(-3).shapes, modes.at(3).shapes.conj())


def test_without_cholmod_the_reduction_is_the_same():
    """Then each nodal diameter has a factor of its own, and the static motions of the faces those of all nodes."""
    sector = bladed_sector(12, divisions=(2, 2, 1, 3))
    full = assemble(sector, {"": STEEL, "disk": STEEL}, None)
    faces, nodal = cyclic_faces(full, sector), BoundaryChoice(contact_dofs="nodal")
    found = []
    for backend in ("auto", "superlu"):
        choice = interface_motion(full, sector, faces, nodal, InterfaceOptions(modes=6), backend=backend)
        options = ReductionOptions(modes=10, store_basis=False, backend=backend)
        model = reduce_sector(full, sector, options, choice).model
        found.append(natural_frequencies(model, np.pi / 6.0, count=8))
    np.testing.assert_allclose(found[1], found[0], rtol=1e-6)


def test_a_rigid_disk_is_a_clamped_blade():
    sector, full, faces = bladed(12, stiffer=1e6)
    blade = replace(sector, blocks=sector.blocks[1:])
    at_rim = np.flatnonzero(np.hypot(sector.points[:, 1], sector.points[:, 2]) < 0.25 * 1.02)
    alone = replace(full, fixed=(3 * at_rim[:, None] + np.arange(3)).ravel())
    free = np.setdiff1d(np.arange(full.n_dofs), alone.fixed)
    k, m = (matrix[free][:, free].tocsc() for matrix in (full.stiffness, full.mass))
    clamped = np.sqrt(np.sort(eigsh(k, 4, m, sigma=0.0, return_eigenvectors=False))) / (2.0 * np.pi)
    assert len(blade.blocks) == 1
    for diameter in (0, 4):
        np.testing.assert_allclose(cyclic_modes(full, faces, diameter, 4).frequency_hz, clamped, rtol=1e-4)


def test_stuck_shrouds_are_a_ring_in_one_piece():
    sector, full, faces = bladed(12)
    tied = CyclicFaces(
        np.concatenate([faces.right, sector.node_sets["contact_right"]]),
        np.concatenate([faces.left, sector.node_sets["contact_left"]]),
        faces.axis,
        12,
    )
    choice = interface_motion(full, sector, faces, BoundaryChoice(contact_dofs="nodal"))
    model = reduce_sector(full, sector, ReductionOptions(modes=60, store_basis=False), choice).model
    for diameter in (0, 2, 6):
        exact = cyclic_modes(full, tied, diameter, 4).frequency_hz
        stuck = natural_frequencies(model, np.pi / 6 * diameter, normal=1e13, tangential=1e13, count=4)
        np.testing.assert_allclose(stuck, exact, rtol=3e-4)


def test_faces_that_do_not_match_are_said_to():
    sector, full, faces = bladed(12)
    with pytest.raises(RomParameterError, match="30 degrees apart, n_blades = 12 would fit"):
        cyclic_faces(full, replace(sector, n_blades=13))
    fewer = replace(sector, node_sets=sector.node_sets | {"cyclic_right": sector.node_sets["cyclic_right"][1:]})
    with pytest.raises(RomParameterError, match="must have as many nodes as cyclic_left"):
        cyclic_faces(full, fewer)
    with pytest.raises(RomParameterError, match="must be a set of the nodes of a cut face"):
        cyclic_faces(full, replace(sector, node_sets={"root": np.array([0])}))
    with pytest.raises(RomParameterError, match="nodal_diameter = 7: must be a whole number, 0 to 6 for 12 sectors"):
        cyclic_modes(full, faces, 7, 1)


def test_a_blade_of_shroud_and_disk_made_here():
    """A rigid disk clamps the blade; a real one lowers its frequencies, and does so differently at each diameter."""
    blade = BladeParameters(72, 0.3, 0.15, 0.036, 0.009, 0.006, 25.0, "lens")
    shroud, mesh = ShroudParameters(70.0, 0.005, 0.04, 0.012), MeshParameters(size=0.01)
    clamped = assemble(build_sector(blade, shroud, mesh), STEEL, "hex8")
    model = reduce_sector(clamped, build_sector(blade, shroud, mesh), ReductionOptions(modes=30)).model
    alone = natural_frequencies(model, 0.0, count=3)
    sector = build_sector(blade, shroud, mesh, DiskParameters(bore_radius=0.15, rim_width=0.046))
    found = {}
    for factor in (1.0, 1e6):
        disk = Material(factor * 2.1e11, 0.3, factor * 7850.0)
        full = assemble(sector, {"": STEEL, "disk": disk}, "hex8")
        faces = cyclic_faces(full, sector)
        found[factor] = [cyclic_modes(full, faces, diameter, 3).frequency_hz for diameter in (0, 5, 36)]
    np.testing.assert_allclose(found[1e6], [alone] * 3, rtol=2e-3)
    low, middle, high = found[1.0]
    assert np.all(np.array(found[1.0])[:, 0] < alone[0])
    assert low[0] < high[0]
    assert not np.allclose(middle[:2], high[:2], rtol=0.01)
