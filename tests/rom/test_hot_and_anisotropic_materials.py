"""Materials over the temperature and anisotropic ones: scaling, beams, free expansion, CalculiX, bad input."""

import calculix
import calculix_blocks
import numpy as np
import pytest
from element_meshes import arched, brick, mixed_brick
from rom_reference import lowest_hz
from test_calculix_elements import clamped_nodes, needs_calculix, off_by, sector_of, solved

from geometry.mesh_files.read import read_mesh
from pipeline.scene.elastic_material import elastic_material
from rom import AnisotropicMaterial, HotMaterials, Material, MaterialTable, RomParameterError, assemble
from rom.finite_elements.assembly import ElasticBody, elastic_matrices, stress_at_quadrature
from rom.finite_elements.discretisation import discretise
from rom.finite_elements.loads import at_quadrature, thermal_force
from rom.finite_elements.material import law_of
from rom.finite_elements.rotation import stiffen_by_rotation

TURNED = np.linalg.qr(np.array([[1.0, 0.4, -0.3], [-0.2, 1.0, 0.6], [0.5, -0.1, 1.0]]))[0]
TURNED *= np.sign(np.linalg.det(TURNED))
NINE = ([1.4e11, 1.7e11, 2.2e11], [0.31, 0.25, 0.36], [8.0e10, 6.0e10, 9.5e10])
ORTHOTROPIC = AnisotropicMaterial.from_constants(*NINE, 8200.0, [1e-5, 1.6e-5, 2.2e-5], TURNED)
COLD, HOT = Material(2.1e11, 0.28, 7900.0, 1.1e-5), Material(1.5e11, 0.34, 7500.0, 1.5e-5)
ALLOY = MaterialTable((0.0, 400.0, 900.0), (COLD, Material(1.9e11, 0.3, 7800.0, 1.2e-5), HOT), mean_from=0.0)
SOFTER = AnisotropicMaterial(0.7 * ORTHOTROPIC.stiffness, 8000.0, [2e-5, 1e-5, 1e-5], TURNED)
CAST = MaterialTable((0.0, 900.0), (ORTHOTROPIC, SOFTER), mean_from=0.0)


def crystal(axes=((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))):
    return AnisotropicMaterial.from_constants([1.25e11] * 3, [0.39] * 3, [1.25e11] * 3, 8600.0, axes=axes)


def test_at_one_temperature_all_frequencies_are_as_the_root_of_young_s_modulus():
    mesh = mixed_brick(arched, ("", "", ""))
    table = MaterialTable((20.0, 820.0), (Material(2e11, 0.3, 7800.0), Material(1.6e11, 0.3, 7800.0)))
    (cold, mass), (hot, hot_mass) = (
        elastic_matrices(discretise(mesh), HotMaterials(table, at)) for at in (20.0, np.full(len(mesh.points), 620.0))
    )
    assert abs(hot - 0.85 * cold).max() < 1e-14 * abs(cold).max()
    assert abs(hot_mass - mass).max() <= 1e-14 * abs(mass).max()
    assert table.at(620.0) == Material(1.7e11, 0.3, 7800.0)


@pytest.mark.parametrize("along", [[1, 0, 0], [1, 1, 0], [1, 1, 1]])
def test_a_cantilever_of_a_cubic_crystal_is_as_stiff_as_young_s_modulus_along_it(along):
    """1/E = s11 - 2 (s11 - s12 - s44/2) (l^2 m^2 + m^2 n^2 + n^2 l^2), and Euler's first frequency."""
    unit = np.array(along) / np.linalg.norm(along)
    across = np.cross(unit, [0.3, -0.5, 0.8])
    across /= np.linalg.norm(across)
    frame = np.column_stack([unit, across, np.cross(unit, across)])  # the beam along x is along `unit` in the crystal
    material = crystal(frame)
    x, y, z = unit**2
    s11, s12, s44 = 1 / 1.25e11, -0.39 / 1.25e11, 1 / 1.25e11
    modulus = 1.0 / (s11 - 2.0 * (s11 - s12 - s44 / 2.0) * (x * y + y * z + z * x))
    assert material.modulus_along([1.0, 0.0, 0.0]) == pytest.approx(modulus, rel=1e-12)
    mesh = brick("hex20", (64, 1, 1), (1.0, 0.01, 0.01), lambda points: points)
    matrices = elastic_matrices(discretise(mesh), material)
    first = lowest_hz(*matrices, 1, (3 * clamped_nodes(mesh)[:, None] + np.arange(3)).ravel())[0]
    euler = 1.8751041**2 / (2.0 * np.pi) * np.sqrt(modulus * 0.01**2 / 12.0 / 8600.0)
    assert first == pytest.approx(euler, rel=5e-3)


