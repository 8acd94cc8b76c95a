"""Blades of ordinary proportions are not refused, and whatever is refused fits with each value that is named."""

import re
from dataclasses import replace

import numpy as np
import pytest
from random_blades import random_blade

from geometry import BladeParameters, GeometryError, MeshParameters, ShroudParameters, build_sector
from geometry.blade.checks import check_parameters
from geometry.quality import hexahedron_scaled_jacobian

LEAST_QUALITY = 0.1
NAMED = re.compile(r"(blade|shroud)\.(\w+) (?:at most |at least )?(-?[\d.]+(?:e[+-]?\d+)?) fits")
NAMED_ANGLE = re.compile(r"the nearest angle that fits is ([\d.]+)")


def quality(blade, shroud, mesh):
    sector = build_sector(blade, shroud, mesh)
    return hexahedron_scaled_jacobian(sector.points, sector.hexahedra).min()


def refusal(blade, shroud, mesh):
    try:
        check_parameters(blade, shroud, mesh)
    except GeometryError as error:
        return error
    return None


def named_values(error):
    """(table, parameter, value) of all values that a refusal names."""
    found = [("shroud", "angle", value) for value in NAMED_ANGLE.findall(error.allowed)]
    found += NAMED.findall(error.allowed)
    return [(table, name, int(value) if name == "n_blades" else float(value)) for table, name, value in found]


# found by trying random blades: a value named for the first gave no mesh, one for the second was named twice
STUBBY = {
    "lens": (
        BladeParameters(136, 0.382042, 0.124865, 0.0355431, 0.0086953, 0.00359406, twist=41.8379, section="lens"),
        ShroudParameters(131.17985, 0.00506526, 0.03827994, 0.0144985),
        MeshParameters(0.00584696, (7, 4)),
    ),
    "thick": (
        BladeParameters(98, 0.928711, 0.48902, 0.225669, 0.119339, 0.114854, twist=54.9365),
        ShroudParameters(63.278987, 0.02728316, 0.35238239, 0.16792706),
        MeshParameters(0.0223336, (3, 4)),
    ),
}


@pytest.mark.parametrize("kind", STUBBY)
def test_each_value_named_for_a_stubby_blade_meshes_and_is_named_once(kind):
    blade, shroud, mesh = STUBBY[kind]
    error = refusal(blade, shroud, mesh)
    values = named_values(error)
    assert values
    assert len({place[:2] for place in values}) == len(values), str(error)
    parts = {"blade": blade, "shroud": shroud}
    for table, parameter, value in values:
        changed = parts | {table: replace(parts[table], **{parameter: value})}
        assert quality(**changed, mesh=mesh) > 0.0, (parameter, value)
        if f"{parameter} at most" in str(error):  # a lower one fits as well
            lower = type(value)(0.9 * value)
            changed = parts | {table: replace(parts[table], **{parameter: lower})}
            assert refusal(**changed, mesh=mesh) is None, (parameter, lower)


def test_a_size_that_gives_no_mesh_is_refused_with_one_that_does():
    blade, shroud, mesh = STUBBY["lens"]
    blade = replace(blade, chord=0.02495)
    with pytest.raises(GeometryError, match=r"gives no valid mesh; mesh\.size = [\d.]+ does") as caught:
        build_sector(blade, shroud, mesh)
    assert "np." not in str(caught.value)
    size = float(re.search(r"mesh\.size = ([\d.]+) does", str(caught.value))[1])
    assert quality(blade, shroud, replace(mesh, size=size)) > 0.0


@pytest.mark.parametrize("seed", range(12))
def test_ordinary_blades_are_not_refused(seed):
    assert quality(*random_blade(seed)) > LEAST_QUALITY


# what a random blade is given so that it does not fit
SPOILT = {
    "axial edges": lambda blade, shroud: (blade, replace(shroud, edge_angle=0.0)),
    "long contact": lambda blade, shroud: (blade, replace(shroud, contact_length=4.0 * shroud.contact_length)),
    "narrow shroud": lambda blade, shroud: (blade, replace(shroud, axial_width=0.7 * shroud.axial_width)),
    "large fillet": lambda blade, shroud: (blade, replace(shroud, fillet_radius=2.0 * blade.thickness)),
    "gap": lambda blade, shroud: (blade, replace(shroud, gap=1.2 * np.pi * blade.hub_radius / blade.n_blades)),
    "thick shroud": lambda blade, shroud: (blade, replace(shroud, thickness=1.1 * blade.length)),
    "twist": lambda blade, shroud: (replace(blade, root_stagger=40.0, twist=50.0), shroud),
    "thick": lambda blade, shroud: (
        replace(blade, thickness=2.5 * blade.thickness, tip_thickness=2.5 * blade.tip_thickness),
        shroud,
    ),
}


@pytest.mark.parametrize("spoil", SPOILT)
def test_each_value_that_a_refusal_names_passes_and_meshes(spoil):
    for seed in range(100, 300):
        blade, shroud, mesh = random_blade(seed)
        parts = dict(zip(("blade", "shroud"), SPOILT[spoil](blade, shroud), strict=True))
        error = refusal(**parts, mesh=mesh)
        if error is not None:
            break
    values = named_values(error)
    assert (error.table, error.parameter) in [place[:2] for place in values], str(error)
    for table, parameter, value in values:
        changed = parts | {table: replace(parts[table], **{parameter: value})}
        assert quality(**changed, mesh=mesh) > LEAST_QUALITY, (parameter, value)


def test_where_no_single_value_helps_a_smaller_section_is_named():
    blade, shroud, mesh = random_blade(3)
    blade = replace(
        blade, chord=20 * blade.chord, thickness=40 * blade.chord / 3, tip_thickness=None, fillet_radius=0.0
    )
    error = refusal(blade, replace(shroud, fillet_radius=0.0), mesh)
    chord, thickness = re.search(r"blade\.chord ([\d.]+) with blade\.thickness ([\d.]+) fits", error.allowed).groups()
    smaller = replace(blade, chord=float(chord), thickness=float(thickness))
    assert quality(smaller, replace(shroud, fillet_radius=0.0), mesh) > LEAST_QUALITY
