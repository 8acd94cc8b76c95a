"""What the drawing process is told, as JSON on its command line."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass


@dataclass(frozen=True)
class RenderJob:
    """Files, modes and springs of one set of pictures; `phase` in rad, springs in N/m for each contact node."""

    sector: str
    rom: str
    folder: str
    prefix: str
    title: str
    modes: tuple[int, ...]
    deformation: float
    contact: str
    blades: int
    phase: float
    normal: tuple[float, ...]
    tangential: tuple[float, ...]

    def to_json(self) -> str:
        """One line."""
        return json.dumps(asdict(self))

    @classmethod
    def from_json(cls, text: str) -> RenderJob:
        """The job that `to_json` wrote."""
        values = json.loads(text)
        for name in ("modes", "normal", "tangential"):
            values[name] = tuple(values[name])
        return cls(**values)


@dataclass(frozen=True)
class OperatingJob:
    """Files of one curve and how its operating deflection shape is drawn: `<name>.png` and `<name>.gif` in `folder`.

    deformation: largest drawn displacement, m; blades: neighbours side by side; frames: of the animation, one period.
    """

    sector: str
    rom: str
    curve: str
    folder: str
    name: str
    title: str
    deformation: float
    blades: int
    frames: int

    def to_json(self) -> str:
        """One line."""
        return json.dumps(asdict(self))

    @classmethod
    def from_json(cls, text: str) -> OperatingJob:
        """The job that `to_json` wrote."""
        return cls(**json.loads(text))
