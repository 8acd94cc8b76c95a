"""Floquet exponents against closed forms: linear contacts, Mathieu's equation, a fold; slider memory."""

from dataclasses import replace

import numpy as np
import pytest
from lumped import lumped_blade, oscillator
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, minimize_scalar
from scipy.special import mathieu_a, mathieu_b

from nonlinear import ContactParameters, Excitation, SolverOptions, forced_response
from nonlinear.contact.cone_event_driven import EventDrivenCoulombCone
from nonlinear.contact.event_driven import EventDrivenJenkins
from nonlinear.contact.fourier import basis_table, to_real
from nonlinear.response_solver import build_harmonic_balance
from nonlinear.stability.floquet import (
    FloquetAnalysis,
    Instability,
    crossings,
    floquet_exponents,
    instability_of,
)
from nonlinear.stability.hill import RETENTION_HARMONIC, HillProblem
from nonlinear.stability.slider_memory import MemorySampler
from rom import modal_model

STRIP = 0.5 - 1e-6


def spring_jacobian(stiffness, n_harmonics):
    """Contact Jacobian of springs (n_c, 3)."""
    size = 2 * n_harmonics + 1
    jacobian = np.zeros((len(stiffness), 3, 3, size, size))
    for node, row in enumerate(stiffness):
        for a in range(3):
            jacobian[node, a, a] = -row[a] * np.eye(size)
    return jacobian


def coupled_exponents(modal, phase, kappa, stiffness, n_harmonics, omega):
    """lambda = s - i h omega in the strip, s of the blade with its springs at the phase h psi + kappa."""
    found = []
    count = modal.angular_frequency.size
    for h in range(-n_harmonics, n_harmonics + 1):
        relative = modal.right - modal.left * np.exp(1j * (h * phase + kappa))
        coupled = np.diag(modal.angular_frequency**2) + relative.conj().T @ (stiffness.reshape(-1, 1) * relative)
        system = np.block([[np.zeros((count, count)), np.eye(count)], [-coupled, -np.diag(modal.damping)]])
        found.append(np.linalg.eigvals(system) - 1j * h * omega)
    found = np.concatenate(found)
    return found[np.abs(found.imag) < STRIP * omega]


def distance(values, others):
    """Largest distance of one of the values from the nearest of the others."""
    return max(np.abs(others - value).min() for value in values)


