"""The modes of a sector of a bladed disk: other ones in each wave, as its cut faces follow the neighbours."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from rom.cyclic.cyclic_symmetry import inter_blade_phase, relative_contact_motion
from rom.cyclic.modal_damping import ModalDamping
from rom.cyclic.modal_model import ModalModel
from rom.cyclic.projected_modes import projected_modes
from rom.cyclic.reduced_model import Array, ReducedModel
from rom.cyclic.wave_modes import WaveModes
from rom.errors import ReducedModelError

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
    _known: dict[int, ModalModel] = field(default_factory=dict, init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        """Check the number of blades, the damping and the static force."""
        if self.model.n_blades is None:
            raise ReducedModelError("n_blades: missing; a model with cyclic/right needs the number of sectors")
        if self.model.wave_blocks and 0 not in self.model.wave_blocks and not self.static.any():
            return  # a model of linear vibration in some waves
        still = self.at(0)
        rigid = still.angular_frequency == 0.0
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
        """The modes in a wave of a number of nodal diameters. Rigid motions of the disk have w = 0.

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
            Whether rigid motions, which no contact feels, are free to move.
        """
        found = [self.at_phase(float(phase)) for phase in phases]
        size = max(each.angular_frequency.size for each in found)
        still = ABOVE * max(float(each.angular_frequency[-1]) for each in found)
        damped = max(float(each.damping[-1]) for each in found)
        frequency, damping = np.full((len(found), size), still), np.full((len(found), size), damped)
        relative = np.zeros((len(found), 3 * self.n_contacts, size), dtype=complex)
        for row, (each, phase, moves) in enumerate(
            zip(found, phases, np.broadcast_to(rigid, len(found)), strict=True)
        ):
            own, count = each.angular_frequency, each.angular_frequency.size
            frequency[row, :count] = own if moves else np.where(own == 0.0, still, own)
            damping[row, :count] = each.damping
            relative[row, :, :count] = relative_contact_motion(each.right, each.left, phase)
        return WaveModes(frequency, damping, relative)

    def _solved(self, n: int) -> ModalModel:
        wave = self.model.wave(2.0 * np.pi * n / self.n_blades)
        assert wave is not None
        real = 2 * n % self.n_blades == 0
        return projected_modes(self.model, self.modal_damping, self.static, wave.real if real else wave)

    def _conjugate(self, modes: ModalModel) -> ModalModel:
        """The modes of -n from those of n; the forces may be complex themselves."""
        shapes, model = modes.shapes.conj(), self.model
        adjoint = shapes.conj().T
        return replace(
            modes,
            shapes=shapes,
            right=modes.right.conj(),
            left=None if modes.left is None else modes.left.conj(),
            force=adjoint @ model.force_excitation,
            static_force=adjoint @ self.static,
            outputs={name: row.conj() for name, row in modes.outputs.items()},
            harmonic_forces={h: adjoint @ vector for h, vector in model.force_harmonics.items()},
        )
