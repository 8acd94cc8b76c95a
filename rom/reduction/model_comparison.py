"""Linear responses by which two models of a blade are compared: natural frequencies and receptances.

The contacts are free, sliding (normal springs only) or stuck (all springs): the three linear limits between which a
response with friction and gaps lies.
What leaving out the Coriolis forces costs is the change of the natural frequencies.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rom.cyclic.contact_springs import SpringSupportedMotion, contact_springs
from rom.cyclic.natural_frequencies import frequencies_without_and_with_coriolis, natural_frequencies
from rom.cyclic.receptance import RelativeReceptance
from rom.cyclic.reduced_model import ReducedModel
from rom.cyclic.sector_modes import RingModes, modal_model
from rom.linear_algebra.threads import one_blas_thread

COMPARED_OUTPUTS = ("tip", "tip_x", "tip_y", "tip_z")  # displacements; others may have another unit
_FIRST_GUESS = 12
_BETWEEN = 7  # frequencies of a receptance spread evenly over the range, its ends among them


@dataclass(frozen=True)
class LinearOperation:
    """Operating conditions in which linear models are compared."""

    frequency_hz: tuple[float, float]  # range (low, high) of the excitation frequency, Hz
    phase: float  # inter-blade phase angle, rad
    # normal, tangential (n_c,): contact springs of the nodes, N/m
    normal: NDArray[np.float64]
    tangential: NDArray[np.float64]
    damping_ratio: float | tuple[float, ...] | None = None  # as in `modal_model`
    rayleigh: tuple[float, float] | None = None  # as in `modal_model`

    def contact_conditions(self) -> dict[str, tuple[NDArray[np.float64], NDArray[np.float64]]]:
        """Normal and tangential springs (n_c,) of the contact conditions `free`, `sliding` and `stuck`.

        A condition without springs of its own, the same as another one, is left out.
        """
        none = np.zeros_like(self.normal)
        conditions = {"free": (none, none)}
        if np.any(self.normal):
            conditions["sliding"] = (self.normal, none)
        if np.any(self.tangential):
            conditions["stuck"] = (self.normal, self.tangential)
        return conditions


@dataclass(frozen=True)
class LinearResponse:
    """Natural frequencies and receptances of one model in one contact condition."""

    condition: str  # contact condition: `free`, `sliding` or `stuck`
    first_mode: int  # number of the first frequency in `natural_hz`, 1 for the lowest of all
    # (k,) natural frequencies from the first one in the range to the first one above it; infinite where the model has
    # none
    natural_hz: NDArray[np.float64]
    # (f,) frequencies of the receptances: the resonances, the ends of the range and some between
    sample_hz: NDArray[np.float64]
    # (f, 3 n_c, 3 n_c) relative displacement of the contact nodes for relative forces there, m/N
    contact: NDArray[np.complex128]
    output: NDArray[np.complex128]  # (f, n_o) displacements of the outputs for 1 N of excitation, m/N


@dataclass(frozen=True)
class LinearError:
    """Relative errors of one model in one contact condition."""

    condition: str  # contact condition: `free`, `sliding` or `stuck`
    natural_hz: NDArray[np.float64]  # (k,) signed errors of the natural frequencies
    # contact, output: largest relative error of the receptances over the sampled frequencies, in the spectral norm of
    # the matrix and the length of the vector of outputs
    contact: float
    output: float
    # (k,) which natural frequencies lie in the range; where it holds none in any condition, the first one above it
    within: NDArray[np.bool_]

    @property
    def frequency(self) -> float:
        """Largest error of a natural frequency that is `within`, 0 without any."""
        return float(np.max(np.abs(self.natural_hz[self.within]), initial=0.0))

    @property
    def worst(self) -> float:
        """Largest error of all."""
        return max(self.frequency, self.contact, self.output)


@one_blas_thread()
def linear_responses(
    model: ReducedModel, operation: LinearOperation, like: Sequence[LinearResponse] | None = None
) -> tuple[LinearResponse, ...]:
    """Linear responses of a model in each contact condition of an operation."""
    damping = operation.damping_ratio
    if isinstance(damping, tuple):
        damping = damping[: model.size]  # a small model may have fewer modes than ratios are given
    modal = modal_model(model, damping_ratio=damping, rayleigh=operation.rayleigh)
    responses = []
    for index, (condition, (normal, tangential)) in enumerate(operation.contact_conditions().items()):
        if like is None:
            every = _natural_beyond(model, operation, normal, tangential)
            first, natural = _in_and_above(every, operation.frequency_hz)
            samples = _samples(natural, operation.frequency_hz)
        else:
            first, samples = like[index].first_mode, like[index].sample_hz
            natural = np.full(len(like[index].natural_hz), np.inf)
            last = min(first - 1 + len(natural), model.size)
            every = natural_frequencies(model, operation.phase, normal=normal, tangential=tangential, count=last)
            found = every[first - 1 :]
            natural[: len(found)] = found
        springs = contact_springs(model.n_contacts, normal, tangential).reshape(-1)
        contact, output = _receptances(modal, operation.phase, springs, samples)
        responses.append(LinearResponse(condition, first, natural, samples, contact, output))
    return tuple(responses)


def linear_errors(
    found: Sequence[LinearResponse], exact: Sequence[LinearResponse], frequency_hz: tuple[float, float]
) -> tuple[LinearError, ...]:
    """Errors of linear responses against exact ones."""
    low, high = frequency_hz
    within = [(response.natural_hz >= low) & (response.natural_hz <= high) for response in exact]
    if not any(inside.any() for inside in within):
        for inside in within:
            inside[0] = True
    return tuple(_error(*each) for each in zip(found, exact, within, strict=True))


def _error(found: LinearResponse, exact: LinearResponse, within: NDArray[np.bool_]) -> LinearError:
    contact = np.linalg.norm(found.contact - exact.contact, 2, axis=(1, 2)) / np.linalg.norm(
        exact.contact, 2, axis=(1, 2)
    )
    size = np.maximum(np.linalg.norm(exact.output, axis=1), 1e-300)  # 0 without a force
    output = np.linalg.norm(found.output - exact.output, axis=1) / size
    return LinearError(
        condition=exact.condition,
        natural_hz=found.natural_hz / exact.natural_hz - 1.0,
        contact=float(np.max(contact)),
        output=float(np.max(output)),
        within=within,
    )


def _natural_beyond(
    model: ReducedModel, operation: LinearOperation, normal: NDArray[np.float64], tangential: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Natural frequencies in Hz from the lowest to at least one above the range, or all there are."""
    count = _FIRST_GUESS
    while True:
        every = natural_frequencies(model, operation.phase, normal=normal, tangential=tangential, count=count)
        if every[-1] > operation.frequency_hz[1] or count >= model.size:
            return every
        count *= 2


