"""Nodal forces of pressures, tractions and temperatures on every kind of element, against statics and elasticity."""

from dataclasses import replace

import numpy as np
import pytest
from element_meshes import KINDS, arched, brick, mixed_brick, moved
from scipy.sparse.linalg import spsolve

from geometry import (
    BladeParameters,
    ContactFace,
    ElementSides,
    MeshParameters,
    SectorMesh,
    ShroudParameters,
    build_sector,
)
from geometry.elements import ELEMENT_KINDS, sides_on
from rom import AnisotropicMaterial, Material, RomParameterError, assemble
from rom.finite_elements.assembly import stress_at_quadrature
from rom.finite_elements.discretisation import discretise
from rom.finite_elements.loads import at_quadrature, pressure_force, thermal_force, traction_force
from rom.finite_elements.rotation import centrifugal_displacement, stiffen_by_rotation
from rom.reduction.face_integrals import face_points
from rom.stress.stress_recovery import StressRecovery

LAYERS = AnisotropicMaterial.from_constants(
    [1.4e11, 1.7e11, 2.2e11], [0.31, 0.25, 0.36], [8.0e10, 6.0e10, 9.5e10], 7800.0, [1e-5, 1.6e-5, 2.2e-5]
)
STEEL = Material(2.0e11, 0.3, 7800.0, expansion=1.2e-5)
MESHES = [*KINDS, "mixed"]


def sector_of(mesh, **surfaces):
    """The mesh as a sector without contact nodes, with surfaces."""
    none = ContactFace(np.empty(0, dtype=int), np.empty((0, 3)), np.empty((0, 3, 3)), np.empty(0))
    return SectorMesh(mesh.points, mesh.blocks, {"root": np.empty(0, dtype=int)}, none, none, 12, surfaces)


def bent(kind):
    """An arch of one kind of element, or of three."""
    return mixed_brick(arched) if kind == "mixed" else brick(kind, (4, 2, 2), (2.0, 1.0, 0.5), arched)


def skin(mesh):
    """The sides that one element only has."""
    found = {}
    for index, block in enumerate(mesh.blocks):
        for side, corners in enumerate(block.topology.sides):
            for element, nodes in enumerate(block.nodes[:, list(corners)]):
                found.setdefault(frozenset(nodes.tolist()), []).append((index, element, side))
    single = np.array(sorted(rows[0] for rows in found.values() if len(rows) == 1))
    return ElementSides(*single.T)


def resultants(mesh, force):
    """Total force and moment about the origin."""
    nodal = force.reshape(-1, 3)
    return nodal.sum(axis=0), np.cross(mesh.points, nodal).sum(axis=0)


@pytest.mark.parametrize("kind", MESHES)
def test_a_uniform_pressure_all_round_has_no_resultant(kind):
    mesh = bent(kind)
    sector = sector_of(mesh)
    force = pressure_force(assemble(sector, STEEL, None), sector, skin(mesh), 1e5)
    for total in resultants(mesh, force):
        np.testing.assert_allclose(total, 0.0, atol=1e-9 * np.abs(force).sum())


@pytest.mark.parametrize("kind", MESHES)
def test_a_pressure_that_grows_with_depth_is_buoyancy(kind):
    """Archimedes: p = -g z presses up with g times the volume, through the centroid."""
    mesh = bent(kind)
    sector = sector_of(mesh)
    full = assemble(sector, STEEL, None)
    force, moment = resultants(mesh, pressure_force(full, sector, skin(mesh), -9.81 * mesh.points[:, 2]))
    nodes = discretise(sector)
    volume, first = 0.0, np.zeros(3)
    for batch in nodes.batches():
        table = nodes.blocks[batch.block].table
        volume += batch.weights.sum()
        first += np.einsum("eq,qb,ebi->i", batch.weights, table.values, mesh.points[batch.nodes])
    # the points of a tetrahedron or a wedge integrate the volume of a curved one with an error of higher order
    np.testing.assert_allclose(force, [0.0, 0.0, 9.81 * volume], atol=1e-4 * 9.81 * volume)
    np.testing.assert_allclose(moment, np.cross(first / volume, force), atol=2e-4 * 9.81 * volume)


