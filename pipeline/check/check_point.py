"""Check of one motion: the solutions of a curve at a frequency, and the ring integrated in time from one of them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from pipeline.errors import input_error, reason_of
from pipeline.stages.request import Request
from pipeline.stages.respond import CurveResult
from pipeline.stages.scene_to_solver import contact_on_model, damped_modes, excitation, solver_options
from pipeline.stages.stored_curve import read_curve

if TYPE_CHECKING:
    from nonlinear import FoundSolution, ResponseCurve, Ring, RingMotion, SolverOptions

MOST_PERIODS = 3000


@dataclass(frozen=True)
class CheckedPoint:
    """Which motion to check."""

    curve: int  # number of the curve, from 0
    frequency_hz: float  # excitation frequency, Hz
    branch: int | None = None  # 0: main branch, k: detached branch k; None: all
    solution: int = 1  # number of the solution among those at the frequency, from 1, the highest


@dataclass(frozen=True)
class Check:
    """The answer."""

    point: CheckedPoint  # which motion was checked
    label: str  # swept parameters of the curve
    solutions: list[FoundSolution]  # all solutions at the frequency, the highest first
    motion: RingMotion  # what the ring did
    predicted_rate: float  # growth rate of the disturbance from the Floquet exponents, 1/s

    @property
    def checked(self) -> FoundSolution:
        """The solution that the ring started from."""
        return self.solutions[self.point.solution - 1]


def refuse(request: Request, point: CheckedPoint) -> None:
    """Refuse a point that no result of the scene can have, before anything is computed."""
    members = request.scene.members
    if point.curve >= len(members):
        last = len(members) - 1
        raise input_error("shroud check", "--curve", str(point.curve), f"0 to {last}" if last else "0")
    response = members[point.curve].scene.response
    low, high = response.frequency
    if not low <= point.frequency_hz <= high:
        allowed = f"{low:g} to {high:g} Hz, the range of curve {point.curve}"
        raise input_error("shroud check", "--frequency", f"{point.frequency_hz:g}", allowed)
    if response.method == "static-first":
        allowed = '"coupled": with a frozen static part a ring has no motion in time'
        raise input_error(request.scene.path, "response.method", '"static-first"', allowed)


def check_point(point: CheckedPoint, curve: CurveResult, label: str) -> Check:
    """Find the solutions of a solved curve at the frequency and integrate the ring from one of them."""
    from nonlinear import RingIntegration, RingPatterns, SolutionSearch
    from rom import one_blas_thread

    if curve.file is None or curve.rom is None:
        raise input_error("shroud check", "--curve", str(point.curve), f"a curve that was solved ({curve.reason})")
    solved = read_curve(curve.file)
    branches = [solved, *solved.detached]
    _refuse_branch(point, branches)
    ring, options = _problem(curve, curve.rom)
    with one_blas_thread():
        search = SolutionSearch(ring, options, point.frequency_hz)
        found = [each for each in search.solutions(branches) if point.branch in (None, each.branch)]
        _refuse_solution(point, found)
        start = found[point.solution - 1].solution
        try:
            motion = RingIntegration(ring, options).motion(start, MOST_PERIODS)
        except ArithmeticError as error:
            raise input_error(
                "shroud check", "", reason_of(error), "contacts that can be integrated in time"
            ) from None
        patterns = RingPatterns(ring, options, start.omega, start.displacement)
        return Check(point, label, found, motion, patterns.growth_rate(motion.nodal_diameter))


def _refuse_branch(point: CheckedPoint, branches: list[ResponseCurve]) -> None:
    if point.branch is None:
        return
    last = len(branches) - 1
    if point.branch > last:
        allowed = f"0, the main branch, to {last}" if last else "0, the main branch: there is no detached one"
        raise input_error("shroud check", "--branch", str(point.branch), allowed)
    frequency_hz = branches[point.branch].frequency_hz
    low, high = frequency_hz.min(), frequency_hz.max()
    if not low <= point.frequency_hz <= high:
        allowed = f"{low:.6g} to {high:.6g} Hz, the range of branch {point.branch}"
        raise input_error("shroud check", "--frequency", f"{point.frequency_hz:g}", allowed)


def _refuse_solution(point: CheckedPoint, found: list[FoundSolution]) -> None:
    if point.solution > len(found):
        allowed = f"1 to {len(found)}" if found else "a frequency with a solution: Newton's method found none there"
        raise input_error("shroud check", "--solution", str(point.solution), allowed)


def _problem(curve: CurveResult, rom: Path) -> tuple[Ring, SolverOptions]:
    """The ring and the options that a curve was solved with."""
    from nonlinear import Ring
    from rom import read_reduced_model

    scene, model = curve.member.scene, read_reduced_model(rom, with_basis=False)
    options = solver_options(scene)
    modal = damped_modes(model, scene.response, scene.load)
    return Ring(modal, contact_on_model(scene, model), excitation(scene), options.output), options
