"""One response curve to solve in different ways: the problem, and how its peak is compared."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pipeline.scene.reading import read_scene
from pipeline.scene.schema import Scene
from pipeline.stages.scene_to_solver import contact_on_model, damped_modes
from work_precision.stages import kept_model, with_values
from work_precision.study import relative_error

if TYPE_CHECKING:
    from nonlinear import ContactParameters, Excitation, ResponseCurve, SolverOptions
    from rom import ModalModel

PEAK, FREQUENCY = "peak amplitude", "peak frequency"


@dataclass(frozen=True)
class CurveCase:
    """A scene at one interference, m, and the name of its line in a figure."""

    scene: Path
    interference: float
    label: str


@dataclass(frozen=True)
class CurveProblem:
    """What `forced_response` takes. The options leave out what comes beside the curve itself: Floquet exponents,
    detached branches and the estimate of the harmonics left out."""

    modal: ModalModel
    contact: ContactParameters
    excitation: Excitation
    options: SolverOptions

    def solve(self, **changes: Any) -> ResponseCurve:
        """The curve with other solver options."""
        from nonlinear import forced_response

        return forced_response(self.modal, self.contact, self.excitation, replace(self.options, **changes))


def curve_problem(case: CurveCase, store: Path) -> CurveProblem:
    """The problem of a case on the reduced model of its scene.

    Raises
    ------
    InputError : the scene cannot be read.
    """
    scene = with_values(read_scene(case.scene).first, {"contact.interference": case.interference})
    return problem_on(kept_model(store, scene), scene)


def problem_on(file: Path, scene: Scene) -> CurveProblem:
    """The problem of a scene on a given reduced model."""
    from nonlinear import Excitation, SolverOptions
    from rom import read_reduced_model

    model = read_reduced_model(file, with_basis=False)
    contact = contact_on_model(scene, model)
    excitation = Excitation(scene.excitation.engine_order, scene.excitation.force)
    options = SolverOptions(scene.response.frequency, stability="folds", detached=False, truncation=False)
    return CurveProblem(damped_modes(model, scene.response, scene.load), contact, excitation, options)


def peak_errors(found: ResponseCurve, reference: ResponseCurve) -> dict[str, float]:
    """Relative errors of the highest peak: of its amplitude and of its frequency, inf where there is no curve."""
    if found.peak is None or reference.peak is None:
        return {PEAK: float("inf"), FREQUENCY: float("inf")}
    return {
        PEAK: relative_error(found.peak.amplitude_m, reference.peak.amplitude_m),
        FREQUENCY: relative_error(found.peak.frequency_hz, reference.peak.frequency_hz),
    }


def ending(curve: ResponseCurve) -> str:
    """A note for a curve that is not complete."""
    return "" if curve.termination.complete else "incomplete"
