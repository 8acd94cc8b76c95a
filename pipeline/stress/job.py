"""Job of the process that draws the fields of one curve."""

from __future__ import annotations

from dataclasses import dataclass

from pipeline.render.drawing_process import Job

MARGINS = 4.0  # ends of the colours of margins: this many times the required factor, and its inverse times it
COLOURS = "RdYlBu"  # red below the required factor, which is in the middle, blue above


@dataclass(frozen=True)
class StressJob(Job):
    """The fields of one VTU file: `<name>.png` in `folder`."""

    fields: str  # the file
    # `folder`, `name`: folder and base name of the picture
    folder: str
    name: str
    title: str  # heading
    hot_spots: tuple[tuple[float, float, float], ...]  # positions that are numbered, m
    # `largest_amplitude`, `largest_mean`: ends of the colours, Pa: largest values outside of singular places
    largest_amplitude: float
    largest_mean: float
    required: float  # required margin; 0 where there are no limits
