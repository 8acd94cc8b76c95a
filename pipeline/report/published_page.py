"""The page in the output folder: removed as soon as it no longer shows the results beside it."""

from __future__ import annotations

import re
from pathlib import Path

from pipeline.stages.model.sweep_models import Models
from pipeline.stages.request import RunOutcome
from pipeline.store.fingerprints import fingerprint

PAGE = "report.html"
_MARK = re.compile(rb'<meta name="shroud-results" content="([0-9a-f]+)">')
_HEAD = 4096  # bytes at the start of the page that contain the mark


def results_fingerprint(models: Models, outcome: RunOutcome) -> str:
    """Hash of the results: key and parameters of each curve, key of its reduced model, what studies are asked for."""
    keys = {index: model.key for index, model in models.items() if model is not None}
    scene = outcome.curves[0].member.scene if outcome.curves else None
    return fingerprint(
        {
            "studies": {name: getattr(scene, name).model_dump() for name in (scene.studies if scene else ())},
            "curves": [
                [
                    curve.file.parent.name if curve.file else curve.reason,
                    dict(curve.member.parameters),
                    keys.get(curve.member.index),
                ]
                for curve in outcome.curves
            ],
        }
    )


def retire_page(out: Path, results: str) -> bool:
    """Remove the page in `out` if it shows other results; True where it did."""
    page = out / PAGE
    try:
        with page.open("rb") as file:
            mark = _MARK.search(file.read(_HEAD))
    except OSError:
        return False
    if mark is not None and mark.group(1).decode() == results:
        return False
    page.unlink(missing_ok=True)
    return True
