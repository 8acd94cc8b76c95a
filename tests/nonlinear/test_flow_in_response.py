"""Response and stability of a ring in a flow: physical matrices, energy, poles of waves, a flow that does nothing."""

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from lumped import lumped_blade
from lumped_disk import sector_with_disk

from nonlinear import ContactParameters, Excitation, SolverOptions, forced_response
from nonlinear.contact.fourier import to_real
from nonlinear.mistuned_ring.mistuning import Mistuning
from nonlinear.mistuned_ring.ring_response import mistuned_response
from nonlinear.response_solver import build_harmonic_balance
from nonlinear.stability.floquet import FloquetAnalysis
from nonlinear.stability.ring_stability import LinearisedContact, RingStability
from rom import InfluenceCoefficients, modal_model
from rom.cyclic.natural_frequencies import aeroelastic_modes

N, EO = 12, 2
FLOW = InfluenceCoefficients(2, np.array([-1, 0, 1]), np.array([0.02 - 0.01j, -0.01 - 0.02j, -0.03 + 0.02j]))
STILL = InfluenceCoefficients(2, np.array([0]), np.array([0j]))
CONTACT = ContactParameters.shared(2, normal_stiffness=6.0, tangential_stiffness=4.0, friction=0.3, interference=0.3)
OPTIONS = SolverOptions((0.05, 0.5), harmonics=3, stability="ring", search="off", detached=False, truncation=False)


@lru_cache
def solved(flow, disk=False, options=OPTIONS):
    model = sector_with_disk(N) if disk else lumped_blade(N)
    modal = modal_model(model, damping_ratio=0.01, influence={"none": [], "still": [STILL], "flow": [FLOW]}[flow])
    return model, modal, forced_response(modal, CONTACT, Excitation(EO, 1.0), options)


def test_a_flow_that_does_nothing_changes_nothing():
    options = replace(OPTIONS, stability="folds")
    curve, other = solved("none", options=options)[2], solved("still", options=options)[2]
    assert other.frequency_hz == pytest.approx(curve.frequency_hz, rel=1e-12)
    assert other.amplitude_m == pytest.approx(curve.amplitude_m, rel=1e-12)


def test_waves_with_modes_of_their_own_have_the_same_stability():
    """Modes that all waves share, of a blade alone, and modes of each wave by itself, as with a disk."""
    options = replace(OPTIONS, harmonics=2, frequency_hz=(0.14, 0.24))
    curve, other = solved("none", options=options)[2], solved("still", options=options)[2]
    assert 0 < np.count_nonzero(curve.stable) < curve.stable.size
    assert np.array_equal(other.stable, curve.stable)


def test_the_leading_exponent_solves_the_perturbation_equations_in_physical_matrices():
    """d = G(sigma) K(sigma) d of a nodal diameter, G from the matrices of the blade and of the flow."""
    model, modal, curve = solved("flow", options=replace(OPTIONS, stability="folds"))
    index, wave = int(np.argmin(np.abs(curve.frequency_hz - 0.17))), Excitation(EO, 1.0)
    balance, omega = build_harmonic_balance(modal, CONTACT, wave, OPTIONS), 2.0 * np.pi * curve.frequency_hz[index]
    displacement = to_real(curve.relative_displacement[index].reshape(4, -1)).reshape(7, -1, 3)
    jacobian = balance.element.evaluate(displacement).jacobian
    analysis = FloquetAnalysis.of(balance.receptance, CONTACT)
    leading = RingStability(analysis, N).leading(LinearisedContact(displacement, jacobian, omega))
    contact, sigma = analysis.point(displacement, jacobian, omega), leading.exponent / omega
    harmonics = np.array([0, 1, -1, 2, -2, 3, -3])
    inertia = model.mass @ modal.shapes
    damping, family = inertia @ np.diag(modal.damping) @ inertia.T, np.outer(inertia[:, 1], inertia[:, 1])
    receptances = []
    for h in harmonics:
        s, phase = omega * (sigma + 1j * h), 2.0 * np.pi * (EO * h + leading.nodal_diameter) / N
        relative = model.contact_right - np.exp(1j * phase) * model.contact_left
        spring, dashpot = FLOW.springs_and_dashpots(phase, float(modal.angular_frequency[1]))
        dynamic = s**2 * model.mass + s * damping + model.stiffness + (spring + s * dashpot) * family
        receptances.append(relative @ np.linalg.solve(dynamic, relative.conj().T))
    size = 7 * 6
    matrix = np.eye(size, dtype=complex)
    for column in range(size):
        motion = np.zeros(size, complex)
        motion[column] = 1.0
        forces = contact.forces(sigma, motion.reshape(7, 6), True)
        matrix[:, column] -= np.concatenate([g @ f for g, f in zip(receptances, forces, strict=True)])
    values = np.linalg.svd(matrix, compute_uv=False)
    assert values[-1] < 1e-6 * values[-2]


