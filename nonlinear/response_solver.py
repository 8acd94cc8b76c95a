"""The nonlinear forced response of a blade from its modes, the contact and the excitation."""

import math
import time
from collections.abc import Iterator
from dataclasses import replace
from typing import Literal, NamedTuple

from nonlinear.branches.branch import Branch, assemble_curve, with_stability
from nonlinear.branches.branch_collection import Lifting
from nonlinear.branches.detached_branches import detached_branches
from nonlinear.branches.range_continuation import continue_over_range
from nonlinear.contact.element_choice import contact_element
from nonlinear.contact.parameters import Array, ContactElement, ContactError, ContactParameters
from nonlinear.continuation.arclength_continuation import Continuation, Progress
from nonlinear.continuation.point_stability import PointStability
from nonlinear.continuation.solution_point import SolutionPoint
from nonlinear.continuation.step_control import find_resonances
from nonlinear.harmonic_balance.initial_solution import TruncatedBalances, on_support, static_displacement
from nonlinear.harmonic_balance.residual import HarmonicBalance, has_odd_harmonics_only
from nonlinear.harmonic_selection.adaptive_harmonics import (
    HarmonicSelection,
    feasible_harmonic_numbers,
)
from nonlinear.harmonic_selection.truncation_error import TruncationErrorEstimator, TruncationEstimate
from nonlinear.options import Excitation, OptionsError, SolverOptions
from nonlinear.peak_errors import with_peak_errors
from nonlinear.residual_tractions.extreme_amplitude import free_tractions
from nonlinear.residual_tractions.residual_bounds import residual_bounds
from nonlinear.response_curve import ResponseCurve, StaticContact, TerminationReason, by_height
from nonlinear.worst_motion.worst_motion import find_worst_motion
from rom.cyclic.receptance import RelativeReceptance
from rom.cyclic.sector_modes import RingModes
from rom.linear_algebra.threads import one_blas_thread

LEAST_HARMONICS = 7  # that detached branches may have with harmonics "auto", where the main branch has fewer
StageName = Literal["main branch", "truncation error", "detached branches", "worst motion"]
STRICTER = 2.0  # factor on the tolerance along the curve, where the truncation error came out too large


def forced_response(
    modal: RingModes,
    contact: ContactParameters,
    excitation: Excitation,
    options: SolverOptions,
    progress: Progress | None = None,
) -> ResponseCurve:
    """The steady forced response over the frequency range, through its folds.

    Parameters
    ----------
    modal : rom.ModalModel or rom.SectorModes
        Modes of the blade with free contacts, with their damping.
    contact : ContactParameters
        Parameters of the contact nodes.
    excitation : Excitation
        Engine order and force.
    options : SolverOptions
        Frequency range, harmonics, tolerances.
    progress : callable, optional
        Called with the frequency (Hz) and the number of points at each new point.

    Returns
    -------
    ResponseCurve
        The main branch, with other branches in `detached`. An incomplete curve is returned as far as it was solved;
        its `termination` says why it ended.

    Raises
    ------
    ContactError
        The number of contact nodes differs from that of the model.

    Examples
    --------
    A mass on a spring, 1 kg and 1 N/m, rubs against the ground. Its resonance lies between those with a free and a
    stuck contact, 1 / (2 pi) and 2 / (2 pi) Hz. Examples of other names of the package go on from here.

    >>> import numpy as np
    >>> from nonlinear import ContactParameters, Excitation, SolverOptions, forced_response
    >>> from rom import ReducedModel, modal_model
    >>> one = np.ones(1)
    >>> parts = np.eye(1), np.eye(1), np.eye(3, 1), np.zeros((1, 3)), one, {"tip": one}  # mass, stiffness, contact
    >>> blade = ReducedModel(*parts, n_blades=12)
    >>> modal, excitation = modal_model(blade, damping_ratio=0.01), Excitation(engine_order=3, force=1.0)
    >>> values = {"normal_stiffness": 0.0, "tangential_stiffness": 3.0, "friction": 0.5, "preload": 2.0}
    >>> contact, options = ContactParameters.shared(1, **values), SolverOptions((0.1, 0.4))
    >>> curve = forced_response(modal, contact, excitation, options)
    >>> print(f"{curve.peak.amplitude_m:.3f} m at {curve.peak.frequency_hz:.3f} Hz")
    1.380 m at 0.198 Hz
    """
    *_, last = response_stages(modal, contact, excitation, options, progress)
    return last.curve


