"""Growth rate on linear segments and beside them: closed forms, Hill's method with all poles, no gaps."""

import numpy as np
import pytest
from lumped import lumped_blade, oscillator

from nonlinear import ContactParameters, Excitation, SolverOptions, forced_response
from nonlinear.contact.fourier import to_real
from nonlinear.response_solver import build_harmonic_balance
from nonlinear.stability.hill import HillProblem
from rom import modal_model

OPEN, STUCK = -1e3, 1e3  # interference that no motion here overcomes
RANGES = (
    (0.02, 0.06),
    (0.1, 0.5),
)  # far below the first resonance, where no exponent lies in the strip, and about it


def blade_curve(interference, n_blades=12, harmonics=1, method="coupled", frequency=RANGES[1], **contact):
    """Modes, contact, curve and options of a lumped blade."""
    damping_ratio = contact.pop("damping_ratio", [0.02, 0.03, 0.001, 0.05])
    modal = modal_model(lumped_blade(n_blades), damping_ratio=damping_ratio)
    values = {"normal_stiffness": 6.0, "tangential_stiffness": 4.0, "friction": 0.4} | contact
    parameters = ContactParameters.shared(2, interference=interference, **values)
    options = SolverOptions(
        frequency, harmonics=harmonics, method=method, detached=False, truncation=False, search="off"
    )
    return modal, parameters, forced_response(modal, parameters, Excitation(1, 1.0), options), options


@pytest.mark.parametrize("frequency", RANGES)
@pytest.mark.parametrize("harmonics", [1, 3])
def test_open_contacts_decay_as_the_least_damped_mode(harmonics, frequency):
    """-zeta omega, the smallest over all modes: here the third one."""
    modal, _, curve, _ = blade_curve(OPEN, harmonics=harmonics, frequency=frequency)
    assert curve.points > 5
    expected = -0.5 * modal.damping.min()
    assert modal.damping.argmin() == 2
    assert curve.growth_rate == pytest.approx(np.full(curve.points, expected), rel=1e-12)


@pytest.mark.parametrize("frequency", RANGES)
def test_stuck_contact_of_one_mass(frequency):
    """x'' + c x' + (1 + kt) x: the spring of the contact has no damping, the rate stays -c / 2."""
    one = np.ones(1)
    contact = ContactParameters(one, 0.5 * one, 0.5 * one, STUCK * one, 0.0 * one)
    modal = modal_model(oscillator(), rayleigh=(0.03, 0.0))
    curve = forced_response(modal, contact, Excitation(0, 1.0), SolverOptions(frequency, detached=False))
    assert (curve.sticking == 1).all()
    assert curve.growth_rate == pytest.approx(np.full(curve.points, -0.015), rel=1e-9)


@pytest.mark.parametrize("frequency", RANGES)
@pytest.mark.parametrize(
    ("n_blades", "harmonics", "method"), [(12, 1, "coupled"), (3, 3, "coupled"), (12, 2, "static-first")]
)
def test_stuck_contacts_against_hill(n_blades, harmonics, method, frequency):
    """The leading one of all eigenvalues of Hill's matrices of the contact element for all kappa, none condensed."""
    modal, contact, curve, options = blade_curve(STUCK, n_blades, harmonics, method, frequency)
    balance = build_harmonic_balance(modal, contact, Excitation(1, 1.0), options)
    static = method == "coupled"
    problems = [
        HillProblem(modal, balance.receptance.phase, harmonics, 2.0 * np.pi * k / n_blades, static, np.inf)
        for k in range(n_blades // 2 + 1)
    ]
    assert (curve.sticking == 2).all()
    assert np.ptp(curve.growth_rate) < 1e-12
    for index in (0, curve.points // 2, curve.peak.index, curve.points - 1):
        omega = 2.0 * np.pi * curve.frequency_hz[index]
        jacobian = balance.element.evaluate(to_real(curve.relative_displacement[index])).jacobian
        rates = [omega * problem.eigenproblem(jacobian, omega).eigenvalues().real.max() for problem in problems]
        assert curve.growth_rate[index] == pytest.approx(max(rates), rel=1e-6)
        # each kappa has the poles of the phases h psi + kappa: the one that the strip gives to k is among them
        assert rates[curve.growth_nodal_diameter[index]] == pytest.approx(max(rates), rel=1e-6)


@pytest.mark.parametrize(("law", "harmonics"), [("two_sliders", 1), ("two_sliders", 3), ("cone", 2)])
def test_sliders_that_static_traction_moves_change_no_pole(law, harmonics):
    """Stiff contacts: the sliders stand off their origin, and the rates are those of the springs of the ring."""
    stiff = {"normal_stiffness": 600.0, "tangential_stiffness": 400.0, "friction": 0.05}
    modal, contact, curve, options = blade_curve(STUCK, harmonics=harmonics, law=law, **stiff)
    mean = curve.relative_displacement[:, 0, :, :2].real, -curve.contact_force[:, 0, :, :2].real / 200.0
    assert np.abs(mean[0] - mean[1]).max() > 1.0  # where the sliders stand
    assert curve.termination.complete
    assert curve.stable.all()
    assert (curve.sticking == 2).all()
    springs = np.tile([200.0, 200.0, 300.0], 2)
    rates = []
    for n in range(modal.n_blades // 2 + 1):
        motion = modal.right - np.exp(1j * modal.phase(n)) * modal.left
        stiffness = np.diag(modal.angular_frequency**2) + motion.conj().T @ (springs[:, None] * motion)
        size = len(stiffness)
        rates.append(
            np.linalg.eigvals(
                np.block([[np.zeros((size, size)), np.eye(size)], [-stiffness, -np.diag(modal.damping)]])
            ).real.max()
        )
    assert curve.growth_rate == pytest.approx(np.full(curve.points, max(rates)), rel=1e-6)
    balance = build_harmonic_balance(modal, contact, Excitation(1, 1.0), options)
    for index in range(0, curve.points, 9):
        unknown = balance.unknown(to_real(curve.relative_displacement[index]))
        residual = balance.evaluate(unknown, 2.0 * np.pi * curve.frequency_hz[index]).residual
        assert balance.relative_error(residual, unknown) < 1e-11


def test_continuous_where_contacts_begin_to_open():
    """Contacts without friction: at their first opening the stiffness changes for a short time only."""
    _, _, curve, _ = blade_curve(0.25, tangential_stiffness=0.0, friction=0.0, damping_ratio=0.02)
    opens = curve.separating > 0
    edges = np.flatnonzero(opens[1:] != opens[:-1])
    assert edges.size >= 2
    for edge in (edges[0], edges[-1]):
        linear, nonlinear = curve.growth_rate[edge : edge + 2][:: 1 if opens[edge + 1] else -1]
        assert nonlinear == pytest.approx(linear, rel=0.1)


@pytest.mark.parametrize("interference", [-0.3, 6.0])
def test_every_stable_point_has_a_negative_growth_rate(interference):
    """Slipping and opening contacts too, from far below the resonance on."""
    _, _, curve, _ = blade_curve(interference, frequency=(0.05, 0.3))
    assert np.isfinite(curve.growth_rate).all()
    assert ((curve.growth_rate > 0.0) <= ~curve.stable).all()
    assert (curve.growth_rate[curve.stable] < 0.0).all()
