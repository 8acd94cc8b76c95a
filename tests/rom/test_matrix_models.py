"""Models made of matrices: units, axes, dofs, any symmetric mass, superelements, contact pairs."""

from dataclasses import replace

import numpy as np
import pytest
from matrix_tables import stocky_sector, write_nodes
from scipy.io import mmwrite
from scipy.linalg import block_diag, eigh, qr
from scipy.sparse import csr_matrix
from scipy.spatial.transform import Rotation

from rom import (
    BoundaryChoice,
    Material,
    MatrixFileError,
    ReductionOptions,
    RomParameterError,
    assemble,
    natural_frequencies,
    reduce_sector,
)
from rom.cyclic.natural_frequencies import gyroscopic_frequencies
from rom.finite_elements.rotation import stiffen_by_rotation
from rom.matrix_files.matrix_choice import MatrixChoice
from rom.matrix_files.matrix_model import model_from_matrices
from rom.matrix_files.superelement import model_from_superelement

STEEL = Material(2e11, 0.3, 7800.0)
NODAL = BoundaryChoice(excitation_direction=(1.0, 2.0, 0.5), contact_dofs="nodal")
MODES = ReductionOptions(6)


@pytest.fixture(scope="module")
def sector():
    return stocky_sector()


@pytest.fixture(scope="module")
def full(sector):
    return assemble(sector, STEEL, "hex8")


@pytest.fixture(scope="module")
def reduced(full, sector):
    return reduce_sector(full, sector, MODES, NODAL).model


def write_matrix(path, matrix):
    mmwrite(path, csr_matrix(matrix), symmetry="symmetric", precision=17)


def choice(folder, **values):
    files = {name: folder / file for name, file in (("stiffness", "K.mtx"), ("mass", "M.mtx"), ("nodes", "n.csv"))}
    return MatrixChoice(**{**files, "n_blades": 40, **values})


def assert_same_model(found, expected, rtol=1e-9):
    """Frequencies in two contact conditions, excitation, centrifugal force and tip of two reduced models."""
    for kwargs in ({}, {"normal": 1e8, "tangential": 5e7}):
        ours = natural_frequencies(found, 0.7, **springs(found, kwargs))[:8]
        assert np.allclose(ours, natural_frequencies(expected, 0.7, **springs(expected, kwargs))[:8], rtol=rtol)
    for name in ("force_centrifugal", "force_excitation"):
        ours, theirs = (static(model, getattr(model, name)) for model in (found, expected))
        assert np.allclose(ours, theirs, rtol=1e-7)
    assert np.allclose(found.contact_position, expected.contact_position, atol=1e-12)
    assert np.allclose(found.contact_area, expected.contact_area)


def springs(model, values):
    return {name: value / model.n_contacts * np.ones(model.n_contacts) for name, value in values.items()}


def static(model, force):
    """Static contact and tip displacements under a force."""
    q = np.linalg.solve(model.stiffness, force)
    return np.concatenate([model.contact_right @ q, model.contact_left @ q, [model.outputs["tip"] @ q]])


def test_matrices_with_clamped_rows_give_the_model_of_the_mesh(full, sector, reduced, tmp_path):
    write_matrix(tmp_path / "K.mtx", full.stiffness)
    write_matrix(tmp_path / "M.mtx", full.mass)
    write_nodes(tmp_path / "n.csv", sector.points, sector, sector.node_sets["root"])
    found = model_from_matrices(choice(tmp_path))
    assert found.full.isotropic_mass
    assert_same_model(reduce_sector(found.full, found.sector, MODES, NODAL).model, reduced, rtol=1e-11)


