"""Natural frequencies of shrouded blades against CalculiX: same mesh, same 20-node bricks, other program.

CalculiX integrates stiffness and mass of a C3D20 with the same 3 x 3 x 3 Gauss points, so nothing but round-off and
the seven digits that it prints is left between the two.
"""

from dataclasses import replace
from functools import cache

import calculix
import numpy as np
import pytest
from rom_reference import lowest_hz

from geometry import BladeParameters, MeshParameters, ShroudParameters, build_sector
from rom import Material, assemble

needs_calculix = pytest.mark.skipif(calculix.PROGRAM is None, reason="CalculiX is not installed: no ccx on PATH")

COUNT = 10
STEEL = Material(young_modulus=2.1e11, poisson_ratio=0.3, density=7800.0)
TITANIUM = Material(young_modulus=1.14e11, poisson_ratio=0.34, density=4430.0)
STRAIGHT = BladeParameters(n_blades=72, hub_radius=0.3, length=0.1, chord=0.03, thickness=0.008, tip_thickness=0.006)
# Shroud angle: blade, element size, material.
BLADES = {
    70.0: (STRAIGHT, 0.008, STEEL),
    120.0: (replace(STRAIGHT, n_blades=60, length=0.13, twist=15.0), 0.008, TITANIUM),
    180.0: (replace(STRAIGHT, hub_radius=0.25, twist=25.0, section="lens"), 0.007, STEEL),
}


def sector_of(angle):
    blade, size, material = BLADES[angle]
    shroud = ShroudParameters(angle=angle, thickness=0.006, axial_width=0.036, contact_length=0.01)
    return build_sector(blade, shroud, MeshParameters(size=size)), material


@cache
def solved(angle):
    """Sector, material and ten natural frequencies of a blade, once for all tests."""
    sector, material = sector_of(angle)
    full = assemble(sector, material)
    return sector, material, lowest_hz(full.stiffness, full.mass, COUNT, full.fixed)


def off_by(found, exact):
    """Largest difference in units of the seventh digit, the last one printed: 0.5 by rounding alone."""
    return np.max(np.abs(found - exact) / 10.0 ** (np.floor(np.log10(exact)) - 6))


def test_deck_has_the_nodes_and_the_clamp_of_the_full_model():
    sector, material = sector_of(120.0)
    full = assemble(sector, material)
    mesh = calculix.quadratic_mesh(sector)
    assert len(mesh.points) == len(full.positions)
    assert len(np.unique(mesh.elements)) == len(mesh.points)
    # Both sets of positions in one order: the numberings have nothing in common.
    for ours, theirs in (
        (full.positions, mesh.points),
        (full.positions[full.fixed[::3] // 3], mesh.points[mesh.clamped]),
    ):
        ours, theirs = (np.unique(np.round(points, 10), axis=0) for points in (ours, theirs))
        np.testing.assert_allclose(ours, theirs, atol=2e-10)
    fields = [
        field.strip() for line in calculix.deck(mesh, material, COUNT).splitlines() for field in line.split(",")
    ]
    assert max(map(len, (field for field in fields if "=" not in field))) <= calculix.FIELD_WIDTH


def test_frequencies_are_read_from_the_first_table():
    text = """
     E I G E N V A L U E   O U T P U T

 MODE NO    EIGENVALUE                       FREQUENCY
                                     REAL PART            IMAGINARY PART
                           (RAD/TIME)      (CYCLES/TIME     (RAD/TIME)

      1   0.8200005E+07   0.2863565E+04   0.4557505E+03   0.0000000E+00
      2   0.1191166E+09   0.1091405E+05   0.1737026E+04   0.0000000E+00

     P A R T I C I P A T I O N   F A C T O R S

MODE NO.   X-COMPONENT     Y-COMPONENT     Z-COMPONENT     X-ROTATION

      3   0.1641065E-03   0.3612379E+00  -0.6512260E-14  -0.1390748E+00
"""
    np.testing.assert_array_equal(calculix.frequencies(text), [455.7505, 1737.026])


@needs_calculix
@pytest.mark.parametrize("angle", BLADES)
def test_ten_frequencies_agree_to_the_printed_digits(angle, tmp_path):
    sector, material, exact = solved(angle)
    found = calculix.run(tmp_path, calculix.deck(calculix.quadratic_mesh(sector), material, COUNT))
    assert len(found) == COUNT
    assert off_by(found, exact) < 0.75


@needs_calculix
@pytest.mark.parametrize("fault", ["density", "clamp"])
def test_the_comparison_sees_a_small_fault(fault, tmp_path):
    sector, material, exact = solved(120.0)
    mesh = calculix.quadratic_mesh(sector)
    if fault == "density":
        material = replace(material, density=material.density * (1 + 1e-5))
    else:
        # One mid-edge node of the root is let go.
        mesh = replace(mesh, clamped=mesh.clamped[:-1])
    assert off_by(calculix.run(tmp_path, calculix.deck(mesh, material, COUNT)), exact) > 5.0
