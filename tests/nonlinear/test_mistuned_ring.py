"""A mistuned ring: tuned curve, published case, dense ring in the time of one blade, time steps, highest factor."""

from dataclasses import replace

import numpy as np
import pytest

from nonlinear import ContactParameters, Excitation, OptionsError, SolverOptions, forced_response
from nonlinear.harmonic_balance.initial_solution import solve_at
from nonlinear.mistuned_ring.linear_sectors import LinearSectors
from nonlinear.mistuned_ring.mistuning import Mistuning, MistuningError, whitehead_bound
from nonlinear.mistuned_ring.ring_balance import RingBalance
from nonlinear.mistuned_ring.ring_receptance import RingReceptance
from nonlinear.mistuned_ring.ring_response import mistuned_response
from rom import ModalModel, ReducedModel, modal_model
from rom.cyclic.receptance import RelativeReceptance

Array = np.ndarray
ANCHOR = np.array([0.0091, -0.0003, 0.0060, -0.0072, -0.0016, 0.0083])  # stiffness 1 + d


def chain_blade(n_blades: int, damping_ratio: float = 0.005) -> ModalModel:
    """A mass on a spring, 1 kg and 1 N/m, with one contact node on either side that moves with it along t1."""
    one, face = np.ones(1), np.eye(3, 1)
    model = ReducedModel(np.eye(1), np.eye(1), face, np.zeros((1, 3)), one, {"tip": one}, face, n_blades=n_blades)
    return modal_model(model, damping_ratio=damping_ratio)


def chain_contact(stiffness: float, preload: float) -> ContactParameters:
    """A slider between neighbours, mu = 1."""
    return ContactParameters.shared(
        1, normal_stiffness=0.0, tangential_stiffness=stiffness, friction=1.0, preload=preload
    )


def full_blade(n_blades: int, n_contacts: int = 2, size: int = 10) -> ReducedModel:
    """A blade with random modes, one at 50 Hz, the others above 300 Hz, and random faces."""
    rng = np.random.default_rng(7)
    modes = np.linalg.qr(rng.standard_normal((size, size)))[0]
    faces = rng.standard_normal((2, 3 * n_contacts, size))
    force, tip = rng.standard_normal((2, size))
    stiffness = (modes * np.append(1e5, np.geomspace(4e6, 1e9, size - 1))) @ modes.T
    place = np.zeros((n_contacts, 3))
    return ReducedModel(np.eye(size), stiffness, faces[0], place, force, {"tip": tip}, faces[1], n_blades=n_blades)


CONTACT = {"normal_stiffness": 2e3, "tangential_stiffness": 1.5e3, "friction": 0.3}
OPTIONS = SolverOptions((46.0, 58.0), harmonics=3, stability="folds", detached=False, truncation=False)


@pytest.mark.parametrize("n_blades", [1, 2, 3, 6])
def test_jacobian_and_its_bordered_factors(n_blades: int) -> None:
    """The Jacobian against differences of the residual; blocks, solution and sign against the dense matrix."""
    modal, rng = modal_model(full_blade(12), damping_ratio=0.01), np.random.default_rng(n_blades)
    contact = ContactParameters.shared(2, **CONTACT, interference=1e-4)
    mistuning = Mistuning.sampled(n_blades, 3, frequency=0.05, friction=0.1, stiffness=0.1, interference=1e-5)
    receptance = RelativeReceptance(modal, modal.phase(5), (0, 1, 2), 1.0)
    balance = RingBalance.of(
        RingReceptance(receptance, 1.0 + mistuning.frequency), contact, mistuning, replace(OPTIONS, harmonics=2)
    )
    x, direction, right, column, row = rng.standard_normal((5, balance.size))
    x, omega = 1e-4 * x, 300.0
    linearised = balance.evaluate(x, omega)
    step = 1e-9 * direction
    difference = balance.evaluate(x + step, omega).residual - balance.evaluate(x - step, omega).residual
    np.testing.assert_allclose(
        linearised.jacobian @ direction, difference / 2e-9, atol=1e-5 * np.abs(difference).max() / 2e-9
    )
    difference = balance.evaluate(x, omega + 1e-4).residual - balance.evaluate(x, omega - 1e-4).residual
    np.testing.assert_allclose(linearised.dR_dp, difference / 2e-4, atol=1e-6 * np.abs(difference).max() / 2e-4)
    whole = np.block([[linearised.jacobian, column[:, None]], [row[None], np.array([[0.3]])]])
    factors = linearised.factorise(column, row, 0.3)
    solution, z = factors.solve(right, 0.7)
    np.testing.assert_allclose(
        np.append(solution, z), np.linalg.solve(whole, np.append(right, 0.7)), rtol=1e-9, atol=1e-9
    )
    assert factors.sign == np.sign(np.linalg.slogdet(whole)[0])


