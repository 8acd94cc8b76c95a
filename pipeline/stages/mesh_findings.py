"""What was found in the mesh file of a scene, kept beside its mesh; sizes of a mesh."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from geometry import SectorMesh

FINDINGS = "own_mesh.json"


def own_findings(folder: Path) -> dict[str, Any]:
    """What `write_findings` has written; empty for a mesh that was made here."""
    path = folder / FINDINGS
    found: dict[str, Any] = json.loads(path.read_text(encoding="utf-8")) if path.is_file() else {}
    return found


def elements_by_kind(sector: SectorMesh) -> dict[str, int]:
    """Number of elements of each kind."""
    counts: dict[str, int] = {}
    for block in sector.blocks:
        counts[block.kind] = counts.get(block.kind, 0) + len(block)
    return counts


def extent(sector: SectorMesh) -> dict[str, float]:
    """Radii of hub and tip, bounds along the axes, and the mean size of an element, m."""
    import numpy as np

    radius = np.hypot(sector.points[:, 1], sector.points[:, 2])
    low, high = sector.points.min(axis=0), sector.points.max(axis=0)
    return {
        "hub_radius": float(radius.min()),
        "tip_radius": float(radius.max()),
        "size": mean_size(sector),
        **{f"{axis}_low": float(low[k]) for k, axis in enumerate("xyz")},
        **{f"{axis}_high": float(high[k]) for k, axis in enumerate("xyz")},
    }


def mean_size(sector: SectorMesh) -> float:
    """Mean length of the edges between the corners of the elements, m."""
    import numpy as np

    lengths = [
        np.linalg.norm(sector.points[block.nodes[:, b]] - sector.points[block.nodes[:, a]], axis=1)
        for block in sector.blocks
        for a, b in block.topology.edges
    ]
    return float(np.concatenate(lengths).mean())
