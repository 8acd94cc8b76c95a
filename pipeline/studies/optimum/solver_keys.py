"""Keys of a scene as parameters of the solver: the names of both, and the factors between their values."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pipeline.scene.schema import Scene

NAMES = {  # key of a scene -> parameter of `nonlinear.find_optimum`
    "contact.interference": "interference",
    "contact.friction": "friction",
    "contact.normal_stiffness": "normal_stiffness",
    "contact.tangential_stiffness": "tangential_stiffness",
    "contact.preload": "preload",
    "excitation.force": "force",
    "response.damping_ratio": "damping",
}


def scale(key: str, scene: Scene, n_contacts: int) -> float:
    """Value of a key of the scene divided by that of the solver's parameter.

    A stiffness of the scene is that of the whole face, of the solver the mean of the nodes. The damping of the solver
    is a factor on that of the scene.
    """
    if key in ("contact.normal_stiffness", "contact.tangential_stiffness"):
        return float(n_contacts)
    if key == "response.damping_ratio":
        ratio = scene.response.damping_ratio
        return ratio if isinstance(ratio, float) else 1.0
    return 1.0
