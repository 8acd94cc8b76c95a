"""The section of the page about mistuned rings."""

from __future__ import annotations

from pipeline.results.worst import sentence, with_unit
from pipeline.studies.mistuning.result import MistuningResult
from pipeline.studies.mistuning.study import headline, remarks
from pipeline.studies.registry import StudySection

MOST_ROWS = 40
HEADINGS = ("ring (seed)", "amplification factor", "highest amplitude", "frequency [Hz]", "blade", "points")
CAPTION = (
    "Mistuned rings: tuned curve and largest amplitude of any blade of the ring with the highest peak; amplitudes of "
    "its blades at the peak, beside them the deviations of their frequencies; distribution of the amplification "
    "factor. The dashed line is Whitehead's bound of a linear ring."
)


def mistuning_section(result: MistuningResult) -> StudySection:
    """The amplification of the tuned response, and the highest rings in a table."""
    ordered = sorted(result.rings, key=lambda ring: -ring.factor if ring.factor == ring.factor else 0.0)
    rows = tuple(
        (
            str(ring.seed),
            f"{ring.factor:.4g}",
            with_unit(ring.amplitude_m),
            f"{ring.frequency_hz:.5g}",
            str(ring.blade),
            f"{ring.points}" + ("" if ring.complete else ", not complete"),
        )
        for ring in ordered[:MOST_ROWS]
    )
    said = (headline(result), *remarks(result))
    left = len(ordered) - len(rows)
    more = (f"{left} more rings are in mistuning.json.",) if left else ()
    return StudySection("Mistuned ring", (*(sentence(line) for line in said), *more), CAPTION, HEADINGS, rows)
