"""Wear over a life: closed forms of one node, small explicit steps, scaling, and what ends it."""

from dataclasses import replace

import numpy as np
import pytest
from lumped import lumped_blade, oscillator

from nonlinear import (
    ContactError,
    ContactParameters,
    Excitation,
    OperatingPoint,
    OptionsError,
    SolverOptions,
    forced_response,
    wear_history,
)
from nonlinear.contact_states import nodal_contact
from rom import modal_model

QUICK = {"detached": False, "stability": "folds", "truncation": False, "search": "off"}
ALPHA, AREA = 1e-3, 2.0


def slider(interference: float = 3.0, force: float = 1.0) -> OperatingPoint:
    """The peak of a mass on a spring with a slider to ground, all ones, under the constant load kn v0."""
    modal = modal_model(oscillator(), damping_ratio=1e-13)
    contact = ContactParameters.shared(
        1, normal_stiffness=1.0, tangential_stiffness=1.0, friction=1.0, interference=interference
    )
    return OperatingPoint((modal, contact, Excitation(0, force), SolverOptions((0.1, 0.25), **QUICK)))


def imposed(interference: float, amplitude: float, frequency_hz: float = 0.5) -> OperatingPoint:
    """A heavy mass far above its resonance, whose motion the contact does not change: kt = 3, kn = 2, mu = 0.5."""
    mass, omega = 1e9, 2.0 * np.pi * frequency_hz
    modal = modal_model(oscillator(mass=mass), damping_ratio=1e-13)
    contact = ContactParameters.shared(
        1, normal_stiffness=2.0, tangential_stiffness=3.0, friction=0.5, interference=interference
    )
    force = Excitation(0, amplitude * (mass * omega**2 - 1.0))
    return OperatingPoint((modal, contact, force, SolverOptions((0.4, 0.6), **QUICK)), frequency_hz=frequency_hz)


def blade(interference: float = 1.0, force: float = 1.0) -> OperatingPoint:
    """A small blade with two nodes that slip, open and redistribute their load."""
    modal = modal_model(lumped_blade(), damping_ratio=0.02)
    contact = ContactParameters.shared(
        2, normal_stiffness=4.0, tangential_stiffness=3.0, friction=0.4, interference=interference
    )
    return OperatingPoint((modal, contact, Excitation(4, force), SolverOptions((0.1, 0.5), **QUICK)))


def logistic(cycles: np.ndarray, amplitude: float, first: float) -> np.ndarray:
    """mu kn v0 of `imposed` after some cycles: dL/dn = -beta L (X - L / kt), beta = 4 alpha mu kn / A."""
    stuck, beta = 3.0 * amplitude, 4.0 * ALPHA * 0.5 * 2.0 / AREA
    return stuck / (1.0 + (stuck / first - 1.0) * np.exp(beta * amplitude * cycles))


def test_one_node_under_an_imposed_motion_is_logistic() -> None:
    history = wear_history([imposed(2.9, 1.0)], ALPHA, AREA, cycles=3000.0, tolerance=1e-6)
    expected = logistic(history.cycles, 1.0, 2.9)
    np.testing.assert_allclose(history.interference_m[:, 0], expected, rtol=1e-4)
    assert history.cycles[-1] == 3000.0
    assert history.complete
    np.testing.assert_allclose(history.time_s, history.cycles / 0.5, rtol=1e-12)
    assert history.error_m < 1e-3
    assert np.abs(history.interference_m[-1, 0] - expected[-1]) < history.error_m


def test_order_of_the_steps() -> None:
    """Halving fixed steps divides the error by eight: the pair advances with its third order."""
    errors = []
    for steps in (8, 16, 32):
        history = wear_history([imposed(2.0, 1.0)], ALPHA, AREA, cycles=1200.0, tolerance=0.99, steps=steps)
        assert len(history.cycles) >= steps
        even = np.isclose(np.diff(history.cycles), 1200.0 / steps).sum()
        assert even >= steps - 3  # but the first ones, which are shorter
        errors.append(abs(history.interference_m[-1, 0] - logistic(np.array(1200.0), 1.0, 2.0)))
    assert errors[0] / errors[1] > 5.0
    assert errors[1] / errors[2] > 5.0