@pytest.mark.parametrize("kind", KINDS)
def test_tractions_are_in_balance_with_constant_stress(kind):
    """sigma n on the six faces of a brick of distorted elements are the forces K u of the linear displacement."""
    mesh = moved(brick(kind, (2, 2, 2)), 0.05)
    sector = sector_of(mesh)
    full = assemble(sector, STEEL, None)
    slope = 1e-4 * np.random.default_rng(2).standard_normal((3, 3))
    stress = STEEL.law.stress((slope + slope.T) / 2)
    total = np.zeros(full.n_dofs)
    for axis, end in np.ndindex(3, 2):
        side = sides_on(mesh.blocks, np.flatnonzero(np.abs(mesh.points[:, axis] - end) < 1e-9))
        total += traction_force(full, sector, side, (2 * end - 1) * stress[axis])
    exact = full.stiffness @ (mesh.points @ slope.T).ravel()
    np.testing.assert_allclose(total, exact, atol=1e-9 * np.abs(exact).max())


@pytest.mark.parametrize("kind", MESHES)
def test_a_free_body_expands_without_stress_in_a_linear_temperature_field(kind):
    """alpha T with T linear in x, y, z is a compatible strain; it is exact in quadratic parallelepipeds."""
    mesh = mixed_brick() if kind == "mixed" else brick(kind, (3, 3, 3))
    if kind == "tet10":
        mesh = moved(mesh, 0.05)
    sector = sector_of(mesh)
    full = assemble(sector, STEEL, None)
    quadratic = kind == "mixed" or ELEMENT_KINDS[kind].quadratic
    gradient = np.array([30.0, -20.0, 50.0]) if quadratic else np.zeros(3)
    temperature = 100.0 + mesh.points @ gradient
    alpha, x = STEEL.expansion, mesh.points
    # u with the strain alpha (T0 + g.x) I: alpha (T0 x + (g.x) x - g |x|^2 / 2)
    exact = alpha * (100.0 * x + (x @ gradient)[:, None] * x - 0.5 * np.sum(x**2, axis=1)[:, None] * gradient)
    force = thermal_force(full, sector, STEEL, temperature)
    assert np.abs(force).max() > 0.0
    np.testing.assert_allclose(full.stiffness @ exact.ravel(), force, atol=1e-9 * np.abs(force).max())
    nodes = discretise(sector)
    elastic = stress_at_quadrature(nodes, STEEL, exact)
    for stress, block in zip(elastic, nodes.blocks, strict=True):
        heat = STEEL.law.restrained_stress(at_quadrature(block, slice(None), temperature))
        rest = stress - heat
        assert np.abs(rest).max() < 1e-9 * np.abs(heat).max()


@pytest.mark.parametrize("equilibrium", ["linear", "nonlinear"])
def test_a_twisted_blade_expands_at_speed_as_at_rest(equilibrium):
    """Heated alike all over it expands without stress: rotation changes that by a few tenths of a per cent."""
    blade = BladeParameters(72, 0.3, 0.15, 0.036, 0.009, tip_thickness=0.006, twist=25.0, section="lens")
    sector = build_sector(blade, ShroudParameters(70.0, 0.005, 0.04, 0.012), MeshParameters(size=0.02))
    rest = assemble(sector, STEEL, None)
    fast = stiffen_by_rotation(rest, sector, STEEL, 4500.0, equilibrium)
    squared = (4500.0 * np.pi / 30.0) ** 2

    def expanded(full, about=None):
        force = thermal_force(full, sector, STEEL, 500.0, about)
        return centrifugal_displacement(replace(full, centrifugal=force)).reshape(-1, 3)[sector.right.nodes]

    at_rest = expanded(rest)
    found = expanded(fast, squared * centrifugal_displacement(fast))
    assert np.abs(found - at_rest).max() < 5e-3 * np.abs(at_rest).max()


@pytest.mark.parametrize("kind", ["tet10", "wedge15", "hex20"])
def test_a_thick_walled_cylinder_under_pressure_is_lame_s(kind):
    """Plane strain, a quarter of it: radial displacement at the bore, radii 1 and 2."""

    def quarter(points):
        angle, radius = 0.5 * np.pi * points[:, 0], 1.0 + points[:, 2]
        return np.column_stack([radius * np.sin(angle), points[:, 1], radius * np.cos(angle)])

    mesh = brick(kind, (4, 1, 4), (1.0, 0.25, 1.0), quarter)
    sector = sector_of(mesh)
    full = assemble(sector, STEEL, None)
    radius = np.hypot(mesh.points[:, 0], mesh.points[:, 2])
    bore = np.flatnonzero(np.abs(radius - 1.0) < 1e-9)
    force = pressure_force(full, sector, sides_on(mesh.blocks, bore), 1e6)
    wall = np.column_stack([mesh.points[:, 0] < 1e-9, np.ones(len(radius), dtype=bool), mesh.points[:, 2] < 1e-9])
    free = np.flatnonzero(~wall.ravel())
    displacement = np.zeros(full.n_dofs)
    displacement[free] = spsolve(full.stiffness[free][:, free].tocsc(), force[free])
    found = np.sum(displacement.reshape(-1, 3) * mesh.points, axis=1)[bore]
    exact = 1e6 * (1 + 0.3) / 2.0e11 * ((1 - 2 * 0.3) * 1.0 + 4.0) / 3.0
    np.testing.assert_allclose(found, exact, rtol=3e-3)


