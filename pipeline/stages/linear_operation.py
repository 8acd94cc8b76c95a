"""What a scene uses its reduced model for: by this the modes it needs are chosen and its errors are measured."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pipeline.scene.schema import Scene
from pipeline.stages.curve_file import face_area
from pipeline.stages.scene_to_solver import stiffness_by_node, used_contact

if TYPE_CHECKING:
    from geometry import SectorMesh
    from rom import LinearOperation, ReducedModel


def linear_operation(scene: Scene, sector: SectorMesh) -> LinearOperation:
    """Frequency range, travelling wave, damping and contact springs of a scene on the mesh of its blade."""
    return _operation(scene, len(sector.right.nodes), sector.n_blades, float(sector.right.area.sum()))


def operation_of_model(scene: Scene, model: ReducedModel) -> LinearOperation:
    """The same on a reduced model of the blade."""
    return _operation(scene, model.n_contacts, model.n_blades, face_area(model))


def _operation(scene: Scene, n_contacts: int, n_blades: int | None, area: float | None) -> LinearOperation:
    from rom import LinearOperation, inter_blade_phase

    values = used_contact(scene, area)
    response = scene.response
    return LinearOperation(
        frequency_hz=response.frequency,
        phase=inter_blade_phase(scene.excitation.engine_order, n_blades),
        normal=stiffness_by_node(values["normal_stiffness"], n_contacts),
        tangential=stiffness_by_node(values["tangential_stiffness"], n_contacts),
        damping_ratio=response.damping_ratio,
        rayleigh=response.rayleigh,
    )


def operation_values(scene: Scene) -> dict[str, Any]:
    """The scene values that the linear operation depends on, for a fingerprint; not the blade's own."""
    return {
        "engine_order": scene.excitation.engine_order,
        "normal": scene.contact.normal_stiffness,
        "tangential": scene.contact.tangential_stiffness,
        "frequency": scene.response.frequency,
        "damping_ratio": scene.response.damping_ratio,
        "rayleigh": scene.response.rayleigh,
    }