@pytest.mark.parametrize("unit", ["mm", "in", "mm-kg-ms"])
def test_units_axes_order_and_nodal_frames_make_no_difference(full, sector, reduced, tmp_path, unit):
    """Clamped rows left out, dofs in any order, an engine axis anywhere, displacements along axes of each node."""
    rng = np.random.default_rng(5)
    metre = {"mm": 1e-3, "in": 0.0254, "mm-kg-ms": 1e-3}[unit]
    newton = {"mm": 1.0, "in": 4.4482216152605, "mm-kg-ms": 1e3}[unit]
    kilogram = {"mm": 1e3, "in": 175.12683524647, "mm-kg-ms": 1.0}[unit]
    turn, shift = Rotation.from_rotvec([0.3, -1.1, 0.6]).as_matrix(), np.array([5.0, -2.0, 1.0])
    axes = Rotation.random(len(sector.points), random_state=2).as_matrix()
    # displacements along the nodal axes: axes @ turn @ ours, in the unit of length
    change = block_diag(*(axes @ turn))
    free = np.setdiff1d(np.arange(full.n_dofs), full.fixed)
    order = rng.permutation(free)
    for name, matrix, unit_si in (("K", full.stiffness, newton / metre), ("M", full.mass, kilogram)):
        theirs = change @ matrix.toarray() @ change.T / unit_si
        write_matrix(tmp_path / f"{name}.mtx", np.where(np.abs(theirs) > 0.0, theirs, 0.0)[np.ix_(order, order)])
    labels = rng.permutation(9000)[: len(sector.points)] + 1
    rows = "\n".join(f"{labels[dof // 3]},{dof % 3 + 1}" for dof in order)
    (tmp_path / "d.csv").write_text(f"node,component\n{rows}\n")
    points = sector.points @ turn.T / metre + shift
    turned = replace(
        sector,
        right=replace(sector.right, frame=sector.right.frame @ turn.T, area=sector.right.area / metre**2),
    )
    write_nodes(tmp_path / "n.csv", points, turned, [], labels)
    lines = (tmp_path / "n.csv").read_text().splitlines()
    lines[0] += ",e1x,e1y,e1z,e2x,e2y,e2z"
    for k, frame in enumerate(axes):
        lines[k + 1] += "," + ",".join(repr(float(value)) for value in frame[:2].ravel())
    (tmp_path / "n.csv").write_text("\n".join(lines))
    force = (change @ full.centrifugal)[order] / newton
    mmwrite(tmp_path / "f.mtx", force.reshape(-1, 1), precision=17)
    values = {"unit": unit, "axis": turn[:, 0], "axis_point": shift, "dofs": tmp_path / "d.csv"}
    found = model_from_matrices(choice(tmp_path, **values, centrifugal=tmp_path / "f.mtx"))
    model = reduce_sector(found.full, found.sector, MODES, NODAL).model
    assert_same_model(model, reduced, rtol=1e-8)
    assert np.allclose(found.sector.right.frame, sector.right.frame, atol=1e-9)


def test_constraint_of_a_single_dof(full, sector, tmp_path):
    """A node that is held along x alone: the same as a spring there of infinite stiffness."""
    node = int(np.setdiff1d(np.arange(len(sector.points)), [*sector.node_sets["root"], *sector.right.nodes])[5])
    kept = np.setdiff1d(np.arange(full.n_dofs), [3 * node])
    for name, matrix in (("K", full.stiffness), ("M", full.mass)):
        write_matrix(tmp_path / f"{name}.mtx", matrix[kept][:, kept])
    rows = "\n".join(f"{dof // 3 + 1},{dof % 3 + 1}" for dof in kept)
    (tmp_path / "d.csv").write_text(f"node,component\n{rows}\n")
    write_nodes(tmp_path / "n.csv", sector.points, sector, sector.node_sets["root"])
    found = model_from_matrices(choice(tmp_path, dofs=tmp_path / "d.csv"))
    assert not found.full.isotropic_mass
    model = reduce_sector(found.full, found.sector, ReductionOptions(60), NODAL).model
    free = np.setdiff1d(kept, full.fixed)
    exact = eigh(full.stiffness[free][:, free].toarray(), full.mass[free][:, free].toarray(), eigvals_only=True)
    assert np.allclose((2 * np.pi * natural_frequencies(model, 0.0)[:5]) ** 2, exact[:5], rtol=3e-4)
    unheld = 2 * np.pi * natural_frequencies(reduce_sector(full, sector, ReductionOptions(60), NODAL).model, 0.0)
    assert np.abs(unheld[:5] ** 2 / exact[:5] - 1).max() > 3e-3


