"""Modes of the reduced system: its displacements, forces and contact motions in modal coordinates."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from rom.cyclic.cyclic_symmetry import inter_blade_phase
from rom.cyclic.reduced_model import Array, ComplexArray, ReducedModel
from rom.errors import ReducedModelError
from rom.units import angular_speed

HIGHEST_SQUARED = 1e60  # (rad/s)^2: its square must not overflow


@dataclass(frozen=True)
class ModalModel:
    """All modes of a reduced system, mass-normalised, and its vectors in modal coordinates.

    Attributes
    ----------
    angular_frequency : (m,) array
        Natural frequencies w_m in rad/s, ascending.
    damping : (m,) array
        Modal damping coefficients 2 zeta_m w_m, 1/s.
    right, left : (3 n_c, m) array
        Contact motions of the modes; left None: contact against ground.
    force : (m,) array
        Modal force of 1 N of excitation, real or complex.
    static_force : (m,) array
        Modal static force at the rotational speed, N / sqrt(kg).
    outputs : mapping of str to (m,) array
        Outputs of the modes.
    shapes : (n, m) array
        Modes in the reduced coordinates.
    position : (n_c, 3) array
        Positions of the contact nodes, as in `ReducedModel`.
    area : (n_c,) array or None
        Areas of the contact nodes, as in `ReducedModel`.
    n_blades : int or None
        Number of blades of the ring.
    harmonic_forces : mapping of int to (m,) array
        Modal forces of 1 N of excitation in harmonics 2 and more that have a force of their own.

    Examples
    --------
    The mode of 4 kg on 4 MN/m, normalised to 1 kg:

    >>> from rom import ReducedModel, modal_model
    >>> n, one = np.array([[0.0], [0.0], [1.0]]), np.ones(1)
    >>> model = ReducedModel(4 * np.eye(1), 4e6 * np.eye(1), n, np.zeros((1, 3)), one, {"tip": one}, n_blades=40)
    >>> modal = modal_model(model, damping_ratio=0.01)
    >>> modal.angular_frequency.round(6).tolist(), abs(modal.outputs["tip"]).round(6).tolist()
    ([1000.0], [0.5])
    """

    angular_frequency: Array
    damping: Array
    right: Array
    left: Array | None
    force: Array | ComplexArray
    static_force: Array
    outputs: Mapping[str, Array]
    shapes: Array
    position: Array
    area: Array | None
    n_blades: int | None
    harmonic_forces: Mapping[int, Array | ComplexArray] = field(default_factory=dict)

    @property
    def n_contacts(self) -> int:
        """Number of contact nodes on a face."""
        return self.right.shape[0] // 3

    def phase(self, engine_order: int) -> float:
        """Inter-blade phase angle psi, rad; see `inter_blade_phase`.

        Parameters
        ----------
        engine_order : int
            Engine order EO.
        """
        return inter_blade_phase(engine_order, self.n_blades)


def modal_model(
    model: ReducedModel,
    *,
    damping_ratio: ArrayLike | None = None,
    rayleigh: tuple[float, float] | None = None,
    speed_rpm: float | None = None,
) -> ModalModel:
    """Solve K phi = w^2 M phi of the reduced system for all its modes.

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

    Returns
    -------
    ModalModel
        The modes.

    Raises
    ------
    ReducedModelError
        The mass or the stiffness is not positive definite (a rigid-body mode has no static response); damping is
        given twice, not at all, or negative; the model was stiffened for another speed than `speed_rpm`, or has no
        centrifugal force.

    Examples
    --------
    >>> from rom import ReducedModel, modal_model
    >>> along_n, one = np.array([[0.0], [0.0], [1.0]]), np.ones(1)
    >>> model = ReducedModel(np.eye(1), 1e6 * np.eye(1), along_n, np.zeros((1, 3)), one, {"tip": one})
    >>> print(modal_model(model, damping_ratio=0.01).damping.round(6))  # 2 zeta w, w = 1000 rad/s
    [20.]
    """
    if model.cyclic_right is not None:
        raise ReducedModelError(
            "cyclic/right: not allowed for a forced response; a sector joined to its neighbours at cut faces has "
            "natural frequencies here, but other modes at each nodal diameter"
        )
    squared, shapes = _modes(model)
    frequency = np.sqrt(squared)
    return ModalModel(
        angular_frequency=frequency,
        damping=_modal_damping(frequency, damping_ratio, rayleigh),
        right=model.contact_right @ shapes,
        left=None if model.contact_left is None else model.contact_left @ shapes,
        force=shapes.T @ model.force_excitation,
        static_force=shapes.T @ _static_force(model, speed_rpm),
        outputs={name: vector @ shapes for name, vector in model.outputs.items()},
        shapes=shapes,
        position=model.contact_position,
        area=model.contact_area,
        n_blades=model.n_blades,
        harmonic_forces={h: shapes.T @ vector for h, vector in model.force_harmonics.items()},
    )


def _modes(model: ReducedModel) -> tuple[Array, Array]:
    """Eigenvalues w^2 (n,) and mass-normalised modes (n, n)."""
    from scipy.linalg import LinAlgError, eigh

    # Symmetrised: matrices from elsewhere are symmetric only to their own round-off.
    mass = (model.mass + model.mass.T) / 2
    stiffness = (model.stiffness + model.stiffness.T) / 2
    try:
        squared, shapes = eigh(stiffness, mass)
    except LinAlgError:
        raise ReducedModelError("mass: not positive definite, allowed: positive definite") from None
    if squared[0] <= 1e-14 * squared[-1]:
        raise ReducedModelError(
            f"stiffness: smallest w^2 is {squared[0]:.3g} (largest {squared[-1]:.3g}), allowed: positive definite; "
            "a structure that floats freely has no static response"
        )
    if squared[-1] > HIGHEST_SQUARED:
        raise ReducedModelError(
            f"mass: too small for its stiffness: the largest w^2 is {squared[-1]:.3g} (rad/s)^2, "
            f"allowed: {HIGHEST_SQUARED:g} at most"
        )
    return squared, shapes


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
            raise ReducedModelError("force/centrifugal: missing, but load.speed_rpm is not 0")
        static = static + model.force_centrifugal * angular_speed(speed) ** 2
    return static


def _modal_damping(frequency: Array, damping_ratio: ArrayLike | None, rayleigh: tuple[float, float] | None) -> Array:
    """2 zeta_i w_i from ratios or from Rayleigh's two coefficients."""
    if (damping_ratio is None) == (rayleigh is None):
        raise ReducedModelError("damping: give either a damping ratio or Rayleigh coefficients, not both or none")
    if rayleigh is not None:
        damping = rayleigh[0] + rayleigh[1] * frequency**2
    else:
        ratios = np.atleast_1d(np.asarray(damping_ratio, dtype=float))
        if ratios.ndim != 1 or ratios.size == 0:
            raise ReducedModelError("damping_ratio: allowed: a number or a list of numbers, one a mode")
        if ratios.size > frequency.size:
            raise ReducedModelError(
                f"damping_ratio: {ratios.size} values, allowed: at most one for each of the {frequency.size} modes"
            )
        zeta = np.full(frequency.size, ratios[-1])
        zeta[: ratios.size] = ratios
        damping = 2.0 * zeta * frequency
    if not np.all(np.isfinite(damping)) or np.any(damping < 0.0):
        raise ReducedModelError("damping: negative or not finite in some mode, allowed: 0 or more in every mode")
    return damping