def test_without_deviations_it_is_the_cyclic_curve() -> None:
    """Five equal blades with slip and lift-off: solutions of the ring are those of one blade, at all points."""
    modal = modal_model(full_blade(5), damping_ratio=0.01)
    contact = ContactParameters.shared(2, **CONTACT, interference=2e-4)
    excitation = Excitation(engine_order=2, force=3.0)
    curve = forced_response(modal, contact, excitation, OPTIONS)
    assert curve.termination.complete
    assert curve.slipping.any()
    assert curve.separating.any()
    receptance = RelativeReceptance(modal, modal.phase(2), (0, 1, 2, 3), 3.0)
    balance = RingBalance.of(RingReceptance(receptance, np.ones(5)), contact, Mistuning.of(5), OPTIONS)
    rng = np.random.default_rng(0)
    for index in range(0, curve.points, 5):
        found = curve.relative_displacement[index].reshape(4, 1, -1) * np.ones((1, 5, 1))
        rows = np.concatenate([found[:1].real, np.stack([found[1:].real, found[1:].imag], axis=1).reshape(6, 5, -1)])
        exact = rows.reshape(-1)
        guess = exact * (1.0 + 1e-5 * rng.standard_normal(exact.size))  # not the same in all blades
        solved = solve_at(balance, 2.0 * np.pi * curve.frequency_hz[index], guess, OPTIONS)
        assert solved.converged
        assert np.abs(solved.solution - exact).max() < 1e-9 * np.abs(exact).max()
    ring = mistuned_response(modal, contact, excitation, OPTIONS, Mistuning.of(5))
    assert ring.complete
    assert ring.peak is not None
    assert curve.peak is not None
    tuned = mistuned_response(modal, contact, excitation, OPTIONS)
    assert tuned.peak is not None
    assert ring.peak.amplitude_m == pytest.approx(tuned.peak.amplitude_m, rel=1e-9)
    assert ring.peak.blade_amplitude_m == pytest.approx(np.full(5, ring.peak.amplitude_m), rel=1e-9)
    top = largest_vibration(curve.output)
    assert tuned.peak.amplitude_m >= top.max() * (1.0 - 1e-12)
    assert tuned.peak.amplitude_m == pytest.approx(top[curve.peak.index], rel=1e-3)  # that one: with the mean


def largest_vibration(output: Array) -> Array:
    """Largest abs(x - x_0) of coefficients (P, H+1) by many samples."""
    angles = np.linspace(0.0, 2.0 * np.pi, 4000, endpoint=False)
    waves = np.exp(1j * np.outer(np.arange(1, output.shape[1]), angles))
    largest: Array = np.abs((output[:, 1:] @ waves).real).max(axis=1)
    return largest