def test_general_mass_path_is_the_isotropic_one_for_an_isotropic_mass(full, sector):
    turning = stiffen_by_rotation(full, sector, STEEL, 9000.0, "linear")
    ours = reduce_sector(turning, sector, MODES, NODAL, augment=True)
    general = reduce_sector(replace(turning, isotropic_mass=False), sector, MODES, NODAL, augment=True)
    for name in ("mass", "stiffness", "coriolis", "basis"):
        one, other = getattr(ours.model, name), getattr(general.model, name)
        assert np.allclose(one, other, rtol=1e-9, atol=1e-9 * np.abs(one).max()), name
    assert np.allclose(ours.augmented.mass, general.augmented.mass, atol=1e-7)


def small_model(mass_of):
    """Full model of six nodes with random matrices, two contact nodes, a root and a tip; mass_of(rng, n)."""
    rng = np.random.default_rng(11)
    n = 18
    root = rng.standard_normal((n, n))
    stiffness, mass = 1e6 * (root @ root.T + n * np.eye(n)), mass_of(rng, n)
    pitch = 2 * np.pi / 40
    points = np.array([0.0, 0.0, 1.0]) + rng.uniform(-0.1, 0.1, (6, 3))
    points[1] = [0.0, np.sin(pitch / 2), np.cos(pitch / 2)]
    points[2] = [0.0, -np.sin(pitch / 2), np.cos(pitch / 2)]
    return stiffness, mass, points


def test_any_symmetric_mass_all_modes_kept_is_the_full_problem(tmp_path):
    """Blocks of the mass that are no multiples of the identity, and Coriolis forces (M A + A M)/2 of it."""

    def mass_of(rng, n):
        root = rng.standard_normal((n, n))
        return root @ root.T / n + np.eye(n)

    stiffness, mass, points = small_model(mass_of)
    write_matrix(tmp_path / "K.mtx", stiffness)
    write_matrix(tmp_path / "M.mtx", mass)
    sets = {1: "contact_right", 2: "contact_left", 3: "tip"}
    lines = [f"{k + 1},{x!r},{y!r},{z!r},{sets.get(k, '')},0,1,0,1e-4" for k, (x, y, z) in enumerate(points.tolist())]
    (tmp_path / "n.csv").write_text("node,x,y,z,sets,nx,ny,nz,area\n" + "\n".join(lines))
    speed = 3000.0
    found = model_from_matrices(choice(tmp_path, speed_rpm=speed, tolerance=1.0))
    model = reduce_sector(found.full, found.sector, ReductionOptions(100), NODAL).model
    assert model.size == len(mass)
    exact = np.sqrt(eigh(stiffness, mass, eigvals_only=True)) / (2 * np.pi)
    lowest = natural_frequencies(model, 0.0)
    assert np.allclose(lowest, exact[: len(lowest)], rtol=1e-9)
    spin = np.kron(np.eye(6), np.array([[0.0, 0, 0], [0, 0, 1], [0, -1, 0]]))
    gyroscopic = (mass @ spin + spin @ mass) * speed * np.pi / 30
    n = len(mass)
    first_order = np.block(
        [[np.zeros((n, n)), np.eye(n)], [-np.linalg.solve(mass, stiffness), -np.linalg.solve(mass, gyroscopic)]]
    )
    turning = np.sort(np.abs(np.linalg.eigvals(first_order).imag))[::2] / (2 * np.pi)
    found_turning = np.sort(gyroscopic_frequencies(model, 0.0))
    assert np.allclose(found_turning, turning[: len(found_turning)], rtol=1e-7)
    assert np.abs(turning / exact - 1).max() > 1e-3
    # the centrifugal force of the quadratic form of the velocities, W^T M W x
    x = points.ravel()
    assert np.allclose(found.full.centrifugal, spin.T @ mass @ spin @ x)