class ResponseStage(NamedTuple):
    """A response curve as far as it is known at a stage of its solution, see `response_stages`."""

    # what has been found last: "main branch", "truncation error", "detached branches" or "worst motion"
    name: StageName
    curve: ResponseCurve  # the curve; what later stages find is missing in it


def response_stages(
    modal: RingModes,
    contact: ContactParameters,
    excitation: Excitation,
    options: SolverOptions,
    progress: Progress | None = None,
) -> Iterator[ResponseStage]:
    """The forced response stage by stage: that of the last one is the result of `forced_response`.

    Who needs the main branch alone takes the first stage; nothing of the others is computed.

    Yields the main branch with its stability, then with its errors, with detached branches, with the worst motion.
    """
    if contact.n_contacts != modal.n_contacts:
        raise ContactError(
            f"contact: parameters of {contact.n_contacts} nodes, allowed: {modal.n_contacts}, as the model"
        )
    started = time.perf_counter()
    with one_blas_thread():
        for name, found in _stages(modal, contact, excitation, options, progress):
            # even this clock may be set back, when a virtual machine moves
            curve = replace(found, seconds=max(0.0, time.perf_counter() - started))
            yield ResponseStage(name, curve)
        curve = replace(found, worst=find_worst_motion((modal, contact, excitation, options), found))
    yield ResponseStage("worst motion", replace(curve, seconds=max(0.0, time.perf_counter() - started)))


def build_continuation(
    modal: RingModes, contact: ContactParameters, excitation: Excitation, options: SolverOptions
) -> tuple[Continuation, TruncatedBalances, Array]:
    """The continuation of a problem, its balances by number of harmonics, and its static displacement (n_c, 3)."""
    fixed = _with_fixed_harmonics(modal, excitation, options)
    receptance, element = _parts(modal, contact, excitation, fixed)
    static = static_displacement(receptance, contact, options)
    frozen = static if options.method == "static-first" else None
    balance = HarmonicBalance(receptance, element, frozen, odd=has_odd_harmonics_only(receptance, contact))
    balances = TruncatedBalances(balance, contact, fixed)
    continuation = Continuation(
        balance,
        options,
        find_resonances(receptance, contact, options),
        contact,
        stability=None
        if options.stability == "folds"
        else PointStability(contact, balances, options.stability == "ring", options.budget("stability")),
        budget=options.budget("branch"),
    )
    return continuation, balances, static


def _stages(
    modal: RingModes,
    contact: ContactParameters,
    excitation: Excitation,
    options: SolverOptions,
    progress: Progress | None,
) -> Iterator[tuple[StageName, ResponseCurve]]:
    """The stages of a solution without the worst motion; one, and a curve without points, where it does not start."""
    try:
        continuation, balances, static = build_continuation(modal, contact, excitation, options)
    except ArithmeticError as error:
        message = f"no start at {options.frequency_hz[0]:.6g} Hz: {error}"
        empty = Branch([], [], [], TerminationReason("start failed", options.frequency_hz[0], message))
        fixed = _with_fixed_harmonics(modal, excitation, options)
        balance = HarmonicBalance(*_parts(modal, contact, excitation, fixed))
        yield "main branch", assemble_curve(balance, empty, options)
        return
    balance = continuation.balance
    estimator = TruncationErrorEstimator(continuation, balances)
    truncation = TruncationEstimate()
    if options.harmonics == "auto":
        branches, truncation = _with_adaptive_harmonics(continuation, estimator, static, progress)
    else:
        branches = continue_over_range(continuation, static, progress)
    curve = assemble_curve(balance, branches[0], options)
    curve = replace(curve, static_contact=StaticContact.of(contact, static), static_displacement=static)
    yield "main branch", curve
    if options.truncation and options.harmonics != "auto":
        truncation = estimator.of_branch(branches[0].points, branches[0].peak_indices)
    curve = with_peak_errors(curve, branches[0], contact, estimator, truncation)
    curve = _with_residual_tractions(curve, continuation, contact, branches[0], static)
    yield "truncation error", curve
    others = [(branch, "") for branch in branches[1:]]
    if options.detached:
        lifting = lifting_to(options, balances, curve.harmonics)
        limited = replace(continuation, budget=options.budget("detached"))
        search = detached_branches(limited, lifting, branches, static, progress)
        others += [(each.branch, each.origin) for each in search.branches]
        curve = replace(curve, branches_left_out=search.left_out)
    detached = [
        with_peak_errors(assemble_curve(balance, branch, options, origin), branch, contact, estimator)
        for branch, origin in others
    ]
    yield "detached branches", replace(curve, detached=by_height(detached))


