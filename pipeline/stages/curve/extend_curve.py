"""Further branches of a curve, found from the branches of its neighbours in a sweep."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from pipeline.codec import plain, restored
from pipeline.process.progress import seconds_since
from pipeline.scene import schema
from pipeline.stages.curve.curve_file import (
    CURVE,
    branch_mark,
    contacts_of_curve,
    read_added,
    read_curve,
    section_from_attributes,
    write_extended,
)
from pipeline.stages.curve.curve_summary import keep_summary
from pipeline.stages.curve.solve_curve import Progress
from pipeline.stages.scene_to_solver import contact_parameters, nonlinear_problem, section_excitation

if TYPE_CHECKING:
    from nonlinear.branches.branch_collection import BranchStart
    from nonlinear.response_extension import Extension


FACTS = "extension.json"


@dataclass(frozen=True)
class Source:
    """A curve whose branches are carried to a neighbour."""

    file: Path  # its file
    rom: Path  # file of its reduced model
    label: str  # the parameter in which it differs, with its value there


@dataclass(frozen=True)
class LostBranch:
    """A branch of a neighbour that does not reach the curve."""

    label: str  # label of the neighbour
    branch: str  # mark of the branch, see `branch_mark`
    # part of the way from the neighbour, 0, to the curve, 1, up to which some solution of it was followed, with few
    # harmonics
    followed: float


@dataclass(frozen=True)
class ExtensionFacts:
    """What came of carrying the branches of the neighbours to a curve."""

    added: int  # number of branches added
    lost: tuple[LostBranch, ...]  # branches that do not exist on the curve

    @classmethod
    def read(cls, folder: Path) -> ExtensionFacts:
        """What `extend_curve` has written into a folder."""
        found: ExtensionFacts = restored(cls, json.loads((folder / FACTS).read_text(encoding="utf-8")))
        return found


def extend_curve(
    folder: Path,
    rom: Path,
    scene: schema.Scene,
    base: Path,
    sources: Sequence[Source],
    progress: Progress | None = None,
) -> None:
    """Look for further branches of a curve, from those of its neighbours, on one BLAS thread.

    Writes `extension.json`, see `ExtensionFacts`, and where branches were added `curve.h5` with all of them.
    """
    from nonlinear.response_extension import carry_branches
    from rom.files.reduced_model_file import read_reduced_model
    from rom.linear_algebra.threads import one_blas_thread

    start = time.perf_counter()
    with one_blas_thread():
        problem = nonlinear_problem(scene, read_reduced_model(rom, with_basis=False))
        before = read_curve(base)
        offers = [offer for source in sources for offer in _offers(source)]
        found = carry_branches(problem, before, [item for offer in offers for item in offer.starts], progress)
        after, added = found.curve, len(found.curve.detached) - len(before.detached)
    if added:
        seconds = before.seconds + seconds_since(start)
        write_extended(folder / CURVE, base, before, replace(after, seconds=seconds))
        keep_summary(folder / CURVE)
    facts = ExtensionFacts(added, tuple(_lost(offers, found)))
    (folder / FACTS).write_text(json.dumps(plain(facts)), encoding="utf-8")


@dataclass(frozen=True)
class _Offer:
    """Starts from one branch of a neighbour."""

    label: str
    branch: str
    starts: list[BranchStart]


def _offers(source: Source) -> Iterator[_Offer]:
    """Solutions on the branches of a neighbour that are new in its file, with the parameters that they solve."""
    import h5py

    from nonlinear.branches.branch_collection import branch_starts
    from rom.files.reduced_model_file import read_reduced_model

    model = read_reduced_model(source.rom, with_basis=False)
    with h5py.File(source.file, "r") as file:
        contacts = contacts_of_curve(file)
        wave = section_from_attributes(schema.Excitation, file.attrs)
    contact = contact_parameters(contacts, model.contact_area)
    force = section_excitation(wave)
    curve = read_added(source.file)
    branches = (*curve.detached, curve)
    of_branch: list[list[BranchStart]] = [[] for _ in branches]
    for start in branch_starts(curve, contact, force, source.label):
        of_branch[start.branch].append(start)
    for branch, starts in zip(branches, of_branch, strict=True):
        yield _Offer(source.label, branch_mark(branch.frequency_hz), starts)


def _lost(offers: Sequence[_Offer], found: Extension) -> Iterator[LostBranch]:
    """The branches all starts of which were lost, and how far the best one came."""
    reached = {id(item.start): item.at for item in found.lost}
    for offer in offers:
        if offer.starts and all(id(start) in reached for start in offer.starts):
            yield LostBranch(offer.label, offer.branch, max(reached[id(start)] for start in offer.starts))
