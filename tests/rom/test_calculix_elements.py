"""Curved elements of every quadratic kind, mixed meshes, several materials and static loads against CalculiX.

CalculiX has the same shape functions and quadrature points (C3D20 27, C3D10 4, C3D15 9, for the mass as well), so
nothing but round-off and the seven digits that it prints is left between the two.
"""

from functools import cache

import calculix
import calculix_blocks
import numpy as np
import pytest
from element_meshes import QUADRATIC, arched, brick, mixed_brick
from rom_meshes import mesh_of
from rom_reference import lowest_hz
from scipy.sparse import coo_matrix, kron
from scipy.sparse.linalg import eigsh, spsolve

from geometry import ContactFace, ElementSides, SectorMesh
from geometry.elements import sides_on
from rom import Material, assemble
from rom.finite_elements.assembly import elastic_matrices
from rom.finite_elements.discretisation import discretise
from rom.finite_elements.loads import pressure_force, thermal_force
from rom.finite_elements.rotation import stiffen_by_rotation

needs_calculix = pytest.mark.skipif(calculix.PROGRAM is None, reason="CalculiX is not installed: no ccx on PATH")

COUNT = 10
STEEL = Material(2.1e11, 0.3, 7800.0, expansion=1.2e-5)
TITANIUM = Material(1.14e11, 0.34, 4430.0, expansion=8.6e-6)
NICKEL = Material(1.9e11, 0.29, 8200.0, expansion=1.3e-5)
MATERIALS = {"": STEEL, "foot": NICKEL, "leaf": TITANIUM}


@cache
def curved(kind):
    """An arch of one kind of element, or of three kinds and materials."""
    if kind == "mixed":
        return mixed_brick(arched, ("foot", "", "leaf"))
    return brick(kind, (4, 2, 2), (2.0, 1.0, 0.4), arched)


def clamped_nodes(mesh):
    """The nodes of the arch at x = 0."""
    return np.flatnonzero(mesh.points[:, 0] < 1e-9)


def off_by(found, exact):
    """Largest relative difference."""
    return np.max(np.abs(found / exact - 1.0))


@needs_calculix
@pytest.mark.parametrize("kind", [*QUADRATIC, "mixed", "hex8"])
def test_ten_frequencies_of_a_curved_body_agree_to_a_millionth(kind, tmp_path):
    mesh = curved(kind)
    held = clamped_nodes(mesh)
    found = calculix_blocks.natural_frequencies(tmp_path, mesh, MATERIALS, held, COUNT)
    matrices = elastic_matrices(discretise(mesh), MATERIALS)
    exact = lowest_hz(*matrices, COUNT, (3 * held[:, None] + np.arange(3)).ravel())
    assert len(found) == COUNT
    assert off_by(found, exact) < 1e-6


@needs_calculix
def test_the_comparison_sees_straight_edges(tmp_path):
    mesh = curved("tet10")
    held = clamped_nodes(mesh)
    straight = mesh.points.copy()
    block = mesh.blocks[0]
    straight[block.nodes[:, 4:]] = mesh.points[block.nodes[:, np.array(block.topology.edges)]].mean(axis=2)
    found = calculix_blocks.natural_frequencies(
        tmp_path, mesh_of(straight, block.nodes, "tet10"), MATERIALS, held, COUNT
    )
    matrices = elastic_matrices(discretise(mesh), MATERIALS)
    assert off_by(found, lowest_hz(*matrices, COUNT, (3 * held[:, None] + np.arange(3)).ravel())) > 1e-4


def sector_of(mesh):
    """The mesh as a sector without contact faces, clamped at x = 0."""
    none = ContactFace(np.empty(0, dtype=int), np.empty((0, 3)), np.empty((0, 3, 3)), np.empty(0))
    return SectorMesh(mesh.points, mesh.blocks, {"root": clamped_nodes(mesh)}, none, none, 12)


