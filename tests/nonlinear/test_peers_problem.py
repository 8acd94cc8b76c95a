"""Published comparison problems. One: 36 dofs, 9 friction nodes against ground, 128 samples a period.

Values of |q^(1)| of node 12 in x on which three other programs agree to 9 decimals (variable load: two programs).
"""

import numpy as np
import pytest

from nonlinear import ContactParameters, Excitation, SolverOptions, forced_response
from nonlinear.contact.fourier import to_complex
from nonlinear.harmonic_balance.initial_solution import periodic_start
from nonlinear.response_solver import build_harmonic_balance
from rom import ReducedModel, modal_model

FREQUENCIES = (0.80, 1.00, 1.05, 1.10, 1.15, 1.20)
CONSTANT_1 = (0.447322883, 0.898440686, 1.264494453, 2.617636182, 2.324599740, 1.942844850)
CONSTANT_5 = (0.447322883, 0.898440686, 1.264494453, 2.623080902, 2.329617441, 1.945808167)
VARIABLE_1 = (0.428134832, 0.848186249, 1.182370796, 2.969930143, 2.441742470, 1.924253035)


def model(force_x, force_z):
    """The reduced model: 12 nodes, nodes 4 to 12 in contact with ground, normal direction -z."""
    chain = 2.0 * np.eye(12) - np.eye(12, k=1) - np.eye(12, k=-1)
    chain[11, 11] = 1.0
    coupling = np.array([[1.0, 0.0, 0.3], [0.0, 2.0, 0.0], [0.3, 0.0, 4.0]])
    stiffness = np.kron(chain @ chain, coupling) / (4.0 * np.sin(np.pi / 50.0) ** 2) ** 2
    right = np.zeros((27, 36))
    for contact, node in enumerate(range(4, 13)):
        right[3 * contact + np.arange(3), 3 * (node - 1) + np.arange(3)] = [1.0, 1.0, -1.0]
    force = np.zeros(36)
    force[33], force[35] = force_x, force_z
    output = np.zeros(36)
    output[33] = 1.0
    return ReducedModel(np.eye(36), stiffness, right, np.zeros((9, 3)), force, {"tip": output})


def problem(kind):
    """Modes and contact of problem A (constant load) or V (variable load, lift-off)."""
    every = np.ones(9)
    if kind == "A":
        limit = 0.30 + 0.05 * np.arange(9)
        contact = ContactParameters(0 * every, 0.4 * every, every, 0 * every, limit)
        return modal_model(model(2.0, 0.0), rayleigh=(0.0, 0.004)), contact
    preload = np.repeat([1.6, 1.2, 1.0], 3)
    contact = ContactParameters(0.8 * every, 0.4 * every, 0.5 * every, 0 * every, preload)
    return modal_model(model(2.0, 1.0), rayleigh=(0.0, 0.004)), contact


def options(harmonics, integration):
    return SolverOptions(
        (0.5 / (2 * np.pi), 1.6 / (2 * np.pi)),
        harmonics=harmonics,
        samples=128,
        integration=integration,
        detached=False,
        truncation=False,
        search="off",
    )


@pytest.mark.parametrize(
    ("kind", "harmonics", "values"), [("A", 1, CONSTANT_1), ("A", 5, CONSTANT_5), ("V", 1, VARIABLE_1)]
)
def test_nine_decimals(kind, harmonics, values):
    modal, contact = problem(kind)
    choice = options(harmonics, "sampled")
    balance = build_harmonic_balance(modal, contact, Excitation(0, 1.0), choice)
    for omega, value in zip(FREQUENCIES, values, strict=True):
        start = periodic_start(balance, omega, np.zeros((9, 3)), choice)
        assert start.converged
        force = to_complex(balance.forces(start.solution).force.reshape(2 * harmonics + 1, -1))
        coordinates, _ = balance.receptance.modal_response(omega, force)
        assert abs(coordinates[1] @ modal.outputs["tip"]) == pytest.approx(value, abs=6e-10)


