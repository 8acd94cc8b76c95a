"""The optimum: kinds of minimum, what is refused, performance curve, several parameters."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from lumped import lumped_blade, oscillator
from test_peak_curves import QUICK, closed_form, slider

from nonlinear import (
    ContactError,
    ContactParameters,
    Excitation,
    OptionsError,
    SolverOptions,
    TerminationReason,
    find_joint_optimum,
    find_optimum,
    forced_response,
    performance_curve,
)
from nonlinear.peak_curves.joint_optimum import CarriedPeak, multipliers
from nonlinear.peak_curves.parameter_family import ParameterFamily
from nonlinear.peak_curves.peak_branch import PeakPiece
from nonlinear.peak_curves.peak_curve import PeakPoint
from nonlinear.peak_curves.peak_search import PeakSearch
from nonlinear.peak_curves.worst_envelope import MARGIN, EnvelopeOfPeaks, lowest_of
from nonlinear.problem import Problem
from rom import modal_model


@dataclass(frozen=True)
class Made:
    """Peaks with given amplitudes over the share, in place of solved ones."""

    amplitude: object
    rate: object

    def point(self, share: float, persists: bool = True) -> PeakPoint:
        point = PeakPoint(share, None, self.amplitude(share), self.rate(share), (-1.0, 0.0), (0.0, 1.0))
        return replace(point, persists=persists)

    def piece(self, low: float, high: float, unstable=(2.0, 3.0)) -> PeakPiece:
        edges = [edge + side for edge in unstable for side in (-1e-7, 1e-7) if low < edge < high]
        shares = sorted([*np.linspace(low, high, 9), *edges])
        return PeakPiece(tuple(self.point(s, not unstable[0] < s < unstable[1]) for s in shares), "made")


class Follower:
    """Solves for made peaks: the one whose amplitude is nearest."""

    def __init__(self, *made: Made) -> None:
        self.made = made

    def moved(self, peak: PeakPoint, share: float) -> PeakPoint:
        nearest = min(self.made, key=lambda each: abs(each.amplitude(peak.share) - peak.amplitude))
        return nearest.point(share)


FALLING = Made(lambda s: 1.0 - 0.5 * s, lambda s: -0.5)
RISING = Made(lambda s: 0.2 + s, lambda s: 1.0)
ISOLA = Made(lambda s: 3.0, lambda s: 0.0)
BOWL = Made(lambda s: 1.0 + (s - 0.3) ** 2, lambda s: 2.0 * (s - 0.3))
LEVEL = Made(lambda s: 1.0 + max(0.0, 0.5 - s) ** 2, lambda s: -2.0 * max(0.0, 0.5 - s))


@pytest.mark.parametrize(
    ("pieces", "kind", "share", "height", "rates"),
    [
        ([BOWL.piece(0.0, 1.0)], "smooth", 0.3, 1.0, (0.0, 0.0)),
        ([FALLING.piece(0.0, 1.0), RISING.piece(0.0, 1.0)], "kink", 0.8 / 1.5, 1.1 / 1.5, (-0.5, 1.0)),
        ([FALLING.piece(0.0, 1.0), ISOLA.piece(0.6, 1.0)], "jump", 0.6 - MARGIN, 0.7 + 0.5 * MARGIN, (-0.5, np.inf)),
        ([FALLING.piece(0.0, 1.0)], "edge", 1.0, 0.5, (-0.5, np.nan)),
        ([ISOLA.piece(0.0, 1.0)], "flat", None, 3.0, (0.0, 0.0)),
        ([LEVEL.piece(0.0, 1.0)], "plateau", 0.75, 1.0, (0.0, 0.0)),
        # beyond 0.5 the peak is unstable and nothing else is known: it does not count
        ([FALLING.piece(0.0, 1.0, (0.5, 2.0))], "edge", 0.5, 0.75, (-0.5, np.nan)),
    ],
)
def test_kinds_of_minimum(pieces, kind, share, height, rates) -> None:
    envelope = EnvelopeOfPeaks(pieces, [])
    found = lowest_of(envelope, Follower(BOWL, FALLING, RISING, ISOLA, LEVEL))
    if kind == "edge" and share == 0.5:  # the end of what is known
        assert found.share <= 0.5
        assert found.height == pytest.approx(0.75, abs=1e-3)
        return
    assert found.kind == kind
    assert found.height == pytest.approx(height, abs=1e-9)
    assert share is None or found.share == pytest.approx(share, abs=0.01 if kind == "plateau" else 1e-8)
    assert found.rates == pytest.approx(rates, abs=1e-6, nan_ok=True) or kind == "flat"


def test_a_parameter_without_effect_and_an_optimum_at_the_end_are_told() -> None:
    problem = slider()
    flat = find_optimum(problem, "damping", 0.5, 2.0)  # of 1e-13 times critical damping
    assert flat.kind == "flat"
    assert "changes by less than 0.1 %" in flat.message
    edge = find_optimum(problem, "preload", 1.7, 3.0)
    assert edge.kind == "edge"
    assert edge.value == 1.7
    assert edge.message.startswith("preload = 1.7: lowest at an end of a range, ")


def test_bad_ranges_are_refused_in_one_line() -> None:
    problem = slider()
    with pytest.raises(OptionsError, match="allowed: normal_stiffness, "):
        find_optimum(problem, "angle", 0.0, 1.0)
    with pytest.raises(OptionsError, match=r"range of preload: \[3, 1\], allowed: low < high"):
        find_optimum(problem, "preload", 3.0, 1.0)
    with pytest.raises(OptionsError, match=r"force: 0, allowed: above 0"):
        find_optimum(problem, "force", 0.0, 1.0)
    with pytest.raises(ContactError, match=r"friction: -0\.1"):
        find_optimum(problem, "friction", -0.1, 1.0)
    with pytest.raises(OptionsError, match="parameters: preload, allowed: two or three"):
        find_joint_optimum(problem, {"preload": (1.0, 2.0)})
    modal, contact, excitation, options = problem
    loaded = replace(modal, static_force=np.ones_like(modal.static_force))
    with pytest.raises(OptionsError, match=r"static load .* does not scale with preload"):
        performance_curve((loaded, contact, excitation, options), "preload", 1.0, 2.0)
    with pytest.raises(OptionsError, match=r"preload: 1\.2, allowed for a performance curve over interference: 0"):
        performance_curve(problem, "interference", 1.0, 2.0)


def test_responses_without_a_start_are_told_in_one_line() -> None:
    """The solver finds no start anywhere."""

    def empty(problems):
        none = np.zeros(0)
        reason = TerminationReason("start failed", 0.1, "no start at 0.1 Hz: singular")
        gone = {"frequency_hz": none, "amplitude_m": none, "peaks": (), "worst": None, "termination": reason}
        return [replace(forced_response(*problem), **gone) for problem in problems]

    with pytest.raises(ArithmeticError, match=r"no peak to follow over preload from 1 to 3: no start at 0\.1 Hz"):
        find_optimum(slider(), "preload", 1.0, 3.0, solver=empty)
    with pytest.raises(ArithmeticError, match=r"no motion that persists is known over preload, friction: no start"):
        find_joint_optimum(slider(), {"preload": (1.0, 3.0), "friction": (0.5, 1.0)}, solver=empty)


def test_one_performance_curve_serves_every_force() -> None:
    """X / P = r^2 / (r - pi/4) over r = N0 / P, from two forces; and responses at a third one."""
    modal, contact, excitation, options = slider()
    curves = [
        performance_curve((modal, contact, replace(excitation, force=force), options), "preload", force, 3.0 * force)
        for force in (0.3, 7.0)
    ]
    for curve in curves:
        assert curve.best_ratio == pytest.approx(np.pi / 2.0, rel=1e-8)
        assert curve.least_compliance == pytest.approx(np.pi, rel=1e-9)
        (followed,) = curve.curves
        np.testing.assert_allclose(followed.amplitude_m, closed_form(followed.value), rtol=1e-9)
    np.testing.assert_allclose(curves[0].ratio[::50], curves[1].ratio[::50], rtol=1e-9)
    np.testing.assert_allclose(curves[0].compliance, curves[1].compliance, rtol=1e-9)
    force, limit = 2.5, 1.4
    other = replace(contact, preload=contact.preload * (force * limit / contact.preload.mean()))
    peak = forced_response(modal, other, replace(excitation, force=force), options).peak
    assert curves[0].amplitude_m(force, force * limit) == pytest.approx(peak.amplitude_m, rel=1e-4)
    assert curves[0].best_value(force) == pytest.approx(force * np.pi / 2.0, rel=1e-8)


def test_performance_curve_over_the_interference() -> None:
    """A mass that opens and closes: the peak at another force and the same v0 / F."""
    modal = modal_model(oscillator(tangential=False), damping_ratio=0.02)
    options = SolverOptions((0.1, 0.4), detached=False, stability="folds", truncation=False, search="off")

    def problem(force: float, interference: float):
        contact = ContactParameters.shared(
            1, normal_stiffness=1.0, tangential_stiffness=0.0, friction=0.0, interference=interference
        )
        return modal, contact, Excitation(0, force), options

    curve = performance_curve(problem(0.1, 0.0), "interference", -0.05, 0.1)
    for ratio in (-0.3, 0.4):
        peak = forced_response(*problem(20.0, 20.0 * ratio)).peak
        assert curve.amplitude_m(20.0, 20.0 * ratio) == pytest.approx(peak.amplitude_m, rel=1e-3)


def test_joint_optimum_in_closed_form() -> None:
    """X = (P / kt) r^2 / (r - pi/4): the stiffest slider, and the same limit for every stiffness."""
    ranges = {"tangential_stiffness": (0.5, 2.0), "preload": (1.0, 3.0)}
    found = find_joint_optimum(slider(), ranges)
    assert found.at_end == {"tangential_stiffness": "high", "preload": ""}
    assert found.values["preload"] == pytest.approx(np.pi / 2.0, rel=1e-6)
    assert found.amplitude_m == pytest.approx(np.pi / 2.0, rel=1e-9)
    assert found.elasticities["tangential_stiffness"] == pytest.approx(-1.0, rel=1e-7)
    assert min(height for _, height in found.path) >= found.amplitude_m * (1.0 - 1e-9)
    assert [peak.multiplier for peak in found.peaks] == [1.0]


def test_gradient_of_a_carried_peak_against_differences() -> None:
    """Stiffness, preload and damping, away from the place where the peak was found."""
    _, contact, excitation, options = slider()
    problem = modal_model(oscillator(), damping_ratio=0.02), contact, excitation, options
    names = "tangential_stiffness", "preload", "damping"
    box = ParameterFamily(Problem(*problem), names, (0.5, 1.0, 0.5), (2.0, 3.0, 3.0))
    found = PeakSearch(ParameterFamily.over(box.at(np.full(3, 0.3)), "force", 0.9, 1.1), lambda line: None)
    found.solve([0.5], "first")
    start = found.follower.moved(found.pieces[0].nearest(0.5), 0.5)
    peak = CarriedPeak(box, "main branch", [(np.full(3, 0.3), start)])
    place = np.array([0.5, 0.4, 0.7])
    gradient, step = peak.gradient(place), 1e-4
    for k, unit in enumerate(np.eye(3)):
        above, below = (peak.amplitude(place + side * step * unit) for side in (1.0, -1.0))
        assert gradient[k] == pytest.approx((above - below) / (2.0 * step), rel=1e-5), names[k]


def test_multipliers_of_an_exchange() -> None:
    """0.25 (3, 1) + 0.75 (-1, -1/3) = 0; at an end of the second range only the first part has to vanish."""
    inside = np.array([False, False])
    gradients = np.array([[3.0, 1.0], [-1.0, -1.0 / 3.0]])
    np.testing.assert_allclose(multipliers(gradients, inside, inside), [0.25, 0.75], atol=1e-6)
    gradients = np.array([[3.0, 5.0], [-1.0, 7.0]])
    low_end = np.array([False, True])
    np.testing.assert_allclose(multipliers(gradients, low_end, inside), [0.25, 0.75], atol=1e-6)


def test_the_first_harmonic_as_objective_against_responses_over_the_interference() -> None:
    """Contacts that press: the displacement has a mean and a second harmonic too. The parabola through the first
    harmonics of single responses has its minimum where the search finds it; that of the displacement is another."""
    modal = modal_model(lumped_blade(n_contacts=1), damping_ratio=0.02)
    contact = ContactParameters.shared(1, normal_stiffness=4.0, tangential_stiffness=3.0, friction=0.4)
    wave, options = Excitation(4, 1.0), SolverOptions((0.34, 0.36), harmonics=2, **QUICK)
    problem = modal, contact, wave, replace(options, objective="harmonic_1")
    found = find_optimum(problem, "interference", 0.55, 0.6, most_responses=12)
    assert found.objective == "harmonic_1"
    assert "harmonic 1 of" in found.message
    values = found.value + 0.004 * np.arange(-2.0, 3.0)
    curves = [forced_response(modal, contact.with_interference(value), wave, options) for value in values]
    heights = [top_of(curve.frequency_hz, curve.harmonic_m[:, 0]) for curve in curves]
    fit = np.polynomial.Polynomial.fit(values, heights, 4)
    assert float(fit(found.value)) == pytest.approx(found.amplitude_m, rel=2e-5)
    lowest = min((z.real for z in fit.deriv().roots() if abs(z.imag) < 1e-9), key=lambda z: abs(z - found.value))
    assert lowest == pytest.approx(found.value, abs=3e-4)
    displacement = np.polynomial.Polynomial.fit(values, [curve.peak.amplitude_m for curve in curves], 4)
    assert abs(displacement.deriv()(found.value)) > 10.0 * abs(fit.deriv()(found.value))
    assert found.amplitude_m < 0.995 * curves[2].peak.amplitude_m
    ahead = forced_response(modal, contact.with_interference(found.value), replace(wave, force=1.001), options)
    rise = (top_of(ahead.frequency_hz, ahead.harmonic_m[:, 0]) - heights[2]) / 0.001
    assert rise == pytest.approx(found.derivatives["force"], rel=2e-2)


def top_of(x, y) -> float:
    """Highest value of the parabola through the highest point and its neighbours."""
    k = int(np.argmax(y))
    a, b, c = np.polyfit(x[k - 1 : k + 2] - x[k], y[k - 1 : k + 2], 2)
    return float(c - b**2 / (4.0 * a))


def test_the_end_of_the_range_is_no_optimum() -> None:
    """With more preload the peak of the slider leaves the range, and the end of the range lies ever lower."""
    modal, contact, wave, options = slider()
    options = replace(options, frequency_hz=(0.1, 0.18))
    ends = forced_response(modal, replace(contact, preload=np.array([6.0])), wave, options)
    found = find_optimum((modal, contact, wave, options), "preload", 0.9, 6.0, most_responses=12)
    assert ends.worst.at_end
    assert ends.worst.amplitude_m < found.amplitude_m
    assert not found.worst.at_end
    assert found.frequency_hz < 0.18
    assert found.amplitude_m == pytest.approx(closed_form(np.array(found.value)), rel=1e-6)
    assert any("end of the frequency range" in said and "no candidates" in said for said in found.remarks)
    with pytest.raises(ArithmeticError, match="end of the frequency range, which is no peak"):
        find_optimum((modal, contact, wave, options), "preload", 5.0, 6.0, most_responses=12)
