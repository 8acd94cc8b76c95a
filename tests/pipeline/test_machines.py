"""A published blade: the E3 booster, whose modes at rest were read off a Campbell diagram to some 7 %."""

from pathlib import Path

import numpy as np
from scipy.sparse.linalg import eigsh

from pipeline.scene.geometry_parameters import sector_of
from pipeline.scene.reading import read_scene
from rom import Material, assemble

SCENES = Path(__file__).parents[2] / "scenes"
PUBLISHED = [250.0, 1000.0, 1050.0]  # Hz: first flex, first torsion, second flex


def test_booster_without_shroud() -> None:
    scene = read_scene(SCENES / "e3_booster.toml").first
    assert scene.material is not None
    given = scene.material
    full = assemble(sector_of(scene, size=0.012), Material(given.young_modulus, given.poisson_ratio, given.density))
    free = np.setdiff1d(np.arange(full.stiffness.shape[0]), full.fixed)
    stiffness, mass = (matrix[free][:, free].tocsc() for matrix in (full.stiffness, full.mass))
    squared = eigsh(stiffness, k=3, M=mass, sigma=0.0, return_eigenvectors=False)
    hertz = np.sqrt(np.sort(squared)) / (2 * np.pi)
    np.testing.assert_allclose(hertz, PUBLISHED, rtol=0.08)  # and the error of so coarse a mesh
    np.testing.assert_allclose(hertz[0], 267.0, rtol=0.01)
