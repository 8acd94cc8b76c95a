"""The bordered Jacobian in interface modes against dense matrices of the full size."""

import numpy as np
import pytest
from lumped import lumped_blade

from nonlinear import ContactParameters, Excitation, SolverOptions
from nonlinear.harmonic_balance.condensed_factors import ContactStiffness
from nonlinear.response_solver import build_harmonic_balance
from rom import modal_model


def linearised(stiffness, method="coupled", normal=1.0, seed=0, omega=1.07):
    modal = modal_model(lumped_blade(12, 6), damping_ratio=0.002)
    contact = ContactParameters.shared(
        6,
        normal_stiffness=normal * stiffness,
        tangential_stiffness=stiffness,
        friction=0.5,
        preload=0.0 if normal else 0.2,
        interference=0.1,
    )
    options = SolverOptions((0.1, 0.7), harmonics=9, method=method)
    balance = build_harmonic_balance(modal, contact, Excitation(4, 1.0), options)
    x = np.random.default_rng(seed).normal(size=balance.size)
    if balance.odd:
        rows = np.zeros((19, 18))
        rows[balance.first_row :] = x.reshape(-1, 18)
        rows[3::4] = rows[4::4] = 0.0
        x = rows[balance.first_row :].reshape(-1)
    return balance.evaluate(x, omega)


def random_border(size, seed):
    rng = np.random.default_rng(seed)
    column, row = rng.normal(size=(2, size)) / np.sqrt(size)
    return column, row, float(rng.normal())


@pytest.mark.parametrize("method", ["coupled", "static-first"])
@pytest.mark.parametrize("normal", [1.0, 0.0])  # without normal stiffness there are no even harmonics
@pytest.mark.parametrize("stiffness", [0.05, 0.15])
def test_solutions_and_signs_are_those_of_the_full_matrix(stiffness, normal, method):
    """Random states and borders, near the resonance at 1 rad/s: where det changes its sign and where it does not."""
    signs, condensed = [], 0
    for seed in range(8):
        state = linearised(stiffness, method, normal, seed)
        size = state.residual.size
        column, row, corner = random_border(size, seed)
        factors = state.factorise(column, row, corner)
        condensed += factors.contracts
        matrix = np.block([[state.jacobian, column[:, None]], [row, corner]])
        right = np.random.default_rng(seed + 100).normal(size=size + 1)
        expected = np.linalg.solve(matrix, right)
        found, last = factors.solve(right[:-1], right[-1])
        error = np.linalg.norm(np.append(found, last) - expected) / np.linalg.norm(expected)
        assert error < 1e-15 * np.linalg.cond(matrix) + 1e-14
        assert factors.sign == np.linalg.slogdet(matrix)[0]
        assert state.solve(right[:-1]) == pytest.approx(
            np.linalg.solve(state.jacobian, right[:-1]), rel=1e-8, abs=1e-9
        )
        signs.append(factors.sign)
    assert len(set(signs)) == 2
    assert condensed >= 6  # a state near a singular one has dense factors


@pytest.mark.parametrize(("stiffness", "contracts"), [(40.0, True), (4000.0, False)])
def test_stiff_contacts_are_condensed_while_the_iteration_converges(stiffness, contracts):
    """The iteration matrix is far from normal there: its norm is above 1, its eigenvalues are below."""
    for seed in range(3):
        state = linearised(stiffness, seed=seed)
        column, row, corner = random_border(state.residual.size, seed + 1)
        factors = state.factorise(column, row, corner)
        matrix = np.block([[state.jacobian, column[:, None]], [row, corner]])
        found, last = factors.solve(-column, 0.5)
        expected = np.linalg.solve(matrix, np.append(-column, 0.5))
        assert np.append(found, last) == pytest.approx(expected, abs=1e-8 * np.linalg.norm(expected))
        assert factors.sign == np.linalg.slogdet(matrix)[0]
        assert factors.contracts == contracts
        if contracts:
            iteration = iteration_matrix(factors, matrix)
            assert np.linalg.norm(iteration, 2) > 1.0 > np.abs(np.linalg.eigvals(iteration)).max()


def iteration_matrix(factors, matrix):
    """M = I - P^-1 B, with P^-1 column by column."""
    images, last = factors._condensed_solution(matrix[:-1], matrix[-1])
    return np.eye(len(matrix)) - np.vstack([images, last])


def test_stiffness_of_the_nodes_is_the_force_jacobian():
    state = linearised(1.0)
    x = np.random.default_rng(3).normal(size=(19, 18, 2))
    expected = np.einsum("kabij,jkbq->ikaq", state.contact.jacobian, x.reshape(19, 6, 3, 2)).reshape(19, 18, 2)
    assert ContactStiffness.of(state.contact.jacobian, 0, False).times(x) == pytest.approx(expected, abs=1e-12)


def test_interface_modes_hold_the_receptance_in_the_whole_band():
    """Outside them it is at most twice the geometric mean of the largest and the first neglected bound."""
    state = linearised(1.0)
    receptance = state.balance.receptance
    modes, values = receptance.interface_modes(1.0)
    for omega in np.linspace(1.0, 2.0**0.25, 7)[:-1]:
        matrix = receptance.matrix(omega)
        for h in range(10):
            for count in (1, 4, 9):
                q = modes[h, :, :count]
                inside = q @ (q.conj().T @ matrix[h] @ q) @ q.conj().T
                outside = np.linalg.norm(matrix[h] - inside, 2)
                assert outside <= 2.001 * np.sqrt(values[h, 0] * values[h, count])
