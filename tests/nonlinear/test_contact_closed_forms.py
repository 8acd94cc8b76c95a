"""Contact elements against closed forms of one slider: work, mean forces, Fourier coefficients, criteria."""

import numpy as np
import pytest

from nonlinear import ContactParameters, SolverOptions, contact_cycle
from nonlinear.contact.element_choice import contact_element
from nonlinear.contact.parameters import LIFT_OFF, SLIP, STICK


def single(kn=0.0, kt=1.0, mu=0.5, v0=0.0, preload=1.0, law="two_sliders"):
    """One node."""
    one = np.ones(1)
    return ContactParameters(kn * one, kt * one, mu * one, v0 * one, preload * one, law)


def element(contact, integration, harmonics=1, samples=4096):
    options = SolverOptions((1.0, 2.0), harmonics=harmonics, integration=integration, samples=samples)
    return contact_element(contact, harmonics, options)


def sine(amplitude, normal_gain):
    """u = U sin(theta) along t1 and d_n = k U sin(theta): rows (0, Re, Im) with Im = -1 for a sine."""
    rows = np.zeros((3, 1, 3))
    rows[2, 0, 0] = -amplitude
    rows[2, 0, 2] = -normal_gain * amplitude
    return rows


def work_per_cycle(rows, force):
    """Friction work of -f_R on the motion."""
    f, d = force[1] + 1j * force[2], rows[1] + 1j * rows[2]
    return float(np.pi * (np.conj(f) * d).imag.sum())


INTEGRATIONS = [("exact", 1e-12), ("sampled", 2e-5)]


@pytest.mark.parametrize("law", ["two_sliders", "cone"])
@pytest.mark.parametrize(("integration", "tolerance"), INTEGRATIONS)
class TestInPhaseMotion:
    """u = U sin, N = N0 + k u with kt = 1, kn = 1, k = 0.6, mu = 0.5, N0 = 1: on a line both laws are one."""

    k = 0.6

    def run(self, integration, law, amplitude):
        rows = sine(amplitude, self.k)
        return rows, element(single(kn=1.0, law=law), integration).evaluate(rows)

    def test_full_stick(self, integration, tolerance, law):
        rows, result = self.run(integration, law, 0.30)
        assert result.state[0] == STICK
        assert abs(work_per_cycle(rows, result.force)) < 1e-12  # pi u T is 0.3: round-off of its two terms
        assert -0.11 - 1e-12 <= -result.force[0, 0, 0] <= 0.29

    def test_stick_slip(self, integration, tolerance, law):
        for amplitude, work, mean in ((0.51, 0.0199604, 0.152809), (1.00, 0.9010989, 0.240630)):
            rows, result = self.run(integration, law, amplitude)
            assert result.state[0] == SLIP
            assert work_per_cycle(rows, result.force) == pytest.approx(work, abs=6e-8 + 10 * tolerance)
            assert -result.force[0, 0, 0] == pytest.approx(mean, abs=1e-6 + tolerance)

    def test_lift_off(self, integration, tolerance, law):
        rows, result = self.run(integration, law, 2.0)
        assert result.state[0] == LIFT_OFF
        assert work_per_cycle(rows, result.force) == pytest.approx(2.1717949, abs=6e-8 + 100 * tolerance)
        t1 = -result.force[:, 0, 0]
        # T1 = a cos + b sin: Re = a, Im = -b
        assert t1 == pytest.approx([0.318710, 0.345652, -0.523180], abs=1e-6 + 30 * tolerance)
        assert 1.0 - result.force[0, 0, 2] == pytest.approx(1.0247134, abs=6e-8 + tolerance)  # f_n = -(N - N0)

    def test_static_force_is_projected_on_its_range(self, integration, tolerance, law):
        # (paper eqs. 10 to 16) inside: kt u0; beyond: Tmax0 = mu N0 - (kt - mu k) U, Tmin0 = -mu N0 + (kt + mu k) U
        rows = sine(0.3, self.k)
        for static, expected in ((0.1, 0.1), (5.0, 0.29), (-5.0, -0.11)):
            rows[0, 0, 0] = static
            result = element(single(kn=1.0, law=law), integration).evaluate(rows)
            assert -result.force[0, 0, 0] == pytest.approx(expected, abs=1e-12 + tolerance)
            assert result.state[0] == STICK

    def test_slip_starts_at_the_amplitude_of_constant_load(self, integration, tolerance, law):
        # U = mu N0 / kt whatever k, as long as kt > mu k
        for gain in (0.0, 0.3, 0.9):
            for amplitude, state in ((0.4999, STICK), (0.5001, SLIP)):
                result = element(single(kn=1.0, law=law), integration).evaluate(sine(amplitude, gain))
                assert result.state[0] == state, (gain, amplitude)


