"""Linear natural frequencies around a nonlinear mode: free and stuck, of its nodal diameter and of its harmonics'."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from nonlinear import ContactParameters
    from rom import RingModes

NEAR = 0.05  # relative distance at which a harmonic counts as near a mode
_COUNT = 20


@dataclass(frozen=True)
class LinearNeighbours:
    """Frequencies of one structure with its contacts."""

    modal: RingModes  # the structure with free contacts
    contact: ContactParameters  # the contact
    nodal_diameter: int  # nodal diameter of harmonic 1

    def free_hz(self, harmonic: int = 1) -> NDArray[np.float64]:
        """Natural frequencies with open contacts at the phase of a harmonic, Hz."""
        own = self.modal.at(harmonic * self.nodal_diameter)
        return np.asarray(own.angular_frequency / (2.0 * np.pi))

    def stuck_hz(self, harmonic: int = 1) -> NDArray[np.float64]:
        """Natural frequencies with stuck contacts at the phase of a harmonic, Hz."""
        from rom import coupled_frequencies

        rubs = self.contact.friction > 0.0
        found = coupled_frequencies(
            self.modal,
            harmonic * self.modal.phase(self.nodal_diameter),
            normal=self.contact.normal_stiffness,
            tangential=self.contact.tangential_stiffness * rubs,
        )
        return np.asarray(found / (2.0 * np.pi))

    def ranges(self, harmonic: int = 1) -> Iterator[tuple[int, float, float]]:
        """Number, lowest and highest frequency of the first modes between open and stuck contacts, Hz."""
        pairs = zip(self.free_hz(harmonic), self.stuck_hz(harmonic), strict=False)
        for number, (free, stuck) in enumerate(pairs, start=1):
            if number > _COUNT:
                return
            yield number, float(min(free, stuck)), float(max(free, stuck))

    def within(self, frequency_hz: float, damping: float, own: int) -> Iterator[tuple[int, float]]:
        """Other modes of the same nodal diameter, and their nearest frequency, within the half-power bandwidth."""
        for number, low, high in self.ranges():
            near = float(np.clip(frequency_hz, low, high))
            if number != own and abs(near - frequency_hz) < damping * frequency_hz:
                yield number, near

    def nearest(self, harmonic: int, frequency_hz: float) -> str:
        """The mode that a harmonic is near to, as `, near mode 3: 1250 to 1400 Hz`; empty where there is none."""
        best, said = NEAR, ""
        for number, low, high in self.ranges(harmonic):
            distance = abs(float(np.clip(frequency_hz, low, high)) / frequency_hz - 1.0)
            if distance < best:
                best, said = distance, f", near mode {number} of its nodal diameter: {low:.5g} to {high:.5g} Hz"
        return said
