"""Limit cycles of waves that a flow feeds: closed forms, energy, scaling, the onset, outcomes."""

from dataclasses import replace

import numpy as np
import pytest
from lumped import lumped_blade, oscillator
from scipy.optimize import brentq
from turning import turning

from nonlinear import ContactParameters, Excitation, SolverOptions
from nonlinear.contact.fourier import to_complex, to_real
from nonlinear.nonlinear_modes.limit_cycles import self_excitation
from nonlinear.response_solver import build_harmonic_balance
from rom import InfluenceCoefficients, modal_model
from rom.cyclic.natural_frequencies import aeroelastic_modes

N = 12
QUIET = SolverOptions((0.05, 0.5), harmonics=1, stability="folds")
IN_RING = replace(QUIET, harmonics=3, stability="ring")
SHROUD = {"normal_stiffness": 6.0, "tangential_stiffness": 4.0, "friction": 0.3, "interference": 0.3}


def fed_oscillator(fed):
    """m = k = 1 with the damping coefficient -fed, and a slider with kt = limit = 1."""
    flow = InfluenceCoefficients(1, np.array([0]), np.array([1j * fed]))
    modal = modal_model(oscillator(n_blades=4), damping_ratio=0.0, influence=[flow])
    slider = ContactParameters.shared(1, normal_stiffness=0.0, tangential_stiffness=1.0, friction=1.0, preload=1.0)
    return modal, slider


def shrouded(strength=1.0, coriolis=False, **contact):
    """A ring whose first family the flow feeds in backward waves."""
    flow = InfluenceCoefficients(1, np.array([-1, 0, 1]), strength * np.array([-0.03, 0.02j, 0.03]))
    model = turning(N) if coriolis else lumped_blade(N)
    modal = modal_model(model, damping_ratio=0.005, influence=[flow], coriolis=coriolis)
    return modal, ContactParameters.shared(2, **(SHROUD | contact))


@pytest.mark.parametrize("fed", [0.05, 0.1, 0.2, 0.26])
def test_one_harmonic_of_a_slider_in_closed_form(fed):
    """fed w X = b1(X), w^2 = k + a1(X) / X of a slider in cycles of the amplitude X."""

    def frequency(size):
        angle = np.arccos(1.0 - 2.0 / size)
        return np.sqrt(1.0 + (angle - np.sin(angle) * np.cos(angle)) / np.pi)

    def excess(size):
        return fed * frequency(size) * size - 4.0 * (1.0 - 1.0 / size) / np.pi

    sizes = np.geomspace(1.0001, 200.0, 4000)
    signs = np.sign([excess(size) for size in sizes])
    roots = [brentq(excess, sizes[i], sizes[i + 1], xtol=1e-14) for i in np.flatnonzero(np.diff(signs))]
    found = self_excitation(*fed_oscillator(fed), 1, QUIET)
    assert len(roots) == 2
    assert [cycle.vibration_m for cycle in found.cycles] == pytest.approx(roots, rel=1e-9)
    assert [2.0 * np.pi * cycle.frequency_hz for cycle in found.cycles] == pytest.approx(
        [frequency(size) for size in roots], rel=1e-9
    )
    assert [cycle.attracting for cycle in found.cycles] == [True, False]
    assert (found.held, found.threshold) == (found.cycles[0], found.cycles[1])
    if fed == 0.1:
        assert roots == pytest.approx([1.142310, 11.370195], abs=1e-6)


def test_more_than_friction_can_take_up_grows_for_ever():
    found = self_excitation(*fed_oscillator(0.2630), 1, QUIET)
    assert (found.cycles, found.outcome) == ((), "grows for ever")


@pytest.mark.parametrize(("n", "coriolis"), [(3, False), (-4, False), (3, True)])
def test_cycles_of_a_ring_solve_the_balance_without_excitation_and_keep_the_energy(n, coriolis):
    modal, contact = shrouded(coriolis=coriolis)
    found = self_excitation(modal, contact, 3 if n > 0 else n, IN_RING)
    if n < 0:  # forward waves are damped
        assert (found.damping_ratio > 0.0, found.outcome) == (True, "decays")
        return
    (cycle,) = found.cycles[:1]
    assert found.damping_ratio < 0.0
    assert cycle.attracting
    assert cycle.flow_j == pytest.approx(cycle.damping_j + cycle.friction_j, rel=1e-9)
    balance = build_harmonic_balance(modal, contact, Excitation(n, 0.0), IN_RING)
    motion = np.einsum("hrm,hm->hr", balance.receptance.modes.relative, cycle.coordinates)
    at = balance.evaluate(to_real(motion).reshape(-1), 2.0 * np.pi * cycle.frequency_hz)
    assert np.abs(at.residual).max() < 1e-9 * np.abs(motion).max()
    assert np.abs(to_complex(to_real(motion))[1]).max() > 0.0
    assert np.isfinite(cycle.growth_rate)


def test_cycles_scale_with_the_interference():
    one = self_excitation(*shrouded(), 3, QUIET).cycles
    other = self_excitation(*shrouded(interference=0.6), 3, QUIET).cycles
    assert len(one) == len(other) > 0
    for small, large in zip(one, other, strict=True):
        assert large.frequency_hz == pytest.approx(small.frequency_hz, rel=1e-9)
        assert large.vibration_m == pytest.approx(2.0 * small.vibration_m, rel=1e-8)
        assert large.friction_j == pytest.approx(4.0 * small.friction_j, rel=1e-8)


@pytest.mark.parametrize("coriolis", [False, True])
def test_flutter_begins_where_the_stuck_wave_has_no_damping(coriolis):
    def leading(strength):
        modal, contact = shrouded(strength, coriolis)
        springs = {"normal": contact.normal_stiffness, "tangential": contact.tangential_stiffness}
        model = turning(N) if coriolis else lumped_blade(N)
        values = aeroelastic_modes(model, modal, 3, count=4, **springs)
        frequency = 2.0 * np.pi * self_excitation(modal, contact, 3, QUIET).frequency_hz
        return float(values[np.argmin(np.abs(values.imag - frequency))].real)

    onset = brentq(leading, 0.01, 1.0, xtol=1e-12)
    for strength, flutters in ((onset * (1.0 - 1e-6), False), (onset * (1.0 + 1e-6), True)):
        found = self_excitation(*shrouded(strength, coriolis), 3, QUIET)
        assert (found.damping_ratio < 0.0) == flutters
        assert abs(found.damping_ratio) < 1e-6


def test_a_gap_lets_the_wave_grow_until_the_shrouds_touch():
    found = self_excitation(*shrouded(interference=-0.1), 3, QUIET)
    assert found.damping_ratio < 0.0
    assert found.held is None or found.held.vibration_m > found.linear_limit_m


def test_contacts_that_are_not_there_hold_nothing():
    found = self_excitation(*shrouded(normal_stiffness=0.0, tangential_stiffness=0.0), 3, QUIET)
    assert (found.mode, found.linear_limit_m, found.outcome) == (None, np.inf, "grows for ever")
