"""Linear segments of a curve: no iterations, the linear response to the last digit, and their ends in place."""

from itertools import pairwise

import numpy as np
import pytest
from lumped import lumped_blade

from nonlinear import ContactParameters, Excitation, SolverOptions, contact_cycle, forced_response
from nonlinear.branches.range_continuation import continue_over_range
from nonlinear.contact.element_choice import contact_element
from nonlinear.contact.fourier import to_complex
from nonlinear.continuation.arclength_continuation import Continuation
from nonlinear.continuation.linear_segments import LinearSegments
from nonlinear.continuation.response_kernels import SprungHarmonic, moving_forces, sprung_motion
from nonlinear.continuation.response_quantities import output_amplitude
from nonlinear.harmonic_balance.initial_solution import static_displacement
from nonlinear.response_solver import build_harmonic_balance
from rom import linear_response, modal_model

SPAN = (0.1, 0.8)


def problem(interference, friction=0.4, law="two_sliders", harmonics=1, preload=0.0):
    modal = modal_model(lumped_blade(), damping_ratio=0.01)
    contact = ContactParameters.shared(
        2,
        normal_stiffness=6.0,
        tangential_stiffness=4.0,
        friction=friction,
        interference=interference,
        preload=preload,
        law=law,
    )
    return (
        modal,
        contact,
        Excitation(4, 1.0),
        SolverOptions(SPAN, harmonics=harmonics, detached=False, truncation=False, search="off"),
    )


@pytest.mark.parametrize(
    ("interference", "friction", "springs"),
    [
        (-1e3, 0.4, {}),
        (1e3, 0.4, {"normal": 3.0, "tangential": 2.0}),
        (1e3, 0.0, {"normal": 3.0}),  # pressed together without friction: it slides, and is linear
    ],
)
@pytest.mark.parametrize("law", ["two_sliders", "cone"])
def test_the_whole_curve_is_linear(interference, friction, springs, law):
    modal, contact, excitation, options = problem(interference, friction, law, harmonics=3)
    curve = forced_response(modal, contact, excitation, options)
    assert curve.termination.complete
    linear = linear_response(modal, curve.frequency_hz, phase=modal.phase(4), force=1.0, **springs)
    assert curve.output[:, 1] == pytest.approx(linear, rel=1e-9)
    ordinary = np.ones(curve.points, dtype=bool)
    ordinary[[peak.index for peak in curve.peaks]] = False  # these are solved for
    assert curve.iterations[ordinary].sum() == 0


@pytest.mark.parametrize(("interference", "law"), [(-3.0, "two_sliders"), (1.5, "two_sliders"), (-3.0, "cone")])
def test_a_linear_segment_ends_where_a_contact_changes(interference, law):
    """At the last linear point a contact just touches, or just begins to slip: found in the time domain."""
    modal, contact, excitation, options = problem(interference, law=law)
    balance = build_harmonic_balance(modal, contact, excitation, options)
    static = static_displacement(balance.receptance, contact, options)
    points = continue_over_range(Continuation(balance, options, contact=contact), static)[0].points
    ends = [point for point, after in pairwise(points) if point.linear is not None and after.linear is None]
    assert ends
    for end in ends:
        cycle = contact_cycle(to_complex(end.displacement), contact, samples=20000)
        v = contact.interference + cycle.displacement[..., 2]
        if interference < 0.0:
            assert v.max() == pytest.approx(0.0, abs=1e-6)
        else:
            load = contact.normal_stiffness * v
            reach = contact.friction / contact.tangential_stiffness * load
            upper, lower = (cycle.displacement[..., :2] + way * reach[..., None] for way in (1.0, -1.0))
            places = upper.min(axis=0) - lower.max(axis=0)  # of a slider that never slips
            assert min(places.min(), load.min()) == pytest.approx(0.0, abs=1e-5)


