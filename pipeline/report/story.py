"""What a reader wants first: what was computed, the worst motion, the best value, and how sure this is."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

from pipeline.figures.data import SweepPoint
from pipeline.figures.sweep_keys import SweepKey, sweep_keys
from pipeline.report.error_budget import FAIR, LARGE, SMALL, UNKNOWN, ErrorRow
from pipeline.report.report_source import ReportSource
from pipeline.results.worst import with_unit
from pipeline.scene.labels import quantity

MANY = 24  # values
SHORT = 60  # characters of a finding that the sentence has room for


def story(source: ReportSource, points: Sequence[SweepPoint], errors: Sequence[ErrorRow]) -> list[tuple[str, str]]:
    """Headings and a sentence or two for each."""
    told = [("Computed", _computed(source, points))]
    known = [point for point in points if math.isfinite(point.worst[1])]
    if known:
        told.append(("Worst motion", _worst(known, len(source.curves))))
    if len(known) > 1:
        told.append(("Best value", _best(known)))
    told.append(("How sure", _how_sure(errors, len([p for p in known if p.worst_open]), len(known))))
    return told


def swept_range(key: SweepKey) -> str:
    """The range of a swept key: `interference v0 from -250 to 400 µm (8 values)`."""
    name = "interference v0" if key.name == "contact.interference" else quantity(key.name).symbol
    first, last = key.values[0], key.values[-1]
    if not key.numeric:
        return f"{name} {', '.join(key.text(value) for value in key.values[:6])}{' ...' * (len(key.values) > 6)}"
    unit = quantity(key.name).unit
    low, high = key.text(first), key.text(last)
    if len(key.values) > MANY:  # sampled, with more digits than anybody reads
        low, high = f"{key.position(first):.3g}", f"{key.position(last):.3g}"
    return f"{name} from {low} to {high}{f' {unit}' if unit else ''} ({len(key.values)} values)"


def _computed(source: ReportSource, points: Sequence[SweepPoint]) -> str:
    scene, count = source.first, len(source.curves)
    low, high = scene.response.frequency
    of = ""
    if scene.blade is not None and scene.shroud is not None:
        disk = " on a disk" if scene.disk is not None else ""
        of = f" of a ring of {scene.blade.n_blades} blades{disk}, shroud angle {scene.shroud.angle:g}°"
    elif scene.model is not None:
        of = f" of a ring of {scene.model.n_blades} blades, matrices of another program"
    elif scene.mesh_file is not None:
        of = f" of a ring of {scene.n_blades} blades, mesh {Path(scene.mesh_file).name}"
    if "shroud.angle" in source.swept or "mesh.file" in source.swept:
        of = of.partition(", ")[0]
    curves = f"{count} response curves" if count > 1 else "One response curve"
    load = [f"{scene.excitation.force:g} N"] * ("excitation.force" not in source.swept)
    orders = [scene.excitation.engine_order * item.order for item in scene.excitation.harmonic if item.order > 1]
    besides = f" and its multiples {', '.join(map(str, orders))}" if orders else ""
    order = f"engine order {scene.excitation.engine_order}{besides}"
    load += [order] * ("excitation.engine_order" not in source.swept)
    excited = f", excited by {' at '.join(load)}" if load else ""
    keys = sweep_keys(points)
    over = f". Swept: {'; '.join(swept_range(key) for key in keys)}" if keys else ""
    failed = count - len(points)
    missing = f" {failed} of them could not be computed." if failed else ""
    return f"{curves}{of}, {low:g} to {high:g} Hz{excited}{over}.{missing}"


def _worst(known: Sequence[SweepPoint], count: int) -> str:
    highest = max(known, key=lambda point: point.worst[1])
    where = f", with {highest.label}" if highest.parameters else ""
    text = f"{'At least ' * highest.worst_open}{_place(highest)}{where}."
    if count > 1:
        text += f" It is the highest of {len(known)} curves."
    if highest.peak[1] > 1.03 * highest.worst[1]:
        text += f" The main branch reaches {with_unit(highest.peak[1])}, but that motion is unstable."
    elif highest.worst[1] > 1.03 * highest.peak[1]:
        text += f" The main branch alone reaches {with_unit(highest.peak[1])}."
    return text


def _best(known: Sequence[SweepPoint]) -> str:
    closed = [point for point in known if not point.worst_open]
    if not closed:
        return "Not known: each worst motion may be higher than found (see the remarks of the table)."
    lowest = min(closed, key=lambda point: point.worst[1])
    highest = max(known, key=lambda point: point.worst[1])
    text = f"{lowest.label}, with a worst motion of {_place(lowest)}"
    if lowest.worst[1] > 0.0 and highest is not lowest:
        text += f"; the highest is {highest.worst[1] / lowest.worst[1]:.3g} times as high"
    unsure = [point for point in known if point.worst_open and point.worst[1] < lowest.worst[1]]
    if unsure:
        curves, which = ("curve has", "it") if len(unsure) == 1 else ("curves have", "they")
        text += f". {len(unsure)} {curves} a lower one so far, but {which} may be higher than found"
    return f"{text}."


def _how_sure(errors: Sequence[ErrorRow], unsure: int, known: int) -> str:
    named: dict[str, list[str]] = {LARGE: [], FAIR: [], UNKNOWN: [], SMALL: []}
    for row in errors:
        said = row.verdict in (LARGE, FAIR) and len(row.found) <= SHORT
        named[row.verdict].append(f"{row.name} ({row.found})" if said else row.name)
    text = "; ".join(f"{verdict}: {', '.join(names)}" for verdict, names in named.items() if names)
    text = f"Errors, as the section Errors judges them: {text}."
    if unsure:
        text += f" On {unsure} of {known} curves the worst motion may be higher than found."
    return text


def _place(point: SweepPoint) -> str:
    return f"{with_unit(point.worst[1])} at {point.worst[0]:.5g} Hz{point.mark}"
