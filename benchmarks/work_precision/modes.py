"""Fixed-interface modes: error of the reduced model against the full one on the same mesh, over seconds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from problems import BuiltMesh, built_mesh, scene_with

from pipeline.stages.scene_to_solver import linear_operation
from work_precision.study import Measured, Study, announced, timed

if TYPE_CHECKING:
    from rom import ReducedModel
    from rom.reduction.model_comparison import LinearOperation, LinearResponse

BEYOND = 20.0  # highest mode of the reference over that of the usual one
FREE, STUCK = "natural frequencies, free", "natural frequencies, stuck"
CONTACT, OUTPUT = "receptance of the contact nodes", "receptance of the tip"


@dataclass(frozen=True)
class ModesSettings:
    """Numbers of fixed-interface modes, and tolerances of "auto"."""

    modes: Sequence[int]
    tolerances: Sequence[float] = ()


DEFAULT = ModesSettings((2, 5, 10, 20, 30, 40, 60, 80), (1e-2, 1e-3))


def modes_study(scene_file: Path, settings: ModesSettings) -> Study:
    """Errors of natural frequencies in the range and of receptances over it, for each number of modes."""
    from rom.reduction.model_comparison import linear_responses

    rows = []
    with built_mesh(scene_with(scene_file, {})) as mesh:
        operation = linear_operation(mesh.scene, mesh.sector())
        exact = linear_responses(_full_reference(mesh, BEYOND), operation)
        uncertainty = _errors(_full_reference(mesh, 1.0), operation, exact)
        choices = [("number of modes", f"{number}", {"rom.modes": number}) for number in settings.modes]
        for tolerance in settings.tolerances:
            values = {"rom.modes": "auto", "rom.tolerance": tolerance}
            choices.append(('tolerance of "auto"', f"{tolerance:g}", values))
        for series, setting, values in choices:
            made, seconds = timed(lambda values=values: mesh.reduced(values))
            errors, counts = _errors(made.model(), operation, exact), {"modes": int(made.facts["modes"])}
            rows.append(announced(Measured(series, setting, seconds, errors, counts)))
    return Study(
        "modes",
        "Fixed-interface modes",
        "Seconds of the reduction of the assembled matrices, reading and writing included; largest error of the "
        "natural frequencies in the frequency range and of the receptances over it.",
        "Reference: the full model on the same mesh, represented by its free modes far beyond the range and static "
        f"responses; its uncertainty is the change when the highest mode lies {BEYOND:g} times lower.",
        uncertainty,
        tuple(rows),
    )


def _full_reference(mesh: BuiltMesh, beyond: float) -> ReducedModel:
    """A model of the full one's responses, good up to `beyond` times the frequency range."""
    from rom import BoundaryChoice
    from rom.reduction.reference_model import full_reference

    highest, excitation = beyond * mesh.scene.response.frequency[1], mesh.scene.excitation
    return full_reference(
        mesh.full_model(),
        mesh.sector(),
        highest,
        BoundaryChoice(excitation.unit_direction, excitation.at),
    ).model


def _errors(model: ReducedModel, operation: LinearOperation, exact: Sequence[LinearResponse]) -> dict[str, float]:
    from rom.reduction.model_comparison import linear_errors, linear_responses

    errors = linear_errors(linear_responses(model, operation, exact), exact, operation.frequency_hz)
    by_condition = {error.condition: error for error in errors}
    return {
        FREE: by_condition["free"].frequency,
        STUCK: by_condition.get("stuck", by_condition["free"]).frequency,
        CONTACT: max(error.contact for error in errors),
        OUTPUT: max(error.output for error in errors),
    }
