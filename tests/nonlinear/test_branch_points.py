"""Branch points: the branch of symmetric motions goes straight on through them and loses its stability there."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from nonlinear import BifurcationKind, ContactParameters, Excitation, SolverOptions, forced_response
from rom import ReducedModel, modal_model

STIFFNESS, DAMPING, FORCE, HARMONICS = 3.0, 0.02, 3.0, 15


@pytest.fixture(scope="module")
def curve():
    """A mass between two elastic stops at +1 and -1, x'' + 0.04 x' + x + 3 (beyond the stops) = 3 cos(w t)."""
    right = np.zeros((6, 1))
    right[2, 0], right[5, 0] = 1.0, -1.0
    model = ReducedModel(
        mass=np.eye(1),
        stiffness=np.eye(1),
        contact_right=right,
        contact_position=np.zeros((2, 3)),
        force_excitation=np.ones(1),
        outputs={"tip": np.ones(1)},
        n_blades=None,
        producer="test",
    )
    contact = ContactParameters.shared(
        2, normal_stiffness=2 * STIFFNESS, tangential_stiffness=0.0, friction=0.0, interference=-1.0
    )
    options = SolverOptions((0.05, 0.6), harmonics=HARMONICS, detached=False, truncation=False, search="off")
    return forced_response(modal_model(model, damping_ratio=DAMPING), contact, Excitation(0, FORCE), options)


def test_symmetric_motions_are_followed_through_the_branch_points(curve):
    assert curve.termination.complete
    kinds = [item.kind for item in curve.bifurcations]
    assert kinds.count(BifurcationKind.BRANCH_POINT) == 4  # two intervals of asymmetric motions
    assert np.abs(curve.output[:, 0::2]).max() < 1e-9  # and the curve stays with the symmetric ones
    assert curve.points < 300


def asymmetry_growth(curve, index, periods=30):
    """Growth rate (1/s) of x(t + T/2) + x(t) in time integration; the truncation error of its start perturbs it."""
    omega = 2.0 * np.pi * curve.frequency_hz[index]
    order = np.arange(HARMONICS + 1)
    start = (curve.output[index] * np.array([np.ones(HARMONICS + 1), 1j * order * omega])).sum(axis=1).real

    def motion(t, state):
        x, v = state
        stop = STIFFNESS * (max(x - 1.0, 0.0) - max(-x - 1.0, 0.0))
        return v, FORCE * np.cos(omega * t) - 2.0 * DAMPING * v - x - stop

    half = np.pi / omega * np.arange(2 * periods + 1)
    states = solve_ivp(motion, (0.0, half[-1]), start, t_eval=half, rtol=1e-11, atol=1e-12).y
    sums = np.linalg.norm(states[:, 1:] + states[:, :-1], axis=0)
    small = slice(3, int(np.argmax(np.append(sums, 1.0) > 0.1)))  # settled, and still a small perturbation
    return np.polyfit(half[:-1][small], np.log(sums[small]), 1)[0]


@pytest.mark.parametrize(("hertz", "stable"), [(0.098, True), (0.115, False), (0.137, False), (0.16, True)])
def test_time_integration_leaves_the_symmetric_motion_between_branch_points(curve, hertz, stable):
    near = np.abs(curve.frequency_hz - hertz)
    index = int(np.argmin(near))
    assert near[index] < 0.01
    assert curve.stable[index] == stable
    growth = asymmetry_growth(curve, index)
    assert (growth < 0.0) == stable
    assert growth == pytest.approx(curve.growth_rate[index], rel=0.05 if stable else 0.01)