@pytest.mark.parametrize("law", ["two_sliders", "cone"])
def test_jenkins_coefficients(law):
    # u = X cos: a1 = (kt X / pi)(th - sin(2 th) / 2), b1 = -(4 limit / pi)(1 - xs / X), th = acos(1 - 2 xs / X)
    rows = np.zeros((3, 1, 3))
    rows[1, 0, 0] = 5.0
    contact = single(kt=2.0, mu=1.0, preload=3.0, law=law)
    for integration, tolerance in (("exact", 1e-13), ("sampled", 2e-6)):
        force = -element(contact, integration).evaluate(rows).force[:, 0, 0]
        assert force[1] == pytest.approx(2.5231579, abs=6e-8 + tolerance)
        assert -force[2] == pytest.approx(-2.6738030, abs=6e-8 + tolerance)
        assert np.pi * force[2] * 5.0 == pytest.approx(42.0, rel=1e-6)  # 4 limit (X - xs)


def test_jenkins_path():
    # kt 2, limit 3: u = 0, 5, 3.5, 2, -5, -3.5, -2, 0 gives T = 0, 3, 0, -3, -3, 0, 3, 3 from w = 0
    from nonlinear.contact.return_map import jenkins_return_map

    u = np.array([0.0, 5.0, 3.5, 2.0, -5.0, -3.5, -2.0, 0.0])
    state, source, sign = (np.empty(8, dtype=np.int64) for _ in range(3))
    jenkins_return_map(u, np.full(8, 3.0), 2.0, state, source, sign)
    expected = np.array([3.0, 3.0, 0.0, -3.0, -3.0, 0.0, 3.0, 3.0])  # second period: it enters with T = 3 at u = 0
    assert 2.0 * (u - (u[source] - sign * 3.0 / 2.0)) == pytest.approx(expected)
    assert state[5] == STICK
    assert state[4] == SLIP


def test_circular_path_of_the_cone_slider():
    # Constant circular motion of radius r > mu N / kt: T rotates with |T| = mu N and leads, w follows on the circle
    # of radius sqrt(r^2 - (mu N / kt)^2); work per cycle 2 pi mu N sqrt(r^2 - (mu N / kt)^2).
    limit, kt, radius = 3.0, 2.0, 5.0
    rows = np.zeros((3, 1, 3))
    rows[1, 0, 0] = radius  # u1 = r cos
    rows[2, 0, 1] = -radius  # u2 = r sin
    contact = single(kt=kt, mu=1.0, preload=limit, law="cone")
    exact = 2.0 * np.pi * limit * np.sqrt(radius**2 - (limit / kt) ** 2)
    errors = []
    for samples in (512, 1024, 2048):
        result = element(contact, "sampled", samples=samples).evaluate(rows)
        assert result.state[0] == SLIP
        errors.append(abs(work_per_cycle(rows, result.force) / exact - 1.0))
    assert errors[-1] < 2e-3
    assert errors[0] / errors[2] > 3.5  # radial return: first order or better in the sample spacing
    result = element(contact, "exact").evaluate(rows)
    assert work_per_cycle(rows, result.force) == pytest.approx(exact, rel=1e-11)  # events: roots to 1e-14
    lead = np.arcsin(np.sqrt(1.0 - (limit / kt / radius) ** 2))  # of T before u: |w| = r sin(lead)
    assert -result.force[1, 0, :2] - 1j * result.force[2, 0, :2] == pytest.approx(
        limit * np.exp(1j * lead) * np.array([1.0, -1j]), abs=1e-11 * limit
    )


