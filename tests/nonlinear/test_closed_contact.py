"""Stability with stiff contacts, closed around the mean flexibility: against dense matrices and all poles."""

from dataclasses import replace

import numpy as np
import pytest
from lumped import lumped_blade

from nonlinear import ContactParameters, Excitation, SolverOptions
from nonlinear.response_solver import build_harmonic_balance
from nonlinear.stability import perturbation_pencils
from nonlinear.stability.closed_refinement import ClosedContact
from nonlinear.stability.eigenproblem import Pencil, converged
from nonlinear.stability.floquet import FloquetAnalysis
from nonlinear.stability.perturbation_pencils import LARGE, nearest_eigenvalues, series
from nonlinear.stability.point_contact import PointContact, in_harmonics
from nonlinear.stability.ring_scan import FaceScan
from nonlinear.stability.ring_stability import LinearisedContact, RingStability
from nonlinear.stability.ring_structure import NEGLIGIBLE_ACROSS, FaceFlexibility, RingStructure
from nonlinear.stability.slider_memory import MemorySampler
from rom import modal_model
from rom.cyclic.cyclic_symmetry import relative_contact_motion

N_BLADES, HARMONICS, OMEGA = 12, 2, 1.3
LAWS = ["two_sliders", "cone"]


def case(law, stiffness=60.0, seed=2):
    """Structure, point and displacement of a motion with slip and lift-off; contacts stiffer than the blade."""
    modal = modal_model(lumped_blade(N_BLADES), damping_ratio=0.02)
    contact = ContactParameters.shared(
        2, normal_stiffness=stiffness, tangential_stiffness=0.7 * stiffness, friction=0.5, interference=0.1, law=law
    )
    options = SolverOptions((0.1, 0.8), harmonics=HARMONICS)
    balance = build_harmonic_balance(modal, contact, Excitation(5, 1.0), options)
    displacement = 0.3 * np.random.default_rng(seed).normal(size=(2 * HARMONICS + 1, 2, 3))
    analysis = FloquetAnalysis.of(balance.receptance, contact)
    jacobian = balance.element.evaluate(displacement).jacobian
    point = PointContact(jacobian, OMEGA, analysis.sampler.memory(displacement))
    return RingStructure(analysis.problem, contact, N_BLADES), point, displacement


def dense_contact(point, sigma):
    """K(sigma), rows and columns (S, 3 n_c)."""
    values = in_harmonics(point.at(sigma)[0]).transpose(3, 0, 1, 4, 2)  # harmonic, node, component; twice
    size, nodes = values.shape[:2]
    result = np.zeros((size, nodes, 3, size, nodes, 3), dtype=complex)
    for node in range(nodes):
        result[:, node, :, :, node] = values[:, node]
    return result.reshape(3 * size * nodes, -1)


def of_all_harmonics(blocks):
    """Block diagonal matrix."""
    size, rows, columns = blocks.shape
    result = np.zeros((size, rows, size, columns), dtype=complex)
    result[np.arange(size), :, np.arange(size)] = blocks
    return result.reshape(size * rows, -1)


def whole_problem(structure, point, k, sigma):
    """I - G K with all modes, and nothing linearised."""
    kappa = 2.0 * np.pi * k / N_BLADES
    modes = structure.problem.modal.waves(structure.phases(np.array([kappa]))[0])
    s = OMEGA * (sigma + 1j * structure.harmonics)[:, None]
    receptance = 1.0 / (s**2 + modes.damping * s + modes.angular_frequency**2)
    flexibility = (modes.relative * receptance[:, None]) @ modes.relative.conj().transpose(0, 2, 1)
    product = of_all_harmonics(flexibility) @ dense_contact(point, sigma)
    return np.eye(len(product)) - product