def beam_element(length, area, inertia, density):
    """Stiffness and consistent mass (12, 12) of an Euler-Bernoulli beam along z, dofs u, v, w, rx, ry, rz a node."""
    young, shear = 2e11, 8e10
    k, m = np.zeros((12, 12)), np.zeros((12, 12))
    bend = np.array([[12, 6, -12, 6], [6, 4, -6, 2], [-12, -6, 12, -6], [6, 2, -6, 4]], dtype=float)
    inert = np.array([[156, 22, 54, -13], [22, 4, 13, -3], [54, 13, 156, -22], [-13, -3, -22, 4]], dtype=float)
    for place, sign in (([0, 4, 6, 10], 1.0), ([1, 3, 7, 9], -1.0)):
        scale = np.array([1.0, sign * length, 1.0, sign * length])
        k[np.ix_(place, place)] += young * inertia / length**3 * bend * np.outer(scale, scale)
        m[np.ix_(place, place)] += density * area * length / 420 * inert * np.outer(scale, scale)
    for place, stiff, dense in (
        ([2, 8], young * area, density * area),
        ([5, 11], 2 * shear * inertia, 2 * density * inertia),
    ):
        k[np.ix_(place, place)] += stiff / length * np.array([[1, -1], [-1, 1]])
        m[np.ix_(place, place)] += dense * length / 6 * np.array([[2, 1], [1, 2]])
    return k, m


def test_rotations_are_interior_dofs_of_a_cantilever(tmp_path):
    """Twelve beam elements with rotations: bending frequencies of the closed form, twice each (square section)."""
    n, length, side = 12, 0.4, 0.02
    k, m = np.zeros((6 * n + 6,) * 2), np.zeros((6 * n + 6,) * 2)
    stiffness, mass = beam_element(length / n, side**2, side**4 / 12, 7800.0)
    for e in range(n):
        at = slice(6 * e, 6 * e + 12)
        k[at, at] += stiffness
        m[at, at] += mass
    write_matrix(tmp_path / "K.mtx", k[6:, 6:])
    write_matrix(tmp_path / "M.mtx", m[6:, 6:])
    rows = [f"{node},{component}" for node in range(2, n + 2) for component in range(1, 7)]
    (tmp_path / "d.csv").write_text("node,component\n" + "\n".join(rows))
    sets = {n: "tip", n - 1: "contact_right", n - 2: "contact_left"}
    lines = [f"{e + 1},0,0,{1 + length * e / n!r},{sets.get(e, '')},0,1,0,1e-4" for e in range(n + 1)]
    (tmp_path / "n.csv").write_text("node,x,y,z,sets,nx,ny,nz,area\n" + "\n".join(lines))
    found = model_from_matrices(choice(tmp_path, dofs=tmp_path / "d.csv", tolerance=1.0))
    model = reduce_sector(found.full, found.sector, ReductionOptions(20), NODAL).model
    betas = np.array([1.8751041, 4.6940911, 7.8547574])
    book = (betas / length) ** 2 * np.sqrt(2e11 * side**2 / 12 / 7800.0) / (2 * np.pi)
    bending = natural_frequencies(model, 0.0)
    for exact in book:
        assert np.sum(np.abs(bending / exact - 1) < 2e-4) == 2
    with pytest.raises(RomParameterError, match="rotations"):
        model_from_matrices(choice(tmp_path, dofs=tmp_path / "d.csv", tolerance=1.0, speed_rpm=3000.0))


def test_superelement_with_its_transformation_is_its_model(full, sector, reduced, tmp_path):
    """The matrices of a reduction in other coordinates q = S p, with T = basis S, units mm and N."""
    mix, _ = qr(np.random.default_rng(0).standard_normal((reduced.size, reduced.size)))
    mix[:, -1] *= 3.0
    write_matrix(tmp_path / "K.mtx", symmetric(mix.T @ reduced.stiffness @ mix) * 1e3)  # J in N mm
    write_matrix(tmp_path / "M.mtx", symmetric(mix.T @ reduced.mass @ mix) * 1e3)
    mmwrite(tmp_path / "T.mtx", reduced.basis @ mix * 1e3, precision=17)
    mmwrite(tmp_path / "f.mtx", (mix.T @ reduced.force_centrifugal * 1e3).reshape(-1, 1), precision=17)
    rows = "\n".join(f"{dof // 3 + 1},{dof % 3 + 1}" for dof in range(full.n_dofs))
    (tmp_path / "d.csv").write_text(f"node,component\n{rows}\n")
    scaled = replace(sector, right=replace(sector.right, area=sector.right.area * 1e6))
    write_nodes(tmp_path / "n.csv", sector.points * 1e3, scaled, [])
    files = {"transformation": "T.mtx", "dofs": "d.csv", "centrifugal": "f.mtx"}
    values = {name: tmp_path / file for name, file in files.items()}
    found, _ = model_from_superelement(choice(tmp_path, **values, unit="mm", reduced=True), NODAL)
    assert_same_model(found, reduced)
    at = sector.points[sector.left.nodes[0]]
    loaded, _ = model_from_superelement(
        choice(tmp_path, **values, unit="mm", reduced=True), replace(NODAL, excitation_at=at)
    )
    expected = reduce_sector(full, sector, MODES, replace(NODAL, excitation_at=at)).model
    assert np.allclose(static(loaded, loaded.force_excitation), static(expected, expected.force_excitation))


