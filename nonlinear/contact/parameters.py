"""Contact parameters with the normal law, and the interface of a contact element."""

from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import Any, Literal, Protocol, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
Law = Literal["two_sliders", "cone"]
STICK, SLIP, LIFT_OFF = 0, 1, 2


class ContactError(ValueError):
    """A contact parameter out of its range; the message names it, its value and what is allowed.

    Examples
    --------
    >>> from nonlinear import ContactError, ContactParameters
    >>> try:
    ...     ContactParameters.shared(2, normal_stiffness=2e5, tangential_stiffness=1.5e5, friction=-0.4)
    ... except ContactError as error:
    ...     print(error)
    friction: -0.4, allowed: 0 or more
    """


@dataclass(frozen=True)
class ContactParameters:
    """Parameters of the contact element, one value per contact node, and its normal law.

    Attributes
    ----------
    normal_stiffness : (n_c,) float
        Penalty stiffness kn along the contact normal, N/m, 0 or more.
    tangential_stiffness : (n_c,) float
        Stiffness kt of the elastic slider, N/m, 0 or more.
    friction : (n_c,) float
        Friction coefficient mu, 0 or more.
    interference : (n_c,) float
        Initial interference v0, m. Positive: pressed together. Negative: a gap.
    preload : (n_c,) float
        Normal load N0 that is already in equilibrium, N.
    law : {"two_sliders", "cone"} or tuple of these
        Two sliders, one along t1 and one along t2, or one slider in the contact plane with the circular
        friction cone: a word for all nodes, or one for each node.
    slider_origin : (n_c, 2) float
        Position w0 along (t1, t2) from which the sliders start, m; 0 by default. Where a node sticks all the time, it
        decides on the residual traction; elsewhere the steady cycle does not depend on it.

    Notes
    -----
    The normal law, N = max(N0 + kn (v0 + d_n), 0) (Gulisano et al. 2011, eq. 8), stands here only: everything
    else calls `initial_load`, `unclipped_load`, `normal_load` or `load_coefficients`.

    Examples
    --------
    Two nodes share a face; the normal load grows with the displacement and never pulls.

    >>> import numpy as np
    >>> from nonlinear import ContactParameters
    >>> contact = ContactParameters.shared(2, normal_stiffness=2e5, tangential_stiffness=1.5e5, friction=0.4)
    >>> contact.normal_load(np.array([1e-5, -1e-5]))  # N
    array([1., 0.])
    """

    normal_stiffness: Array
    tangential_stiffness: Array
    friction: Array
    interference: Array
    preload: Array
    law: Law | tuple[Law, ...] = "two_sliders"
    slider_origin: Array = field(default_factory=lambda: np.zeros((0, 2)))

    def __post_init__(self) -> None:
        """Check lengths, finiteness and signs."""
        length = np.asarray(self.normal_stiffness).shape
        if length == (0,):
            raise ContactError("normal_stiffness: no contact nodes, allowed: one node or more")
        for name in ("normal_stiffness", "tangential_stiffness", "friction", "interference", "preload"):
            values = np.asarray(getattr(self, name), dtype=float)
            if values.ndim != 1 or values.shape != length:
                raise ContactError(f"{name}: shape {values.shape}, allowed: one number a node, {length}")
            if not np.all(np.isfinite(values)):
                raise ContactError(f"{name}: {values.tolist()}, allowed: finite numbers")
            if name != "interference" and np.any(values < 0.0):
                raise ContactError(f"{name}: {float(values.min())!r}, allowed: 0 or more")
        self._check_law(length[0])
        origin = np.asarray(self.slider_origin, dtype=float)
        if origin.shape == (0, 2):
            object.__setattr__(self, "slider_origin", np.zeros((*length, 2)))
        elif origin.shape != (*length, 2):
            raise ContactError(f"slider_origin: shape {origin.shape}, allowed: two numbers a node, {(*length, 2)}")
        elif not np.all(np.isfinite(origin)):
            raise ContactError(f"slider_origin: {origin.tolist()}, allowed: finite numbers")

    def _check_law(self, n_contacts: int) -> None:
        """Check words and number of the laws; one word for all is kept as one word."""
        laws, known = (self.law,) if isinstance(self.law, str) else tuple(self.law), get_args(Law)
        for law in laws:
            if law not in known:
                raise ContactError(f"law: {law!r}, allowed: " + " or ".join(f'"{word}"' for word in known))
        if not isinstance(self.law, str):
            if len(laws) != n_contacts:
                raise ContactError(
                    f"law: {len(laws)} words, allowed: one word, or one for each of {n_contacts} nodes"
                )
            object.__setattr__(self, "law", laws[0] if len(set(laws)) == 1 else laws)

    @classmethod
    def joined(cls, *parts: "ContactParameters") -> "ContactParameters":
        """The parameters of several interfaces, one after the other (see `rom.with_interfaces`).

        Parameters
        ----------
        *parts : ContactParameters
            Those of each interface.

        Returns
        -------
        ContactParameters
            Parameters of all nodes.
        """
        arrays = {name: np.concatenate([getattr(part, name) for part in parts]) for name in cls._per_node()}
        return cls(law=tuple(law for part in parts for law in part.laws), **arrays)

    def at(self, nodes: NDArray[Any]) -> "ContactParameters":
        """The parameters of some nodes.

        Parameters
        ----------
        nodes : (n,) int or (n_c,) bool
            Which nodes.

        Returns
        -------
        ContactParameters
            Their parameters.
        """
        laws = tuple(np.array(self.laws)[nodes].tolist())
        return replace(self, law=laws, **{name: getattr(self, name)[nodes] for name in self._per_node()})

    @classmethod
    def _per_node(cls) -> list[str]:
        """The names of the arrays."""
        return [item.name for item in fields(cls) if item.name != "law"]

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
        area: ArrayLike | None = None,
    ) -> "ContactParameters":
        """Build from the stiffnesses of the whole contact face.

        Parameters
        ----------
        n_contacts : int
            Number of contact nodes.
        normal_stiffness, tangential_stiffness : float or (n_c,) float
            kn and kt, N/m. A number is the stiffness of the whole face, shared by the nodes as their areas.
        friction, interference, preload : float or (n_c,) float
            mu, v0 (m) and N0 (N). A number holds for each node, a preload for a node of mean area: the pressure is
            the same on all.
        law : {"two_sliders", "cone"}
            Friction law.
        area : (n_c,) float, optional
            Areas of the nodes, m^2; None: all the same.

        Returns
        -------
        ContactParameters
            Parameters node by node.

        Raises
        ------
        ContactError
            For values out of range and lists of another length.
        """

        even = np.ones(n_contacts)
        areas = even if area is None else np.asarray(area, dtype=float)
        if areas.shape != even.shape or not np.all(np.isfinite(areas)) or np.any(areas <= 0.0):
            raise ContactError(f"area: {areas.tolist()}, allowed: {n_contacts} numbers above 0")

        def per_node(value: ArrayLike, factors: Array, whole: float = 1.0) -> Array:
            array = np.asarray(value, dtype=float)
            return array.copy() if array.ndim else float(array) * factors / whole

        return cls(
            normal_stiffness=per_node(normal_stiffness, areas, areas.sum()),
            tangential_stiffness=per_node(tangential_stiffness, areas, areas.sum()),
            friction=per_node(friction, even),
            interference=per_node(interference, even),
            preload=per_node(preload, areas * n_contacts, areas.sum()),
            law=law,
        )

    @property
    def n_contacts(self) -> int:
        """Number of contact nodes."""
        return self.normal_stiffness.shape[0]

    @property
    def laws(self) -> tuple[Law, ...]:
        """The friction law of each node."""
        return (self.law,) * self.n_contacts if isinstance(self.law, str) else self.law

    @cached_property
    def cone(self) -> NDArray[np.bool_]:
        """Nodes under the friction cone, (n_c,)."""
        return np.array([law == "cone" for law in self.laws])

    @cached_property
    def initial_load(self) -> Array:
        """Normal load without relative displacement, N0 + kn v0, (n_c,), N; negative where there is a gap."""
        return self.preload + self.normal_stiffness * self.interference

    def unclipped_load(self, normal_displacement: Array) -> Array:
        """Load of the normal spring, N0 + kn (v0 + d_n); negative where the contact is open.

        Parameters
        ----------
        normal_displacement : (..., n_c) float
            Relative displacement d_n along the contact normal, m.

        Returns
        -------
        (..., n_c) float
            Load, N.
        """
        return self.initial_load + self.normal_stiffness * normal_displacement

    def normal_load(self, normal_displacement: Array) -> Array:
        """Normal load N = max(N0 + kn (v0 + d_n), 0) (Gulisano et al. 2011, eq. 8).

        Parameters
        ----------
        normal_displacement : (..., n_c) float
            Relative displacement d_n along the contact normal, m.

        Returns
        -------
        (..., n_c) float
            Normal load, N, 0 or more.
        """
        return np.maximum(self.unclipped_load(normal_displacement), 0.0)

    def load_coefficients(self, displacement: Array) -> Array:
        """Real Fourier coefficients of the unclipped load: kn d_n, and N0 + kn v0 added to harmonic 0.

        Parameters
        ----------
        displacement : (2H+1, n_c, 3) float
            Real Fourier coefficients of the relative displacement, m.

        Returns
        -------
        (2H+1, n_c) float
            Coefficients, N.
        """
        load = self.normal_stiffness * displacement[:, :, 2]
        load[0] += self.initial_load
        return load

    def from_slider_origin(self, displacement: Array) -> Array:
        """The displacement measured from where the sliders start: u - w0, with w0 in harmonic 0.

        A slider that starts at w0 under the motion u is at w0 plus the position of one that starts at 0 under u - w0.

        Parameters
        ----------
        displacement : (2H+1, n_c, 3) float
            Real Fourier coefficients of the relative displacement, m.

        Returns
        -------
        (2H+1, n_c, 3) float
            The same with u1 and u2 shifted in harmonic 0, m.
        """
        if not self._has_slider_origin:
            return displacement
        shifted = displacement.copy()
        shifted[0, :, :2] -= self.slider_origin
        return shifted

    @cached_property
    def can_stick(self) -> NDArray[np.bool_]:
        """Nodes that friction can hold where they are pressed together, (n_c,)."""
        return np.asarray((self.tangential_stiffness > 0.0) & (self.friction > 0.0))

    @cached_property
    def _has_slider_origin(self) -> bool:
        return bool(self.slider_origin.any())

    @property
    def odd(self) -> bool:
        """Whether no normal load varies (kn = 0): half a period later the contact forces are opposite.

        Then there are no even harmonics: friction under a constant load has one steady response only.
        """
        return not np.any(self.normal_stiffness)

    def with_interference(self, interference: ArrayLike) -> "ContactParameters":
        """Return the same contact with another interference.

        Parameters
        ----------
        interference : float or (n_c,) float
            v0, m; a number holds for each node.

        Returns
        -------
        ContactParameters
            The new parameters.
        """
        return replace(self, interference=np.broadcast_to(np.asarray(interference, float), (self.n_contacts,)).copy())


