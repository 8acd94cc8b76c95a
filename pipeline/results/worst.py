"""The motions of the curves in words, as table, report, summary and terminal say them: heights with their marks, the
worst motion and the contact there, detached branches, what was searched, ends of the range."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from nonlinear.options import TRUNCATION_TOLERATED
from pipeline.scene.labels import prefixed

if TYPE_CHECKING:
    from pipeline.stages.curve.curve_summary import CurveSummary

# Contact at the worst motion, and what it is called: no node ever in contact, some node opens at some time, some node
# slips and none opens, all stick all the time.
FREE, STUCK, SLIPPING, SEPARATING, UNKNOWN = "free", "stuck", "slipping", "separating", "unknown"
CONTACT_SAID = {FREE: "stays open", SEPARATING: "opens and closes", SLIPPING: "slips", STUCK: "sticks", UNKNOWN: "-"}

SEARCHED = "searched: "  # beginning of each sentence
END_MARK = " (end)"  # beside a frequency or an amplitude at an end of the frequency range, where no peak is
# the same as a remark
UNSTABLE_SAID = "unstable: the blades leave this motion for a lower or a higher one (response.search)"
UNSTABLE_MARK = " (unstable)"  # beside the amplitude of a solution that the ring leaves
STARRED = ("quasi-periodic", "irregular")  # kinds of worst motions that do not repeat
MOST_NAMED = 10  # curves whose numbers are listed
NOTICEABLE = 1.03  # ratio of the worst motion to the peak of the main branch above which a run warns


def worst_cells(facts: CurveSummary | None, factor: float) -> tuple[str, str, str]:
    """Frequency (Hz), amplitude (m times `factor`) and kind of the worst motion, for a table.

    An amplitude that the search may have fallen short of has the mark ">=", a solution that the ring leaves, perhaps
    for a lower one, "(unstable)", a motion that does not repeat a star, an end of the frequency range "(end)", an
    amplitude with too few harmonics "(too few harmonics)".
    """
    if facts is None or not math.isfinite(facts.worst_amplitude_m):
        return "-", "unknown" if facts is not None and facts.worst_searched else "-", "-"
    at_least = ">= " if facts.worst_unresolved and not facts.worst_unstable else ""
    marks = UNSTABLE_MARK * facts.worst_unstable + " (too few harmonics)" * harmonics_lack(facts)
    amplitude = f"{at_least}{facts.worst_amplitude_m * factor:.4g}{marks}"
    return (
        f"{facts.worst_frequency_hz:.6g}{END_MARK * facts.worst_at_end}",
        amplitude,
        _branch(facts) + "*" * (facts.worst_motion in STARRED),
    )


def harmonics_lack(facts: CurveSummary) -> bool:
    """Whether the height of a curve has a truncation error that is too large: H is too small for it."""
    return number_error(facts) > TRUNCATION_TOLERATED


def truncation_mark(error: float) -> str:
    """` (too few harmonics: truncation error 24 %)` where that is the case; otherwise empty."""
    return f" (too few harmonics: truncation error {share(error)})" if error > TRUNCATION_TOLERATED else ""


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


def _branch(facts: CurveSummary) -> str:
    if facts.worst_branch < 0:
        return "none"
    return f"detached {facts.worst_branch}" if facts.worst_branch else "main"


def unstable_peaks(facts: Mapping[int, CurveSummary]) -> list[int]:
    """Curves whose peak of the main branch is unstable."""
    return [number for number, item in facts.items() if peak_is_unstable(item)]


def peak_is_unstable(facts: CurveSummary) -> bool:
    """Whether the peak of the main branch does not persist; in files of earlier versions it is above what does."""
    worst = facts.worst_amplitude_m
    return not facts.peak_stable or (math.isfinite(worst) and worst * NOTICEABLE < facts.peak_amplitude_m)


def seen_remarks(facts: CurveSummary) -> Iterator[str]:
    """How long an irregular worst motion was seen, and over which frequencies a motion in time was followed."""
    if facts.worst_motion == "irregular":
        known = math.isfinite(facts.worst_recurrence)
        often = f", in {facts.worst_recurrence:.3g} of 1000 within 5 % of its height"
        yield f"the worst motion is irregular, seen for {facts.worst_periods} periods{often * known}"
    if facts.worst_motion.startswith("subharmonic"):
        yield f"the worst motion repeats after {facts.worst_motion.rpartition(':')[2]} periods of the excitation"
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


def contact_state(file: Path, facts: CurveSummary) -> str:
    """Contact state at the worst motion of a curve in a file, or at the peak where that is not known.

    Of a quasi-periodic motion that of the periodic solution that it departs from.
    """
    import h5py

    from pipeline.stages.curve.curve_file import BRANCHES

    worst = math.isfinite(facts.worst_amplitude_m)
    number, index = (facts.worst_branch, facts.worst_index) if worst else (0, facts.peak_index)
    with h5py.File(file, "r") as source:
        branches = sorted(source.get(BRANCHES, ()), key=int) if number else []
        if not 0 <= number <= len(branches) or index < 0:
            return UNKNOWN
        return _state(source[BRANCHES][branches[number - 1]] if number else source, index)


def _state(group: Any, index: int) -> str:
    """Contact state of one point of a branch, from its nodes and its contact force."""
    if group["separating"][index]:
        force = group["contact_force"][index]  # without contact exactly 0, but for the mean of a preload
        return SEPARATING if force[1:].any() or force[0, :, :2].any() else FREE
    if group["slipping"][index]:
        return SLIPPING
    return STUCK if group["sticking"][index] else UNKNOWN
