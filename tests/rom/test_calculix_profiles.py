"""A blade from sections as points against the parametric one, and against CalculiX on its mesh."""

from dataclasses import replace

import calculix
import numpy as np
import pytest
from profile_support import naca, placed, sections_of
from rom_reference import lowest_hz

from geometry import BladeParameters, MeshParameters, ShroudParameters, build_sector
from geometry.blade.profiles import blade_of_sections, profile_stack
from rom import Material, assemble

STEEL = Material(young_modulus=2.1e11, poisson_ratio=0.3, density=7800.0)
BLADE = BladeParameters(72, 0.3, 0.15, 0.036, 0.009, 0.006, twist=25.0, section="lens")
SHROUD = ShroudParameters(angle=70.0, thickness=0.005, axial_width=0.040, contact_length=0.012)
TIP = 0.445


def of_points(sections):
    blade = blade_of_sections(72, 0.3, 0.15, profile_stack("blade.csv", sections), SHROUD.thickness)
    return build_sector(blade, SHROUD, MeshParameters(0.008))


def mass_and_hz(sector, count=10):
    full = assemble(sector, STEEL)
    return full.mass.sum() / 3, lowest_hz(full.stiffness, full.mass, count, full.fixed)


@pytest.mark.parametrize("changes", [{}, {"camber": 20.0, "root_stagger": -15.0}])
def test_sections_of_the_parametric_blade(changes):
    blade = replace(BLADE, **changes)
    own, made = build_sector(blade, SHROUD, MeshParameters(0.008)), of_points(sections_of(blade, TIP))
    mass, hertz = mass_and_hz(own)
    made_mass, made_hertz = mass_and_hz(made)
    assert made_mass == pytest.approx(mass, rel=1e-3)
    np.testing.assert_allclose(made_hertz, hertz, rtol=1e-3)


@pytest.mark.skipif(calculix.PROGRAM is None, reason="CalculiX is not installed: no ccx on PATH")
def test_profiles_with_a_sharp_edge_in_calculix(tmp_path):
    sections = [placed(naca(0.036, share), turn, radius) for share, turn, radius in ((0.2, 0, 0.3), (0.15, 30, TIP))]
    sector = of_points(sections)
    exact = calculix.run(tmp_path, calculix.deck(calculix.quadratic_mesh(sector), STEEL, 6))
    np.testing.assert_allclose(mass_and_hz(sector, 6)[1], exact, rtol=1e-6)
