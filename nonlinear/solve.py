"""The nonlinear forced response of a blade: one call from modes, contact and excitation to a curve."""

import time
from collections.abc import Callable
from itertools import pairwise

import numpy as np
from threadpoolctl import threadpool_limits

from nonlinear.balance import HarmonicBalance
from nonlinear.contact import ContactError, ContactParameters
from nonlinear.continuation import Continuation, CurvePoint
from nonlinear.curve import CurveData, ResponseCurve, assemble_curve
from nonlinear.elements import contact_element
from nonlinear.newton import NewtonResult
from nonlinear.options import Excitation, SolverOptions
from nonlinear.outcome import Ending, Outcome
from nonlinear.peaks import locate_peak
from nonlinear.start import periodic_start, static_displacement
from nonlinear.truncation import truncation_error
from rom import ModalModel, RelativeReceptance

Progress = Callable[[float, int], None]


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
    began = time.perf_counter()
    # The matrices are small: more threads than one make each product slower.
    with threadpool_limits(1, "blas"):
        balance = harmonic_balance(modal, contact, excitation, options)
        try:
            start = _first_point(balance, contact, options)
        except ArithmeticError as error:
            return _failed_start(balance, options, began, str(error))
        if not start.converged:
            reason = f"no periodic solution found: relative residual {start.residual:.2g}"
            return _failed_start(balance, options, began, reason)
        continuation = Continuation(balance, options)
        points = list(continuation.trace(_as_point(continuation, start), progress))
        outcome = _outcome(points, options)
        points, peak_indices = _insert_peaks(continuation, points)
        truncation = truncation_error(balance, contact, points, peak_indices, options)
        seconds = time.perf_counter() - began
        return assemble_curve(balance, options.output, CurveData(points, peak_indices, outcome, seconds, truncation))


def harmonic_balance(
    modal: ModalModel, contact: ContactParameters, excitation: Excitation, options: SolverOptions
) -> HarmonicBalance:
    """The balance that `forced_response` solves.

    Raises
    ------
    ArithmeticError : method "static-first" and no static equilibrium.
    """
    harmonics = tuple(range(options.harmonics + 1))
    phase = modal.phase(excitation.engine_order)
    receptance = RelativeReceptance(modal, phase, harmonics, excitation.force)
    element = contact_element(contact, options.harmonics, options)
    if options.method == "static-first":
        static = static_displacement(receptance, contact, options)
        return HarmonicBalance(receptance, element, static)
    return HarmonicBalance(receptance, element)


def _first_point(balance: HarmonicBalance, contact: ContactParameters, options: SolverOptions) -> NewtonResult:
    static = balance.frozen_static
    if static is None:
        static = static_displacement(balance.receptance, contact, options)
    return periodic_start(balance, 2.0 * np.pi * options.frequency[0], static, options)


def _as_point(continuation: Continuation, start: NewtonResult) -> CurvePoint:
    low, _ = continuation.span
    at = continuation.balance.evaluate(start.solution, low)
    forward = np.asarray(np.linalg.solve(at.jacobian, -at.slope), dtype=np.float64), 1.0
    return continuation.point(start.solution, low, forward, start.iterations, 0.0, continuation.options.step)


def _failed_start(balance: HarmonicBalance, options: SolverOptions, began: float, reason: str) -> ResponseCurve:
    low = options.frequency[0]
    outcome = Outcome(Ending.START_FAILED, low, f"no start at {low:.6g} Hz: {reason}")
    seconds = time.perf_counter() - began
    return assemble_curve(balance, options.output, CurveData([], [], outcome, seconds, float("nan")))


def _outcome(points: list[CurvePoint], options: SolverOptions) -> Outcome:
    low, high = options.frequency
    last = points[-1].frequency / (2.0 * np.pi)
    if last >= high * (1.0 - 1e-12):
        return Outcome(Ending.COMPLETE, last, f"complete: {low:g} to {high:g} Hz in {len(points)} points")
    if len(points) > 1 and last <= low * (1.0 + 1e-12):
        return Outcome(
            Ending.TURNED_BACK,
            last,
            f"the curve turned back and left the range at its low end, {low:g} Hz: start lower",
        )
    if len(points) >= options.max_points:
        return Outcome(Ending.TOO_MANY_POINTS, last, f"given up at {last:.6g} Hz after {len(points)} points")
    return Outcome(
        Ending.STEP_TOO_SMALL, last, f"no next point found at {last:.6g} Hz with steps down to {options.min_step:g}"
    )


def _insert_peaks(continuation: Continuation, points: list[CurvePoint]) -> tuple[list[CurvePoint], list[int]]:
    """The points with the located maxima among them, and the indices of these."""
    result, indices = points[:1], []
    for before, after in pairwise(points):
        peak = locate_peak(continuation, before, after)
        if peak is not None:
            if peak is not before and peak is not after:
                result.append(peak)
            indices.append(len(result) - 1 if peak is not after else len(result))
        result.append(after)
    return result, indices
