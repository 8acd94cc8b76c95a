"""An optimum as figure and report show it: in the unit of its scene key, beside the scene's own value."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from nonlinear import Optimum

KEYS = {
    "interference": "contact.interference",
    "preload": "contact.preload",
    "friction": "contact.friction",
    "normal_stiffness": "contact.normal_stiffness",
    "tangential_stiffness": "contact.tangential_stiffness",
    "force": "excitation.force",
    "damping": "response.damping_ratio",
}


@dataclass(frozen=True)
class ShownOptimum:
    """An optimum over one parameter with the value that the scene has.

    Attributes
    ----------
    found : Optimum
        The optimum.
    own_value : float
        The parameter of the scene, in the unit of `found.value`; NaN where it has no single one.
    per_unit : float
        Value of the scene key for each unit of `found.value`: the damping is found as a factor on that of the scene.
    """

    found: Optimum
    own_value: float
    per_unit: float = 1.0

    @property
    def key(self) -> str:
        """Dotted key of the parameter in the scene."""
        return KEYS[self.found.name]

    @property
    def own_amplitude_m(self) -> float:
        """Worst motion at the scene's own value, m; NaN where it is not known."""
        return float(self.found.envelope.at(np.array([self.own_value]))[0])
