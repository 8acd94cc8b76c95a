"""Response of a ring with Coriolis forces: physical matrices, a speed of zero, forward and backward waves."""

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from turning import SPEED, circling, turning

from nonlinear import ContactParameters, Excitation, SolverOptions, forced_response
from rom import InfluenceCoefficients, modal_model
from rom.cyclic.natural_frequencies import gyroscopic_frequencies
from rom.cyclic.pole_modes import PoleModes
from rom.cyclic.receptance import RelativeReceptance

N, EO = 12, 2
FLOW = InfluenceCoefficients(2, np.array([-1, 0, 1]), np.array([0.02 - 0.01j, -0.01 - 0.02j, -0.03 + 0.02j]))
CONTACT = ContactParameters.shared(2, normal_stiffness=6.0, tangential_stiffness=4.0, friction=0.3, interference=0.3)
OPTIONS = SolverOptions((0.05, 0.5), harmonics=3, stability="folds", search="off", detached=False, truncation=False)


@lru_cache
def solved(disk=False, speed=SPEED, flow=False, coriolis=True, options=OPTIONS):
    model = turning(N, disk, speed)
    modal = modal_model(model, damping_ratio=0.01, influence=[FLOW] * flow, coriolis=coriolis)
    return model, modal, forced_response(modal, CONTACT, Excitation(EO, 1.0), options)


def in_wave(model, modal, n):
    """Coordinates, mass, stiffness, damping and the modes times the mass in a wave of n nodal diameters."""
    own, phase = modal.at(n), 2.0 * np.pi * n / N
    wave = model.wave(phase) if model.has_disk else np.eye(model.size)
    mass, stiffness, skew = (wave.conj().T @ part @ wave for part in (model.mass, model.stiffness, model.coriolis))
    inertia = mass @ np.linalg.lstsq(wave, own.shapes, rcond=None)[0]
    damping = inertia @ np.diag(own.damping) @ inertia.conj().T + SPEED * skew
    return wave, mass, stiffness, damping, inertia