def _with_residual_tractions(
    curve: ResponseCurve, continuation: Continuation, contact: ContactParameters, branch: Branch, static: Array
) -> ResponseCurve:
    """The main curve with what the residual tractions leave open at its peak."""
    if curve.peak is None:
        return curve
    index = curve.peak.index
    point = branch.points[index]
    free = free_tractions(contact, point.balance.element, point.displacement)
    curve = replace(curve, free_nodes=int(free.any(axis=1).sum()))
    if continuation.options.residual_tractions != "bounds":
        return curve
    return replace(curve, residual_bounds=residual_bounds(continuation, contact, branch, index, static))


def lifting_to(options: SolverOptions, balances: TruncatedBalances, most: int) -> Lifting:
    """The numbers of harmonics of detached branches; `most`: the largest number on the main branch."""
    if options.harmonics != "auto":
        return Lifting(balances, (options.harmonics,))
    feasible = feasible_harmonic_numbers(balances.base.n_contacts, balances.highest_excited)
    numbers = tuple(n for n in feasible if n <= max(most, LEAST_HARMONICS))
    return Lifting(balances, numbers, options.harmonic_tolerance)


def _with_adaptive_harmonics(
    continuation: Continuation, estimator: TruncationErrorEstimator, static: Array, progress: Progress | None
) -> tuple[list[Branch], TruncationEstimate]:
    """Branches with as many harmonics at each point as the tolerance asks for, and the truncation error of the peak.

    The selection along the curve rests on a cheap estimate. Where `_checked` tells of a larger error, the curve is
    solved again with a stricter selection and more harmonics at least.
    """
    tolerance = continuation.options.harmonic_tolerance
    stability, continuation = continuation.stability, replace(continuation, stability=None)
    selection = HarmonicSelection(estimator.balances, tolerance / STRICTER, stability)
    numbers = [*feasible_harmonic_numbers(estimator.balances.base.n_contacts, estimator.balances.highest_excited)]
    most, solved = numbers[-1], None
    while solved is None:
        selection.min_harmonics, *numbers = numbers
        start = continuation.with_balance(estimator.balances.balance(selection.min_harmonics))
        branches = continue_over_range(replace(start, adapt=selection), static, progress)
        solved = _checked(branches, estimator, tolerance, most if numbers else None)
        selection.tolerance /= STRICTER
    main = solved.branches[0]
    said = [main.termination.message, *_few_harmonics_at(main.points)]
    if not solved.accurate:
        number = max((point.balance.n_harmonics for point in main.points), default=most)
        said.append(
            f"{number} harmonics{', the most there are,' if number == most else ''} do not reach {tolerance:g}"
        )
    solved.branches[0] = main._replace(termination=replace(main.termination, message="; ".join(said)))
    if stability is None:
        return solved.branches, solved.at_peak
    # only now: the exponents of a curve that is solved again would be lost
    with_exponents = replace(continuation, stability=stability)
    return [with_stability(with_exponents, branch) for branch in solved.branches], solved.at_peak


