"""Forces on single modes of the blade: what a force does to one mode and to no other."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from rom.cyclic.reduced_model import ReducedModel
from rom.errors import ReducedModelError


def with_modal_forces(
    model: ReducedModel, modal: Mapping[int, complex], *, harmonic: int = 1, added: bool = False
) -> ReducedModel:
    """A reduced model that is excited in some of its modes with free contacts.

    The force f = M sum_m a_m phi_m has the modal force a_m on the mass-normalised mode phi_m and none on the others.
    The sign of a mode is that with which the largest of its outputs, by magnitude, is positive.

    `modal`: modal forces a_m of 1 N of excitation, N / sqrt(kg), by number of the mode; 1 is the lowest.
    """
    from scipy.linalg import eigh

    if model.has_disk:
        raise ReducedModelError("excitation by modes: not with a disk, whose modes differ from wave to wave")
    wrong = [number for number in modal if not 1 <= number <= model.size]
    if wrong:
        raise ReducedModelError(f"mode {wrong[0]}: not a mode of the model, allowed: 1 to {model.size}")
    _, shapes = eigh(model.stiffness, model.mass, subset_by_index=[0, max(modal, default=1) - 1])
    given = model.force_excitation if harmonic == 1 else model.force_harmonics.get(harmonic)
    force = np.zeros(model.size, dtype=complex)
    if added and given is not None:
        force += given
    for number, amplitude in modal.items():
        shape = shapes[:, number - 1]
        outputs = [row @ shape for _, row in sorted(model.outputs.items())]
        sign = -1.0 if max(outputs, key=abs) < 0.0 else 1.0
        force += amplitude * sign * (model.mass @ shape)
    found = force if np.any(force.imag) else force.real
    if harmonic == 1:
        return replace(model, force_excitation=found)
    return replace(model, force_harmonics={**model.force_harmonics, harmonic: found})
