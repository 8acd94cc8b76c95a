"""Sections of a scene as objects of the solver, and back from the attributes of a curve file."""

from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from pipeline_support import ground_model, shroud, small_scene, write_scene

from nonlinear import ContactError
from nonlinear.contact.parameters import punch_stiffness
from pipeline.scene.contact_section import Contact
from pipeline.scene.loads_section import Load
from pipeline.scene.reading import read_scene
from pipeline.scene.response_section import Response
from pipeline.scene.schema import Scene
from pipeline.scene.sweep import as_in_scene, key_value
from pipeline.stages.curve.curve_file import section_from_attributes, used_parameters
from pipeline.stages.scene_to_solver import InterfaceContact, contact_on_model, contact_parameters, resolved_contacts
from rom.reduction.contact_dofs import ContactNodes

AREA = 2.4e-5  # m^2


def scene(folder: Path, **changes: Any) -> Scene:
    return read_scene(write_scene(folder / "s.toml", small_scene(**changes))).first


def face(contact: Contact, nodes: int) -> InterfaceContact:
    return InterfaceContact("shroud", contact, nodes)


def resolved(scene: Scene, area: np.ndarray | None = None) -> InterfaceContact:
    """The contact of a face of one node."""
    (found,) = resolved_contacts(scene, ContactNodes({"shroud": 1}, np.zeros((1, 3)), area))
    return found


def test_a_number_is_the_stiffness_of_the_face_and_the_friction_of_each_node(tmp_path: Path) -> None:
    contact = contact_parameters([face(scene(tmp_path, contact__law="cone").contact, 4)])
    np.testing.assert_array_equal(contact.normal_stiffness, np.full(4, 2e5 / 4))
    np.testing.assert_array_equal(contact.tangential_stiffness, np.full(4, 1.5e5 / 4))
    np.testing.assert_array_equal(contact.friction, np.full(4, 0.4))
    np.testing.assert_array_equal(contact.interference, np.full(4, 1e-5))
    np.testing.assert_array_equal(contact.preload, np.zeros(4))
    assert contact.law == "cone"


def test_what_is_of_the_face_is_shared_by_the_areas_of_its_nodes(tmp_path: Path) -> None:
    area = np.array([25.0, 40.0, 25.0, 10.0]) * 1e-6
    values = scene(tmp_path, contact__preload=2.0, contact__friction=[0.1, 0.2, 0.3, 0.4]).contact
    contact = contact_parameters([face(values, 4)], area)
    np.testing.assert_allclose(contact.normal_stiffness, 2e5 * area / 1e-4, rtol=1e-12)
    np.testing.assert_allclose(contact.tangential_stiffness, 1.5e5 * area / 1e-4, rtol=1e-12)
    np.testing.assert_allclose(contact.preload / area, 8.0 / 1e-4, rtol=1e-12)  # the same pressure, 2 N on average
    np.testing.assert_array_equal(contact.interference, np.full(4, 1e-5))
    np.testing.assert_array_equal(contact.friction, [0.1, 0.2, 0.3, 0.4])
    for wrong in ([1.0, 1.0, 1.0], [1.0, 1.0, 1.0, 0.0]):
        with pytest.raises(ContactError, match=r"^area: "):
            contact_parameters([face(values, 4)], np.array(wrong))


def test_lists_are_node_by_node(tmp_path: Path) -> None:
    values = scene(tmp_path, contact__normal_stiffness=[1.0, 2.0], contact__interference=[-1e-6, 1e-6]).contact
    contact = contact_parameters([face(values, 2)])
    np.testing.assert_array_equal(contact.normal_stiffness, [1.0, 2.0])
    np.testing.assert_array_equal(contact.interference, [-1e-6, 1e-6])


def test_punch_is_computed_for_the_stiffness_that_asks_for_it(tmp_path: Path) -> None:
    blade = scene(tmp_path, contact__normal_stiffness="punch")
    normal, _ = punch_stiffness(210e9, 0.3, AREA)
    assert blade.contact.uses_punch
    contact = resolved(blade, np.array([AREA])).contact
    assert (contact.normal_stiffness, contact.tangential_stiffness) == (normal, 1.5e5)
    assert not contact.uses_punch
    model = ground_model(contact_area=np.full(3, AREA / 3.0))
    np.testing.assert_allclose(contact_on_model(blade, model).normal_stiffness, normal / 3.0, rtol=1e-12)


GAUSS = np.array([np.tile([-1.0, 0.0, 1.0], 2) * np.sqrt(0.6), np.repeat([-1.0, 1.0], 3) / np.sqrt(3.0)])
FACE = ContactNodes(  # a mortar of 3 x 2 points on a rectangle of 12 mm x 5 mm
    {"shroud": 6},
    np.column_stack([*(GAUSS.T * [6e-3, 2.5e-3]).T, np.full(6, 0.4)]),
    np.tile([5.0, 8.0, 5.0], 2) / 36.0 * 6e-5,
    np.tile([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], (6, 1, 1)),
)