def test_the_flexibility_of_the_faces_is_that_of_all_modes():
    """In every wave, near the highest frequency of a perturbation, away from resonances."""
    structure, _, _ = case("two_sliders")
    modal, contact = structure.problem.modal, structure.contact
    faces = FaceFlexibility.of(modal, contact, 2.0)
    assert 0 < faces.right.shape[1] < modal.damping.size
    s = np.array([0.9j + 0.05])
    mean = series(faces.mean, s, 1.0)[0][0]
    weights = np.sqrt(np.outer(*2 * [np.tile([21.0, 21.0, 30.0], 2)]))
    phases = np.linspace(-np.pi, np.pi, 9)[:, None]
    pencils = faces.pencils(phases, np.ones(1))
    found = pencils.flexibility(0.05 - 0.1j, 1.0)[0][:, 0]
    for phase, deviation in zip(phases[:, 0], found, strict=True):
        motion = relative_contact_motion(modal.right, modal.left, phase)
        exact = motion / (s**2 + modal.damping * s + modal.angular_frequency**2) @ motion.conj().T
        error = mean + faces.shared @ deviation @ faces.shared.T - exact
        assert np.abs(weights * error).max() < 2.0 * NEGLIGIBLE_ACROSS + 0.01 * np.abs(weights * exact).max()


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("sigma", [0.0, 0.02 + 0.3j])
def test_the_contact_closed_around_the_mean_flexibility(law, sigma):
    """K_U = U^T K (I - M K)^-1 U and the motion under contact forces, with dense matrices; M linear in sigma."""
    structure, point, _ = case(law)
    motions = structure.motions(OMEGA)
    closed = ClosedContact.of(structure.problem, motions, point)
    at_zero, change = series(motions.mean, 1j * OMEGA * structure.harmonics, OMEGA)
    contact, shared = dense_contact(point, sigma), np.kron(np.eye(structure.harmonics.size), motions.shared)
    mean = of_all_harmonics(at_zero + sigma * change)
    exact = shared.T @ contact @ np.linalg.solve(np.eye(len(mean)) - mean @ contact, shared)
    # linear in sigma too: M_0 + sigma M_1 in the inverse leaves its square
    assert closed.at(sigma)[0] == pytest.approx(exact, abs=1e-9 if sigma == 0.0 else 2e-3 * np.abs(exact).max())
    step = 1e-5
    slope = (closed.at(sigma + step)[0] - closed.at(sigma - step)[0]) / (2.0 * step)
    assert closed.at(sigma)[1] == pytest.approx(slope, abs=2e-2 * np.abs(slope).max())
    free = np.random.default_rng(1).normal(size=(structure.harmonics.size, 6)) + 0.5j
    without_change = np.eye(len(mean)) - of_all_harmonics(at_zero) @ contact
    moved = np.linalg.solve(without_change, free.ravel())
    assert closed.motion(sigma, free).ravel() == pytest.approx(moved, abs=1e-9 * np.abs(moved).max())


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("stiffness", [6.0, 60.0, 600.0])
def test_refined_exponents_solve_the_whole_problem(law, stiffness):
    """All modes, the memory not linearised: I - G K is singular, and the exponents are those with all poles."""
    structure, point, _ = case(law, stiffness)
    checked = 0
    for k in (1, 4, 6):
        problem = replace(structure.problem, kappa=2.0 * np.pi * k / N_BLADES, retention_radius=np.inf)
        every_pole = problem.eigenproblem(point.jacobian, OMEGA, point.memory)
        starts = every_pole.eigenvalues(0.1j)
        for start in starts[(np.abs(starts.imag) < 0.5) & (np.abs(starts.real) < 0.3)]:
            found = structure.refinement(point, k).converged(complex(start))
            if found is None or not found.exact:
                continue
            checked, value = checked + 1, found.value
            smallest = np.linalg.svd(whole_problem(structure, point, k, value), compute_uv=False)[-1]
            beside = np.linalg.svd(whole_problem(structure, point, k, value + 1e-3), compute_uv=False)[-1]
            assert smallest < 1e-3 * beside
            assert converged(every_pole, value).value == pytest.approx(value, abs=1e-6)
    assert checked >= 3


