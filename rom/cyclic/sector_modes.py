"""The modes of a ring: of a blade alone, the same in every wave, or of a sector of a bladed disk.

A sector has other modes in each wave, as its cut faces follow the neighbours. Either way K phi = w^2 M phi.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rom.cyclic.cyclic_symmetry import in_wave, inter_blade_phase, relative_contact_motion, sparse_wave
from rom.cyclic.influence_coefficients import InfluenceCoefficients, flow_in_wave
from rom.cyclic.modal_model import ModalDamping, ModalModel, WaveModes, with_coriolis
from rom.cyclic.pole_modes import coriolis_forces
from rom.cyclic.reduced_model import Array, ComplexArray, ReducedModel
from rom.errors import ReducedModelError
from rom.units import angular_speed

HIGHEST_SQUARED = 1e60  # (rad/s)^2: its square must not overflow
RIGID = 1e-14  # of the largest w^2: a smaller one is that of a rigid motion
RIGID_IN_WAVE = 1e-11  # the same in a wave: coordinates of cut faces leave more round-off


def projected_modes(
    model: ReducedModel,
    damping: ModalDamping,
    static: Array,
    wave: NDArray[Any] | None = None,
    phase: float = 0.0,
    turns: bool = False,
) -> ModalModel:
    """All modes of a reduced model, with its Coriolis forces where it `turns`.

    Shapes: `static` (n,), `wave` (n, k), the coordinates in the wave of a `phase`.
    """
    squared, shapes = _modes(model, wave)
    floating = _floating_first(model, squared, shapes, phase)
    rigid = np.count_nonzero(squared == 0.0)
    if wave is None and floating < rigid:
        raise ReducedModelError(
            f"stiffness: {rigid - floating} rigid motions that contacts do not hold even where they stick, allowed: "
            "positive definite, or rigid motions that contacts hold; a structure that floats freely has no static "
            "response"
        )
    frequency = np.sqrt(squared)
    adjoint = shapes.conj().T
    return ModalModel(
        angular_frequency=frequency,
        damping=damping.coefficients(frequency),
        right=model.contact_right @ shapes,
        left=None if model.contact_left is None else model.contact_left @ shapes,
        force=adjoint @ model.force_excitation,
        static_force=adjoint @ static,
        outputs={name: vector @ shapes for name, vector in model.outputs.items()},
        shapes=shapes,
        position=model.contact_position,
        area=model.contact_area,
        n_blades=model.n_blades,
        harmonic_forces={h: adjoint @ vector for h, vector in model.force_harmonics.items()},
        floating=floating,
        coriolis=coriolis_forces(model, shapes) if turns else None,
    )


def _floating_first(model: ReducedModel, squared: Array, shapes: NDArray[Any], phase: float) -> int:
    """Number of rigid motions that contacts feel; combines the rigid shapes (n, r) so that these come first."""
    rigid = squared == 0.0
    if not rigid.any():
        return 0
    right = model.contact_right @ shapes[:, rigid]
    left = np.zeros_like(right) if model.contact_left is None else model.contact_left @ shapes[:, rigid]
    relative = relative_contact_motion(right, left, phase)
    _, felt, combined = np.linalg.svd(relative if np.iscomplexobj(shapes) else relative.real)
    shapes[:, rigid] = shapes[:, rigid] @ combined.conj().T
    rows = model.contact_right if model.contact_left is None else np.hstack([model.contact_right, model.contact_left])
    scale = float(np.linalg.norm(rows, axis=1).max(initial=0.0) * np.linalg.norm(shapes[:, rigid], axis=0).max())
    return int(np.count_nonzero(felt > FELT * scale))


MASSLESS = 1e-14  # mass over the largest one, below which a coordinate counts as massless
QUICK = 1e4  # how far above the highest frequency of the others the small mass puts massless coordinates


def unfit_mass(mass: NDArray[Any], stiffness: NDArray[Any]) -> ReducedModelError:
    """What is wrong with a mass matrix; massless coordinates get by with a small mass, which the line proposes."""
    from scipy.linalg import eigvalsh

    own = np.diag(mass).real
    massless = np.abs(mass).max(axis=1) <= MASSLESS * np.abs(own).max(initial=0.0)
    found = "mass: not positive definite, allowed: positive definite"
    if not massless.any() or massless.all():
        return ReducedModelError(found)
    rest = np.ix_(~massless, ~massless)
    try:
        highest = float(eigvalsh(stiffness[rest], mass[rest])[-1])
    except np.linalg.LinAlgError:
        return ReducedModelError(found)
    small = float(np.diag(stiffness).real[massless].min()) / (QUICK**2 * highest)
    count = np.count_nonzero(massless)
    remedy = f"give them one of {small:.1g}, with which they follow at once"
    return ReducedModelError(f"{found}; {count} coordinates have no mass: {remedy}")


def _modes(model: ReducedModel, wave: NDArray[Any] | None) -> tuple[Array, NDArray[Any]]:
    """Eigenvalues w^2 (k,) and mass-normalised modes (n, k)."""
    from scipy.linalg import LinAlgError, eigh

    # Symmetrised: matrices from elsewhere are symmetric only to their own round-off.
    mass: NDArray[Any] = (model.mass + model.mass.T) / 2
    stiffness: NDArray[Any] = (model.stiffness + model.stiffness.T) / 2
    if wave is not None:
        mass, stiffness = in_wave(mass, wave), in_wave(stiffness, wave)
    try:
        squared, shapes = eigh(stiffness, mass)
    except LinAlgError:
        raise unfit_mass(mass, stiffness) from None
    round_off = RIGID if wave is None else RIGID_IN_WAVE
    if squared[0] < -round_off * squared[-1]:
        raise ReducedModelError(
            f"stiffness: smallest w^2 is {squared[0]:.3g} (largest {squared[-1]:.3g}), allowed: positive definite; "
            "a structure that floats freely has no static response"
        )
    if squared[-1] > HIGHEST_SQUARED:
        raise ReducedModelError(
            f"mass: too small for its stiffness: the largest w^2 is {squared[-1]:.3g} (rad/s)^2, "
            f"allowed: {HIGHEST_SQUARED:g} at most"
        )
    squared = np.where(squared <= round_off * squared[-1], 0.0, squared)
    return squared, shapes if wave is None else sparse_wave(wave) @ shapes


FELT = 1e-6  # relative motion of contacts over the largest that a rigid motion may cause, below which it is round-off
NO_STATIC_FORCE = 1e-6  # of the static force: part of it on rigid motions that is round-off
ABOVE = 10.0  # frequency of modes that fill a row, as a multiple of the highest one
WHOLE = 1e-6  # distance of n from a whole number


@dataclass(frozen=True)
class SectorModes:
    """The modes of a sector that is joined to its neighbours at cut faces, wave by wave.

    In a wave of n nodal diameters the sector has the coordinates q = T_n z of `wave_coordinates`, hence modes of its
    own. The modes of -n are the complex conjugates of those of n; they are real where n is 0 or N_b / 2.

    Attributes
    ----------
    model : ReducedModel
        The reduced model, with cut faces.
    modal_damping : ModalDamping
        Damping of the modes of every wave.
    static : (n,) array
        Static force, N.
    are_softly_held : bool
        Whether bodies that contacts alone hold are on soft springs, see `ModalModel.softly_held`.
    influence : tuple of InfluenceCoefficients
        Those of the mode families that the flow around the blades acts on.
    turns : bool
        Whether Coriolis forces act.

    Raises
    ------
    ReducedModelError
        The number of blades is missing, the damping is not as allowed, or the static force pushes a disk that nothing
        holds.

    Examples
    --------
    Blades of 1 kg on 1 MN/m, on rims of 1 kg that springs of 1 MN/m join: the frequencies rise with n.

    >>> from rom import ReducedModel, modal_model
    >>> rim = 1e6 * np.array([[2.0, -1.0, -1.0], [-1.0, 1.0, 0.0], [-1.0, 0.0, 1.0]])
    >>> left, right, blade = np.eye(3)
    >>> n, cut = np.outer([0.0, 0.0, 1.0], blade), {"cyclic_right": right[None], "cyclic_left": left[None]}
    >>> tip, place = {"tip": blade}, np.zeros((1, 3))
    >>> model = ReducedModel(np.eye(3), rim + 1e5 * np.eye(3), n, place, blade, tip, n, n_blades=12, **cut)
    >>> modes = modal_model(model, damping_ratio=0.01)
    >>> bool(modes.at(0).angular_frequency[0] < modes.at(6).angular_frequency[0])
    True
    """

    model: ReducedModel
    modal_damping: ModalDamping
    static: Array
    are_softly_held: bool = False
    influence: tuple[InfluenceCoefficients, ...] = ()
    turns: bool = False
    _known: dict[int, ModalModel] = field(default_factory=dict, init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        """Check the number of blades, the damping and the static force."""
        if self.model.n_blades is None:
            raise ReducedModelError("n_blades: missing; a model with cyclic/right needs the number of sectors")
        if self.model.wave_blocks and 0 not in self.model.wave_blocks and not self.static.any():
            return  # a model of linear vibration in some waves
        still = self.at(0)
        rigid = ~still.is_felt
        pushed = np.linalg.norm(still.shapes[:, rigid] @ still.static_force[rigid]) * np.sqrt(
            np.trace(self.model.mass) * np.abs(self.model.mass).max()
        )
        if pushed > NO_STATIC_FORCE * np.linalg.norm(self.static):
            raise ReducedModelError(
                "force/static: pushes the disk along or about its axis, where nothing holds it; allowed: a disk that "
                "is held, or static forces in equilibrium"
            )

    @property
    def n_contacts(self) -> int:
        """Number of contact nodes on a face."""
        return self.model.n_contacts

    @property
    def position(self) -> Array:
        """Positions (n_c, 3) of the contact nodes, as in `ReducedModel`."""
        return self.model.contact_position

    @property
    def area(self) -> Array | None:
        """Areas (n_c,) of the contact nodes, as in `ReducedModel`."""
        return self.model.contact_area

    @property
    def n_blades(self) -> int:
        """Number of blades of the ring."""
        assert self.model.n_blades is not None
        return self.model.n_blades

    @property
    def output_names(self) -> tuple[str, ...]:
        """Names of the outputs."""
        return tuple(self.model.outputs)

    @property
    def waves_differ(self) -> bool:
        """Whether each wave has modes of its own: sectors are joined at a disk."""
        return True

    @property
    def blades_may_differ(self) -> bool:
        """Whether mistuning of the blades can be described: with a disk only where their own stiffness is known."""
        return self.model.blade_stiffness is not None

    @property
    def joined(self) -> bool:
        """Whether the blades move each other without contacts: through a disk, or the flow."""
        return True

    @property
    def neighbours_coupled(self) -> bool:
        """Whether neighbouring blades move each other: through the disk, whatever the contacts touch."""
        return True

    @property
    def harmonic_forces(self) -> tuple[int, ...]:
        """Harmonics 2 and more of the excitation that have a force of their own."""
        return tuple(self.model.force_harmonics)

    def phase(self, engine_order: int) -> float:
        """Inter-blade phase angle psi, rad; see `inter_blade_phase`.

        Parameters
        ----------
        engine_order : int
            Engine order EO.
        """
        return inter_blade_phase(engine_order, self.n_blades)

    def at(self, nodal_diameter: int) -> ModalModel:
        """The modes in a wave of a number of nodal diameters. Rigid motions have w = 0.

        Parameters
        ----------
        nodal_diameter : int
            n, of any sign; n + N_b is the same wave.

        Raises
        ------
        ReducedModelError
            The mass or the stiffness is not positive definite.
        """
        n = nodal_diameter % self.n_blades
        if n not in self._known:
            mirrored = self.n_blades - n
            self._known[n] = self._conjugate(self.at(mirrored)) if mirrored < n else self._solved(n)
        return self._known[n]

    def at_phase(self, phase: float) -> ModalModel:
        """The modes in a wave of an inter-blade phase angle, a multiple of 2 pi / N_b.

        Parameters
        ----------
        phase : float
            Phase from one blade to the next, rad.
        """
        n = phase * self.n_blades / (2.0 * np.pi)
        if abs(n - round(n)) > WHOLE:
            raise ValueError(f"phase: {phase} rad, allowed: multiples of 2 pi / {self.n_blades}")
        return self.at(round(n))

    @property
    def softly_held(self) -> "SectorModes":
        """The same with bodies that contacts alone hold on springs so soft that no vibration notices them."""
        return replace(self, are_softly_held=True) if self.at(0).floating else self

    def with_damping_times(self, factor: float) -> "SectorModes":
        """The same modes with all damping coefficients times a factor.

        Parameters
        ----------
        factor : float
            The factor.
        """
        return replace(self, modal_damping=self.modal_damping.times(factor))

    def waves(self, phases: Array, rigid: bool | Sequence[bool] = False) -> WaveModes:
        """The modes in several waves, those of the waves with fewer modes filled up with some that do not move.

        Parameters
        ----------
        phases : (J,) array
            Phases from one blade to the next, rad, multiples of 2 pi / N_b.
        rigid : bool or (J,) sequence of bool
            Whether rigid motions of the disk, which no contact feels, are free to move.
        """
        found = [self.at_phase(float(phase)) for phase in phases]
        size = max(each.angular_frequency.size for each in found)
        still = ABOVE * max(float(each.angular_frequency[-1]) for each in found)
        damped = max(float(each.damping[-1]) for each in found)
        frequency, damping = np.full((len(found), size), still), np.full((len(found), size), damped)
        relative = np.zeros((len(found), 3 * self.n_contacts, size), dtype=complex)
        flow = np.zeros((2, len(found), size), dtype=complex) if self.influence else None
        for row, (each, phase, moves) in enumerate(
            zip(found, phases, np.broadcast_to(rigid, len(found)), strict=True)
        ):
            own, count = each.angular_frequency, each.angular_frequency.size
            frequency[row, :count] = np.where(each.is_felt | bool(moves), own, still)
            damping[row, :count] = each.damping
            relative[row, :, :count] = relative_contact_motion(each.right, each.left, phase)
            if flow is not None and each.flow is not None:
                flow[:, row, :count] = each.flow
        return WaveModes(frequency, damping, relative, flow)

    @cached_property
    def without_coriolis(self) -> "SectorModes":
        """The same without Coriolis forces."""
        return replace(self, turns=False) if self.turns else self

    def in_motion(self, waves: WaveModes, phases: Array, moves: Sequence[bool]) -> WaveModes:
        """What vibrates in several waves: their modes, or with Coriolis forces their poles.

        Parameters
        ----------
        waves : WaveModes
            The modes, (J, m).
        phases : (J,) array
            Phases from one blade to the next, rad, multiples of 2 pi / N_b.
        moves : (J,) sequence of bool
            Where it vibrates. Elsewhere the motion is static, and the modes stay what they are.
        """
        return with_coriolis(waves, [self.at_phase(float(phase)) for phase in phases], moves) if self.turns else waves

    def wave_outputs(self, name: str, phases: Array) -> ComplexArray:
        """An output of the modes in several waves, (J, m); 0 in those that fill a row up.

        Parameters
        ----------
        name : str
            Name of the output.
        phases : (J,) array
            Phases from one blade to the next, rad, multiples of 2 pi / N_b.
        """
        found = [self.at_phase(float(phase)).outputs[name] for phase in phases]
        rows = np.zeros((len(found), max(own.size for own in found)), dtype=complex)
        for row, own in zip(rows, found, strict=True):
            row[: own.size] = own
        return rows

    def reduced_coordinates(self, coordinates: ComplexArray, phases: Array) -> ComplexArray:
        """Coordinates of the reduced model, (J, n), from modal ones (J, m) in several waves.

        Parameters
        ----------
        coordinates : (J, m) complex array
            Modal coordinates.
        phases : (J,) array
            Phases from one blade to the next, rad, multiples of 2 pi / N_b.
        """
        shapes = [self.at_phase(float(phase)).shapes for phase in phases]
        return np.stack([row[: own.shape[1]] @ own.T for row, own in zip(coordinates, shapes, strict=True)])

    def _solved(self, n: int) -> ModalModel:
        phase = 2.0 * np.pi * n / self.n_blades
        wave = self.model.wave(phase)
        assert wave is not None
        real = 2 * n % self.n_blades == 0
        wave = wave.real if real else wave
        found = projected_modes(self.model, self.modal_damping, self.static, wave, phase, self.turns)
        if self.influence:
            found = replace(found, flow=flow_in_wave(self.influence, found.angular_frequency, phase))
        return found.softly_held if self.are_softly_held else found

    def _conjugate(self, modes: ModalModel) -> ModalModel:
        """The modes of -n from those of n; the forces may be complex themselves."""
        shapes, model = modes.shapes.conj(), self.model
        adjoint = shapes.conj().T
        found = replace(
            modes,
            shapes=shapes,
            right=modes.right.conj(),
            left=None if modes.left is None else modes.left.conj(),
            force=adjoint @ model.force_excitation,
            static_force=adjoint @ self.static,
            outputs={name: row.conj() for name, row in modes.outputs.items()},
            harmonic_forces={h: adjoint @ vector for h, vector in model.force_harmonics.items()},
            flow=None if modes.flow is None else modes.flow.conj(),
            coriolis=None if modes.coriolis is None else modes.coriolis.conj(),
        )
        if modes.turns:
            vars(found)["turning"] = modes.turning.conjugate  # the eigenproblem of poles is dear: once for +-n
        return found


RingModes = ModalModel | SectorModes


def modal_model(
    model: ReducedModel,
    *,
    damping_ratio: ArrayLike | None = None,
    rayleigh: tuple[float, float] | None = None,
    speed_rpm: float | None = None,
    influence: Sequence[InfluenceCoefficients] = (),
    coriolis: bool = False,
) -> RingModes:
    """Solve K phi = w^2 M phi of the reduced system for all its modes.

    Those of a sector with cut faces are solved wave by wave, when they are asked for.

    Parameters
    ----------
    model : ReducedModel
        The reduced model.
    damping_ratio : float or sequence of float, optional
        zeta, one number for all modes or one for each of the first modes; the last one holds for the modes above.
    rayleigh : (float, float), optional
        (a, b) of C = a M + b K, 2 zeta_m w_m = a + b w_m^2. Give this or `damping_ratio`.
    speed_rpm : float, optional
        Rotational speed of the centrifugal force, rev/min. By default the speed that the model was stiffened for,
        0 where the model does not say.
    influence : sequence of InfluenceCoefficients
        Those of the mode families that the flow around the blades acts on.
    coriolis : bool
        Whether Coriolis forces act, those of the speed of the model.

    Returns
    -------
    ModalModel or SectorModes
        The modes of a blade alone, or those of a sector with cut faces.

    Raises
    ------
    ReducedModelError
        The mass or the stiffness is not positive definite (a rigid-body mode of a blade has no static response);
        damping is given twice, not at all, or negative; the model was stiffened for another speed than `speed_rpm`,
        or has no centrifugal force; the number of sectors is missing, or a static force pushes a disk that floats;
        Coriolis forces without their matrix or a speed.

    Examples
    --------
    >>> from rom import ReducedModel, modal_model
    >>> along_n, one = np.array([[0.0], [0.0], [1.0]]), np.ones(1)
    >>> model = ReducedModel(np.eye(1), 1e6 * np.eye(1), along_n, np.zeros((1, 3)), one, {"tip": one})
    >>> print(modal_model(model, damping_ratio=0.01).damping.round(6))  # 2 zeta w, w = 1000 rad/s
    [20.]
    """
    damping, static = ModalDamping(damping_ratio, rayleigh), _static_force(model, speed_rpm)
    if model.has_disk:
        return SectorModes(model, damping, static, influence=tuple(influence), turns=coriolis)
    found = projected_modes(model, damping, static, turns=coriolis)
    if influence:
        flow_in_wave(
            influence, found.angular_frequency, 0.0
        )  # the families exist, and tables reach their frequencies
    return replace(found, influence=tuple(influence))


def _static_force(model: ReducedModel, speed_rpm: float | None) -> Array:
    """Static force (n,) of harmonic 0: centrifugal force at the speed, and any other."""
    stiffened = model.speed_rpm
    speed = (stiffened or 0.0) if speed_rpm is None else speed_rpm
    if stiffened is not None and speed != stiffened:
        raise ReducedModelError(
            f"load.speed_rpm = {speed:g}: the model was stiffened for {stiffened:g} rev/min, allowed: that speed"
        )
    static = np.zeros(model.size)
    if model.force_static is not None:
        static = static + model.force_static
    if speed != 0.0:
        if model.force_centrifugal is None:
            raise ReducedModelError(
                "force/centrifugal: missing, but load.speed_rpm is not 0, allowed: the static force at 1 rad/s "
                "(force_centrifugal in Python; zeros where there is none)"
            )
        static = static + model.force_centrifugal * angular_speed(speed) ** 2
    return static