def test_a_field_over_the_face_is_its_polynomial_at_the_nodes(tmp_path: Path) -> None:
    """Of stiffness and preload each node has its share of the face, as of a number."""
    field = {"mean": 2e5, "tilt": [3e4, -2e4], "crown": [1e4, 5e4]}
    gap = {"mean": -1e-6, "tilt": [0.0, 4e-6]}
    given = scene(tmp_path, contact__normal_stiffness=field, contact__preload=field, contact__interference=gap)
    (found,) = resolved_contacts(given, FACE)
    x, y = GAUSS
    shape = 2e5 + 3e4 * x - 2e4 * y + 1e4 * (1.0 / 3.0 - x**2) + 5e4 * (1.0 / 3.0 - y**2)
    contact = contact_parameters([found], FACE.area)
    np.testing.assert_allclose(contact.normal_stiffness, shape * FACE.shares, rtol=1e-12)
    np.testing.assert_allclose(contact.preload, 6.0 * shape * FACE.shares, rtol=1e-12)
    np.testing.assert_allclose(contact.interference, -1e-6 + 4e-6 * y, rtol=1e-12)
    assert contact.normal_stiffness.sum() == pytest.approx(2e5, rel=1e-12)
    listed = scene(tmp_path, contact__interference=list(found.contact.interference))
    np.testing.assert_array_equal(
        contact_parameters(resolved_contacts(listed, FACE)).interference, contact.interference
    )


def test_a_wedge_shaped_gap_is_a_rigid_tilt_of_the_face(tmp_path: Path) -> None:
    """N = kn v0 and M = kn (L / 2) theta / 3 of an interference v0 + theta x over a face of the length L."""
    given = scene(tmp_path, contact__interference={"mean": 1e-5, "tilt": [4e-6, 0.0]})
    contact = contact_parameters(resolved_contacts(given, FACE), FACE.area)
    load = contact.initial_load
    arm = FACE.position[:, 0]
    assert load.sum() == pytest.approx(2e5 * 1e-5, rel=1e-12)
    assert load @ arm == pytest.approx(2e5 * 6e-3 * 4e-6 / 3.0, rel=1e-12)
    closed = contact.with_interference(np.full(6, 1e-5))
    np.testing.assert_allclose(closed.normal_load(4e-6 / 6e-3 * arm), load, rtol=1e-12)


def test_a_field_keeps_its_shape_where_a_study_changes_it(tmp_path: Path) -> None:
    given = scene(
        tmp_path,
        contact__interference={"mean": 1e-5, "tilt": [4e-6, 0.0]},
        contact__friction={"mean": 0.4, "crown": [0.1, 0.0]},
    )
    assert key_value(given, "contact.friction") == 0.4
    moved, scaled = (
        as_in_scene(given, f"contact.{key}", x) for key, x in (("interference", 3e-5), ("friction", 0.2))
    )
    assert (moved["mean"], moved["tilt"]) == (3e-5, [4e-6, 0.0])
    assert (scaled["mean"], scaled["crown"]) == (0.2, [0.05, 0.0])


@pytest.mark.parametrize(
    ("value", "words"),
    [
        ({"mean": 0.1, "tilt": [0.2, 0.0]}, ": a field that falls to -0.1, allowed: a field that is nowhere below 0"),
        ({"tilt": [0.2, 0.0]}, ".mean: missing, allowed: a number, -1e15 to 1e15"),
        ({"mean": 1.0, "tilts": [0.0, 1.0]}, ".tilts: unknown key, did you mean tilt?, allowed: mean, tilt, crown"),
        ({"mean": 1.0, "tilt": [0.0]}, ".tilt: [0.0], allowed: two numbers, along t1 and t2, -1e15 to 1e15"),
    ],
)
def test_what_is_wrong_with_a_field_is_one_line(tmp_path: Path, value: Any, words: str) -> None:
    for section, tables in {
        "contact.friction": {"contact__friction": value},
        "interface.shroud.friction": {"interface": {"shroud": {"friction": value}}},
    }.items():
        status, _, error = shroud("validate", write_scene(tmp_path / "s.toml", small_scene(**tables)))
        assert (status, error.count("\n")) == (2, 1)
        assert f": {section}{words}\n" in error


def test_numbers_need_no_area(tmp_path: Path) -> None:
    plain = scene(tmp_path)
    assert resolved(plain).contact is plain.contact


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"contact__friction": [0.1, 0.2, 0.3, 0.4], "response__damping_ratio": [0.01, 0.02]},
        {"response__damping_ratio": None, "response__rayleigh": [1.0, 1e-6], "response__harmonics": "auto"},
    ],
)
def test_a_curve_file_gives_its_sections_back(tmp_path: Path, changes: dict[str, Any]) -> None:
    solved = scene(tmp_path, load__speed_rpm=3000.0, contact__tangential_stiffness="punch", **changes)
    found = resolved(solved, np.array([AREA]))
    with h5py.File(tmp_path / "curve.h5", "w") as file:
        for key, value in used_parameters(solved, [found], {}).items():
            file.attrs[key] = value
        assert section_from_attributes(Contact, file.attrs) == found.contact
        assert section_from_attributes(Response, file.attrs) == solved.response
        assert section_from_attributes(Load, file.attrs) == solved.load
