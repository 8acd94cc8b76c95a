"""Lumped rings that turn: Coriolis forces of all their masses."""

from dataclasses import replace

import numpy as np
from lumped import lumped_blade
from lumped_disk import sector_with_disk

from rom import ReducedModel

SPEED = 0.08  # rad/s, a tenth of the lowest natural frequency


def turning(n_blades, disk=False, speed=SPEED, seed=3) -> ReducedModel:
    """A lumped blade, or a sector with a disk, with a skew matrix of the size of 2 M."""
    model = sector_with_disk(n_blades) if disk else lumped_blade(n_blades)
    skew = np.random.default_rng(seed).normal(size=(model.size, model.size))
    root = np.sqrt(np.diag(model.mass))
    return replace(
        model,
        coriolis=(skew - skew.T) * np.outer(root, root),
        speed_rpm=speed * 30.0 / np.pi,
        force_centrifugal=np.zeros(model.size),
    )


def circling(speed, sense=0.0) -> ReducedModel:
    """1 kg on an isotropic spring of 1 N/m against the ground, in a frame that turns; a force turns in a `sense`."""
    skew = np.array([[0.0, -2.0], [2.0, 0.0]])
    return ReducedModel(
        np.eye(2),
        (1.0 - speed**2) * np.eye(2),
        np.eye(3, 2),
        np.zeros((1, 3)),
        np.array([1.0, 1j * sense]) if sense else np.eye(2)[0],
        {"tip": np.eye(2)[0]},
        coriolis=skew,
        speed_rpm=speed * 30.0 / np.pi,
        force_centrifugal=np.zeros(2),
    )
