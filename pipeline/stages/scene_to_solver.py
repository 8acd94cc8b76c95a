"""The contact parameters of a scene as numbers: stiffness of the face shared by the nodes, "punch" computed."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pipeline.scene.schema import Scene

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from nonlinear import ContactParameters


def used_contact(scene: Scene, face_area: float | None) -> dict[str, Any]:
    """The section [contact] with numbers only: "punch" replaced by the stiffness of the whole face, N/m.

    `face_area` (m^2) is needed for "punch" alone.
    """
    values = scene.contact.model_dump()
    if "punch" in (values["normal_stiffness"], values["tangential_stiffness"]):
        from nonlinear import punch_stiffness

        assert scene.material is not None  # the checks see to both
        assert face_area is not None
        normal, tangential = punch_stiffness(scene.material.young_modulus, scene.material.poisson_ratio, face_area)
        for name, computed in (("normal_stiffness", normal), ("tangential_stiffness", tangential)):
            if values[name] == "punch":
                values[name] = float(computed)
    return values


def stiffness_by_node(value: float | tuple[float, ...], n_contacts: int) -> NDArray[np.float64]:
    """Contact stiffness of each node, N/m: a number is the whole face, shared evenly; a list is node by node."""
    import numpy as np

    if isinstance(value, tuple | list):
        return np.asarray(value, dtype=float)
    return np.full(n_contacts, float(value) / n_contacts)


def by_node(value: float | tuple[float, ...], n_contacts: int) -> NDArray[np.float64]:
    """A quantity of each node: a number holds for all of them, a list is node by node."""
    import numpy as np

    return np.broadcast_to(np.asarray(value, dtype=float), (n_contacts,)).copy()


def contact_parameters(values: dict[str, Any], n_contacts: int) -> ContactParameters:
    """Node by node, as the nonlinear package takes them, from the result of `used_contact`."""
    from nonlinear import ContactParameters

    return ContactParameters(
        normal_stiffness=stiffness_by_node(values["normal_stiffness"], n_contacts),
        tangential_stiffness=stiffness_by_node(values["tangential_stiffness"], n_contacts),
        friction=by_node(values["friction"], n_contacts),
        interference=by_node(values["interference"], n_contacts),
        preload=by_node(values["preload"], n_contacts),
        law=values["law"],
    )
