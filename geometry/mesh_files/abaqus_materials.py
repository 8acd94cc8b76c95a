"""Materials of Abaqus and CalculiX input files."""

from __future__ import annotations

from geometry.errors import MeshFileError
from geometry.mesh_files.abaqus_keywords import KeywordBlock
from geometry.mesh_files.text_files import numbers

NUMBERS = {
    "ELASTIC": ("young_modulus", "poisson_ratio"),
    "DENSITY": ("density",),
    "EXPANSION": ("expansion",),
}
ISOTROPIC = ("", "ISO", "ISOTROPIC")


def materials_of(blocks: list[KeywordBlock]) -> tuple[dict[str, dict[str, float]], list[str]]:
    """Properties by material, and notes on what was left out.

    Parameters
    ----------
    blocks : list of KeywordBlock
        The whole file.

    Raises
    ------
    MeshFileError
        A property has no numbers.
    """
    found: dict[str, dict[str, float]] = {}
    notes: list[str] = []
    current = ""
    for block in blocks:
        if block.keyword == "MATERIAL":
            current = block.needs("NAME")
            found.setdefault(current, {})
        elif block.keyword in NUMBERS and current:
            names = NUMBERS[block.keyword]
            kind = block.parameters.get("TYPE", "").upper()
            if kind not in ISOTROPIC:
                notes.append(f"material {current}: *{block.keyword}, TYPE={kind} left out: only isotropic is read")
                continue
            found[current] |= dict(zip(names, _first_row(block, len(names)), strict=True))
            if len(block.data) > 1:
                notes.append(f"material {current}: *{block.keyword} depends on temperature: the first line is taken")
    return found, notes


def _first_row(block: KeywordBlock, count: int) -> list[float]:
    def refusal(field: str) -> MeshFileError:
        return block.refuse(f"{field.strip()!r}: must be a number")

    fields = [part for part in (block.data[0] if block.data else "").split(",") if part.strip()]
    if len(fields) < count:
        raise block.refuse(f"must have {count} numbers")
    return [float(value) for value in numbers(fields[:count], refusal)]
