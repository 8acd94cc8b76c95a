"""The study `optimum`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from pipeline.stages.scene_to_solver import nonlinear_problem
from pipeline.studies.optimum.optimum_result import OptimumResult
from pipeline.studies.optimum.solver_keys import NAMES, scale

if TYPE_CHECKING:
    from pipeline.studies.study import StudyContext


class OptimumStudy:
    """Values of keys at which the worst motion is lowest, as `Study`."""

    name = "optimum"
    result = OptimumResult

    def key(self, context: StudyContext) -> Mapping[str, Any]:
        """Nothing more than its section and the scene."""
        return {}

    def compute(self, context: StudyContext) -> OptimumResult:
        """The optimum over one key of contact, load or damping."""
        from nonlinear import find_optimum
        from rom import one_blas_thread, read_reduced_model

        section = context.scene.optimum
        assert section is not None  # the study is asked for
        ((key, (low, high)),) = section.ranges.items()
        with one_blas_thread():
            model = read_reduced_model(context.model.rom, with_basis=False)
            factor = scale(key, context.scene, model.n_contacts)
            problem = nonlinear_problem(context.scene, model)
            found = find_optimum(problem, NAMES[key], low / factor, high / factor, context.progress)
        keys = {name: key for key, name in NAMES.items()}
        derivatives = {
            keys[name]: value / scale(keys[name], context.scene, model.n_contacts)
            for name, value in found.derivatives.items()
        }
        return OptimumResult(
            ranges={key: (low, high)},
            values={key: found.value * factor},
            amplitude_m=found.amplitude_m,
            frequency_hz=found.frequency_hz,
            kind=found.kind,
            curvature=found.curvature / factor**2,
            within={key: (found.within[0] * factor, found.within[1] * factor)},
            derivatives=derivatives,
            message=found.message,
        )

    def lines(self, result: OptimumResult) -> Sequence[str]:
        """One line."""
        return [f"optimum: {result.message}"]
