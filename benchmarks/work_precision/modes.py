"""Modes kept: error of the reduced model against the full one on the same mesh, over seconds of the reduction."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from pipeline.scene.reading import read_scene
from pipeline.stages.linear_operation import linear_operation
from work_precision.stages import BuiltMesh, BuiltModel, built_mesh
from work_precision.study import Measured, Quantity, Study, said
from work_precision.timing import timed

if TYPE_CHECKING:
    from rom import LinearError, ReducedModel

MUCH = 20.0  # how much further than usual the modes of the reference reach
FREE, STUCK = "natural frequencies, free", "natural frequencies, stuck"
CONTACT, OUTPUT = "receptance of the contact nodes", "receptance of the tip"


@dataclass(frozen=True)
class ModesSettings:
    """Numbers of fixed-interface modes, and tolerances of the automatic choice."""

    modes: Sequence[int]
    tolerances: Sequence[float] = ()


USUAL = ModesSettings((2, 5, 10, 20, 30, 40, 60, 80), (1e-2, 1e-3))
FULL = ModesSettings((1, 2, 3, 5, 7, 10, 15, 20, 30, 40, 60, 80, 120, 160), (1e-1, 1e-2, 1e-3, 1e-4))


def modes_study(scene_file: Path, settings: ModesSettings) -> Study:
    """Errors of natural frequencies in the range and of receptances over it, for each number of modes.

    Raises
    ------
    InputError : the scene cannot be read.
    """
    from rom import linear_errors, linear_responses

    scene = read_scene(scene_file).first
    with built_mesh(scene) as mesh:
        operation = linear_operation(scene, mesh.sector())
        exact = linear_responses(_full_reference(mesh, MUCH), operation)
        nearly = linear_errors(
            linear_responses(_full_reference(mesh, 1.0), operation, exact), exact, operation.frequency_hz
        )
        unsure = _errors(nearly)
        rows = []
        for name, key, values in (
            ("number of modes", "rom.modes", settings.modes),
            ('tolerance of "auto"', "rom.tolerance", settings.tolerances),
        ):
            for value in values:
                choice = {key: value} if key == "rom.modes" else {"rom.modes": "auto", key: value}
                made, seconds = timed(lambda choice=choice: mesh.reduced(choice))
                found = linear_errors(linear_responses(made.model(), operation, exact), exact, operation.frequency_hz)
                rows.append(said(_row(name, value, made, seconds, _errors(found))))
    return Study(
        "modes",
        "Modes kept",
        "Seconds of the reduction of the assembled matrices, reading and writing included; largest error of the "
        "natural frequencies in the frequency range and of the receptances over it.",
        "Reference: the full model on the same mesh by its free modes far beyond the range with static answers; "
        f"its uncertainty is what modes that reach {MUCH:g} times less far change.",
        tuple(Quantity(name, unsure[name]) for name in unsure),
        tuple(rows),
        {},
    )


def _full_reference(mesh: BuiltMesh, beyond: float) -> ReducedModel:
    """The full model's answers for `beyond` times the frequency range."""
    from rom import BoundaryChoice, full_reference

    return full_reference(
        mesh.full_model(),
        mesh.sector(),
        beyond * mesh.scene.response.frequency[1],
        BoundaryChoice(
            excitation_direction=mesh.scene.excitation.unit_direction, excitation_at=mesh.scene.excitation.at
        ),
    ).model


def _errors(errors: Sequence[LinearError]) -> dict[str, float]:
    by_condition = {error.condition: error for error in errors}
    free, stuck = by_condition["free"], by_condition.get("stuck", by_condition["free"])
    return {
        FREE: free.frequency,
        STUCK: stuck.frequency,
        CONTACT: max(error.contact for error in errors),
        OUTPUT: max(error.output for error in errors),
    }


def _row(series: str, value: float, made: BuiltModel, seconds: float, errors: dict[str, float]) -> Measured:
    kept = int(made.facts["modes"])
    return Measured(series, f"{value:g}", seconds, errors, {"modes": kept})
