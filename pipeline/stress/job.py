"""Job of the process that draws the fields of one curve."""

from __future__ import annotations

from dataclasses import dataclass

from pipeline.render.drawing_process import Job


@dataclass(frozen=True)
class StressJob(Job):
    """The fields of one VTU file: `<name>.png` in `folder`."""

    fields: str  # the file
    folder: str  # folder and base name of the picture
    name: str  # folder and base name of the picture
    title: str  # heading
    hot_spots: tuple[tuple[float, float, float], ...]  # positions that are numbered, m
    largest_amplitude: float  # ends of the colours, Pa: largest values outside of singular places
    largest_mean: float  # ends of the colours, Pa: largest values outside of singular places
    required: float  # required margin; 0 where there are no limits