def symmetric(matrix):
    return 0.5 * (matrix + matrix.T)


def test_superelement_with_physical_and_modal_coordinates(full, sector, reduced, tmp_path):
    """Contact nodes and tip along x, y and z, then modal coordinates: what Nastran and Ansys write."""
    boundary = [*sector.right.nodes, *sector.left.nodes, int(sector.node_sets["tip"][0])]
    frames = block_diag(
        *[*sector.right.frame, *sector.left.frame, np.eye(3)], np.eye(reduced.size - 3 * len(boundary))
    )
    for name in ("stiffness", "mass"):
        write_matrix(tmp_path / f"{name[0].upper()}.mtx", symmetric(frames.T @ getattr(reduced, name) @ frames))
    rows = [f"{node + 1},{axis}" for node in boundary for axis in "xyz"]
    rows += [",0"] * (reduced.size - len(rows))
    (tmp_path / "d.csv").write_text("node,component\n" + "\n".join(rows))
    write_nodes(tmp_path / "n.csv", sector.points, sector, [])
    values = {"stiffness": tmp_path / "S.mtx", "dofs": tmp_path / "d.csv", "reduced": True}
    found, _ = model_from_superelement(choice(tmp_path, **values), NODAL)
    found = replace(found, force_centrifugal=frames.T @ reduced.force_centrifugal)
    assert_same_model(found, reduced, rtol=1e-11)
    (tmp_path / "d.csv").write_text("node,component\n" + "\n".join([",0"] * 3 + rows[3:]))
    with pytest.raises(MatrixFileError, match="contact_right has no coordinates"):
        model_from_superelement(choice(tmp_path, **values), NODAL)
    write_matrix(tmp_path / "M.mtx", np.diag([1.0] * (reduced.size - 1) + [0.0]))
    (tmp_path / "d.csv").write_text("node,component\n" + "\n".join(rows))
    with pytest.raises(MatrixFileError, match="singular"):
        model_from_superelement(choice(tmp_path, **values), NODAL)


