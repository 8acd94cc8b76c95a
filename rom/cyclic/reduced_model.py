"""The reduced model of one blade: result of the reduction, input of the forced response; its motion on the mesh."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rom.cyclic.cyclic_symmetry import wave_coordinates
from rom.errors import ReducedModelError

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
SYMMETRY_TOLERANCE = 1e-8
FRAME_TOLERANCE = 1e-6
MOST_BLADES = 10_000
HIGHEST_HARMONIC = 31  # of the excitation
MAIN_INTERFACE = "shroud"  # name of the interface of a model that names none
LARGEST_NUMBER = 1e100  # squares and products of larger numbers overflow


@dataclass(frozen=True)
class WaveBlock:
    """Coordinates of a reduced model that one nodal diameter has for itself, see `model_of_waves`."""

    first: int  # the first of them
    size: int  # number m of complex coordinates z of the wave, q = T z
    # whether z is real: waves of 0 and N_b / 2 nodal diameters. Else Re and Im have a real coordinate each
    real: bool

    @property
    def length(self) -> int:
        """Number of real coordinates."""
        return self.size if self.real else 2 * self.size

    @property
    def coordinates(self) -> NDArray[Any]:
        """T (length, m)."""
        one = np.eye(self.size)
        return one if self.real else np.sqrt(0.5) * np.concatenate([one, -1j * one])


@dataclass(frozen=True)
class ReducedModel:
    """Mass, stiffness, contact, force and output vectors in n reduced coordinates q, SI units.

    Attributes
    ----------
    mass, stiffness : (n, n) array
        Symmetric matrices.
    contact_right : (3 n_c, n) array
        Displacement of the right contact nodes = contact_right @ q, rows t1, t2, n of node 1, then of node 2, ...
    contact_position : (n_c, 3) array
        Positions of the right contact nodes, m.
    force_excitation : (n,) array
        Generalised force of 1 N of excitation, real or complex.
    outputs : mapping of str to (n,) array
        Displacement NAME = outputs[NAME] @ q. "tip" is the default output.
    contact_left : (3 n_c, n) array or None
        The same as `contact_right` for the left nodes; None for contact against ground.
    contact_area : (n_c,) array or None
        Tributary areas of the contact nodes, m^2.
    contact_frame : (n_c, 3, 3) array or None
        Directions t1, t2, n of the right contact nodes, in rows.
    force_centrifugal : (n,) array or None
        Generalised centrifugal force at 1 rad/s; it grows with the square of the speed.
        At a speed its static displacement is that of the equilibrium with free contacts.
    force_static : (n,) array or None
        Any other static force, N.
    force_harmonics : mapping of int to (n,) array
        Generalised forces of 1 N of excitation in harmonics h = 2 and more of the excitation that have a pattern of
        their own, real or complex; the others have `force_excitation`.
    coriolis : (n, n) array or None
        Skew-symmetric matrix at 1 rad/s that times the speed multiplies the velocity, kg; None: not known.
    cyclic_right, cyclic_left : (r, n) array or None
        Motions of the two cut faces at which the sector is joined to its neighbours, those of the left one turned by
        one pitch; in a travelling wave cyclic_right @ q = exp(i psi) cyclic_left @ q. None: joined by contacts alone.
    blade_stiffness : (n, n) array or None
        The part of `stiffness` that is the elastic stiffness of the blade; needed where blades on a disk differ.
    wave_blocks : mapping of int to WaveBlock
        Coordinates that each nodal diameter has for itself, in a model made of one superelement for each.
    interfaces : mapping of str to int
        Contact interfaces by name in the order of their nodes, with their numbers of nodes, see `with_interfaces`;
        by default all nodes belong to the one named "shroud".
    basis : (N, n) array or None
        Displacements of the mesh nodes for unit coordinates.
    n_blades : int or None
        Number of blades of the ring; None for a single structure.
    speed_rpm : float or None
        Speed, rev/min, about whose static equilibrium `stiffness` holds; None: not known.
    producer : str
        Free text that says who made the model.

    Raises
    ------
    ReducedModelError
        A shape, a value or a symmetry is wrong.

    Examples
    --------
    A blade of one coordinate, 4 kg on 4 MN/m, whose contact node touches its neighbours along n:

    >>> from rom import ReducedModel, natural_frequencies
    >>> along_n, one = np.array([[0.0], [0.0], [1.0]]), np.ones(1)
    >>> model = ReducedModel(
    ...     mass=4.0 * np.eye(1), stiffness=4e6 * np.eye(1), contact_right=along_n, contact_left=along_n,
    ...     contact_position=np.zeros((1, 3)), force_excitation=one, outputs={"tip": one}, n_blades=40
    ... )
    >>> model.size, model.n_contacts, (2 * np.pi * natural_frequencies(model, phase=0.0)).round(6).tolist()
    (1, 1, [1000.0])
    """

    mass: Array
    stiffness: Array
    contact_right: Array
    contact_position: Array
    force_excitation: Array | ComplexArray
    outputs: Mapping[str, Array]
    contact_left: Array | None = None
    contact_area: Array | None = None
    force_centrifugal: Array | None = None
    force_static: Array | None = None
    coriolis: Array | None = None
    basis: Array | None = None
    n_blades: int | None = None
    speed_rpm: float | None = None
    producer: str = field(default="shroud")
    force_harmonics: Mapping[int, Array | ComplexArray] = field(default_factory=dict)
    cyclic_right: Array | None = None
    cyclic_left: Array | None = None
    blade_stiffness: Array | None = None
    wave_blocks: Mapping[int, WaveBlock] = field(default_factory=dict)
    interfaces: Mapping[str, int] = field(default_factory=dict)
    contact_frame: Array | None = None

    def __post_init__(self) -> None:
        """Check shapes, finiteness and symmetry."""
        n = self.mass.shape[0] if self.mass.ndim == 2 else 0
        if n < 1:
            raise ReducedModelError(f"mass: shape {self.mass.shape}, allowed: one coordinate or more")
        n_contacts = self.contact_position.shape[0]
        if len(self.interfaces) < 2:  # it has all nodes
            name = next(iter(self.interfaces), MAIN_INTERFACE)
            object.__setattr__(self, "interfaces", {name: n_contacts})
        elif sum(self.interfaces.values()) != n_contacts or min(self.interfaces.values()) < 1:
            raise ReducedModelError(
                f"contact/interfaces: {dict(self.interfaces)}, allowed: one node or more each, {n_contacts} together"
            )
        joined = 0 if self.cyclic_right is None else len(self.cyclic_right)
        if (self.cyclic_right is None) != (self.cyclic_left is None):
            raise ReducedModelError("cyclic/right: allowed only together with cyclic/left")
        shapes: dict[str, tuple[object, tuple[int, ...]]] = {
            "mass": (self.mass, (n, n)),
            "stiffness": (self.stiffness, (n, n)),
            "contact/position": (self.contact_position, (n_contacts, 3)),
            "contact/right": (self.contact_right, (3 * n_contacts, n)),
            "contact/left": (self.contact_left, (3 * n_contacts, n)),
            "contact/area": (self.contact_area, (n_contacts,)),
            "contact/frame": (self.contact_frame, (n_contacts, 3, 3)),
            "force/excitation": (self.force_excitation, (n,)),
            "force/centrifugal": (self.force_centrifugal, (n,)),
            "force/static": (self.force_static, (n,)),
            "coriolis": (self.coriolis, (n, n)),
            "blade_stiffness": (self.blade_stiffness, (n, n)),
            "cyclic/right": (self.cyclic_right, (joined, n)),
            "cyclic/left": (self.cyclic_left, (joined, n)),
            **{f"output/{name}": (vector, (n,)) for name, vector in self.outputs.items()},
            **{f"force/excitation_{h}": (vector, (n,)) for h, vector in self.force_harmonics.items()},
        }
        for name, (array, shape) in shapes.items():
            if array is not None:
                _check_array(name, np.asarray(array), shape)
        _check_symmetric("mass", self.mass)
        _check_symmetric("stiffness", self.stiffness)
        if self.blade_stiffness is not None:
            _check_symmetric("blade_stiffness", self.blade_stiffness)
        if self.coriolis is not None:
            _check_symmetric("coriolis", self.coriolis, skew=True)
        if any(not 2 <= h <= HIGHEST_HARMONIC for h in self.force_harmonics):
            raise ReducedModelError(
                f"force/excitation_h: harmonics {sorted(self.force_harmonics)}, allowed: 2 to {HIGHEST_HARMONIC}; "
                "force/excitation is that of harmonic 1"
            )
        if "tip" not in self.outputs:
            raise ReducedModelError("output/tip: missing; it is the default output")
        if self.basis is not None:
            if self.basis.ndim != 2 or self.basis.shape[1] != n:
                raise ReducedModelError(f"basis: shape {self.basis.shape}, allowed: (any, {n})")
            _check_array("basis", self.basis, self.basis.shape)
        if self.contact_area is not None and not np.all(self.contact_area > 0.0):
            raise ReducedModelError("contact/area: holds values that are not above 0, allowed: areas in m^2")
        if self.contact_frame is not None:
            _check_frames(self.contact_frame)
        if self.n_blades is not None and not 1 <= self.n_blades <= MOST_BLADES:
            raise ReducedModelError(f"n_blades: {self.n_blades}, allowed: 1 to {MOST_BLADES}")
        if self.speed_rpm is not None and not np.isfinite(self.speed_rpm):
            raise ReducedModelError(f"speed_rpm: {self.speed_rpm}, allowed: a finite number (rev/min)")

    @classmethod
    def from_matrices(
        cls,
        mass: ArrayLike,
        stiffness: ArrayLike,
        contact_right: ArrayLike,
        load: ArrayLike,
        output: ArrayLike | Mapping[str, ArrayLike] | None = None,
        *,
        contact_left: ArrayLike | None = None,
        n_blades: int | None = None,
        contact_position: ArrayLike | None = None,
        **further: Any,
    ) -> ReducedModel:
        """A model from matrices, contact rows and loads in any form that numpy or `scipy.sparse` has.

        Parameters
        ----------
        mass, stiffness : (n, n) array
            Symmetric matrices of few coordinates.
        contact_right : (3 n_c, n) array
            Rows that map the coordinates to the displacement of the contact nodes along t1, t2, n.
        load : (n,) array
            Generalised force of 1 N of excitation, real or complex.
        output : (n,) array or mapping of str to (n,) array
            Displacement whose response is computed, or several by name, one of them "tip"; by default the
            displacement on which a real load works.
        contact_left : (3 n_c, n) array
            Rows of the nodes of the left face; none: the contacts are against the ground.
        n_blades : int
            Number of blades of the ring; none: a single structure.
        contact_position : (n_c, 3) array
            Positions of the right nodes, m, for pictures and lists of nodes by place; by default the origin.
        **further : array or value
            Further attributes, such as `contact_area` or `force_static`.

        Returns
        -------
        ReducedModel
            The model.

        Raises
        ------
        ReducedModelError
            Names the argument or attribute, its shape or value, and what is allowed.

        Examples
        --------
        A mass of 1 kg on a spring of 1 N/m, which rubs against the ground along t1:

        >>> from rom import ReducedModel
        >>> ReducedModel.from_matrices([[1.0]], [[1.0]], [[1.0], [0.0], [0.0]], load=[1.0]).n_contacts
        1
        """
        given: dict[str, Any] = {"mass": mass, "stiffness": stiffness, "contact_right": contact_right, "load": load}
        given |= {"contact_left": contact_left, "contact_position": contact_position, "output": output, **further}
        known = {name: _converted(name, value) for name, value in given.items()}
        return cls(n_blades=n_blades, **{"producer": "arrays", **_with_defaults(known)})

    @property
    def has_coriolis(self) -> bool:
        """Whether its Coriolis forces are known and not 0: their matrix, at a speed other than 0."""
        return self.coriolis is not None and bool(self.speed_rpm)

    @property
    def n_contacts(self) -> int:
        """Number of contact nodes on a face."""
        return self.contact_position.shape[0]

    @property
    def size(self) -> int:
        """Number of reduced coordinates."""
        return self.mass.shape[0]

    @property
    def has_disk(self) -> bool:
        """Whether the sector is joined to its neighbours, so that each wave has modes of its own."""
        return self.cyclic_right is not None or bool(self.wave_blocks)

    def wave(self, phase: float) -> NDArray[Any] | None:
        """Coordinates of a wave, q = T z.

        Parameters
        ----------
        phase : float
            Phase from one sector to the next, rad.

        Returns
        -------
        (n, k) array or None
            T; None where the sector is joined by contacts alone.

        Raises
        ------
        ReducedModelError
            The model has nothing for this nodal diameter.
        """
        if not self.wave_blocks:
            return wave_coordinates(self.cyclic_right, self.cyclic_left, phase)
        assert self.n_blades is not None
        n = round(phase * self.n_blades / (2.0 * np.pi)) % self.n_blades
        mirrored = min(n, self.n_blades - n)
        if mirrored not in self.wave_blocks:
            known = ", ".join(map(str, self.wave_blocks))
            raise ReducedModelError(f"nodal_diameter/{mirrored}: missing, and needed here; the model holds {known}")
        block = self.wave_blocks[mirrored]
        found = np.zeros((self.size, block.size), dtype=block.coordinates.dtype)
        found[block.first : block.first + block.length] = block.coordinates
        return found if mirrored == n else found.conj()


@dataclass(frozen=True)
class ContactInterface:
    """Pairs of nodes that may touch each other.

    The relative displacement in harmonic h of a wave of phase psi is d = q_R - q_L exp(i h psi) *between neighbours*,
    as the left nodes are those of the next blade; d = q_R - q_L *inside a sector*; d = q_R *against the ground*.

    Attributes
    ----------
    right : (3 n, n_q) array
        Displacement of the right nodes = right @ q, rows t1, t2, n of node 1, then of node 2, ...
    position : (n, 3) array
        Positions of the right nodes, m.
    left : (3 n, n_q) array or None
        The same as `right` for the left nodes; None: against the ground.
    inside : bool
        Whether the left nodes belong to the same sector as the right ones.
    area : (n,) array or None
        Tributary areas of the nodes, m^2.
    frame : (n, 3, 3) array or None
        Directions t1, t2, n of the right nodes, in rows.
    name : str
        Name by which scenes give its parameters and results speak of it.

    Examples
    --------
    A root that moves in its slot: the displacement between the two does not depend on the wave.

    >>> from rom import ContactInterface
    >>> root, slot = np.eye(3, 2), 0.5 * np.eye(3, 2)
    >>> rows, of_the_wave = ContactInterface(root, np.zeros((1, 3)), left=slot, inside=True).rows
    >>> rows[0, 0].item(), of_the_wave.any().item()
    (0.5, False)
    """

    right: Array
    position: Array
    left: Array | None = None
    inside: bool = False
    area: Array | None = None
    name: str = ""
    frame: Array | None = None

    @property
    def rows(self) -> tuple[Array, Array]:
        """The parts of d that do not depend on the wave and that go with -exp(i h psi), (3 n, n_q) each."""
        if self.left is None:
            return self.right, np.zeros_like(self.right)
        return (self.right - self.left, np.zeros_like(self.left)) if self.inside else (self.right, self.left)


def with_interfaces(model: ReducedModel, *interfaces: ContactInterface) -> ReducedModel:
    """The model with several contact interfaces in place of its own: B_h stacks them.

    What does not depend on the wave in the relative displacement of a pair stands in `contact_right`, what goes with
    -exp(i h psi) in `contact_left`: of nodes that touch inside a sector the former is the difference of both.

    Parameters
    ----------
    model : ReducedModel
        The model.
    *interfaces : ContactInterface
        One or more; their nodes are numbered one interface after the other (see `ContactParameters.joined`). One
        without a name is called after its place, "interface 1" and so on, or "shroud" where it is alone.

    Returns
    -------
    ReducedModel
        The model. Areas and frames are known if those of all interfaces are.

    Raises
    ------
    ReducedModelError
        An interface has motions of another number of nodes or coordinates, or two have one name.

    Examples
    --------
    A blade of two coordinates: its tip touches the next blade, its foot its own tip.

    >>> from rom import ContactInterface, ReducedModel, modal_model, with_interfaces
    >>> tip, foot = (np.outer([0.0, 0.0, 1.0], one) for one in np.eye(2))
    >>> place, one = np.zeros((1, 3)), np.eye(2)[0]
    >>> blade = ReducedModel(np.eye(2), np.diag([1.0, 4.0]), tip, place, one, {"tip": one}, n_blades=4)
    >>> shroud = ContactInterface(tip, place, tip)
    >>> model = with_interfaces(blade, shroud, ContactInterface(foot, place, tip, inside=True))
    >>> modal_model(model, damping_ratio=0.01).waves(np.array([np.pi])).relative[0, [2, 5]].real.round(6).tolist()
    [[2.0, 0.0], [-1.0, 1.0]]
    """
    parts = [interface.rows for interface in interfaces]
    for interface, (right, left) in zip(interfaces, parts, strict=True):
        shape = 3 * len(interface.position), model.size
        for name, rows in (("right", right), ("left", left)):
            if rows.shape != shape:
                raise ReducedModelError(f"contact interface: {name}: shape {rows.shape}, allowed: {shape}")
    alone = len(interfaces) == 1
    names = [each.name or (MAIN_INTERFACE if alone else f"interface {k + 1}") for k, each in enumerate(interfaces)]
    if len(set(names)) < len(names):
        raise ReducedModelError(f"contact/interfaces: {names}, allowed: a name of its own for each")
    left = np.concatenate([part for _, part in parts])
    return replace(
        model,
        contact_right=np.concatenate([part for part, _ in parts]),
        contact_left=left if left.any() else None,
        contact_position=np.concatenate([interface.position for interface in interfaces]),
        contact_area=_of_all([each.area for each in interfaces]),
        contact_frame=_of_all([each.frame for each in interfaces]),
        interfaces={name: len(each.position) for name, each in zip(names, interfaces, strict=True)},
    )


def _of_all(parts: Sequence[Array | None]) -> Array | None:
    """Values of all interfaces, one after the other; None where those of one are not known."""
    known = [part for part in parts if part is not None]
    return np.concatenate(known) if len(known) == len(parts) else None


def interfaces_of(model: ReducedModel) -> tuple[ContactInterface, ...]:
    """The contact interfaces of a model, one by one: `with_interfaces` puts them together again.

    Those whose left nodes do not move with the wave are against the ground: of an interface inside a sector
    the displacement of one side relative to the other is known alone.
    """
    found, first = [], 0
    for name, count in model.interfaces.items():
        nodes, rows = slice(first, first + count), slice(3 * first, 3 * (first + count))
        left = None if model.contact_left is None else model.contact_left[rows]
        area, frame = (None if array is None else array[nodes] for array in (model.contact_area, model.contact_frame))
        touches = left is not None and left.any()
        found.append(
            ContactInterface(
                model.contact_right[rows],
                model.contact_position[nodes],
                left if touches else None,
                area=area,
                name=name,
                frame=frame,
            )
        )
        first += count
    return tuple(found)


def _array(name: str, values: Any) -> NDArray[Any]:
    """An array of real or complex numbers, of its own; sparse matrices become dense."""
    dense = values.toarray() if hasattr(values, "toarray") else values
    try:
        found = np.array(dense)
        return found.astype(np.complex128 if np.iscomplexobj(found) else np.float64)
    except (TypeError, ValueError):
        raise ReducedModelError(f"{name}: not an array of numbers, allowed: rows of equal length") from None


def _with_defaults(given: dict[str, Any]) -> dict[str, Any]:
    """The attributes of a model from the converted arguments of `from_matrices`."""
    right, load, output = given["contact_right"], given.pop("load"), given.pop("output")
    if unknown := given.keys() - {each.name for each in fields(ReducedModel)}:
        raise ReducedModelError(f"{min(unknown)}: unknown attribute, allowed: those of ReducedModel")
    if right.ndim != 2 or len(right) % 3:
        allowed = "three rows, along t1, t2, n, for each contact node"
        raise ReducedModelError(f"contact_right: shape {right.shape}, allowed: {allowed}")
    if output is None and np.iscomplexobj(load):
        raise ReducedModelError("output: missing, allowed: a row of the displacement, as the load is complex")
    if given["contact_position"] is None:
        given["contact_position"] = np.zeros((len(right) // 3, 3))
    output = load if output is None else output
    named = output if isinstance(output, Mapping) else {"tip": output}
    return {**given, "force_excitation": load, "outputs": named}


def _converted(name: str, value: Any) -> Any:
    """An attribute of a model: arrays, also in a mapping, as `_array` makes them; others as they are."""
    if isinstance(value, Mapping):
        return {key: _converted(f"{name} {key}", part) for key, part in value.items()}
    is_array = isinstance(value, list | tuple | np.ndarray) or hasattr(value, "toarray")
    return _array(name, value) if is_array else value


def _check_array(name: str, array: NDArray[np.generic], shape: tuple[int, ...]) -> None:
    if array.shape != shape:
        raise ReducedModelError(f"{name}: shape {array.shape}, allowed: {shape}")
    if not np.all(np.isfinite(array)):
        raise ReducedModelError(f"{name}: holds values that are not finite, allowed: finite numbers")
    if np.max(np.abs(array), initial=0.0) > LARGEST_NUMBER:
        raise ReducedModelError(f"{name}: holds values beyond {LARGEST_NUMBER:g}, allowed: numbers in SI units")


def _check_frames(frames: Array) -> None:
    """Refuse rows t1, t2, n that are not orthonormal."""
    off = float(np.abs(frames @ frames.transpose(0, 2, 1) - np.eye(3)).max(initial=0.0))
    if off > FRAME_TOLERANCE:
        raise ReducedModelError(f"contact/frame: off by {off:.2g}, allowed: orthonormal rows t1, t2, n")


def _check_symmetric(name: str, matrix: Array, skew: bool = False) -> None:
    mirrored = -matrix.T if skew else matrix.T
    asymmetry = float(np.max(np.abs(matrix - mirrored), initial=0.0))
    scale = float(np.max(np.abs(matrix), initial=0.0))
    if asymmetry > SYMMETRY_TOLERANCE * scale:
        relative = asymmetry / scale
        wrong = "not skew-symmetric, off" if skew else "asymmetric"
        raise ReducedModelError(
            f"{name}: {wrong} by {relative:.2g} of its largest entry, allowed: {SYMMETRY_TOLERANCE:g}"
        )


def expand_to_mesh(model: ReducedModel, coordinates: NDArray[Any]) -> NDArray[Any]:
    """Displacements of all mesh nodes from reduced coordinates, u = basis q.

    `coordinates` (..., n): reduced coordinates q, real or complex. Returns (..., n_nodes, 3): displacements in m. The
    mesh vertices are the first nodes, in their own order; mid-side nodes follow.
    """
    if model.basis is None:
        raise ReducedModelError(
            "basis: missing, allowed: a model reduced with it (`shroud run SCENE --until render`, or store_basis)"
        )
    if model.basis.shape[0] % 3:
        raise ReducedModelError(f"basis: {model.basis.shape[0]} rows, allowed: three for each node of a mesh")
    coordinates = np.asarray(coordinates)
    return (coordinates @ model.basis.T).reshape(*coordinates.shape[:-1], -1, 3)
