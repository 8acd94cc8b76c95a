"""The nonlinear forced response of a blade: one call from modes, contact and excitation to a curve."""

import time
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from threadpoolctl import threadpool_limits

from nonlinear.balance import HarmonicBalance
from nonlinear.contact import Array, ContactElement, ContactError, ContactParameters
from nonlinear.continuation import Continuation
from nonlinear.curve import CurveData, ResponseCurve, assemble_curve
from nonlinear.detached import detached_branches
from nonlinear.elements import contact_element
from nonlinear.family import BalanceFamily
from nonlinear.landmarks import landmarks
from nonlinear.options import Excitation, SolverOptions
from nonlinear.outcome import Ending, Outcome
from nonlinear.start import static_displacement
from nonlinear.trace import Trace
from nonlinear.tracing import Progress, trace_range
from nonlinear.truncation import Truncation
from rom import ModalModel, RelativeReceptance

LADDER = (1, 3, 5, 7, 9, 11, 15, 21, 31)  # numbers of harmonics that "auto" tries
NOTHING_LEFT_OUT = 1e-9  # truncation error of a response that is linear


def forced_response(
    modal: ModalModel,
    contact: ContactParameters,
    excitation: Excitation,
    options: SolverOptions,
    progress: Progress | None = None,
) -> ResponseCurve:
    """Trace the steady forced response over `options.frequency` through its turning points.

    `progress(frequency_hz, points)` is called at each solved point. A curve that could not be completed comes back
    with what was reached; its outcome says where and why.

    Raises
    ------
    ContactError : the contact parameters are not for the nodes of the model.
    """
    if contact.n_contacts != modal.n_contacts:
        raise ContactError(
            f"contact: parameters of {contact.n_contacts} nodes, allowed: {modal.n_contacts}, as the model"
        )
    # The matrices are small: more threads than one make each product slower.
    with threadpool_limits(1, "blas"):
        if options.harmonics == "auto":
            return _with_enough_harmonics(modal, contact, excitation, options, progress)
        return _with_detached(_with_harmonics(modal, contact, excitation, options, progress), progress)


class _Solved(NamedTuple):
    """A curve, its truncation error (at the peak or along the curve), and what its branches are sought with."""

    curve: ResponseCurve
    truncation_error: float
    continuation: Continuation
    static: Array
    traces: list[Trace]


def _with_harmonics(
    modal: ModalModel,
    contact: ContactParameters,
    excitation: Excitation,
    options: SolverOptions,
    progress: Progress | None,
    everywhere: bool = False,
) -> _Solved:
    """The curve with a given number of harmonics, and the truncation error: at the peak, or `everywhere` along it."""
    began = time.perf_counter()
    receptance, element = _parts(modal, contact, excitation, options)
    nan = float("nan")
    try:
        static = static_displacement(receptance, contact, options)
    except ArithmeticError as error:
        message = f"no start at {options.frequency[0]:.6g} Hz: {error}"
        nothing = Trace([], [], Outcome(Ending.START_FAILED, options.frequency[0], message))
        balance = HarmonicBalance(receptance, element)
        curve = assemble_curve(balance, options.output, CurveData(*nothing, time.perf_counter() - began, nan))
        return _Solved(curve, nan, Continuation(balance, options), np.zeros((contact.n_contacts, 3)), [])
    balance = HarmonicBalance(receptance, element, static if options.method == "static-first" else None)
    continuation = Continuation(balance, options, landmarks(receptance, contact, options), contact)
    traces = trace_range(continuation, static, progress)
    truncation = Truncation(continuation, BalanceFamily(balance, contact, options))
    main = traces[0]
    at_peak = truncation.at_peak(main.points, main.peak_indices)
    along = truncation.along(main.points, main.peak_indices) if everywhere else at_peak
    curve = assemble_curve(balance, options.output, CurveData(*main, time.perf_counter() - began, at_peak))
    return _Solved(curve, along, continuation, static, traces)


def _with_detached(solved: _Solved, progress: Progress | None) -> ResponseCurve:
    """The curve with the branches that hang on it nowhere, and the pieces of an incomplete one."""
    curve, continuation = solved.curve, solved.continuation
    if not solved.traces:
        return curve
    began = time.perf_counter()
    pieces = solved.traces[1:]
    if continuation.options.detached:
        pieces = [*pieces, *detached_branches(continuation, solved.static, solved.traces, progress)]
    output, nan = continuation.options.output, float("nan")
    branches = [assemble_curve(continuation.balance, output, CurveData(*piece, 0.0, nan)) for piece in pieces]
    seconds = curve.seconds + time.perf_counter() - began
    return replace(curve, detached=tuple(branches), seconds=seconds)


def _with_enough_harmonics(
    modal: ModalModel,
    contact: ContactParameters,
    excitation: Excitation,
    options: SolverOptions,
    progress: Progress | None,
) -> ResponseCurve:
    """The curve with as many harmonics as its estimated truncation error asks for.

    An estimate is believed when nothing at all was left out, or when the one before it was confirmed: the peak then
    moved by no more than it had said (with a factor of 3 and the tolerance granted).
    """
    tolerance, seconds = options.harmonic_tolerance, 0.0
    before: tuple[float, float] | None = None  # peak amplitude and estimate with fewer harmonics
    for harmonics in LADDER:
        fixed = replace(options, harmonics=harmonics)
        solved = _with_harmonics(modal, contact, excitation, fixed, progress, everywhere=True)
        curve, error = solved.curve, solved.truncation_error
        seconds += curve.seconds
        height = curve.peak.amplitude_m if curve.peak else 0.0
        confirmed = before is not None and abs(height - before[0]) <= (3.0 * before[1] + tolerance) * height
        if error <= NOTHING_LEFT_OUT or (error <= tolerance and confirmed):
            break
        before = height, error
    else:
        message = f"{curve.outcome.message}; {LADDER[-1]} harmonics, the most there are, do not reach {tolerance:g}"
        curve = replace(curve, outcome=replace(curve.outcome, message=message))
    return _with_detached(solved._replace(curve=replace(curve, seconds=seconds)), progress)


def harmonic_balance(
    modal: ModalModel, contact: ContactParameters, excitation: Excitation, options: SolverOptions
) -> HarmonicBalance:
    """The balance that `forced_response` solves.

    Raises
    ------
    ArithmeticError : method "static-first" and no static equilibrium.
    """
    receptance, element = _parts(modal, contact, excitation, options)
    static = static_displacement(receptance, contact, options) if options.method == "static-first" else None
    return HarmonicBalance(receptance, element, static)


def _parts(
    modal: ModalModel, contact: ContactParameters, excitation: Excitation, options: SolverOptions
) -> tuple[RelativeReceptance, ContactElement]:
    n_harmonics = options.fixed_harmonics
    phase = modal.phase(excitation.engine_order)
    receptance = RelativeReceptance(modal, phase, tuple(range(n_harmonics + 1)), excitation.force)
    return receptance, contact_element(contact, n_harmonics, options)
