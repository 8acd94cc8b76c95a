"""Change of the natural frequencies by the Coriolis forces, which the response leaves out, cached in the store."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

from pipeline.stages.cache_keys import linear_operation_inputs
from pipeline.stages.code_fingerprint import code_fingerprint
from pipeline.stages.scene_to_solver import linear_operation_on_model
from pipeline.store.fingerprints import fingerprint

if TYPE_CHECKING:
    from pipeline.scene.schema import Scene
    from pipeline.stages.model_chain import BuiltModel
    from pipeline.store.content_store import Store

FILE = "coriolis_error.json"


def stored_coriolis_error(store: Store, model: BuiltModel, scene: Scene) -> float | None:
    """Largest relative change of a natural frequency in the range by the Coriolis forces; 0 at rest, None: not known.

    It is not known for a model from elsewhere without its Coriolis matrix.
    """
    if scene.load.speed_rpm == 0.0:
        return 0.0
    key = fingerprint({"reduce": model.key, **linear_operation_inputs(scene), "code": code_fingerprint(__name__)})
    entry = store.get("coriolis-error", key, lambda folder: _write(folder / FILE, model.rom, scene))
    value: float | None = json.loads(entry.file(FILE).read_text())
    return value


def _write(path: Path, rom: Path, scene: Scene) -> None:
    from rom import coriolis_error, read_reduced_model

    model = read_reduced_model(rom, with_basis=False)
    path.write_text(json.dumps(coriolis_error(model, linear_operation_on_model(scene, model))))
