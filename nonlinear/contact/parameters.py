"""Contact parameters and the interface of a contact element: Fourier coefficients in, forces and Jacobian out."""

from dataclasses import dataclass, replace
from typing import Literal, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
Law = Literal["two_sliders", "cone"]
STICK, SLIP, LIFT_OFF = 0, 1, 2


class ContactError(ValueError):
    """A contact parameter out of its range; the message names it, its value and what is allowed."""


@dataclass(frozen=True)
class ContactParameters:
    """Node by node parameters of the contact element, each (n_c,).

    Attributes
    ----------
    normal_stiffness, tangential_stiffness : kn, kt of each node, N/m, 0 or more.
    friction : mu, 0 or more.
    interference : v0, metres; positive: pressed together, negative: a gap.
    preload : N0, N; a normal load that is already in equilibrium.
    law : "two_sliders", one slider along t1 and one along t2, or "cone", one slider in the plane with the
        circular friction cone.
    """

    normal_stiffness: Array
    tangential_stiffness: Array
    friction: Array
    interference: Array
    preload: Array
    law: Law = "two_sliders"

    def __post_init__(self) -> None:
        """Check lengths, finiteness and signs."""
        length = np.asarray(self.normal_stiffness).shape
        for name in ("normal_stiffness", "tangential_stiffness", "friction", "interference", "preload"):
            values = np.asarray(getattr(self, name), dtype=float)
            if values.ndim != 1 or values.shape != length:
                raise ContactError(f"{name}: shape {values.shape}, allowed: one number a node, {length}")
            if not np.all(np.isfinite(values)):
                raise ContactError(f"{name}: {values.tolist()}, allowed: finite numbers")
            if name != "interference" and np.any(values < 0.0):
                raise ContactError(f"{name}: {float(values.min())!r}, allowed: 0 or more")
        if self.law not in ("two_sliders", "cone"):
            raise ContactError(f'law: {self.law!r}, allowed: "two_sliders" or "cone"')

    @classmethod
    def shared(
        cls,
        n_contacts: int,
        *,
        normal_stiffness: ArrayLike,
        tangential_stiffness: ArrayLike,
        friction: ArrayLike,
        interference: ArrayLike = 0.0,
        preload: ArrayLike = 0.0,
        law: Law = "two_sliders",
    ) -> "ContactParameters":
        """Build from whole-face stiffnesses for `n_contacts` nodes.

        A number is shared evenly by the nodes (stiffnesses, N/m) or holds for each (the rest); a list is node by
        node. Raises ContactError for values out of range and lists of another length.
        """

        def per_node(value: ArrayLike, share: bool) -> Array:
            array = np.asarray(value, dtype=float)
            if array.ndim == 0:
                return np.full(n_contacts, float(array) / (n_contacts if share else 1))
            return array.copy()

        return cls(
            normal_stiffness=per_node(normal_stiffness, True),
            tangential_stiffness=per_node(tangential_stiffness, True),
            friction=per_node(friction, False),
            interference=per_node(interference, False),
            preload=per_node(preload, False),
            law=law,
        )

    @property
    def n_contacts(self) -> int:
        """Number of contact nodes."""
        return self.normal_stiffness.shape[0]

    @property
    def odd(self) -> bool:
        """Whether no normal load varies (kn = 0), so that the vibration half a turn later has the opposite forces.

        Then there are no even harmonics: friction under a constant load has one steady response only.
        """
        return not np.any(self.normal_stiffness)

    def with_interference(self, interference: ArrayLike) -> "ContactParameters":
        """The same contact with another interference (a number or one a node)."""
        return replace(self, interference=np.broadcast_to(np.asarray(interference, float), (self.n_contacts,)).copy())


@dataclass(frozen=True)
class ContactForces:
    """What an element returns for real Fourier coefficients (see `ContactElement`).

    Attributes
    ----------
    force : (2H+1, n_c, 3), f_R = -(T1, T2, N - N0).
    jacobian : (n_c, 3, 3, 2H+1, 2H+1); [k, a, b, i, j] = d force[i, k, a] / d displacement[j, k, b]; empty where it
        is not kept.
    state : (n_c,) worst state of each node in the cycle: STICK, SLIP or LIFT_OFF.
    """

    force: Array
    jacobian: Array
    state: NDArray[np.int64]

    def without_jacobian(self) -> "ContactForces":
        """The same forces; a curve of thousands of points has no room for the Jacobian of each."""
        return replace(self, jacobian=np.empty((0,) * self.jacobian.ndim))


class ContactElement(Protocol):
    """Anything that turns a periodic relative displacement into the periodic contact force.

    Real Fourier coefficients: rows 0, 1, 2, 3, ... of an array hold harmonic 0, Re h=1, Im h=1, Re h=2, ..., so
    that d(theta) = d_0 + sum_h Re_h cos(h theta) - Im_h sin(h theta): the real and imaginary parts of d^(h).
    """

    def evaluate(self, displacement: Array) -> ContactForces:
        """Forces and Jacobian for `displacement` (2H+1, n_c, 3) in the contact frame, metres."""
        ...


def punch_stiffness(young_modulus: float, poisson_ratio: float, area: float) -> tuple[float, float]:
    """Whole-face (kn, kt) in N/m of a rigid flat circular punch of the face's area on the elastic shroud.

    young_modulus E in Pa and poisson_ratio nu of both bodies; area in m^2.

    kn = 2 a E*, E* = E / (2 (1 - nu^2)) for two equal bodies, a = sqrt(area / pi); kt / kn = 2 (1 - nu) / (2 - nu).
    A stand-in: it knows neither the shape of the face nor its roughness.
    """
    radius = np.sqrt(area / np.pi)
    normal = 2.0 * radius * young_modulus / (2.0 * (1.0 - poisson_ratio**2))
    return float(normal), float(normal * 2.0 * (1.0 - poisson_ratio) / (2.0 - poisson_ratio))
