"""Meshes written for other programs and read back: nodes, sets, surfaces, materials, and the same frequencies."""

from dataclasses import replace

import numpy as np
import pytest
from geometry_support import SLENDER, sector, slender_shroud
from mesh_file_support import area, every_kind, straight_middles, volumes
from mesh_writer import abaqus_number, nastran_number, write_mesh

from geometry import MeshFileError, read_mesh
from geometry.mesh_files.nastran_cards import real
from rom import Material, assemble

SUFFIXES = [".inp", ".bdf", ".cdb", ".msh", ".vtu"]
STEEL = {"young_modulus": 2.1e11, "poisson_ratio": 0.3, "density": 7850.0, "expansion": 1.23456789e-5}


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_every_kind_of_element(tmp_path, suffix):
    mesh = every_kind()
    write_mesh(tmp_path / f"a{suffix}", mesh, {"": STEEL})
    found = read_mesh(tmp_path / f"a{suffix}")
    kinds = {block.kind: volume for block, volume in zip(found.blocks, volumes(found), strict=True)}
    assert kinds == pytest.approx(dict(zip((b.kind for b in mesh.blocks), volumes(mesh), strict=True)), rel=1e-12)
    assert straight_middles(found, 1e-13)
    np.testing.assert_allclose(found.points, mesh.points, rtol=1e-12, atol=1e-15)
    assert set(found.node_sets["low"]) == set(mesh.node_sets["low"])
    if suffix != ".vtu":
        np.testing.assert_array_equal(found.node_labels, mesh.node_labels)
        assert sorted(np.concatenate(found.element_labels)) == [10, 20, 30, 40, 50, 60]
    if suffix in (".inp", ".msh", ".vtu"):
        assert area(found, "below") == pytest.approx(area(mesh, "below"), rel=1e-12)
    else:
        assert set(found.node_sets["below"]) == set(range(len(mesh.points)))
    if suffix != ".msh":
        kinds = {found.blocks[block].kind for block, _ in found.element_sets["pair"]}
        assert kinds == {mesh.blocks[1].kind, mesh.blocks[4].kind}
    if suffix in (".inp", ".bdf", ".cdb"):
        (material,) = found.materials.values()
        assert material == pytest.approx(STEEL, rel=1e-12)
        assert {block.material for block in found.blocks} == set(found.materials)


@pytest.fixture(scope="module")
def dummy():
    mesh = sector(SLENDER, slender_shroud(120.0), 0.008)
    return mesh, frequencies(mesh)


def frequencies(mesh):
    from scipy.sparse.linalg import eigsh

    model = assemble(mesh, Material(2.1e11, 0.3, 7850.0), "hex8")
    free = np.setdiff1d(np.arange(model.stiffness.shape[0]), model.fixed)
    stiffness, mass = model.stiffness[free][:, free], model.mass[free][:, free]
    values = eigsh(stiffness.tocsc(), 6, mass.tocsc(), sigma=0.0, return_eigenvectors=False)
    return np.sqrt(np.sort(values))


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_frequencies_of_a_blade(tmp_path, dummy, suffix):
    mesh, expected = dummy
    write_mesh(tmp_path / f"blade{suffix}", mesh)
    found = read_mesh(tmp_path / f"blade{suffix}")
    for name, nodes in mesh.node_sets.items():
        assert set(found.node_sets[name]) == set(nodes)
    again = replace(mesh, points=found.points, blocks=tuple(replace(b, material="") for b in found.blocks))
    np.testing.assert_allclose(frequencies(again), expected, rtol=1e-9)
    if suffix in (".inp", ".msh", ".vtu"):
        assert found.surfaces["face_right"].nodes(found.blocks).tolist() == sorted(mesh.node_sets["face_right"])


def test_numbers_fit_their_fields():
    random = np.random.default_rng(1)
    values = np.concatenate(
        [random.normal(size=2000) * 10.0 ** random.integers(-12, 12, 2000), [0.0, 1.0, -1e300, 9.999999999999999e-3]]
    ).tolist()
    for value in values:
        wide, narrow = abaqus_number(value), nastran_number(value)
        assert len(wide) <= 20
        assert len(narrow) <= 16
        assert float(wide) == pytest.approx(value, rel=1e-13, abs=0)
        assert real(narrow) == pytest.approx(value, rel=1e-10, abs=0)


def test_a_suffix_that_is_not_written(tmp_path):
    with pytest.raises(MeshFileError, match=r"a\.stl: the suffix must be one of \.inp, \.bdf, \.cdb, \.msh, \.vtu"):
        write_mesh(tmp_path / "a.stl", every_kind())
    with pytest.raises(MeshFileError, match="cannot be written: No such file or directory"):
        write_mesh(tmp_path / "nowhere" / "a.inp", every_kind())