def solved(full, force):
    """Static displacements (n, 3)."""
    free = np.setdiff1d(np.arange(full.n_dofs), full.fixed)
    displacement = np.zeros(full.n_dofs)
    displacement[free] = spsolve(full.stiffness[free][:, free].tocsc(), force[free])
    return displacement.reshape(-1, 3)


@needs_calculix
@pytest.mark.parametrize("kind", ["tet10", "mixed"])
def test_ten_frequencies_about_the_equilibrium_in_rotation(kind, tmp_path):
    mesh, speed = curved(kind), 300.0
    found = calculix_blocks.natural_frequencies(
        tmp_path, mesh, MATERIALS, clamped_nodes(mesh), COUNT, calculix.Rotation(speed * np.pi / 30.0)
    )
    sector = sector_of(mesh)
    rest = assemble(sector, MATERIALS, None)
    full = stiffen_by_rotation(rest, sector, MATERIALS, speed)
    exact = lowest_hz(full.stiffness, full.mass, COUNT, full.fixed)
    assert off_by(lowest_hz(rest.stiffness, rest.mass, COUNT, rest.fixed), exact) > 1e-3
    assert off_by(found, exact) < 2e-6


def top_of(mesh):
    """The sides on the outer surface of the arch."""
    radius = np.hypot(mesh.points[:, 0], mesh.points[:, 2])
    return sides_on(mesh.blocks, np.flatnonzero(radius > radius.max() - 1e-9))


def corners_of(mesh, surface):
    """Corner nodes of each side of a surface."""
    return [
        mesh.blocks[block].nodes[element][list(mesh.blocks[block].topology.sides[side])]
        for block, element, side in zip(surface.block, surface.element, surface.side, strict=True)
    ]


@needs_calculix
@pytest.mark.parametrize("kind", [*QUADRATIC, "mixed"])
def test_displacements_under_a_pressure_on_a_curved_surface(kind, tmp_path):
    mesh = curved(kind)
    sector, surface = sector_of(mesh), top_of(mesh)
    value = np.linspace(1e6, 2e6, len(surface))
    deck = calculix_blocks.static_deck(
        mesh, MATERIALS, clamped_nodes(mesh), list(zip(corners_of(mesh, surface), value, strict=True))
    )
    found = calculix_blocks.displacements(tmp_path, deck, len(mesh.points))
    full = assemble(sector, MATERIALS, None)
    single = (
        ElementSides(*(rows[k : k + 1] for rows in (surface.block, surface.element, surface.side)))
        for k in range(len(surface))
    )
    force = sum(pressure_force(full, sector, side, p) for side, p in zip(single, value, strict=True))
    exact = solved(full, force)
    # CalculiX has fewer points on the sides of its elements: the normals of curved sides differ a little
    assert np.abs(found - exact).max() < 5e-5 * np.abs(exact).max()


@needs_calculix
@pytest.mark.parametrize("kind", [*QUADRATIC, "mixed"])
def test_displacements_in_a_temperature_field(kind, tmp_path):
    mesh = curved(kind)
    sector = sector_of(mesh)
    temperature = 300.0 + 200.0 * mesh.points[:, 0] - 100.0 * mesh.points[:, 2]
    for block in mesh.blocks:  # CalculiX takes the temperatures of the corners alone
        ends = block.nodes[:, np.array(block.topology.edges)]
        temperature[block.nodes[:, block.topology.corners :]] = temperature[ends].mean(axis=2)
    deck = calculix_blocks.static_deck(mesh, MATERIALS, clamped_nodes(mesh), temperature=temperature)
    found = calculix_blocks.displacements(tmp_path, deck, len(mesh.points))
    full = assemble(sector, MATERIALS, None)
    exact = solved(full, thermal_force(full, sector, MATERIALS, temperature))
    assert np.abs(found - exact).max() < 1e-6 * np.abs(exact).max()


