"""Eigenvalues of waves with aerodynamic influence coefficients, against closed forms and the whole ring."""

from dataclasses import replace

import numpy as np
import pytest
from lumped import lumped_blade
from lumped_disk import sector_with_disk

from rom import InfluenceCoefficients, modal_model
from rom.cyclic.natural_frequencies import aeroelastic_modes, gyroscopic_frequencies

N = 6
SPRINGS = {"normal": 5.0, "tangential": 3.0}
FLOW = InfluenceCoefficients(2, np.array([-1, 0, 1]), np.array([0.02 - 0.01j, -0.01 - 0.02j, -0.03 + 0.04j]))


@pytest.mark.parametrize("model", [lumped_blade(N), sector_with_disk(N)], ids=["blade", "disk"])
def test_no_flow_leaves_the_damped_modes(model):
    modal = modal_model(model, damping_ratio=0.01)
    for n in (0, 2, -1):
        own = modal.at(n)
        values = aeroelastic_modes(model, modal, n, count=3)
        omega = own.angular_frequency[:3]
        assert values == pytest.approx(omega * (-0.01 + 1j * np.sqrt(1.0 - 1e-4)), rel=1e-8)


def test_two_neighbours_add_a_sine_over_the_nodal_diameter():
    """Closed form: Im C(psi) of the family alone, and nothing of the others."""
    model = lumped_blade(N)
    flow = InfluenceCoefficients(2, np.array([-1, 0, 1]), np.array([-1e-6, -3e-6j, 1e-6]))
    modal = modal_model(model, damping_ratio=0.0, influence=[flow])
    omega = modal.angular_frequency[1]
    for n in range(-2, 4):
        values = aeroelastic_modes(model, modal, n, count=3)
        psi = 2.0 * np.pi * n / N
        assert values[1] == pytest.approx(1j * omega + omega * 1e-6 * (np.sin(psi) - 1.5), rel=1e-11)
        assert values[[0, 2]].real == pytest.approx(0.0, abs=1e-13)


def test_waves_are_those_of_the_whole_ring_with_springs_and_dashpots():
    """All blades in one structure with stuck contacts, the flow between them as real matrices: its eigenvalues."""
    model = lumped_blade(N)
    modal = modal_model(model, damping_ratio=0.02, influence=[FLOW])
    every = np.eye(N)
    count, omega = model.size, modal.angular_frequency[1]
    family = np.outer(model.mass @ modal.shapes[:, 1], model.mass @ modal.shapes[:, 1])
    inner = model.mass @ modal.shapes @ np.diag(modal.damping) @ modal.shapes.T @ model.mass
    stiffness, damping = np.kron(every, model.stiffness), np.kron(every, inner)
    for place, value in zip(FLOW.offset, FLOW.coefficient, strict=True):
        at = np.roll(every, place, axis=1)  # row j: one at j + l
        stiffness -= omega**2 * value.real * np.kron(at, family)
        damping -= omega * value.imag * np.kron(at, family)
    springs = np.tile([SPRINGS["tangential"], SPRINGS["tangential"], SPRINGS["normal"]], 2)
    for j in range(N):
        motion = np.kron(every[j], model.contact_right) - np.kron(every[(j + 1) % N], model.contact_left)
        stiffness += motion.T @ (springs[:, None] * motion)
    mass = np.linalg.inv(np.kron(every, model.mass))
    size = N * count
    whole = np.linalg.eigvals(
        np.block([[np.zeros((size, size)), np.eye(size)], [-mass @ stiffness, -mass @ damping]])
    )
    for n in range(-2, 4):
        for value in aeroelastic_modes(model, modal, n, count=4, **SPRINGS):
            assert np.abs(whole - value).min() < 1e-9


def test_values_of_waves_are_given_back():
    values = np.random.default_rng(3).normal(size=N) + 1j * np.random.default_rng(4).normal(size=N)
    flow = InfluenceCoefficients.of_waves(1, values)
    assert flow.in_wave(2.0 * np.pi * np.arange(N) / N) == pytest.approx(values, abs=1e-12)


def test_coriolis_forces_part_forward_and_backward_waves():
    rng = np.random.default_rng(5)
    model = lumped_blade(N)
    square = rng.normal(size=(model.size, model.size))
    turning = replace(
        model, coriolis=1e-2 * (square - square.T), speed_rpm=2.0, force_centrifugal=np.zeros(model.size)
    )
    modal = modal_model(turning, damping_ratio=0.0)
    for n in (1, -1):
        values = aeroelastic_modes(turning, modal, n, count=4, **SPRINGS)
        hertz = gyroscopic_frequencies(turning, 2.0 * np.pi * n / N, count=4, **SPRINGS)
        assert values.imag / (2.0 * np.pi) == pytest.approx(hertz, rel=1e-9)
        assert values.real == pytest.approx(0.0, abs=1e-12)