@pytest.mark.parametrize("curvature", [0.0, 8.0])
def test_normals_and_areas_from_the_nodes_alone(tmp_path, curvature):
    """A plane and a curved face of 7 x 5 nodes, material behind it: outward normals, area of the surface."""
    t, r = (grid.ravel() for grid in np.meshgrid(np.linspace(-0.01, 0.01, 7), np.linspace(-0.004, 0.004, 5)))
    pitch, tilt = 2 * np.pi / 40, np.pi / 5
    bulge = curvature * t**2
    normal = np.array([-np.sin(tilt), np.cos(tilt)])
    along = np.array([np.cos(tilt), np.sin(tilt)])
    x, arc = (t * along[k] + bulge * normal[k] for k in range(2))
    radius = 0.5 + r
    right = np.column_stack([x, 0.02 + arc, radius])
    c, s = np.cos(pitch), np.sin(pitch)
    back = np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    left = right @ back.T
    inside = right - 0.005 * np.array([normal[0], normal[1], 0.0])
    points = np.vstack([right, left, inside, left + 0.005 * back @ np.array([normal[0], normal[1], 0.0])])
    sets = ["contact_right"] * 35 + ["contact_left"] * 35 + [""] * 70
    lines = [f"{k + 1},{a!r},{b!r},{d!r},{sets[k]}" for k, (a, b, d) in enumerate(points.tolist())]
    (tmp_path / "n.csv").write_text("node,x,y,z,sets\n" + "\n".join(lines))
    write_matrix(tmp_path / "K.mtx", np.eye(420))
    write_matrix(tmp_path / "M.mtx", np.eye(420))
    found = model_from_matrices(choice(tmp_path))
    slope = 2 * curvature * t
    exact = (normal - slope[:, None] * along) / np.sqrt(1 + slope**2)[:, None]
    middle = np.arange(35).reshape(5, 7)[:, 1:-1].ravel()
    ours = np.array([frame[2] for frame in found.sector.right.frame])
    axes = found.sector.right.position[17] - [0, 0, np.hypot(0.02, 0.5)]
    assert np.linalg.norm(axes[1:]) < 0.05
    turn = np.arctan2(-points[:70, 1].mean(), points[:70, 2].mean())
    turned = exact[:, 1:] * np.cos(turn), exact[:, 1:] * -np.sin(turn)
    expected = np.column_stack([exact[:, 0], turned[0], turned[1]])
    assert np.abs(ours[middle] - expected[middle]).max() < (1e-9 if curvature == 0.0 else 3e-3)
    area = 0.008 * np.trapezoid(np.sqrt(1 + (2 * curvature * np.linspace(-0.01, 0.01, 2001)) ** 2), dx=1e-5)
    assert found.sector.right.area.sum() == pytest.approx(area, rel=1e-9 if curvature == 0.0 else 2e-3)
    assert any("triangulation" in note for note in found.notes)


def test_files_that_do_not_fit_each_other_are_refused_with_one_line(full, sector, tmp_path):
    k, m = full.stiffness, full.mass
    write_matrix(tmp_path / "K.mtx", k)
    write_matrix(tmp_path / "M.mtx", m)
    write_matrix(tmp_path / "small.mtx", m[:30][:, :30])
    write_matrix(tmp_path / "zero.mtx", csr_matrix((np.array([1e-30]), ([1], [0])), shape=m.shape))
    write_matrix(tmp_path / "negative.mtx", -m)
    write_nodes(tmp_path / "n.csv", sector.points, sector, sector.node_sets["root"])
    text = (tmp_path / "n.csv").read_text()
    (tmp_path / "fewer.csv").write_text("\n".join(text.splitlines()[:-1]))
    (tmp_path / "swapped.csv").write_text(
        text.replace("contact_right", "other")
        .replace("contact_left", "contact_right")
        .replace("other", "contact_left")
    )
    (tmp_path / "clamped.csv").write_text(text.replace("contact_right", "contact_right root", 1))
    tips = text.replace("contact_left", "contact_left tip")
    (tmp_path / "tips.csv").write_text(tips)
    (tmp_path / "no_right.csv").write_text(text.replace("contact_right", ""))
    rows = [f"{dof // 3 + 1},{dof % 3 + 1}" for dof in range(full.n_dofs)]
    (tmp_path / "unknown.csv").write_text("node,component\n" + "\n".join([*rows[:-1], "99999,3"]))
    (tmp_path / "short.csv").write_text("node,component\n" + "\n".join(rows[:-1]))
    cases = [
        ({"mass": tmp_path / "small.mtx"}, "two matrices of the same size"),
        ({"mass": tmp_path / "zero.mtx"}, "a mass of 0"),
        ({"mass": tmp_path / "negative.mtx"}, "a diagonal entry of -"),
        ({"nodes": tmp_path / "fewer.csv"}, "rows without dofs"),
        ({"nodes": tmp_path / "swapped.csv"}, "swap contact_right and contact_left"),
        ({"nodes": tmp_path / "clamped.csv"}, "constrained"),
        ({"nodes": tmp_path / "tips.csv"}, "one node"),
        ({"nodes": tmp_path / "no_right.csv"}, "no node is in the set contact_right"),
        ({"dofs": tmp_path / "unknown.csv"}, "no node 99999"),
        ({"dofs": tmp_path / "short.csv"}, "one dof for each row"),
        ({"n_blades": 41}, "41 blades"),
        ({"axis": "z"}, "axis"),
        ({"sets": {"root": "hub"}}, "no node is in the set hub"),
        ({"axis": (0.0, 0.0, 0.0)}, "not all 0"),
        ({"unit": "cm"}, "must be one of m, mm, in"),
    ]
    for values, said in cases:
        with pytest.raises((MatrixFileError, RomParameterError), match=said) as caught:
            model_from_matrices(choice(tmp_path, **values))
        assert "\n" not in str(caught.value)


