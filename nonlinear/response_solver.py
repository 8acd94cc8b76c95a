"""The nonlinear forced response of a blade: one call from modes, contact and excitation to a curve."""

import time
from dataclasses import replace

from nonlinear.branches.branch import Branch, with_stability
from nonlinear.branches.detached_branches import detached_branches
from nonlinear.branches.range_continuation import Progress, continue_over_range
from nonlinear.branches.termination import TerminationReason
from nonlinear.contact.element_choice import contact_element
from nonlinear.contact.parameters import Array, ContactElement, ContactError, ContactParameters
from nonlinear.continuation.arclength_continuation import Continuation
from nonlinear.continuation.point_stability import PointStability
from nonlinear.continuation.resonances import find_resonances
from nonlinear.harmonic_balance.balance_family import BalanceFamily
from nonlinear.harmonic_balance.initial_solution import static_displacement
from nonlinear.harmonic_balance.residual import HarmonicBalance
from nonlinear.harmonic_selection.adaptive_harmonics import LADDER, HarmonicSelection, ladder
from nonlinear.harmonic_selection.truncation_error import Truncation
from nonlinear.options import Excitation, SolverOptions
from nonlinear.response_curve import ResponseCurve, assemble_curve
from rom import ModalModel, RelativeReceptance, one_blas_thread

STRICTER = 2.0  # the choice of harmonics along a curve, where its outcome was not good enough


def forced_response(
    modal: ModalModel,
    contact: ContactParameters,
    excitation: Excitation,
    options: SolverOptions,
    progress: Progress | None = None,
) -> ResponseCurve:
    """Trace the steady forced response over `options.frequency_hz` through its turning points.

    modal: the modes of the blade, with damping; contact: parameters of its contact nodes; excitation: engine order
    and force; options: frequency range, harmonics and the rest. `progress(frequency_hz, points)` is called at each
    solved point. A curve that could not be completed comes back with what was reached; its outcome says where and
    why.

    Raises
    ------
    ContactError : the contact parameters are not for the nodes of the model.
    """
    if contact.n_contacts != modal.n_contacts:
        raise ContactError(
            f"contact: parameters of {contact.n_contacts} nodes, allowed: {modal.n_contacts}, as the model"
        )
    with one_blas_thread():
        began = time.perf_counter()
        solved = _solve(modal, contact, excitation, options, progress)
        return replace(solved, seconds=max(0.0, time.perf_counter() - began))


def _solve(
    modal: ModalModel,
    contact: ContactParameters,
    excitation: Excitation,
    options: SolverOptions,
    progress: Progress | None,
) -> ResponseCurve:
    fixed = replace(options, harmonics=LADDER[0]) if options.harmonics == "auto" else options
    receptance, element = _parts(modal, contact, excitation, fixed)
    try:
        static = static_displacement(receptance, contact, options)
    except ArithmeticError as error:
        message = f"no start at {options.frequency_hz[0]:.6g} Hz: {error}"
        nothing = Branch([], [], [], TerminationReason("start failed", options.frequency_hz[0], message))
        return assemble_curve(HarmonicBalance(receptance, element), nothing, options.output)
    frozen = static if options.method == "static-first" else None
    balance = HarmonicBalance(receptance, element, frozen, odd=contact.odd)
    continuation = Continuation(
        balance,
        options,
        find_resonances(receptance, contact, options),
        contact,
        stability=_stability(contact, options),
    )
    truncation = Truncation(continuation, BalanceFamily(balance, contact, fixed))
    if options.harmonics == "auto":
        traces, left_out = _with_enough_harmonics(continuation, truncation, static, progress)
    else:
        traces, left_out = continue_over_range(continuation, static, progress), float("nan")
        if options.truncation:
            left_out = truncation.at_peak(traces[0].points, traces[0].peak_indices)
    curve = assemble_curve(balance, traces[0], options.output, left_out)
    pieces = traces[1:]
    if options.detached:
        pieces = [*pieces, *detached_branches(continuation, truncation.family, traces, static, progress)]
    return replace(curve, detached=tuple(assemble_curve(balance, piece, options.output) for piece in pieces))


def _stability(contact: ContactParameters, options: SolverOptions) -> PointStability | None:
    """The analysis that the options ask for."""
    if options.stability == "folds":
        return None
    return PointStability(contact)


def _with_enough_harmonics(
    continuation: Continuation, truncation: Truncation, static: Array, progress: Progress | None
) -> tuple[list[Branch], float]:
    """Traces with as many harmonics at each point as the estimated error of those left out asks for, and that error.

    The choice along the curve rests on an estimate of one sweep. The peaks and places along the curve are then solved
    with more harmonics; where that tells of a larger error, the curve is traced again with a stricter choice. So it
    is where the curve ends because the branch that it followed is another one with more harmonics.
    """
    tolerance = continuation.options.harmonic_tolerance
    stability, continuation = continuation.stability, replace(continuation, stability=None)
    choice = HarmonicSelection(truncation.family, tolerance / STRICTER)
    tried = ladder(truncation.family.base.n_contacts)
    for least in tried:
        choice.least = least
        start = continuation.of(truncation.family.balance(least))
        traces = continue_over_range(replace(start, adapt=choice), static, progress)
        main = traces[0]
        left_out = truncation.at_peak(main.points, main.peak_indices)
        complete = main.termination.complete or least == tried[-1]
        if complete and left_out <= tolerance and truncation.along(main.points, main.peak_indices) <= tolerance:
            break
        choice.tolerance /= STRICTER
    else:
        message = f"{main.termination.message}; {tried[-1]} harmonics, the most there are, do not reach {tolerance:g}"
        traces = [main._replace(termination=replace(main.termination, message=message)), *traces[1:]]
    if stability is not None:  # only now: the exponents of a curve that is traced again would be lost
        asked = replace(continuation, stability=stability)
        traces = [with_stability(asked, trace) for trace in traces]
    return traces, left_out


def build_harmonic_balance(
    modal: ModalModel, contact: ContactParameters, excitation: Excitation, options: SolverOptions
) -> HarmonicBalance:
    """The balance that `forced_response` solves for the same modal, contact, excitation and options.

    Raises
    ------
    ArithmeticError : method "static-first" and no static equilibrium.
    """
    receptance, element = _parts(modal, contact, excitation, options)
    static = static_displacement(receptance, contact, options) if options.method == "static-first" else None
    return HarmonicBalance(receptance, element, static, odd=contact.odd)


def _parts(
    modal: ModalModel, contact: ContactParameters, excitation: Excitation, options: SolverOptions
) -> tuple[RelativeReceptance, ContactElement]:
    n_harmonics = options.fixed_harmonics
    phase = modal.phase(excitation.engine_order)
    receptance = RelativeReceptance(modal, phase, tuple(range(n_harmonics + 1)), excitation.force)
    return receptance, contact_element(contact, n_harmonics, options)