def test_linear_ring_of_six() -> None:
    """Published case: h = 0.01, coupling 0.01, excitation cos(omega t - 2 pi j / 6)."""
    modal, contact, excitation = chain_blade(6), chain_contact(0.01, 1e4), Excitation(engine_order=5, force=1.0)
    options, mistuning = SolverOptions((0.157, 0.163)), Mistuning.of(6, frequency=np.sqrt(1.0 + ANCHOR) - 1.0)
    for pattern, amplitude, omega, blade in ((None, 99.504951, 1.004963, 0), (mistuning, 116.420250, 1.005307, 4)):
        ring = mistuned_response(modal, contact, excitation, options, pattern).peak
        assert ring is not None
        assert ring.located
        linear = LinearSectors.of(modal, contact, excitation, pattern or Mistuning.of(6), highest_hz=0.17)
        for found in (ring, linear.peak((0.157, 0.163))):
            assert found.amplitude_m == pytest.approx(amplitude, abs=1e-6)
            assert 2.0 * np.pi * found.frequency_hz == pytest.approx(omega, abs=1e-6)
            assert found.blade == blade or pattern is None


def test_linear_ring_is_the_dense_ring() -> None:
    """All coordinates of all blades at once, in one time, with springs between the faces."""
    n_blades, model, size = 5, full_blade(5), 10
    modal = modal_model(model, damping_ratio=0.01)
    contact = ContactParameters.shared(2, **CONTACT, interference=1.0)
    mistuning = Mistuning.sampled(n_blades, 4, frequency=0.03, stiffness=0.2)
    problem = modal, contact, Excitation(engine_order=3, force=2.0), mistuning
    few, every = (LinearSectors.of(*problem, highest_hz=highest) for highest in (60.0, 1e4))
    assert few.force.size < n_blades * size == every.force.size
    shapes = modal.shapes
    damping = np.linalg.inv(shapes).T @ np.diag(modal.damping) @ np.linalg.inv(shapes)
    springs = np.tile([1.5e3 / 2, 1.5e3 / 2, 2e3 / 2], 2)
    whole, force = np.zeros((2, n_blades * size, n_blades * size)), np.zeros(n_blades * size, complex)
    for j in range(n_blades):
        own, following = (
            slice(j * size, (j + 1) * size),
            slice((j + 1) % n_blades * size, ((j + 1) % n_blades + 1) * size),
        )
        whole[0, own, own] += (1.0 + mistuning.frequency[j]) ** 2 * model.stiffness
        whole[1, own, own] += damping
        relative = np.zeros((6, n_blades * size))
        relative[:, own], relative[:, following] = model.contact_right, -np.asarray(model.contact_left)
        whole[0] += relative.T @ ((1.0 + mistuning.stiffness[j]) * springs[:, None] * relative)
        force[own] = 2.0 * model.force_excitation * np.exp(2j * np.pi * 3 * j / n_blades)
    for hertz in (48.0, 51.3, 55.0):
        omega = 2.0 * np.pi * hertz
        motion = np.linalg.solve(whole[0] + 1j * omega * whole[1] - omega**2 * np.eye(n_blades * size), force)
        expected = motion.reshape(n_blades, size) @ model.outputs["tip"]
        expected *= np.exp(-2j * np.pi * 3 * np.arange(n_blades) / n_blades)  # each in its own time
        largest = np.abs(expected).max()
        np.testing.assert_allclose(every.vibration([hertz])[0], expected, atol=1e-10 * largest)
        np.testing.assert_allclose(few.vibration([hertz])[0], expected, atol=2e-4 * largest)


def test_mistuned_friction_ring_in_time() -> None:
    """Four different blades with sliders between them, stepped in time until periodic, by central differences."""
    n_blades, kt, limit, frequency = 4, 0.3, 0.25, 1.12
    deviations = Mistuning.of(n_blades, frequency=[0.02, -0.03, 0.01, 0.04], stiffness=[0.1, 0.0, -0.2, 0.05])
    deviations = replace(deviations, friction=np.array([0.0, 0.3, -0.2, 0.1]))
    modal, contact = chain_blade(n_blades, 0.04), chain_contact(kt, limit)
    hertz = frequency / (2.0 * np.pi)
    options = SolverOptions((0.999 * hertz, 1.001 * hertz), harmonics=9)
    ring = mistuned_response(modal, contact, Excitation(engine_order=1, force=0.3), options, deviations)
    middle = int(np.argmin(np.abs(ring.frequency_hz - hertz)))
    stepped = stepped_amplitudes(deviations, kt, limit, 2.0 * np.pi * ring.frequency_hz[middle])
    np.testing.assert_allclose(ring.amplitude_m[middle], stepped, rtol=2e-4)
    assert np.ptp(stepped) > 0.1 * stepped.mean()  # the blades differ
    stuck = LinearSectors.of(modal, contact, Excitation(engine_order=1, force=0.3), deviations, highest_hz=0.2)
    assert np.all(np.abs(np.abs(stuck.vibration([hertz])[0]) / stepped - 1.0) > 0.02)  # and slip


