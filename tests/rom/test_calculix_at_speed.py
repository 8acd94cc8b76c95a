"""Natural frequencies at speed against CalculiX: static step with the centrifugal load, then a perturbation step.

Its linear static step is followed by the same terms as `equilibrium = "linear"` here, its nonlinear one (NLGEOM) by
those of "nonlinear". The thin, twisted blade is the hardest of `benchmarks/frequencies_at_speed.py`: without the
initial-displacement stiffness a frequency is off by 1 %.
"""

import calculix
import numpy as np
import pytest
from rom_reference import lowest_hz
from scipy.sparse.linalg import eigsh

from geometry import BladeParameters, MeshParameters, ShroudParameters, build_sector
from rom import Material, ReducedModel, assemble
from rom.cyclic.natural_frequencies import gyroscopic_frequencies
from rom.finite_elements.rotation import coriolis_acceleration, stiffen_by_rotation

pytestmark = pytest.mark.skipif(calculix.PROGRAM is None, reason="CalculiX is not installed: no ccx on PATH")

STEEL = Material(young_modulus=2.1e11, poisson_ratio=0.3, density=7850.0)
SPEED = 9000.0  # rev/min
COUNT = 12


@pytest.fixture(scope="module")
def blade():
    thin = BladeParameters(
        n_blades=72, hub_radius=0.3, length=0.2, chord=0.036, thickness=0.006, tip_thickness=0.003, twist=40.0
    )
    shroud = ShroudParameters(angle=70.0, thickness=0.005, axial_width=0.04, contact_length=0.012)
    sector = build_sector(thin, shroud, MeshParameters(size=0.018, contact_grid=(2, 2)))
    return sector, assemble(sector, STEEL)


def in_rotation(sector, folder, **choice):
    """Text of the result file for the lowest modes at the speed."""
    rotation = calculix.Rotation(SPEED * np.pi / 30.0, **choice)
    calculix.run(folder, calculix.deck(calculix.quadratic_mesh(sector), STEEL, COUNT, rotation))
    return (folder / "blade.dat").read_text()


def test_nonlinear_equilibrium_and_coriolis_forces(blade, tmp_path):
    sector, full = blade
    at_speed = stiffen_by_rotation(full, sector, STEEL, SPEED)
    said = in_rotation(sector, tmp_path, coriolis=True)
    free = np.setdiff1d(np.arange(full.n_dofs), full.fixed)
    squared, modes = eigsh(at_speed.stiffness[free][:, free], COUNT, full.mass[free][:, free], sigma=0.0)
    found = np.sqrt(squared) / (2 * np.pi)
    np.testing.assert_allclose(found, calculix.frequencies(said), rtol=1e-6)
    # CalculiX adds the Coriolis forces between these modes: a model of the same coordinates.
    shapes = np.zeros((full.n_dofs, COUNT))
    shapes[free] = modes
    model = ReducedModel(
        mass=np.eye(COUNT),
        stiffness=np.diag(squared),
        contact_right=np.zeros((3, COUNT)),
        contact_position=np.zeros((1, 3)),
        force_excitation=np.ones(COUNT),
        outputs={"tip": np.ones(COUNT)},
        coriolis=shapes.T @ (full.mass @ coriolis_acceleration(shapes)),
        speed_rpm=SPEED,
    )
    turning = gyroscopic_frequencies(model, 0.0, count=COUNT)
    np.testing.assert_allclose(turning, calculix.gyroscopic_frequencies(said), rtol=1e-6)
    assert np.abs(turning[:10] / found[:10] - 1.0).max() > 1e-3


def test_linear_equilibrium(blade, tmp_path):
    sector, full = blade
    at_speed = stiffen_by_rotation(full, sector, STEEL, SPEED, "linear")
    found = lowest_hz(at_speed.stiffness, full.mass, COUNT, full.fixed)
    exact = calculix.frequencies(in_rotation(sector, tmp_path, nonlinear=False))
    np.testing.assert_allclose(found, exact, rtol=1e-6)
