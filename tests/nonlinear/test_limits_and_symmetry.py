"""Properties of the response: linear limits, homogeneity, symmetry of the travelling wave, energy balance."""

import numpy as np
import pytest
from lumped import lumped_blade

from nonlinear import ContactParameters, Excitation, SolverOptions, forced_response
from rom import linear_response, modal_model

RANGE = (0.10, 0.70)
NORMAL, TANGENTIAL = 4.0, 3.0


def contact(interference, friction=0.4, law="two_sliders", n_contacts=2):
    return ContactParameters.shared(
        n_contacts,
        normal_stiffness=NORMAL,
        tangential_stiffness=TANGENTIAL,
        friction=friction,
        interference=interference,
        law=law,
    )


def solve(interference, *, engine_order=4, force=1.0, harmonics=1, modal=None, **keys):
    modal = modal or modal_model(lumped_blade(), damping_ratio=0.01)
    options = {key: keys.pop(key) for key in ("integration", "samples", "method") if key in keys}
    return forced_response(
        modal,
        contact(interference, **keys),
        Excitation(engine_order, force),
        SolverOptions(
            RANGE,
            harmonics=harmonics,
            detached=False,
            stability="folds",
            truncation=False,
            search="off",
            **options,
        ),
    )


def relative_difference(curve, linear):
    return np.max(np.abs(curve.output[:, 1] - linear)) / np.max(np.abs(linear))


@pytest.mark.parametrize("law", ["two_sliders", "cone"])
@pytest.mark.parametrize("harmonics", [1, 3])
def test_far_gap_is_the_linear_free_response(law, harmonics):
    modal = modal_model(lumped_blade(), damping_ratio=0.01)
    curve = solve(-1e4, law=law, harmonics=harmonics, modal=modal)
    linear = linear_response(modal, curve.frequency_hz, phase=modal.phase(4), force=1.0)
    assert curve.termination.complete
    assert relative_difference(curve, linear) < 1e-12
    assert np.all(curve.separating == 2)
    assert np.all(curve.dissipated_j == 0.0)


@pytest.mark.parametrize("law", ["two_sliders", "cone"])
@pytest.mark.parametrize("harmonics", [1, 3])
def test_deep_interference_is_the_linear_stuck_response(law, harmonics):
    modal = modal_model(lumped_blade(), damping_ratio=0.01)
    curve = solve(1e4, law=law, harmonics=harmonics, modal=modal)
    linear = linear_response(
        modal, curve.frequency_hz, phase=modal.phase(4), force=1.0, normal=NORMAL / 2, tangential=TANGENTIAL / 2
    )
    assert curve.termination.complete
    assert relative_difference(curve, linear) < 1e-10
    assert np.all(curve.sticking == 2)


def test_no_friction_slides_on_normal_springs():
    modal = modal_model(lumped_blade(), damping_ratio=0.01)
    curve = solve(1e4, friction=0.0, modal=modal)
    linear = linear_response(modal, curve.frequency_hz, phase=modal.phase(4), force=1.0, normal=NORMAL / 2)
    assert relative_difference(curve, linear) < 1e-10
    assert np.max(np.abs(curve.dissipated_j)) < 1e-11 * np.max(np.abs(curve.amplitude_m))


def test_very_large_friction_never_slips_while_pressed():
    modal = modal_model(lumped_blade(), damping_ratio=0.01)
    curve = solve(40.0, friction=1e9, modal=modal)
    linear = linear_response(
        modal, curve.frequency_hz, phase=modal.phase(4), force=1.0, normal=NORMAL / 2, tangential=TANGENTIAL / 2
    )
    assert np.all(curve.slipping + curve.separating == 0)
    assert relative_difference(curve, linear) < 1e-10


@pytest.mark.parametrize(
    ("law", "interference"), [("two_sliders", -3.0), ("two_sliders", 0.0), ("two_sliders", 2.0), ("cone", 2.0)]
)
def test_homogeneous_in_force_and_interference(law, interference):
    one, scaled = solve(interference, law=law), solve(8.0 * interference, force=8.0, law=law)
    assert one.termination.complete
    assert scaled.points == one.points  # the step control sees no scale
    assert scaled.frequency_hz == pytest.approx(one.frequency_hz, rel=1e-10)
    assert scaled.output == pytest.approx(8.0 * one.output, rel=1e-8, abs=1e-9)
    assert scaled.peak.amplitude_m == pytest.approx(8.0 * one.peak.amplitude_m, rel=1e-9)


