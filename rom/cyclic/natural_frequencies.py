"""Natural frequencies, mode shapes and forced response of the ring with free, sliding or stuck contacts."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rom.cyclic.contact_springs import SpringSupportedMotion, contact_springs, spring_stiffness, supported_frequencies
from rom.cyclic.cyclic_symmetry import in_wave, inter_blade_phase, relative_contact_motion
from rom.cyclic.pole_modes import coriolis_forces
from rom.cyclic.receptance import SMALLEST_FACE, RelativeReceptance
from rom.cyclic.reduced_model import Array, ComplexArray, ReducedModel, expand_to_mesh
from rom.cyclic.sector_modes import FELT, RIGID_IN_WAVE, RingModes, unfit_mass
from rom.linear_algebra.threads import one_blas_thread

SHAPES = 30  # modes with contact springs between which these forces act, or twice as many as asked for


def coupled_frequencies(
    modal: RingModes,
    phase: float,
    *,
    normal: ArrayLike = 0.0,
    tangential: ArrayLike = 0.0,
    highest: float = np.inf,
) -> Array:
    """Undamped natural frequencies with linear contact springs, from the modes with free contacts.

    `phase`: inter-blade phase angle, rad; `normal`, `tangential` (n_c,): contact springs kn, kt of the nodes, N/m.
    Returns (m,): natural frequencies in rad/s, ascending; with `highest` perhaps none above it.
    """
    springs = contact_springs(modal.n_contacts, normal, tangential)
    modal = modal.at_phase(phase)
    if not springs.any():
        return modal.angular_frequency[modal.floating :]
    relative = relative_contact_motion(modal.right, modal.left, phase)
    few = (
        modal.angular_frequency[0] > 0.0
        and 8 * np.count_nonzero(modal.angular_frequency <= highest) < modal.angular_frequency.size
    )
    if few and 3 * modal.n_contacts >= SMALLEST_FACE:
        found = supported_frequencies(modal.angular_frequency, relative, springs, highest)
        if found is not None:
            return found
    squared = np.linalg.eigvalsh(np.diag(modal.angular_frequency**2) + spring_stiffness(relative, springs))
    # bodies that slide without friction float
    return np.sqrt(squared[squared > RIGID_IN_WAVE * squared[-1]] if modal.floating else squared)


def linear_response(
    modal: RingModes,
    frequency_hz: Sequence[float] | Array,
    *,
    phase: float,
    force: float,
    normal: ArrayLike = 0.0,
    tangential: ArrayLike = 0.0,
    output: str = "tip",
    harmonic: int = 1,
    harmonic_factors: tuple[tuple[int, complex], ...] = (),
) -> ComplexArray:
    """Response of one harmonic with linear contact springs: free (no springs), sliding or stuck contacts.

    Parameters
    ----------
    modal : ModalModel or SectorModes
        The modes, with damping.
    frequency_hz : (F,) sequence of float
        Excitation frequencies, Hz.
    phase : float
        Inter-blade phase angle, rad.
    force : float
        Amplitude of the excitation, N.
    normal, tangential : float or (n_c,) array
        Contact springs kn, kt of the nodes, N/m.
    output : str
        Name of the output.
    harmonic : int
        The harmonic h of the excitation, at h times the excitation frequency.
    harmonic_factors : tuple of (int, complex)
        Harmonics of the excitation, as in `RelativeReceptance`.

    Returns
    -------
    (F,) complex array
        Amplitude of the output, m.

    Examples
    --------
    Static displacement F / k, and F / (c w) at resonance:

    >>> from rom import ReducedModel, linear_response, modal_model
    >>> n, one = np.array([[0.0], [0.0], [1.0]]), np.ones(1)
    >>> model = ReducedModel(np.eye(1), 1e6 * np.eye(1), n, np.zeros((1, 3)), one, {"tip": one})
    >>> modal = modal_model(model, damping_ratio=0.01)
    >>> abs(linear_response(modal, [0.0, 500.0 / np.pi], phase=0.0, force=2.0)).round(9).tolist()
    [2e-06, 0.0001]
    """
    springs = contact_springs(modal.n_contacts, normal, tangential).reshape(-1)
    receptance = RelativeReceptance(modal, phase, (harmonic,), force, harmonic_factors)
    omegas = 2.0 * np.pi * np.asarray(frequency_hz, dtype=float)
    contact_force = np.zeros((omegas.size, 1, springs.size), dtype=complex)
    if np.any(springs):
        free = receptance.coordinates(omegas, contact_force)[:, 0] @ receptance.modes.relative[0].T
        for index, omega in enumerate(omegas.tolist()):
            motion = SpringSupportedMotion(receptance.matrix(omega)[0] * springs).solve(free[index])
            contact_force[index, 0] = -springs * motion
    found: ComplexArray = receptance.output(output, receptance.coordinates(omegas, contact_force))[:, 0]
    return found


COUPLED_MODES = 300  # modes between which the Coriolis forces act, at most or as many as are asked for
ROUND_OFF = 1e-12  # of the highest frequency


def natural_frequencies(
    model: ReducedModel, phase: float, *, normal: ArrayLike = 0.0, tangential: ArrayLike = 0.0, count: int = 10
) -> NDArray[np.float64]:
    """Lowest natural frequencies of the ring at one inter-blade phase angle, with linear contact springs.

    They solve (K + B^H diag(k) B) phi = w^2 M phi with B = right - exp(i psi) left.

    Parameters
    ----------
    model : ReducedModel
        The reduced model.
    phase : float
        Inter-blade phase angle psi, rad.
    normal, tangential : float or (n_c,) array
        Contact springs kn, kt of the nodes, N/m. Both 0: free contacts; only normal: sliding without friction; both:
        stuck.
    count : int
        Number of frequencies.

    Returns
    -------
    (count,) array
        Natural frequencies in Hz, ascending; fewer for a smaller model.

    Raises
    ------
    ReducedModelError
        The mass is not positive definite.

    Examples
    --------
    In opposite phase the springs between the blades act with 4 kn, which here doubles the frequency:

    >>> from rom import ReducedModel, natural_frequencies
    >>> n, one = np.array([[0.0], [0.0], [1.0]]), np.ones(1)
    >>> model = ReducedModel(np.eye(1), 1e6 * np.eye(1), n, np.zeros((1, 3)), one, {"tip": one}, contact_left=n)
    >>> [natural_frequencies(model, phase, normal=0.75e6).round(3).tolist() for phase in (0.0, np.pi)]
    [[159.155], [318.31]]
    """
    return natural_modes(model, phase, normal=normal, tangential=tangential, count=count)[0]


@one_blas_thread()
def natural_modes(
    model: ReducedModel, phase: float, *, normal: ArrayLike = 0.0, tangential: ArrayLike = 0.0, count: int = 10
) -> tuple[NDArray[np.float64], NDArray[np.complex128]]:
    """Lowest natural frequencies with their mass-normalised modes in reduced coordinates.

    Returns `frequencies` (count,): natural frequencies in Hz, ascending; fewer for a smaller model; `modes` (n,
    count): reduced coordinates q of the modes, q^H M q = 1 kg.
    """
    squared, shapes = _cyclic_modes(model, phase, contact_springs(model.n_contacts, normal, tangential), count)
    return _omega(squared) / (2 * np.pi), shapes


def gyroscopic_frequencies(
    model: ReducedModel, phase: float, *, normal: ArrayLike = 0.0, tangential: ArrayLike = 0.0, count: int = 10
) -> NDArray[np.float64]:
    """Lowest natural frequencies of the ring with the Coriolis forces at the speed of the model.

    They solve (K + B^H diag(k) B + i w W G - w^2 M) phi = 0 with w > 0, waves that run with the excitation; W is the
    speed and G the Coriolis matrix. With the modes of G = 0 and the diagonal matrix w_0 of their frequencies they are
    the positive eigenvalues of the Hermitian matrix [[0, w_0], [w_0, i W phi^H G phi]], half of all.

    `phase`, `normal`, `tangential` (n_c,): inter-blade phase angle, rad, and contact springs, N/m, as in
    `natural_frequencies`. Returns (count,): natural frequencies in Hz, ascending; fewer for a smaller model.
    """
    return frequencies_without_and_with_coriolis(model, phase, (normal, tangential), count)[1]


@one_blas_thread()
def frequencies_without_and_with_coriolis(
    model: ReducedModel, phase: float, springs: tuple[ArrayLike, ArrayLike], count: int = COUPLED_MODES
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Natural frequencies, Hz, of `natural_frequencies` and of `gyroscopic_frequencies`, from one solution.

    `springs` are their normal and tangential ones. Raises ReducedModelError as they do.
    """
    from scipy.linalg import eigvalsh

    stiffness = contact_springs(model.n_contacts, *springs)
    squared, shapes = _cyclic_modes(model, phase, stiffness, max(count, COUPLED_MODES))
    omega = _omega(squared)
    still = np.diag(omega)
    turning = 1j * coriolis_forces(model, shapes)
    values = eigvalsh(np.block([[np.zeros_like(still), still], [still, turning]]))[len(still) :]
    values[np.abs(values) <= ROUND_OFF * values[-1]] = 0.0  # rigid motions
    return omega[:count] / (2 * np.pi), values[:count] / (2 * np.pi)


