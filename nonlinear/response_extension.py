"""Branches of other problems carried to the problem of a response curve."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from nonlinear.branches.branch import assemble_curve
from nonlinear.branches.branch_collection import BranchCollection, BranchStart, KnownBranch, Lifting
from nonlinear.branches.detached_branches import few_harmonics
from nonlinear.branches.parameter_continuation import Carried, Homotopy, carry_solution
from nonlinear.contact.fourier import to_real
from nonlinear.continuation.arclength_continuation import Progress
from nonlinear.harmonic_balance.initial_solution import pad_or_truncate
from nonlinear.harmonic_balance.residual import HarmonicBalance
from nonlinear.harmonic_selection.truncation_error import TruncationErrorEstimator
from nonlinear.peak_errors import with_peak_errors
from nonlinear.problem import Problem, ProblemTuple
from nonlinear.response_curve import ResponseCurve, by_height
from nonlinear.response_solver import build_continuation, lifting_to
from nonlinear.worst_motion.worst_motion import find_worst_motion
from rom.linear_algebra.threads import one_blas_thread

SAME_AS_KNOWN = 0.01  # distance from a known branch, relative to the vibration, within which nothing is lifted


class LostStart(NamedTuple):
    """A start whose branch does not exist at the problem it was carried to."""

    start: BranchStart  # the start
    at: float  # part of the way from the problem of the start, 0, to this one, 1, at which it was lost


@dataclass(frozen=True)
class Extension:
    """A response curve with branches carried from other problems."""

    curve: ResponseCurve  # the curve; the same object if there is nothing new
    lost: tuple[LostStart, ...] = ()  # starts that did not reach the problem of the curve


def extend_response(
    problem: ProblemTuple, curve: ResponseCurve, starts: Sequence[BranchStart], progress: Progress | None = None
) -> ResponseCurve:
    """The curve with the branches to which solutions of other problems lead.

    Returns the curve with all branches, by falling highest amplitude; the same object if there is nothing new.
    """
    return carry_branches(problem, curve, starts, progress).curve


def carry_branches(
    problem: ProblemTuple, curve: ResponseCurve, starts: Sequence[BranchStart], progress: Progress | None = None
) -> Extension:
    """As `extend_response`, and where the starts were lost that did not reach the problem.

    Each start is carried with few harmonics by continuation in a parameter that goes from its problem to this one.
    What it reaches gets the harmonics of the curve, and is followed if it lies on no known branch.
    """
    modal, contact, excitation, options = problem
    if not starts or not curve.points:
        return Extension(curve)
    with one_blas_thread():
        try:
            continuation, balances, _ = build_continuation(modal, contact, excitation, options)
        except ArithmeticError:
            return Extension(curve)
        lifting = lifting_to(options, balances, curve.harmonics)
        full = continuation.with_balance(balances.balance(lifting.numbers[-1]))
        known = [_known(full.balance, branch) for branch in (curve, *curve.detached) if branch.points]
        collection = BranchCollection(full, known, progress=progress)
        lost = _offer(collection, lifting, starts, Problem(*problem))
    estimator = TruncationErrorEstimator(continuation, balances)
    added = [
        with_peak_errors(
            assemble_curve(full.balance, found.branch, options, found.origin), found.branch, contact, estimator
        )
        for found in collection.found
    ]
    if not added:
        return Extension(curve, lost)
    left_out = -1 if curve.branches_left_out < 0 else curve.branches_left_out + collection.left_out
    extended = replace(curve, detached=by_height((*curve.detached, *added)), branches_left_out=left_out)
    return Extension(replace(extended, worst=find_worst_motion(problem, extended)), lost)


def _offer(
    collection: BranchCollection, lifting: Lifting, starts: Sequence[BranchStart], problem: Problem
) -> tuple[LostStart, ...]:
    """Carry all starts and add the branches that they reach; the starts that are lost.

    The curve over s at fixed frequency, which costs most, is followed until one start of a branch is lost.
    """
    lost: list[LostStart] = []
    ended: set[tuple[str, int]] = set()
    few = lifting.balances.balance(min(few_harmonics(lifting.balances)[-1], lifting.numbers[-1]))
    low, high = problem.options.omega_range
    for start in starts:
        branch = start.label, start.branch
        carried = _carry(few, start, problem, branch not in ended)
        if not carried.points:
            ended.add(branch)
            lost.append(LostStart(start, carried.lost_at))
        for point in carried.points:
            if not low <= point.omega <= high:
                continue
            point = replace(point, balance=few)
            if collection.is_known(point, SAME_AS_KNOWN):
                continue
            lifted = lifting.lift(collection.continuation, point)
            if lifted is not None:
                collection.offer(lifted, f"carried from {start.label}")
    return tuple(lost)


def _carry(balance: HarmonicBalance, start: BranchStart, problem: Problem, fixed_frequency: bool) -> Carried:
    """Carry one start to the problem."""
    _, contact, excitation, options = problem
    homotopy = Homotopy(balance, (start.contact, contact), (start.force, excitation.force), options)
    omega = 2.0 * np.pi * start.frequency_hz
    unknown = pad_or_truncate(balance.unknown(start.displacement), balance)
    first = homotopy.from_solution(unknown, omega)
    return carry_solution(first, unknown, omega, fixed_frequency=fixed_frequency)


def _known(balance: HarmonicBalance, branch: ResponseCurve) -> KnownBranch:
    """The solutions of a solved branch."""
    rows = (balance.unknown(to_real(row)) for row in branch.relative_displacement)
    return KnownBranch(2.0 * np.pi * branch.frequency_hz, np.stack([row.reshape(-1) for row in rows]))