class TestLinearContacts:
    """Springs between the blades: the exponents are those of the coupled structure."""

    omega, n_harmonics = 1.3, 3

    @pytest.mark.parametrize("kappa", [0.0, 2.0 * np.pi / 3.0, np.pi])
    @pytest.mark.parametrize("stiffness", [0.0, 5.0])
    @pytest.mark.parametrize("damping", [0.02, [0.02, 1.0, 1.6, 0.1]])  # critical and overdamped modes among them
    def test_all_poles_retained(self, kappa, stiffness, damping):
        modal = modal_model(lumped_blade(3), damping_ratio=damping)
        springs = stiffness * np.array([[1.0, 1.0, 1.5], [1.2, 0.8, 2.0]])
        phase = modal.phase(1)
        problem = HillProblem(modal, phase, self.n_harmonics, kappa, retention_radius=np.inf)
        found = floquet_exponents(problem, spring_jacobian(springs, self.n_harmonics), self.omega)
        inside = found[np.abs(found.imag) < STRIP * self.omega]
        expected = coupled_exponents(modal, phase, kappa, springs, self.n_harmonics, self.omega)
        tolerance = 1e-9 if damping == 0.02 else 3e-6  # a double pole splits by the root of what is neglected
        assert inside.size == expected.size
        assert distance(inside, expected) < tolerance
        assert distance(expected, inside) < tolerance
        assert np.all(np.diff(found.real) <= 1e-12)

    @pytest.mark.parametrize("kappa", [0.0, 2.0 * np.pi / 3.0])
    def test_condensed(self, kappa):
        """The contact nodes are 30 times faster than the blade: no pole of theirs needs to be retained."""
        modal = modal_model(lumped_blade(3), damping_ratio=0.02)
        springs = np.full((2, 3), 5.0)
        problem = HillProblem(modal, modal.phase(1), self.n_harmonics, kappa)
        found = floquet_exponents(problem, spring_jacobian(springs, self.n_harmonics), self.omega)
        expected = coupled_exponents(modal, modal.phase(1), kappa, springs, self.n_harmonics, self.omega)
        assert distance(expected, found) < 1e-8

    def test_sticking_contacts_of_the_element(self):
        modal = modal_model(lumped_blade(3), damping_ratio=0.02)
        contact = ContactParameters.shared(
            2, normal_stiffness=6.0, tangential_stiffness=4.0, friction=0.5, interference=1e3
        )
        balance = build_harmonic_balance(modal, contact, Excitation(1, 1.0), SolverOptions((0.1, 0.8), harmonics=3))
        displacement = 1e-2 * np.random.default_rng(3).normal(size=(7, 2, 3))
        springs = np.tile([2.0, 2.0, 3.0], (2, 1))
        analysis = FloquetAnalysis.of(balance.receptance, contact)
        assert analysis.sampler.memory(displacement) is None
        jacobian = balance.element.evaluate(displacement).jacobian
        found = analysis.exponents(displacement, jacobian, self.omega)
        expected = coupled_exponents(modal, modal.phase(1), 0.0, springs, 3, self.omega)
        assert distance(found[:4], expected) < 1e-3
        assert found[0].real == pytest.approx(expected.real.max(), abs=1e-4)

    def test_kappas_are_copies_of_each_other(self):
        """lambda + i omega for kappa + psi, but for what would come from a truncated harmonic."""
        modal = modal_model(lumped_blade(3), damping_ratio=0.02)
        jacobian = spring_jacobian(np.full((2, 3), 5.0), 2)
        one, other = (
            HillProblem(modal, modal.phase(1), 2, kappa, retention_radius=np.inf)
            .eigenproblem(jacobian, 1.3)
            .eigenvalues()
            for kappa in (0.0, modal.phase(1))
        )
        copied = np.array([np.abs(other - value - 1j).min() < 1e-9 for value in one])
        assert np.count_nonzero(copied) == 4 * one.size // 5


class TestMathieu:
    """x'' + c x' + (a - 2 q cos n theta) x = 0, omega = 1: one mode, and a contact whose stiffness varies by hand."""

    def problem(self, radius=np.inf, damping=0.0, n_harmonics=14):
        modal = modal_model(oscillator(stiffness=0.3, tangential=False), rayleigh=(damping, 0.0))
        return HillProblem(modal, 0.0, n_harmonics, retention_radius=radius)

    def jacobian(self, a, q, order, n_harmonics=14):
        samples = 256
        table = basis_table(n_harmonics, samples)
        theta = 2.0 * np.pi * np.arange(samples) / samples
        stiffness = a - 0.3 - 2.0 * q * np.cos(order * theta)
        product = 2.0 * table.T @ (stiffness[:, None] * table) / samples
        product[0] /= 2.0
        jacobian = np.zeros((1, 3, 3, *product.shape))
        jacobian[0, 2, 2] = -product
        return jacobian

    @pytest.mark.parametrize("radius", [np.inf, 2.0])
    @pytest.mark.parametrize(("value", "number"), [(mathieu_a, 0), (mathieu_a, 1), (mathieu_a, 2), (mathieu_b, 3)])
    def test_characteristic_values_have_a_zero_exponent(self, value, number, radius):
        q = 1.7
        motion = self.problem(radius).eigenproblem(self.jacobian(value(number, q), q, 2), 1.0)
        nearest = np.sort(np.abs(motion.eigenvalues()))
        assert nearest[0] < 1e-6  # a double zero
        assert (
            np.abs(
                self.problem(radius).eigenproblem(self.jacobian(value(number, q) + 0.1, q, 2), 1.0).eigenvalues()
            ).min()
            > 1e-2
        )

    def test_damping_shifts_the_exponents(self):
        """x = e^(-c t / 2) y, y'' + (a - c^2 / 4 - ...) y = 0."""
        q, damping = 0.8, 0.3
        jacobian = self.jacobian(mathieu_b(1, q) + damping**2 / 4.0, q, 2)
        values = self.problem(damping=damping).eigenproblem(jacobian, 1.0).eigenvalues()
        assert np.abs(values + damping / 2.0).min() < 1e-6

    @pytest.mark.parametrize(
        ("a", "q", "order", "expected"),
        [
            (1.0, 0.4, 2, Instability.REAL),  # first tongue, stiffness twice a period
            (0.25, 0.1, 1, Instability.PERIOD_DOUBLING),  # the same once a period
        ],
    )
    def test_growth_in_a_tongue(self, a, q, order, expected):
        damping = 0.05

        def rate(t, x):
            return [x[1], -damping * x[1] - (a - 2.0 * q * np.cos(order * t)) * x[0]]

        columns = [
            solve_ivp(rate, (0.0, 2.0 * np.pi), start, method="DOP853", rtol=1e-11, atol=1e-13).y[:, -1]
            for start in ([1.0, 0.0], [0.0, 1.0])
        ]
        multiplier = max(np.linalg.eigvals(np.array(columns).T), key=abs)
        growth = np.log(abs(multiplier)) / (2.0 * np.pi)
        assert growth > 0.01
        for radius, tolerance in ((np.inf, 1e-8), (2.0, 1e-3)):
            found = floquet_exponents(self.problem(radius, damping), self.jacobian(a, q, order), 1.0)
            assert found[0].real == pytest.approx(growth, abs=tolerance)
            assert instability_of(found[0], 1.0) is expected
        assert (multiplier.real < 0.0) == (expected is Instability.PERIOD_DOUBLING)


