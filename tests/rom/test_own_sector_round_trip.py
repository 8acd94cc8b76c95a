"""The blade of the mesher, written to a file of another program and read back: the same sector and frequencies."""

import sys
from pathlib import Path

import numpy as np
import pytest
from mesh_writer import write_mesh

from geometry import read_mesh
from geometry.own_mesh.own_sector import sector_from_mesh
from geometry.own_mesh.sector_choice import SectorChoice
from rom import BoundaryChoice, Material, ReductionOptions, assemble, natural_frequencies, reduce_sector

sys.path.append(str(Path(__file__).parents[1] / "geometry"))
from own_mesh_support import N_BLADES, dummy

STEEL = Material(young_modulus=2.1e11, poisson_ratio=0.3, density=7850.0)
NAMES = {"root": "root", "contact_right": "face_right", "contact_left": "face_left", "tip": "tip"}


def reduced_hz(sector, kind):
    """Frequencies of the free blades and of the stuck ring in opposite phase."""
    full = assemble(sector, STEEL, "hex20")
    options = ReductionOptions(modes=10, store_basis=False)
    model = reduce_sector(full, sector, options, BoundaryChoice(contact_dofs=kind)).model
    share = 1e8 * model.contact_area / model.contact_area.sum()
    free = natural_frequencies(model, np.pi, count=6)
    return np.concatenate([free, natural_frequencies(model, np.pi, normal=share, tangential=share, count=6)])


@pytest.mark.parametrize("suffix", ["inp", "bdf", "cdb", "msh"])
@pytest.mark.parametrize("angle", [180.0, 70.0])
def test_sector_of_a_file(angle, suffix, tmp_path):
    """Plane faces: frames and areas to round-off. At 70 degrees sides of elements are not quite the cylinder."""
    made = dummy(angle)
    write_mesh(tmp_path / f"blade.{suffix}", made)
    own = sector_from_mesh(read_mesh(tmp_path / f"blade.{suffix}"), SectorChoice(N_BLADES, sets=NAMES))
    assert own.findings.matching
    for face, wanted in ((own.sector.right, made.right), (own.sector.left, made.left)):
        np.testing.assert_array_equal(face.nodes, wanted.nodes)
        np.testing.assert_allclose(face.frame, wanted.frame, atol=1e-12 if angle == 180.0 else 2e-3)
        total = pytest.approx(wanted.area.sum(), rel=1e-12 if angle == 180.0 else 2e-5)
        assert face.area.sum() == total


@pytest.mark.parametrize(("angle", "close"), [(180.0, 1e-9), (70.0, 3e-4)])
@pytest.mark.parametrize("kind", ["mortar", "patch", "nodal"])
def test_frequencies_of_the_sector_of_a_file(angle, close, kind, tmp_path):
    """At 70 degrees the areas that the nodes stand for differ by 0.4 %: the mesher shares the face evenly."""
    made = dummy(angle)
    write_mesh(tmp_path / "blade.inp", made)
    own = sector_from_mesh(read_mesh(tmp_path / "blade.inp"), SectorChoice(N_BLADES, sets=NAMES)).sector
    np.testing.assert_allclose(reduced_hz(own, kind), reduced_hz(made, kind), rtol=close)
