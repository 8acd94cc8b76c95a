"""Which modes of a ring are integrated in time, and with which step; the other modes are a residual flexibility."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.parameters import Array
from nonlinear.time_integration.ring import Ring
from rom import contact_springs

RETENTION = 20.0  # modes up to this multiple of the excitation frequency are integrated
LEAST_STEPS = 240  # a period: error of amplitudes up to 2e-4
LARGEST_ANGLE = 0.6  # of the fastest mode of the ring with stuck contacts over a step, rad
MOST_STEPS = 50_000


class StepError(ArithmeticError):
    """The contacts are so stiff for the retained modes that a period needs too many steps.

    Examples
    --------
    With the names of the example of `forced_response`:

    >>> from dataclasses import replace
    >>> from nonlinear import Ring, RingIntegrator, StepError
    >>> stiff = replace(contact, tangential_stiffness=np.array([1e12]))
    >>> try:
    ...     RingIntegrator.of(Ring(modal, stiff, excitation), omega=1.0)
    ... except StepError as error:
    ...     print(str(error).partition("allowed: ")[2])
    50000; the contacts are stiff
    """


@dataclass(frozen=True)
class RetainedModes:
    """Modes that are integrated, w_m <= RETENTION omega; the others follow their forces at once, eta = f / w_m^2.

    Without the residual flexibility a stiff contact spring on the small mass of a node would set the step. With it
    the spring acts in series with the local flexibility of the blade.
    """

    ring: Ring  # the ring
    highest: float  # natural frequency up to which modes are integrated, rad/s

    @classmethod
    def of(cls, ring: Ring, omega: float, retention: float = RETENTION) -> "RetainedModes":
        """Choose the modes."""
        lowest = ring.modal.at(ring.excitation.engine_order).angular_frequency[0]
        return cls(ring, max(retention * omega, float(lowest)))

    def are_retained(self, angular_frequency: Array) -> NDArray[np.bool_]:
        """Whether modes of natural frequencies w (...), rad/s, are integrated."""
        chosen: NDArray[np.bool_] = angular_frequency <= self.highest
        return chosen

    def flexibility(self, angular_frequency: Array) -> Array:
        """1 / w^2 of the modes that are not integrated, 0 for the others, for natural frequencies w (...), rad/s."""
        found = np.zeros(angular_frequency.shape)
        follow = ~self.are_retained(angular_frequency)
        found[follow] = 1.0 / angular_frequency[follow] ** 2
        return found

    def fastest(self) -> float:
        """Highest natural frequency of the retained modes with all contacts stuck, rad/s.

        The springs k act in series with the residual flexibility G: (I + k G)^-1 k.
        """
        modal, contact = self.ring.modal, self.ring.contact
        springs = contact_springs(contact.n_contacts, contact.normal_stiffness, contact.tangential_stiffness)
        waves = modal.waves(self.ring.sampled_phases(), rigid=True)
        highest = 0.0
        for frequency, motion in zip(waves.angular_frequency, waves.relative, strict=True):
            chosen = self.are_retained(frequency)
            residual = (motion * self.flexibility(frequency)) @ motion.conj().T
            size = len(residual)
            series = np.linalg.solve(np.eye(size) + springs.reshape(-1, 1) * residual, np.diag(springs.reshape(-1)))
            kept = motion[:, chosen]
            stiffness = np.diag(frequency[chosen] ** 2) + kept.conj().T @ series @ kept
            highest = max(highest, float(np.linalg.eigvalsh(stiffness)[-1]))
        return math.sqrt(highest)

    def steps(self, omega: float) -> int:
        """Steps a period: enough for the fastest mode, and a multiple of the blades of the wave."""
        least = max(LEAST_STEPS, math.ceil(2.0 * math.pi * self.fastest() / (omega * LARGEST_ANGLE)))
        if least > MOST_STEPS:
            raise StepError(
                f"time integration: {least} steps a period, allowed: {MOST_STEPS}; the contacts are stiff"
            )
        blades = self.ring.wave_blades
        return blades * math.ceil(least / blades)
