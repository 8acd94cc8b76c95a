"""Stability of a ring with Coriolis forces: physical matrices, poles of waves, a speed of zero."""

from dataclasses import replace
from functools import lru_cache, partial

import numpy as np
import pytest
from test_coriolis_in_response import CONTACT, EO, OPTIONS, N, in_wave
from turning import SPEED, turning

from nonlinear import ContactParameters, Excitation, forced_response
from nonlinear.contact.fourier import to_real
from nonlinear.response_solver import build_harmonic_balance
from nonlinear.stability.eigenproblem import all_refined, converged, eigenvalues_by_slices
from nonlinear.stability.floquet import FloquetAnalysis
from nonlinear.stability.ring_stability import LinearisedContact, RingStability
from nonlinear.time_integration.ring import Ring
from nonlinear.worst_motion.ring_integration import RingPatterns
from rom import modal_model
from rom.cyclic.natural_frequencies import aeroelastic_modes


@lru_cache
def solved(disk, speed=SPEED, coriolis=True):
    model = turning(N, disk, speed)
    modal = modal_model(model, damping_ratio=0.01, coriolis=coriolis)
    return model, modal, forced_response(modal, CONTACT, Excitation(EO, 1.0), OPTIONS)


def analysed(modal, curve, index):
    """The analysis of a point, and its linearised contact."""
    balance = build_harmonic_balance(modal, CONTACT, Excitation(EO, 1.0), OPTIONS)
    displacement = to_real(curve.relative_displacement[index].reshape(4, -1)).reshape(7, -1, 3)
    jacobian = balance.element.evaluate(displacement).jacobian
    contact = LinearisedContact(displacement, jacobian, 2.0 * np.pi * curve.frequency_hz[index])
    return FloquetAnalysis.of(balance.receptance, CONTACT), contact


def smallest_values(model, modal, point, sigma, nodal_diameter):
    """Smallest singular values of I - G(sigma) K(sigma), G from the matrices of the sector, and of the contacts."""
    receptances, harmonics = [], np.array([0, 1, -1, 2, -2, 3, -3])
    for h in harmonics:
        s, n = point.omega * (sigma + 1j * h), EO * h + nodal_diameter
        wave, mass, stiffness, damping, _ = in_wave(model, modal, n)
        relative = (model.contact_right - np.exp(2j * np.pi * n / N) * model.contact_left) @ wave
        receptances.append(relative @ np.linalg.solve(s**2 * mass + s * damping + stiffness, relative.conj().T))
    columns = []
    for motion in np.eye(42, dtype=complex):
        forces = point.forces(sigma, motion.reshape(7, 6), True)
        columns.append(motion - np.concatenate([g @ f for g, f in zip(receptances, forces, strict=True)]))
    return np.linalg.svd(np.array(columns).T, compute_uv=False)[-2:]


@pytest.mark.parametrize("disk", [False, True], ids=["blade", "disk"])
def test_the_leading_exponents_solve_the_perturbation_equations_in_physical_matrices(disk):
    """d = G(sigma) K(sigma) d, of the ring and, with all poles retained, of the wave itself."""
    model, modal, curve = solved(disk)
    for share in (0.3, 0.7):
        analysis, contact = analysed(modal, curve, int(share * len(curve.frequency_hz)))
        point, omega = analysis.point(*contact), contact.omega
        leading = RingStability(analysis, N).leading(contact)
        own = analysis.exponents(*contact)
        every = replace(analysis.problem, retention_radius=np.inf)
        exact = converged(every.eigenproblem(contact.jacobian, omega, point.memory), own[np.argmax(own.real)] / omega)
        for sigma, n in ((leading.exponent / omega, leading.nodal_diameter), (exact.value, 0)):
            next_one, small = smallest_values(model, modal, point, sigma, n)
            assert small < 1e-5 * next_one, (share, n)
        assert own[np.argmax(own.real)] / omega == pytest.approx(exact.value, abs=1e-3)


