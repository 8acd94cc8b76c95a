"""The section of the page about a map."""

from __future__ import annotations

from pipeline.results.worst import sentence
from pipeline.scene.labels import quantity
from pipeline.studies.map.result import BasinRange, WorstMotionMap
from pipeline.studies.map.study import conclusion
from pipeline.studies.registry import StudySection

HEADINGS = ("key", "lowest at", "neighbouring values", "10 % higher: this key alone", "both keys")
CAPTION = (
    "Amplitude and frequency of the worst motion. Contours are interpolated between curves that continue each other; "
    "elsewhere each cell has the colour of its curve. Lines lie half-way between curves."
)


def map_section(result: WorstMotionMap) -> StudySection:
    """Where the lowest worst motion lies, how wide its neighbourhood is, and which contact states there are."""
    shares = ", ".join(
        f"{state} {100 * share:.2g} %" for state, share in sorted(result.shares.items(), key=lambda item: -item[1])
    )
    said = [sentence(line) for line in conclusion(result)]
    rows = () if result.basin is None else tuple(_row(each) for each in result.basin.ranges)
    return StudySection(
        heading="Map",
        conclusion=(*said, f"Contact at the worst motion, by area of the map: {shares}."),
        caption=CAPTION,
        headings=HEADINGS if rows else (),
        rows=rows,
    )


def _row(found: BasinRange) -> tuple[str, ...]:
    named = quantity(found.key)

    def between(ends: tuple[float, float]) -> str:
        return f"{named.value(ends[0])} to {named.value(ends[1])}"

    together = between(found.together) + (" (edge of the map)" if any(found.at_edge) else "")
    return named.symbol, named.value(found.value), between(found.bracket), between(found.alone), together
