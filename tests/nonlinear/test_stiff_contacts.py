"""Contacts far stiffer than the structure: sliding far beyond the stick limit, hard stops, free modes with stops.

The cases are public tests of Code_Aster: sdnd104a (a block on a shaking table), sdnd122a and sdnd123a (stops).
"""

import numpy as np
import pytest
from lumped import oscillator
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq

from nonlinear import ContactParameters, Excitation, ResponseCurve, SolverOptions, forced_response, nonlinear_mode
from nonlinear.contact.element_choice import contact_element
from rom import ReducedModel, modal_model

QUICK = {"detached": False, "stability": "folds", "truncation": False, "search": "off"}
LIMIT, SUPPORT = 1.0, 3e-5  # of the slider, N; of the block, N/m


def block(amplitude: float, kt: float, harmonics: int, integration: str = "exact") -> ResponseCurve:
    """A block of 1 kg on a soft spring; the table shakes at 1 Hz, `amplitude` in m/s2."""
    modal = modal_model(oscillator(stiffness=SUPPORT), damping_ratio=1e-12)
    values = {"normal_stiffness": 0.0, "tangential_stiffness": kt, "friction": 0.1, "preload": 10.0 * LIMIT}
    options = SolverOptions((0.95, 1.0), harmonics=harmonics, integration=integration, **QUICK)
    return forced_response(modal, ContactParameters.shared(1, **values), Excitation(0, amplitude), options)


def slider_coefficients(motion: float, kt: float) -> tuple[float, float]:
    """a1 and b1 of a Jenkins slider under X cos."""
    turn = 4.0 * np.arcsin(np.sqrt(LIMIT / kt / motion))
    rest = turn**3 / 6.0 - turn**5 / 120.0 + turn**7 / 5040.0 if turn < 0.1 else turn - np.sin(turn)
    return 0.5 * kt * motion / np.pi * rest, -4.0 * LIMIT / np.pi * (1.0 - LIMIT / kt / motion)


@pytest.mark.parametrize("ratio", [1e3, 1e5, 1e7])
def test_force_of_a_slider_that_hardly_ever_sticks(ratio: float) -> None:
    """Stick lasts for a small part of the period, and the force in it is a small difference of large springs."""
    contact = ContactParameters.shared(
        1, normal_stiffness=0.0, tangential_stiffness=ratio, friction=0.1, preload=10.0 * LIMIT
    )
    motion, phase = np.zeros((3, 1, 3)), 0.7
    motion[1:, 0, 0] = np.cos(phase), np.sin(phase)
    force = contact_element(contact, 1, SolverOptions((1.0, 2.0))).evaluate(motion).force[:, 0, 0]
    found = -complex(force[1], force[2]) * np.exp(-1j * phase)
    a1, b1 = slider_coefficients(1.0, ratio)
    assert (found.real, found.imag) == pytest.approx((a1, -b1), abs=2e-12)


@pytest.mark.parametrize("amplitude", [15.0, 1.5])
@pytest.mark.parametrize("kt", [9e4, 9e6])
def test_closed_form_of_one_harmonic(amplitude: float, kt: float) -> None:
    curve = block(amplitude, kt, 1)
    assert curve.termination.complete
    for frequency, harmonic in zip(curve.frequency_hz[::8], curve.harmonic_m[::8, 0], strict=True):
        squared = (2.0 * np.pi * frequency) ** 2

        def balance(motion: float, squared: float = squared) -> float:
            a1, b1 = slider_coefficients(motion, kt)
            return motion * (squared - SUPPORT) - np.sqrt(amplitude**2 - b1**2) - a1

        exact = brentq(balance, 1.001 * LIMIT / kt, 2.0 * amplitude / squared, xtol=1e-20, rtol=1e-14)
        assert abs(harmonic) == pytest.approx(exact, rel=1e-9)


@pytest.mark.parametrize("integration", ["exact", "sampled"])
def test_friction_power_tends_to_that_of_a_rigid_contact(integration: str) -> None:
    curve = block(15.0, 9e6, 15, integration)
    assert curve.termination.complete
    power = curve.dissipated_j[-1] * curve.frequency_hz[-1]
    rigid = 4.0 * LIMIT * 15.0 / (2.0 * np.pi) ** 2 * np.sqrt(1.0 - (np.pi / 30.0) ** 2)
    assert power == pytest.approx(rigid, rel=1e-3)


