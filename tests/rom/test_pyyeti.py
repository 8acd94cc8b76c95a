"""Exported reduced matrices under the Craig-Bampton checks of pyYeti.

The checks ask how the boundary moves as a rigid body, so the blade is free here: none of its root is clamped, and its
contact and tip nodes alone hold the inside. A clamped blade has no rigid-body motion and must fail.
pyYeti counts six dofs a node: the rotations, which solid elements do not have, are empty rows.
"""

import io
from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest
from rom_meshes import NODAL
from rom_reference import lowest_hz

from geometry import BladeParameters, MeshParameters, SectorMesh, ShroudParameters, build_sector
from rom import (
    FullModel,
    Material,
    ReductionOptions,
    assemble,
    read_reduced_model,
    reduce_sector,
    write_reduced_model,
)
from rom.finite_elements.full_model import node_dofs

cb = pytest.importorskip("pyyeti.cb", reason="pyYeti is not installed (package pyyeti)")
nastran = pytest.importorskip("pyyeti.nastran.n2p", reason="pyYeti is not installed (package pyyeti)")

STEEL = Material(young_modulus=2.1e11, poisson_ratio=0.3, density=7800.0)
MODES = 20
T1, N, T2 = 0, 1, 2
# A mass matrix of motions that are not rigid has radii of gyration that are not real.
no_gyration = pytest.mark.filterwarnings("ignore:invalid value encountered in sqrt:RuntimeWarning")


@dataclass(frozen=True)
class Checked:
    """A sector, its full model, and what pyYeti made of its exported matrices.

    support (6,): statically determinate dofs; answer: arrays by name; report: the text it wrote.
    """

    sector: SectorMesh
    full: FullModel
    support: np.ndarray
    answer: SimpleNamespace
    report: str

    @property
    def translations(self):
        """Rows of the boundary that move: three of six at each node."""
        return np.flatnonzero(np.arange(len(self.answer.rbg)) % 6 < 3)

    @property
    def boundary_positions(self):
        """Kept nodes (k, 3) [m] in the order of the reduced coordinates."""
        sector = self.sector
        return np.vstack([sector.right.position, sector.left.position, sector.points[sector.node_sets["tip"]]])


def shrouded(clamped):
    blade = BladeParameters(72, 0.3, 0.1, chord=0.03, thickness=0.008, tip_thickness=0.006, twist=20.0)
    shroud = ShroudParameters(angle=70.0, thickness=0.006, axial_width=0.036, contact_length=0.01)
    sector = build_sector(blade, shroud, MeshParameters(size=0.006))
    root = sector.node_sets["root"] if clamped else np.zeros(0, dtype=int)
    return replace(sector, node_sets={**sector.node_sets, "root": root})


def six_dofs_a_node(matrix, n_contacts):
    """Reduced matrix (n, n) with three empty rotations a node; contact dofs in the order t1, n, t2."""
    nodes = 2 * n_contacts + 1
    place = 6 * np.arange(nodes)[:, None] + np.arange(3)
    # The reduced coordinates of a contact node are t1, t2, n.
    place[:-1] = place[:-1, [T1, T2, N]]
    modal = 6 * nodes + np.arange(len(matrix) - 3 * nodes)
    rows = np.concatenate([place.ravel(), modal])
    padded = np.zeros((6 * nodes + len(modal),) * 2)
    padded[np.ix_(rows, rows)] = matrix
    return padded


def checked(folder, clamped=False, left_frame=None):
    """Reduce a sector, write and read the file, and let pyYeti check what it says, the left frames being as given."""
    sector = shrouded(clamped)
    full = assemble(sector, STEEL)
    write_reduced_model(folder / "model.h5", reduce_sector(full, sector, ReductionOptions(modes=MODES), NODAL).model)
    model = read_reduced_model(folder / "model.h5")
    mass, stiffness = (six_dofs_a_node(matrix, model.n_contacts) for matrix in (model.mass, model.stiffness))
    # One corner of the right face, two dofs of the opposite corner, one of the left face.
    corner, last = 6 * (model.n_contacts - 1), 6 * (2 * model.n_contacts - 1)
    support = np.array([T1, N, T2, corner + T1, corner + N, last + T2])
    found = Checked(sector, full, support, SimpleNamespace(), "")
    # A contact node's own axes are x = t1, y = n, z = t2 (right-handed), given by an origin, z and x.
    frames = [*sector.right.frame, *(sector.left.frame if left_frame is None else left_frame)]
    axes = [np.array([[k, 1, 0], [0, 0, 0], t2, t1]) for k, (t1, t2, _) in enumerate(frames, 1)]
    names = list(range(1, len(axes) + 2))
    table = nastran.addgrid(None, names, "b", 0, found.boundary_positions, [*axes, 0])
    report = io.StringIO()
    boundary = np.arange(6 * len(names))
    answer = cb.cbcheck(report, mass, stiffness, boundary, support, uset=table, rb_norm=True)
    return replace(found, answer=answer, report=report.getvalue())


