"""The stages that a user waits for, one after another and timed, by the functions that `shroud run` calls."""

from __future__ import annotations

import json
import shutil
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pipeline.scene.schema import Scene
from pipeline.stages.build_full_model import FULL_MODEL, make_full_model
from pipeline.stages.build_mesh import SECTOR, make_mesh
from pipeline.stages.build_reduced_model import FACTS, REDUCED_MODEL, make_reduced_model
from pipeline.stages.cache_keys import model_keys
from pipeline.store.content_store import Store

if TYPE_CHECKING:
    from geometry import SectorMesh
    from rom import FullModel, ReducedModel


def with_values(scene: Scene, values: Mapping[str, Any]) -> Scene:
    """A scene with other values of dotted keys, which are taken as they are."""
    for key, value in values.items():
        section, name = key.split(".")
        changed = getattr(scene, section).model_copy(update={name: value})
        scene = scene.model_copy(update={section: changed})
    return scene


@dataclass(frozen=True)
class BuiltMesh:
    """Mesh and full model in a folder, and what they took: seconds of meshing and assembling, files included."""

    folder: Path
    scene: Scene
    seconds: float

    def sector(self) -> SectorMesh:
        """The mesh."""
        from rom import load_sector

        return load_sector(self.folder / SECTOR)

    def full_model(self) -> FullModel:
        """The assembled matrices."""
        from rom import load_full_model

        return load_full_model(self.folder / FULL_MODEL)

    def reduced(self, values: Mapping[str, Any]) -> BuiltModel:
        """The reduced model with other values of dotted keys."""
        scene = with_values(self.scene, values)
        start = time.perf_counter()
        make_reduced_model(self.folder, self.folder / SECTOR, self.folder / FULL_MODEL, scene)
        seconds = time.perf_counter() - start
        facts = json.loads((self.folder / FACTS).read_text(encoding="utf-8"))
        return BuiltModel(self.folder / REDUCED_MODEL, scene, seconds, facts)


@dataclass(frozen=True)
class BuiltModel:
    """A reduced model in a file (until the next one in the same folder), seconds of its reduction, and its sizes."""

    file: Path
    scene: Scene
    seconds: float
    facts: Mapping[str, Any]

    def model(self) -> ReducedModel:
        """The reduced model, without its basis."""
        from rom import read_reduced_model

        return read_reduced_model(self.file, with_basis=False)


@contextmanager
def built_mesh(scene: Scene) -> Iterator[BuiltMesh]:
    """Mesh and full model of a scene in a folder that is gone afterwards."""
    with tempfile.TemporaryDirectory(prefix="shroud-bench-") as name:
        folder = Path(name)
        start = time.perf_counter()
        make_mesh(folder, scene)
        make_full_model(folder, folder / SECTOR, scene)
        yield BuiltMesh(folder, scene, time.perf_counter() - start)


def kept_model(store: Path, scene: Scene) -> Path:
    """File of a scene's reduced model without its basis; made where `store` does not hold it yet.

    For references, which take long and are not timed.
    """
    from rom import write_reduced_model

    def build(folder: Path) -> None:
        with built_mesh(scene) as mesh:
            made = mesh.reduced({})
            write_reduced_model(folder / REDUCED_MODEL, made.model())
            shutil.copyfile(mesh.folder / FACTS, folder / FACTS)

    key = model_keys(scene).reduce
    return Store(store).get("reference", key, build).file(REDUCED_MODEL)


def extrapolated(sizes: Sequence[float], values: Sequence[float], order: float) -> tuple[float, float]:
    """Limit for vanishing element size and its relative uncertainty, from three sizes or more.

    Least squares of limit + c size^order: a mesh changes in steps with its size, so that Richardson's extrapolation
    of two neighbours is at the mercy of where those steps lie. The uncertainty is the largest change of the limit
    when one of the sizes is left out.
    """
    import numpy as np

    terms = np.column_stack([np.ones(len(sizes)), np.asarray(sizes, dtype=float) ** order])
    found = np.asarray(values, dtype=float)

    def limit(rows: list[int]) -> float:
        return float(np.linalg.lstsq(terms[rows], found[rows])[0][0])

    every = list(range(len(sizes)))
    best = limit(every)
    return best, max(abs(limit([row for row in every if row != left_out]) / best - 1.0) for left_out in every)