@pytest.mark.parametrize(
    ("kind", "harmonics", "omega", "height"),
    [
        ("A", 1, 1.098410, 2.618448631),
        ("A", 5, 1.100561, 2.623664717),
        ("V", 1, 1.095393, 2.978425669),
        ("V", 5, 1.090578, 3.025908620),
    ],
)
def test_peaks(kind, harmonics, omega, height):
    """The others' peaks: the largest sample of a flat top that 128 samples make ragged at the 3e-4 level."""
    modal, contact = problem(kind)
    for integration in ("sampled", "exact"):
        curve = forced_response(modal, contact, Excitation(0, 1.0), options(harmonics, integration))
        assert curve.termination.complete
        top = int(np.argmax(curve.harmonic_m[:, 0]))
        assert curve.harmonic_m[top, 0] == pytest.approx(height, rel=1e-3)
        assert 2 * np.pi * curve.frequency_hz[top] == pytest.approx(omega, rel=4e-3)
        assert curve.energy_error.max() < 1e-8


LENGTH, HEIGHT, WIDTH, YOUNG, DENSITY, ELEMENTS = 2000.0, 100.0, 300.0, 185000.0, 7.83e-9, 8  # mm, N, t, s
SLIDER = 750.0  # mm from the clamped end


def beam():
    """A clamped Euler-Bernoulli beam of eight cubic elements with a slider against the ground."""
    area, second, own = HEIGHT * WIDTH, WIDTH * HEIGHT**3 / 12.0, LENGTH / ELEMENTS
    scale = np.tile([1.0, own], 2)
    bending = np.array([[12, 6, -12, 6], [6, 4, -6, 2], [-12, -6, 12, -6], [6, 2, -6, 4]])
    inertia = np.array([[156, 22, 54, -13], [22, 4, 13, -3], [54, 13, 156, -22], [-13, -3, -22, 4]])
    stiffness, mass = np.zeros((2, 2 * ELEMENTS + 2, 2 * ELEMENTS + 2))
    for first in range(0, 2 * ELEMENTS, 2):
        place = slice(first, first + 4)
        stiffness[place, place] += YOUNG * second / own**3 * bending * np.outer(scale, scale)
        mass[place, place] += DENSITY * area * own / 420.0 * inertia * np.outer(scale, scale)
    unit = np.eye(2 * ELEMENTS)
    right, tip = np.zeros((3, 2 * ELEMENTS)), unit[-2]
    right[0] = unit[2 * (round(SLIDER / own) - 1)]
    return ReducedModel(mass[2:, 2:], stiffness[2:, 2:], right, np.zeros((1, 3)), tip, {"tip": tip})


@pytest.mark.parametrize(
    ("stiffness", "harmonics", "peak", "at"),
    [(1e4, 1, 0.521032, 134.975), (1e5, 1, 0.203218, 171.539), (1e5, 21, 0.182486, 166.346)],
)
def test_peaks_of_a_beam_with_a_slider(stiffness, harmonics, peak, at):
    """Another program: largest displacement of the tip, mm, at rad/s; the slider slips at 1500 N."""
    modal = modal_model(beam(), rayleigh=(24.897320, 0.0))
    assert modal.angular_frequency[0] == pytest.approx(123.34059, rel=1e-7)
    contact = ContactParameters.shared(
        1, normal_stiffness=0.0, tangential_stiffness=stiffness, friction=1.0, preload=1500.0
    )
    own = SolverOptions((20.0, 30.0), harmonics=harmonics, stability="folds", detached=False, search="off")
    found = forced_response(modal, contact, Excitation(0, 200.0), own).peak
    assert found.amplitude_m == pytest.approx(peak, rel=1e-5)
    assert 2.0 * np.pi * found.frequency_hz == pytest.approx(at, rel=5e-4)
