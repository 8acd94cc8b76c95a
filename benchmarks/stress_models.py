"""The blade of a scene at the shroud angles of the matrix, reduced once and kept."""

from __future__ import annotations

import sys
from collections.abc import Iterable
from pathlib import Path

from pipeline.process.progress import Reporter
from pipeline.scene.reading import read_scene
from pipeline.scene.schema import Scene
from pipeline.stages.cache_keys import model_keys
from pipeline.stages.model_chain import ModelChain
from pipeline.stages.stage_log import StageLog
from pipeline.store.content_store import Store


def reduced_models(scene_file: Path, angles: Iterable[float], store: Path) -> dict[float, Path]:
    """Shroud angle (degrees) -> file of the reduced model, made where `store` does not hold it yet.

    Raises
    ------
    InputError : the scene cannot be read. StageError : the profile does not fit at an angle.
    """
    scene = read_scene(scene_file).first
    chain = ModelChain(Store(store), StageLog(), Reporter(stream=sys.stderr))
    models = {}
    for angle in sorted(set(angles)):
        turned = _at_angle(scene, angle)
        models[angle] = chain.reduced_model(turned, model_keys(turned)).rom
    return models


def _at_angle(scene: Scene, angle: float) -> Scene:
    assert scene.shroud is not None
    return scene.model_copy(update={"shroud": scene.shroud.model_copy(update={"angle": angle})})
