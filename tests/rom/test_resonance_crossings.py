"""Engine orders at natural frequencies: waves against the sampled force, bounds, distances, crossings over speed."""

import numpy as np
import pytest

from rom import ReducedModel, inter_blade_phase, natural_frequencies
from rom.cyclic.resonance_crossings import (
    excited_nodal_diameter,
    resonance_crossings,
    speed_crossings,
    wave_direction,
)


@pytest.mark.parametrize("n_blades", [11, 12])
def test_waves_are_those_of_a_force_at_rest_seen_by_the_blades(n_blades: int) -> None:
    """The force cos(EO theta) at rest is sampled at blades that turn towards +y; its wave is read off the samples."""
    time = np.arange(4096) / 4096.0  # revolutions
    blades = np.arange(n_blades) / n_blades
    for order in range(1, 3 * n_blades):
        force = np.cos(2.0 * np.pi * order * (blades[:, None] + time[None, :]))
        content = np.abs(np.fft.fft2(force))
        place, harmonic = np.unravel_index(np.argmax(content[:, :2048]), (n_blades, 2048))
        assert harmonic == order
        signed = (place + n_blades // 2) % n_blades - n_blades // 2  # exp(i (signed j pitch + EO t))
        assert excited_nodal_diameter(order, n_blades) == abs(signed)
        expected = "standing" if 2 * abs(signed) in (0, n_blades) else ("backward" if signed > 0 else "forward")
        assert wave_direction(order, n_blades) == expected


def test_springs_below_those_of_stuck_contacts_stay_between_the_limits() -> None:
    random = np.random.default_rng(3)
    size, nodes = 9, 2
    root = random.standard_normal((size, size))
    right, left = random.standard_normal((2, 3 * nodes, size))
    model = ReducedModel(
        np.eye(size),
        1e4 * (root @ root.T + np.eye(size)),
        right,
        np.zeros((nodes, 3)),
        np.ones(size),
        {"tip": np.ones(size)},
        left,
        n_blades=12,
        producer="a test",
    )
    phase, normal, tangential = inter_blade_phase(5, 12), 4e3, 2e3
    free = natural_frequencies(model, phase, count=6)
    stuck = natural_frequencies(model, phase, normal=normal, tangential=tangential, count=6)
    found = resonance_crossings(5, 12, free, stuck, (1e-3, 1e6))
    assert [each.mode for each in found] == [1, 2, 3, 4, 5, 6]
    for _ in range(20):
        shares = random.uniform(size=(2, nodes))
        hz = natural_frequencies(model, phase, normal=normal * shares[0], tangential=tangential * shares[1], count=6)
        for each, value in zip(found, hz, strict=True):
            assert each.free_hz <= value <= each.stuck_hz


def test_distances_and_margins() -> None:
    free, stuck = [100.0, 240.0, 300.0, 650.0, 900.0], [110.0, 260.0, 390.0, 700.0, 1000.0]
    found = {each.mode: each for each in resonance_crossings(2, 72, free, stuck, (250.0, 350.0), 9000.0)}
    assert set(found) == {1, 2, 3, 4}  # the fifth is beyond the next one above, and no nearer to 300 Hz
    assert [found[mode].in_range for mode in (1, 2, 3, 4)] == [False, True, True, False]
    assert found[1].range_distance == pytest.approx(110.0 / 250.0 - 1.0)
    assert found[4].range_distance == pytest.approx(650.0 / 350.0 - 1.0)
    assert found[3].margin == 0.0  # 2 x 9000 / 60 = 300 Hz
    assert found[2].margin == pytest.approx(260.0 / 300.0 - 1.0)
    far = resonance_crossings(2, 72, free, stuck, (250.0, 350.0), 27000.0)  # 900 Hz, outside of the range
    assert [each.mode for each in far] == [1, 2, 3, 4, 5]
    assert far[-1].margin == 0.0
    (alone,) = resonance_crossings(0, None, [100.0], [120.0], (110.0, 115.0), 3000.0)
    assert (alone.nodal_diameter, alone.wave, alone.speeds_rpm, alone.margin) == (0, "standing", None, None)


def test_crossings_over_speed_have_the_closed_form_of_a_stiffness_that_grows_with_its_square() -> None:
    at_rest, growth, order = 80.0, 1.7e-4, 3  # f^2 = f_0^2 + B n^2
    speeds = np.array([0.0, 700.0, 1900.0, 2400.0])
    natural = np.sqrt(at_rest**2 + growth * speeds**2)
    ((speed, frequency),) = speed_crossings(speeds, natural, order)
    assert speed == pytest.approx(at_rest / np.sqrt((order / 60.0) ** 2 - growth), rel=1e-12)
    assert frequency == pytest.approx(order * speed / 60.0, rel=1e-12)
    assert speed_crossings(speeds[:2], natural[:2], order) == []
    for first in (0, 1):  # one at a speed of the table counts once: 80 Hz at 80 rev/min, order 60
        assert speed_crossings([0.0, 80.0, 100.0][first:], [50.0, 80.0, 85.0][first:], 60) == [(80.0, 80.0)]
