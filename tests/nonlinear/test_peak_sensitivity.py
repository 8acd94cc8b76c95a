"""Derivatives of a peak on a solved curve: closed form of a mass with a slider."""

import numpy as np
import pytest
from lumped import oscillator

from nonlinear import ContactParameters, Excitation, SolverOptions, forced_response
from nonlinear.peak_curves.peak_sensitivity import peak_sensitivity
from rom import modal_model


def peak(limit: float) -> tuple[float, float]:
    """Amplitude and frequency, Hz, of the peak under unit force, mass and stiffness, for a limit of the slider."""
    amplitude = limit**2 / (limit - np.pi / 4.0)
    turn = np.arccos(1.0 - 2.0 * limit / amplitude)
    stiffness = (turn - 0.5 * np.sin(2.0 * turn)) / np.pi  # of the slider, first harmonic
    return float(amplitude), float(np.sqrt(1.0 + stiffness) / (2.0 * np.pi))


def test_derivatives_by_the_slip_limit_and_by_the_force() -> None:
    modal, limit = modal_model(oscillator(), damping_ratio=1e-13), 1.2
    springs = {"normal_stiffness": 0.0, "tangential_stiffness": 1.0}
    contact = ContactParameters.shared(1, **springs, friction=0.5, preload=2.0 * limit)
    quick = {"detached": False, "stability": "folds", "truncation": False, "search": "off"}
    problem = modal, contact, Excitation(0, 1.0), SolverOptions((0.1, 0.25), **quick)
    curve = forced_response(*problem)
    found = peak_sensitivity(problem, curve, curve.peak.index, ["friction", "preload", "force"])
    assert found is not None
    step = 1e-6
    rates = [
        (above - below) / (2.0 * step) for above, below in zip(peak(limit + step), peak(limit - step), strict=True)
    ]
    assert (found.amplitude_m, found.frequency_hz) == pytest.approx(peak(limit), rel=1e-8)
    for name, per_limit in (("friction", 2.0 * limit), ("preload", 0.5)):
        assert found.amplitude[name] == pytest.approx(per_limit * rates[0], rel=1e-6)
        assert found.frequency[name] == pytest.approx(per_limit * rates[1], rel=1e-5)
    # Euler: amplitude of degree 1, frequency of degree 0 in force and slip limit
    assert found.amplitude["force"] == pytest.approx(found.amplitude_m - limit * rates[0], rel=1e-6)
    assert found.frequency["force"] == pytest.approx(-limit * rates[1], rel=1e-5)