def test_axes_turned_by_a_right_angle_leave_a_cubic_crystal_as_it_is():
    mesh = brick("hex8", (3, 2, 1), (1.0, 0.4, 0.2), arched)
    turned = crystal(np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]))
    body, after = (ElasticBody.of(discretise(mesh), material) for material in (crystal(), turned))
    moved = 0.02 * np.random.default_rng(1).standard_normal(mesh.points.size)
    for one, other in ((b.tangent(u) for b in (body, after)) for u in (moved, 0.0 * moved)):
        assert abs(one - other).max() < 1e-12 * abs(one).max()


def test_the_tangent_of_an_anisotropic_body_is_the_derivative_of_its_forces():
    mesh = brick("wedge15", (2, 1, 1), (1.0, 0.4, 0.2), arched)
    materials = HotMaterials(CAST, 300.0 + 200.0 * mesh.points[:, 0])
    body = ElasticBody.of(discretise(mesh), materials)
    random = np.random.default_rng(2)
    at, step = 0.01 * random.standard_normal((2, mesh.points.size))
    ahead, behind = (body.internal_force(at + sign * 1e-4 * step)[0] for sign in (1.0, -1.0))
    slope = body.tangent(at) @ step
    assert np.abs((ahead - behind) / 2e-4 - slope).max() < 1e-6 * np.abs(slope).max()
    linear = elastic_matrices(discretise(mesh), materials)[0]
    assert abs(body.tangent(0.0 * at) - linear).max() < 1e-13 * abs(linear).max()


@pytest.mark.parametrize("material", [ORTHOTROPIC, CAST, ALLOY])
def test_a_body_that_expands_freely_has_no_stress(material):
    mesh = brick("hex20", (2, 2, 1), (1.0, 0.4, 0.2), arched)
    hot = HotMaterials(material, 520.0, reference=20.0)
    law = law_of(hot, discretise(mesh).blocks[0], slice(None))
    tensor = 500.0 * law.expansion if law.strain is None else np.asarray(law.strain)
    strain = tensor if np.shape(tensor) == (3, 3) else tensor * np.eye(3)
    moved = mesh.points @ strain
    (stress,) = stress_at_quadrature(discretise(mesh), hot, moved)
    heat = law.restrained_stress(
        at_quadrature(discretise(mesh).blocks[0], slice(None), np.full(len(mesh.points), 500.0))
    )
    assert np.abs(heat).max() > 1e8
    assert np.abs(stress - heat).max() < 1e-9 * np.abs(heat).max()
    sector = sector_of(mesh)
    full = assemble(sector, hot, None)
    force = thermal_force(full, sector, hot, 500.0)
    assert np.abs(full.stiffness @ moved.ravel() - force).max() < 1e-9 * np.abs(force).max()


def test_thermal_strains_are_integrated_or_mean():
    """alpha = 1e-5 (1 + T / 1000): the integral from 20 to 520, and the mean one from 0 on."""
    states = tuple(Material(2e11, 0.3, 7800.0, 1e-5 * (1.0 + at / 1000.0)) for at in (0.0, 300.0, 1000.0))
    inside, mean = (MaterialTable((0.0, 300.0, 1000.0), states, mean_from) for mean_from in (None, 0.0))
    assert np.diff(inside.free_strain([20.0, 520.0])) == pytest.approx(1e-5 * (500.0 + (520.0**2 - 20.0**2) / 2000.0))
    assert np.diff(mean.free_strain([20.0, 520.0])) == pytest.approx(1e-5 * (520.0 * 1.52 - 20.0 * 1.02))


