"""How sure the numbers of a run are, in sentences: error budget, search for the worst motion, residual tractions.

For `shroud info` and the report, from the summaries of the curves by their numbers and from `models` of summary.json.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any

from nonlinear.options import TRUNCATION_TOLERATED
from pipeline.results.tables import TOLERATED_SAMPLING, bounds_text, branch_remarks, has_bounds, listed
from pipeline.results.worst import (
    SEARCHED,
    STARRED,
    branch_said,
    end_said,
    open_remarks,
    seen_remarks,
    sentence,
    share,
    unstable_peaks,
)
from pipeline.stages.curve.curve_summary import CurveSummary

Facts = Mapping[int, CurveSummary]


def error_sentences(facts: Facts, models: Sequence[Mapping[str, Any]]) -> list[str]:
    """The error budget: harmonics, samples, energy, modes, cut faces, Coriolis forces, branches."""
    return [*_of_peaks(facts), *_of_models(models), *_of_branches(facts)]


def _largest(facts: Facts, error: Callable[[CurveSummary], float]) -> tuple[float, str] | None:
    """The largest of an error over the curves, and where; None where it is not known of any."""
    known = {number: error(item) for number, item in facts.items() if not math.isnan(error(item))}
    if not known:
        return None
    number = max(known, key=lambda each: known[each])
    return known[number], f" (curve {number})" if len(facts) > 1 else ""


def _of_peaks(facts: Facts) -> Iterator[str]:
    found = _largest(facts, lambda item: item.truncation_error)
    if found is None:
        yield "The truncation error, by neglected harmonics, was not estimated."
    else:
        end = "" if found[0] <= TRUNCATION_TOLERATED else ", too much: raise response.harmonics"
        yield f"Neglected harmonics change a peak by {_at_most(found[0])}{found[1]}{end}."
    found = _largest(facts, lambda item: max(item.sampling_error, item.sampling_frequency_error))
    if found is not None and found[0] > 0.0:
        raised = ', too much: raise contact.samples or set contact.integration = "exact"'
        end = "" if found[0] <= TOLERATED_SAMPLING else raised
        yield f"Time samples of the contact force change a peak by {_at_most(found[0])}{found[1]}{end}."
    found = _largest(facts, lambda item: item.energy_error)
    if found is not None:
        yield f"The energy balance per cycle closes to {found[0]:.0e}{found[1]}."


def _at_most(error: float) -> str:
    text = share(error)
    return text if text[0] in "<ou" else f"at most {text}"


def _of_models(models: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    known = [model for model in models if model.get("modes_error") is not None]
    if known:
        modes = sorted({model["modes"] for model in known})
        number = str(modes[0]) if len(modes) == 1 else f"{modes[0]} to {modes[-1]}"
        frequency, receptance = (
            share(max(model[f"{name}_error"] for model in known)) for name in ("modes_frequency", "receptance")
        )
        yield (
            f"With {number} fixed-interface modes the reduced model is off by {frequency} in natural frequencies and "
            f"by {receptance} in receptances at a fixed frequency (estimated)."
        )
    disks = [model for model in models if "wave_error" in model]
    if disks:
        worst = max(disks, key=lambda model: float(model["wave_error"]))
        waves = ", ".join(str(number) for number in sorted(worst["wave_error_at"]))
        yield (
            f"With {worst['cut_face_motions']} motions of a cut face six natural frequencies of the disk are off by "
            f"at most {share(worst['wave_error'])}, against the whole mesh at nodal diameters {waves}."
        )
    if said := coriolis_said(models):
        yield f"Coriolis forces are neglected: {said}."
    if included := [float(model["coriolis_error"]) for model in models if has_coriolis(model)]:
        yield f"Coriolis forces are included; they change natural frequencies in the range by {share(max(included))}."


def has_coriolis(model: Mapping[str, Any]) -> bool:
    """Whether Coriolis forces act in the curves of a model; not in files of earlier versions."""
    return bool(model.get("coriolis_included", False))


def coriolis_said(models: Sequence[Mapping[str, Any]], tolerated: float = 0.0) -> str:
    """What neglected Coriolis forces change; "" where that is not more than `tolerated`."""
    errors: list[Any] = [model.get("coriolis_error") for model in models if not has_coriolis(model)]
    if None in errors:
        return "their effect is not known, the reduced model has no dataset coriolis"
    largest = max(errors, default=0.0)
    return f"they change natural frequencies in the range by {share(largest)}" if largest > tolerated else ""


def _of_branches(facts: Facts) -> Iterator[str]:
    detached = [number for number, item in facts.items() if item.truncation_branch == "detached"]
    if detached:
        yield (
            f"{_named(detached)}: with more harmonics the peak lies on a detached branch, and the truncation error "
            "compares with what the main branch reaches; raise response.harmonics."
        )
    lost = [number for number, item in facts.items() if item.truncation_branch == "lost"]
    if lost:
        yield (
            f"{_named(lost)}: the peak could not be followed to more harmonics on its branch, and the truncation "
            "error may be larger than estimated; raise response.harmonics."
        )
    if unstable := unstable_peaks(facts):
        yield f"{_named(unstable)}: the peak of the response curve is unstable and does not persist."


def search_sentences(facts: Facts) -> list[str]:
    """What the search for the worst motion covered and what it did not; what all curves share is said once."""
    found = {
        number: item.worst_searched.removeprefix(SEARCHED).split("; ")
        for number, item in facts.items()
        if item.worst_searched
    }
    if not found:
        return []
    first = next(iter(found.values()))
    common = [part for part in first if all(part in parts for parts in found.values())]
    common = [part for part in common if not part.startswith("not searched")]
    sentences = ["The worst motion is the highest that persists, of those that were searched for."]
    if common:
        sentences.append(f"Searched{' on every curve' * (len(facts) > 1)}: {'; '.join(common)}.")
    different: dict[str, list[int]] = {}
    for number, parts in found.items():
        own = [part for part in parts if part not in common and not part.startswith("not searched")]
        different.setdefault("; ".join(own), []).append(number)
    sentences += [f"{_named(numbers)}: {own}." for own, numbers in different.items() if own]
    left = dict.fromkeys(part for parts in found.values() for part in parts if part.startswith("not searched"))
    sentences += [sentence(part) for part in left]
    if any(item.worst_motion in STARRED for item in facts.values()):
        sentences.append(
            "The height of a quasi-periodic or irregular motion is the largest displacement while the ring is "
            "integrated in time."
        )
    return sentences


def open_sentences(facts: Facts) -> list[str]:
    """What was left open of single curves, ends of the range, and what was not counted."""
    return [
        f"Curve {number}: {said}."
        for number, item in facts.items()
        for said in (end_said(item), *seen_remarks(item), *open_remarks(item))
        if said
    ]


def branch_sentences(facts: Facts) -> list[str]:
    """Every detached branch."""
    return [
        f"Curve {number}: a detached branch, {branch_said(branch)}{', unstable' * (not branch['stable_points'])}"
        f"{branch_remarks(branch)}."
        for number, item in facts.items()
        for branch in item.detached
    ]


def residual_sentences(facts: Facts, asked: bool, cone: bool) -> list[str]:
    """Bounds of the peaks over residual tractions, where they were asked for, and which peaks are not unique."""
    known = {number: item for number, item in facts.items() if has_bounds(item)}
    end = "; an estimate with the friction cone: some tractions may lead a little beyond it" * cone
    found = [f"Curve {number}: {bounds_text(item)}{end}." for number, item in known.items()]
    free = [number for number, item in facts.items() if item.free_nodes > 0 and number not in known]
    if free and asked:
        return [*found, f"{_named(free)}: no bounds over residual tractions were found."]
    if free:
        found.append(
            f"{_named(free)}: some contact nodes stick all the time along t1 or t2 at the peak, and friction leaves "
            'the static traction there undetermined; response.residual_tractions = "bounds" gives the lowest and the '
            "highest peak."
        )
    return found


def bifurcation_sentences(facts: Facts) -> list[str]:
    """Kinds of bifurcations of each main branch, and how many of each."""
    kinds = {number: Counter(str(each["kind"]) for each in item.bifurcations) for number, item in facts.items()}
    said = {number: [f"{kind} ({count})" for kind, count in found.items()] for number, found in kinds.items()}
    return [f"Curve {number}: {', '.join(texts)}." for number, texts in said.items() if texts]


def _named(numbers: Iterable[int]) -> str:
    text = listed(list(numbers))
    return f"{text[:1].upper()}{text[1:]}"