@pytest.mark.parametrize("law", LAWS)
def test_the_least_stable_nodal_diameter_with_stiff_contacts(law):
    """Against each nodal diameter with all poles."""
    for seed in range(2):
        structure, point, displacement = case(law, 60.0, seed)
        analysis = FloquetAnalysis(structure.problem, MemorySampler(structure.contact, HARMONICS))
        ring = RingStability(analysis, N_BLADES)
        highest = -np.inf
        for k in range(1, N_BLADES // 2 + 1):
            problem = replace(structure.problem, kappa=2.0 * np.pi * k / N_BLADES, retention_radius=np.inf)
            every_pole = problem.eigenproblem(point.jacobian, OMEGA, point.memory)
            for centre in (-0.4, -0.2, 0.0, 0.2, 0.4):
                values = every_pole.eigenvalues(1j * centre)
                near = values[(np.abs(values.imag - centre) < 0.12) & (values.real > -0.2) & (values.real < 2.0)]
                refined = [converged(every_pole, complex(value)) for value in near]
                highest = max([highest, *(one.value.real for one in refined if one and abs(one.value.imag) < 0.52)])
        found = ring.leading(LinearisedContact(displacement, point.jacobian, OMEGA))
        # what decays fast is refined as far as the sign is in doubt
        assert found.exponent.real / OMEGA == pytest.approx(highest, rel=0.2, abs=0.015)
        assert found.grows(OMEGA) == (highest > 1e-6)


def test_open_contacts_leave_the_poles_of_the_blade():
    structure, point, _ = case("two_sliders")
    open_point = PointContact(np.zeros_like(point.jacobian), OMEGA, None)
    found = FaceScan(structure).scanned(open_point).eigenvalues()
    least = structure.problem.modal.damping.min()  # 2 zeta omega
    assert found[0][0].real * OMEGA == pytest.approx(-least / 2.0, rel=1e-6)


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("sigma", [0.0, 0.02 + 0.3j])
def test_the_contact_closed_in_few_motions(law, sigma, monkeypatch):
    """With dense matrices and the mean flexibility of these motions; exponents refined with it are exact."""
    monkeypatch.setattr(perturbation_pencils, "NEGLIGIBLE_MEAN", 0.6)
    structure, point, _ = case(law, 6.0)
    motions = structure.motions(OMEGA)
    closed = ClosedContact.of(structure.problem, motions, point)
    count = motions.flexible.shape[1]
    assert motions.shared.shape[1] <= count < 6
    assert motions.flexible[:, : motions.shared.shape[1]] == pytest.approx(motions.shared)
    at_zero, change = series(motions.mean_of_flexible, 1j * OMEGA * structure.harmonics, OMEGA)
    spread = np.kron(np.eye(structure.harmonics.size), motions.flexible)
    contact, shared = dense_contact(point, sigma), np.kron(np.eye(structure.harmonics.size), motions.shared)
    mean = spread @ of_all_harmonics(at_zero + sigma * change) @ spread.T
    exact = shared.T @ contact @ np.linalg.solve(np.eye(len(mean)) - mean @ contact, shared)
    assert closed.at(sigma)[0] == pytest.approx(exact, abs=1e-9 if sigma == 0.0 else 2e-3 * np.abs(exact).max())
    found = [
        structure.refinement(point, 4).converged(start) for start in (0.02 + 0.1j, -0.05 + 0.3j, 0.1, -0.1 - 0.3j)
    ]
    exact_ones = [one.value for one in found if one is not None and one.exact]
    assert exact_ones
    for value in exact_ones:
        smallest = np.linalg.svd(whole_problem(structure, point, 4, value), compute_uv=False)[-1]
        beside = np.linalg.svd(whole_problem(structure, point, 4, value + 1e-3), compute_uv=False)[-1]
        assert smallest < 1e-3 * beside


@pytest.mark.parametrize("size", [LARGE - 1, LARGE, 80])
def test_eigenvalues_next_to_zero(size):
    """Of matrices with known eigenvalues; one of them zero."""
    random = np.random.default_rng(size)
    values = random.uniform(0.05, 4.0, (3, size)) * np.exp(1j * random.uniform(0.0, 2.0 * np.pi, (3, size)))
    values[1, 7] = 0.0
    vectors = np.eye(size) + 0.3 * random.normal(size=(3, size, size)) / np.sqrt(size)
    descriptor = np.eye(size) + 0.2j * random.normal(size=(3, size, size)) / np.sqrt(size)
    matrix = descriptor @ (vectors * values[:, None]) @ np.linalg.inv(vectors)
    found = nearest_eigenvalues(Pencil(matrix, descriptor))
    for known, all_found in zip(values, found, strict=True):
        nearest = known[np.argsort(np.abs(known))[:6]]
        assert np.abs(nearest[:, None] - all_found).min(axis=1).max() < 1e-4


def test_eigenvalues_of_an_invariant_subspace():
    """The subspace has no more dimensions: what follows is round-off."""
    matrix = np.diag(np.repeat([0.0, 1.0, 2.0], 20)).astype(complex)[None]
    found = nearest_eigenvalues(Pencil(matrix, np.eye(60, dtype=complex)[None]))
    assert [np.abs(found[0] - value).min() for value in (0.0, 1.0, 2.0)] == pytest.approx([0.0] * 3, abs=1e-9)
