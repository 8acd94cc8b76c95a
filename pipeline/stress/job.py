"""Job of the process that draws the fields of one curve."""

from __future__ import annotations

from dataclasses import dataclass

from pipeline.render.job import Job


@dataclass(frozen=True)
class StressJob(Job):
    """The fields of one VTU file: `<name>.png` in `folder`.

    Attributes
    ----------
    fields : str
        The file.
    folder, name : str
        Folder and base name of the picture.
    title : str
        Heading.
    hot_spots : tuple of (float, float, float)
        Positions that are numbered, m.
    largest_amplitude, largest_mean : float
        Ends of the colours, Pa: largest values outside of singular places.
    required : float
        Required margin; 0 where there are no limits.
    """

    fields: str
    folder: str
    name: str
    title: str
    hot_spots: tuple[tuple[float, float, float], ...]
    largest_amplitude: float
    largest_mean: float
    required: float