def mode_shapes(
    model: ReducedModel, phase: float, *, normal: ArrayLike = 0.0, tangential: ArrayLike = 0.0, count: int = 10
) -> tuple[NDArray[np.float64], NDArray[np.complex128]]:
    """Lowest natural frequencies with their mass-normalised mode shapes on the mesh.

    Blade j moves with shape * exp(i j psi), rotated by j pitches.

    `normal`, `tangential` (n_c,): contact springs, N/m, as in `natural_frequencies`. Returns `frequencies` (count,):
    natural frequencies in Hz, ascending; `shapes` (count, n_nodes, 3): mode shapes of the mesh nodes.
    """
    frequency, modes = natural_modes(model, phase, normal=normal, tangential=tangential, count=count)
    return frequency, expand_to_mesh(model, modes.T)


def _omega(squared: NDArray[np.float64]) -> NDArray[np.float64]:
    """Angular frequencies, rad/s, of their squares; 0 where round-off has made a square negative."""
    return np.sqrt(np.maximum(squared, 0.0))


def _cyclic_modes(
    model: ReducedModel, phase: float, springs: NDArray[np.float64], count: int
) -> tuple[NDArray[np.float64], NDArray[np.complex128]]:
    """Lowest eigenvalues (count,) [(rad/s)^2] and mass-normalised vectors (n, count) with springs (n_c, 3) N/m.

    Rigid motions of bodies that only contacts hold are left out.
    """
    from scipy.linalg import LinAlgError, eigh

    wave, motion = model.wave(phase), relative_contact_motion(model.contact_right, model.contact_left, phase)
    stiffness: NDArray[Any] = model.stiffness
    mass: NDArray[Any] = model.mass
    if wave is not None:
        stiffness, mass, motion = in_wave(stiffness, wave), in_wave(mass, wave), motion @ wave
    stiffness = stiffness + spring_stiffness(motion, springs)
    own = np.diag(mass).real
    with np.errstate(over="ignore"):  # mass is not positive definite then
        still = np.divide(np.diag(stiffness).real, own, np.zeros(own.size), where=own > 0.0).max() * RIGID_IN_WAVE
    held = motion if wave is None else motion[_in_sector(model)]  # a disk that nothing holds moves all of its sector
    reach, rows, floating = FELT * float(np.abs(motion).max(initial=0.0)), len(mass), 0
    while True:
        last = min(count + floating, rows) - 1
        try:
            squared, shapes = eigh(stiffness, mass, subset_by_index=(0, last))
        except LinAlgError:
            raise unfit_mass(mass, stiffness) from None
        felt = np.abs(held @ shapes).max(axis=0, initial=0.0) > reach * np.abs(shapes).max(axis=0)
        elastic = ~((squared < still) & felt)
        if np.count_nonzero(elastic) >= count or last + 1 == rows:
            break
        floating += count - int(np.count_nonzero(elastic))
    squared, shapes = squared[elastic], shapes[:, elastic]
    return squared, shapes if wave is None else wave @ shapes


