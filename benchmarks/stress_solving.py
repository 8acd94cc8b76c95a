"""One case of the matrix solved, and what is written down of it."""

from __future__ import annotations

import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from stress_cases import TANGENTIAL_RATIO, StressCase

if TYPE_CHECKING:
    from nonlinear import ContactParameters, Excitation, ResponseCurve, SolverOptions
    from rom import ModalModel

BELOW_FREE, ABOVE_STUCK = 0.8, 1.2
OUT_OF_TIME, RAISED = "out of time", "raised an exception"


@dataclass(frozen=True)
class StressResult:
    """Outcome of a case. `ending` is that of the solver, or why there is none; errors are NaN without a curve."""

    case: StressCase
    low_hz: float
    high_hz: float
    complete: bool
    ending: str
    message: str
    points: int
    iterations: int
    seconds: float
    energy_error: float
    turning_points: int
    peaks: int
    truncation_error: float
    detached: int

    @property
    def milliseconds_a_point(self) -> float:
        """Time a point; NaN where there is none."""
        return 1e3 * self.seconds / self.points if self.points else float("nan")

    def row(self) -> dict[str, Any]:
        """Column -> value, the parameters first."""
        values = {name: value for name, value in asdict(self).items() if name != "case"}
        return self.case.values() | values


class OutOfTimeError(Exception):
    """The time that a case may take is over."""


def solve_case(case: StressCase, model: Path, limit: float) -> StressResult:
    """Solve one curve on one BLAS thread; whatever happens to it becomes part of the result.

    `limit`: seconds after which the curve is given up at the next solved point.
    """
    return attempt(case, model, limit)[0]


def attempt(case: StressCase, model: Path, limit: float) -> tuple[StressResult, ResponseCurve | None]:
    """As `solve_case`, with the curve, if there is one."""
    from threadpoolctl import threadpool_limits

    began = time.perf_counter()
    low = high = float("nan")
    reached = [0]

    def watch(frequency_hz: float, points: int) -> None:
        reached[0] = points
        if time.perf_counter() - began > limit:
            raise OutOfTimeError(f"given up at {frequency_hz:.6g} Hz after {limit:g} s")

    with threadpool_limits(1):
        try:
            low, high = frequency_range(case, model)
            curve = curve_of(case, model, (low, high), watch)
        except Exception as error:  # a case that breaks is a finding, not the end of the run
            ending = OUT_OF_TIME if isinstance(error, OutOfTimeError) else RAISED
            message = str(error) if isinstance(error, OutOfTimeError) else f"{type(error).__name__}: {error}"
            seconds, nan = time.perf_counter() - began, float("nan")
            failed = StressResult(case, low, high, False, ending, message, reached[0], 0, seconds, nan, 0, 0, nan, 0)
            return failed, None
    return _result(case, low, high, curve), curve


def _result(case: StressCase, low: float, high: float, curve: ResponseCurve) -> StressResult:
    return StressResult(
        case=case,
        low_hz=low,
        high_hz=high,
        complete=curve.termination.complete,
        ending=curve.termination.kind,
        message=curve.termination.message,
        points=curve.points,
        iterations=int(curve.iterations.sum()),
        seconds=curve.seconds,
        energy_error=float(np.max(curve.energy_error, initial=0.0)) if curve.points else float("nan"),
        turning_points=int(curve.turning_points.size),
        peaks=len(curve.peaks),
        truncation_error=curve.truncation_error,
        detached=len(curve.detached),
    )


def frequency_range(case: StressCase, model: Path) -> tuple[float, float]:
    """Hz, from 0.8 of the free to 1.2 of the fully stuck first natural frequency at the nodal diameter."""
    from rom import natural_frequencies, read_reduced_model

    reduced = read_reduced_model(model)
    phase = 2.0 * np.pi * case.order_ratio
    normal = case.normal_stiffness / reduced.n_contacts
    free = natural_frequencies(reduced, phase, count=1)[0]
    stuck = natural_frequencies(reduced, phase, normal=normal, tangential=TANGENTIAL_RATIO * normal, count=1)[0]
    return BELOW_FREE * float(free), ABOVE_STUCK * float(stuck)


def posed(
    case: StressCase, model: Path, frequency: tuple[float, float]
) -> tuple[ModalModel, ContactParameters, Excitation, SolverOptions]:
    """What a case asks to solve, under 1 N: the arguments of `forced_response`."""
    from nonlinear import ContactParameters, Excitation, SolverOptions
    from rom import modal_model, read_reduced_model

    reduced = read_reduced_model(model)
    assert reduced.n_blades is not None
    order = round(case.order_ratio * reduced.n_blades)
    if not np.isclose(order / reduced.n_blades, case.order_ratio):
        raise ValueError(f"{reduced.n_blades} blades have no engine order {case.order_ratio:.3g} N_b")
    contact = ContactParameters.shared(
        reduced.n_contacts,
        normal_stiffness=case.normal_stiffness,
        tangential_stiffness=TANGENTIAL_RATIO * case.normal_stiffness,
        friction=case.friction,
        interference=case.interference,
        law=case.law,
    )
    modal = modal_model(reduced, damping_ratio=case.damping_ratio)
    return modal, contact, Excitation(order, 1.0), SolverOptions(frequency, harmonics=case.harmonics)


def curve_of(case: StressCase, model: Path, frequency: tuple[float, float], watch: Any = None) -> ResponseCurve:
    """The response curve of a case under 1 N."""
    from nonlinear import forced_response

    return forced_response(*posed(case, model, frequency), watch)
