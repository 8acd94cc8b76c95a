"""What a scene uses its reduced model for: by this the modes it needs are chosen and its errors are measured."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pipeline.contact_values import stiffness_by_node, used_contact
from pipeline.scene import Scene

if TYPE_CHECKING:
    from geometry import SectorMesh
    from rom import LinearOperation


def linear_operation(scene: Scene, sector: SectorMesh) -> LinearOperation:
    """Frequency range, travelling wave, damping and contact springs of a scene on the mesh of its blade."""
    import numpy as np

    from rom import LinearOperation

    n_contacts = len(sector.right.nodes)
    values = used_contact(scene, float(sector.right.area.sum()))
    response = scene.response
    return LinearOperation(
        frequency=response.frequency,
        phase=2.0 * np.pi * (scene.excitation.engine_order % sector.n_blades) / sector.n_blades,
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
