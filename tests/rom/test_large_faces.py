"""Large contact faces: the receptance by a power series against the sum over all modes."""

import numpy as np
import pytest

from rom import ModalModel
from rom.cyclic.natural_frequencies import coupled_frequencies
from rom.cyclic.receptance import SMALLEST_FACE, RelativeReceptance

N_CONTACTS, N_MODES = 55, 240


@pytest.fixture(scope="module")
def modal() -> ModalModel:
    """Some modes near 1 rad/s and many far above, as a reduced model with many boundary dofs has them."""
    rng = np.random.default_rng(5)
    frequency = np.sort(np.concatenate([[0.3, 0.9, 1.1, 2.6, 7.0], 10.0 ** rng.uniform(1.0, 4.5, N_MODES - 5)]))
    return ModalModel(
        angular_frequency=frequency,
        damping=0.006 * frequency * rng.uniform(0.5, 2.0, N_MODES),
        right=rng.normal(size=(3 * N_CONTACTS, N_MODES)),
        left=rng.normal(size=(3 * N_CONTACTS, N_MODES)),
        force=rng.normal(size=N_MODES),
        static_force=rng.normal(size=N_MODES),
        outputs={"tip": rng.normal(size=N_MODES)},
        shapes=np.eye(N_MODES),
        position=np.zeros((N_CONTACTS, 3)),
        area=None,
        n_blades=12,
    )


def modal_sum(modal: ModalModel, phase: float, h: int, omega: float) -> np.ndarray:
    """G by its definition."""
    motion = modal.right - modal.left * np.exp(1j * h * phase)
    x = h * omega
    return (motion / (modal.angular_frequency**2 + 1j * modal.damping * x - x**2)) @ motion.conj().T


@pytest.mark.parametrize("omega", [0.0, 0.8999, 1.0, 1.1, 2.0, 3.3])
def test_matrix_and_response_are_those_of_all_modes(modal: ModalModel, omega: float) -> None:
    assert 3 * modal.n_contacts >= SMALLEST_FACE
    phase, harmonics = 0.7, (0, 1, 2, 5)
    receptance = RelativeReceptance(modal, phase, harmonics, 2.0)
    expected = np.array([modal_sum(modal, phase, h, omega) for h in harmonics])
    matrix = receptance.matrix(omega)
    for found, wanted in zip(matrix, expected, strict=True):
        assert np.linalg.norm(found - wanted) < 1e-12 * np.linalg.norm(wanted)  # sums over all modes
    rng = np.random.default_rng(1)
    force = rng.normal(size=(4, 3 * N_CONTACTS)) + 1j * rng.normal(size=(4, 3 * N_CONTACTS))
    force[0] = force[0].real
    response, derivative = receptance.response(omega, force)
    free, _ = receptance.response(omega, np.zeros_like(force))
    assert response - free == pytest.approx((expected @ force[..., None])[..., 0], rel=1e-10, abs=1e-9)
    step = 1e-6 * max(omega, 1.0)
    ahead, behind = (receptance.response(omega + shift, force)[0] for shift in (step, -step))
    assert derivative == pytest.approx((ahead - behind) / (2.0 * step), rel=1e-5, abs=1e-4 * np.abs(derivative).max())


@pytest.mark.parametrize(("normal", "tangential"), [(0.02, 0.0), (0.02, 0.03), (50.0, 30.0)])
@pytest.mark.parametrize("highest", [3.0, 11.0, 70.0])
def test_frequencies_with_springs_are_the_lowest_of_all(
    modal: ModalModel, normal: float, tangential: float, highest: float
) -> None:
    springs = {"normal": normal, "tangential": tangential}
    every = coupled_frequencies(modal, 0.7, **springs)
    found = coupled_frequencies(modal, 0.7, **springs, highest=highest)
    assert every.size == N_MODES
    # to round-off of the highest of all
    assert found[found <= highest] == pytest.approx(every[every <= highest], rel=1e-7)
