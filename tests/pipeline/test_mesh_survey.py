"""What `shroud new --mesh` tells from a mesh without being told."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.root_mesh import root_mesh
from geometry import ElementBlock, ImportedMesh
from geometry.errors import OwnMeshError
from geometry.own_mesh.own_sector import sector_from_mesh
from geometry.own_mesh.ring import fitting_ring
from geometry.own_mesh.sector_choice import SectorChoice
from geometry.units import UNIT_SYSTEMS
from pipeline.new_scene.mesh_survey import guess
from pipeline.scene.mesh_section import Mesh
from pipeline.stages.model.scene_materials import propose_unit

CORNERS = [0, 1, 2, 3, 4, 5, 6, 7]


def brick(n_blades=36, radius=(300.0, 400.0), axis=2, sets=None, materials=None):
    """A sector in one brick, from face to face; nodes 0 to 3 lie at one end of the axis."""
    half = np.pi / n_blades
    angle = np.array([-half, half, half, -half] * 2)
    r = np.array([radius[0], radius[0], radius[1], radius[1]] * 2)
    length = 0.1 * radius[0]
    points = np.column_stack([r * np.cos(angle), r * np.sin(angle), [0.0] * 4 + [length] * 4])
    block = ElementBlock("hex8", np.array([CORNERS]), "steel" if materials else "")
    return ImportedMesh(
        "b.inp", np.roll(points, axis - 2, axis=1), np.arange(8), (block,), (), sets or {}, {}, {}, materials or {}
    )


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("n_blades", [5, 24, 97])
def test_axis_and_number_of_blades_of_unnamed_faces(n_blades, axis):
    ring = fitting_ring(brick(n_blades, axis=axis))
    assert (ring.axis, ring.n_blades, ring.pairs) == ("xyz"[axis], n_blades, 1)
    told = guess(brick(n_blades, axis=axis))
    assert (told.axis, told.n_blades) == ("xyz"[axis], n_blades)
    assert guess(brick(n_blades, axis=axis), n_blades=50).n_blades == 50  # what is given is taken


def test_faces_that_are_no_images_make_no_ring():
    mesh = brick()
    mesh.points[1] += [0.0, 20.0, 0.0]
    assert fitting_ring(mesh) is None
    assert guess(mesh).n_blades is None


@pytest.mark.parametrize(
    ("radius", "modulus", "unit"),
    [
        ((300.0, 400.0), None, "mm"),
        ((0.3, 0.4), None, "m"),
        ((3.0, 6.0), None, "in"),
        ((1.5, 2.5), None, "m"),
        ((3.0, 6.0), 2.1e11, "m"),
        ((3.0, 6.0), 2.1e5, "mm"),
    ],
)
def test_the_unit_is_told_from_the_modulus_or_the_size(radius, modulus, unit):
    materials = {"steel": {"young_modulus": modulus}} if modulus else None
    assert guess(brick(radius=radius, materials=materials)).unit == unit


STEEL = {  # radius, Young's modulus and density as in tables of units: 207 to 210 GPa, 7800 to 7860 kg/m^3
    "m": (0.3, 2.1e11, 7850.0),
    "mm": (300.0, 2.1e5, 7.85e-9),
    "in": (12.0, 3.0e7, 7.33e-4),
    "mm-kg-s": (300.0, 2.1e8, 7.85e-6),
    "mm-kg-ms": (300.0, 210.0, 7.85e-6),
    "mm-g-ms": (300.0, 2.1e5, 7.85e-3),
    "mm-g-s": (300.0, 2.1e11, 7.85e-3),
    "mm-kgf-s": (300.0, 2.14e4, 8.0e-10),
    "cm-g-s": (30.0, 2.1e12, 7.85),
    "m-t-s": (0.3, 2.1e8, 7.85),
    "in-lbf-lbm": (12.0, 3.0e7, 0.284),
    "in-kip-s": (12.0, 3.0e4, 7.33e-7),
    "ft-lbf-s": (1.0, 4.36e9, 15.2),
    "ft-lbf-lbm": (1.0, 4.36e9, 490.0),
}


@pytest.mark.parametrize("unit", UNIT_SYSTEMS)
def test_the_system_of_units_is_told_from_steel_and_size(unit):
    radius, modulus, density = STEEL[unit]
    proposal = propose_unit(radius, {"steel": {"young_modulus": modulus, "density": density}})
    assert (proposal.unit, proposal.consistent) == (unit, True)
    system = UNIT_SYSTEMS[unit]
    assert modulus * system.pressure == pytest.approx(2.1e11, rel=0.02)
    assert density * system.density == pytest.approx(7850.0, rel=0.01)
    assert radius * system.length == pytest.approx(0.3, rel=0.02)
    Mesh(file="b.inp", n_blades=3, unit=unit)  # the scene knows it


@pytest.mark.parametrize(
    ("radius", "numbers", "unit", "meant"),
    [
        (300.0, {"young_modulus": 2.1e5, "density": 7.85e-6}, "mm", {"density": 7850.0}),
        (300.0, {"young_modulus": 2.1e11, "density": 7850.0}, "mm", {"young_modulus": 2.1e11, "density": 7850.0}),
        (0.3, {"young_modulus": 210.0, "density": 7850.0}, "m", {"young_modulus": 2.1e11}),
        (300.0, {"young_modulus": 1.1e5, "density": 4.43}, "mm", {"density": 4430.0}),
    ],
)
def test_numbers_of_no_consistent_system_are_given_in_si_units(radius, numbers, unit, meant):
    proposal = propose_unit(radius, {"blade": numbers})
    assert (proposal.unit, proposal.consistent) == (unit, False)
    assert proposal.numbers["blade"] == pytest.approx(meant)
    assert set(proposal.stated) == {"blade"}


@pytest.mark.parametrize(
    ("root", "right", "left"),
    [
        ("Nfix", "shroud_pressure_side", "shroud_suction_side"),
        ("BLADE-ROOT", "CONTACT_PS", "CONTACT_SS"),
        ("fixed", "shroud right", "shroud left"),
    ],
)
def test_roles_are_told_from_the_words_of_names(root, right, left):
    faces = {root: np.array([0, 1, 4, 5]), right: np.array([0, 3, 4, 7]), left: np.array([1, 2, 5, 6])}
    told = guess(brick(sets=faces))
    assert told.sets == {"root": root, "contact_right": right, "contact_left": left}
    assert (told.axis, told.n_blades) == ("z", 36)


@pytest.mark.parametrize("place", [(0.0, 0.0, 50.0), (-700.0, 300.0, 0.0)])
def test_an_axis_that_is_not_through_the_origin_is_found(place):
    """The sector of a file whose axis, along y, is elsewhere; its contact faces are named."""
    faces = {"contact_right": np.array([1, 2, 5, 6]), "contact_left": np.array([0, 3, 4, 7])}
    mesh = brick(12, axis=1, sets=faces)
    blocks = (ElementBlock("hex8", np.array([[0, 3, 2, 1, 4, 7, 6, 5]])),)  # those of the brick are inside out
    moved = replace(mesh, points=mesh.points + place, blocks=blocks)
    told = guess(moved)
    assert (told.axis, told.n_blades) == ("y", 12)
    np.testing.assert_allclose(np.delete(told.axis_point, 1), np.delete(place, 1), atol=1e-3)
    names = {"root": "root", **{role: told.sets[role] for role in faces}}
    rooted = replace(moved, node_sets={**moved.node_sets, "root": np.array([0, 1, 4, 5])})
    where = {"unit": "mm", "axis": "y", "sets": names, "contact_grid": (1, 1)}
    assert sector_from_mesh(rooted, SectorChoice(12, axis_point=told.axis_point, **where))
    with pytest.raises(OwnMeshError, match=r"mesh\.axis_point"):
        sector_from_mesh(rooted, SectorChoice(12, **where))


def test_contacts_between_bodies_are_found_with_their_kinds():
    told = guess(root_mesh(damper=True))
    assert told.n_blades == 40
    assert {name: (each.kind, each.right, each.left) for name, each in told.interfaces.items()} == {
        "root": ("inside", "DISK_FLANKS", "BLADE_FLANKS"),
        "damper": ("inside", "DAMPER_OWN", "PLATFORM_RIGHT"),
        "damper_next": ("neighbours", "DAMPER_NEXT", "PLATFORM_LEFT"),
    }
    choice = SectorChoice(told.n_blades, told.unit, told.axis, sets=told.sets, interfaces=told.interfaces)
    assert set(sector_from_mesh(root_mesh(damper=True), choice).sector.interfaces) == set(told.interfaces)


def test_what_the_file_holds_and_joins_goes_before_names_and_geometry():
    """The pair of a contact of the file, though the faces are apart; nodes that the file holds."""
    mesh = root_mesh(damper=True)
    sets = {**mesh.node_sets, "held": np.arange(5)}
    mesh = replace(mesh, contacts=(("DAMPER_OWN", "PLATFORM_LEFT"),), root="held", node_sets=sets)
    told = guess(mesh)
    assert told.sets["root"] == "held"
    assert any("in contact in the file" in line for line in told.why)
    assert any(each.right == "DAMPER_OWN" and each.left == "PLATFORM_LEFT" for each in told.interfaces.values())
    assert all(each.right != "DAMPER_OWN" or each.left == "PLATFORM_LEFT" for each in told.interfaces.values())


@pytest.mark.parametrize(
    "soft",
    [{"young_modulus": 1100.0, "density": 9.5e-10}, {"young_modulus": 300.0, "density": 1.2e-9}],
    ids=["polymer", "rubber"],
)
@pytest.mark.parametrize(
    "beside", [{}, {"blade": {"young_modulus": 113e3, "density": 4.43e-9}}], ids=["alone", "coat"]
)
def test_numbers_that_are_possible_stand(soft, beside):
    """mm, t, s: a slow or light material is none that is in other units."""
    proposal = propose_unit(300.0, {**beside, "soft": soft})
    assert (proposal.unit, proposal.numbers, proposal.stated) == ("mm", {}, {})


def test_one_material_in_other_units_does_not_touch_the_others():
    """Aluminium with the density in kg/m^3 beside titanium in mm, t, s."""
    numbers = {"young_modulus": 7e4, "density": 2700.0}
    proposal = propose_unit(300.0, {"blade": {"young_modulus": 113e3, "density": 4.43e-9}, "coat": numbers})
    assert (proposal.unit, proposal.consistent) == ("mm", False)
    assert proposal.numbers == {"coat": {"density": pytest.approx(2700.0)}}