class TestFold:
    """One-sided stop with a gap of 3, one harmonic: the response curve is known in closed form."""

    contact = ContactParameters(np.ones(1), np.zeros(1), np.zeros(1), -3.0 * np.ones(1), np.zeros(1))

    def stiffness(self, amplitude):
        """Static displacement and N_1 / A, from N = max(x - 3, 0) on x = x0 + A cos."""

        def moments(static):
            threshold = np.clip((3.0 - static) / amplitude, -1.0, 1.0)
            half = np.arccos(threshold)
            mean = amplitude * (np.sin(half) - threshold * half) / np.pi
            return mean, (half - 0.5 * np.sin(2.0 * half)) / np.pi

        static = brentq(lambda x: x + moments(x)[0], -amplitude, 0.0, xtol=1e-15)
        return static, moments(static)[1]

    def omega(self, amplitude):
        """The larger omega at which |1 + N_1 / A - omega^2 + 0.04 i omega| A = 1."""
        total = 1.0 + self.stiffness(amplitude)[1]
        half = total - 0.5 * 0.04**2
        return np.sqrt(half + np.sqrt(half**2 - total**2 + amplitude**-2))

    def leading(self, amplitude):
        """The real exponent nearest to zero."""
        modal = modal_model(oscillator(tangential=False), damping_ratio=0.02)
        balance = build_harmonic_balance(modal, self.contact, Excitation(0, 1.0), SolverOptions((0.05, 0.4)))
        (static, added), omega = self.stiffness(amplitude), self.omega(amplitude)
        first = 1.0 / (1.0 + added - omega**2 + 0.04j * omega)
        unknown = np.zeros((3, 1, 3))
        unknown[:, 0, 2] = static, first.real, first.imag
        at = balance.evaluate(unknown.reshape(-1), omega)
        assert np.abs(at.residual).max() < 1e-9
        values = HillProblem(modal, 0.0, 1).eigenproblem(at.contact.jacobian, omega).eigenvalues()
        values = values.real[values.imag == 0.0]
        return values[np.argmin(np.abs(values))] if values.size else None

    def test_the_exponent_vanishes_at_the_fold(self):
        fold = minimize_scalar(self.omega, bounds=(3.05, 8.0), method="bounded", options={"xatol": 1e-12}).x
        assert 3.2 < fold < 7.0
        before, at, after = (self.leading(fold * factor) for factor in (0.99, 1.0, 1.01))
        assert before < -1e-3  # the lower branch
        assert abs(at) < 1e-6
        assert after > 1e-3  # the middle one


