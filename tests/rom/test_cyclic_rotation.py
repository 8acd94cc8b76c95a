"""Disks in rotation: the wheel without symmetry, Timoshenko's disk, Coriolis forces, static displacements."""

from functools import cache

import numpy as np
import pytest
from rom_meshes import NODAL
from scipy.sparse.linalg import eigsh
from wheels import annular_sector, bladed_sector, wheel_mesh

from rom import Material, ReductionOptions, RomParameterError, assemble, natural_frequencies, reduce_sector
from rom.cyclic.cyclic_symmetry import wave_coordinates
from rom.cyclic.natural_frequencies import gyroscopic_frequencies
from rom.cyclic_sector.cyclic_faces import cyclic_faces
from rom.cyclic_sector.cyclic_modes import modes_by_nodal_diameter, static_motion
from rom.cyclic_sector.interface_motion import InterfaceOptions, interface_motion
from rom.cyclic_sector.wave_reference import wave_errors
from rom.finite_elements.rotation import centrifugal_displacement, coriolis_acceleration, stiffen_by_rotation

STEEL = Material(2.1e11, 0.3, 7850.0)
BOTH = {"": STEEL, "disk": STEEL}
RPM = 3000.0
OMEGA = RPM * np.pi / 30.0


@cache
def spinning(held=True, equilibrium="nonlinear"):
    """A sector of six, its model at rest and at speed, and its cut faces."""
    sector = bladed_sector(6, held, divisions=(2, 2, 1, 3))
    full = assemble(sector, BOTH, None)
    faces = cyclic_faces(full, sector)
    return sector, full, stiffen_by_rotation(full, sector, BOTH, RPM, equilibrium, static_motion(full, faces)), faces


@pytest.mark.parametrize("equilibrium", ["nonlinear", "linear"])
def test_all_nodal_diameters_at_speed_are_the_wheel_at_speed(equilibrium):
    """The wheel in one piece, spun without any symmetry: static displacement, stress stiffening, spin softening."""
    sector, _, turning, faces = spinning(equilibrium=equilibrium)
    whole = wheel_mesh(sector)
    wheel = stiffen_by_rotation(assemble(whole, BOTH, None), whole, BOTH, RPM, equilibrium)
    free = np.setdiff1d(np.arange(wheel.n_dofs), wheel.fixed)
    k, m = (matrix[free][:, free].tocsc() for matrix in (wheel.stiffness, wheel.mass))
    exact = np.sqrt(np.sort(eigsh(k, 20, m, sigma=0.0, return_eigenvectors=False)))
    found = [mode.omega for mode in modes_by_nodal_diameter(turning, faces, (0, 1, 1, 2, 2, 3), 8)]
    np.testing.assert_allclose(np.sort(np.concatenate(found))[:20], exact, rtol=1e-7)


def test_the_displacement_of_the_reduced_sector_in_rotation_is_that_of_the_wheel():
    """A steady load acts in nodal diameter 0; the reduced model has its displacement at tip and contacts."""
    sector, _, turning, faces = spinning()
    choice = interface_motion(turning, sector, faces, NODAL)
    model = reduce_sector(turning, sector, ReductionOptions(modes=10), choice).model
    wave = wave_coordinates(model.cyclic_right, model.cyclic_left, 0.0).real
    moved = wave @ np.linalg.solve(wave.T @ model.stiffness @ wave, wave.T @ model.force_centrifugal)
    whole = wheel_mesh(sector)
    wheel = assemble(whole, BOTH, None)
    exact = centrifugal_displacement(stiffen_by_rotation(wheel, whole, BOTH, RPM)).reshape(-1, 3)
    at_tip = exact[wheel.vertex_node[whole.node_sets["tip"][0]]]
    found = np.array([model.outputs[f"tip_{axis}"] @ moved for axis in "xyz"])
    np.testing.assert_allclose(found, at_tip, atol=1e-6 * np.linalg.norm(at_tip))
    nearest = np.argmin(np.linalg.norm(wheel.positions[:, None] - sector.right.position, axis=2), axis=0)
    at_contact = np.einsum("kij,kj->ki", sector.right.frame, exact[nearest]).ravel()
    np.testing.assert_allclose(model.contact_right @ moved, at_contact, atol=1e-6 * np.abs(at_contact).max())