@pytest.mark.parametrize("interference", [-1.0, 1.0])
@pytest.mark.parametrize("engine_order", [1, 4])
def test_backward_wave_mirrors_the_forward_wave(interference, engine_order):
    """A blade that is symmetric under a half turn about its stacking axis cannot tell EO from N_b - EO."""
    forward = solve(interference, engine_order=engine_order, harmonics=3)
    backward = solve(interference, engine_order=12 - engine_order, harmonics=3)
    assert forward.termination.complete
    assert backward.peak.amplitude_m == pytest.approx(forward.peak.amplitude_m, rel=1e-9)
    assert backward.peak.frequency_hz == pytest.approx(forward.peak.frequency_hz, rel=1e-6)


def test_engine_orders_beyond_the_blade_count_are_aliased():
    for alias in (4 + 12, 4 + 36, 4 - 12):
        assert solve(1.0, engine_order=alias).amplitude_m == pytest.approx(solve(1.0).amplitude_m, rel=1e-10)


@pytest.mark.parametrize("engine_order", [0, 6, 12, 18])
def test_in_phase_and_opposite_phase(engine_order):
    """EO 0 and N_b / 2 (and their aliases) have a real travelling wave factor and are nothing special."""
    curve = solve(0.5, engine_order=engine_order, harmonics=3)
    assert curve.termination.complete
    assert curve.energy_error.max() < 1e-8


def test_direction_of_the_travelling_wave():
    """Blade j+1 carries exp(+i psi): in a linear ring of all blades it lags behind blade j by psi in theta.

    The full ring is solved with explicit contact springs between its blades and a force exp(i j psi) on blade j.
    """
    model = lumped_blade(n_blades=5)
    modal = modal_model(model, rayleigh=(0.02, 0.0))
    psi, n = 2.0 * np.pi * 2 / 5, model.size
    springs = np.tile([TANGENTIAL, TANGENTIAL, NORMAL], 2) / 2.0
    stiffness, force = np.zeros((5 * n, 5 * n)), np.zeros(5 * n, dtype=complex)
    for blade in range(5):
        own, after = slice(blade * n, (blade + 1) * n), slice((blade + 1) % 5 * n, ((blade + 1) % 5 + 1) * n)
        stiffness[own, own] += model.stiffness
        relative = np.zeros((6, 5 * n))
        relative[:, own] += model.contact_right
        relative[:, after] -= model.contact_left
        stiffness += relative.T @ (springs[:, None] * relative)
        force[own] = model.force_excitation * np.exp(1j * blade * psi)
    mass = np.kron(np.eye(5), model.mass)
    for hertz in (0.15, 0.2, 0.31):
        omega = 2.0 * np.pi * hertz
        ring = np.linalg.solve(stiffness - omega**2 * mass + 1j * omega * 0.02 * mass, force)
        one = linear_response(
            modal, [hertz], phase=modal.phase(2), force=1.0, normal=NORMAL / 2, tangential=TANGENTIAL / 2
        )
        tips = ring.reshape(5, n) @ model.outputs["tip"]
        assert tips[0] == pytest.approx(one[0], rel=1e-9)
        assert tips[1] == pytest.approx(one[0] * np.exp(1j * psi), rel=1e-9)


@pytest.mark.parametrize("interference", [-2.0, -0.5, 0.0, 0.3, 1.0, 5.0])
@pytest.mark.parametrize("harmonics", [1, 5])
def test_work_put_in_is_dissipated(interference, harmonics):
    curve = solve(interference, harmonics=harmonics)
    assert curve.termination.complete
    assert curve.energy_error.max() < 1e-8
    assert np.max(curve.dissipated_j) > 0.0
    assert np.all(curve.dissipated_j >= -1e-9 * np.max(curve.amplitude_m))


def test_friction_work_is_that_of_the_slipping_contact():
    """The work from the Fourier coefficients equals the integral of mu N |dw| over the slip in the time domain."""
    from nonlinear import contact_cycle

    parameters = contact(1.0)
    curve = solve(1.0, harmonics=3)
    at = int(np.argmax(curve.dissipated_j))
    cycle = contact_cycle(curve.relative_displacement[at], parameters, samples=16384)
    tangential = parameters.tangential_stiffness[:, None]
    slider = cycle.displacement[:, :, :2] - cycle.force[:, :, :2] / tangential
    moved = np.roll(slider, -1, axis=0) - slider
    mean_force = 0.5 * (cycle.force[:, :, :2] + np.roll(cycle.force[:, :, :2], -1, axis=0))
    assert (mean_force * moved).sum() == pytest.approx(curve.dissipated_j[at], rel=1e-5)
