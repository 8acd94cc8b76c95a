"""Centrifugal force, static equilibrium and stiffness at speed against closed forms and identities."""

import numpy as np
import pytest
from rom_meshes import NODAL, annulus, box, box_sector, mesh_of, sector_of
from rom_reference import lowest_hz, rotating_beam_ratio

from rom import Material, ReductionOptions, RomParameterError, assemble, natural_frequencies, reduce_sector
from rom.finite_elements.assembly import ElasticBody, elastic_matrices
from rom.finite_elements.discretisation import discretise
from rom.finite_elements.full_model import FullModel, centrifugal_force
from rom.finite_elements.rotation import (
    RotatingBody,
    centrifugal_displacement,
    static_equilibrium,
    stiffen_by_rotation,
)

RPM = 30.0 / np.pi
NO_POISSON = Material(young_modulus=2.1e11, poisson_ratio=0.0, density=7800.0)


def bar(divisions, lengths, hub, centre_y=0.0):
    """Radial bar along z clamped at the radius `hub`; its contact nodes are only there to make it a sector."""
    lx, ly, _ = lengths
    points, hexahedra = box(divisions, lengths, (-lx / 2, centre_y - ly / 2, hub))
    root = np.flatnonzero(points[:, 2] < hub + 1e-9)
    sides = [np.flatnonzero((points[:, 2] > hub + 1e-9) & (points[:, 1] == y)) for y in np.unique(points[:, 1])]
    return sector_of(points, hexahedra, root, len(points) - 1, sides[-1], sides[0], np.eye(3), 30)


def test_total_centrifugal_force_and_moment_of_a_block_off_the_radius():
    lengths = np.array([0.03, 0.02, 0.1])
    full = assemble(bar((2, 2, 4), lengths, hub=0.3, centre_y=0.05), NO_POISSON)
    mass, arm = NO_POISSON.density * lengths.prod(), np.array([0.0, 0.05, 0.35])
    force = full.centrifugal.reshape(-1, 3)
    np.testing.assert_allclose(force.sum(axis=0), mass * arm, rtol=1e-12, atol=1e-15)
    moment = np.cross(full.positions, force).sum(axis=0)
    np.testing.assert_allclose(moment, np.zeros(3), atol=1e-12 * mass)
    # Work of the force in a shift of every point along its own radius: the moment of inertia about x.
    radial = np.sum(force * full.positions * [0.0, 1.0, 1.0])
    inertia = mass * (np.sum(lengths[1:] ** 2) / 12 + np.sum(arm**2))
    assert radial == pytest.approx(inertia, rel=1e-12)


def test_rotating_bar_stretches_as_in_the_closed_form():
    hub, length = 0.3, 0.2
    full = assemble(bar((1, 1, 10), (0.002, 0.002, length), hub), NO_POISSON)
    displacement = centrifugal_displacement(full).reshape(-1, 3)
    r = full.positions[:, 2]
    tip = hub + length
    exact = NO_POISSON.density / NO_POISSON.young_modulus * (tip**2 / 2 * (r - hub) - (r**3 - hub**3) / 6)
    np.testing.assert_allclose(displacement[:, 2], exact, atol=1e-4 * exact.max())


def beam_under_tension(tension, lengths=(1.0, 0.02, 0.02), divisions=(24, 1, 1)):
    """First three frequencies of a simply supported beam under an axial stress, motion in the x-y plane only."""
    points, hexahedra = box(divisions, lengths)
    mesh = discretise(mesh_of(points, hexahedra), "hex20")
    _, mass = elastic_matrices(mesh, NO_POISSON)
    stress = np.zeros((len(hexahedra), len(mesh.blocks[0].table.weights), 3, 3))
    stress[..., 0, 0] = tension / (lengths[1] * lengths[2])
    x, y, _ = mesh.positions.T
    ends = np.flatnonzero((x < 1e-9) | (x > lengths[0] - 1e-9))
    corner = np.flatnonzero((x < 1e-9) & (np.abs(y - lengths[1] / 2) < 1e-9))
    held = np.concatenate([3 * np.arange(mesh.n_nodes) + 2, 3 * ends + 1, 3 * corner])
    stiffness = ElasticBody.of(mesh, NO_POISSON).tangent(np.zeros(3 * mesh.n_nodes), (stress,))
    return lowest_hz(stiffness, mass, 3, np.unique(held))


