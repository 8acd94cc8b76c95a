"""Bounds over residual tractions: a wedge damper from the literature, exact gradients, brute force, no sticking node.

Wedge damper: N. N. Balaji, E. Ferhatoglu (2025), programs of "nonuniq", script c1: two masses, a damper between them
on two oblique contacts. Values computed there by time sampling.
"""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from nonlinear import ContactParameters, Excitation, OptionsError, ResponseCurve, SolverOptions, forced_response
from nonlinear.branches.range_continuation import continue_over_range
from nonlinear.contact.element_choice import contact_element
from nonlinear.contact.parameters import ContactElement, ContactForces
from nonlinear.continuation.arclength_continuation import Continuation
from nonlinear.continuation.response_quantities import output_amplitude
from nonlinear.harmonic_balance.initial_solution import solve_at
from nonlinear.harmonic_balance.residual import HarmonicBalance
from nonlinear.residual_tractions.extreme_amplitude import (
    TractionLevels,
    TractionOrigins,
    TractionSearch,
    nearest_peak,
)
from nonlinear.response_solver import build_harmonic_balance
from rom import ModalModel, ReducedModel, modal_model
from rom.cyclic.receptance import RelativeReceptance

HARMONICS = 5
STUCK_HZ = (15.87579, 31.83099, 49.42141, 74.07305, 390.82342, 811.64284)
MASS, DAMPING = np.diag([10.0] * 4 + [0.1] * 2), np.diag([20.0] * 4 + [0.0] * 2)


def joined(first: int, second: int, stiffness: float) -> np.ndarray:
    matrix = np.zeros((6, 6))
    matrix[np.ix_([first, second], [first, second])] = stiffness * np.array([[1.0, -1.0], [-1.0, 1.0]])
    return matrix


GROUNDED = np.diag([1e5] * 4 + [0.0, 0.0])
STIFFNESS = GROUNDED + joined(0, 1, 9e5) + joined(2, 3, 3e5) + joined(4, 5, 1e6)
COS, SIN = np.cos(np.deg2rad(40.0)), np.sin(np.deg2rad(40.0))
CONTACTS = np.zeros((6, 6))  # (t1, t2, n) of both contacts by (x1, y1, x2, y2, xD, yD)
for row, (x, y), mass in ((0, (COS, SIN), 0), (2, (-SIN, COS), 0), (3, (COS, -SIN), 2), (5, (SIN, COS), 2)):
    CONTACTS[row, 4:], CONTACTS[row, mass : mass + 2] = (x, y), (-x, -y)
SPRINGS = np.tile([3e5, 0.0, 3e5], 2)
WEDGE = ContactParameters(np.full(2, 3e5), np.full(2, 3e5), np.full(2, 0.9), np.zeros(2), np.zeros(2))


