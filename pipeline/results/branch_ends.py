"""Where a detached branch comes from and where it ends along a sweep, in words."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from pipeline.scene.labels import quantity, value_label


def branch_remarks(branch: Mapping[str, Any]) -> str:
    """Remarks on an entry of `detached` in summary.json, each after a comma: how it was found where it was carried,
    and between which values of swept parameters it ends.
    """
    return "".join(f", {remark}" for remark in _remarks(branch))


def _remarks(branch: Mapping[str, Any]) -> Iterator[str]:
    if branch["origin"].startswith("carried"):
        yield branch["origin"]
    for end in branch["born_between"]:
        key = end["parameter"]
        yield f"ends between {value_label(key, end['exists'])} and {quantity(key).value(end['missing'])}"