def test_followed_peak_in_closed_form() -> None:
    """At the peak the excitation works pi P X = E, X = L^2 / (L - pi/4): ln L + pi / (4 L) falls linearly."""
    limit = 4.5  # of the amplitude: reached at the far side of the optimum, which is X = pi at L = pi/2
    history = wear_history(
        [slider()], ALPHA, AREA, cycles=372.0, tolerance=1e-5, limits={"amplitude": limit, "depth": 1.0}
    )
    load, rate = history.interference_m[:, 0], np.pi * ALPHA / AREA

    def clock(load):
        return (np.log(3.0) + np.pi / 12.0 - np.log(load) - np.pi / (4.0 * load)) / rate

    np.testing.assert_allclose(history.cycles, clock(load), rtol=1e-4, atol=1e-3)
    np.testing.assert_allclose(history.highest_m, load**2 / (load - np.pi / 4.0), rtol=1e-8)
    events = {(event.kind, event.said[:5]): event.cycles for event in history.events}
    lowest = next(cycles for (kind, _), cycles in events.items() if kind == "lowest amplitude")
    assert lowest == pytest.approx(clock(np.pi / 2.0), rel=5e-3)
    roots = limit / 2.0 * (1.0 - np.sqrt(1.0 - np.pi / limit))
    assert events["limit", "ampli"] == pytest.approx(clock(roots), rel=1e-5)
    assert events["limit", "depth"] == pytest.approx(clock(2.0), rel=1e-5)


def test_volume_time_and_force_scale() -> None:
    """Volume is alpha times work; twice alpha is half the time; force and interference scale together."""
    settings = {"tolerance": 1e-4, "steps": 8}
    one = wear_history([blade()], ALPHA, AREA, seconds=4e3, **settings)
    np.testing.assert_allclose(one.volume_m3, ALPHA * one.work_j, rtol=1e-12)
    np.testing.assert_allclose(one.depth_m, one.volume_m3 / AREA, rtol=1e-12)
    power = np.trapezoid(one.power_w, one.time_s)
    assert one.work_j[-1].sum() == pytest.approx(power, rel=5e-3)
    twice = wear_history([blade()], 2.0 * ALPHA, AREA, seconds=2e3, **settings)
    np.testing.assert_allclose(twice.depth_m[-1], one.depth_m[-1], rtol=1e-7)
    larger = wear_history([blade(2.0, 2.0)], ALPHA, AREA, seconds=2e3, **settings)
    np.testing.assert_allclose(larger.depth_m[-1], 2.0 * one.depth_m[-1], rtol=1e-6)
    np.testing.assert_allclose(larger.amplitude_m[-1], 2.0 * one.amplitude_m[-1], rtol=1e-6)


def test_without_wear_nothing_changes() -> None:
    history = wear_history([blade()], 0.0, AREA, seconds=1e3, steps=4)
    assert not history.depth_m.any()
    assert history.events == ()
    assert np.ptp(history.amplitude_m) == 0.0
    assert np.ptp(history.power_w) == 0.0
    assert history.work_j[-1].sum() == pytest.approx(1e3 * history.power_w[0], rel=1e-12)


def test_small_explicit_steps() -> None:
    """The response traced anew at each evaluation of midpoint steps, with nothing followed."""
    point, life, steps = blade(), 6e3, 10
    narrow = replace(point.problem.options, frequency_hz=(0.26, 0.45))
    point = replace(point, problem=point.problem._replace(options=narrow))
    history = wear_history([point], ALPHA, AREA, seconds=life, tolerance=1e-4)

    def rate(depth):
        contact = point.problem.contact
        worn = point.problem._replace(contact=contact.with_interference(contact.interference - depth))
        curve = forced_response(*worn)
        done = nodal_contact(worn, curve, curve.peak.index).dissipated_j
        return ALPHA / AREA * done * curve.peak.frequency_hz, curve.peak.amplitude_m

    depth = np.zeros(2)
    for _ in range(steps):
        half = depth + 0.5 * life / steps * rate(depth)[0]
        depth = depth + life / steps * rate(half)[0]
    np.testing.assert_allclose(history.depth_m[-1], depth, rtol=2e-3)
    assert history.highest_m[-1] == pytest.approx(rate(depth)[1], rel=2e-3)
    again = replace(point.problem.contact, interference=history.interference_at(0.5 * life))
    rest = wear_history(
        [replace(point, problem=point.problem._replace(contact=again), curve=None)], ALPHA, AREA, seconds=0.5 * life
    )
    np.testing.assert_allclose(rest.interference_m[-1], history.interference_m[-1], rtol=5e-3, atol=2e-3)


def test_separation_is_the_free_blade() -> None:
    """The peak of a worn blade rises to that of the free one; the nodes lose contact one after the other."""
    point = blade()
    history = wear_history([point], ALPHA, AREA, seconds=1e6)
    free = forced_response(*point.problem._replace(contact=point.problem.contact.with_interference(-1e3)))
    assert history.highest_m[-1] == pytest.approx(free.peak.amplitude_m, rel=1e-3)
    kinds = [event.kind for event in history.events]
    assert kinds == ["lowest amplitude", "node separates", "node separates", "separation"]
    lost = [event.time_s for event in history.events[1:3]]
    assert lost[0] < lost[1] == history.events[3].time_s < 1e6