def test_micro_slip_of_a_stiff_contact_on_a_soft_support() -> None:
    """One harmonic of the friction exceeds the force: no gross slip. The mean of a slider is not held by friction."""
    curve = block(1.01, 9e6, 3)
    assert curve.termination.complete
    assert np.abs(curve.harmonic_m[:, 0]) == pytest.approx(1.01 * LIMIT / 9e6, rel=0.01)


@pytest.mark.parametrize("gap", [0.0, 1.0])
@pytest.mark.parametrize("kn", [1e4, 1e6])
def test_a_curve_with_a_hard_stop(kn: float, gap: float) -> None:
    modal = modal_model(oscillator(tangential=False), damping_ratio=0.05)
    contact = ContactParameters.shared(
        1, normal_stiffness=kn, tangential_stiffness=0.0, friction=0.0, interference=-gap
    )
    curve = forced_response(modal, contact, Excitation(0, 0.2), SolverOptions((0.2, 0.4), harmonics=15, **QUICK))
    assert curve.termination.complete
    if gap == 0.0:  # a rigid stop at the middle doubles the frequency
        assert curve.peak.frequency_hz == pytest.approx(1.0 / np.pi, rel=0.02)


def mode_of_one_mass(
    kn: float, gap: float, k: float, largest: float, harmonics: int
) -> tuple[np.ndarray, np.ndarray]:
    modal = modal_model(oscillator(stiffness=k, tangential=False), damping_ratio=1e-13)
    contact = ContactParameters.shared(
        1, normal_stiffness=kn, tangential_stiffness=0.0, friction=0.0, interference=-gap
    )
    options = SolverOptions((0.1, 2.0), harmonics=harmonics)
    mode = nonlinear_mode(modal, contact, 0, (1.05 * gap, largest), options)
    assert mode.complete
    beyond = mode.amplitude_m > 1.01 * gap
    return mode.amplitude_m[beyond], mode.frequency_hz[beyond]


@pytest.mark.parametrize(("ratio", "tolerance"), [(5.0, 1e-5), (1e6, 0.02)])
def test_free_mode_of_a_mass_with_a_stop(ratio: float, tolerance: float) -> None:
    """A half wave on the spring k, one on k + kn; kn / k = 1e6: a rigid stop."""
    k, gap = 10.0, 0.01
    amplitude, frequency = mode_of_one_mass(ratio * k, gap, k, 0.05, 15)
    free, held = np.sqrt(k), np.sqrt(k + ratio * k)
    speed, depth = free * np.sqrt(amplitude**2 - gap**2), gap - ratio * gap / (1.0 + ratio)
    period = 2.0 * (np.pi - np.arccos(gap / amplitude)) / free + 2.0 * np.arctan2(speed / held, depth) / held
    assert len(amplitude) > 5
    assert frequency == pytest.approx(1.0 / period, rel=tolerance)
    if ratio == 5.0:  # sdnd122a, by the energy on the free side
        assert CubicSpline(amplitude, frequency)(np.sqrt(2.0 * 0.00650108 / k)) == pytest.approx(0.6466310, rel=1e-5)


def test_second_mode_of_two_masses_between_stops() -> None:
    """sdnd123a: two masses on springs of 1 N/m, stops of 30 N/m at +-1 m of the first."""
    select, right = np.eye(2), np.zeros((6, 2))
    right[2], right[5] = select[0], -select[0]
    stiffness = np.array([[2.0, -1.0], [-1.0, 1.0]])
    model = ReducedModel(np.eye(2), stiffness, right, np.zeros((2, 3)), select[0], {"tip": select[0]})
    contact = ContactParameters.shared(
        2,
        normal_stiffness=60.0,
        tangential_stiffness=0.0,
        friction=0.0,
        interference=-1.0,  # 30 N/m each
    )
    modal, options = modal_model(model, damping_ratio=1e-13), SolverOptions((0.1, 2.0), harmonics=15)
    mode = nonlinear_mode(modal, contact, 0, (0.95, 1.12), options, number=2)
    found = CubicSpline(mode.amplitude_m, mode.frequency_hz)((1.01, 1.05, 1.1))
    assert found == pytest.approx((0.2587326, 0.2694060, 0.2879113), rel=2e-4)