def stepped_amplitudes(deviations: Mistuning, kt: float, limit: float, omega: float) -> Array:
    """Amplitudes of the blades of a ring of masses with sliders between neighbours, by 1200 steps a period."""
    steps, periods, force, n = 1200, 60, 0.3, deviations.n_blades
    dt = 2.0 * np.pi / omega / steps
    stiffness, damping = (1.0 + deviations.frequency) ** 2, 0.08
    kt_j, limit_j = kt * (1.0 + deviations.stiffness), limit * (1.0 + deviations.friction)
    load = force * np.cos(2.0 * np.pi * (np.arange(steps)[:, None] / steps + np.arange(n) / n))
    before, now, slider, top = np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n)
    ahead, behind = np.r_[1:n, 0], np.r_[n - 1, : n - 1]
    for step in range(steps * periods):
        relative = now - now[ahead]
        traction = kt_j * (relative - slider)
        traction = np.minimum(np.maximum(traction, -limit_j), limit_j)
        slider = relative - traction / kt_j
        total = load[step % steps] - stiffness * now - traction + traction[behind]
        following = (2.0 * now - before * (1.0 - 0.5 * damping * dt) + dt**2 * total) / (1.0 + 0.5 * damping * dt)
        before, now = now, following
        if step >= steps * (periods - 1):
            top = np.maximum(top, np.abs(now))
    return top


def test_no_linear_ring_exceeds_whiteheads_bound() -> None:
    modal, contact, excitation = chain_blade(6), chain_contact(0.01, 1.0), Excitation(engine_order=1, force=1.0)
    tuned = LinearSectors.of(modal, contact, excitation, Mistuning.of(6), highest_hz=0.2).peak((0.15, 0.17))
    factors = []
    for seed in range(60):
        pattern = Mistuning.sampled(6, seed, frequency=0.002 * 1.05**seed)
        ring = LinearSectors.of(modal, contact, excitation, pattern, highest_hz=0.2)
        factors.append(ring.peak((0.14, 0.18)).amplitude_m / tuned.amplitude_m)
    assert whitehead_bound(6) == pytest.approx(1.7247449)
    assert 1.3 < max(factors) <= whitehead_bound(6)


def test_what_does_not_fit_is_refused() -> None:
    problem = chain_blade(6), chain_contact(0.01, 1.0), Excitation(engine_order=1, force=1.0)
    options = SolverOptions((0.15, 0.17))
    with pytest.raises(MistuningError, match="mistuning: of 5 blades, allowed: 6, as the model"):
        mistuned_response(*problem, options, Mistuning.of(5))
    with pytest.raises(OptionsError, match="method: 'static-first', allowed for a mistuned ring"):
        mistuned_response(*problem, replace(options, method="static-first"), Mistuning.of(6))
    with pytest.raises(OptionsError, match='harmonics: "auto", allowed here: a number'):
        mistuned_response(*problem, replace(options, harmonics="auto"), Mistuning.of(6))
    with pytest.raises(MistuningError, match=r"friction: -1\.5, allowed: above -1"):
        Mistuning.of(2, friction=-1.5)
    with pytest.raises(MistuningError, match=r"frequency: .*nan.*, allowed: finite numbers"):
        Mistuning.of(2, frequency=[0.0, np.nan])