def test_prestressed_beam_against_the_closed_form():
    inertia = 0.02**4 / 12
    euler = np.pi**2 * NO_POISSON.young_modulus * inertia
    free = beam_under_tension(0.0)
    plain = np.pi / 2 * np.sqrt(NO_POISSON.young_modulus * inertia / (NO_POISSON.density * 0.02**2))
    assert free[0] == pytest.approx(plain, rel=1e-3)
    for load in (-0.9, -0.5, 1.0, 20.0):
        found = beam_under_tension(load * euler)
        mode = np.arange(1, 4)
        np.testing.assert_allclose(found / free, np.sqrt(1 + load / mode**2), rtol=5e-3)


def test_strong_tension_makes_a_string():
    lengths = (1.0, 0.002, 0.02)
    area, inertia = 0.002 * 0.02, 0.02 * 0.002**3 / 12
    tension = 2000 * np.pi**2 * NO_POISSON.young_modulus * inertia
    string = np.arange(1, 4) / 2 * np.sqrt(tension / (NO_POISSON.density * area))
    np.testing.assert_allclose(beam_under_tension(tension, lengths), string, rtol=5e-3)


@pytest.fixture(scope="module")
def slender():
    """Square blade, length 0.5 m from the axis, so that x and y bending are the same at rest."""
    sector = bar((1, 1, 24), (0.01, 0.01, 0.5), hub=0.0)
    return sector, assemble(sector, NO_POISSON)


def bending(full, count=2):
    """Lowest frequencies [rad/s] of motions along x (flap) and along y (lag), each with the other held."""
    held = [np.union1d(full.fixed, np.arange(axis, full.n_dofs, 3)) for axis in (1, 0)]
    return [2 * np.pi * lowest_hz(full.stiffness, full.mass, count, fixed) for fixed in held]


@pytest.mark.parametrize("ratio", [1.0, 3.0])
def test_rotating_beam_stiffens_like_the_ritz_solution_and_softens_in_plane(slender, ratio):
    sector, full = slender
    unit = 0.01 / 0.5**2 * np.sqrt(NO_POISSON.young_modulus / (12 * NO_POISSON.density))
    speed = ratio * unit
    flap, lag = bending(stiffen_by_rotation(full, sector, NO_POISSON, speed * RPM))
    np.testing.assert_allclose(flap / unit, rotating_beam_ratio(ratio, hub=0.0, count=2), rtol=2e-3)
    # In the plane of rotation the centrifugal force turns with the blade: W^2 less, but for the sections' turning.
    np.testing.assert_allclose(flap**2 - lag**2, speed**2, rtol=3e-3)


def test_ritz_reference_is_the_known_one():
    """First flap root of the uniform cantilever at rest, and hub radius stiffens."""
    assert rotating_beam_ratio(0.0, 0.0)[0] == pytest.approx(1.8751041**2, rel=1e-7)
    assert rotating_beam_ratio(3.0, 1.0)[0] > rotating_beam_ratio(3.0, 0.0)[0]


def test_southwell_coefficient_with_a_hub(slender):
    sector = bar((1, 1, 24), (0.01, 0.01, 0.5), hub=0.5)
    full = assemble(sector, NO_POISSON)
    unit = 0.01 / 0.5**2 * np.sqrt(NO_POISSON.young_modulus / (12 * NO_POISSON.density))
    at_rest, turning = (
        bending(stiffen_by_rotation(full, sector, NO_POISSON, w * unit * RPM), 1)[0] / unit for w in (0.0, 0.5)
    )
    found = (turning**2 - at_rest**2) / 0.5**2
    exact = (rotating_beam_ratio(0.5, 1.0) ** 2 - rotating_beam_ratio(0.0, 1.0) ** 2) / 0.5**2
    np.testing.assert_allclose(found, exact, rtol=2e-3)


