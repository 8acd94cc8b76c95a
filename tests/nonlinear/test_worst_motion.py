"""The worst motion: the highest stable solution on any branch, or what the ring reaches where none is that high."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest

from nonlinear import OptionsError, Peak, ResponseCurve, SolverOptions, TerminationReason
from nonlinear.time_integration.ring_motion import RingMotion
from nonlinear.worst_motion.candidates import branches_of, coexistences, stable_amplitudes, unstable_stretches
from nonlinear.worst_motion.departure_search import MOST_FURTHER
from nonlinear.worst_motion.ring_integration import Integrated
from nonlinear.worst_motion.ring_starts import Start
from nonlinear.worst_motion.stepped_sweep import Sweep
from nonlinear.worst_motion.worst_motion import EQUAL_COST, MOST_STRETCHES, affordable, worst_of

OPTIONS = SolverOptions((1.0, 9.0), harmonics=3)


def curve_of(frequency, amplitude, stable, *detached, complete=True):
    """A curve of these points; `detached`: curves of the same kind."""
    size = len(frequency)
    none = np.zeros(size)
    whole = np.zeros(size, dtype=int)
    amplitude = np.asarray(amplitude, dtype=float)
    top = int(np.argmax(amplitude)) if size else 0
    return ResponseCurve(
        termination=TerminationReason("complete" if complete else "step too small", 9.0, "end"),
        frequency_hz=np.asarray(frequency, dtype=float),
        amplitude_m=amplitude,
        harmonic_m=np.zeros((size, 3)),
        static_m=none,
        phase_rad=none,
        stable=np.asarray(stable, dtype=bool),
        growth_rate=np.where(stable, -1.0, 1.0),
        growth_nodal_diameter=whole,
        sticking=whole,
        slipping=whole,
        separating=whole,
        dissipated_j=none,
        iterations=whole,
        kept_harmonics=whole + 3,
        arc=none,
        energy_error=none,
        output=np.zeros((size, 4), dtype=complex),
        relative_displacement=np.zeros((size, 4, 1, 3), dtype=complex),
        contact_force=np.zeros((size, 4, 1, 3), dtype=complex),
        peak=Peak(float(frequency[top]), float(amplitude[top]), top) if size else None,
        peaks=(),
        bifurcations=(),
        seconds=0.0,
        harmonics=3,
        truncation_error=0.01,
        detached=tuple(detached),
    )


def ring_to(amplitude, **changes):
    """Time integration that always leads to this motion, and the list of its starting points."""
    starts = []
    motion = RingMotion(
        stays=False,
        growth_rate=1.0,
        amplitude_m=amplitude,
        lowest_m=0.8 * amplitude,
        periodic=False,
        repeats_after=0,
        started_m=amplitude,
        settled=True,
        n_blades=4,
        nodal_diameter=18,
        periods=300,
        envelope_m=np.full((300, 4), amplitude),
        final=None,
        persistence=300,
    )

    def integrate(place, blade_periods, floor):
        starts.append(place)
        return Integrated(replace(motion, **changes))

    return integrate, starts


def never(place, blade_periods, floor):
    raise AssertionError("time integration without need")


SEVEN = [2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0]
HILL = [1.0, 2.0, 3.0, 9.0, 4.0, 2.0, 1.0]


def test_where_all_is_stable_it_is_the_peak():
    worst = worst_of(curve_of(SEVEN, HILL, [True] * 7), OPTIONS, 72, never)
    assert (worst.amplitude_m, worst.frequency_hz, worst.branch, worst.index) == (9.0, 5.0, 0, 3)
    assert (worst.motion, worst.scatter, worst.unresolved) == ("periodic", 0.0, "")
    for said in ("no detached branch found", "nodal diameters 0 to 36", "harmonics 0 to 3", "not searched: mistuned"):
        assert said in worst.searched


def test_a_stable_detached_branch_above_the_main_one():
    low = curve_of([4.0, 5.0], [11.0, 12.0], [True, True])
    high = curve_of([6.0, 7.0], [60.0, 50.0], [True, True])
    worst = worst_of(curve_of(SEVEN, HILL, [True] * 7, low, high), OPTIONS, 72, never)
    assert (worst.amplitude_m, worst.frequency_hz, worst.branch, worst.index) == (60.0, 6.0, 2, 0)


@pytest.mark.parametrize("height", [12.0, 6.0, 3.0])
def test_an_unstable_top_is_integrated_in_time(height):
    """A quasi-periodic motion counts where it is higher than what is stable: 4 here."""
    integrate, starts = ring_to(height)
    curve = curve_of(SEVEN, HILL, [True, True, True, False, True, True, True])
    worst = worst_of(curve, OPTIONS, 72, integrate)
    assert starts == [(0, 3)]
    assert "time integration from 1 unstable solution (ring of 4 blades)" in worst.searched
    if height > 4.0:
        assert (worst.amplitude_m, worst.frequency_hz, worst.branch, worst.index) == (height, 5.0, 0, 3)
        assert (worst.motion, worst.nodal_diameter, worst.ring_blades) == ("quasi-periodic", 18, 4)
        assert worst.scatter == pytest.approx(0.2)
    else:
        assert (worst.amplitude_m, worst.index, worst.motion) == (4.0, 4, "periodic")


def test_an_irregular_motion_that_persists_counts():
    """45.0 um seen for 1500 periods stood at zero, as no two of its windows agreed."""
    curve = curve_of(SEVEN, HILL, [True, True, True, False, True, True, True])
    envelope = np.full((1920, 4), 10.0)
    envelope[::100, 3] = 14.9, *[15.0] * 19
    integrate, _ = ring_to(15.0, settled=False, persistence=1920, envelope_m=envelope)
    worst = worst_of(curve, OPTIONS, 72, integrate)
    assert (worst.amplitude_m, worst.motion, worst.periods) == (15.0, "irregular", 1920)
    assert worst.recurrence == pytest.approx(20 / 1.92)
    assert worst.scatter == pytest.approx(0.2)
    assert worst.unresolved == ""
    short, _ = ring_to(15.0, settled=False, persistence=480)
    worst = worst_of(curve, OPTIONS, 72, short)
    assert (worst.amplitude_m, worst.recurrence) == (15.0, 1000.0)
    assert worst.unresolved.startswith("the irregular motion was followed for 480 periods only: a larger")


@pytest.mark.parametrize("top", [None, 8.0])
def test_what_was_seen_higher_and_does_not_persist_is_said(top):
    """A motion of 30 in time that ends low, or in another one, higher than all that is stable."""
    curve = curve_of(SEVEN, HILL, [True, True, True, False, True, True, True])
    integrate, _ = ring_to(28.0, settled=False, persistence=80)

    def follow(frequency_hz, motion, blade_periods, height_m):
        found = top and replace(motion, amplitude_m=top, settled=True, envelope_m=np.full((300, 4), top))
        places, heights = np.array([4.9, 5.0]), np.array([20.0, 28.0])
        return Sweep(places, heights, 5.0, found, 5_000, True, seen_m=30.0)

    worst = worst_of(curve, OPTIONS, 72, integrate, follow=follow)
    assert worst.amplitude_m == (top or 4.0)
    assert worst.unresolved == "motions up to 30 m at 5 Hz were not seen to persist"


@pytest.mark.parametrize("complete", [True, False])
def test_a_motion_is_followed_in_frequency(complete):
    """Its highest point counts, its range is kept; a motion on the one that was followed is not followed again."""
    curve = curve_of(SEVEN, [1.0, 6.0, 7.0, 8.0, 9.0, 2.0, 1.0], [True, False, False, False, False, True, True])
    integrate, starts = ring_to(9.5)
    followed = []

    def follow(frequency_hz, motion, blade_periods, height_m):
        followed.append((frequency_hz, blade_periods))
        top = replace(motion, amplitude_m=21.0, persistence=320)
        places = np.array([2.5, 6.0, 7.5])
        return Sweep(places, np.array([9.0, 9.6, 21.0]), 7.5, top, 5_000, complete)

    worst = worst_of(curve, OPTIONS, 72, integrate, follow=follow)
    assert len(starts) > 1
    assert len(followed) == 1
    assert followed[0][0] == 6.0
    assert (worst.amplitude_m, worst.frequency_hz, worst.periods) == (21.0, 7.5, 320)
    assert (worst.followed_hz, worst.followed_m) == ((2.5, 6.0, 7.5), (9.0, 9.6, 21.0))
    assert "1 motion followed in frequency" in worst.searched
    only = "" if complete else "the motion at 7.5 Hz, up to 21 m, was followed from 2.5 to 7.5 Hz only"
    assert worst.unresolved == only


@pytest.mark.parametrize("height", [1.0, 12.0])
def test_mixed_starts_go_where_blades_keep_the_high_solution(height):
    """Where they leave it a quarter of the way, nearer to the end where it is lower, otherwise to the middle."""
    frequency = [3.0, 5.0, 7.0, 7.0, 5.0, 3.0, 2.0]
    curve = curve_of(frequency, [2.0, 6.0, 10.0, 5.0, 2.0, 0.5, 0.5], [False] * 3 + [True] * 4)
    ring, _ = ring_to(height)
    starts = []

    class Mix:
        starts = tuple(Start(9, (1,) * number + (0,) * (8 - number), again=True) for number in (7, 1))
        random_starts, swept_starts = (), ()
        in_flow = slides = False

        def __call__(self, frequency_hz, start, blade_periods, floor):
            starts.append((frequency_hz, sum(start.shares), blade_periods))
            return ring(None, 0, 0.0) if blade_periods > 48_000 else Integrated(None, "was left out")

    worst = worst_of(curve, OPTIONS, 72, lambda *_: Integrated(None), mix=Mix())
    (between,) = coexistences(branches_of(curve))
    assert (between.start_hz, between.end_hz, between.height_m) == (4.0, 6.0, 8.0)
    second = 5.0 if height > 10.0 else 4.25
    # until blades times periods are spent
    assert starts == [(4.5, 7, 49_500), (4.5, 1, 48_300), (second, 7, 47_100), (second, 1, 47_100)]
    assert worst.amplitude_m == max(height, 5.0)
    assert "time integration from 2 mixed starts (ring of 4 blades)" in worst.searched
    assert worst.unresolved == ""  # the range was looked at


def test_an_unstable_solution_below_a_stable_one_is_left_alone():
    """The overhanging part of a fold: at 5 and 6 Hz stable solutions stand above the unstable ones."""
    frequency, amplitude = [4.0, 5.0, 6.0, 6.5, 6.0, 5.0, 4.5, 5.0], [4.0, 6.0, 8.0, 8.5, 6.0, 4.0, 2.0, 1.0]
    stable = [True, True, True, True, False, False, True, True]
    curve = curve_of(frequency, amplitude, stable)
    assert unstable_stretches(branches_of(curve)) == []
    assert worst_of(curve, OPTIONS, 72, never).amplitude_m == 8.5
    assert sorted(stable_amplitudes(branches_of(curve), 5.5)) == pytest.approx([7.0])


def test_the_ring_starts_from_the_fastest_growth_too():
    """The highest motion of an unstable part need not be where the unstable solution is highest."""
    curve = curve_of(SEVEN, [1.0, 6.0, 7.0, 8.0, 9.0, 2.0, 1.0], [True, False, False, False, False, True, True])
    rates = np.array([-1.0, 1.0, 20.0, 2.0, 1.0, -1.0, -1.0])
    ring, starts = ring_to(1.0)

    def integrate(place, blade_periods, floor):
        found = ring(place, blade_periods, floor)
        height = {1: 8.0, 2: 16.0, 3: 14.0, 4: 9.5}[place[1]]
        changes = {"amplitude_m": height, "lowest_m": 0.5 * height, "envelope_m": height * np.ones((300, 4))}
        return Integrated(replace(found.motion, **changes))

    worst = worst_of(replace(curve, growth_rate=rates), OPTIONS, 72, integrate)
    assert starts[:2] == [(0, 2), (0, 4)]
    assert (worst.amplitude_m, worst.index, worst.motion) == (16.0, 2, "quasi-periodic")
    starts.clear()
    worst_of(replace(curve, growth_rate=curve.frequency_hz), OPTIONS, 72, integrate)  # as fast everywhere
    assert starts[0] == (0, 4)


def test_a_ring_that_goes_to_a_known_stable_solution_adds_nothing():
    main = curve_of(SEVEN, HILL, [True] * 7, curve_of([5.0, 5.05], [20.0, 20.0], [False, False]))
    integrate, starts = ring_to(8.8, periodic=True, lowest_m=8.8)  # stable are 9 and 8.75
    worst = worst_of(main, OPTIONS, 72, integrate)
    assert starts[0] == (1, 0)
    assert (worst.amplitude_m, worst.branch) == (9.0, 0)


def test_a_periodic_motion_on_no_branch_is_a_finding():
    main = curve_of(SEVEN, HILL, [True] * 7, curve_of([4.5, 5.5], [20.0, 20.0], [False, False]))
    integrate, _ = ring_to(15.0, periodic=True, lowest_m=15.0)
    worst = worst_of(main, OPTIONS, 72, integrate)
    assert (worst.amplitude_m, worst.branch, worst.motion, worst.scatter) == (15.0, -1, "periodic", 0.0)


def test_the_highest_motion_of_a_stretch_is_refined():
    """The motion is highest at 6.6 Hz, the unstable solution at 5 Hz."""
    frequency = np.linspace(4.0, 8.0, 81)
    amplitude = 10.0 - (frequency - 5.0) ** 2
    curve = curve_of(frequency, amplitude, [False] * 81)
    starts = []

    def integrate(place, blade_periods, floor):
        starts.append(place)
        height = 30.0 - (frequency[place[1]] - 6.6) ** 2
        return ring_to(height)[0](place, blade_periods, floor)

    worst = worst_of(curve, OPTIONS, 72, integrate)
    assert len(starts) == len(set(starts)) <= 1 + MOST_FURTHER
    assert starts[0] == (0, 20)
    assert worst.amplitude_m > 29.9
    assert worst.frequency_hz == frequency[worst.index]


def test_what_is_left_open_is_said():
    tops = [20.0 + n for n in range(MOST_STRETCHES + 2)]
    places = [1.0 + 0.1 * n for n in range(len(tops))]
    unstable = [curve_of([f, f + 0.05], [top, top], [False] * 2) for f, top in zip(places, tops, strict=True)]
    main = curve_of(SEVEN, HILL, [True] * 7, *unstable, complete=False)
    integrate, _ = ring_to(15.0, settled=False, persistence=80)
    worst = worst_of(main, OPTIONS, 72, integrate)
    for said in (
        "incomplete",
        "2 unstable parts",
        "up to 21 m",
        "motions up to 15 m at 1.7 Hz",
    ):
        assert said in worst.unresolved
    assert worst.amplitude_m == 9.0  # a transient is no motion that persists
    without = worst_of(main, replace(OPTIONS, search="off"), 72, None, "switched off")
    assert without.amplitude_m == 9.0
    assert f"{len(tops)} unstable parts" in without.unresolved
    assert "switched off" in without.unresolved


def test_low_unstable_stretches_are_left_out():
    """Motions up to three times an unstable solution were seen; far below the highest one it does not matter."""
    curve = curve_of(SEVEN, HILL, [True, True, True, True, True, True, False])
    assert worst_of(curve, OPTIONS, 72, never).amplitude_m == 9.0


def test_no_stable_solution_and_no_time_integration():
    worst = worst_of(curve_of(SEVEN, HILL, [False] * 7), OPTIONS, 72, None, "switched off")
    assert math.isnan(worst.amplitude_m)
    assert worst.branch == -1
    assert "up to 9 m" in worst.unresolved


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"stability": "wave"}, "symmetry of the wave only; .*not searched: other nodal diameters"),
        ({"stability": "folds"}, "stability from folds only"),
        ({"detached": False}, "not searched: detached branches"),
    ],
)
def test_what_was_not_searched_is_said(changes, said):
    worst = worst_of(curve_of(SEVEN, HILL, [True] * 7), replace(OPTIONS, **changes), 72, never)
    assert pytest.approx(9.0) == worst.amplitude_m
    assert re.search(said, worst.searched)


def test_a_ring_that_stays_has_the_height_of_the_solution():
    """What is left of the disturbance at the end does not count."""
    curve = curve_of(SEVEN, HILL, [True, True, True, False, True, True, True])
    integrate, _ = ring_to(9.2, stays=True, periodic=True, started_m=9.0)
    worst = worst_of(curve, OPTIONS, 72, integrate)
    assert (worst.amplitude_m, worst.branch, worst.index, worst.scatter) == (9.0, 0, 3, 0.0)


def test_the_ring_starts_where_the_highest_stable_motion_loses_its_stability():
    """Rings fall from the high unstable solutions; beside the stability limit a motion begins that is modulated."""
    curve = curve_of(SEVEN, [1.0, 5.0, 6.0, 7.0, 8.0, 9.0, 1.0], [True, True, False, False, False, False, True])
    ring, starts = ring_to(1.0)

    def integrate(place, blade_periods, floor):
        found = ring(place, blade_periods, floor).motion
        height = 6.5 if place[1] == 2 else 0.1
        return Integrated(replace(found, amplitude_m=height, lowest_m=0.5 * height))

    worst = worst_of(curve, OPTIONS, 72, integrate)
    assert starts[0] == (0, 5)
    assert (worst.amplitude_m, worst.index) == (6.5, 2)


def test_a_large_ring_that_was_left_out_is_said():
    """What a smaller one does counts all the same."""
    curve = curve_of(SEVEN, HILL, [True, True, True, False, True, True, True])
    ring, _ = ring_to(15.0)

    def integrate(place, blade_periods, floor):
        return ring(place, blade_periods, floor)._replace(failure="of 72 blades would take too long")

    worst = worst_of(curve, OPTIONS, 72, integrate)
    assert worst.amplitude_m == 15.0
    assert worst.unresolved == "time integration at 5 Hz of 72 blades would take too long (solutions up to 9 m)"


def test_a_motion_that_falls_but_is_the_highest_at_the_end_is_said():
    """Where it ends is not known: it may settle above the worst motion known."""
    curve = curve_of(SEVEN, HILL, [True, True, True, False, True, True, True])
    falling = np.repeat(np.linspace(9.0, 6.0, 300)[:, None], 4, axis=1)
    open_ring, _ = ring_to(9.0, settled=False, envelope_m=falling, persistence=80)
    worst = worst_of(curve, OPTIONS, 72, open_ring)
    assert worst.amplitude_m == 4.0
    assert worst.unresolved == "motions up to 9 m at 5 Hz were not seen to persist"
    fallen, _ = ring_to(9.0, settled=False, envelope_m=falling / 2.0, persistence=80)
    assert worst_of(curve, OPTIONS, 72, fallen).unresolved == ""


def test_the_end_of_the_range_is_a_lower_bound_and_no_peak():
    """The hill ends on its way up: at 9 Hz, where the range ends, nothing is known of the peak beyond."""
    rising = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 9.0]
    worst = worst_of(curve_of([*SEVEN[:6], 9.0], rising, [True] * 7), OPTIONS, 72, never)
    assert (worst.amplitude_m, worst.frequency_hz, worst.at_end) == (9.0, 9.0, True)
    assert worst.unresolved.startswith("9 Hz is an end of the frequency range")
    inside = worst_of(curve_of(SEVEN, HILL, [True] * 7), OPTIONS, 72, never)
    assert (inside.at_end, inside.unresolved) == (False, "")


@pytest.mark.parametrize("error", [3.65, 0.03, math.nan])
@pytest.mark.parametrize("stays", [True, False])
def test_a_detached_branch_that_more_harmonics_do_not_confirm_is_named_beside(error, stays):
    """122.8 um from a branch with an estimate of 365 %; a ring started there fell to 11 um."""
    high = replace(curve_of([4.0, 5.0], [50.0, 60.0], [True, True]), truncation_error=error)
    curve = curve_of(SEVEN, HILL, [True] * 7, high)
    fallen = {"amplitude_m": 1.0, "lowest_m": 1.0, "periodic": True, "envelope_m": np.ones((300, 4))}
    integrate, starts = ring_to(60.0, stays=stays, started_m=60.0, **({} if stays else fallen))
    worst = worst_of(curve, OPTIONS, 72, integrate)
    if not error > 0.05:
        assert (worst.amplitude_m, worst.branch, starts, worst.not_counted) == (60.0, 1, [], "")
        assert worst.truncation_error == pytest.approx(error, nan_ok=True)
    elif stays:
        assert (worst.amplitude_m, worst.branch, worst.not_counted) == (60.0, 1, "")
    else:
        assert (worst.amplitude_m, worst.branch, worst.truncation_error) == (9.0, 0, 0.01)
        assert (
            worst.not_counted == "detached branch 1, up to 60 m: truncation error 365 %, the ring does not stay on it"
        )
        assert worst.unresolved == ""
        without = worst_of(curve, OPTIONS, 72, None, "switched off")
        assert (without.amplitude_m, without.branch) == (9.0, 0)
        assert without.not_counted.endswith("not checked by time integration")
        assert "1 unstable part of the branches, up to 60 m" in without.unresolved


def test_more_blade_periods_are_shared_out_alike():
    curve = curve_of(SEVEN, HILL, [True, True, True, False, True, True, True])
    ring, _ = ring_to(15.0)
    given = []

    def integrate(place, blade_periods, floor):
        given.append(blade_periods)
        return ring(place, blade_periods, floor)

    for search in ("quick", "standard", "thorough"):
        worst_of(curve, replace(OPTIONS, search=search), 72, integrate)
    assert given == [6_750, 27_000, 270_000]  # the least, as this curve costs little
    many = replace(curve, kept_harmonics=curve.kept_harmonics + 1000)
    assert affordable([many], OPTIONS) == 7 * 2007 * EQUAL_COST
    with pytest.raises(OptionsError, match='search: "most", allowed: "off", "quick", "standard" or "thorough"'):
        replace(OPTIONS, search="most")


def test_many_places_are_not_all_named():
    frequency = np.linspace(4.0, 8.0, 81)
    curve = curve_of(frequency, 10.0 - (frequency - 5.0) ** 2, [False] * 81)
    worst = worst_of(curve, OPTIONS, 72, lambda *_: Integrated(None, "of 72 blades would take too long"))
    assert re.fullmatch(
        r"time integration at (\S+ Hz, ){3}\d+ others of 72 blades would take too long \(solutions up to 10 m\)",
        worst.unresolved,
    )


def test_a_ring_that_had_no_time_to_leave_tells_nothing():
    curve = curve_of(SEVEN, HILL, [True, True, True, False, True, True, True])
    integrate, _ = ring_to(9.2, stays=True, periodic=True, started_m=9.0, periods=10)
    worst = worst_of(curve, OPTIONS, 72, integrate)
    assert worst.amplitude_m == 4.0
    assert worst.unresolved == "motions up to 9.2 m at 5 Hz were not seen to persist"
