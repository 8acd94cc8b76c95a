"""Modes followed by their shapes: what crosses keeps its shape, what veers keeps its line."""

import numpy as np

from rom import ReducedModel
from rom.cyclic.mode_following import FollowedModes, follow_modes, modal_assurance, modes_over_diameters


def two_masses(coupling: float, spread: float, blades: int = 24) -> ReducedModel:
    """Two oscillators a blade; springs between neighbours move the first one through the second one."""
    stiffness = np.array([[1.0, coupling], [coupling, 1.0 + spread]])
    face, one = np.zeros((3, 2)), np.ones(2)
    face[2, 0] = 1.0
    return ReducedModel(np.eye(2), stiffness, face, np.zeros((1, 3)), one, {"tip": one}, face, n_blades=blades)


def followed(coupling: float) -> FollowedModes:
    return modes_over_diameters(two_masses(coupling, 0.3), range(13), normal=0.25, count=2)


def test_uncoupled_modes_cross() -> None:
    """In closed form w^2 = 1 + 4 kn sin^2(psi / 2) of the first one, 1.3 of the second one."""
    modes = followed(0.0)
    psi = 2.0 * np.pi * np.arange(13) / 24
    squared = {1: 1.0 + 1.0 * np.sin(psi / 2.0) ** 2, 2: np.full(13, 1.3)}
    for place, hz in enumerate(modes.frequency_hz):
        for number, frequency in zip(modes.lines[place], hz, strict=True):
            np.testing.assert_allclose((2.0 * np.pi * frequency) ** 2, squared[number][place], rtol=1e-12)
    assert modes.lines[0].tolist() == [1, 2]
    assert modes.lines[-1].tolist() == [2, 1]


def test_modes_that_veer_slowly_do_not_cross() -> None:
    assert (followed(0.2).lines == [1, 2]).all()


def test_phase_and_scale_of_a_shape_do_not_matter() -> None:
    random = np.random.default_rng(3)
    shapes = np.linalg.qr(random.normal(size=(6, 4)) + 1j * random.normal(size=(6, 4)))[0]
    turned = shapes * random.uniform(0.5, 2.0, 4) * np.exp(1j * random.uniform(0.0, 6.0, 4))
    np.testing.assert_allclose(modal_assurance(shapes, turned), np.eye(4), atol=1e-12)
    order = [2, 0, 3, 1]
    assert follow_modes([shapes, turned[:, order]])[1].tolist() == order
