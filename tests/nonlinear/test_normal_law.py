"""The normal law N = max(N0 + kn (v0 + d_n), 0), written out here, against all elements and other users of it."""

import numpy as np
import pytest

from nonlinear import ContactParameters, SolverOptions, contact_cycle
from nonlinear.contact.element_choice import contact_element
from nonlinear.contact.fourier import basis_table, to_complex
from nonlinear.contact.parameters import LIFT_OFF

KN, KT, MU = 2.0, 3.0, 0.4
SAMPLES = 4096


def parameters(law):
    """Nodes that are always pressed, always open and both in turn, with and without preload."""
    interference = np.array([9.0, -9.0, 0.3, -0.3, 9.0, -9.0, 0.3, -0.3])
    preload = np.array([0.0, 0.0, 0.0, 0.0, 0.7, 0.7, 0.7, 0.7])
    one = np.ones(interference.size)
    return ContactParameters(KN * one, KT * one, MU * one, interference, preload, law)


def motion(contact, harmonics):
    rng = np.random.default_rng(harmonics)
    return rng.normal(size=(2 * harmonics + 1, contact.n_contacts, 3)) / 2.0


def load_in_time(contact, rows):
    """Closed form in time, (samples, n_c)."""
    normal = basis_table(rows.shape[0] // 2, SAMPLES) @ rows[:, :, 2]
    return np.maximum(contact.preload + KN * (contact.interference + normal), 0.0)


def coefficients(signal, harmonics):
    """Real Fourier coefficients of samples, (2H+1, n_c)."""
    table = basis_table(harmonics, SAMPLES)
    weight = np.append(1.0, np.full(2 * harmonics, 2.0))[:, None] / SAMPLES
    return weight * (table.T @ signal)


@pytest.mark.parametrize("law", ["two_sliders", "cone"])
@pytest.mark.parametrize("harmonics", [1, 3])
class TestPeriodicMotion:
    def test_every_element(self, law, harmonics):
        contact = parameters(law)
        rows = motion(contact, harmonics)
        load = load_in_time(contact, rows)
        expected = coefficients(contact.preload - load, harmonics)
        opens = (load <= 0.0).any(axis=0)
        assert opens.any()
        assert not opens.all()
        for integration, tolerance in (("exact", 1e-5), ("sampled", 1e-12)):
            options = SolverOptions((1.0, 2.0), harmonics=harmonics, integration=integration, samples=SAMPLES)
            result = contact_element(contact, harmonics, options).evaluate(rows)
            assert result.force[:, :, 2] == pytest.approx(expected, abs=tolerance)
            assert np.array_equal(result.state == LIFT_OFF, opens)

    def test_contact_cycle(self, law, harmonics):
        contact = parameters(law)
        rows = motion(contact, harmonics)
        cycle = contact_cycle(to_complex(rows), contact, samples=SAMPLES)
        load = load_in_time(contact, rows)
        assert cycle.force[:, :, 2] == pytest.approx(load, abs=1e-12)
        assert np.array_equal(cycle.state == LIFT_OFF, load <= 0.0)

    def test_slip_limit(self, law, harmonics):
        """|T| <= mu N in every sample, with N of the closed form, and |T| = mu N at some of them."""
        contact = parameters(law)
        rows = 4.0 * motion(contact, harmonics)
        cycle = contact_cycle(to_complex(rows), contact, samples=SAMPLES)
        traction = np.abs(cycle.force[:, :, :2])
        size = np.hypot(traction[:, :, 0], traction[:, :, 1]) if law == "cone" else traction.max(axis=2)
        limit = MU * load_in_time(contact, rows)
        assert np.all(size <= limit + 1e-12)
        slips = (np.abs(size - limit) < 1e-12) & (limit > 0.0)
        assert slips.any(axis=0)[limit.any(axis=0)].all()

    def test_load_coefficients(self, law, harmonics):
        contact = parameters(law)
        rows = motion(contact, harmonics)
        unclipped = basis_table(harmonics, SAMPLES) @ contact.load_coefficients(rows)
        assert np.maximum(unclipped, 0.0) == pytest.approx(load_in_time(contact, rows), abs=1e-12)


@pytest.mark.parametrize("law", ["two_sliders", "cone"])
def test_statics(law):
    contact = parameters(law)
    rows = motion(contact, 0)
    result = contact_element(contact, 0, SolverOptions((1.0, 2.0))).evaluate(rows)
    load = load_in_time(contact, rows)[0]
    round_off = 1e-12 * KN * np.abs(contact.interference).max()  # the largest term is kn v0, in no order of its own
    assert contact.preload - result.force[0, :, 2] == pytest.approx(load, abs=round_off)
    assert contact.normal_load(rows[0, :, 2]) == pytest.approx(load, abs=round_off)
    assert np.array_equal(result.state == LIFT_OFF, load <= 0.0)


def test_linear_segments():
    """The linear states of the contact: force and distance from the next change of state."""
    from lumped import oscillator

    from nonlinear import Excitation
    from nonlinear.continuation.linear_segments import LinearSegments
    from nonlinear.response_solver import build_harmonic_balance
    from rom import modal_model

    one = np.ones(1)
    contact = ContactParameters(KN * one, 0.0 * one, 0.0 * one, 0.5 * one, 0.7 * one)  # N0 + kn v0 = 1.7
    options = SolverOptions((0.1, 0.2), harmonics=1)
    balance = build_harmonic_balance(
        modal_model(oscillator(), damping_ratio=0.0), contact, Excitation(0, 1.0), options
    )
    segments = LinearSegments(balance, contact)
    for static, swing in ((0.2, 0.3), (-3.0, 0.4)):
        rows = np.zeros((3, 1, 3))
        rows[0, 0, 2], rows[1, 0, 2] = static, swing
        state = segments.state(rows)
        assert state is not None
        load = load_in_time(contact, rows)
        assert bool(state.pressed[0]) == bool(load.all())
        system = segments.system(state)
        assert system.forces(rows).force[:, :, 2] == pytest.approx(coefficients(contact.preload - load, 1), abs=1e-12)
        unclipped = 1.7 + KN * (static + np.array([swing, -swing]))
        assert system.margin(rows) == pytest.approx(np.abs(unclipped).min() / KN)
    rows[0, 0, 2], rows[1, 0, 2] = -0.85, 0.1  # opens and closes
    assert segments.state(rows) is None


@pytest.mark.parametrize("law", ["two_sliders", "cone"])
def test_slider_memory_sees_separation_where_the_element_does(law):
    """A slider that an earlier event has set exists exactly where the closed form of the load or of slip says so."""
    from nonlinear.stability.slider_memory import MemorySampler

    contact = parameters(law)
    rows = motion(contact, 1)
    rows[:, :, :2] *= 1e-6  # too small to slip under any load but the one near separation
    memory = MemorySampler(contact, 1).memory(rows)
    load = load_in_time(contact, rows)
    partly = np.flatnonzero((load <= 0.0).any(axis=0) & (load > 0.0).any(axis=0))
    assert memory is not None
    assert set(partly) <= set(memory.node.tolist())
    assert not set(memory.node.tolist()) & set(np.flatnonzero((load > 1.0).all(axis=0)))