PITCH = np.radians(30.0)
SEGMENT = Material(210000.0, 0.3, 7.8e-9)  # mm, t, s


@cache
def segment():
    """A twelfth of a disk about x, 96 hex20 as in CalculiX's problem `segment`, and its faces at 30 and 0 degrees."""
    flat = brick("hex20", (2, 12, 4), (0.1, 0.9, PITCH))
    axial, radius, angle = flat.points.T + np.array([[0.0], [0.1], [0.0]])
    points = np.column_stack([axial, radius * np.cos(angle), radius * np.sin(angle)])
    faces = (np.flatnonzero(np.abs(angle - end) < 1e-9) for end in (PITCH, 0.0))
    right, left = (face[np.lexsort(np.round(flat.points[face, :2], 9).T)] for face in faces)
    return mesh_of(points, flat.blocks[0].nodes, "hex20"), right, left


def segment_hz(diameter, count):
    """Frequencies of the free disk at a number of nodal diameters: the right face moves as the left one, turned."""
    mesh, right, left = segment()
    turn = np.array([[1, 0, 0], [0, np.cos(PITCH), -np.sin(PITCH)], [0, np.sin(PITCH), np.cos(PITCH)]])
    kept = np.setdiff1d(np.arange(len(mesh.points)), right)
    place = np.zeros(len(mesh.points), dtype=int)
    place[kept] = np.arange(len(kept))
    node = coo_matrix((np.ones(len(kept)), (kept, place[kept])), (len(mesh.points), len(kept)))
    tied = coo_matrix((np.ones(len(right)), (right, place[left])), node.shape)
    constraint = (kron(node, np.eye(3)) + np.exp(1j * diameter * PITCH) * kron(tied, turn)).tocsr()
    matrices = elastic_matrices(discretise(mesh), SEGMENT)
    k, m = ((constraint.conj().T @ matrix @ constraint).tocsc() for matrix in matrices)
    squared = eigsh(k, k=count, M=m, sigma=1e9, which="LM", return_eigenvectors=False)
    return np.sort(np.sqrt(squared)) / (2 * np.pi)


def test_the_disk_segment_has_the_frequencies_that_calculix_prints_for_it():
    """Two nodal diameters; the nodes of that problem are rounded to some 1e-5 of the radius."""
    printed = [130230.4, 819388.7, 1130438.0, 1834951.0, 2129782.0]
    np.testing.assert_allclose(segment_hz(2, 5), printed, rtol=8e-6)


@needs_calculix
@pytest.mark.parametrize("diameter", [2, 3])
def test_a_disk_under_cyclic_symmetry_agrees_to_a_millionth(diameter, tmp_path):
    mesh, right, left = segment()
    cyclic = ["*SURFACE, NAME=RIGHT, TYPE=NODE", *[f"{node}," for node in right + 1]]
    cyclic += ["*SURFACE, NAME=LEFT, TYPE=NODE", *[f"{node}," for node in left + 1]]
    cyclic += ["*TIE, CYCLIC SYMMETRY, NAME=FACES", "LEFT, RIGHT", "*CYCLIC SYMMETRY MODEL, N=12"]
    cyclic += ["0., 0., 0., 1., 0., 0.", "*STEP", "*FREQUENCY", "10"]
    cyclic += [f"*SELECT CYCLIC SYMMETRY MODES, NMIN={diameter}, NMAX={diameter}", "*END STEP"]
    text = "\n".join([*calculix_blocks.body(mesh, {"": SEGMENT}, []), *cyclic]) + "\n"
    rows = [line.split() for line in calculix_blocks.run(tmp_path, text).splitlines()]
    found = [float(row[4]) for row in rows if len(row) >= 5 and row[0] == str(diameter) and row[1].isdigit()]
    assert len(found) == 10  # each twice
    assert off_by(np.array(found[::2]), segment_hz(diameter, 5)) < 1e-6
