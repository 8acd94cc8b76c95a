"""Nonlinear forced response: contact element, harmonic balance and continuation on a modal model.

The sub-packages, each built on those before it: `contact` (contact forces), `harmonic_balance` (the equations),
`stability` (Floquet exponents), `time_integration` (rings of blades in time), `continuation` (points along a curve),
`branches` (whole branches with peaks and bifurcations), `harmonic_selection` (truncation error),
`residual_tractions` (bounds of the peak), `worst_motion` (the highest motion that persists), `nonlinear_modes`
(frequency and damping over the amplitude), `mistuned_ring` (rings of blades that differ). `response_solver` puts
them together; `mode_agreement` compares nonlinear modes with a response curve.

A name is imported from its file when it is first asked for: options and limits need neither NumPy nor numba.

References
----------
A. Gulisano, C. M. Firrone, S. Zucca, "Forced response of shrouded blades with a coupled static/dynamic approach",
Proc. 7th European Nonlinear Dynamics Conference (ENOC 2011), Rome, 2011. Cited as "Gulisano et al. 2011".
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from nonlinear.branches.branch_collection import BranchStart, branch_starts
    from nonlinear.contact.element_choice import ContactCycle, contact_cycle, contact_element
    from nonlinear.contact.fourier import largest_lengths
    from nonlinear.contact.parameters import (
        LIFT_OFF,
        SLIP,
        STICK,
        ContactElement,
        ContactError,
        ContactForces,
        ContactParameters,
        punch_stiffness,
    )
    from nonlinear.contact_states import NodalContact, nodal_contact
    from nonlinear.continuation.response_quantities import output_components
    from nonlinear.harmonic_balance.initial_solution import static_contact
    from nonlinear.harmonic_balance.residual import HarmonicBalance, LinearisedResidual
    from nonlinear.mistuned_ring.linear_contacts import LinearPeak
    from nonlinear.mistuned_ring.linear_ring import LinearRing
    from nonlinear.mistuned_ring.linear_sectors import LinearSectors
    from nonlinear.mistuned_ring.mistuned_curve import mistuned_curve
    from nonlinear.mistuned_ring.mistuning import Mistuning, MistuningError, whitehead_bound
    from nonlinear.mistuned_ring.ring_response import MistunedResponse, RingPeak, mistuned_response
    from nonlinear.mode_agreement import PeakAgreement, PeakMotion, compare_with_peaks, peak_motions
    from nonlinear.nonlinear_modes.limit_cycles import LimitCycle, SelfExcitation, self_excitation
    from nonlinear.nonlinear_modes.mode_curve import harmonic_shares
    from nonlinear.nonlinear_modes.nonlinear_mode import ModeDamping, ModeResonance, NonlinearMode, nonlinear_mode
    from nonlinear.nonlinear_modes.ring_in_flow import RingInFlow, ring_in_flow
    from nonlinear.options import (
        MOST_UNKNOWNS,
        NEARLY_LOWEST,
        NO_PEAK,
        TRUNCATION_TOLERATED,
        Excitation,
        ExcitationHarmonic,
        OptionsError,
        SolverOptions,
        least_samples,
    )
    from nonlinear.peak_curves.joint_optimum import find_joint_optimum
    from nonlinear.peak_curves.optimum import find_optimum
    from nonlinear.peak_curves.optimum_result import (
        ActivePeak,
        JointOptimum,
        Optimum,
        PeakCurve,
        SolvedResponse,
        WorstEnvelope,
    )
    from nonlinear.peak_curves.peak_search import solved_response
    from nonlinear.peak_curves.peak_sensitivity import PeakSensitivity, peak_sensitivity
    from nonlinear.peak_curves.performance_curve import PerformanceCurve, performance_curve
    from nonlinear.response_curve import (
        Bifurcation,
        BifurcationKind,
        Peak,
        ResidualBounds,
        ResidualExtreme,
        ResponseCurve,
        StaticContact,
        TerminationReason,
        WorstMotion,
        at_range_end,
    )
    from nonlinear.response_extension import Extension, carry_branches, extend_response
    from nonlinear.response_solver import (
        ResponseStage,
        build_harmonic_balance,
        forced_response,
        response_stages,
    )
    from nonlinear.time_integration.ring import Ring, RingState, StepError
    from nonlinear.time_integration.ring_integrator import ContactIterationError, RingIntegrator, RingRecord
    from nonlinear.time_integration.ring_motion import RingLimits, RingMotion, integrate_ring
    from nonlinear.wear.wear_history import WearEvent, WearHistory, wear_history
    from nonlinear.wear.worn_motion import MotionLostError, OperatingPoint
    from nonlinear.worst_motion.ring_integration import RingIntegration, RingPatterns
    from nonlinear.worst_motion.solution_search import FoundSolution, SolutionSearch
    from nonlinear.worst_motion.worst_motion import find_worst_motion

__all__ = [
    "LIFT_OFF",
    "MOST_UNKNOWNS",
    "NEARLY_LOWEST",
    "NO_PEAK",
    "SLIP",
    "STICK",
    "TRUNCATION_TOLERATED",
    "ActivePeak",
    "Bifurcation",
    "BifurcationKind",
    "BranchStart",
    "ContactCycle",
    "ContactElement",
    "ContactError",
    "ContactForces",
    "ContactIterationError",
    "ContactParameters",
    "Excitation",
    "ExcitationHarmonic",
    "Extension",
    "FoundSolution",
    "HarmonicBalance",
    "JointOptimum",
    "LimitCycle",
    "LinearPeak",
    "LinearRing",
    "LinearSectors",
    "LinearisedResidual",
    "MistunedResponse",
    "Mistuning",
    "MistuningError",
    "ModeDamping",
    "ModeResonance",
    "MotionLostError",
    "NodalContact",
    "NonlinearMode",
    "OperatingPoint",
    "Optimum",
    "OptionsError",
    "Peak",
    "PeakAgreement",
    "PeakCurve",
    "PeakMotion",
    "PeakSensitivity",
    "PerformanceCurve",
    "ResidualBounds",
    "ResidualExtreme",
    "ResponseCurve",
    "ResponseStage",
    "Ring",
    "RingInFlow",
    "RingIntegration",
    "RingIntegrator",
    "RingLimits",
    "RingMotion",
    "RingPatterns",
    "RingPeak",
    "RingRecord",
    "RingState",
    "SelfExcitation",
    "SolutionSearch",
    "SolvedResponse",
    "SolverOptions",
    "StaticContact",
    "StepError",
    "TerminationReason",
    "WearEvent",
    "WearHistory",
    "WorstEnvelope",
    "WorstMotion",
    "at_range_end",
    "branch_starts",
    "build_harmonic_balance",
    "carry_branches",
    "compare_with_peaks",
    "contact_cycle",
    "contact_element",
    "extend_response",
    "find_joint_optimum",
    "find_optimum",
    "find_worst_motion",
    "forced_response",
    "harmonic_shares",
    "integrate_ring",
    "largest_lengths",
    "least_samples",
    "mistuned_curve",
    "mistuned_response",
    "nodal_contact",
    "nonlinear_mode",
    "output_components",
    "peak_motions",
    "peak_sensitivity",
    "performance_curve",
    "punch_stiffness",
    "response_stages",
    "ring_in_flow",
    "self_excitation",
    "solved_response",
    "static_contact",
    "wear_history",
    "whitehead_bound",
]

_PLACES = {
    "LIFT_OFF": "nonlinear.contact.parameters",
    "MOST_UNKNOWNS": "nonlinear.options",
    "NEARLY_LOWEST": "nonlinear.options",
    "NO_PEAK": "nonlinear.options",
    "TRUNCATION_TOLERATED": "nonlinear.options",
    "SLIP": "nonlinear.contact.parameters",
    "STICK": "nonlinear.contact.parameters",
    "Bifurcation": "nonlinear.response_curve",
    "BifurcationKind": "nonlinear.response_curve",
    "BranchStart": "nonlinear.branches.branch_collection",
    "at_range_end": "nonlinear.response_curve",
    "branch_starts": "nonlinear.branches.branch_collection",
    "Extension": "nonlinear.response_extension",
    "carry_branches": "nonlinear.response_extension",
    "extend_response": "nonlinear.response_extension",
    "ContactCycle": "nonlinear.contact.element_choice",
    "ContactElement": "nonlinear.contact.parameters",
    "ContactError": "nonlinear.contact.parameters",
    "ContactForces": "nonlinear.contact.parameters",
    "ContactParameters": "nonlinear.contact.parameters",
    "Excitation": "nonlinear.options",
    "ExcitationHarmonic": "nonlinear.options",
    "HarmonicBalance": "nonlinear.harmonic_balance.residual",
    "LinearisedResidual": "nonlinear.harmonic_balance.residual",
    "LimitCycle": "nonlinear.nonlinear_modes.limit_cycles",
    "SelfExcitation": "nonlinear.nonlinear_modes.limit_cycles",
    "self_excitation": "nonlinear.nonlinear_modes.limit_cycles",
    "RingInFlow": "nonlinear.nonlinear_modes.ring_in_flow",
    "ring_in_flow": "nonlinear.nonlinear_modes.ring_in_flow",
    "ModeDamping": "nonlinear.nonlinear_modes.nonlinear_mode",
    "ModeResonance": "nonlinear.nonlinear_modes.nonlinear_mode",
    "NonlinearMode": "nonlinear.nonlinear_modes.nonlinear_mode",
    "harmonic_shares": "nonlinear.nonlinear_modes.mode_curve",
    "nonlinear_mode": "nonlinear.nonlinear_modes.nonlinear_mode",
    "ActivePeak": "nonlinear.peak_curves.optimum_result",
    "JointOptimum": "nonlinear.peak_curves.optimum_result",
    "find_joint_optimum": "nonlinear.peak_curves.joint_optimum",
    "performance_curve": "nonlinear.peak_curves.performance_curve",
    "Optimum": "nonlinear.peak_curves.optimum_result",
    "PeakCurve": "nonlinear.peak_curves.optimum_result",
    "PerformanceCurve": "nonlinear.peak_curves.performance_curve",
    "SolvedResponse": "nonlinear.peak_curves.optimum_result",
    "WorstEnvelope": "nonlinear.peak_curves.optimum_result",
    "find_optimum": "nonlinear.peak_curves.optimum",
    "PeakSensitivity": "nonlinear.peak_curves.peak_sensitivity",
    "peak_sensitivity": "nonlinear.peak_curves.peak_sensitivity",
    "OptionsError": "nonlinear.options",
    "Peak": "nonlinear.response_curve",
    "NodalContact": "nonlinear.contact_states",
    "PeakAgreement": "nonlinear.mode_agreement",
    "PeakMotion": "nonlinear.mode_agreement",
    "compare_with_peaks": "nonlinear.mode_agreement",
    "nodal_contact": "nonlinear.contact_states",
    "peak_motions": "nonlinear.mode_agreement",
    "ResidualBounds": "nonlinear.response_curve",
    "ResidualExtreme": "nonlinear.response_curve",
    "ResponseCurve": "nonlinear.response_curve",
    "SolverOptions": "nonlinear.options",
    "StaticContact": "nonlinear.response_curve",
    "static_contact": "nonlinear.harmonic_balance.initial_solution",
    "TerminationReason": "nonlinear.response_curve",
    "WorstMotion": "nonlinear.response_curve",
    "contact_cycle": "nonlinear.contact.element_choice",
    "contact_element": "nonlinear.contact.element_choice",
    "ResponseStage": "nonlinear.response_solver",
    "forced_response": "nonlinear.response_solver",
    "response_stages": "nonlinear.response_solver",
    "build_harmonic_balance": "nonlinear.response_solver",
    "largest_lengths": "nonlinear.contact.fourier",
    "least_samples": "nonlinear.options",
    "output_components": "nonlinear.continuation.response_quantities",
    "punch_stiffness": "nonlinear.contact.parameters",
    "solved_response": "nonlinear.peak_curves.peak_search",
    "FoundSolution": "nonlinear.worst_motion.solution_search",
    "RingIntegration": "nonlinear.worst_motion.ring_integration",
    "RingPatterns": "nonlinear.worst_motion.ring_integration",
    "SolutionSearch": "nonlinear.worst_motion.solution_search",
    "find_worst_motion": "nonlinear.worst_motion.worst_motion",
    "ContactIterationError": "nonlinear.time_integration.ring_integrator",
    "Ring": "nonlinear.time_integration.ring",
    "RingIntegrator": "nonlinear.time_integration.ring_integrator",
    "RingLimits": "nonlinear.time_integration.ring_motion",
    "RingMotion": "nonlinear.time_integration.ring_motion",
    "RingRecord": "nonlinear.time_integration.ring_integrator",
    "RingState": "nonlinear.time_integration.ring",
    "StepError": "nonlinear.time_integration.ring",
    "integrate_ring": "nonlinear.time_integration.ring_motion",
    "Mistuning": "nonlinear.mistuned_ring.mistuning",
    "MistuningError": "nonlinear.mistuned_ring.mistuning",
    "MistunedResponse": "nonlinear.mistuned_ring.ring_response",
    "mistuned_curve": "nonlinear.mistuned_ring.mistuned_curve",
    "mistuned_response": "nonlinear.mistuned_ring.ring_response",
    "RingPeak": "nonlinear.mistuned_ring.ring_response",
    "LinearRing": "nonlinear.mistuned_ring.linear_ring",
    "LinearPeak": "nonlinear.mistuned_ring.linear_contacts",
    "LinearSectors": "nonlinear.mistuned_ring.linear_sectors",
    "whitehead_bound": "nonlinear.mistuned_ring.mistuning",
    "WearEvent": "nonlinear.wear.wear_history",
    "WearHistory": "nonlinear.wear.wear_history",
    "wear_history": "nonlinear.wear.wear_history",
    "OperatingPoint": "nonlinear.wear.worn_motion",
    "MotionLostError": "nonlinear.wear.worn_motion",
}


def __getattr__(name: str) -> Any:
    if name not in _PLACES:
        raise AttributeError(f"module 'nonlinear' has no attribute {name!r}")
    return getattr(import_module(_PLACES[name]), name)


def __dir__() -> list[str]:
    return sorted([*globals(), *__all__])
