"""Linear answers of a blade by which two models of it are compared: natural frequencies and receptances.

The shrouds are free, sliding (normal springs only) or stuck (all springs): the three linear limits between which a
response with friction and gaps lies.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rom.cyclic.modal_model import ModalModel, modal_model
from rom.cyclic.natural_frequencies import natural_frequencies
from rom.cyclic.receptance import RelativeReceptance
from rom.cyclic.reduced_model import ReducedModel
from rom.linear_algebra.threads import one_blas_thread

_FIRST_GUESS = 12
_BETWEEN = 7  # frequencies of a receptance spread evenly over the range, its ends among them


@dataclass(frozen=True)
class LinearOperation:
    """What a model is used for: excitation frequencies, travelling wave, damping and contact springs.

    frequency_hz: (low, high) in Hz; phase: inter-blade phase angle in rad; normal, tangential: springs (n_c,) in N/m of
    the contact nodes; damping_ratio or rayleigh as in `modal_model`.
    """

    frequency_hz: tuple[float, float]
    phase: float
    normal: NDArray[np.float64]
    tangential: NDArray[np.float64]
    damping_ratio: float | tuple[float, ...] | None = None
    rayleigh: tuple[float, float] | None = None

    def joints(self) -> dict[str, tuple[NDArray[np.float64], NDArray[np.float64]]]:
        """Normal and tangential springs (n_c,) of `free`, `sliding`, `stuck`; none twice where springs are 0."""
        none = np.zeros_like(self.normal)
        joints = {"free": (none, none)}
        if np.any(self.normal):
            joints["sliding"] = (self.normal, none)
        if np.any(self.tangential):
            joints["stuck"] = (self.normal, self.tangential)
        return joints


@dataclass(frozen=True)
class LinearResponse:
    """What one model answers with one joint.

    Attributes
    ----------
    joint : `free`, `sliding` or `stuck`.
    first_mode : number of the first natural frequency here, 1 for the lowest of all.
    natural_hz : (k,) from the first one in the range to the first one above it; infinite where the model has none.
    sample_hz : (f,) where the receptances are taken: the resonances, the ends of the range and between.
    contact : (f, 3 n_c, 3 n_c) relative motion of the contact nodes for relative forces there, m/N.
    output : (f, n_o) displacements of the outputs for 1 N of excitation, m/N.
    """

    joint: str
    first_mode: int
    natural_hz: NDArray[np.float64]
    sample_hz: NDArray[np.float64]
    contact: NDArray[np.complex128]
    output: NDArray[np.complex128]


@dataclass(frozen=True)
class LinearError:
    """Relative errors of one model's answers with one joint.

    natural_hz (k,): signed; contact and output: largest |difference| / |answer| over the sampled frequencies, in the
    spectral norm of the matrix and the length of the vector of outputs. within (k,): the frequencies in the range;
    where it holds none of any joint, the first one above it of each.
    """

    joint: str
    natural_hz: NDArray[np.float64]
    contact: float
    output: float
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
    """Answers of a model in an operation with each joint; with `like`, of the same modes at the same frequencies.

    Raises ReducedModelError when the model has no static response or its damping is refused.
    """
    damping = operation.damping_ratio
    if isinstance(damping, tuple):
        damping = damping[: model.size]  # a small model may have fewer modes than ratios are given
    modal = modal_model(model, damping_ratio=damping, rayleigh=operation.rayleigh)
    answers = []
    for index, (joint, (normal, tangential)) in enumerate(operation.joints().items()):
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
        springs = np.column_stack([tangential, tangential, normal]).ravel()
        contact, output = _receptances(modal, operation.phase, springs, samples)
        answers.append(LinearResponse(joint, first, natural, samples, contact, output))
    return tuple(answers)


def linear_errors(
    found: Sequence[LinearResponse], exact: Sequence[LinearResponse], frequency: tuple[float, float]
) -> tuple[LinearError, ...]:
    """Errors of answers that were `found` like the `exact` ones; frequency: the range (low, high) in Hz."""
    low, high = frequency
    within = [(answer.natural_hz >= low) & (answer.natural_hz <= high) for answer in exact]
    if not any(inside.any() for inside in within):
        for inside in within:
            inside[0] = True
    return tuple(_error(*each) for each in zip(found, exact, within, strict=True))


def _error(found: LinearResponse, exact: LinearResponse, within: NDArray[np.bool_]) -> LinearError:
    contact = np.linalg.norm(found.contact - exact.contact, 2, axis=(1, 2)) / np.linalg.norm(
        exact.contact, 2, axis=(1, 2)
    )
    output = np.linalg.norm(found.output - exact.output, axis=1) / np.linalg.norm(exact.output, axis=1)
    return LinearError(
        joint=exact.joint,
        natural_hz=found.natural_hz / exact.natural_hz - 1.0,
        contact=float(np.max(contact)),
        output=float(np.max(output)),
        within=within,
    )


def _natural_beyond(
    model: ReducedModel, operation: LinearOperation, normal: NDArray[np.float64], tangential: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Natural frequencies in Hz from the lowest to one above the range at least, or all there are."""
    count = _FIRST_GUESS
    while True:
        every = natural_frequencies(model, operation.phase, normal=normal, tangential=tangential, count=count)
        if every[-1] > operation.frequency_hz[1] or count >= model.size:
            return every
        count *= 2


def _in_and_above(every: NDArray[np.float64], frequency: tuple[float, float]) -> tuple[int, NDArray[np.float64]]:
    """Number of the first natural frequency in or above the range, and all up to the first one above it."""
    low, high = frequency
    first = min(int(np.searchsorted(every, low)), len(every) - 1)
    last = int(np.searchsorted(every, high, side="right"))
    return first + 1, every[first : last + 1]


def _samples(natural: NDArray[np.float64], frequency: tuple[float, float]) -> NDArray[np.float64]:
    """Frequencies (f,) at which receptances are compared: at a resonance a shifted frequency shows most."""
    low, high = frequency
    resonances = natural[(natural >= low) & (natural <= high)]
    return np.unique(np.concatenate([np.linspace(low, high, _BETWEEN), resonances]))


def _receptances(
    modal: ModalModel, phase: float, springs: NDArray[np.float64], sample_hz: NDArray[np.float64]
) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
    """Contact (f, 3 n_c, 3 n_c) and output (f, n_o) receptances with springs (3 n_c,): (I + G k)^-1 G and so on."""
    receptance = RelativeReceptance(modal, phase, (1,), 1.0)
    outputs = np.stack([modal.outputs[name] for name in sorted(modal.outputs)])
    size = len(springs)
    contact = np.empty((len(sample_hz), size, size), dtype=complex)
    output = np.empty((len(sample_hz), len(outputs)), dtype=complex)
    none = np.zeros((1, size), dtype=complex)
    for index, hertz in enumerate(sample_hz):
        omega = 2.0 * np.pi * hertz
        free = receptance.matrix(omega)[0]
        moved, _ = receptance.response(omega, none)
        solved = np.linalg.solve(np.eye(size) + free * springs, np.column_stack([free, moved[0]]))
        contact[index] = solved[:, :-1]
        coordinates, _ = receptance.modal_response(omega, np.asarray(-springs * solved[:, -1], dtype=complex)[None])
        output[index] = outputs @ coordinates[0]
    return contact, output
