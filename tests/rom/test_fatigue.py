"""Amplitude and mean of multiaxial cycles against closed forms, Goodman and yield lines, smallest balls."""

import numpy as np
import pytest

from rom import RomParameterError
from rom.stress.fatigue import FatigueLimits, enclosing_balls, stress_cycle
from rom.stress.stress_recovery import deviator, von_mises

LIMITS = FatigueLimits(endurance_limit=300.0, tensile_strength=900.0)


def cycle_of(*harmonics):
    """Cycle of one point with tensors (6,) of harmonics 0, 1, ..."""
    found = stress_cycle(np.array(harmonics, dtype=complex)[:, None])
    return float(found.amplitude[0]), float(found.mean[0]), float(found.largest[0])


def tension(size):
    return np.array([size, 0, 0, 0, 0, 0], dtype=complex)


def shear(xy=0.0, yz=0.0):
    return np.array([0, 0, 0, xy, yz, 0], dtype=complex)


def test_von_mises_of_tension_shear_and_pressure():
    stress = np.array([[7.0, 0, 0, 0, 0, 0], [0, 0, 0, 0, 2.0, 0], [3.0, 3.0, 3.0, 0, 0, 0]])
    np.testing.assert_allclose(von_mises(stress), [7.0, 2.0 * np.sqrt(3.0), 0.0], atol=1e-12)
    random = np.random.default_rng(1).normal(size=(20, 6))
    tensor = random[:, [[0, 3, 5], [3, 1, 4], [5, 4, 2]]]
    part = tensor - np.trace(tensor, axis1=1, axis2=2)[:, None, None] / 3 * np.eye(3)
    np.testing.assert_allclose(von_mises(random), np.sqrt(1.5 * np.sum(part**2, axis=(1, 2))), rtol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(deviator(random), axis=1), von_mises(random), rtol=1e-12)


def test_a_uniaxial_cycle_has_half_its_range_and_its_mid_range():
    assert cycle_of(tension(2.0), tension(3.0j)) == pytest.approx((3.0, 2.0, 5.0))
    assert cycle_of(tension(-2.0), tension(3.0)) == pytest.approx((3.0, -2.0, 5.0))
    # cos t + 0.5 cos 2t runs from -0.75 (at cos t = -1/2) to 1.5: the mid-range is not the mean over time
    amplitude, mean, _ = cycle_of(tension(10.0), tension(1.0), tension(0.5))
    assert amplitude == pytest.approx(1.125, rel=3e-3)
    assert mean == pytest.approx(10.375, rel=1e-4)


def test_shear_in_one_plane_and_shear_that_turns():
    assert cycle_of(shear(), shear(xy=2.0))[0] == pytest.approx(2.0 * np.sqrt(3.0))
    # (xy, yz) = 2 (cos t, sin t): a circle in the space of deviators
    assert cycle_of(shear(), shear(xy=2.0, yz=-2.0j))[0] == pytest.approx(2.0 * np.sqrt(3.0))
    # the larger half axis where the sizes differ
    assert cycle_of(shear(), shear(xy=2.0, yz=-1.0j))[0] == pytest.approx(2.0 * np.sqrt(3.0))
    # in phase they add up as vectors
    assert cycle_of(shear(), shear(xy=2.0, yz=1.0))[0] == pytest.approx(np.sqrt(3.0 * 5.0))


def test_tension_and_torsion_out_of_phase_by_a_quarter():
    both = tension(np.sqrt(3.0)) + shear(xy=-1.0j)  # equal von Mises sizes: amplitude as of either alone
    assert cycle_of(shear(), both)[0] == pytest.approx(np.sqrt(3.0))


def test_a_proportional_cycle_does_not_depend_on_the_direction_and_scales():
    direction = np.random.default_rng(2).normal(size=6)
    size = von_mises(direction)
    amplitude, mean, _ = cycle_of(0.0 * direction, (1 + 1j) * direction)
    assert amplitude == pytest.approx(np.sqrt(2.0) * size)
    assert mean == 0.0
    twice = cycle_of(0.0 * direction, 2 * (1 + 1j) * direction, 0.1 * direction)
    once = cycle_of(0.0 * direction, (1 + 1j) * direction, 0.05 * direction)
    assert twice == pytest.approx(2 * np.array(once))