@dataclass(frozen=True)
class ContactForces:
    """Contact forces of a periodic motion and their Jacobian, as real Fourier coefficients (see `ContactElement`)."""

    force: Array  # (2H+1, n_c, 3) force on the right node, f_R = -(T1, T2, N - N0), N
    # (n_c, 3, 3, 2H+1, 2H+1) [k, a, b, i, j] = d force[i, k, a] / d displacement[j, k, b], N/m; empty where it is not
    # kept
    jacobian: Array
    state: NDArray[np.int64]  # (n_c,) worst state of each node in the period: STICK, SLIP or LIFT_OFF

    def without_jacobian(self) -> "ContactForces":
        """The same forces; a curve of thousands of points has no room for the Jacobian of each."""
        return ContactForces(self.force, np.empty((0,) * self.jacobian.ndim), self.state)


class ContactElement(Protocol):
    """Interface of a contact element: periodic relative displacement in, periodic contact force out.

    Both are real Fourier coefficients. Rows 0, 1, 2, 3, ... hold harmonic 0, Re h=1, Im h=1, Re h=2, ..., so that
    d(theta) = d_0 + sum_h Re_h cos(h theta) - Im_h sin(h theta): real and imaginary parts of d^(h).
    """

    def evaluate(self, displacement: Array) -> ContactForces:
        """Evaluate contact forces and Jacobian.

        `displacement` (2H+1, n_c, 3): relative displacement in the contact frame (t1, t2, n), m.
        """
        ...


def punch_stiffness(young_modulus: float, poisson_ratio: float, area: float) -> tuple[float, float]:
    """Contact stiffnesses of the whole face: a rigid flat circular punch of the area of the face.

    kn = 2 a E*, E* = E / (2 (1 - nu^2)) for two equal bodies, a = sqrt(area / pi);
    kt / kn = 2 (1 - nu) / (2 - nu) (Johnson 1985). The shape of the face and its roughness are left out.

    `young_modulus`: E of both bodies, Pa; `area`: contact area, m^2. Returns `kn, kt`: normal and tangential
    stiffness of the face, N/m.

    References
    ----------
    K. L. Johnson, Contact Mechanics, Cambridge University Press, 1985.
    """
    radius = np.sqrt(area / np.pi)
    normal = 2.0 * radius * young_modulus / (2.0 * (1.0 - poisson_ratio**2))
    return float(normal), float(normal * 2.0 * (1.0 - poisson_ratio) / (2.0 - poisson_ratio))
