"""Blade-tip timing: passages of blades with a known vibration, aliases, amplitudes from several probes."""

import numpy as np
import pytest

from nonlinear.time_integration.tip_timing import Passages, TipTiming, fitted_amplitudes, tells_amplitude

BLADES, RADIUS = 12, 0.5


def timing(angles: list[float], engine_order: int, speed: float = 0.0) -> TipTiming:
    return TipTiming(np.radians(angles), RADIUS, engine_order, BLADES, 2, speed)


def fed(reader: TipTiming, omega: float, amplitude: float, parts: int = 6, periods: int = 10) -> None:
    """A vibration amplitude cos(theta + E 2 pi b / N) + 1 mm of all blades, in parts of some periods."""
    theta = 2.0 * np.pi * (np.arange(periods * 64) + 1.0) / 64
    phase = 2.0 * np.pi * reader.engine_order / BLADES * np.arange(BLADES)
    output = 1e-3 + amplitude * np.cos(theta[:, None] + phase)
    for part in range(parts):
        reader(part * periods * 2.0 * np.pi / omega, omega, output.reshape(periods, 64, BLADES))


def exact(passages: Passages, reader: TipTiming, omega: float, amplitude: float) -> np.ndarray:
    """Distance of the tip from each probe, m, at the time of each passage: 0."""
    ratio = 1.0 / reader.engine_order if reader.engine_order else reader.speed / omega
    turned = ratio * omega * passages.time_s
    phase = 2.0 * np.pi * reader.engine_order / BLADES * passages.blade
    moved = 1e-3 + amplitude * np.cos(omega * passages.time_s + phase)
    angle = turned + 2.0 * np.pi * passages.blade / BLADES + moved / RADIUS
    return np.asarray(RADIUS * (angle - reader.angles[passages.probe] - 2.0 * np.pi * passages.revolution))


def test_each_tip_is_at_its_probe_when_it_passes() -> None:
    reader = timing([10.0, 75.0, 200.0], 4)
    fed(reader, 500.0, 2e-3)
    passages = reader.passages()
    later = passages.time_s > 0.05  # the very first part begins without the step before
    assert np.abs(exact(passages, reader, 500.0, 2e-3))[later].max() < 1e-7
    assert len(passages.time_s) == 15 * 3 * 2  # 60 periods are 15 revolutions
    assert np.all(np.diff(passages.time_s) > 0.0)


def test_probes_tell_the_amplitude_of_a_vibration_of_an_engine_order() -> None:
    reader = timing([10.0, 75.0, 200.0, 340.0], 4)
    fed(reader, 500.0, 5e-4)
    frequency, amplitude = fitted_amplitudes(reader.passages(), reader.angles, 4)
    assert frequency == pytest.approx(500.0 / (2.0 * np.pi))
    assert amplitude[1:] == pytest.approx(5e-4, rel=0.02)  # the phases are 4 u / r away from those of the probes


def test_one_probe_sees_an_engine_order_as_a_constant_and_other_frequencies_as_aliases() -> None:
    reader = timing([30.0], 4)
    fed(reader, 500.0, 2e-3)
    seen = reader.passages()
    assert np.ptp(seen.displacement_m[seen.blade == 0][1:]) < 1e-8
    speed = 2.0 * np.pi * 40.0
    other = timing([30.0], 0, speed)
    fed(other, 2.0 * np.pi * 93.0, 1e-6, parts=60)  # 93 Hz at 40 revolutions a second: 13 Hz
    seen = other.passages()
    own = seen.displacement_m[seen.blade == 0]
    lines = np.abs(np.fft.rfft(own - own.mean()))
    assert np.fft.rfftfreq(len(own), 1.0 / 40.0)[lines.argmax()] == pytest.approx(13.0, abs=0.1)


def test_the_timer_rounds_and_scatters() -> None:
    reader = timing([10.0, 75.0, 200.0], 4)
    fed(reader, 500.0, 2e-3, parts=60)
    fine, coarse, noisy = (reader.passages(), reader.passages(1e-5), reader.passages(noise=1e-6, seed=1))
    tip = RADIUS * 125.0
    assert np.abs(coarse.displacement_m - fine.displacement_m).max() == pytest.approx(0.5e-5 * tip, rel=0.05)
    assert np.std(noisy.displacement_m - fine.displacement_m) == pytest.approx(1e-6 * tip, rel=0.1)
    assert np.allclose(coarse.time_s / 1e-5, np.round(coarse.time_s / 1e-5))


@pytest.mark.parametrize(
    ("angles", "engine_order", "told"),
    [([0.0, 40.0, 100.0], 4, True), ([0.0, 90.0, 180.0, 270.0], 4, False), ([0.0, 40.0], 4, False)],
)
def test_probes_that_see_one_phase_tell_no_amplitude(angles: list[float], engine_order: int, told: bool) -> None:
    assert tells_amplitude(np.radians(angles), engine_order) == told