@needs_calculix
@pytest.mark.parametrize("speed", [0.0, 300.0])
@pytest.mark.parametrize("kind", ["isotropic", "orthotropic"])
def test_ten_frequencies_in_a_temperature_field(kind, speed, tmp_path):
    mesh = mixed_brick(arched, ("foot", "", "leaf"))
    rest = {"foot": Material(1.9e11, 0.29, 8200.0), "leaf": ORTHOTROPIC}
    materials = {**rest, "": CAST} if kind == "orthotropic" else {**rest, "": ALLOY, "leaf": ALLOY}
    temperature = field_of(mesh)
    rotation = calculix.Rotation(speed * np.pi / 30.0) if speed else None
    found = calculix_blocks.natural_frequencies(
        tmp_path, mesh, materials, clamped_nodes(mesh), 10, rotation, temperature
    )
    hot, sector = HotMaterials(materials, temperature), sector_of(mesh)
    full = stiffen_by_rotation(assemble(sector, hot, None), sector, hot, speed)
    exact = lowest_hz(full.stiffness, full.mass, 10, full.fixed)
    assert off_by(found, exact) < (2e-6 if speed else 1e-6)
    cold = assemble(sector, HotMaterials(materials, 0.0), None)
    assert off_by(lowest_hz(cold.stiffness, cold.mass, 10, cold.fixed), exact) > 1e-2


def field_of(mesh):
    """Temperatures of the nodes, mid-side nodes half-way: CalculiX takes those of the corners alone."""
    temperature = 300.0 + 180.0 * mesh.points[:, 0] - 100.0 * mesh.points[:, 2]
    for block in mesh.blocks:
        ends = block.nodes[:, np.array(block.topology.edges)]
        temperature[block.nodes[:, block.topology.corners :]] = temperature[ends].mean(axis=2)
    return temperature


@needs_calculix
@pytest.mark.parametrize("material", [ALLOY, CAST])
def test_displacements_by_mean_expansions_over_the_temperature(material, tmp_path):
    mesh = brick("hex20", (4, 2, 2), (2.0, 1.0, 0.4), arched)
    temperature = field_of(mesh)
    deck = calculix_blocks.static_deck(mesh, {"": material}, clamped_nodes(mesh), temperature=temperature)
    found = calculix_blocks.displacements(tmp_path, deck, len(mesh.points))
    hot, sector = HotMaterials(material, temperature, reference=0.0), sector_of(mesh)
    full = assemble(sector, hot, None)
    exact = solved(full, thermal_force(full, sector, hot, temperature))
    assert np.abs(found - exact).max() < 1e-6 * np.abs(exact).max()