@dataclass(frozen=True)
class DampedReceptance(RelativeReceptance):
    """Receptance of the masses and the damper on the contact springs; its damping is not modal."""

    def dynamic_stiffness(self, omega: float) -> tuple[np.ndarray, np.ndarray]:
        h = np.asarray(self.harmonics, dtype=float)[:, None, None]
        stiffness = STIFFNESS + CONTACTS.T @ (SPRINGS[:, None] * CONTACTS)
        return stiffness + 1j * h * omega * DAMPING - (
            h * omega
        ) ** 2 * MASS, 1j * h * DAMPING - 2 * h * h * omega * MASS

    def _terms(self, omega: float, contact_force: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        value, derivative = self.dynamic_stiffness(omega)
        motion = np.linalg.solve(value, self.modal_force[..., None] + self.adjoint @ contact_force[..., None])
        return motion[..., 0], -np.linalg.solve(value, derivative @ motion)[..., 0]

    def matrix(self, omega: float) -> np.ndarray:
        return self.relative @ np.linalg.solve(self.dynamic_stiffness(omega)[0], self.adjoint)

    def output_rows(self, name: str, omega: float) -> np.ndarray:
        return self.modal.outputs[name] @ np.linalg.solve(self.dynamic_stiffness(omega)[0], self.adjoint)


@dataclass(frozen=True)
class WithoutSprings:
    """Contact forces less those of the contact springs, which the structure has (its damper floats without them)."""

    element: ContactElement

    def at(self, variables: np.ndarray) -> "WithoutSprings":
        return WithoutSprings(self.element.at(variables))  # type: ignore[attr-defined]

    def evaluate(self, displacement: np.ndarray) -> ContactForces:
        forces, springs = self.element.evaluate(displacement), SPRINGS.reshape(2, 3)
        jacobian, rows = forces.jacobian.copy(), np.arange(displacement.shape[0])
        for axis in range(3):
            jacobian[:, axis, axis, rows, rows] += springs[:, axis, None]
        return replace(forces, force=forces.force + springs * displacement, jacobian=jacobian)

    def derivative(self, displacement: np.ndarray, forces: ContactForces) -> np.ndarray:
        return self.element.derivative(displacement, forces)  # type: ignore[attr-defined, no-any-return]


@pytest.fixture(scope="module")
def wedge() -> Continuation:
    """Continuation of the wedge damper near its third mode; output: y2."""
    force, static = np.zeros((2, 6))
    force[1], force[2], static[5] = -20.0, 5.0, 240.0
    modal = ModalModel(
        angular_frequency=np.full(6, 100.0),  # of no influence here
        damping=np.zeros(6),
        right=CONTACTS,
        left=None,
        force=-1j * force,  # sin(omega t)
        static_force=static,
        outputs={"tip": np.eye(6)[3]},
        shapes=np.eye(6),
        position=np.zeros((2, 3)),
        area=None,
        n_blades=None,
    )
    receptance = DampedReceptance(modal, 0.0, tuple(range(HARMONICS + 1)), 1.0)
    options = SolverOptions((48.0, 51.0), harmonics=HARMONICS)
    balance = HarmonicBalance(receptance, WithoutSprings(contact_element(WEDGE, HARMONICS, options)))
    return Continuation(balance, options)


@dataclass(frozen=True)
class StartedAtPhaseZero:
    """Sliders that start at t = 0 with T = m mu N there: the start follows the motion, w0 = u(0) - m mu N(0) / kt."""

    element: ContactElement
    level: float

    def evaluate(self, displacement: np.ndarray) -> ContactForces:
        first = np.zeros(displacement.shape[0])
        first[0], first[1::2] = 1.0, 1.0  # the basis at t = 0
        now = np.tensordot(first, displacement, axes=1)
        mu_kt = self.level * WEDGE.friction / WEDGE.tangential_stiffness
        moved = displacement.copy()
        moved[0, :, 0] -= now[:, 0] - mu_kt * WEDGE.normal_load(now[:, 2])
        forces = self.element.evaluate(moved)
        jacobian = forces.jacobian.copy()
        by_start = forces.jacobian[:, :, 0, :, 0][..., None] * first
        jacobian[:, :, 0] -= by_start
        jacobian[:, :, 2] += by_start * (mu_kt * WEDGE.normal_stiffness)[:, None, None, None]
        return replace(forces, jacobian=jacobian)


def wedge_static() -> np.ndarray:
    force = np.r_[np.zeros(5), 240.0]
    return (CONTACTS @ np.linalg.solve(STIFFNESS + CONTACTS.T @ (SPRINGS[:, None] * CONTACTS), force)).reshape(2, 3)


# the instant of the start is not the same in the last digits of the middle case, and its peak depends on it
@pytest.mark.parametrize(
    ("level", "amplitude", "frequency_hz", "tolerance"),
    [(-1.0, 4.48698e-4, 49.418, 5e-4), (0.0, 4.0489e-4, 49.361, 5e-3), (1.0, 3.371e-4, 49.424, 5e-4)],
)
def test_wedge_damper_has_the_peaks_of_the_literature(
    wedge: Continuation, level: float, amplitude: float, frequency_hz: float, tolerance: float
) -> None:
    element = StartedAtPhaseZero(contact_element(WEDGE, HARMONICS, wedge.options), level)
    there = replace(wedge, balance=replace(wedge.balance, element=WithoutSprings(element)))
    branch = continue_over_range(there, wedge_static())[0]
    highest = max(branch.points, key=lambda point: output_amplitude(point, "tip", mean=0.0))
    peak = nearest_peak(there, highest, mean=0.0)
    assert peak is not None
    assert output_amplitude(peak, "tip", mean=0.0) == pytest.approx(amplitude, rel=tolerance)
    assert peak.omega / (2.0 * np.pi) == pytest.approx(frequency_hz, rel=tolerance)


def test_wedge_damper_sticks_at_its_frequencies() -> None:
    stiffness = STIFFNESS + CONTACTS.T @ (SPRINGS[:, None] * CONTACTS)
    squared = np.linalg.eigvals(np.linalg.solve(MASS, stiffness)).real
    np.testing.assert_allclose(np.sqrt(np.sort(squared)) / (2.0 * np.pi), STUCK_HZ, rtol=1e-6)


def test_bounds_of_the_wedge_damper_and_exact_gradients(wedge: Continuation) -> None:
    levels = TractionLevels(WEDGE, contact_element(WEDGE, HARMONICS, wedge.options), np.zeros((2, 2)))
    search = TractionSearch(wedge, WithoutSprings(levels), mean=0.0)
    first = continue_over_range(wedge, wedge_static())[0]
    highest = max(first.points, key=lambda point: output_amplitude(point, "tip", mean=0.0))
    start = search.start(np.array([[-0.95, 0.0], [0.0, 0.0]]), highest)
    assert start is not None
    middle = search.move(np.array([[-0.3, 0.0], [0.0, 0.0]]))
    assert middle is not None
    step = np.zeros((2, 2))
    step[0, 0] = 1e-4
    above, below = search.move(middle.variables + step), search.move(middle.variables - step)
    assert above is not None
    assert below is not None
    assert (above.amplitude - below.amplitude) / 2e-4 == pytest.approx(middle.gradient[0, 0], rel=1e-6)
    # the second contact slips: 0 but for round-off, which is 1e-16 of what the first one does, or some times that
    assert middle.gradient[1] == pytest.approx([0.0, 0.0], abs=1e-10 * abs(middle.gradient[0, 0]))
    low, high = search.extreme(start, -1.0), search.extreme(start, 1.0)
    assert low.amplitude == pytest.approx(3.371e-4, rel=5e-4)
    assert high.amplitude == pytest.approx(4.48698e-4, rel=5e-4)
    assert high.point.contact.state.tolist() == [0, 0]  # fully stuck
    # the displacement as a whole, with vibration and mean, against time samples of sliders that start at either limit
    whole = TractionSearch(wedge, WithoutSprings(levels), mean=None)
    start = whole.start(start.variables, start.point)
    assert start is not None
    sampled = contact_element(WEDGE, HARMONICS, replace(wedge.options, integration="sampled", samples=1024))
    for sign, level in ((-1.0, 1.0), (1.0, -1.0)):
        found = whole.extreme(start, sign)
        element = WithoutSprings(StartedAtPhaseZero(sampled, level))
        peak = nearest_peak(replace(wedge, balance=replace(wedge.balance, element=element)), found.point, mean=None)
        assert peak is not None
        for mean in (None, 0.0):
            expected = output_amplitude(peak, "tip", mean)
            assert output_amplitude(found.point, "tip", mean) == pytest.approx(expected, rel=1e-4)
        assert found.amplitude > output_amplitude(found.point, "tip", 0.0) + 1e-3  # its mean: 1.0 and 1.6 mm


def random_structure(seed: int, law: str = "two_sliders") -> tuple[ModalModel, ContactParameters, Excitation]:
    """A coupled structure with three contacts against ground, some of which slip at the peak and some stick."""
    rng, size = np.random.default_rng(seed), 11
    root = rng.normal(size=(size, size))
    mass = np.diag(np.r_[rng.uniform(0.1, 0.3, size)[:-2], 1.0, 1.0])
    model = ReducedModel(
        mass=mass,
        stiffness=root @ root.T / size + 0.3 * np.eye(size),
        contact_right=np.eye(size)[:9],
        contact_position=np.zeros((3, 3)),
        force_excitation=np.eye(size)[-1],
        outputs={"tip": np.eye(size)[-2]},
        producer="test",
    )
    contact = ContactParameters(
        normal_stiffness=rng.uniform(0.5, 2.0, 3),
        tangential_stiffness=rng.uniform(0.5, 2.0, 3),
        friction=rng.uniform(0.2, 0.6, 3),
        interference=rng.uniform(0.5, 2.0, 3),
        preload=np.zeros(3),
        law=law,  # type: ignore[arg-type]
    )
    return modal_model(model, damping_ratio=0.01), contact, Excitation(0, float(rng.uniform(0.02, 0.08)))


RANGE = SolverOptions((0.05, 0.2), detached=False, truncation=False, stability="folds", search="off")


@pytest.fixture(scope="module")
def curve() -> ResponseCurve:
    """A curve with bounds."""
    return forced_response(*random_structure(3), replace(RANGE, residual_tractions="bounds"))


def test_random_starts_stay_inside_the_bounds(curve: ResponseCurve) -> None:
    bounds = curve.residual_bounds
    assert bounds is not None
    assert curve.peak is not None
    assert curve.free_nodes > 0
    assert bounds.highest.amplitude_m > 1.01 * curve.peak.amplitude_m
    for each in (bounds.lowest, bounds.highest, bounds.least_vibration, bounds.most_vibration):  # one motion each
        assert each.amplitude_m == pytest.approx(each.vibration_m + abs(each.static_m), rel=1e-12)  # H = 1
    modal, contact, excitation = random_structure(3)
    rng, reach = np.random.default_rng(3), 3.0 * float(np.abs(curve.relative_displacement).max())
    for _ in range(8):
        origin = rng.uniform(-reach, reach, (3, 2))
        other = forced_response(modal, replace(contact, slider_origin=origin), excitation, RANGE)
        # the range is swept densely: the largest vibration, to a few parts in ten thousand
        vibration, whole = other.harmonic_m[:, 0].max(), other.amplitude_m.max()
        assert bounds.lowest.amplitude_m * (1.0 - 1e-3) <= whole <= bounds.highest.amplitude_m * (1.0 + 1e-6)
        assert bounds.least_vibration.vibration_m * (1.0 - 1e-3) <= vibration
        assert vibration <= bounds.most_vibration.vibration_m * (1.0 + 1e-6)


def test_the_curve_from_the_bounding_tractions_has_the_bound_as_its_peak(curve: ResponseCurve) -> None:
    bounds = curve.residual_bounds
    assert bounds is not None
    modal, contact, excitation = random_structure(3)
    for extreme in (bounds.lowest, bounds.highest, bounds.most_vibration):
        again = forced_response(modal, replace(contact, slider_origin=extreme.slider_origin), excitation, RANGE)
        near = int(np.argmin(np.abs(again.frequency_hz - extreme.frequency_hz)))
        np.testing.assert_allclose(again.static_m[near], extreme.static_m, rtol=1e-2)
        np.testing.assert_allclose(again.harmonic_m[near, 0], extreme.vibration_m, rtol=1e-2)
        assert extreme.curve_amplitude_m.max() == pytest.approx(extreme.amplitude_m, rel=1e-4)
        assert np.all(np.abs(extreme.traction) <= contact.friction[:, None] * 10.0)
    assert np.all(bounds.band_lowest_m <= bounds.band_highest_m)
    assert curve.peak is not None
    at_peak = bounds.band_index == curve.peak.index
    assert bounds.band_lowest_m[at_peak] < curve.peak.amplitude_m < bounds.band_highest_m[at_peak]


def test_the_band_vanishes_where_everything_slips() -> None:
    modal, contact, excitation = random_structure(3)
    slippery = replace(contact, friction=2e-3 * contact.friction)
    curve = forced_response(modal, slippery, excitation, replace(RANGE, residual_tractions="bounds"))
    bounds, peak = curve.residual_bounds, curve.peak
    assert bounds is not None
    assert peak is not None
    assert (curve.sticking[peak.index], curve.slipping[peak.index]) == (0, 3)
    assert curve.free_nodes == 0
    assert bounds.lowest.amplitude_m == bounds.highest.amplitude_m == pytest.approx(peak.amplitude_m, rel=1e-12)


def test_the_gradient_by_the_starts_of_a_cone_is_exact() -> None:
    modal, contact, excitation = random_structure(3, "cone")
    balance = build_harmonic_balance(modal, contact, excitation, RANGE)
    solved = solve_at(balance, 0.7, np.zeros(balance.size), RANGE)
    assert solved.converged
    point = Continuation(balance, RANGE).solver.starting_point(solved.solution, 0.7, 1.0, 0)
    origins = TractionOrigins(balance.element, np.zeros((3, 2)), np.ones((3, 2)), np.zeros((3, 2)))
    search = TractionSearch(Continuation(balance, RANGE), origins, mean=None, fixed_frequency=True)
    places = 0.02 * np.random.default_rng(1).normal(size=(3, 2))
    middle, gradient = search.start(places, point), np.zeros((3, 2))
    assert middle is not None
    for k, c in np.ndindex(3, 2):
        step = np.zeros((3, 2))
        step[k, c] = 1e-5
        above, below = search.move(places + step), search.move(places - step)
        assert above is not None
        assert below is not None
        gradient[k, c] = (above.amplitude - below.amplitude) / 2e-5
    assert np.abs(gradient).max() > 1e-3
    np.testing.assert_allclose(middle.gradient, gradient, rtol=1e-6, atol=1e-8)


def test_bounds_need_the_coupled_method() -> None:
    with pytest.raises(OptionsError, match="coupled"):
        SolverOptions((1.0, 2.0), residual_tractions="bounds", method="static-first")
    with pytest.raises(OptionsError, match="residual_tractions"):
        SolverOptions((1.0, 2.0), residual_tractions="both")  # type: ignore[arg-type]
