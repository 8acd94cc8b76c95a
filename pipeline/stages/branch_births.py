"""Where the branches of a sweep are born: between the values of a parameter up to which they exist and do not."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from pipeline.stages.extend_curve import LostBranch
from pipeline.stages.stored_curve import branch_groups, branch_mark
from pipeline.stages.sweep_neighbours import Neighbour

# Parameters that are continued in proportion; others change at once, and the residual that is left goes to zero.
PROPORTIONAL = (
    "contact.interference",
    "contact.friction",
    "contact.preload",
    "contact.normal_stiffness",
    "contact.tangential_stiffness",
    "excitation.force",
)


class Births:
    """Collects where branches end between neighbouring curves."""

    def __init__(self, neighbours: Mapping[str, Sequence[Neighbour]]) -> None:
        self._neighbours = neighbours
        self._found: dict[str, dict[str, list[dict[str, Any]]]] = {}  # by curve and mark of the branch

    def note(self, curve: str, lost: Sequence[LostBranch]) -> None:
        """Note which branches of its neighbours a curve does not have."""
        by_label = {neighbour.label: neighbour for neighbour in self._neighbours[curve]}
        for item in lost:
            neighbour = by_label[item.label]
            end = _followed(neighbour, item.followed)
            entry = {"parameter": neighbour.parameter, "exists": end, "missing": neighbour.here}
            self._found.setdefault(neighbour.curve, {}).setdefault(item.branch, []).append(entry)

    def by_number(self, curve: str, file: Path) -> dict[str, list[dict[str, Any]]]:
        """Where the detached branches in the file of a curve end, by their number.

        Each entry names the parameter, the value up to which the branch was followed (`exists`), and that of the
        neighbour which does not have it (`missing`).
        """
        import h5py

        found = self._found.get(curve)
        if not found:
            return {}
        with h5py.File(file, "r") as source:
            marks = [branch_mark(group["frequency_hz"][()]) for group in branch_groups(source)]
        return {
            str(number): sorted(found[mark], key=lambda entry: (entry["parameter"], repr(entry["missing"])))
            for number, mark in enumerate(marks, start=1)
            if mark in found
        }


def _followed(neighbour: Neighbour, part: float) -> Any:
    """The value of the parameter on the way from the neighbour, at a part of it from 0 to 1."""
    if neighbour.parameter not in PROPORTIONAL:
        return neighbour.there
    if isinstance(neighbour.there, list | tuple):
        pairs = zip(neighbour.there, neighbour.here, strict=True)
        return [there + part * (here - there) for there, here in pairs]
    return neighbour.there + part * (neighbour.here - neighbour.there)