def _in_sector(model: ReducedModel) -> NDArray[np.bool_]:
    """Rows (3 n_c,) of contact nodes that do not touch the next blade."""
    left = model.contact_left
    if left is None:
        return np.ones(3 * model.n_contacts, dtype=bool)
    return np.repeat(~left.reshape(model.n_contacts, -1).any(axis=1), 3)


def aeroelastic_modes(
    model: ReducedModel,
    modal: RingModes,
    nodal_diameter: int,
    *,
    normal: ArrayLike = 0.0,
    tangential: ArrayLike = 0.0,
    count: int = 10,
) -> ComplexArray:
    """Eigenvalues of a wave with its aerodynamic, damping and Coriolis forces, as far as these are known.

    `nodal_diameter`: n of any sign, the phase angle is 2 pi n / N_b: a wave n > 0 runs against +y, as that of an
    engine order; `normal`, `tangential` (n_c,): contact springs kn, kt of the nodes, N/m. Returns (count,): lambda,
    rad/s, of motions exp(lambda t), by ascending frequency Im lambda > 0; Re lambda > 0: flutter.
    """
    phase = inter_blade_phase(nodal_diameter, model.n_blades)
    free, springs = modal.at_phase(phase), {"normal": normal, "tangential": tangential}
    hertz, shapes = natural_modes(model, phase, count=min(max(SHAPES, 2 * count), model.size), **springs)
    # modal coordinates with free contacts, of the modes with contact springs
    share = free.shapes.conj().T @ (model.mass @ shapes)
    stiffness = np.diag((2.0 * np.pi * hertz) ** 2).astype(complex)
    damping = share.conj().T @ (free.total_damping[:, None] * share)
    if free.flow is not None:
        stiffness += share.conj().T @ (free.flow[0][:, None] * share)
    if model.has_coriolis:
        damping = damping + coriolis_forces(model, shapes)
    zero = np.zeros_like(stiffness)
    values = np.linalg.eigvals(np.block([[zero, np.eye(len(zero))], [-stiffness, -damping]]))
    values = values[values.imag > 0.0]
    return values[np.argsort(values.imag)][:count]
