"""What is known of a scene before its response: natural frequencies of its waves, crossings, static contact.

Frequencies with free and with stuck shrouds enclose those of any linear springs between (Rayleigh). The frequency
range that is proposed holds both of the modes that the force excites in the present range, or of the first one.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pipeline.errors import reason_of
from pipeline.results.frequency_range import proposed_range, stored_resonances
from pipeline.scene.labels import member_label
from pipeline.stages.code_fingerprint import code_fingerprint
from pipeline.stages.codec import plain
from pipeline.stages.engine_orders import excited_orders
from pipeline.stages.natural_frequencies import stored_frequencies
from pipeline.store.disk_errors import StorageError
from pipeline.store.fingerprints import fingerprint

if TYPE_CHECKING:
    from pipeline.scene.reading import Member
    from pipeline.scene.schema import Scene
    from pipeline.stages.model_chain import BuiltModel
    from pipeline.stages.request import Run
    from pipeline.stages.sweep_models import Models
    from pipeline.store.content_store import Store

STATES = ("free", "sliding", "stuck")
MOST = 40  # members of a sweep whose static contact is computed, evenly spread
KIND, FILE = "static-contact", "static.json"


@dataclass(frozen=True)
class NamedMode:
    """One mode of a wave with free, sliding and stuck shrouds."""

    number: int  # from 1, by ascending frequency
    frequency_hz: tuple[float, float, float]
    names: tuple[str, str, str]  # by shape; "" where shapes are not known
    in_range: bool  # whether a part of free to stuck lies in the frequency range of the response
    speeds_rpm: tuple[float, float] | None  # at which the engine order meets free and stuck; None for order 0
    margin: float | None  # of free to stuck from the excitation frequency, relative to that; None at rest


@dataclass(frozen=True)
class WaveModes:
    """The lowest modes of the wave of one engine order."""

    engine_order: int
    nodal_diameter: int
    wave: str  # "backward", "forward" or "standing"
    range_hz: tuple[float, float]  # frequency range of the response
    excitation_hz: float | None  # EO n / 60 at a steady speed; None at rest
    modes: tuple[NamedMode, ...]


@dataclass(frozen=True)
class StaticCase:
    """Contact of one member of a sweep in static equilibrium at speed, before the excitation acts."""

    label: str  # its swept keys
    force_n: float  # normal force of a face, N
    open_share: float  # share of the face that is open
    lowest_m: float  # smallest and largest v = v0 + d_n of the nodes, m: above 0 pressed together, below 0 a gap
    highest_m: float


@dataclass(frozen=True)
class ModelModes:
    """What is known of one reduced model with one contact stiffness and its engine order."""

    label: str  # swept keys of the first member that has it
    speed_rpm: float
    n_blades: int | None
    waves: tuple[WaveModes, ...]  # of the engine order and its multiples that are excited
    static: tuple[StaticCase, ...]
    proposed_hz: tuple[float, float] | None  # frequency range; None where nothing is excited


def modes_of_scene(run: Run, models: Models, problems: list[str]) -> list[ModelModes]:
    """The modes of the reduced models of a run; what cannot be computed goes to `problems`."""
    members = [member for member in run.request.scene.members if models[member.index] is not None]
    shown = {member.index for member in members[:: max(1, -(-len(members) // MOST))]}
    groups: dict[str, list[Member]] = {}
    for member in members:
        groups.setdefault(_case(member.scene, models[member.index]), []).append(member)
    found = []
    for group in groups.values():
        first, model = group[0], models[group[0].index]
        assert model is not None
        try:
            static = [_static_case(run.store, model, member) for member in group if member.index in shown]
            found.append(_model_modes(run.store, model, first, static))
        except StorageError:
            raise
        except Exception as error:  # the models stand without them
            problems.append(f"modes: {reason_of(error)}")
    return found


def _case(scene: Scene, model: BuiltModel | None) -> str:
    """What the natural frequencies of a member depend on."""
    assert model is not None
    stiffness = [scene.contact.normal_stiffness, scene.contact.tangential_stiffness]
    return fingerprint({"model": model.key, "springs": stiffness, "waves": excited_orders(scene)})


def _model_modes(store: Store, model: BuiltModel, member: Member, static: Sequence[StaticCase]) -> ModelModes:
    scene = member.scene
    values = [
        (order, limits, stored_frequencies(store, model, scene, order)) for order, limits in excited_orders(scene)
    ]
    return ModelModes(
        member_label(member),
        scene.load.speed_rpm,
        values[0][2]["n_blades"],
        tuple(_wave(order, limits, found, scene.load.speed_rpm) for order, limits, found in values),
        tuple(static),
        proposed_range(stored_resonances(store, model.key, scene, model.rom), scene.response.frequency),
    )


def _wave(order: int, limits: tuple[float, float], found: dict[str, Any], speed_rpm: float) -> WaveModes:
    from rom import excited_nodal_diameter, signed_distance, wave_direction

    excitation = order * speed_rpm / 60.0 if order and speed_rpm else None
    modes = []
    unnamed = [""] * len(found["free_hz"])
    hertz = zip(*(found[f"{state}_hz"] for state in STATES), strict=True)
    names = zip(*(found.get(f"{state}_names", unnamed) for state in STATES), strict=True)
    for number, (hz, called) in enumerate(zip(hertz, names, strict=True), start=1):
        inside = hz[0] <= limits[1] and hz[2] >= limits[0]
        speeds = (60.0 * hz[0] / order, 60.0 * hz[2] / order) if order else None
        margin = None if excitation is None else signed_distance((hz[0], hz[2]), (excitation, excitation))
        modes.append(NamedMode(number, hz, called, inside, speeds, margin))
    blades = found["n_blades"]
    where = excited_nodal_diameter(order, blades), wave_direction(order, blades)
    return WaveModes(order, *where, limits, excitation, tuple(modes))


def _static_case(store: Store, model: BuiltModel, member: Member) -> StaticCase:
    """The static contact of a member, from the store or computed."""
    scene = member.scene
    sections = {name: getattr(scene, name).model_dump() for name in ("contact", "load", "response")}
    material = scene.material.model_dump() if scene.material else None
    key = fingerprint({"reduce": model.key, **sections, "material": material, "code": code_fingerprint(__name__)})
    entry = store.get(KIND, key, lambda folder: _write_static(folder / FILE, model.rom, scene))
    return StaticCase(member_label(member), **json.loads(entry.file(FILE).read_text(encoding="utf-8")))


def _write_static(path: Path, rom: Path, scene: Scene) -> None:
    from nonlinear import static_contact
    from pipeline.stages.scene_to_solver import contact_on_model, damped_modes, solver_options
    from rom import one_blas_thread, read_reduced_model

    model = read_reduced_model(rom, with_basis=False)
    with one_blas_thread():
        modal = damped_modes(model, scene.response, scene.load)
        values = plain(static_contact(modal, contact_on_model(scene, model), solver_options(scene)))
    del values["opened"]
    path.write_text(json.dumps(values), encoding="utf-8")