@pytest.mark.parametrize("integration", ["exact", "sampled"])
def test_cone_reduces_to_two_sliders_on_a_line(integration):
    rng = np.random.default_rng(3)
    rows = np.zeros((5, 4, 3))
    rows[:, :, 0], rows[:, :, 2] = rng.normal(size=(2, 5, 4))
    laws = {}
    for law in ("cone", "two_sliders"):
        parameters = ContactParameters.shared(
            4, normal_stiffness=4.0, tangential_stiffness=6.0, friction=0.3, interference=0.6, law=law
        )
        laws[law] = element(parameters, integration, harmonics=2, samples=256).evaluate(rows).force
    assert laws["cone"] == pytest.approx(laws["two_sliders"], abs=1e-12)


def test_two_sliders_dissipate_less_than_the_cone_on_a_circle():
    rows = np.zeros((3, 1, 3))
    rows[1, 0, 0], rows[2, 0, 1] = 1.2, -1.2
    work = {}
    for law in ("two_sliders", "cone"):
        contact = single(kt=1.0, mu=1.0, preload=1.0, law=law)
        work[law] = work_per_cycle(rows, element(contact, "exact").evaluate(rows).force)
    assert 0.0 < work["two_sliders"] < work["cone"]


def test_cycle_agrees_with_the_element():
    rng = np.random.default_rng(5)
    contact = ContactParameters.shared(
        6, normal_stiffness=6.0, tangential_stiffness=5.0, friction=0.4, interference=np.linspace(-1, 1, 6)
    )
    coefficients = rng.normal(size=(3, 6, 3)) + 1j * rng.normal(size=(3, 6, 3))
    coefficients[0] = coefficients[0].real
    cycle = contact_cycle(coefficients, contact, samples=512)
    rows = np.concatenate([coefficients[:1].real, *[[c.real, c.imag] for c in coefficients[1:]]])
    result = element(contact, "sampled", harmonics=2, samples=512).evaluate(rows)
    assert -cycle.force.mean(axis=0) == pytest.approx(result.force[0], abs=1e-12)
    assert cycle.state.max(axis=0) == pytest.approx(result.state)
    assert np.all(np.abs(cycle.force[:, :, :2]) <= 0.4 * cycle.force[:, :, 2:] + 1e-12)


@pytest.mark.parametrize("law", ["two_sliders", "cone"])
def test_static_element_is_the_sampled_one_without_vibration(law):
    from nonlinear.contact.aft import AFTContact

    rng = np.random.default_rng(8)
    contact = ContactParameters.shared(
        60,
        normal_stiffness=60.0,
        tangential_stiffness=50.0,
        friction=0.5,
        interference=rng.normal(size=60),
        preload=rng.random(60),
        law=law,
    )
    rows = rng.normal(size=(1, 60, 3))
    static = contact_element(contact, 0, SolverOptions((1.0, 2.0))).evaluate(rows)
    sampled = AFTContact(contact, 0, 1).evaluate(rows)
    size = 60.0 * np.abs(rows).max()  # kn d: the two sum in another order, so that round-off is some 1e-16 of it
    assert static.force == pytest.approx(sampled.force, abs=1e-12 * size)
    assert static.jacobian == pytest.approx(sampled.jacobian, abs=1e-12 * size)
    assert np.array_equal(static.state == LIFT_OFF, sampled.state == LIFT_OFF)
    assert set(static.state) == {STICK, SLIP, LIFT_OFF}
