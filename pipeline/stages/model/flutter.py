"""Damping and frequency of all waves in the flow of [aero], with free, sliding and stuck contacts: linear flutter."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from pipeline.codec import plain, restored
from pipeline.stages.cache_keys import modal_inputs, stiffness_inputs
from pipeline.stages.code_fingerprint import code_fingerprint
from pipeline.stages.scene_to_solver import contact_on_model, scene_modes, springs_by_state
from pipeline.store.fingerprints import fingerprint

if TYPE_CHECKING:
    from pipeline.scene.schema import Scene
    from pipeline.stages.model.model_chain import BuiltModel
    from pipeline.store.content_store import Store

KIND, FILE = "flutter", "flutter.json"
MODES = 6  # lowest ones of each wave


@dataclass(frozen=True)
class FlutterWaves:
    """The lowest modes of all waves in one contact state."""

    contact: str  # "free", "sliding" or "stuck"
    frequency_hz: tuple[tuple[float, ...], ...]  # of each mode over the nodal diameters
    damping_ratio: tuple[tuple[float, ...], ...]  # below 0: flutter


@dataclass(frozen=True)
class LinearFlutter:
    """Damping of the waves of one model in the flow."""

    families: tuple[int, ...]  # modes that the flow acts on
    nodal_diameter: tuple[int, ...]  # ascending; above 0 backward waves
    states: tuple[FlutterWaves, ...]

    def least(self) -> Iterator[tuple[int, list[tuple[float, int, float]]]]:
        """Of each mode the least damping ratio in each contact state, with its nodal diameter and frequency, Hz."""
        for mode in range(len(self.states[0].damping_ratio)):
            found = []
            for waves in self.states:
                ratios = waves.damping_ratio[mode]
                place = ratios.index(min(ratios))
                found.append((ratios[place], self.nodal_diameter[place], waves.frequency_hz[mode][place]))
            yield mode + 1, found


def stored_flutter(store: Store, model: BuiltModel, scene: Scene) -> LinearFlutter | None:
    """The flutter of a model, from the store or computed; None without [aero]."""
    if scene.aero is None:
        return None
    material = scene.material.model_dump() if scene.material else None
    parts = {"reduce": model.key, **stiffness_inputs(scene), "material": material, "modal": modal_inputs(scene)}
    key = fingerprint({**parts, "code": code_fingerprint(__name__)})

    def write(folder: Path) -> None:
        text = json.dumps(plain(linear_flutter(model.rom, scene)))
        (folder / FILE).write_text(text, encoding="utf-8")

    values = json.loads(store.get(KIND, key, write).file(FILE).read_text(encoding="utf-8"))
    found: LinearFlutter = restored(LinearFlutter, values)
    return found


def linear_flutter(rom: Path, scene: Scene) -> LinearFlutter | None:
    """Damping and frequency of all waves of a reduced model in the flow of a scene; None without [aero]."""
    if scene.aero is None:
        return None
    import numpy as np

    from rom.cyclic.natural_frequencies import aeroelastic_modes
    from rom.files.reduced_model_file import read_reduced_model
    from rom.linear_algebra.threads import one_blas_thread

    model = read_reduced_model(rom, with_basis=False)
    blades, count = model.n_blades or 1, min(MODES, model.size)
    diameters = range(-((blades - 1) // 2), blades // 2 + 1)
    states = []
    with one_blas_thread():
        modal = scene_modes(scene, model)
        model = model if modal.turns else replace(model, coriolis=None)
        for name, springs in springs_by_state(contact_on_model(scene, model)).items():
            values = np.array([aeroelastic_modes(model, modal, n, count=count, **springs) for n in diameters])
            hertz, ratio = values.imag.T / (2.0 * np.pi), (-values.real / np.abs(values)).T
            states.append(FlutterWaves(name, *(tuple(map(tuple, each.tolist())) for each in (hertz, ratio))))
    return LinearFlutter(tuple(each.mode for each in modal.influence), tuple(diameters), tuple(states))
