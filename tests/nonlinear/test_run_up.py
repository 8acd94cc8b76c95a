"""Sweeps of the excitation: Lewis' problem, a Jenkins slider integrated directly, a slow sweep beside the balance."""

import numpy as np
import pytest
from lumped import lumped_blade
from scipy.integrate import solve_ivp

from nonlinear import ContactParameters, Excitation, SolverOptions, forced_response
from nonlinear.time_integration.ring import Ring
from nonlinear.time_integration.run_up import half_bandwidth, run_up
from rom import ReducedModel, modal_model

NOWHERE = np.zeros((1, 3))
HZ, OMEGA = 100.0, 2.0 * np.pi * 100.0
# r = 2 pi (df/dt) / (zeta w)^2, peak over the steady peak, half bandwidths that it comes late
LEWIS = [(2.0, 0.82287, 2.052), (10.0, 0.57059, 5.600), (50.0, 0.32740, 13.86)]


def single(direction: int, damping: float, **contact: float) -> Ring:
    """A mass on a spring that its contact touches in the tangential (0) or normal (2) direction."""
    row = np.zeros((3, 1))
    row[direction] = 1.0
    model = ReducedModel.from_matrices(np.eye(1), np.array([[OMEGA**2]]), row, [1.0], contact_position=NOWHERE)
    values = {"normal_stiffness": 1.0, "tangential_stiffness": 1.0, "friction": 0.3, **contact}
    return Ring(modal_model(model, damping_ratio=damping), ContactParameters.shared(1, **values), Excitation(0, 1.0))


@pytest.mark.parametrize(("r", "share", "late"), LEWIS)
def test_a_linear_resonance_is_passed_as_lewis_says(r: float, share: float, late: float) -> None:
    """Up and down differ by the finite damping; their mean is that of a small one."""
    damping = 2e-3
    ring = single(2, damping, interference=-1.0)
    band, steady = half_bandwidth(ring), 1.0 / (2.0 * damping * OMEGA**2)
    assert band == pytest.approx(damping * HZ)
    rate, found = r * (damping * OMEGA) ** 2 / (2.0 * np.pi), []
    for way in (1.0, -1.0):
        sweep = run_up(ring, (HZ - 25.0 * way * band, HZ + (late + 3.0) * way * band), rate)
        assert sweep.rate_hz_per_s == pytest.approx(way * rate)
        assert np.all(sweep.open_share == 1.0)
        found.append((sweep.envelope_m[sweep.peak] / steady, way * (sweep.frequency_hz[sweep.peak] - HZ) / band))
    assert np.mean(found, axis=0) == pytest.approx((share, late), rel=2e-2)
    assert np.mean(found, axis=0)[0] == pytest.approx(share, rel=1e-3 if r < 50.0 else 3e-3)


def test_a_slider_in_a_sweep_is_that_of_direct_integration() -> None:
    """x'' + 2 zeta w x' + w^2 x + T = cos(phi), T of a spring with a Coulomb slider, by an adaptive method."""
    damping, stiffness, limit, rate, ends = 1e-2, 0.05 * OMEGA**2, 0.6, 15.0, (98.0, 106.0)
    ring = single(0, damping, tangential_stiffness=stiffness, friction=1.0, preload=limit)
    sweep = run_up(ring, ends, rate)

    def slope(t: float, state: np.ndarray, stuck: bool, side: float) -> list[float]:
        x, speed, traction = state
        phase = 2.0 * np.pi * (ends[0] * t + 0.5 * rate * max(t, 0.0) ** 2)
        held = traction if stuck else side * limit
        force = np.cos(phase) - OMEGA**2 * x - 2.0 * damping * OMEGA * speed - held
        return [speed, force, stiffness * speed if stuck else 0.0]

    def slips(t: float, state: np.ndarray, *_: object) -> float:
        return abs(state[2]) - limit

    def turns(t: float, state: np.ndarray, *_: object) -> float:
        return state[1]

    slips.terminal, slips.direction, turns.terminal = True, 1.0, True  # type: ignore[attr-defined]
    settled = np.ceil(8.0 / (2.0 * np.pi * damping)) / ends[0]  # whole periods, from rest
    time, times, places = -settled, [np.zeros(1)], [np.zeros(1)]
    state, stuck, side, end = np.zeros(3), True, 1.0, (ends[1] - ends[0]) / rate
    while time < end - 1e-12:
        event = slips if stuck else turns
        part = solve_ivp(
            slope,
            (time, end),
            state,
            "DOP853",
            args=(stuck, side),
            events=event,
            rtol=1e-9,
            atol=1e-14,
            max_step=2e-4,
        )
        times.append(part.t[1:])
        places.append(part.y[0, 1:])
        time, state = float(part.t[-1]), part.y[:, -1].copy()
        if part.status == 1:
            side = float(np.sign(state[2])) if stuck else side
            state[2], stuck = side * limit * (1.0 if stuck else 1.0 - 1e-12), not stuck
    t, x = np.concatenate(times), np.abs(np.concatenate(places))
    assert sweep.slip_share.max() > 0.2
    for k in (*range(0, len(sweep.time_s), 8), sweep.peak):
        within = np.abs(t - sweep.time_s[k]) < 0.5 / sweep.frequency_hz[k]
        assert sweep.envelope_m[k] == pytest.approx(x[within].max(), rel=1e-2)


def test_a_slow_sweep_of_a_ring_has_the_peak_of_the_balance() -> None:
    """Three blades with sliders between them, seventh harmonic in the balance."""
    modal = modal_model(lumped_blade(12), damping_ratio=0.02)
    contact = ContactParameters.shared(
        modal.n_contacts, normal_stiffness=2.0, tangential_stiffness=0.4, friction=0.4, interference=0.2
    )
    excitation, lowest = Excitation(4, 0.05), float(modal.angular_frequency[0]) / (2.0 * np.pi)
    ring, ends = Ring(modal, contact, excitation), (1.1 * lowest, 1.6 * lowest)
    options = SolverOptions(ends, harmonics=7, stability="folds", detached=False, search="off", truncation=False)
    steady = forced_response(modal, contact, excitation, options)
    top = int(np.argmax(steady.amplitude_m))
    assert 0 < top < len(steady.amplitude_m) - 1
    sweep = run_up(ring, ends, 1.0 * half_bandwidth(ring) ** 2)
    assert sweep.n_blades == 3
    assert sweep.slip_share.max() > 0.05
    assert sweep.envelope_m.max() == pytest.approx(steady.amplitude_m[top], rel=2e-2)
    assert sweep.frequency_hz[sweep.peak] == pytest.approx(steady.frequency_hz[top], rel=2e-2)
