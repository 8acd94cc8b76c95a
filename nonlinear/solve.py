"""The nonlinear forced response of a blade: one call from modes, contact and excitation to a curve."""

import time

from threadpoolctl import threadpool_limits

from nonlinear.balance import HarmonicBalance
from nonlinear.contact import ContactElement, ContactError, ContactParameters
from nonlinear.continuation import Continuation
from nonlinear.curve import CurveData, ResponseCurve, assemble_curve
from nonlinear.elements import contact_element
from nonlinear.options import Excitation, SolverOptions
from nonlinear.outcome import Ending, Outcome
from nonlinear.start import static_displacement
from nonlinear.tracing import Progress, trace_range
from nonlinear.truncation import truncation_error
from rom import ModalModel, RelativeReceptance


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
        receptance, element = _parts(modal, contact, excitation, options)
        try:
            static = static_displacement(receptance, contact, options)
        except ArithmeticError as error:
            message = f"no start at {options.frequency[0]:.6g} Hz: {error}"
            outcome = Outcome(Ending.START_FAILED, options.frequency[0], message)
            data = CurveData([], [], outcome, time.perf_counter() - began, float("nan"))
            return assemble_curve(HarmonicBalance(receptance, element), options.output, data)
        frozen = static if options.method == "static-first" else None
        balance = HarmonicBalance(receptance, element, frozen)
        trace = trace_range(Continuation(balance, options), static, progress)
        truncation = truncation_error(balance, contact, trace.points, trace.peak_indices, options)
        data = CurveData(*trace, time.perf_counter() - began, truncation)
        return assemble_curve(balance, options.output, data)


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
    harmonics = tuple(range(options.harmonics + 1))
    receptance = RelativeReceptance(modal, modal.phase(excitation.engine_order), harmonics, excitation.force)
    return receptance, contact_element(contact, options.harmonics, options)