def _few_harmonics_at(points: list[SolutionPoint]) -> list[str]:
    """Where few harmonics are kept since the ring leaves the motion (see `HarmonicSelection`); nothing if nowhere."""
    frequencies = [point.omega / (2.0 * math.pi) for point in points if point.pattern is not None]
    if not frequencies:
        return []
    where = f"{min(frequencies):.4g} to {max(frequencies):.4g} Hz"
    return [f"no ring keeps the periodic motion in parts of {where}, which have few harmonics: see the worst motion"]


class _Checked(NamedTuple):
    """Branches with adaptive harmonics, solved for good."""

    branches: list[Branch]
    at_peak: TruncationEstimate
    accurate: bool  # whether the truncation error is within the tolerance


def _checked(
    branches: list[Branch], estimator: TruncationErrorEstimator, tolerance: float, most: int | None
) -> _Checked | None:
    """The branches with what a solution of the peaks and of some points with more harmonics tells of the error.

    None where the curve may get better if it is solved again: where it is incomplete, which may be due to the
    truncation, or where the error is too large at points that all have fewer harmonics than `most`, the most there
    are. Where `most` is None the curve cannot be solved again.
    """
    main = branches[0]
    unstable = any(point.pattern is not None for point in main.points)

    def may_improve(places: list[int]) -> bool:
        fewer = bool(places) and all(main.points[k].balance.n_harmonics < most for k in places) if most else False
        return fewer and not unstable

    if most is not None and not main.termination.complete:
        return None
    changes = estimator.along_curve(main.points, main.peak_indices)
    too_large = [place for place, change in changes.items() if tolerance < change < math.inf]
    if may_improve(too_large):  # the peak need not be looked at
        return None
    at_peak = estimator.of_branch(main.points, main.peak_indices, main=not unstable)
    highest = [estimator.highest(main.points, main.peak_indices)] if main.points else []
    accurate = at_peak.error <= tolerance or any(main.points[place].pattern is not None for place in highest)
    if not accurate and math.isfinite(at_peak.error) and may_improve(highest):
        return None
    return _Checked(branches, at_peak, accurate and not too_large)


def build_harmonic_balance(
    modal: RingModes, contact: ContactParameters, excitation: Excitation, options: SolverOptions
) -> HarmonicBalance:
    """The balance that `forced_response` solves, for a fixed number of harmonics."""
    receptance, element = _parts(modal, contact, excitation, options)
    static = static_displacement(receptance, contact, options) if options.method == "static-first" else None
    return HarmonicBalance(receptance, element, static, odd=has_odd_harmonics_only(receptance, contact))


def _parts(
    modal: RingModes, contact: ContactParameters, excitation: Excitation, options: SolverOptions
) -> tuple[RelativeReceptance, ContactElement]:
    """The two parts of a balance: structure and contact."""
    n_harmonics = options.fixed_harmonics
    receptance = on_support(_receptance(modal, excitation, n_harmonics), contact, options)
    highest = receptance.excited_harmonics[-1]
    if n_harmonics < highest:
        raise OptionsError(
            f"harmonics: {n_harmonics}, allowed: {highest} or more, the highest harmonic of the excitation"
        )
    return receptance, contact_element(contact, n_harmonics, options)


def _receptance(modal: RingModes, excitation: Excitation, n_harmonics: int) -> RelativeReceptance:
    phase, harmonics = modal.phase(excitation.engine_order), tuple(range(n_harmonics + 1))
    return RelativeReceptance(modal, phase, harmonics, excitation.force, excitation.factors)


def _with_fixed_harmonics(modal: RingModes, excitation: Excitation, options: SolverOptions) -> SolverOptions:
    """The options with the fewest harmonics that are tried in place of "auto"."""
    if options.harmonics != "auto":
        return options
    highest = _receptance(modal, excitation, 1).excited_harmonics[-1]
    return replace(options, harmonics=feasible_harmonic_numbers(modal.n_contacts, highest)[0])
