"""What helps before any response is computed: whether stuck shrouds hold the loaded point, which interference closes
the contacts at speed, and a range of it for a sweep.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pipeline.codec import plain, restored
from pipeline.results.closure import ranges_of_closure
from pipeline.results.frequency_range import held_said
from pipeline.scene.dotted_keys import NO_INTERFACE
from pipeline.scene.labels import quantity
from pipeline.stages.cache_keys import contact_inputs, rotation_of_response
from pipeline.stages.code_fingerprint import code_fingerprint
from pipeline.stages.model.modal_truncation import HELD, stored_truncation_error
from pipeline.store.fingerprints import fingerprint

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from nonlinear.contact.parameters import ContactParameters
    from nonlinear.response_curve import StaticContact
    from pipeline.scene.schema import Scene
    from pipeline.stages.model.model_chain import BuiltModel
    from pipeline.store.content_store import Store

KIND, FILE = "contact-advice", "advice.json"
MOST_STEPS = 30  # of the search for the interference that closes a face
FINE = 0.02  # of the way from the first touch, to which that is found
STILL = 1e-9  # m: a static motion of the faces below this opens none
V0 = "contact.interference"


@dataclass(frozen=True)
class Closing:
    """Where a face that is open at speed begins to touch and is closed, v0 or, where nodes differ, what is added."""

    interface: str  # "" where there is one
    touch_m: float
    close_m: float
    added: bool  # whether these are added to the values of the scene


@dataclass(frozen=True)
class ContactAdvice:
    """What helps with the contacts of one scene."""

    held: float | None  # how much less a force moves the output in the first stuck mode than in the free one
    closing: tuple[Closing, ...]
    ranges: Mapping[str, tuple[float, float]]  # of interference by key, m: from faces apart to faces that stick

    def lines(self, scene: Scene) -> list[str]:
        """The same in words, a line each."""
        found = [held_said(self.held)] if held_said(self.held) and not scene.excitation.load else []
        at = f"at {scene.load.speed_rpm:g} rev/min" if scene.load.speed_rpm else "at rest"
        for each in self.closing:
            of = f" of {each.interface}" if each.interface else ""
            touch, close = (quantity(V0).value(_rounded(value)) for value in (each.touch_m, each.close_m))
            verb = "v0 raised by" if each.added else "v0 ="
            found.append(
                f"the contacts{of} are open {at}: they touch with {verb} {touch}, and are closed with {close}"
            )
        for key, limits in self.ranges.items():
            low, high = (quantity(key).value(_rounded(value)) for value in limits)
            found.append(f"{key} from {low} to {high}: from contacts that never touch to contacts that always stick")
        return found


def _rounded(value: float) -> float:
    return float(f"{value:.3g}")


def stored_advice(store: Store, model: BuiltModel, scene: Scene, derived: Any) -> ContactAdvice:
    """The advice in the store, or computed; `derived`: the scene with other values of some keys."""
    held = stored_truncation_error(store, model, scene)[HELD]
    entry = store.get(
        KIND, advice_key(model.key, scene), lambda folder: _write(folder / FILE, model.rom, scene, derived, held)
    )
    return _read(entry.file(FILE))


def known_advice(store: Store, reduced_model: str, scene: Scene) -> ContactAdvice | None:
    """The advice that an earlier run or `shroud modes` has left in the store."""
    entry = store.find(KIND, advice_key(reduced_model, scene))
    return None if entry is None else _read(entry.file(FILE))


def _read(path: Path) -> ContactAdvice:
    found: ContactAdvice = restored(ContactAdvice, json.loads(path.read_text(encoding="utf-8")))
    return found


def advice_key(reduced_model: str, scene: Scene) -> str:
    """What the advice depends on."""
    return fingerprint(
        {
            "reduce": reduced_model,
            **contact_inputs(scene),
            "excitation": scene.excitation.model_dump(),
            "response": scene.response.model_dump(),
            "load": rotation_of_response(scene),
            "material": scene.material.model_dump() if scene.material else None,
            "code": code_fingerprint(__name__),
        }
    )


def _write(path: Path, rom: Path, scene: Scene, derived: Any, held: float | None) -> None:
    from pipeline.stages.scene_to_solver import contact_on_model, scene_modes, solver_options
    from rom.files.reduced_model_file import read_reduced_model
    from rom.linear_algebra.threads import one_blas_thread

    model = read_reduced_model(rom, with_basis=False)
    closing, first = [], 0
    with one_blas_thread():
        modal, contact, options = scene_modes(scene, model), contact_on_model(scene, model), solver_options(scene)

        def at(shift: float, nodes: NDArray[Any]) -> StaticContact:
            from nonlinear.harmonic_balance.initial_solution import static_contact

            changed = contact.interference.copy()
            changed[nodes] += shift
            return static_contact(modal, replace(contact, interference=changed), options, nodes)

        touching = {name: count for name, count in model.interfaces.items() if name != NO_INTERFACE}
        for name, count in touching.items():
            nodes, first = _numbers(first, count), first + count
            found = _closing(name if len(model.interfaces) > 1 else "", contact, nodes, at)
            closing += [found] if found is not None else []
        closes = ranges_of_closure(scene, model, derived) if touching else {}
        ranges = {key: limits for key, limits in closes.items() if V0[8:] in key}
    path.write_text(json.dumps(plain(ContactAdvice(held, tuple(closing), ranges))), encoding="utf-8")


def _numbers(first: int, count: int) -> NDArray[Any]:
    import numpy as np

    return np.arange(first, first + count)


def _closing(name: str, contact: ContactParameters, nodes: NDArray[Any], at: Any) -> Closing | None:
    """The interference that closes a face; None where it is closed, or none closes it."""
    now = at(0.0, nodes)
    if now.open_share == 0.0 or not contact.normal_stiffness[nodes].all() or contact.preload[nodes].any():
        return None
    touch = max(-now.highest_m, 0.0)
    low, high = touch, touch + max(-now.lowest_m - touch, 1e-7)
    for _ in range(MOST_STEPS):
        if at(high, nodes).open_share == 0.0:
            break
        low, high = high, touch + 2.0 * (high - touch)
    else:
        return None
    fine = FINE * (high - touch)
    while high - low > fine:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if at(middle, nodes).open_share == 0.0 else (middle, high)
    given = contact.interference[nodes]
    added = bool((given != given[0]).any())
    if abs(now.highest_m - given.max()) + abs(now.lowest_m - given.min()) < STILL:
        return None  # nothing but v0 opens it
    start = 0.0 if added else float(given[0])
    return Closing(name, start + touch, start + high, added)