def test_turning_a_spinning_ring_costs_nothing():
    """The stiffness of a free ring at its static equilibrium has the turn about the axis of rotation for a mode of
    frequency 0, an identity of the discrete model at any strain; here the ring is 1 % larger at speed."""
    material = Material(2.1e11, 0.3, 7800.0)
    points, hexahedra = annulus((2, 12, 1), 0.1, 0.2, 0.02)
    mesh = discretise(mesh_of(points, hexahedra), "hex20")
    stiffness, mass = elastic_matrices(mesh, material)
    x, y, z = mesh.positions.T
    rim = (np.hypot(y, z) > 0.2 - 1e-9) & (x < 0.0)
    across, along = (np.flatnonzero(rim & (np.abs(value) < 1e-9)) for value in (y, z))
    assert len(across) == len(along) == 2
    # They hold the ring without a reaction: it grows symmetrically about the axis.
    held = np.concatenate([3 * across, 3 * along, 3 * across + 1, 3 * along + 2])
    vertices, force = np.arange(len(points)), centrifugal_force(mesh, mass)
    full = FullModel(stiffness, mass, mesh.positions, vertices, np.unique(held), force, "hex20")
    rotating = RotatingBody.of(ElasticBody.of(mesh, material), full)
    squared = 0.025 * material.young_modulus / (material.density * 0.2**2)
    displacement = static_equilibrium(rotating, squared)
    assert 0.005 < np.max(np.abs(displacement)) / 0.2 < 0.02
    at_speed = rotating.stiffness(displacement, squared)
    turn = np.cross([1.0, 0.0, 0.0], mesh.positions + displacement.reshape(-1, 3)).ravel()
    np.testing.assert_allclose(at_speed @ turn, 0.0, atol=1e-9 * squared * np.max(np.abs(mass @ turn)))
    # Neither the stiffness at rest nor the geometric stiffness without the initial displacement has this mode.
    for incomplete in (stiffness, at_speed - rotating.body.tangent(displacement) + stiffness):
        assert np.max(np.abs(incomplete @ turn)) > 0.1 * squared * np.max(np.abs(mass @ turn))


def test_no_speed_changes_nothing_and_its_direction_does_not_matter():
    sector = box_sector(divisions=(4, 2, 4))
    full = assemble(sector, NO_POISSON)
    assert stiffen_by_rotation(full, sector, NO_POISSON, 0.0) is full
    slow, fast, back = (stiffen_by_rotation(full, sector, NO_POISSON, speed) for speed in (1000.0, 2000.0, -2000.0))
    assert (slow.speed_rpm, fast.speed_rpm, back.speed_rpm) == (1000.0, 2000.0, -2000.0)
    assert abs(fast.stiffness - back.stiffness).max() == 0.0
    assert abs(fast.stiffness - fast.stiffness.T).max() < 1e-13 * abs(full.stiffness).max()  # a sum of three
    hz = [
        natural_frequencies(reduce_sector(m, sector, ReductionOptions(), NODAL).model, 0.0)[0]
        for m in (full, slow, fast)
    ]
    assert hz[0] < hz[1] < hz[2]


def test_bad_values_are_refused_in_one_line():
    sector = box_sector(divisions=(4, 2, 4))
    full = assemble(sector, NO_POISSON, "hex8")
    with pytest.raises(RomParameterError, match=r"load.speed_rpm = nan: must be a finite number"):
        stiffen_by_rotation(full, sector, NO_POISSON, float("nan"))
    with pytest.raises(RomParameterError, match="model at rest"):
        stiffen_by_rotation(stiffen_by_rotation(full, sector, NO_POISSON, 100.0), sector, NO_POISSON, 200.0)
    with pytest.raises(RomParameterError, match=r"load.equilibrium = 'quick': must be one of nonlinear, linear"):
        stiffen_by_rotation(full, sector, NO_POISSON, 100.0, "quick")
    with pytest.raises(
        RomParameterError, match=r"load.speed_rpm = 1000000000.0: a lower speed: no static equilibrium"
    ):
        stiffen_by_rotation(full, sector, NO_POISSON, 1e9)
