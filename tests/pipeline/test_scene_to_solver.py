"""Sections of a scene as objects of the solver, and back from the attributes of a curve file."""

from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from pipeline_support import ground_model, small_scene, write_scene

from nonlinear import ContactError, punch_stiffness
from pipeline.scene.reading import read_scene
from pipeline.scene.schema import Contact, Load, Response, Scene
from pipeline.stages.curve.curve_file import section_from_attributes, used_parameters
from pipeline.stages.scene_to_solver import InterfaceContact, contact_on_model, contact_parameters, resolved_contacts

AREA = 2.4e-5  # m^2


def scene(folder: Path, **changes: Any) -> Scene:
    return read_scene(write_scene(folder / "s.toml", small_scene(**changes))).first


def face(contact: Contact, nodes: int) -> InterfaceContact:
    return InterfaceContact("shroud", contact, nodes)


def resolved(scene: Scene, area: np.ndarray | None = None) -> InterfaceContact:
    """The contact of a face of one node."""
    (found,) = resolved_contacts(scene, {"shroud": 1}, area)
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
