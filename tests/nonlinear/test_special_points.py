"""Peaks and changes of stability between two neighbours of a curve that have different numbers of harmonics."""

import pytest
from test_truncation import bilinear, height, main_branch

from nonlinear import Excitation
from nonlinear.branches.special_points import locate_change, locate_peak


@pytest.fixture(scope="module")
def neighbours():
    """An oscillator with a stop: a point shortly before its peak with 3 harmonics, the same with one, and the next.

    With one harmonic the amplitude falls there already.
    """
    modal, contact = bilinear(8.0)
    (truncation, branch), (coarse, _) = (
        main_branch((modal, contact, Excitation(0, 1.0)), (0.02, 0.6), count) for count in (3, 1)
    )
    solver, recorder = truncation.continuation.solver, coarse.continuation.recorder
    start, peak = (branch.points[branch.peak_indices[-1] + offset] for offset in (-1, 0))
    before = recorder.record(solver.step(start, 0.9 * (peak.arc - start.arc)))
    common = coarse.continuation.solver.refit(before)
    after = recorder.record(coarse.continuation.solver.step(common, 0.01))
    return coarse, before, common, after


def test_a_peak_is_where_the_number_of_harmonics_changes(neighbours):
    """Nothing lies between: with one harmonic the amplitude falls from the first point on."""
    truncation, before, common, after = neighbours
    assert before.dA_ds > 0.0 > after.dA_ds
    peak = locate_peak(truncation.continuation, before, after)
    assert peak.balance is after.balance
    assert (peak.arc, peak.omega) == (before.arc, common.omega)
    assert height(truncation, peak) > height(truncation, after)


def test_a_change_there_is_at_the_second_point(neighbours):
    """The two have the same arc length: there is no way between them to be searched."""
    truncation, before, common, _ = neighbours
    recorded = truncation.continuation.recorder.record(common)

    def has_one(point):
        return point.balance is common.balance

    found = locate_change(truncation.continuation, before, recorded, has_one, rate=lambda point: 1.0)
    assert found is recorded
    again = locate_peak(truncation.continuation, before, recorded)  # from a rise to a fall at one place
    assert again.arc == before.arc
    assert again.omega == pytest.approx(common.omega, rel=1e-9)