@pytest.mark.parametrize("bore", ["free", "clamped"])
def test_a_reduced_disk_grows_as_the_whole_one(bore):
    """In its few lowest modes a disk bends; its growth in rotation is a motion of the cut faces by itself."""
    sector = annular_sector(8, (0.1, 0.25), 0.02, (2, 8, 2), bore)
    full = assemble(sector, STEEL, None)
    faces = cyclic_faces(full, sector)
    choice = interface_motion(full, sector, faces, NODAL, InterfaceOptions(modes=4, tolerance=1e-9))
    model = reduce_sector(full, sector, ReductionOptions(modes=4), choice).model
    wave = wave_coordinates(model.cyclic_right, model.cyclic_left, 0.0).real
    stiffness, force = wave.T @ model.stiffness @ wave, wave.T @ model.force_centrifugal
    moved = wave @ np.linalg.lstsq(stiffness, force, rcond=1e-12)[0]
    exact = centrifugal_displacement(full, motion=static_motion(full, faces)).reshape(-1, 3)
    across = full.positions[faces.left] * [0.0, 1.0, 1.0]
    grown, wanted = (
        np.sum(field[faces.left] * across, axis=1) / np.linalg.norm(across, axis=1)
        for field in ((model.basis @ moved).reshape(-1, 3), exact)
    )
    np.testing.assert_allclose(grown, wanted, atol=2e-6 * wanted.max())


def timoshenko(radius, bore, rim, nu):
    """Radial displacement of a thin rotating disk, free at bore and rim, at 1 rad/s, E = rho = 1."""
    both, product = bore**2 + rim**2, (bore * rim / radius) ** 2
    radial = (3.0 + nu) / 8.0 * (both - product - radius**2)
    hoop = (3.0 + nu) / 8.0 * (both + product - (1.0 + 3.0 * nu) / (3.0 + nu) * radius**2)
    return radius * (hoop - nu * radial)


@pytest.mark.parametrize("rpm", [0.0, RPM])
def test_a_free_thin_disk_grows_as_in_the_closed_form(rpm):
    """Nothing holds the disk: its axial and turning motion are none of the static displacement."""
    sector = annular_sector(8, (0.1, 0.25), 0.004, (1, 6, 3))
    full = assemble(sector, STEEL, None)
    faces = cyclic_faces(full, sector)
    motion = static_motion(full, faces)
    turning = stiffen_by_rotation(full, sector, STEEL, rpm, motion=motion)
    moved = centrifugal_displacement(turning, motion=motion).reshape(-1, 3)
    radius = np.hypot(*full.positions[:, 1:].T)
    radial = np.sum(moved[:, 1:] * full.positions[:, 1:], axis=1) / radius
    middle = np.abs(full.positions[:, 0]) < 1e-9
    exact = STEEL.density / STEEL.young_modulus * timoshenko(radius, 0.1, 0.25, STEEL.poisson_ratio)
    np.testing.assert_allclose(radial[middle], exact[middle], rtol=2e-3)


def test_coriolis_forces_of_a_reduced_sector_are_those_of_its_motions():
    """The acceleration of a pattern of the cut faces is in general none of the patterns."""
    sector, _, turning, faces = spinning()
    choice = interface_motion(turning, sector, faces, NODAL)
    model = reduce_sector(turning, sector, ReductionOptions(modes=60), choice).model
    product = model.basis.T @ (turning.mass @ coriolis_acceleration(model.basis))
    np.testing.assert_allclose(model.coriolis, product, atol=1e-9 * np.abs(product).max())
    assert wave_errors(model, choice.interface, 6).largest < 2e-4
    for diameter in (0, 1, 3):
        modes = modes_by_nodal_diameter(turning, faces, (diameter,), 40)[0]
        shapes = modes.shapes
        turned = 1j * OMEGA * (shapes.conj().T @ (turning.mass @ coriolis_acceleration(shapes)))
        still = np.diag(modes.omega)
        pencil = np.block([[np.zeros_like(still), still], [still, turned]])
        exact = np.linalg.eigvalsh(pencil)[40:46] / (2.0 * np.pi)
        phase = np.pi / 3.0 * diameter
        found = gyroscopic_frequencies(model, phase, count=6) - natural_frequencies(model, phase, count=6)
        shift = exact - modes.frequency_hz[:6]
        np.testing.assert_allclose(found, shift, atol=0.02 * np.abs(shift).max())


def test_a_free_disk_at_speed_keeps_its_rigid_motions():
    """Along the axis and about it at 0 Hz, an identity of the equilibrium; tilting, without Coriolis forces, as a
    rigid body with the centrifugal potential -W^2 (I_p cos^2 + I_d sin^2) / 2."""
    _, _, turning, faces = spinning(held=False)
    along, across = modes_by_nodal_diameter(turning, faces, (0, 1), 4)
    assert np.all(along.frequency_hz[:2] < 0.01)
    assert along.frequency_hz[2] > 300.0
    x, y, z = turning.positions.T
    weight = turning.mass[::3][:, ::3]
    polar, axial = 6.0 * (y @ (weight @ y) + z @ (weight @ z)), 6.0 * (x @ (weight @ x))
    diametral = 0.5 * polar + axial
    tilted = RPM / 60.0 * np.sqrt((polar - diametral) / diametral)
    np.testing.assert_allclose(across.frequency_hz[1], tilted, rtol=1e-3)


def test_cut_faces_need_their_motion():
    sector, full, _, _ = spinning()
    with pytest.raises(RomParameterError, match="motion of the cut faces"):
        stiffen_by_rotation(full, sector, BOTH, 3000.0)
