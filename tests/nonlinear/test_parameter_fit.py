"""Parameters from measured motions: closed form of the peak of a mass with a slider, in one harmonic."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from lumped import oscillator

from nonlinear import ContactParameters, Excitation, SolverOptions, forced_response
from nonlinear.contact.parameters import Array
from nonlinear.peak_curves.measured_motion import Measured, modes_of
from nonlinear.peak_curves.parameter_family import with_parameters
from nonlinear.peak_curves.parameter_fit import Fit, ParameterFit, Ranges, distinct, starting_places
from nonlinear.problem import Problem
from nonlinear.response_curve import ResponseCurve
from rom import modal_model

FRICTION, PRELOAD = 0.5, 2.4
OPTIONS = SolverOptions((0.1, 0.25), harmonics=1, detached=False, stability="folds", truncation=False, search="off")


def closed_peak(limit: float, force: float = 1.0) -> tuple[float, float]:
    """Amplitude and frequency, Hz, of the peak of mass and spring 1 with a slider of stiffness 1."""
    share = limit / force
    amplitude = share**2 / (share - np.pi / 4.0)
    turn = np.arccos(1.0 - 2.0 * share / amplitude)
    stiffness = (turn - 0.5 * np.sin(2.0 * turn)) / np.pi  # of the slider, first harmonic
    return float(force * amplitude), float(np.sqrt(1.0 + stiffness) / (2.0 * np.pi))


def problems(forces: Sequence[float]) -> list[Problem]:
    modal = modal_model(oscillator(), damping_ratio=1e-13)
    contact = ContactParameters.shared(
        1, normal_stiffness=0.0, tangential_stiffness=1.0, friction=FRICTION, preload=PRELOAD
    )
    return [Problem(modal, contact, Excitation(0, force), OPTIONS) for force in forces]


def fit_of(ranges: Ranges, measured: Sequence[Measured], forces: Sequence[float]) -> ParameterFit:
    solved = problems(forces)

    def responses(place: Array) -> list[ResponseCurve]:
        values = ranges.values(place).tolist()
        return [forced_response(*with_parameters(problem, ranges.names, values)) for problem in solved]

    return ParameterFit(ranges, solved, [(item,) for item in measured], responses)


def best(fit: ParameterFit, starts: int = 3) -> list[Fit]:
    places = starting_places(np.full(len(fit.ranges.names), 0.5), starts)
    return distinct([found for place in places if fit.start(place, fit.solver(place)) and (found := fit.fit(place))])


def peaks(limit: float, forces: Sequence[float], scatter: float = 0.05) -> list[Measured]:
    name = problems([1.0])[0].options.output
    return [
        Measured(name, *closed_peak(limit, force), amplitude_deviation=scatter, frequency_deviation=0.002)
        for force in forces
    ]


def one_range() -> Ranges:
    return Ranges(("friction",), np.array([0.35]), np.array([0.9]))


def test_exact_peaks_give_the_friction_back() -> None:
    fit = fit_of(one_range(), peaks(1.3, (1.0, 1.5)), (1.0, 1.5))
    found = best(fit)[0]
    assert fit.ranges.values(found.place)[0] == pytest.approx(1.3 / PRELOAD, rel=1e-5)
    assert found.misfit < 1e-6


def test_derivatives_are_those_of_the_closed_form() -> None:
    fit = fit_of(one_range(), peaks(1.3, (1.0,)), (1.0,))
    found = best(fit, 1)[0]
    value = fit.ranges.values(found.place)[0]
    step, span = 1e-6, 0.55
    above, below = (np.array(closed_peak((value + side * step) * PRELOAD)) for side in (1.0, -1.0))
    rates = [np.log(above[0] / below[0]) / (2.0 * step) / 0.05, (above[1] - below[1]) / (2.0 * step) / 0.002]
    assert found.jacobian[:, 0] == pytest.approx(np.array(rates) * span, rel=1e-3)


def test_intervals_hold_the_truth_as_often_as_they_say() -> None:
    """24 sets with noise: a linear fit around the truth is enough at this scatter."""
    rng, inside, scores = np.random.default_rng(3), 0, []
    for _ in range(24):
        limit = float(rng.uniform(1.0, 2.0))
        exact = peaks(limit, (1.0, 1.2))
        noisy = [
            replace(
                item,
                amplitude=item.amplitude * float(np.exp(0.05 * rng.normal())),
                frequency_hz=item.frequency_hz + 0.002 * float(rng.normal()),
            )
            for item in exact
        ]
        fit = fit_of(one_range(), noisy, (1.0, 1.2))
        start = fit.ranges.place(np.array([limit / PRELOAD]))
        assert fit.start(start, fit.solver(start))
        found = fit.fit(start)
        assert found is not None
        away = abs(found.place[0] - start[0])
        scores.append(found.misfit)
        inside += bool(away <= 1.96 * np.sqrt(found.covariance()[0, 0]))
    assert 20 <= inside <= 24
    assert 2.0 < np.mean(scores) < 4.0  # chi square of three degrees of freedom


def test_friction_and_preload_are_told_together_only() -> None:
    """A slider knows their product: along it the posterior is as wide as the ranges."""
    ranges = Ranges(("friction", "preload"), np.array([0.3, 1.0]), np.array([1.5, 5.0]))
    fit = fit_of(ranges, peaks(1.3, (1.0, 1.5)), (1.0, 1.5))
    found = best(fit)[0]
    assert np.prod(ranges.values(found.place)) == pytest.approx(1.3, rel=1e-4)
    covariance = found.covariance()
    deviations = np.sqrt(np.diag(covariance))
    assert covariance[0, 1] / deviations.prod() < -0.99
    assert deviations.min() > 0.15  # of 0.289 where nothing is told


def test_two_values_with_the_same_amplitude_are_both_found() -> None:
    """The height alone: friction below and above the optimum gives the same."""
    limit = 1.2
    height = closed_peak(limit)[0]
    item = Measured(problems([1.0])[0].options.output, height, 0.18, 0.01, 10.0)
    fit = fit_of(Ranges(("friction",), np.array([0.35]), np.array([1.3])), [item], (1.0,))
    found = best(fit, 6)
    limits = sorted(float(fit.ranges.values(each.place)[0]) * PRELOAD for each in found[:2])
    other = 1.0 / (4.0 / np.pi - 1.0 / limit)  # 1/a + 1/b = 4/pi: of the same height
    assert limits == pytest.approx(sorted((limit, other)), rel=1e-3)
    assert found[1].misfit < 1e-3


def test_points_of_a_curve_give_the_friction_back() -> None:
    (problem,) = problems([1.2])
    truth = 1.3 / PRELOAD
    curve = forced_response(*with_parameters(problem, ("friction",), [truth]))
    chosen = np.flatnonzero(curve.amplitude_m > 0.4 * curve.amplitude_m.max())[::4]
    rows = tuple(
        Measured(problem.options.output, float(curve.amplitude_m[k]), float(curve.frequency_hz[k]), 0.05, 0.1, False)
        for k in chosen
    )
    fit = replace(fit_of(one_range(), peaks(1.3, (1.2,)), (1.2,)), measured=[rows])
    found = best(fit)[0]
    assert fit.ranges.values(found.place)[0] == pytest.approx(truth, rel=1e-4)


def test_peaks_of_several_modes_are_told_apart_by_their_frequencies() -> None:
    rows = [Measured("tip", 1.0, f, 0.1, 1.0) for f in (100.0, 101.0, 250.0)]
    assert modes_of(rows) == [(0, 2), (0, 2), (1, 2)]
    up, down = (Measured("tip", 1.0, f, 0.1, 1.0, rate_hz_per_s=rate) for f, rate in ((100.0, 5.0), (80.0, -5.0)))
    assert modes_of([up, down]) == [(0, 1), (0, 1)]  # one joint that snaps through


@pytest.mark.parametrize(("low", "high"), [(0.1, 10.0), (0.0, 10.0), (1.0, 2.0), (-1.0, 5.0)])
def test_places_and_values(low: float, high: float) -> None:
    ranges = Ranges(("friction",), np.array([low]), np.array([high]))
    for share in (0.0, 0.3, 1.0):
        place = np.array([share])
        assert ranges.place(ranges.values(place)) == pytest.approx(place, abs=1e-12)
        step = 1e-6
        slope = (ranges.values(place + step) - ranges.values(place - step)) / (2.0 * step)
        assert ranges.slopes(place) == pytest.approx(slope, rel=1e-6)
