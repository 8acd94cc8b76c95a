"""Mistuned rings in a flow and with Coriolis forces, against all blades in physical matrices and the tuned ring."""

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from lumped_disk import sector_places
from turning import SPEED, turning

from nonlinear import ContactParameters, Excitation, SolverOptions, forced_response
from nonlinear.contact.element_choice import contact_element
from nonlinear.contact.fourier import to_complex, to_real
from nonlinear.harmonic_balance.initial_solution import solve_at
from nonlinear.mistuned_ring import sector_ring as ring_of_sectors
from nonlinear.mistuned_ring.linear_contacts import blade_strain, strain_directions
from nonlinear.mistuned_ring.linear_sectors import LinearSectors
from nonlinear.mistuned_ring.mistuned_curve import mistuned_curve
from nonlinear.mistuned_ring.mistuning import Mistuning
from nonlinear.mistuned_ring.ring_balance import RingBalance
from nonlinear.mistuned_ring.ring_receptance import RingReceptance
from nonlinear.mistuned_ring.ring_response import mistuned_response
from nonlinear.mistuned_ring.sector_ring import SectorRing
from rom import InfluenceCoefficients, modal_model
from rom.cyclic.natural_frequencies import aeroelastic_modes
from rom.cyclic.receptance import RelativeReceptance

N, EO = 5, 2
FLOW = InfluenceCoefficients(2, np.array([-1, 0, 2]), np.array([0.02 - 0.01j, -0.01 - 0.02j, -0.03 + 0.02j]))
STILL = InfluenceCoefficients(2, np.array([0]), np.array([0j]))
VALUES = {"normal_stiffness": 6.0, "tangential_stiffness": 4.0, "friction": 0.3, "interference": [0.3, 0.05]}
CONTACT = ContactParameters.shared(2, **VALUES)
OPTIONS = SolverOptions((0.19, 0.2), harmonics=2, stability="folds", search="off", detached=False, truncation=False)
MISTUNING = Mistuning.sampled(N, 1, frequency=0.03, stiffness=0.05, friction=0.1, interference=0.02)
CASES = [("flow", False), ("turning", False), ("both", False), ("both", True)]
NAMES = [f"{forces}{'_disk' * disk}" for forces, disk in CASES]


@lru_cache
def problem(forces, disk):
    model = turning(N, disk)
    flow = [FLOW] * (forces in ("flow", "both"))
    return model, modal_model(model, damping_ratio=0.01, influence=flow, coriolis=forces in ("turning", "both"))


def whole_ring(model, modal, forces):
    """Mass, damping and stiffness of all blades (n, n), relative motion of their pairs, places of each."""
    disk = model.has_disk
    places = sector_places(model, N) if disk else np.eye(N * model.size).reshape(N, model.size, -1)

    def every(matrix):
        return np.einsum("jna,jnk,jkb->ab", places, np.broadcast_to(matrix, (N, *model.mass.shape)), places)

    mass, stiffness, damping = every(model.mass), every(model.stiffness), np.zeros((places.shape[2],) * 2)
    own = model.blade_stiffness if disk else model.stiffness
    stiffness += every(MISTUNING.added_stiffness[:, None, None] * own)
    if forces in ("turning", "both"):
        damping += SPEED * every(model.coriolis)
    sharing = np.diag(np.einsum("jna,jna->a", places, places))
    for n in range(N):  # inertia vectors of the modes of each wave
        own, turns = modal.at(n), np.exp(2j * np.pi * n * np.arange(N) / N) / np.sqrt(N)
        shapes = np.linalg.solve(sharing, np.einsum("j,jna,nm->am", turns, places, own.shapes))
        inertia = mass @ shapes
        damping = damping + (inertia * own.damping) @ inertia.conj().T
        if forces == "turning":
            continue
        squared, phase = own.angular_frequency[1] ** 2, 2.0 * np.pi * n / N
        share = np.exp(1j * phase * FLOW.offset)
        family = np.outer(inertia[:, 1], inertia[:, 1].conj())
        stiffness = stiffness - squared * (share @ FLOW.coefficient.real) * family
        damping = damping - own.angular_frequency[1] * (share @ FLOW.coefficient.imag) * family
    assert max(np.abs(part.imag).max() for part in (stiffness + 0j, damping + 0j)) < 1e-12
    pairs = model.contact_right @ places - model.contact_left @ np.roll(places, -1, axis=0)
    return mass, damping.real, stiffness.real, pairs.reshape(-1, places.shape[2]), places


