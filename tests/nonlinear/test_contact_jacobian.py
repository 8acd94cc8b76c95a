"""Jacobians of the contact elements against finite differences, in every state and at random states."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nonlinear import ContactParameters, SolverOptions
from nonlinear.contact.element_choice import contact_element
from nonlinear.contact.parameters import LIFT_OFF, SLIP, STICK


def build(contact, integration, harmonics, samples=257):
    options = SolverOptions((1.0, 2.0), harmonics=harmonics, integration=integration, samples=samples)
    return contact_element(contact, harmonics, options)


def directional_error(element, rows, direction, step):
    """Relative difference between J d and the central difference of the force along d."""
    forward, backward = element.evaluate(rows + step * direction), element.evaluate(rows - step * direction)
    numerical = (forward.force - backward.force) / (2.0 * step)
    analytic = np.einsum("kabij,jkb->ika", element.evaluate(rows).jacobian, direction)
    return np.max(np.abs(numerical - analytic)) / max(np.max(np.abs(analytic)), 1.0)


CASES = [("exact", "two_sliders"), ("exact", "cone"), ("sampled", "two_sliders"), ("sampled", "cone")]


@pytest.mark.parametrize(("integration", "law"), CASES)
@pytest.mark.parametrize(
    ("interference", "amplitude", "static", "expected"),
    [
        (-50.0, 1.0, 0.0, LIFT_OFF),  # open all the time
        (50.0, 1.0, 0.0, STICK),  # full stick, static force as it is
        (6.0, 0.5, 40.0, STICK),  # full stick, static force at its upper limit
        (6.0, 0.5, -40.0, STICK),  # and at its lower limit
        (6.0, 3.0, 0.0, SLIP),  # stick and slip
        (1.0, 1.5, 0.2, LIFT_OFF),  # stick, slip and lift-off
        (-1.0, 2.0, 0.0, LIFT_OFF),  # a gap that closes
    ],
)
def test_every_state(integration, law, interference, amplitude, static, expected):
    contact = ContactParameters.shared(
        1, normal_stiffness=2.0, tangential_stiffness=3.0, friction=0.4, interference=interference, law=law
    )
    element = build(contact, integration, 2)
    rng = np.random.default_rng(11)
    rows = amplitude * np.array([0.0, 0.7, -0.7, 0.1, 0.12])[:, None, None] * (1 + 0.3 * rng.random((5, 1, 3)))
    rows[:, :, 2] = 0.9 * np.roll(rows[:, :, 2], 1, axis=0)
    rows[0, :, 0] = static
    rows[0, :, 2] = 0.0
    result = element.evaluate(rows)
    assert result.state[0] == expected
    for _ in range(5):
        assert directional_error(element, rows, rng.normal(size=rows.shape), 1e-6) < 2e-8


@settings(max_examples=100, deadline=None, derandomize=True)
@given(
    st.integers(0, 2**32 - 1),
    st.sampled_from([1, 2, 3, 5]),
    st.sampled_from(CASES),
    st.floats(0.0, 3.0),
    st.floats(-2.0, 2.0),
)
def test_random_states(seed, harmonics, case, friction, interference):
    integration, law = case
    rng = np.random.default_rng(seed)
    contact = ContactParameters.shared(
        3, normal_stiffness=6.0, tangential_stiffness=5.0, friction=friction, interference=interference, law=law
    )
    element = build(contact, integration, harmonics)
    rows = rng.normal(size=(2 * harmonics + 1, 3, 3)) / (1.0 + np.arange(2 * harmonics + 1)[:, None, None] // 2)
    direction = rng.normal(size=rows.shape)
    # A kink may lie within the difference: a short step on one of several scales must see none. Under the cone a
    # slider may take many periods to come to rest, and its Jacobian is that of the last of them.
    allowed = 1e-4 if case == ("exact", "cone") else 1e-6
    assert min(directional_error(element, rows, direction, step) for step in (1e-5, 1e-6, 1e-7, 1e-8)) < allowed


def test_derivative_of_the_moving_restart():
    """Only the exact element knows that the re-contact time moves: sampling does not converge to its Jacobian."""
    contact = ContactParameters.shared(
        1, normal_stiffness=2.0, tangential_stiffness=3.0, friction=5.0, interference=-0.2, law="two_sliders"
    )
    rows = np.zeros((3, 1, 3))
    rows[1, 0], rows[2, 0] = [0.5, 0.0, 1.0], [0.8, 0.0, 0.0]
    exact = build(contact, "exact", 1).evaluate(rows)
    fine = build(contact, "sampled", 1, 65536).evaluate(rows)
    assert fine.force == pytest.approx(exact.force, abs=1e-4)
    assert np.max(np.abs(fine.jacobian - exact.jacobian)) > 0.05
