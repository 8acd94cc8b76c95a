"""The optimum over one key of the solver: its peaks are followed, its responses are curves of the scene."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from nonlinear import ContactError, Optimum, find_optimum
from pipeline.scene.key_values import WHOLE_FACE, as_in_scene
from pipeline.scene.optimum_checks import PLACE, SOLVER_KEYS
from pipeline.stages.scene_to_solver import nonlinear_problem
from pipeline.stages.stored_curve import read_curve
from pipeline.studies.study import StudyContext, StudyError

if TYPE_CHECKING:
    from nonlinear import ResponseCurve
    from pipeline.scene.schema import Scene

_DIGITS = 13  # of a value: the mean of equal numbers differs from them by rounding


@dataclass(frozen=True)
class FollowedPeaks:
    """Finds the optimum over one key of the solver, with other values of some keys of the model.

    Attributes
    ----------
    context : StudyContext
        The scene, and what solves its curves.
    key : str
        The key.
    limits : (float, float)
        Its range, in the unit of the scene.
    others : mapping of str to float
        Further keys with their values.
    """

    context: StudyContext
    key: str
    limits: tuple[float, float]
    others: Mapping[str, float]

    def optimum(self) -> Optimum:
        """The optimum, in the units of the solver (`per_unit`); found in the store where it is there.

        Raises
        ------
        StudyError
            A model or a response could not be computed, or no response has a motion that persists.
        """
        member = self.context.member({key: self._given(key, value) for key, value in self.others.items()}, PLACE)
        model = self.context.model_of(member)
        inputs = {"key": self.key, "limits": list(self.limits), "curve": self.context.key_of(member, model)}
        return self.context.stored("optimum", inputs, Optimum, __name__, lambda: self._found(member.scene, model.rom))

    def _found(self, scene: Scene, rom: Any) -> Optimum:
        from rom import read_reduced_model

        model = read_reduced_model(rom, with_basis=False)
        problem = nonlinear_problem(scene, model)
        factor = per_unit(self.key, scene, model.n_contacts)
        name, (low, high) = SOLVER_KEYS[self.key], self.limits
        try:
            return find_optimum(
                problem,
                name,
                low / factor,
                high / factor,
                self.context.progress,
                lambda problems: self._responses(problems, problem, factor),
            )
        except (ArithmeticError, ContactError) as error:
            raise StudyError(str(error)) from None

    def _responses(self, problems: Sequence[Any], base: Any, factor: float) -> list[ResponseCurve]:
        """The responses of some problems, as curves of the scene."""
        members = []
        for problem in problems:
            value = float(f"{_solver_value(problem, base, SOLVER_KEYS[self.key]) * factor:.{_DIGITS}g}")
            values = {key: self._given(key, each) for key, each in {**self.others, self.key: value}.items()}
            if problem[3].harmonics != self.context.scene.response.harmonics:
                values["response.harmonics"] = problem[3].harmonics
            members.append(self.context.member(values, PLACE))
        curves = self.context.curves(members)
        for curve in curves:
            if curve.file is None:
                raise StudyError(curve.reason)
        return [read_curve(curve.file) for curve in curves if curve.file is not None]

    def _given(self, key: str, value: float) -> Any:
        return as_in_scene(self.context.scene, key, value)


def per_unit(key: str, scene: Scene, n_contacts: int) -> float:
    """Value of a key of the scene for each unit of the solver's parameter.

    A stiffness of the scene is that of the whole face, of the solver the mean of the nodes. The damping of the solver
    is a factor on that of the scene.

    Parameters
    ----------
    key : str
        A key of the solver.
    scene : Scene
        The scene.
    n_contacts : int
        Number of contact nodes.
    """
    if key in WHOLE_FACE:
        return float(n_contacts)
    ratio = scene.response.damping_ratio
    return ratio if key == "response.damping_ratio" and isinstance(ratio, float) else 1.0


def _solver_value(problem: Any, base: Any, name: str) -> float:
    """Value of a parameter of the solver in a problem; of the damping its ratio to that of another problem."""
    modal, contact, excitation, _ = problem
    if name == "damping":
        return float(modal.damping.flat[0] / base[0].damping.flat[0])
    return float(excitation.force if name == "force" else getattr(contact, name).mean())
