"""The friction cone, exact to a stated error: against SciPy's integrators, symmetries, and whole curves."""

import numpy as np
import pytest
from cone_reference import PlaneSlider
from hypothesis import example, given, settings
from hypothesis import strategies as st

from nonlinear import ContactParameters, SolverOptions
from nonlinear.contact.cone_event_driven import FORCE_ERROR, EventDrivenCoulombCone
from nonlinear.contact.element_choice import contact_element
from nonlinear.contact.parameters import LIFT_OFF, SLIP, STICK

NORMAL, TANGENTIAL, FRICTION = 1.0, 3.0, 0.5


def cone(interference, harmonics):
    n = np.size(interference)
    contact = ContactParameters.shared(
        n,
        normal_stiffness=n * NORMAL,
        tangential_stiffness=n * TANGENTIAL,
        friction=FRICTION,
        interference=interference,
        law="cone",
    )
    return contact_element(contact, harmonics, SolverOptions((1.0, 2.0), harmonics=harmonics))


def motion(seed, harmonics, n_contacts):
    """Random coefficients that fall with the harmonic, (2H+1, n_c, 3)."""
    rows = np.random.default_rng(seed).normal(size=(2 * harmonics + 1, n_contacts, 3))
    return rows / (1.0 + np.arange(2 * harmonics + 1)[:, None, None] // 2)


def slip_work(rows, force):
    """Work per cycle that the motion puts into the tangential forces -f_R."""
    f, d = force[1::2] + 1j * force[2::2], rows[1::2] + 1j * rows[2::2]
    order = np.arange(1, f.shape[0] + 1)[:, None]
    return float(np.pi * (order * (f.conj() * d).imag).sum())


def test_it_is_the_default_of_the_cone():
    assert isinstance(cone([0.0], 1), EventDrivenCoulombCone)


@pytest.mark.parametrize(("harmonics", "nodes"), [(1, 5), (3, 3), (5, 3)])
def test_forces_and_work_of_a_general_integrator(harmonics, nodes):
    """Open part of the time, or slipping all the time, at random; to the error that the element states."""
    interference = np.random.default_rng(harmonics).choice([-0.3, 0.3, 1.2, 2.5], size=nodes)
    rows = motion(harmonics, harmonics, nodes)
    result = cone(interference, harmonics).evaluate(rows)
    assert {SLIP, LIFT_OFF} == set(result.state.tolist())
    for node in range(nodes):
        slider = PlaneSlider(rows[:, node], kn=NORMAL, kt=TANGENTIAL, mu=FRICTION, load=interference[node])
        force, work = slider.steady()
        assert np.abs(force - result.force[:, node, :2]).max() < FORCE_ERROR * TANGENTIAL * slider.largest
        assert slip_work(rows[:, node, :2], result.force[:, node, :2]) == pytest.approx(work, rel=1e-10, abs=1e-12)


@example(12336131, 1, 0.0, 0.0, 2.464445)  # the end of slip lies far beyond the panel tried first
@settings(max_examples=40, deadline=None)
@given(
    st.integers(0, 2**32 - 1),
    st.sampled_from([1, 2, 3, 5]),
    st.floats(-1.0, 3.0),
    st.floats(0.0, 6.28),
    st.floats(0.0, 6.28),
)
def test_no_direction_and_no_instant_is_special(seed, harmonics, interference, turn, shift):
    """Turning the plane turns the force, a later start of the cycle shifts it: all event searches begin elsewhere."""
    rows, element = motion(seed, harmonics, 3), cone(np.full(3, interference), harmonics)
    plain = element.evaluate(rows)
    matrix = np.eye(3)
    matrix[:2, :2] = [[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]]
    later = np.exp(1j * shift * np.arange(1, harmonics + 1))[:, None, None]

    def moved(values):
        result = values @ matrix.T
        complex_values = (result[1::2] + 1j * result[2::2]) * later
        result[1::2], result[2::2] = complex_values.real, complex_values.imag
        return result

    there = element.evaluate(moved(rows))
    rests = there.state == STICK  # where a slider comes to rest depends on where its cycle begins
    assert np.array_equal(there.state, plain.state)
    scale = TANGENTIAL * np.abs(rows).max() * harmonics
    assert np.abs(there.force - moved(plain.force))[:, ~rests].max(initial=0.0) < 1e-9 * scale


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1), st.sampled_from([1, 2, 5, 7]))
def test_finite_and_dissipating_for_parameters_of_any_size(seed, harmonics):
    rng = np.random.default_rng(seed)
    n = 12
    kn, kt = rng.choice([0.0, 1e-9, 1.0, 1e9], size=n), rng.choice([0.0, 1e-12, 1.0, 1e6], size=n)
    mu, v0 = rng.choice([0.0, 1e-12, 0.3, 1e6], size=n), rng.choice([0.0, -1.0, 1.0, 1e-9, 100.0], size=n)
    contact = ContactParameters(kn, kt, mu, v0, rng.choice([0.0, 1e-12, 1.0, 1e6], size=n), "cone")
    rows = motion(seed, harmonics, n) * rng.choice([0.0, 1e-15, 1e-6, 1.0, 1e3], size=n)[:, None]
    rows[:, rng.random(n) < 0.3, 1] = 0.0  # along a line
    result = EventDrivenCoulombCone(contact, harmonics).evaluate(rows)
    assert np.isfinite(result.force).all()
    assert np.isfinite(result.jacobian).all()
    for node in range(n):
        force = result.force[:, node, :2]
        size = np.abs(force).max() * np.abs(rows[:, node, :2]).max()
        assert slip_work(rows[:, node, :2], force) >= -1e-9 * size * harmonics**2