@pytest.mark.parametrize("disk", [False, True], ids=["blade", "disk"])
def test_at_rest_coriolis_forces_change_no_exponent(disk):
    (_, modal, curve), other = solved(disk, 0.0, coriolis=False), solved(disk, 0.0)[1]
    for share in (0.3, 0.6):
        index = int(share * len(curve.frequency_hz))
        (analysis, contact), (turned, _) = (analysed(each, curve, index) for each in (modal, other))
        expected, found = analysis.exponents(*contact), turned.exponents(*contact)
        assert np.sort_complex(found) == pytest.approx(np.sort_complex(expected), abs=1e-6 * contact.omega)
        assert np.count_nonzero(found.imag == 0.0) == np.count_nonzero(expected.imag == 0.0)
        leading, own = (RingStability(each, N).leading(contact) for each in (analysis, turned))
        assert own.exponent.real == pytest.approx(leading.exponent.real, rel=2e-3, abs=1e-6 * contact.omega)


@pytest.mark.parametrize(("coriolis", "hertz", "k"), [(False, 0.06236, 0), (False, 0.11146, 2), (True, 0.12627, 3)])
def test_growth_rates_of_one_nodal_diameter_are_those_of_all_poles(coriolis, hertz, k):
    """Few contact nodes, seven harmonics: condensed poles let these perturbations grow by up to 0.1 omega."""
    modal = modal_model(turning(6, speed=0.3), damping_ratio=0.01, coriolis=coriolis)
    options, wave = replace(OPTIONS, harmonics=7, frequency_hz=(0.99 * hertz, 1.01 * hertz)), Excitation(1, 1.0)
    curve = forced_response(modal, CONTACT, wave, options)
    index = int(np.argmin(np.abs(curve.frequency_hz - hertz)))
    displacement = to_real(curve.relative_displacement[index].reshape(8, -1)).reshape(15, -1, 3)
    omega, ring = 2.0 * np.pi * curve.frequency_hz[index], Ring(modal, CONTACT, wave)
    jacobian = build_harmonic_balance(modal, CONTACT, wave, options).element.evaluate(displacement).jacobian
    analysis = FloquetAnalysis.of(ring.receptance(7), CONTACT, kappa=ring.shift(k))
    every = replace(analysis.problem, retention_radius=np.inf)
    problem = every.eigenproblem(jacobian, omega, analysis.point(displacement, jacobian, omega).memory)
    starts = eigenvalues_by_slices(problem.eigenvalues, 1.0 / 6.0, problem.conjugate_pairs)
    found = all_refined(partial(converged, problem), starts[starts.real > -0.05], problem.conjugate_pairs)
    expected = found[np.abs(found.imag) < 0.5].real.max()
    assert -0.05 < expected < 0.0
    assert RingPatterns(ring, options, omega, displacement).growth_rate(k) / omega == pytest.approx(
        expected, abs=1e-4
    )


@pytest.mark.parametrize("disk", [False, True], ids=["blade", "disk"])
def test_stuck_contacts_decay_as_the_least_damped_wave(disk):
    stuck = ContactParameters.shared(
        2, normal_stiffness=6.0, tangential_stiffness=4.0, friction=5.0, interference=9.0
    )
    springs = {"normal": stuck.normal_stiffness, "tangential": stuck.tangential_stiffness}
    model = turning(N, disk)
    modal = modal_model(model, rayleigh=(0.01, 0.0), coriolis=True)
    options = replace(OPTIONS, harmonics=1, frequency_hz=(0.1, 0.2), stability="ring")
    curve = forced_response(modal, stuck, Excitation(EO, 1e-3), options)
    poles = [aeroelastic_modes(model, modal, n, count=20, **springs) for n in range(-5, 7)]
    assert curve.growth_rate == pytest.approx(max(float(each.real.max()) for each in poles), rel=1e-8)