def test_several_harmonics_agree_with_the_closed_form_of_one():
    random = np.random.default_rng(3)
    one = random.normal(size=(2, 50, 6)) + 1j * random.normal(size=(2, 50, 6))
    one[0] = one[0].real
    exact = stress_cycle(one)
    shifted = np.concatenate([one[:1], 1e-9 * one[1:], one[1:]])  # the same path, run twice
    found = stress_cycle(shifted)
    np.testing.assert_allclose(found.amplitude, exact.amplitude, rtol=3e-3)
    np.testing.assert_allclose(found.mean, exact.mean, rtol=3e-3)
    np.testing.assert_allclose(found.largest, exact.largest, rtol=3e-3)


def test_a_hydrostatic_cycle_has_no_amplitude():
    amplitude, mean, largest = cycle_of(tension(1.0), np.array([1, 1, 1, 0, 0, 0], dtype=complex))
    assert amplitude == pytest.approx(0.0, abs=1e-12)
    assert (mean, largest) == pytest.approx((1.0, 1.0))


def test_smallest_balls_have_their_farthest_points_on_every_side():
    points = np.random.default_rng(4).normal(size=(60, 30, 5))
    centre, radius = enclosing_balls(points, 1e-8)
    for cloud, middle, size in zip(points, centre, radius, strict=True):
        distance = np.linalg.norm(cloud - middle, axis=1)
        assert distance.max() == pytest.approx(size)
        # optimal: the centre is a convex combination of the points on the sphere (nonnegative least squares)
        from scipy.optimize import nnls

        touching = cloud[distance > size * (1 - 1e-4)]
        _, rest = nnls(np.vstack([touching.T, np.ones(len(touching))]), np.append(middle, 1.0))
        assert rest < 1e-3


def test_a_ball_of_one_point_and_of_two():
    centre, radius = enclosing_balls(np.array([[[1.0, 2.0], [1.0, 2.0]], [[0.0, 0.0], [4.0, 0.0]]]))
    np.testing.assert_allclose(centre, [[1.0, 2.0], [2.0, 0.0]], atol=1e-3)
    np.testing.assert_allclose(radius, [0.0, 2.0], rtol=1e-3)


def test_goodman_margin_of_the_textbook():
    assert LIMITS.goodman_margin(120.0, 250.0) == pytest.approx(1.47541, abs=5e-6)
    assert LIMITS.margin(120.0, 250.0) == pytest.approx(1.47541, abs=5e-6)  # no yield line
    assert LIMITS.goodman_margin(120.0, -250.0) == pytest.approx(300.0 / 120.0)  # compression: as without mean
    assert LIMITS.margin(0.0, 0.0) == np.inf


def test_at_the_margin_a_cycle_lies_on_the_line():
    limits = FatigueLimits(300.0, 900.0, 600.0)
    for amplitude, mean in ((120.0, 250.0), (50.0, 400.0), (20.0, -500.0)):
        n = limits.margin(amplitude, mean)
        assert limits.margin(n * amplitude, n * mean) == pytest.approx(1.0)
        factor = limits.amplitude_margin(amplitude, mean)
        assert limits.margin(factor * amplitude, mean) == pytest.approx(1.0)
    # the yield line counts at high means: 1 / (20 / 300 + 500 / 900) = 1.607, but 600 / 520 = 1.154
    assert limits.margin(20.0, 500.0) == pytest.approx(600.0 / 520.0)
    assert limits.yield_margin(20.0, -500.0) == pytest.approx(600.0 / 520.0)
    assert limits.amplitude_margin(10.0, 700.0) == 0.0


@pytest.mark.parametrize(
    ("limits", "key"),
    [
        ((0.0, 900.0), "endurance_limit"),
        ((300.0, np.inf), "tensile_strength"),
        ((1000.0, 900.0), "endurance_limit"),
        ((300.0, 900.0, 901.0), "yield_strength"),
    ],
)
def test_impossible_limits_are_refused(limits, key):
    with pytest.raises(RomParameterError, match=f"fatigue.{key}"):
        FatigueLimits(*limits)