def _in_and_above(every: NDArray[np.float64], frequency_hz: tuple[float, float]) -> tuple[int, NDArray[np.float64]]:
    """Number of the first natural frequency in or above the range, and all up to the first one above it."""
    low, high = frequency_hz
    first = min(int(np.searchsorted(every, low)), len(every) - 1)
    last = int(np.searchsorted(every, high, side="right"))
    return first + 1, every[first : last + 1]


def _samples(natural: NDArray[np.float64], frequency_hz: tuple[float, float]) -> NDArray[np.float64]:
    """Frequencies (f,) of the receptances: a shifted natural frequency shows most at its resonance."""
    low, high = frequency_hz
    resonances = natural[(natural >= low) & (natural <= high)]
    return np.unique(np.concatenate([np.linspace(low, high, _BETWEEN), resonances]))


def _receptances(
    modal: RingModes, phase: float, springs: NDArray[np.float64], sample_hz: NDArray[np.float64]
) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
    """Contact receptance (I + G k)^-1 G (f, 3 n_c, 3 n_c) and outputs (f, n_o) for 1 N with springs k (3 n_c,)."""
    receptance = RelativeReceptance(modal, phase, (1,), 1.0)
    outputs = [name for name in sorted(modal.output_names) if name in COMPARED_OUTPUTS]
    size = len(springs)
    contact = np.empty((len(sample_hz), size, size), dtype=complex)
    output = np.empty((len(sample_hz), len(outputs)), dtype=complex)
    none = np.zeros((1, size), dtype=complex)
    for index, hertz in enumerate(sample_hz):
        omega = 2.0 * np.pi * hertz
        free = receptance.matrix(omega)[0]
        linear, _ = receptance.response(omega, none)
        displacement = SpringSupportedMotion(free * springs).solve(np.column_stack([free, linear[0]]))
        contact[index] = displacement[:, :-1]
        contact_force = np.asarray(-springs * displacement[:, -1], dtype=complex)
        coordinates, _ = receptance.modal_response(omega, contact_force[None])
        output[index] = [receptance.output(name, coordinates)[0] for name in outputs]
    return contact, output


def coriolis_error(model: ReducedModel, operation: LinearOperation) -> float | None:
    """Largest relative change of a natural frequency in the range by the Coriolis forces, in any contact condition.

    Returns the change, that of the first frequency above the range where the range holds none, 0 at rest; None where
    the model does not say its speed or has no Coriolis matrix.
    """
    if model.speed_rpm == 0.0:
        return 0.0
    if model.speed_rpm is None or model.coriolis is None:
        return None
    low, high = operation.frequency_hz
    inside: list[float] = []
    above: list[float] = []
    for normal, tangential in operation.contact_conditions().values():
        without, found = frequencies_without_and_with_coriolis(model, operation.phase, (normal, tangential))
        change = np.abs(found / without - 1.0)
        first, last = np.searchsorted(without, low), np.searchsorted(without, high, side="right")
        inside.extend(change[first:last])
        above.extend(change[last : last + 1])
    return float(max(inside or above, default=0.0))
