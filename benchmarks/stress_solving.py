"""One case of the test matrix solved, what is recorded of it, and many cases in worker processes."""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from stress_cases import TANGENTIAL_RATIO, StressCase
from stress_interfaces import InterfaceCase

if TYPE_CHECKING:
    from nonlinear import ContactParameters, Excitation, ResponseCurve, SolverOptions
    from rom import ModalModel

BELOW_FREE, ABOVE_STUCK = 0.8, 1.2
OUT_OF_TIME, RAISED = "out of time", "raised an exception"
THREAD_VARIABLES = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
NAN = float("nan")
Case = StressCase | InterfaceCase
AnyCase = TypeVar("AnyCase", StressCase, InterfaceCase)
Result = TypeVar("Result")


@dataclass(frozen=True)
class StressResult:
    """Result of a case; `ending` is the termination reason, or why there is none; errors are NaN without a curve."""

    case: Case
    low_hz: float
    high_hz: float
    complete: bool
    ending: str
    message: str
    points: int
    seconds: float
    iterations: int = 0
    energy_error: float = NAN
    turning_points: int = 0
    peaks: int = 0
    truncation_error: float = NAN
    detached: int = 0

    def row(self) -> dict[str, Any]:
        """Column -> value, the parameters first."""
        values = {name: value for name, value in asdict(self).items() if name != "case"}
        return self.case.values() | values


class OutOfTimeError(Exception):
    """The time that a case may take is over."""


def solve_case(case: Case, model: Path | None, limit: float) -> StressResult:
    """Solve one curve on one BLAS thread; an exception becomes part of the result.

    `model`: of a case that has none of its own; `limit`: seconds after which the curve is given up at the next point.
    """
    return attempt(case, model, limit)[0]


def attempt(case: Case, model: Path | None, limit: float) -> tuple[StressResult, ResponseCurve | None]:
    """As `solve_case`, with the curve, if there is one."""
    from nonlinear import forced_response
    from rom.linear_algebra.threads import one_blas_thread

    began = time.perf_counter()
    low = high = NAN
    reached = 0

    def watch(frequency_hz: float, points: int) -> None:
        nonlocal reached
        reached = points
        if time.perf_counter() - began > limit:
            raise OutOfTimeError(f"given up at {frequency_hz:.6g} Hz after {limit:g} s")

    with one_blas_thread():
        try:
            if isinstance(case, InterfaceCase):
                problem = case.posed()
            else:
                assert model is not None
                problem = posed(case, model, frequency_range(case, model))
            low, high = problem[3].frequency_hz
            curve = forced_response(*problem, watch)
        except OutOfTimeError as error:
            ending, message = OUT_OF_TIME, str(error)
        except Exception as error:  # a case that breaks is a finding, not the end of the run
            ending, message = RAISED, f"{type(error).__name__}: {error}"
        else:
            return _result(case, low, high, curve), curve
    seconds = time.perf_counter() - began
    return StressResult(case, low, high, False, ending, message, reached, seconds), None


def _result(case: Case, low: float, high: float, curve: ResponseCurve) -> StressResult:
    return StressResult(
        case,
        low,
        high,
        curve.termination.complete,
        curve.termination.kind,
        curve.termination.message,
        curve.points,
        curve.seconds,
        iterations=int(curve.iterations.sum()),
        energy_error=float(np.max(curve.energy_error, initial=0.0)) if curve.points else NAN,
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
    assert reduced.contact_area is not None
    normal = case.normal_stiffness * reduced.contact_area / reduced.contact_area.sum()
    free = natural_frequencies(reduced, phase, count=1)[0]
    stuck = natural_frequencies(reduced, phase, normal=normal, tangential=TANGENTIAL_RATIO * normal, count=1)[0]
    return BELOW_FREE * float(free), ABOVE_STUCK * float(stuck)


def posed(
    case: StressCase, model: Path, frequency_hz: tuple[float, float]
) -> tuple[ModalModel, ContactParameters, Excitation, SolverOptions]:
    """The arguments of `forced_response` for a case under 1 N."""
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
        area=reduced.contact_area,
    )
    modal = modal_model(reduced, damping_ratio=case.damping_ratio)
    return modal, contact, Excitation(order, 1.0), SolverOptions(frequency_hz, harmonics=case.harmonics)


def each(
    solve: Callable[[AnyCase, Path | None, float], Result],
    cases: Sequence[AnyCase],
    models: Sequence[Path | None],
    limit: float,
    jobs: int,
) -> Iterator[Result]:
    """solve(case, model, limit) of every case as it comes, by `jobs` processes with one BLAS thread each."""
    if jobs == 1:
        for case, model in zip(cases, models, strict=True):
            yield solve(case, model, limit)
        return
    import multiprocessing
    from concurrent.futures import ProcessPoolExecutor, as_completed

    for name in THREAD_VARIABLES:
        os.environ[name] = "1"  # the workers inherit it before they load any library
    with ProcessPoolExecutor(jobs, mp_context=multiprocessing.get_context("spawn")) as pool:
        futures = [pool.submit(solve, *each, limit) for each in zip(cases, models, strict=True)]
        for future in as_completed(futures):
            yield future.result()


def positive(text: str) -> int:
    """A whole number of an option, 1 or more."""
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f"{text}, allowed: 1 or more")
    return value