def test_jump_at_a_fold() -> None:
    """At a given frequency the high motion ends in a fold; the response jumps down, where nothing touches."""
    point = replace(blade(), frequency_hz=0.42)
    history = wear_history([point], ALPHA, AREA, seconds=5e4)
    jump = next(event for event in history.events if event.kind == "jump")
    before, after = (history.highest_m[history.time_s <= jump.time_s][-1], history.highest_m[-1])
    assert before > 4.0 * after
    assert history.complete
    worn = [
        point.problem._replace(contact=point.problem.contact.with_interference(history.interference_at(time)))
        for time in (jump.time_s * 0.998, jump.time_s * 1.002)
    ]
    solutions = [np.count_nonzero(np.diff(np.sign(forced_response(*each).frequency_hz - 0.42))) for each in worn]
    assert solutions[0] == 3
    assert solutions[1] == 1


def test_a_higher_peak_is_followed_from_where_it_is_higher() -> None:
    """A life that begins at the lower of two peaks goes back to its first step and follows the higher one."""
    point = blade()
    wide = point.problem._replace(options=replace(point.problem.options, frequency_hz=(0.3, 0.7)))
    curve = forced_response(*wide)
    low, high = sorted(curve.peaks, key=lambda peak: peak.amplitude_m)
    known = replace(curve, peaks=(low,), peak=low, worst=None)
    history = wear_history([replace(point, problem=wide, curve=known)], ALPHA, AREA, seconds=2e3, steps=20, checks=4)
    assert [event.kind for event in history.events] == ["higher peak"]
    assert history.events[0].time_s == history.time_s[1] == history.time_s[2]
    assert history.highest_m[0] == pytest.approx(low.amplitude_m, rel=1e-9)
    assert history.highest_m[2] == pytest.approx(high.amplitude_m, rel=0.02)
    begun = wear_history([replace(point, problem=wide, curve=curve)], ALPHA, AREA, seconds=2e3, steps=20, checks=0)
    np.testing.assert_allclose(history.depth_m[-1], begun.depth_m[-1], rtol=0.03)


def test_duty_of_equal_points_is_one_point() -> None:
    point = replace(slider(), curve=forced_response(*slider().problem))
    parts = [replace(point, share=share) for share in (1.0, 3.0)]
    one, two = (wear_history(each, ALPHA, AREA, cycles=100.0, steps=4) for each in (parts[:1], parts))
    np.testing.assert_allclose(two.depth_m[-1], one.depth_m[-1], rtol=1e-9)
    idle = [*parts, replace(point, share=0.0)]
    np.testing.assert_allclose(
        wear_history(idle, ALPHA, AREA, cycles=100.0, steps=4).depth_m, two.depth_m, rtol=1e-12
    )


def test_a_limit_that_is_exceeded_from_the_start() -> None:
    history = wear_history([slider()], ALPHA, AREA, cycles=1.0, steps=2, limits={"amplitude": 4.0})
    assert [(event.kind, event.cycles) for event in history.events] == [("limit", 0.0)]


def test_bad_input() -> None:
    for arguments, words in [
        (([slider()], -1.0, AREA), "coefficient: -1.0, allowed"),
        (([slider()], ALPHA, 0.0), "area: 0.0, allowed"),
        (([replace(slider(), share=0.0)], ALPHA, AREA), "the duty sums to 0, allowed"),
        (([], ALPHA, AREA), "points: none, allowed"),
    ]:
        with pytest.raises(OptionsError, match=words):
            wear_history(*arguments, cycles=1.0)
    with pytest.raises(OptionsError, match="one of the two"):
        wear_history([slider()], ALPHA, AREA)
    with pytest.raises(ContactError, match="the same at all"):
        wear_history([slider(), slider(2.0)], ALPHA, AREA, cycles=1.0)


def test_a_life_ends_where_its_peak_leaves_the_range() -> None:
    """And is until there that of a wider range; another peak, which the range still holds, is not its result."""
    wide = wear_history([blade()], ALPHA, AREA, seconds=1e6)
    options = replace(blade().problem.options, frequency_hz=(0.3, 0.5))
    history = wear_history(
        [replace(blade(), problem=blade().problem._replace(options=options))], ALPHA, AREA, seconds=1e6
    )
    assert not history.complete
    assert history.frequency_hz[-1, 0] == pytest.approx(0.3, rel=2e-3)
    assert history.highest_m == pytest.approx(np.interp(history.time_s, wide.time_s, wide.highest_m), rel=0.02)
    assert (history.events[-1].kind, "leaves the frequency range" in history.events[-1].said) == ("lost", True)