@pytest.mark.parametrize("kind", MESHES)
def test_points_on_a_curved_face_have_its_area_and_the_positions_of_its_shape_functions(kind):
    mesh = bent(kind)
    radius = np.hypot(mesh.points[:, 0], mesh.points[:, 2])
    top = sides_on(mesh.blocks, np.flatnonzero(np.abs(radius - radius.max()) < 1e-9))
    sector = sector_of(mesh, face_right=top)
    point, weight = np.polynomial.legendre.leggauss(4)
    nodes = discretise(sector)
    points = face_points(nodes, sector, "right", "mortar", (0.5 + 0.5 * point, 0.5 * weight))
    np.testing.assert_allclose(points.interpolation @ mesh.points, points.position, atol=1e-12)
    angle = 0.6 * (1.0 if kind == "mixed" else 2.0)
    # the width is 1 + 0.1 sin 2 x over x
    start = 1.0 if kind == "mixed" else 0.0
    width = 1.0 + 0.05 * (np.cos(2.0 * start) - np.cos(4.0)) / (2.0 - start)
    quadratic = kind == "mixed" or ELEMENT_KINDS[kind].quadratic
    assert points.area.sum() == pytest.approx(radius.max() * angle * width, rel=1e-3 if quadratic else 0.02)


@pytest.mark.parametrize(
    ("load", "message"),
    [
        (
            lambda full, sector, top: pressure_force(full, sector, top, np.zeros(3)),
            r"load.pressure = .*must have the",
        ),
        (lambda full, sector, top: pressure_force(full, sector, top, float("nan")), r"load.pressure = nan"),
        (
            lambda full, sector, top: pressure_force(full, sector, ElementSides(*[np.array([], int)] * 3), 1.0),
            "empty",
        ),
        (
            lambda full, sector, top: traction_force(full, sector, top, np.zeros(2)),
            r"load.traction = .*must have the",
        ),
        (
            lambda full, sector, top: thermal_force(full, sector, STEEL, np.zeros(2)),
            r"load.temperature = .*must be a",
        ),
        (lambda full, sector, top: thermal_force(full, sector, STEEL, float("inf")), r"load.temperature = nan"),
    ],
)
def test_bad_loads_are_refused_in_one_line(load, message):
    mesh = brick("tet10", (1, 1, 1))
    sector = sector_of(mesh)
    with pytest.raises(RomParameterError, match=message) as caught:
        load(assemble(sector, STEEL, None), sector, skin(mesh))
    assert "\n" not in str(caught.value)


def test_a_blade_heated_at_speed_has_the_stress_of_rotation_alone():
    """The stress that a free expansion would have if it were held turns with the blade."""
    blade = BladeParameters(72, 0.3, 0.15, 0.036, 0.009, tip_thickness=0.006, twist=25.0, section="lens")
    sector = build_sector(blade, ShroudParameters(70.0, 0.005, 0.04, 0.012), MeshParameters(size=0.02))
    fast = stiffen_by_rotation(assemble(sector, LAYERS, None), sector, LAYERS, 4500.0)
    base = (4500.0 * np.pi / 30.0) ** 2 * centrifugal_displacement(fast)
    force = thermal_force(fast, sector, LAYERS, 500.0, base)
    moved_by_heat = centrifugal_displacement(replace(fast, centrifugal=force))
    heat = np.full(len(sector.points), 500.0)
    nodes = discretise(sector)
    cold = StressRecovery.of(nodes, LAYERS, base).static(base)
    hot = StressRecovery.of(nodes, LAYERS, base, heat).static(base + moved_by_heat)
    free = np.setdiff1d(np.arange(len(sector.points)), sector.node_sets["root"])
    away = free[sector.points[free, 2] > 0.36]  # the root is clamped: it cannot expand
    off = np.abs(hot.values[away] - cold.values[away]).max()
    assert off < 0.02 * np.abs(cold.values).max()