def ring(modal, mistuning=MISTUNING, harmonics=2, strains=None):
    """The balance of the ring with some strains of its blades, or with all."""
    tuned, rows = RelativeReceptance(modal, modal.phase(EO), tuple(range(harmonics + 1)), 1.0), strains
    if rows is None:
        rows = blade_strain(modal)
        rows = np.pad(rows, ((0, -len(rows) % 3), (0, 0)))
    return RingBalance.of(SectorRing(tuned, N, rows), CONTACT, mistuning, replace(OPTIONS, harmonics=harmonics))


def in_rows(coefficients):
    """The real unknowns of complex coefficients (H+1, ...)."""
    return to_real(coefficients.reshape(len(coefficients), -1)).reshape(-1)


def with_strains(balance, omega, displacement):
    """The unknown of contact displacements (H+1, N, 6), with the strains of tuned blades."""
    whole = np.zeros((len(displacement), N, balance.pair_dofs), complex)
    whole[..., :6] = displacement
    force = balance.by_harmonic(balance.forces(in_rows(whole)).force)
    whole[..., 6:] = balance.structure.response(omega, force)[0][..., 6:]
    return in_rows(whole)


@pytest.mark.parametrize(("forces", "disk"), CASES, ids=NAMES)
def test_points_solve_the_equations_of_all_blades_in_physical_matrices(forces, disk):
    """(K - x^2 M + i x C) q = f + B^T f_c of all blades, K and C with the springs and dashpots between them."""
    model, modal = problem(forces, disk)
    curve = mistuned_response(modal, CONTACT, Excitation(EO, 1.0), OPTIONS, MISTUNING)
    assert curve.complete
    mass, damping, stiffness, pairs, places = whole_ring(model, modal, forces)
    balance, element = ring(modal), contact_element(MISTUNING.contact(CONTACT), 2, OPTIONS)
    turns = np.exp(1j * modal.phase(EO) * np.multiply.outer(np.arange(3), np.arange(N)))
    excited = np.einsum("j,n,jna->a", turns[1], model.force_excitation, places)
    loads = [np.einsum("n,jna->a", model.force_static, places), excited, 0.0 * excited]
    tips, states = model.outputs["tip"] @ places, set()
    for index in (0, len(curve.frequency_hz) // 2):
        omega = 2.0 * np.pi * curve.frequency_hz[index]
        start = with_strains(balance, omega, curve.relative_displacement[index].reshape(3, N, 6))
        found = solve_at(balance, omega, start, OPTIONS)
        assert found.converged
        moved = balance.by_harmonic(found.solution.reshape(5, -1, 3))[..., :6]
        contact = element.evaluate(in_rows(moved).reshape(5, -1, 3))
        force = to_complex(contact.force.reshape(5, -1)).reshape(3, N, 6)
        states |= set(contact.state.tolist())
        for h in range(3):
            right = loads[h] + pairs.T @ (turns[h, :, None] * force[h]).ravel()
            x = h * omega
            q = np.linalg.solve(stiffness - x**2 * mass + 1j * x * damping, right)
            expected = (pairs @ q).reshape(N, 6) / turns[h, :, None]
            assert moved[h] == pytest.approx(expected, abs=1e-9 * np.abs(moved).max())
            output, error = curve.output[index, :, h] * turns[h], 1e-8 if forces == "turning" else 3e-4  # few strains
            assert tips @ q == pytest.approx(output, abs=error * np.abs(curve.output[index]).max())
    assert {1, 2} <= states


@pytest.mark.parametrize(("forces", "disk"), CASES, ids=NAMES)
def test_without_deviations_the_tuned_points_are_solutions(forces, disk):
    modal = problem(forces, disk)[1]
    curve = forced_response(modal, CONTACT, Excitation(EO, 1.0), OPTIONS)
    balance = ring(modal, Mistuning.of(N))
    for index in (len(curve.frequency_hz) // 4, curve.peak.index):
        omega = 2.0 * np.pi * curve.frequency_hz[index]
        tuned = np.repeat(curve.relative_displacement[index].reshape(3, 1, 6), N, axis=1)
        residual = balance.evaluate(with_strains(balance, omega, tuned), omega).residual
        assert np.abs(residual).max() < 1e-9 * np.abs(tuned).max()


def test_forces_that_do_nothing_change_nothing():
    """Clamped blades that differ, each with denominators of its own, against strains in the waves of the ring."""
    model = turning(N, speed=0.0)
    plain, still = (modal_model(model, damping_ratio=0.01, influence=flow) for flow in ([], [STILL]))
    turned = modal_model(model, damping_ratio=0.01, coriolis=True)
    tuned = RelativeReceptance(plain, plain.phase(EO), (0, 1, 2), 1.0)
    clamped = RingBalance.of(RingReceptance(tuned, 1.0 + MISTUNING.frequency), CONTACT, MISTUNING, OPTIONS)
    for hertz in (0.15, 0.2):
        omega = 2.0 * np.pi * hertz
        found = solve_at(clamped, omega, np.zeros(clamped.size), OPTIONS)
        assert found.converged
        known = clamped.by_harmonic(found.solution.reshape(5, -1, 3))
        for modal in (still, turned):
            balance = ring(modal)
            again = solve_at(balance, omega, with_strains(balance, omega, known), OPTIONS)
            own = balance.by_harmonic(again.solution.reshape(5, -1, 3))[..., :6]
            assert own == pytest.approx(known, abs=1e-9 * np.abs(known).max())


@pytest.mark.parametrize(("forces", "disk"), CASES, ids=NAMES)
def test_iterative_solution_is_the_dense_one(forces, disk, monkeypatch):
    """Jacobian against differences; GMRES against a dense solution, near a resonance, with modes that reach far."""
    modal, rng = problem(forces, disk)[1], np.random.default_rng(2)
    tuned = RelativeReceptance(modal, modal.phase(EO), (0, 1, 2), 1.0)
    balance = ring(modal, strains=strain_directions(tuned, CONTACT, 1.2))
    x, direction, right, column, row = 0.1 * rng.standard_normal((5, balance.size))
    for omega in (0.97, 1.0):
        linearised = balance.evaluate(x, omega)
        step = 1e-7 * direction
        difference = balance.evaluate(x + step, omega).residual - balance.evaluate(x - step, omega).residual
        exact = linearised.jacobian @ direction
        np.testing.assert_allclose(exact, difference / 2e-7, atol=1e-5 * np.abs(exact).max())
        product, _ = balance.structure.coupling(omega, linearised.system(column, row, 0.3).change)
        np.testing.assert_allclose(np.eye(balance.size) - product, linearised.jacobian, atol=1e-11)
        monkeypatch.setattr(ring_of_sectors, "SMALLEST_ITERATIVE", balance.size + 1)
        dense = linearised.factorise(column, row, 0.3)
        monkeypatch.setattr(ring_of_sectors, "SMALLEST_ITERATIVE", balance.size)
        factors = linearised.factorise(column, row, 0.3)
        assert type(factors) is not type(dense)
        for one, other in zip(dense.solve(right, 0.7), factors.solve(right, 0.7), strict=True):
            np.testing.assert_allclose(other, one, atol=1e-6 * np.abs(dense.solve(right, 0.7)[0]).max())


def test_jacobian_of_clamped_blades_and_its_bordered_factors():
    """With Coriolis forces: against differences, and against the dense matrix."""
    modal, rng = problem("turning", False)[1], np.random.default_rng(3)
    tuned = RelativeReceptance(modal, modal.phase(EO), (0, 1, 2), 1.0)
    balance = RingBalance.of(RingReceptance(tuned, 1.0 + MISTUNING.frequency), CONTACT, MISTUNING, OPTIONS)
    x, direction, right, column, row = 0.1 * rng.standard_normal((5, balance.size))
    linearised, step = balance.evaluate(x, 1.0), 1e-7 * direction
    difference = balance.evaluate(x + step, 1.0).residual - balance.evaluate(x - step, 1.0).residual
    exact = linearised.jacobian @ direction
    np.testing.assert_allclose(exact, difference / 2e-7, atol=1e-5 * np.abs(exact).max())
    difference = balance.evaluate(x, 1.0 + 1e-6).residual - balance.evaluate(x, 1.0 - 1e-6).residual
    np.testing.assert_allclose(linearised.dR_dp, difference / 2e-6, atol=1e-6 * np.abs(difference).max() / 2e-6)
    whole = np.block([[linearised.jacobian, column[:, None]], [row[None], np.array([[0.3]])]])
    factors = linearised.factorise(column, row, 0.3)
    expected = np.linalg.solve(whole, np.append(right, 0.7))
    np.testing.assert_allclose(np.append(*factors.solve(right, 0.7)), expected, atol=1e-9 * np.abs(expected).max())
    assert factors.sign == np.sign(np.linalg.slogdet(whole)[0])


def test_stuck_blades_that_turn_grow_as_the_least_damped_pole_of_the_ring():
    """A small ring of clamped blades is one structure, whose stability has Coriolis forces."""
    model, modal = problem("turning", False)
    stuck = replace(CONTACT, friction=np.full(2, 5.0), interference=np.full(2, 9.0))
    shared = modal, stuck, Excitation(EO, 1e-3), replace(OPTIONS, harmonics=1, stability="ring")
    curve = mistuned_curve(*shared, MISTUNING, mistuned_response(*shared, MISTUNING))
    mass, damping, stiffness, pairs, _ = whole_ring(model, modal, "turning")
    springs = np.tile([2.0, 2.0, 3.0], 2) * (1.0 + MISTUNING.stiffness)[:, None]
    inverse, zero = np.linalg.inv(mass), np.zeros_like(mass)
    held = inverse @ (stiffness + (pairs.T * springs.ravel()) @ pairs)
    poles = np.linalg.eigvals(np.block([[zero, np.eye(len(mass))], [-held, -inverse @ damping]]))
    assert curve.growth_rate == pytest.approx(poles.real.max(), rel=1e-7)
    assert "stability of the whole ring" in curve.worst.searched


@pytest.mark.parametrize(("forces", "disk"), CASES, ids=NAMES)
def test_linear_rings_are_all_blades_in_physical_matrices(forces, disk):
    """Stuck contacts, with all modes and with a few; without deviations the frequencies of the tuned wave."""
    model, modal = problem(forces, disk)
    mass, damping, stiffness, pairs, places = whole_ring(model, modal, forces)
    springs = np.tile([2.0, 2.0, 3.0], 2) * (1.0 + MISTUNING.stiffness)[:, None]
    stiffness = stiffness + (pairs.T * springs.ravel()) @ pairs
    shared = modal, CONTACT, Excitation(EO, 1.0)
    every, few = (LinearSectors.of(*shared, MISTUNING, highest_hz=hertz) for hertz in (1e4, 0.7))
    assert few.force.size < every.force.size == N * modal.at(0).angular_frequency.size
    turns = np.exp(1j * modal.phase(EO) * np.arange(N))
    force = np.einsum("j,n,jna->a", turns, model.force_excitation, places)
    near = every.tuned_hz[0]
    for hertz in (0.985 * near, near, 1.01 * near):
        omega = 2.0 * np.pi * hertz
        q = np.linalg.solve(stiffness + 1j * omega * damping - omega**2 * mass, force)
        expected = model.outputs["tip"] @ places @ q / turns
        largest = np.abs(expected).max()
        np.testing.assert_allclose(every.vibration([hertz])[0], expected, atol=1e-9 * largest)
        np.testing.assert_allclose(few.vibration([hertz])[0], expected, atol=3e-3 * largest)
    peak = few.peak((0.95 * near, 1.05 * near))
    assert np.abs(few.vibration([peak.frequency_hz])).max() == pytest.approx(peak.amplitude_m)
    springs = {"normal": CONTACT.normal_stiffness, "tangential": CONTACT.tangential_stiffness}
    known = model if forces != "flow" else replace(model, coriolis=None)
    tuned = aeroelastic_modes(known, modal, EO, count=6, **springs).imag / (2.0 * np.pi)
    assert every.tuned_hz[:6] == pytest.approx(tuned, rel=1e-8)
    assert few.tuned_hz[:2] == pytest.approx(tuned[:2], rel=1e-4)
