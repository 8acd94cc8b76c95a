"""The position from which the sliders start: every element, the linear segments and the hysteresis loops know it."""

from dataclasses import replace

import numpy as np
import pytest
from lumped import lumped_blade

from nonlinear import ContactError, ContactParameters, Excitation, SolverOptions, contact_cycle
from nonlinear.contact.element_choice import contact_element
from nonlinear.contact.fourier import basis_table, to_complex
from nonlinear.harmonic_balance.initial_solution import solve_at, static_displacement
from nonlinear.response_solver import build_harmonic_balance, forced_response
from rom import modal_model
from rom.cyclic.receptance import RelativeReceptance

LAWS = ("two_sliders", "cone")
SAMPLES = 2048


def parameters(law: str, **changes: float) -> ContactParameters:
    values = {"normal_stiffness": 3.0, "tangential_stiffness": 2.0, "friction": 0.5, "interference": 2.0} | changes
    contact = ContactParameters.shared(3, **values, law=law, area=None)  # type: ignore[arg-type]
    origin = np.array([[0.3, -0.2], [0.9, 0.4], [-3.0, 2.0]])  # of rest, near the limit, far beyond it
    return replace(contact, slider_origin=origin)


def periodic_motion(harmonics: int) -> np.ndarray:
    rows = 0.15 * np.random.default_rng(3).normal(size=(2 * harmonics + 1, 3, 3))
    rows[1, 0] *= 8.0  # the first node slips
    return rows


def marched(rows: np.ndarray, contact: ContactParameters, node: int) -> np.ndarray:
    """T over the last of some periods (samples, 2): radial return from the origin, written out."""
    table = basis_table((len(rows) - 1) // 2, SAMPLES)
    u, normal = table @ rows[:, node, :2], table @ rows[:, node, 2]
    kt = contact.tangential_stiffness[node]
    limits = contact.friction[node] * np.maximum(contact.normal_stiffness[node] * (2.0 + normal), 0.0)
    w, traction = contact.slider_origin[node].copy(), np.empty_like(u)
    for _ in range(4):
        for k, limit in enumerate(limits):
            trial = kt * (u[k] - w)
            size = np.abs(trial) if contact.law == "two_sliders" else np.full(2, np.hypot(*trial))
            traction[k] = trial * np.minimum(1.0, limit / np.maximum(size, 1e-300))
            w = u[k] - traction[k] / kt
    return traction


@pytest.mark.parametrize("integration", ["exact", "sampled"])
@pytest.mark.parametrize("law", LAWS)
def test_forces_are_those_of_a_slider_marched_from_its_origin(law: str, integration: str) -> None:
    contact, rows = parameters(law), periodic_motion(2)
    options = SolverOptions((1.0, 2.0), harmonics=2, integration=integration, samples=SAMPLES)  # type: ignore[arg-type]
    found = contact_element(contact, 2, options).evaluate(rows)
    cycle = contact_cycle(to_complex(rows), contact, samples=SAMPLES)
    for node in range(3):
        expected = marched(rows, contact, node)
        np.testing.assert_allclose(-found.force[0, node, :2], expected.mean(axis=0), atol=3e-3)
        np.testing.assert_allclose(cycle.force[:, node, :2], expected, atol=3e-3)
    assert found.state.tolist() == [1, 0, 0]
    np.testing.assert_allclose(cycle.displacement[0], rows[[0, 1, 3]].sum(axis=0))


@pytest.mark.parametrize("law", LAWS)
def test_linear_segments_and_equilibrium_know_the_origin(law: str) -> None:
    modal = modal_model(lumped_blade(n_contacts=3), damping_ratio=0.01)
    contact = parameters(law, friction=1.0)
    contact = replace(contact, slider_origin=0.2 * contact.slider_origin)
    options = SolverOptions((0.1, 0.4), detached=False, truncation=False)
    balance = build_harmonic_balance(modal, contact, Excitation(3, 0.01), options)
    curve = forced_response(modal, contact, Excitation(3, 0.01), options)
    at = curve.points // 2
    solved = solve_at(balance, 2.0 * np.pi * curve.frequency_hz[at], np.zeros(balance.size), options)
    assert curve.iterations[at] == 0  # from the linear equations
    stored = to_complex(balance.displacement(solved.solution))
    np.testing.assert_allclose(curve.relative_displacement[at], stored, atol=1e-11)
    np.testing.assert_allclose(curve.contact_force[at], to_complex(balance.forces(solved.solution).force), atol=1e-10)
    static = static_displacement(RelativeReceptance(modal, balance.receptance.phase, (0, 1), 0.0), contact, options)
    np.testing.assert_allclose(static, stored[0].real, atol=1e-11)
    assert np.abs(static[:, :2]).max() > 1e-3


def test_a_wrong_origin_is_refused() -> None:
    contact = parameters("cone")
    for wrong in (np.zeros(3), np.zeros((2, 2)), np.full((3, 2), np.nan)):
        with pytest.raises(ContactError, match="slider_origin"):
            replace(contact, slider_origin=wrong)