@pytest.mark.parametrize("amplitude", [0.98, 0.999, 0.9999])
@pytest.mark.parametrize("turn", [0.0, 0.7, 2.0])
def test_a_slider_comes_to_rest_between_two_circles(amplitude, turn):
    """Motion A cos(theta) along a line and a far static offset across it, under constant load, kt = mu N = 1.

    Each period draws the slider in at both ends of the line, at last to where both are at the distance 1 from it: the
    static force across is sqrt(1 - A^2), whatever the offset, and there is none along the line. (With a smaller A it
    is at rest before, where the last of the ends left it.)
    """
    one = np.ones(1)
    contact = ContactParameters(0.0 * one, one, 0.5 * one, 0.0 * one, 2.0 * one, "cone")
    along, across = np.array([np.cos(turn), np.sin(turn)]), np.array([-np.sin(turn), np.cos(turn)])
    rows = np.zeros((3, 1, 3))
    rows[0, 0, :2], rows[1, 0, :2] = 3.0 * across, amplitude * along
    result = EventDrivenCoulombCone(contact, 1).evaluate(rows)
    assert result.state[0] == STICK
    force = -result.force[:, 0, :2]
    rest = np.sqrt(1.0 - amplitude**2)
    assert force[0] == pytest.approx(rest * across, abs=1e-11)
    assert force[1] == pytest.approx(amplitude * along, abs=1e-11)
    derivative = -np.einsum(
        "abij,jb->ia", result.jacobian[0], np.stack([0.0 * rows[0, 0], rows[1, 0] / amplitude, 0.0 * rows[2, 0]])
    )
    assert derivative[0, :2] == pytest.approx(-amplitude / rest * across, rel=1e-6, abs=1e-9)
    offset = -np.einsum("abij,jb->ia", result.jacobian[0], np.stack([rows[0, 0], 0.0 * rows[1, 0], 0.0 * rows[2, 0]]))
    assert offset[0, :2] == pytest.approx(0.0, abs=1e-6)


def rest_by_small_steps(rows, normal, tangential, friction, interference, samples=20_000, periods=40):
    """Place (2,) where a slider that starts at 0 rests: drawn in at every instant to its elastic limit."""
    theta = 2.0 * np.pi * np.arange(samples) / samples
    parts = [np.ones(samples)]
    for h in range(1, len(rows) // 2 + 1):
        parts += [np.cos(h * theta), -np.sin(h * theta)]
    path = np.array(parts).T @ rows
    limit = friction * normal * (interference + path[:, 2]) / tangential
    assert limit.min() > 0.0
    place = np.zeros(2)
    for _ in range(periods):
        before = place
        for target, most in zip(path[:, :2], limit, strict=True):
            away = place - target
            far = np.hypot(*away)
            if far > most:
                place = target + away * (most / far)
        if np.array_equal(place, before):
            break
    return place


@pytest.mark.parametrize(("seed", "harmonics", "node"), [(1560, 1, 0), (1024, 3, 1), (933, 3, 2)])
def test_it_rests_where_its_own_path_leads(seed, harmonics, node):
    """Not where Newton's method put it on trial, from where it does not move either.

    In these three random states the slider had made as many periods of its own path as are allowed before it
    was put aside for a trial. It did not move from there, so the trial was taken for the end: a wrong force.
    """
    rng = np.random.default_rng(seed + 10**6)
    friction, interference = rng.uniform(0.0, 3.0), rng.uniform(-2.0, 2.0)
    rows = motion(seed, harmonics, 3)[:, node : node + 1]
    normal, tangential = 2.0, 5.0 / 3.0
    contact = ContactParameters.shared(
        1,
        normal_stiffness=normal,
        tangential_stiffness=tangential,
        friction=friction,
        interference=interference,
        law="cone",
    )
    result = contact_element(contact, harmonics, SolverOptions((1.0, 2.0), harmonics=harmonics)).evaluate(rows)
    assert result.state[0] == STICK
    place = rows[0, 0, :2] + result.force[0, 0, :2] / tangential
    expected = rest_by_small_steps(rows[:, 0], normal, tangential, friction, interference)
    assert np.abs(place - expected).max() < 3e-4