@pytest.mark.parametrize("interference", [-3.0, 1.5])
def test_the_same_curve_as_with_newton_everywhere(interference):
    modal, contact, excitation, options = problem(interference, harmonics=3)
    balance = build_harmonic_balance(modal, contact, excitation, options)
    static = static_displacement(balance.receptance, contact, options)
    branches = {}
    for name, known in (("linear segments", contact), ("newton", None)):
        continuation = Continuation(balance, options, contact=known)
        branch = continue_over_range(continuation, static)[0]
        assert branch.termination.complete
        branches[name] = branch
    heights = [
        sorted(output_amplitude(branch.points[i], "tip") for i in branch.peak_indices) for branch in branches.values()
    ]
    assert len(heights[0]) > 0
    assert heights[0] == pytest.approx(heights[1], rel=1e-9)
    # every linear point solves the equations that Newton's method would solve
    for point in branches["linear segments"].points:
        residual = balance.evaluate(point.unknown, point.omega).residual
        assert balance.relative_error(residual, point.unknown) < 1e-11


@pytest.mark.parametrize("law", ["two_sliders", "cone"])
@pytest.mark.parametrize("preload", [0.0, 0.7])
def test_forces_are_those_of_the_contact_element(law, preload):
    modal, contact, excitation, options = problem(1e3, law=law, harmonics=2, preload=preload)
    for interference in (-1e3, 1e3):
        contact = contact.with_interference(interference)
        balance = build_harmonic_balance(modal, contact, excitation, options)
        segments = LinearSegments(balance, contact)
        motion = 0.1 * np.random.default_rng(2).normal(size=(5, 2, 3))
        motion[3:] = 0.0
        state = segments.state(motion)
        assert state is not None
        expected = contact_element(contact, 2, options).evaluate(motion)
        found = segments.system(state).forces(motion)
        assert found.force == pytest.approx(expected.force, rel=1e-9, abs=1e-9)
        assert found.jacobian == pytest.approx(expected.jacobian, rel=1e-9, abs=1e-8)
        assert np.array_equal(found.state, expected.state)


@pytest.mark.parametrize("stiffness", [0.0, 3.0])
def test_the_motion_between_springs_solves_the_equations_of_the_structure(stiffness):
    """(K + B^H k B - (h w)^2 M + i h w C) q = f in the coordinates of the structure; derivatives by differences."""
    rng = np.random.default_rng(3)
    nodes, modes, h, omega = 6, 9, 2.0, 1.3
    relative = rng.normal(size=(nodes, modes)) + 1j * rng.normal(size=(nodes, modes))
    springs = stiffness * np.append(rng.uniform(0.5, 1.0, nodes - 1), 0.0)
    force = rng.normal(size=modes) + 1j * rng.normal(size=modes)
    squares, damping = rng.uniform(1.0, 30.0, modes), rng.uniform(0.01, 0.1, modes)
    adjoint = np.ascontiguousarray(relative.conj().T)
    structure = SprungHarmonic(relative, adjoint, springs, force, squares, damping, 1.0, h)

    def solved(frequency):
        dynamic = np.diag(squares - (h * frequency) ** 2 + 1j * h * frequency * damping)
        return np.linalg.solve(dynamic + relative.conj().T @ (springs[:, None] * relative), force)

    motion, change, coordinates, coordinates_change = sprung_motion(structure, omega)
    assert coordinates == pytest.approx(solved(omega), rel=1e-11)
    assert motion == pytest.approx(relative @ coordinates, rel=1e-11)
    slope = (solved(omega + 1e-5) - solved(omega - 1e-5)) / 2e-5
    assert coordinates_change == pytest.approx(slope, rel=1e-7)
    assert change == pytest.approx(relative @ coordinates_change, rel=1e-10)


@pytest.mark.parametrize("first", [0, 1])
def test_changes_of_forces_are_the_jacobian_times_the_motion(first):
    rng = np.random.default_rng(4)
    force, motion = rng.normal(size=(5, 2, 3)), rng.normal(size=(5 - first, 2, 3))
    jacobian = rng.normal(size=(2, 3, 3, 5, 5))
    change = np.einsum("kabij,jkb->ika", jacobian[..., first:], motion)
    found = moving_forces(force, jacobian, motion)
    for column, rows in enumerate((force, change)):
        assert found[..., column] == pytest.approx(to_complex(rows.reshape(5, 6)), rel=1e-12)
