"""Further branches of a curve, found from the branches of its neighbours in a sweep."""

from __future__ import annotations

import json
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from pipeline.process.clock import seconds_since
from pipeline.scene import schema
from pipeline.stages.curve_file import CURVE, section_from_attributes
from pipeline.stages.scene_to_solver import contact_parameters, nonlinear_problem
from pipeline.stages.solve_curve import Progress
from pipeline.stages.stored_curve import read_added, read_curve, write_extended

if TYPE_CHECKING:
    from nonlinear import BranchStart

FACTS = "extension.json"


@dataclass(frozen=True)
class Source:
    """A curve whose branches are carried to a neighbour.

    Attributes
    ----------
    file : Path
        Its file.
    rom : Path
        File of its reduced model.
    label : str
        The parameter in which it differs, with its value there.
    """

    file: Path
    rom: Path
    label: str


def extend_curve(
    folder: Path,
    rom: Path,
    scene: schema.Scene,
    base: Path,
    sources: Sequence[Source],
    progress: Progress | None = None,
) -> None:
    """Look for further branches of a curve, from those of its neighbours, on one BLAS thread.

    Writes `extension.json` with the number of branches added, and where there are any `curve.h5` with all of them.

    Parameters
    ----------
    folder : Path
        Where the files go.
    rom : Path
        File of the reduced model of the curve.
    scene : Scene
        The scene of the curve.
    base : Path
        File of the curve.
    sources : sequence of Source
        Its neighbours.
    progress : callable
        Called with the frequency reached, Hz, and the number of points so far.
    """
    from nonlinear import extend_response, worst_motion
    from rom import one_blas_thread, read_reduced_model

    start = time.perf_counter()
    with one_blas_thread():
        problem = nonlinear_problem(scene, read_reduced_model(rom, with_basis=False))
        before = read_curve(base)
        starts = [found for source in sources for found in _starts(source)]
        after = extend_response(problem, before, starts, progress)
        added = len(after.detached) - len(before.detached)
        if added:
            after = replace(after, worst=worst_motion(*problem, after))
    seconds = seconds_since(start)
    if added:
        write_extended(folder / CURVE, base, before, replace(after, seconds=before.seconds + seconds))
    (folder / FACTS).write_text(json.dumps({"added": added, "seconds": seconds}), encoding="utf-8")


def _starts(source: Source) -> list[BranchStart]:
    """Solutions on the branches of a neighbour that are new in its file, with the parameters that they solve."""
    import h5py

    from nonlinear import Excitation, branch_starts
    from rom import read_reduced_model

    model = read_reduced_model(source.rom, with_basis=False)
    with h5py.File(source.file, "r") as file:
        contact = section_from_attributes(schema.Contact, file.attrs)
        wave = section_from_attributes(schema.Excitation, file.attrs)
    return branch_starts(
        read_added(source.file),
        contact_parameters(contact, model.n_contacts, model.contact_area),
        Excitation(engine_order=wave.engine_order, force=wave.force),
        source.label,
    )
