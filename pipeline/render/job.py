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
    """Mode shapes of one reduced model."""

    sector: str  # files of the mesh and of the reduced model
    rom: str  # files of the mesh and of the reduced model
    folder: str  # pictures are `<prefix>mode_<number>.png` in `folder`
    prefix: str  # pictures are `<prefix>mode_<number>.png` in `folder`
    title: str  # first part of the heading
    modes: tuple[int, ...]  # mode numbers, from 1
    deformation: float  # largest drawn displacement, m
    contact: str  # state of the shrouds: free, sliding or stuck
    blades: int  # blades drawn side by side
    phase: float  # inter-blade phase angle, rad
    normal: tuple[float, ...]  # contact springs of each node, N/m
    tangential: tuple[float, ...]  # contact springs of each node, N/m
    # those of stuck shrouds, whose modes are drawn too; empty where they are not
    stuck_normal: tuple[float, ...] = ()
    # those of stuck shrouds, whose modes are drawn too; empty where they are not
    stuck_tangential: tuple[float, ...] = ()


@dataclass(frozen=True)
class OperatingJob(Job):
    """The operating deflection shape of one curve: `<name>.png` and `<name>.gif` in `folder`."""

    sector: str  # files of the mesh, of the reduced model and of the curve
    rom: str  # files of the mesh, of the reduced model and of the curve
    curve: str  # files of the mesh, of the reduced model and of the curve
    folder: str  # folder and base name of the pictures
    name: str  # folder and base name of the pictures
    title: str  # heading
    deformation: float  # largest drawn displacement, m
    blades: int  # blades drawn side by side
    frames: int  # frames of the animation, one period