@pytest.mark.parametrize("flow", [False, True], ids=["no_flow", "flow"])
@pytest.mark.parametrize("disk", [False, True], ids=["blade", "disk"])
def test_points_solve_the_equations_in_physical_matrices(disk, flow):
    """(K + K_flow - x^2 M + i x (C + W G + C_flow)) q = f + B^H f_c of each wave, in reduced coordinates."""
    model, modal, curve = solved(disk, flow=flow)
    assert curve.termination.complete
    assert curve.energy_error.max() < 1e-9
    for index in (len(curve.frequency_hz) // 3, curve.peak.index):
        omega = 2.0 * np.pi * curve.frequency_hz[index]
        for h in range(4):
            phase, own, x = 2.0 * np.pi * EO * h / N, modal.at(EO * h), h * omega
            wave, mass, stiffness, damping, inertia = in_wave(model, modal, EO * h)
            dynamic = stiffness - x**2 * mass + 1j * x * damping
            for each in [FLOW] * flow:
                spring, dashpot = each.springs_and_dashpots(phase, float(own.angular_frequency[1]))
                dynamic = dynamic + (spring + 1j * x * dashpot) * np.outer(inertia[:, 1], inertia[:, 1].conj())
            relative = (model.contact_right - np.exp(1j * phase) * model.contact_left) @ wave
            force = relative.conj().T @ curve.contact_force[index, h].ravel()
            if h == 1:
                force = force + wave.conj().T @ model.force_excitation
            if h == 0:
                force = force + wave.conj().T @ model.force_static
            found = curve.relative_displacement[index, h].ravel()
            expected = relative @ np.linalg.solve(dynamic, force)
            assert found == pytest.approx(expected, abs=1e-9 * np.abs(curve.relative_displacement[index]).max())


@pytest.mark.parametrize("disk", [False, True], ids=["blade", "disk"])
def test_at_rest_coriolis_forces_change_nothing(disk):
    (_, modal, curve), (_, other, without) = (solved(disk, 0.0, coriolis=there) for there in (True, False))
    assert without.peak.amplitude_m == pytest.approx(curve.peak.amplitude_m, rel=1e-10)
    receptances = [RelativeReceptance(each, modal.phase(EO), (0, 1, 2), 1.0) for each in (modal, other)]
    poles, modes = (each.matrix(1.1) for each in receptances)
    assert poles == pytest.approx(modes, abs=1e-12 * np.abs(modes).max())


def test_a_mass_on_springs_in_a_turning_frame_has_circular_modes():
    """x'' - 2 W y' + (w0^2 - W^2) x = 0 and y alike: w0 +- W; a force that turns with a mode moves no other."""
    w0, speed = 10.0, 0.7
    found = PoleModes.of(np.full(2, w0**2 - speed**2), 2.0 * speed * np.array([[0.0, -1.0], [1.0, 0.0]]))
    assert np.sort(found.poles.imag)[2:] == pytest.approx([w0 - speed, w0 + speed], rel=1e-12)
    turned = np.abs(found.dual @ np.array([1.0, 1j]))  # y a quarter period ahead of x or behind it
    assert np.sort(turned)[:2] == pytest.approx(0.0, abs=1e-12)
    by_pole = (found.shapes / (np.abs(found.poles) ** 2 - found.poles.conj() * 0.5j)) @ found.dual
    dynamic = (w0**2 - speed**2 - 0.25) * np.eye(2) + 0.5j * 2.0 * speed * np.array([[0.0, -1.0], [1.0, 0.0]])
    assert by_pole == pytest.approx(np.linalg.inv(dynamic), rel=1e-12)


@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_circles_under_a_friction_cone_are_in_closed_form(sense):
    """|T| = mu N at every instant: kt s^2 / X^2 of the stretch s adds to w0^2, and the rest takes energy."""
    speed, stretch, kt, force = 0.1, 1.0, 0.5, 0.3
    contact = ContactParameters.shared(
        1, normal_stiffness=0.0, tangential_stiffness=kt, friction=1.0, preload=stretch * kt, law="cone"
    )
    modal = modal_model(circling(speed, sense), damping_ratio=1e-13, coriolis=True)
    options = replace(OPTIONS, frequency_hz=(0.15, 0.21), harmonics=1)
    curve = forced_response(modal, contact, Excitation(0, force), options)
    size, w = np.abs(curve.relative_displacement[:, 1, 0, 0]), 2.0 * np.pi * curve.frequency_hz
    slips = size > 1.01 * stretch
    along = 1.0 - speed**2 - w**2 + sense * 2.0 * speed * w + kt * stretch**2 / size**2
    across = kt * stretch * np.sqrt(np.maximum(size**2 - stretch**2, 0.0)) / size**2
    assert slips.sum() > 10
    assert (np.hypot(along, across) * size)[slips] == pytest.approx(force, rel=1e-9)


@pytest.mark.parametrize("disk", [False, True], ids=["blade", "disk"])
def test_poles_of_a_wave_are_its_gyroscopic_frequencies(disk):
    """Forward and backward: those of n with a positive imaginary part, and those of -n."""
    model, modal = turning(N, disk), modal_model(turning(N, disk), damping_ratio=0.0, coriolis=True)
    for n in (0, EO, -EO):
        poles = np.sort(modal.at(n).turning.poles.imag)
        expected = 2.0 * np.pi * gyroscopic_frequencies(model, phase=2.0 * np.pi * n / N, count=6)
        assert poles[poles > 0.0][:6] == pytest.approx(expected, rel=1e-9)


def test_large_faces_have_the_same_receptance(monkeypatch):
    """A series takes the place of most poles there."""
    modal = solved()[1]
    receptance = RelativeReceptance(modal, modal.phase(EO), (0, 1, 2), 1.0)
    expected = receptance.matrix(0.3)
    monkeypatch.setattr("rom.cyclic.receptance.SMALLEST_FACE", 3)
    found = RelativeReceptance(modal, modal.phase(EO), (0, 1, 2), 1.0).matrix(0.3)
    assert found == pytest.approx(expected, abs=1e-12 * np.abs(expected).max())
