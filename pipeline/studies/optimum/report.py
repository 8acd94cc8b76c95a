"""Section of the page about an optimum: what to choose, how much better it is, how flat; picture and table."""

from __future__ import annotations

import math

from nonlinear.peak_curves.optimum_result import KINDS
from pipeline.results.worst import motion_said, sentence, truncation_mark, with_unit
from pipeline.scene.labels import quantity, value_label
from pipeline.studies.optimum.figure import elasticities_of, has_lines
from pipeline.studies.optimum.result import ALIKE, OptimumResult
from pipeline.studies.registry import StudySection

CAPTION = (
    "Height and frequency of the worst motion over the parameter. Thin: followed peaks, dashed where "
    "they are unstable. Dotted: the search left open what the ring does there, the highest solution counts. Circles: "
    "responses solved with all options; triangles: counted by the highest solution. Shaded: at most 10 % higher than "
    "at the optimum. Bars: change of the worst motion in % where a parameter grows by 1 %."
)
WITHIN = (
    "Height of the worst motion over the parameter (circles: curves solved; triangles: counted by the highest "
    "solution), and the highest within the tolerance around each value (thick). Shaded: the tolerance around the "
    "optimum."
)
LINES = (
    "Left: every curve of the search by the height of its worst motion, a line for each value tried of one key, with "
    "its best value of the other and the tolerance around that. Right: the height of each, the highest within the "
    "tolerance, and its place."
)
SEARCHED = (
    "Every curve of the search by the height of its worst motion; rings: the best of each value tried, whose height "
    "stands below."
)
TRIED = "Height of the worst motion with the values tried, over each of the keys."
HEADINGS = ("key", "optimum", "scene", "range searched", "at most 10 % higher", "% for 1 %")
NONE = 5e-4  # % for 1 % that count as none


def optimum_section(result: OptimumResult) -> StudySection:
    """Conclusion, caption and table of an optimum."""
    return StudySection(
        heading="Optimum",
        conclusion=tuple(filter(None, (_choice(result), _sharpness(result), _remarks(result)))),
        caption=_caption(result),
        headings=HEADINGS,
        rows=tuple(_rows(result)),
    )


def _caption(result: OptimumResult) -> str:
    if len(result.ranges) == 2 and result.solved:
        return LINES if has_lines(result) else SEARCHED
    if result.robust is not None and result.robust.key:
        return WITHIN
    return TRIED if result.over_one_key is None else CAPTION


def _choice(result: OptimumResult) -> str:
    """What to choose, and how much better than the scene's own values it is."""
    if result.robust is not None or math.isfinite(result.goal):
        return f"Choose {result.message}."
    chosen = ", ".join(value_label(key, _rounded(value)) for key, value in result.values.items())
    what = f"worst motion ({result.named}) {motion_said(result.amplitude_m, result.frequency_hz)}"
    text = f"Choose {chosen}: {what}{truncation_mark(result.truncation_error)}"
    if not math.isfinite(result.gain):
        return f"{text}."
    own = ", ".join(quantity(key).value(_rounded(value)) for key, value in result.base.values.items())
    if result.gain < ALIKE:
        return f"{text}; the scene's {own} is as good."
    lower = f"{'at least ' * bool(result.base.unresolved)}{_times(result.gain)} lower"
    return f"{text}, {lower} than with the scene's {own} ({with_unit(result.base.amplitude_m)})."


def _times(ratio: float) -> str:
    return f"{ratio:.3g} times" if ratio >= 2.0 else f"{100.0 * (1.0 - 1.0 / ratio):.2g} %"


def _sharpness(result: OptimumResult) -> str:
    """How flat it is."""
    kind = KINDS[result.kind].sentence
    ranges = [f"{_range(key, edges)}" for key, edges in result.within.items() if all(map(math.isfinite, edges))]
    within = f"at most 10 % higher with {', '.join(ranges)}" if ranges else ""
    said = "; ".join(filter(None, (kind, within)))
    return sentence(said) if said else ""


def _remarks(result: OptimumResult) -> str:
    """What was searched and left open."""
    return "".join(f"{remark[:1].upper()}{remark[1:].rstrip('.')}. " for remark in result.remarks).rstrip()


def _range(key: str, edges: tuple[float, float]) -> str:
    named = quantity(key)
    low, high = (f"{edge * named.factor:.4g}" for edge in edges)
    return f"{named.symbol} from {low} to {high} {named.unit}".rstrip()


def _rows(result: OptimumResult) -> list[tuple[str, ...]]:
    """The keys that were varied, then the other parameters by the size of their influence."""
    influence = elasticities_of(result)
    rows: list[tuple[str, ...]] = []
    for key, value in result.values.items():
        own = quantity(key).value(_rounded(result.base.values[key])) if key in result.base.values else "-"
        searched, within = (_edges(key, table.get(key)) for table in (result.ranges, result.within))
        rows.append(
            (key, quantity(key).value(_rounded(value)), own, searched, within, _size(influence.pop(key, None)))
        )
    others = sorted(influence.items(), key=lambda item: -abs(item[1]))
    return rows + [(key, "-", "-", "-", "-", _size(size)) for key, size in others]


def _edges(key: str, edges: tuple[float, float] | None) -> str:
    if edges is None or not all(map(math.isfinite, edges)):
        return "-"
    named = quantity(key)
    return f"{edges[0] * named.factor:.4g} to {edges[1] * named.factor:.4g} {named.unit}".rstrip()


def _size(elasticity: float | None) -> str:
    if elasticity is None or not math.isfinite(elasticity):
        return "-"
    return "0" if abs(elasticity) < NONE else f"{elasticity:+.3f}".replace("-", "\u2212")


def _rounded(value: float) -> float:
    return float(f"{value:.4g}")
