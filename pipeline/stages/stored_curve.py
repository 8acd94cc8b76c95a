"""A stored curve read back as a `ResponseCurve`, and stored again with further branches."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pipeline.stages.codec import restored
from pipeline.stages.curve_file import BRANCHES, COLUMNS, OUTPUT, write_branch
from pipeline.stages.curve_summary import read_summary, stored_peak, stored_static, stored_worst, summary_attributes
from pipeline.store.fingerprints import content_fingerprint

if TYPE_CHECKING:
    import h5py

    from nonlinear import ResponseCurve

# Attributes of `ResponseCurve` that its summary has under the same names.
IN_SUMMARY = (
    "seconds",
    "harmonics",
    "origin",
    "free_nodes",
    "truncation_error",
    "truncation_branch",
    "truncation_frequency_hz",
    "motion_truncation_error",
    "sampling_error",
    "sampling_frequency_error",
)
ADDED = "added"  # attribute of a branch: whether it is new in this file, and not in the one that the file extends
# What further branches change in the summary of a curve; everything else speaks of the main branch.
_CHANGED = ("detached", "outputs", "branches_left_out", "worst_", "seconds")


def read_curve(path: Path) -> ResponseCurve:
    """A curve with its detached branches, from a file that `write_curve` or `write_extended` wrote.

    The bounds over residual tractions are left out.
    """
    from dataclasses import replace

    import h5py

    with h5py.File(path, "r") as file:
        facts, branches = read_summary(file), tuple(_read(group) for group in branch_groups(file))
        worst, static = stored_worst(facts), stored_static(facts)
        return replace(_read(file), worst=worst, static_contact=static, detached=branches)


def read_added(path: Path) -> ResponseCurve:
    """The branches that are new in a file, as a curve of their own: of a curve that was solved all, of an extended
    one those that were added.
    """
    from dataclasses import replace

    import h5py

    with h5py.File(path, "r") as file:
        added = [_read(group) for group in branch_groups(file) if group.attrs.get(ADDED, False)]
    return replace(added[0], detached=tuple(added[1:])) if added else read_curve(path)


def branch_mark(frequency_hz: NDArray[np.float64]) -> str:
    """A mark by which a branch is known again in every file that holds it: a hash of its frequencies (P,), Hz."""
    return content_fingerprint(np.ascontiguousarray(frequency_hz).tobytes())


def branch_groups(file: h5py.Group) -> list[h5py.Group]:
    """The groups of the detached branches of a curve, in their order."""
    return [file[f"{BRANCHES}/{number}"] for number in sorted(file.get(BRANCHES, ()), key=int)]


def write_extended(path: Path, base: Path, before: ResponseCurve, after: ResponseCurve) -> None:
    """Write the file of a curve that has got further branches; all that speaks of the main branch is copied."""
    import h5py

    from rom import new_hdf5

    changed = {key: value for key, value in summary_attributes(after).items() if key.startswith(_CHANGED)}
    with new_hdf5(path) as file, h5py.File(base, "r") as source:
        _copy_main(source, file, changed)
        old = list(zip(before.detached, branch_groups(source), strict=True))
        for number, branch in enumerate(after.detached, start=1):
            name = f"{BRANCHES}/{number}"
            group = next((group for known, group in old if _is_same(known, branch)), None)
            if group is None:
                write_branch(file.create_group(name), branch)
            else:
                source.copy(group, file, name)
            file[name].attrs[ADDED] = group is None


def _copy_main(source: h5py.File, target: h5py.File, changed: Mapping[str, Any]) -> None:
    for name in source:
        if name != BRANCHES:
            source.copy(name, target)
    for key, value in [*source.attrs.items(), *changed.items()]:
        target.attrs[key] = value
    target.create_group(BRANCHES)


def _is_same(one: ResponseCurve, other: ResponseCurve) -> bool:
    """Whether two branches are one and the same, to the last digit."""
    return one is other or np.array_equal(one.frequency_hz, other.frequency_hz)


def _read(group: h5py.Group) -> ResponseCurve:
    """One branch, without those beside it."""
    from nonlinear import Bifurcation, Peak, ResponseCurve, TerminationReason

    facts = read_summary(group)
    values = {attribute: group[column][()] for column, attribute in COLUMNS.items() if column in group}
    for name in ("relative_displacement", "contact_force", "output", "energy_error"):
        values[name] = group[name][()]
    ended: Any = facts.termination
    columns = [group[f"harmonic_{h + 1}_m"][()] for h in range(facts.harmonics)]
    values["harmonic_m"] = np.column_stack(columns) if columns else np.empty((values["frequency_hz"].size, 0))
    return ResponseCurve(
        **values,
        **{name: getattr(facts, name) for name in IN_SUMMARY},
        termination=TerminationReason(ended, facts.termination_hz, facts.reason),
        peak=stored_peak(facts),
        peaks=restored(tuple[Peak, ...], facts.peaks),
        bifurcations=restored(tuple[Bifurcation, ...], facts.bifurcations),
        branches_left_out=int(group.attrs["branches_left_out"]),
        outputs={
            name.removeprefix(OUTPUT): values[()].reshape(*values.shape[:2], -1)
            for name, values in group.items()
            if name.startswith(OUTPUT)
        },
    )