@needs_calculix
@pytest.mark.parametrize("material", [ALLOY, CAST])
def test_thermal_stress_at_the_integration_points(material, tmp_path):
    """Their points of an element come in another order: each of theirs has one of ours, and the other way round."""
    mesh = brick("hex20", (4, 2, 2), (2.0, 1.0, 0.4), arched)
    temperature = field_of(mesh)
    deck = calculix_blocks.static_deck(mesh, {"": material}, clamped_nodes(mesh), temperature=temperature)
    printed = calculix_blocks.run(
        tmp_path, deck.replace("*NODE PRINT, NSET=ALL\nU", "*EL PRINT, ELSET=BLADE, GLOBAL=YES\nS")
    )
    rows = [line.split()[2:8] for line in printed.splitlines() if line.split()[1:2] and line.split()[1].isdigit()]
    theirs = np.array(rows, dtype=float).reshape(len(mesh.blocks[0]), -1, 6)  # xx, yy, zz, xy, xz, yz
    hot, sector, mesh_of = HotMaterials(material, temperature, reference=0.0), sector_of(mesh), discretise(mesh)
    full = assemble(sector, hot, None)
    ours = stress_at_quadrature(mesh_of, hot, solved(full, thermal_force(full, sector, hot, temperature)))[0]
    for batch in mesh_of.batches():
        block = mesh_of.blocks[batch.block]
        rise = at_quadrature(block, batch.part, temperature)
        ours[batch.part] -= law_of(hot, block, batch.part).restrained_stress(rise)
    ours = ours[..., [0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    apart = np.abs(theirs[:, :, None] - ours[:, None]).max(axis=-1)
    assert max(apart.min(axis=1).max(), apart.min(axis=2).max()) < 3e-6 * np.abs(ours).max()


@pytest.mark.parametrize(
    ("make", "line"),
    [
        (lambda: AnisotropicMaterial(np.diag([1e11] * 5 + [-1e9]), 8000.0), "positive definite"),
        (lambda: AnisotropicMaterial(np.triu(np.ones((6, 6))), 8000.0), "symmetric"),
        (lambda: AnisotropicMaterial(np.full((6, 6), np.nan), 8000.0), "symmetric"),
        (lambda: AnisotropicMaterial.from_constants([1e11, 1e10, 1e10], [4.0] * 3, [1e10] * 3, 8000.0), "nu12"),
        (lambda: AnisotropicMaterial.from_constants([1e11, 0.0, 1e10], [0.3] * 3, [1e10] * 3, 8000.0), "above 0"),
        (lambda: crystal(np.array([[1.0, 0.0, 0.0], [0.1, 1.0, 0.0], [0.0, 0.0, 1.0]])), "perpendicular"),
        (lambda: crystal(np.diag([1.0, 1.0, -1.0])), "right-handed"),
        (lambda: MaterialTable((20.0, 20.0), (COLD, HOT)), "ascend"),
        (lambda: MaterialTable((20.0, 200.0), (COLD, ORTHOTROPIC)), "one kind"),
        (lambda: ALLOY.at(1000.0), "0 to 900, or extended = true"),
        (lambda: assemble(sector_of(brick("hex8", (1, 1, 1), (1.0, 1.0, 1.0), arched)), ALLOY, None), "temperature"),
    ],
)
def test_what_no_solid_is_and_no_table_holds_is_refused(make, line):
    with pytest.raises(RomParameterError, match=line):
        make()


def test_a_deck_that_calculix_computes_gives_the_same_materials_back(tmp_path):
    mesh = mixed_brick(arched, ("foot", "", "leaf"))
    materials = {"foot": ALLOY, "": CAST, "leaf": ORTHOTROPIC}
    (tmp_path / "deck.inp").write_text("\n".join(calculix_blocks.body(mesh, materials, clamped_nodes(mesh))))
    found = read_mesh(tmp_path / "deck.inp")
    for index, block in enumerate(mesh.blocks):
        given = materials[block.material]
        read = elastic_material(found.materials[f"SOLID{index}"])
        assert isinstance(read, MaterialTable) == isinstance(given, MaterialTable)
        temperature = np.array([0.0, 450.0, 900.0])
        for at in temperature if isinstance(given, MaterialTable) else [0.0]:
            one, other = (m.at(at) if isinstance(m, MaterialTable) else m for m in (read, given))
            strain = np.random.default_rng(3).standard_normal((3, 3))
            np.testing.assert_allclose(
                one.law.stress(strain + strain.T), other.law.stress(strain + strain.T), rtol=1e-9
            )
            assert one.density == pytest.approx(other.density)
            np.testing.assert_allclose(one.law.expansion, other.law.expansion, rtol=1e-9, atol=1e-18)
        if isinstance(given, MaterialTable):
            np.testing.assert_allclose(read.free_strain(temperature), given.free_strain(temperature), rtol=1e-12)
