"""Resonances of the linear limits: frequencies that a step of the continuation must not skip."""

from dataclasses import dataclass

import numpy as np

from nonlinear.contact.parameters import Array, ContactParameters
from nonlinear.options import SolverOptions
from rom import RelativeReceptance, coupled_frequencies

HIGHEST_ORDER = 7  # highest order of superharmonic resonances; higher ones are too weak


@dataclass(frozen=True)
class Resonances:
    """Resonance frequencies in the range, rad/s, ascending."""

    # natural frequencies with the contacts free, sliding and stuck, of harmonic h of the excitation divided by h
    natural: tuple[float, ...] = ()
    all: tuple[float, ...] = ()  # these and their fractions 1/2 ... 1/H: superharmonic resonances


def find_resonances(receptance: RelativeReceptance, contact: ContactParameters, options: SolverOptions) -> Resonances:
    """The primary and superharmonic resonances of a problem."""
    kn, kt = contact.normal_stiffness, contact.tangential_stiffness
    modal, phase = receptance.modal, receptance.phase
    free, sliding, stuck = (0.0, 0.0), (kn, 0.0), (kn, kt)
    highest = HIGHEST_ORDER if isinstance(options.harmonics, str) else min(options.harmonics, HIGHEST_ORDER)
    limit = highest * options.omega_range[1]
    found = np.concatenate(
        [coupled_frequencies(modal, phase, normal=n, tangential=t, highest=limit) for n, t in (free, sliding, stuck)]
    )
    parts = np.concatenate([found / order for order in range(1, highest + 1)])
    for h in (h for h in receptance.excited_harmonics if h > 1):
        top = h * options.omega_range[1]
        own = [
            coupled_frequencies(modal, h * phase, normal=n, tangential=t, highest=top) / h
            for n, t in (free, sliding, stuck)
        ]
        found, parts = np.concatenate([found, *own]), np.concatenate([parts, *own])
    return Resonances(_inside(found, options), _inside(parts, options))


def _inside(frequencies: Array, options: SolverOptions) -> tuple[float, ...]:
    low, high = (2.0 * np.pi * limit for limit in options.frequency_hz)
    frequencies = np.unique(frequencies)
    return tuple(frequencies[(frequencies > low) & (frequencies < high)].tolist())
