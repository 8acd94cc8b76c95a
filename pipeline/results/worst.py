"""The motions of the curves in words, as table, report, summary and terminal say them: heights with their marks, the
worst motion, detached branches, what was searched, ends of the range, and a warning."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from nonlinear import TRUNCATION_TOLERATED
from pipeline.scene.labels import prefixed

if TYPE_CHECKING:
    from pipeline.stages.curve.curve_summary import CurveSummary
    from pipeline.stages.curve.respond import CurveResult

SEARCHED = "searched: "  # beginning of each sentence
END_MARK = " (end)"  # beside a frequency or an amplitude at an end of the frequency range, where no peak is
UNSTABLE_MARK = " (unstable)"  # beside the amplitude of a solution that the ring leaves
_NUMBER = re.compile(r"\d+")
# what is open after too short a time integration
SHORT_OF_TIME = ("take too long", "left out", "not settled", "was followed")
STARRED = ("quasi-periodic", "irregular")  # kinds of worst motions that do not repeat
MOST_NAMED = 10  # curves whose numbers are listed
NOTICEABLE = 1.03  # ratio of the worst motion to the peak of the main branch above which a run warns


def worst_cells(facts: CurveSummary | None, factor: float) -> tuple[str, str, str]:
    """Frequency (Hz), amplitude (m times `factor`) and kind of the worst motion, for a table.

    An amplitude that the search may have fallen short of has the mark ">=", a solution that the ring leaves, perhaps
    for a lower one, "(unstable)", a motion that does not repeat a star, an end of the frequency range "(end)", an
    amplitude with too few harmonics "(H too small)".
    """
    if facts is None or not math.isfinite(facts.worst_amplitude_m):
        return "-", "unknown" if facts is not None and facts.worst_searched else "-", "-"
    at_least = ">= " if facts.worst_unresolved and not facts.worst_unstable else ""
    marks = UNSTABLE_MARK * facts.worst_unstable + " (H too small)" * harmonics_lack(facts)
    amplitude = f"{at_least}{facts.worst_amplitude_m * factor:.4g}{marks}"
    return (
        f"{facts.worst_frequency_hz:.6g}{END_MARK * facts.worst_at_end}",
        amplitude,
        _branch(facts) + "*" * (facts.worst_motion != "periodic"),
    )


def harmonics_lack(facts: CurveSummary) -> bool:
    """Whether the height of a curve has a truncation error that is too large: H is too small for it."""
    return number_error(facts) > TRUNCATION_TOLERATED


def truncation_mark(error: float) -> str:
    """` (H too small: truncation error 24 %)` where that is the case; otherwise empty."""
    return f" (H too small: truncation error {share(error)})" if error > TRUNCATION_TOLERATED else ""


def height_mark(facts: CurveSummary) -> str:
    """What is said beside the worst motion: an end of the range, instability, harmonics that are too few."""
    unstable = UNSTABLE_MARK * facts.worst_unstable
    return END_MARK * facts.at_end + unstable + truncation_mark(number_error(facts))


def number_error(facts: CurveSummary) -> float:
    """Truncation error of the height of a curve: of its worst motion, or of the peak where that has none."""
    worst = facts.worst_truncation_error
    return facts.truncation_error if math.isnan(worst) else worst


def share(error: float) -> str:
    """A relative error in percent; "unknown" where it is infinite: a more accurate solution has no such peak."""
    if math.isnan(error):
        return "-"
    if error > 0.5:
        return "over 50 %" if math.isfinite(error) else "unknown"
    return "< 0.01 %" if error < 1e-4 else f"{100.0 * error:.2g} %"


def worst_kind(facts: CurveSummary) -> str:
    """Branch of the worst motion, and whether it is quasi-periodic or irregular."""
    where = "on no branch found" if facts.worst_branch < 0 else f"{_branch(facts)} branch"
    if facts.worst_branch > 0:
        where = f"detached branch {facts.worst_branch}"
    if facts.worst_motion == "periodic":
        return where
    seen = f", seen for {facts.worst_periods} periods" if facts.worst_motion == "irregular" else ""
    return f"{facts.worst_motion}{seen}, from the {where}"


def _branch(facts: CurveSummary) -> str:
    if facts.worst_branch < 0:
        return "none"
    return f"detached {facts.worst_branch}" if facts.worst_branch else "main"


def exceeds_peak(facts: CurveSummary | None) -> bool:
    """Whether the worst motion is noticeably higher than the peak of the main branch."""
    if facts is None or not math.isfinite(facts.worst_amplitude_m) or not math.isfinite(facts.peak_amplitude_m):
        return False
    return facts.worst_amplitude_m > NOTICEABLE * facts.peak_amplitude_m


def worst_warning(curves: Sequence[CurveResult]) -> str:
    """A line on the curves whose worst motion is higher than the peak of the main branch; "" where there are none."""
    higher = {i: c.facts for i, c in enumerate(curves) if c.facts is not None and exceeds_peak(c.facts)}
    if not higher:
        return ""
    number, facts = max(higher.items(), key=lambda item: item[1].worst_amplitude_m / item[1].peak_amplitude_m)
    worst, peak = with_unit(facts.worst_amplitude_m), with_unit(facts.peak_amplitude_m)
    count = f"{len(higher)} of {len(curves)} curves: a" if len(curves) > 1 else "a"
    of = f", on curve {number} {worst}" if len(curves) > 1 else f", {worst}"
    ratio = facts.worst_amplitude_m / facts.peak_amplitude_m
    return (
        f"{count} motion that persists is higher than the peak of the main branch{of} at "
        f"{facts.worst_frequency_hz:.6g} Hz ({worst_kind(facts)}) beside {peak}, {ratio:.3g} times as high"
    )


def unstable_peak_numbers(curves: Sequence[CurveResult]) -> list[int]:
    """Curves whose worst motion is noticeably lower than the peak of the main branch, which does not persist."""
    return [
        number
        for number, curve in enumerate(curves)
        if curve.facts is not None
        and math.isfinite(curve.facts.worst_amplitude_m)
        and curve.facts.worst_amplitude_m * NOTICEABLE < curve.facts.peak_amplitude_m
    ]


def search_notes(curves: Sequence[CurveResult]) -> list[str]:
    """What the search for the worst motion covered and what it did not, and what it left open, curve by curve."""
    said = [curve.facts.worst_searched for curve in curves if curve.facts is not None and curve.facts.worst_searched]
    notes = [f"worst motion: the highest that persists; {_merged(said)}"] if said else []
    notes += end_notes(curves)
    if said and any(curve.carried_from for curve in curves):
        notes.append("branches of neighbouring curves of the sweep were continued to these curves, too")
    if any(curve.facts is not None and curve.facts.worst_motion in STARRED for curve in curves):
        notes.append("* quasi-periodic or irregular: the largest displacement of a long time integration of the ring")
    for number, curve in enumerate(curves):
        notes += [f"curve {number}: {said}" for said in (() if curve.facts is None else seen_remarks(curve.facts))]
    if low := unstable_peak_numbers(curves):
        named = (
            f"{len(low)} curves"
            if len(low) > MOST_NAMED
            else f"curve{'s' if len(low) > 1 else ''} {', '.join(map(str, low))}"
        )
        notes.append(f"{named}: the peak of the main branch is unstable and does not persist")
    for number, curve in enumerate(curves):
        notes += [f"curve {number}: {said}" for said in (() if curve.facts is None else open_remarks(curve.facts))]
    short = {
        curve.member.scene.response.blade_periods
        for curve in curves
        if curve.facts is not None and any(reason in curve.facts.worst_unresolved for reason in SHORT_OF_TIME)
    }
    if short:
        notes.append(f"response.blade_periods above {max(short)} lets time integration go on for longer")
    return notes


def seen_remarks(facts: CurveSummary) -> Iterator[str]:
    """How long an irregular worst motion was seen, and over which frequencies a motion in time was followed."""
    if facts.worst_motion == "irregular":
        yield f"the worst motion is irregular, seen for {facts.worst_periods} periods"
    if facts.worst_followed_hz:
        low, high = facts.worst_followed_hz[0], facts.worst_followed_hz[-1]
        yield f"the worst motion, on no branch, was followed in frequency from {low:.6g} to {high:.6g} Hz"


def open_remarks(facts: CurveSummary) -> Iterator[str]:
    """What the search for the worst motion of a curve left open, and what it did not count."""
    if facts.worst_unresolved:
        what = "the worst motion is not known" if facts.worst_unstable else "the worst motion may be higher"
        yield f"{what}: {facts.worst_unresolved}"
    if facts.worst_not_counted:
        yield f"not counted as worst motion: {facts.worst_not_counted}"


def end_notes(curves: Sequence[CurveResult]) -> list[str]:
    """A line for each curve whose highest amplitude lies at an end of the frequency range."""
    return [
        f"curve {number}: {said}"
        for number, curve in enumerate(curves)
        if curve.facts is not None and (said := end_said(curve.facts))
    ]


def end_said(facts: CurveSummary) -> str:
    """That the highest amplitude of a curve is no peak, and its highest peak inside the range; "" for a peak."""
    if not (facts.worst_at_end or facts.peak_at_end):
        return ""
    height, at = facts.peak_amplitude_m, facts.peak_frequency_hz
    if facts.worst_at_end:
        height, at = facts.worst_amplitude_m, facts.worst_frequency_hz
    inner = max(facts.peaks, key=lambda peak: float(peak["amplitude_m"]), default=None)
    inside = "none inside it"
    if inner is not None:
        inside = f"the highest inside it: {motion_said(inner['amplitude_m'], inner['frequency_hz'], 6)}"
    return f"{motion_said(height, at, 6)}, an end of the frequency range, is no peak ({inside})"


def with_unit(value: float, unit: str = "m") -> str:
    """A value with four digits and a prefixed unit."""
    factor, prefixed_unit = prefixed(value, unit)
    return f"{value * factor:.4g} {prefixed_unit}"


def motion_said(amplitude_m: float, frequency_hz: float, digits: int = 5) -> str:
    """An amplitude at its frequency, which has so many digits."""
    return f"{with_unit(amplitude_m)} at {frequency_hz:.{digits}g} Hz"


def branch_said(branch: Mapping[str, Any]) -> str:
    """Range and height of a detached branch, an entry of `detached` in summary.json."""
    return f"{branch['from_hz']:.6g} to {branch['to_hz']:.6g} Hz, up to {with_unit(branch['peak_amplitude_m'])}"


def sentence(text: str) -> str:
    """A remark as a sentence: with a capital letter and a full stop."""
    return f"{text[:1].upper()}{text[1:]}."


def _merged(texts: Sequence[str]) -> str:
    """Sentences of the same form as one: where only numbers differ from curve to curve their range is given."""
    columns: dict[int, dict[str, list[list[int]]]] = {}
    for text in texts:
        for place, part in enumerate(text.removeprefix(SEARCHED).split("; ")):
            numbers = [int(number) for number in _NUMBER.findall(part)]
            columns.setdefault(place, {}).setdefault(_NUMBER.sub("#", part), []).append(numbers)
    return SEARCHED + "; ".join(
        " or ".join(_filled(*item) for item in variants.items()) for variants in columns.values()
    )


def _filled(form: str, rows: list[list[int]]) -> str:
    """A form with # for each number, filled in with the numbers, or their ranges, of all rows."""
    ranges = [(min(column), max(column)) for column in zip(*rows, strict=True)]
    texts = iter(str(low) if low == high else f"{low}...{high}" for low, high in ranges)
    return "".join(next(texts) if character == "#" else character for character in form)