def friction_case(n_blades, interference, harmonics, method):
    modal = modal_model(lumped_blade(n_blades, 1), damping_ratio=0.01)
    contact = ContactParameters.shared(
        1, normal_stiffness=6.0, tangential_stiffness=4.0, friction=0.4, interference=interference
    )
    options = SolverOptions(
        (0.1, 0.8),
        harmonics=harmonics,
        method=method,
        stability="folds",
        detached=False,
        truncation=False,
        search="off",
    )
    curve = forced_response(modal, contact, Excitation(1, 1.0), options)
    return contact, build_harmonic_balance(modal, contact, Excitation(1, 1.0), options), curve


@pytest.mark.parametrize(
    ("n_blades", "interference", "harmonics", "method"),
    [(2, -4.0, 3, "coupled"), (2, -4.0, 9, "coupled"), (3, 0.3, 3, "coupled"), (2, -4.0, 3, "static-first")],
)
def test_the_determinant_changes_its_sign_with_a_real_exponent(n_blades, interference, harmonics, method):
    """With all harmonics, those that retain few poles included."""
    contact, balance, curve = friction_case(n_blades, interference, harmonics, method)
    analysis = FloquetAnalysis.of(balance.receptance, contact, static=method == "coupled")
    few = replace(analysis.problem, retention_harmonic=RETENTION_HARMONIC)  # as with many contact nodes
    analysis = replace(analysis, problem=few)
    assert analysis.problem.retention_harmonic < 9
    signs, exponents = [], []
    for displacement, hertz in zip(curve.relative_displacement, curve.frequency_hz, strict=True):
        real, omega = to_real(displacement), 2.0 * np.pi * hertz
        at = balance.evaluate(balance.unknown(real), omega)
        signs.append(np.linalg.slogdet(at.jacobian)[0])
        exponents.append(analysis.exponents(real, at.contact.jacobian, omega))
    positive = np.array([np.count_nonzero((row.real > 0.0) & (row.imag == 0.0)) for row in exponents])
    assert np.all((-1.0) ** positive == signs)
    assert np.count_nonzero(np.diff(signs)) == 2  # two folds
    for index in np.flatnonzero(np.diff(signs)):
        omega = 2.0 * np.pi * curve.frequency_hz[index]
        assert Instability.REAL in crossings(exponents[index], exponents[index + 1], omega)


class TestSliderMemory:
    """Forces on a slider under u + e^(sigma theta) p(theta), integrated in small steps, less those under u alone."""

    contact = ContactParameters(np.array([1.0]), np.array([0.8]), np.array([0.5]), np.array([0.2]), np.zeros(1))
    n_harmonics, samples = 3, 60000

    def friction_force(self, motion):
        """Friction force over two periods, the slider starting at 0, (2 samples,)."""
        forces, position = np.empty(len(motion)), 0.0
        load = np.maximum(0.2 + motion[:, 1], 0.0)
        limit = 0.5 * load / 0.8
        low, high = motion[:, 0] - limit, motion[:, 0] + limit
        for k, (below, above) in enumerate(zip(low.tolist(), high.tolist(), strict=True)):
            position = min(max(position, below), above)
            forces[k] = -0.8 * (motion[k, 0] - position)
        return forces

    @pytest.mark.parametrize("sigma", [0.3, 0.4j, 0.1 - 0.3j])
    def test_growing_perturbation(self, sigma):
        """A cycle in which the slider sticks after slip and after re-contact."""
        rng = np.random.default_rng(1)
        size = 2 * self.n_harmonics + 1
        base, shape = rng.normal(size=(size, 1, 3)) * 0.3, rng.normal(size=(size, 3))
        period = basis_table(self.n_harmonics, self.samples)
        table = np.concatenate([period, period])
        theta = 2.0 * np.pi * np.arange(2 * self.samples) / self.samples
        growth = np.exp(sigma * theta)[:, None] * (table @ shape)
        motion, change, step = table @ base[:, 0, :], 0.0, 5e-4
        for part, unit in ((growth.real, 1.0), (growth.imag, 1j)):
            up, down = (self.friction_force((motion + sign * step * part)[:, [0, 2]]) for sign in (1.0, -1.0))
            change = change + unit * (up - down) / (2.0 * step)
        relative = (change * np.exp(-sigma * theta))[self.samples :]
        measured = 2.0 * period.T @ relative / self.samples
        measured[0] /= 2.0

        jacobian = EventDrivenJenkins(self.contact, self.n_harmonics).evaluate(base).jacobian[0, 0]
        periodic = np.einsum("bij,jb->i", jacobian, shape)
        memory = MemorySampler(self.contact, self.n_harmonics, 4096).memory(base)
        at_start = memory.basis @ shape
        slider = at_start[np.arange(memory.node.size), memory.direction] + memory.dw_dn * at_start[:, 2]
        of_t1 = memory.direction == 0
        force, derivative = memory.force(complex(sigma))
        expected = periodic + (slider[of_t1, None] * force[of_t1]).sum(axis=0)
        size = np.abs(measured).max()
        assert np.abs(expected - measured).max() < 0.01 * size
        assert np.abs(periodic - measured).max() > 0.05 * size  # without memory
        nearby = (memory.force(sigma + 1e-5)[0] - memory.force(sigma - 1e-5)[0]) / 2e-5
        assert derivative == pytest.approx(nearby, abs=1e-6)
        assert memory.force(0.0)[0] == pytest.approx(0.0, abs=1e-12 * size)  # 1 - e^0 in each term

    def test_there_is_none_without_events(self):
        sampler = MemorySampler(self.contact, 1)
        still = np.zeros((3, 1, 3))
        assert sampler.memory(still) is None  # full stick: the slider stands where it always stood
        still[0, 0, 2] = -1.0
        assert sampler.memory(still) is None  # open
        moving = np.zeros((3, 1, 3))
        moving[1, 0, 0] = 1.0
        assert sampler.memory(moving).node.size == 2  # slip at both ends of the stroke


