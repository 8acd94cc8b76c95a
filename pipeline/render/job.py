"""Jobs of the drawing process, given to it as JSON on its command line."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from typing import Self


@dataclass(frozen=True)
class Job:
    """What the drawing process draws."""

    def to_json(self) -> str:
        """The job on one line."""
        return json.dumps(asdict(self))

    @classmethod
    def from_json(cls, text: str) -> Self:
        """The job that `to_json` wrote."""
        return cls(**{key: tuple(v) if isinstance(v, list) else v for key, v in json.loads(text).items()})


@dataclass(frozen=True)
class RenderJob(Job):
    """Mode shapes of one reduced model.

    Attributes
    ----------
    sector, rom : str
        Files of the mesh and of the reduced model.
    folder, prefix : str
        Pictures are `<prefix>mode_<number>.png` in `folder`.
    title : str
        First part of the heading.
    modes : tuple of int
        Mode numbers, from 1.
    deformation : float
        Largest drawn displacement, m.
    contact : str
        State of the shrouds: free, sliding or stuck.
    blades : int
        Blades drawn side by side.
    phase : float
        Inter-blade phase angle, rad.
    normal, tangential : tuple of float
        Contact springs of each node, N/m.
    stuck_normal, stuck_tangential : tuple of float
        Those of stuck shrouds, whose modes are drawn too; empty where they are not.
    """

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
    stuck_normal: tuple[float, ...] = ()
    stuck_tangential: tuple[float, ...] = ()


@dataclass(frozen=True)
class OperatingJob(Job):
    """The operating deflection shape of one curve: `<name>.png` and `<name>.gif` in `folder`.

    Attributes
    ----------
    sector, rom, curve : str
        Files of the mesh, of the reduced model and of the curve.
    folder, name : str
        Folder and base name of the pictures.
    title : str
        Heading.
    deformation : float
        Largest drawn displacement, m.
    blades : int
        Blades drawn side by side.
    frames : int
        Frames of the animation, one period.
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