@pytest.mark.parametrize("disk", [False, True], ids=["blade", "disk"])
def test_points_solve_the_equations_in_physical_matrices(disk):
    """(K + K_flow - x^2 M + i x (C + C_flow)) q = f + B^H f_c of each wave, in reduced coordinates."""
    model, modal, curve = solved("flow", disk, replace(OPTIONS, stability="folds"))
    assert curve.termination.complete
    assert curve.energy_error.max() < 1e-9
    for index in (len(curve.frequency_hz) // 3, curve.peak.index):
        omega = 2.0 * np.pi * curve.frequency_hz[index]
        for h in range(4):
            phase = 2.0 * np.pi * EO * h / N
            own, x = modal.at(EO * h), h * omega
            if disk:
                wave = model.wave(phase)
                mass, stiffness = (wave.conj().T @ part @ wave for part in (model.mass, model.stiffness))
                shapes = np.linalg.lstsq(wave, own.shapes, rcond=None)[0]
            else:
                wave, mass, stiffness, shapes = np.eye(model.size), model.mass, model.stiffness, own.shapes
            inertia = mass @ shapes
            damping = inertia @ np.diag(own.damping) @ inertia.conj().T
            family = np.outer(inertia[:, 1], inertia[:, 1].conj())
            squared, turns = own.angular_frequency[1] ** 2, np.exp(1j * phase * FLOW.offset)
            flow = squared * (turns @ FLOW.coefficient.real)
            flow += 1j * x * own.angular_frequency[1] * (turns @ FLOW.coefficient.imag)
            relative = (model.contact_right - np.exp(1j * phase) * model.contact_left) @ wave
            force = relative.conj().T @ curve.contact_force[index, h].ravel()
            force = force + wave.conj().T @ (model.force_excitation if h == 1 else 0.0 * model.force_excitation)
            q = np.linalg.solve(stiffness - x**2 * mass + 1j * x * damping - flow * family, force)
            found = curve.relative_displacement[index, h].ravel()
            assert (relative @ q) == pytest.approx(found, abs=1e-9 * np.abs(curve.relative_displacement[index]).max())


def test_stuck_contacts_grow_as_the_least_damped_wave():
    """In full stick the recorded growth rate is that of the least stable wave of all; it begins at zero damping."""
    stuck = ContactParameters.shared(
        2, normal_stiffness=6.0, tangential_stiffness=4.0, friction=5.0, interference=9.0
    )
    springs = {"normal": stuck.normal_stiffness, "tangential": stuck.tangential_stiffness}
    model = lumped_blade(N)
    for strength in (1.0, 3.0):
        flow = replace(FLOW, coefficient=strength * FLOW.coefficient)
        modal = modal_model(model, damping_ratio=0.01, influence=[flow])
        options = replace(OPTIONS, harmonics=1, frequency_hz=(0.1, 0.2))
        curve = forced_response(modal, stuck, Excitation(EO, 1e-3), options)
        poles = [aeroelastic_modes(model, modal, n, count=20, **springs) for n in range(-5, 7)]
        least = max(float(each.real.max()) for each in poles)
        assert curve.growth_rate == pytest.approx(least, rel=1e-8)
        assert curve.stable.all() == (least <= 0.0)


def test_a_mistuned_ring_in_a_flow_has_the_tuned_response_without_deviations():
    modal = solved("flow")[1]
    options = replace(OPTIONS, harmonics=1, frequency_hz=(0.17, 0.19))
    tuned = forced_response(modal, CONTACT, Excitation(EO, 1.0), options)
    ring = mistuned_response(modal, CONTACT, Excitation(EO, 1.0), options, Mistuning.of(N))
    assert ring.peak.amplitude_m == pytest.approx(tuned.harmonic_m[:, 0].max(), rel=1e-4)