class TestConeSliderMemory:
    """The same under the friction cone: the direction of slip is remembered as well as the place of stick."""

    contact = replace(TestSliderMemory.contact, law="cone")
    n_harmonics, samples = 3, 30000

    def friction_force(self, motion):
        """Friction force over three periods, the slider starting at 0, (3 samples, 2)."""
        forces, x, y = np.empty((len(motion), 2)), 0.0, 0.0
        limit = 0.5 * np.maximum(0.2 + motion[:, 2], 0.0) / 0.8
        for k, (u, v, r) in enumerate(zip(*motion[:, :2].T.tolist(), limit.tolist(), strict=True)):
            far = np.hypot(u - x, v - y)
            if far > r:
                x, y = u - r * (u - x) / far, v - r * (v - y) / far
            forces[k] = -0.8 * (u - x), -0.8 * (v - y)
        return forces

    @pytest.mark.parametrize(("seed", "sigma"), [(3, 0.3), (4, 0.4j), (5, 0.1 - 0.3j)])
    def test_growing_perturbation(self, seed, sigma):
        rng = np.random.default_rng(seed)
        size = 2 * self.n_harmonics + 1
        base, shape = rng.normal(size=(size, 1, 3)) * 0.3, rng.normal(size=(size, 3))
        period = basis_table(self.n_harmonics, self.samples)
        table = np.concatenate([period, period, period])
        theta = 2.0 * np.pi * np.arange(len(table)) / self.samples
        growth = np.exp(sigma * theta)[:, None] * (table @ shape)
        motion, change, step = table @ base[:, 0, :], 0.0, 3e-5
        for part, unit in ((growth.real, 1.0), (growth.imag, 1j)):
            up, down = (self.friction_force(motion + sign * step * part) for sign in (1.0, -1.0))
            change = change + unit * (up - down) / (2.0 * step)
        relative = (change * np.exp(-sigma * theta)[:, None])[-self.samples :]
        measured = 2.0 * period.T @ relative / self.samples
        measured[0] /= 2.0

        jacobian = EventDrivenCoulombCone(self.contact, self.n_harmonics).evaluate(base).jacobian[0, :2]
        periodic = np.einsum("abij,jb->ia", jacobian, shape)
        memory = MemorySampler(self.contact, self.n_harmonics).memory(base)
        jacobian_change, derivative = memory.jacobian(complex(sigma))
        expected = periodic + np.einsum("abij,jb->ia", jacobian_change[0], shape)
        largest = np.abs(measured).max()
        assert np.abs(expected - measured).max() < 0.005 * largest
        assert np.abs(periodic - measured).max() > 0.08 * largest  # without memory
        nearby = (memory.jacobian(sigma + 1e-5)[0] - memory.jacobian(sigma - 1e-5)[0]) / 2e-5
        assert derivative == pytest.approx(nearby, abs=1e-6)
        assert memory.jacobian(0.0)[0] == pytest.approx(0.0, abs=1e-12 * largest)  # 1 - e^0 in each term

    @pytest.mark.parametrize("sigma", [-1.0 + 0.2j, -3.0])
    def test_decaying_perturbation(self, sigma):
        """Against all instants of the cycle solved at once, but for round-off that grows as fast as it decays."""
        base = np.random.default_rng(3).normal(size=(2 * self.n_harmonics + 1, 1, 3)) * 0.05
        memory = MemorySampler(self.contact, self.n_harmonics).memory(base)
        change = memory.jacobian(complex(sigma))[0][0]
        expected = self.solved_at_once(memory, complex(sigma)) - self.solved_at_once(memory, 0.0)
        tolerance = 1e-14 * np.exp(-2.0 * np.pi * sigma.real)
        assert change == pytest.approx(expected, abs=tolerance * np.abs(expected).max())

    def test_an_exponent_of_the_slider_alone_divides_by_no_zero(self):
        """A slider that forgets one direction at one instant, and loses nothing in the other."""
        base = np.random.default_rng(3).normal(size=(2 * self.n_harmonics + 1, 1, 3)) * 0.05
        memory = MemorySampler(self.contact, self.n_harmonics).memory(base)
        transition = np.tile(np.eye(2), (1, memory.transition.shape[1], 1, 1))
        transition[0, 0] = np.diag([1.0, 0.0])
        change = replace(memory, transition=transition).jacobian(0.0)
        assert np.isfinite(change).all()

    def solved_at_once(self, memory, sigma):
        """Fourier coefficients of kt dw from dw_k - e^(-sigma 2 pi / N) Phi_k dw_(k-1) = Gamma_k p_k, all k."""
        n, size = memory.table.shape
        matrix = np.eye(2 * n, dtype=complex).reshape(n, 2, n, 2)
        for k in range(n):
            matrix[k, :, k - 1] -= np.exp(-sigma * 2.0 * np.pi / n) * memory.transition[0, k]
        right = np.einsum("kid,kj->kidj", memory.input_matrix[0], memory.table)
        solved = np.linalg.solve(matrix.reshape(2 * n, 2 * n), right.reshape(2 * n, -1)).reshape(n, 2, 3, size)
        weights = memory.table * np.append(1.0, np.full(size - 1, 2.0)) / n
        return memory.stiffness[0] * np.einsum("ki,kcdj->cdij", weights, solved)

    def test_there_is_none_without_slip(self):
        sampler = MemorySampler(self.contact, 1)
        still = np.zeros((3, 1, 3))
        assert sampler.memory(still) is None
        still[0, 0, 2] = -1.0
        assert sampler.memory(still) is None
        moving = np.zeros((3, 1, 3))
        moving[1, 0, 0] = 1.0
        assert sampler.memory(moving).node.tolist() == [0]


def test_instabilities_and_crossings():
    omega = 10.0
    assert instability_of(0.3 + 0.0j, omega) is Instability.REAL
    assert instability_of(0.3 - 2.0j, omega) is Instability.COMPLEX
    assert instability_of(0.3 + 5.01j, omega) is Instability.PERIOD_DOUBLING
    stable = np.array([-1.0 + 2.0j, -1.0 - 2.0j, -2.0, -3.0])
    pair = np.array([1.0 + 2.0j, 1.0 - 2.0j, -2.0, -3.0])
    assert crossings(stable, stable, omega) == ()
    assert crossings(stable, pair, omega) == (Instability.COMPLEX,)
    assert crossings(pair, stable, omega) == (Instability.COMPLEX,)
    # a pair that meets on the axis of growth crosses nothing; one of the two may go back later
    met = np.array([1.5, 0.5, -2.0, -3.0], dtype=complex)
    assert crossings(pair, met, omega) == ()
    assert crossings(met, np.array([1.5, -0.5, -2.0, -3.0], dtype=complex), omega) == (Instability.REAL,)