@pytest.fixture(scope="module")
def free(tmp_path_factory):
    return checked(tmp_path_factory.mktemp("free"))


def rigid_mass(full):
    """Mass, first and second moments (6, 6) of the full model about the origin, motions x, y, z, then turns."""
    motion = np.zeros((len(full.positions), 3, 6))
    motion[:, :, :3] = np.eye(3)
    motion[:, :, 3:] = np.cross(np.eye(3), full.positions[:, None, :]).transpose(0, 2, 1)
    motion = motion.reshape(-1, 6)
    return motion.T @ (full.mass @ motion)


def test_all_checks_of_the_report_pass(free):
    assert "Check: PASS" in free.report
    assert free.report.count("Okay") == 5
    for complaint in ("CHECK!", "WARNING", "Warning", "FAIL", "not symmetric"):
        assert complaint not in free.report


def test_rigid_body_modes_by_stiffness_and_by_eigenvectors_are_those_of_the_geometry(free):
    rows, answer = free.translations, free.answer
    np.testing.assert_allclose(answer.rbs[rows], answer.rbg[rows], atol=1e-8)
    np.testing.assert_allclose(answer.rbe[rows], answer.rbg[rows], atol=1e-8)
    found = cb.cbcoordchk(answer.k, answer.bset, free.support, verbose=False, rb_normalizer=answer.rbg[free.support])
    assert found.refpoint_chk == "pass"
    np.testing.assert_allclose(found.coords, free.boundary_positions, atol=1e-9)


def test_nothing_holds_the_free_blade(free):
    stiffness = free.answer.k
    assert np.max(np.abs(stiffness @ free.answer.rbs)) < 1e-11 * np.max(np.abs(stiffness))


def test_mass_centre_of_gravity_and_inertia_are_those_of_the_full_model(free):
    answer, boundary = free.answer, np.ix_(free.answer.bset, free.answer.bset)
    exact = rigid_mass(free.full)
    for found in (
        answer.rbs.T @ answer.m @ answer.rbs,
        answer.rbg.T @ answer.m[boundary] @ answer.rbg,
        answer.rbe.T @ answer.m @ answer.rbe,
    ):
        # The smallest inertia, about the stacking axis, is 1e-4 of the largest entry.
        np.testing.assert_allclose(found, exact, atol=1e-8 * np.max(exact))


def test_fixed_base_frequencies_are_those_of_the_full_model_with_the_boundary_dofs_held(free):
    sector, full = free.sector, free.full
    vertices = np.concatenate([sector.right.nodes, sector.left.nodes, sector.node_sets["tip"]])
    exact = lowest_hz(full.stiffness, full.mass, 8, node_dofs(full.vertex_node[vertices]).ravel())
    np.testing.assert_allclose(free.answer.cb_frq[:8], exact, rtol=1e-9)
    assert np.all(free.answer.effmass_percent.sum() < 100.0)


@no_gyration
def test_a_clamped_blade_is_found_grounded(tmp_path):
    clamped = checked(tmp_path, clamped=True)
    assert "Check: FAIL" in clamped.report
    # The values that a clamp leaves alone are still right.
    assert clamped.report.count("Okay") == 5
    forces = clamped.answer.k @ clamped.answer.rbs
    assert np.max(np.abs(forces)) > 1e-5 * np.max(np.abs(clamped.answer.k))


@no_gyration
def test_frames_of_the_other_face_are_noticed(tmp_path):
    wrong = checked(tmp_path, left_frame=shrouded(clamped=False).right.frame)
    rows = wrong.translations
    assert np.max(np.abs(wrong.answer.rbs[rows] - wrong.answer.rbg[rows])) > 1e-2