def test_a_wrong_order_of_dofs_is_noticed(full, sector, tmp_path):
    order = np.random.default_rng(1).permutation(full.n_dofs)
    write_matrix(tmp_path / "K.mtx", full.stiffness[order][:, order])
    write_matrix(tmp_path / "M.mtx", full.mass[order][:, order])
    write_nodes(tmp_path / "n.csv", sector.points, sector, sector.node_sets["root"])
    assert any("warning" in note and "rigid" in note for note in model_from_matrices(choice(tmp_path)).notes)


def test_rows_without_entries_are_constrained(full, sector, reduced, tmp_path):
    """As Ansys writes the dofs that its supports hold: nobody names the root."""
    held = np.zeros(full.n_dofs, dtype=bool)
    held[full.fixed] = True
    for name, matrix in (("K", full.stiffness), ("M", full.mass)):
        write_matrix(tmp_path / f"{name}.mtx", np.where(held | held[:, None], 0.0, matrix.toarray()))
    write_nodes(tmp_path / "n.csv", sector.points, sector, [])
    found = model_from_matrices(choice(tmp_path))
    assert f"{len(full.fixed)} rows without entries are held: constrained dofs" in found.notes
    ours = reduce_sector(found.full, found.sector, MODES, NODAL).model
    assert np.allclose(natural_frequencies(ours, 0.7)[:8], natural_frequencies(reduced, 0.7)[:8], rtol=1e-9)


@pytest.mark.parametrize("mass", [0.0, 1e-3])
def test_rows_of_nodes_that_calculix_made(full, sector, tmp_path, mass):
    """Inner coordinates, each a mass on a spring on a node of the body: without mass they are rigid links."""
    n, free = full.n_dofs, np.setdiff1d(np.arange(full.n_dofs), full.fixed)
    own, at = n + np.arange(6), free[:6]
    k, m = np.zeros((2, n + 6, n + 6))
    k[:n, :n], m[:n, :n] = full.stiffness.toarray(), full.mass.toarray()
    spring = 0.1 * full.stiffness.diagonal().mean()
    k[own, own], k[at, at], k[own, at], k[at, own] = spring, k[at, at] + spring, -spring, -spring
    m[own, own] = mass
    kept = np.concatenate([free, own])
    for suffix, matrix in ((".sti", k), (".mas", m)):
        lower = np.tril(matrix[np.ix_(kept, kept)])
        i, j = np.nonzero(lower) if suffix == ".sti" or mass else np.nonzero(lower + np.eye(len(kept)))
        text = "\n".join(f"{a + 1} {b + 1} {lower[a, b]:.17g}" for a, b in zip(i, j, strict=True))
        (tmp_path / f"b{suffix}").write_text(text + "\n")
    labels = [f"{dof // 3 + 1}.{dof % 3 + 1}" for dof in free] + [
        f"{n // 3 + 7 + j // 3}.{j % 3 + 1}" for j in range(6)
    ]
    (tmp_path / "b.dof").write_text("\n".join(labels) + "\n")
    write_nodes(tmp_path / "n.csv", sector.points, sector, [])
    files = {"stiffness": tmp_path / "b.sti", "mass": tmp_path / "b.mas"}
    found = model_from_matrices(choice(tmp_path, **files))
    assert any(note.startswith("6 rows of nodes that the table does not have") for note in found.notes)
    ours = reduce_sector(found.full, found.sector, ReductionOptions(20), NODAL).model
    inverse = np.linalg.inv(k[np.ix_(kept, kept)])
    root = np.linalg.cholesky(inverse)
    exact = 1.0 / np.sqrt(np.linalg.eigvalsh(root.T @ m[np.ix_(kept, kept)] @ root)[::-1][:4]) / (2.0 * np.pi)
    assert np.allclose(natural_frequencies(ours, 0.7)[:4], exact, rtol=5e-4)
