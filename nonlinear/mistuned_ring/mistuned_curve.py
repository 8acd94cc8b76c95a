"""The response of a mistuned ring as a curve like that of the tuned ring: stability, branches, worst motion.

A small ring is one structure, with the modes of all its blades and the contact nodes of all pairs: what holds for a
blade against the ground holds for it, by the same solver. Of a large one the main branch alone is known, and time
integration tells of its points whether the ring stays there, and where it goes otherwise.

A structure has one time, in which the harmonic h of blade j is exp(i h j psi) times that in the time of the blade.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from nonlinear.contact.fourier import ComplexArray
from nonlinear.contact.parameters import Array, ContactParameters
from nonlinear.continuation.response_quantities import largest_amplitude
from nonlinear.mistuned_ring.mistuning import Mistuning, check_blades
from nonlinear.mistuned_ring.ring_receptance import ring_in_time
from nonlinear.mistuned_ring.ring_response import MistunedResponse
from nonlinear.options import SEARCH_COST, Excitation, SolverOptions
from nonlinear.response_curve import Kind, Peak, ResponseCurve, TerminationReason, WorstMotion, at_range_end
from nonlinear.response_solver import forced_response
from nonlinear.time_integration.ring import whole_ring
from nonlinear.worst_motion.candidates import Place, branches_of, height_said
from nonlinear.worst_motion.ring_integration import USUAL_PERIODS, Integrated, RingIntegration, Solution
from nonlinear.worst_motion.ring_starts import RingStarts
from nonlinear.worst_motion.stepped_sweep import SteppedSweep
from nonlinear.worst_motion.worst_motion import Open, left_open, worst_of
from rom.cyclic.modal_model import ModalModel
from rom.cyclic.sector_modes import RingModes

MOST_UNKNOWNS = 500  # of a ring that is solved as one structure: some minutes
PERIODS = 1000  # of the time integration of a whole ring with the standard search
MOST_PERIODS = 72_000  # of a blade, of usual cost, of a ring then
MOST_TURNING = 100  # modes of such a ring with Coriolis forces, whose poles are one full eigenproblem
WHOLE, ALONE = "stability of the whole ring", "stability by time integration alone"  # of a small and a large ring
NONE = "no stability"  # where blades are joined, and of large rings with Coriolis forces
OTHERS = "other deviations of blades and contacts"
NOT_IN_TIME = "a mistuned ring on a disk, in a flow or with Coriolis forces is not integrated in time"


def mistuned_curve(
    modal: RingModes,
    contact: ContactParameters,
    excitation: Excitation,
    options: SolverOptions,
    mistuning: Mistuning,
    response: MistunedResponse,
) -> ResponseCurve:
    """The response of a mistuned ring with stability, other branches, truncation error and worst motion.

    Amplitudes are the largest displacement abs(x(t)) of any blade. A ring of few unknowns is solved as one structure;
    of a larger one the curve is that of `mistuned_response`, and time integration tells which of its points persist.
    On a disk, in a flow and with Coriolis forces there is no time integration.

    Harmonics and contacts are in the time of each blade, contacts pair after pair.
    """
    check_blades(modal, mistuning)
    if modal.joined or not isinstance(modal, ModalModel):
        curve = _main_branch(response, options)
        own = replace(options, detached=False)
        return replace(curve, worst=_said(worst_of(curve, own, None, None, NOT_IN_TIME), NONE))
    is_small = 3 * contact.n_contacts * mistuning.n_blades * (2 * response.harmonics + 1) <= MOST_UNKNOWNS
    if modal.turns:
        is_small = is_small and mistuning.n_blades * modal.angular_frequency.size <= MOST_TURNING
    if is_small:
        curve, own = _solved(modal, contact, excitation, options, mistuning, response), options
    else:
        curve, own = _main_branch(response, options), replace(options, stability="ring", detached=False)
    if not curve.points:
        return curve
    if modal.turns:
        return replace(curve, worst=_said(worst_of(curve, own, None, None, NOT_IN_TIME), WHOLE if is_small else NONE))
    ring = ring_in_time(modal, contact, excitation, mistuning, options.output)
    tried: list[int] = []
    worst, error = _worst_motion(RingIntegration(ring, own), curve, mistuning.n_blades, tried)
    if is_small:
        return replace(curve, worst=_said(worst, WHOLE))
    return replace(curve, worst=_said(_with_unseen(worst, curve, tried), ALONE), truncation_error=error)


def _solved(
    modal: ModalModel,
    contact: ContactParameters,
    excitation: Excitation,
    options: SolverOptions,
    mistuning: Mistuning,
    response: MistunedResponse,
) -> ResponseCurve:
    """The curve of the ring as one structure, its peaks located for the blade with the highest one."""
    names = tuple(f"{options.output}_{j}" for j in range(mistuning.n_blades))
    blade = 0 if response.peak is None else response.peak.blade
    own = replace(options, output=names[blade], outputs=names, search="off")
    whole = whole_ring(modal, excitation, 1.0 + mistuning.frequency), mistuning.contact(contact)
    with np.errstate(all="ignore"):  # equal blades: their modes are resonances of each other
        curve = forced_response(*whole, excitation, own)
    turns = mistuning.n_blades, modal.phase(excitation.engine_order)
    detached = tuple(_of_any_blade(branch, *turns, options) for branch in curve.detached)
    return replace(_of_any_blade(curve, *turns, options), detached=detached)


def _of_any_blade(curve: ResponseCurve, count: int, phase: float, options: SolverOptions) -> ResponseCurve:
    """A curve with the largest amplitude of any blade, and contacts in the time of each blade."""
    amplitude = np.max([curve.amplitude_of(name) for name in curve.outputs], axis=0) if curve.points else np.zeros(0)
    peaks = tuple(replace(peak, amplitude_m=float(amplitude[peak.index])) for peak in curve.peaks)
    parts = {}
    for name in ("relative_displacement", "contact_force"):
        values = getattr(curve, name)
        back = np.exp(-1j * phase * np.multiply.outer(np.arange(values.shape[1]), np.arange(count)))
        by_pair = values.reshape(*values.shape[:2], count, -1, 3) * back[:, :, None, None]
        parts[name] = by_pair.reshape(values.shape)
    peak = _peak(curve.frequency_hz, amplitude, options)
    return replace(curve, amplitude_m=amplitude, peaks=peaks, peak=peak, outputs={}, **parts)


def _main_branch(response: MistunedResponse, options: SolverOptions) -> ResponseCurve:
    """The main branch alone, whose stability is not known."""
    count, high = response.frequency_hz.size, options.frequency_hz[1]
    by_blade = [[largest_amplitude(row).value for row in rows] for rows in response.output]
    amplitude = np.array(by_blade).max(axis=1, initial=0.0) if count else np.zeros(0)
    blade = np.array([int(np.argmax(row)) for row in by_blade], dtype=int)
    output: ComplexArray = response.output[np.arange(count), blade]
    unknown, zeros = np.full(count, np.nan), np.zeros(count, dtype=np.int64)
    kind: Kind = "complete" if response.complete else "step too small"
    end = high if response.complete or not count else float(response.frequency_hz[-1])
    return ResponseCurve(
        termination=TerminationReason(kind, end, response.message),
        frequency_hz=response.frequency_hz,
        amplitude_m=amplitude,
        harmonic_m=np.abs(output[:, 1:]),
        static_m=output[:, 0].real,
        phase_rad=np.angle(output[:, 1]),
        stable=np.zeros(count, dtype=bool),
        growth_rate=unknown,
        growth_nodal_diameter=zeros,
        sticking=zeros,
        slipping=zeros,
        separating=zeros,
        dissipated_j=unknown,
        iterations=response.iterations,
        kept_harmonics=np.full(count, response.harmonics, dtype=np.int64),
        arc=unknown,
        energy_error=unknown,
        output=output,
        relative_displacement=response.relative_displacement,
        contact_force=np.zeros_like(response.relative_displacement),
        peak=_peak(response.frequency_hz, amplitude, options),
        peaks=(),
        bifurcations=(),
        seconds=response.seconds,
        harmonics=response.harmonics,
        truncation_error=float("nan"),
    )


def _peak(frequency_hz: Array, amplitude: Array, options: SolverOptions) -> Peak | None:
    """The point with the largest amplitude of any blade."""
    if not amplitude.size:
        return None
    index = int(np.argmax(amplitude))
    at = float(frequency_hz[index])
    is_end = at_range_end(at, options.frequency_hz)
    return Peak(at, float(amplitude[index]), index, located=not is_end, at_end=is_end)


def _worst_motion(
    integration: RingIntegration, curve: ResponseCurve, n_blades: int, tried: list[int]
) -> tuple[WorstMotion, float]:
    """The worst motion of a ring, and the error of the highest point on which it stays: that has all harmonics.

    The indices of the points looked at are added to `tried`.
    """
    branches, options = branches_of(curve), integration.options
    if options.search != "off":
        integration = integration.for_branches(branches)
    seen: list[tuple[float, float]] = []  # heights of points on which the ring stays, and their errors

    def integrate(place: Place, blade_periods: int, height_m: float) -> Integrated:
        branch, index = branches[place[0]], place[1]
        if blade_periods < USUAL_PERIODS * n_blades:  # no smaller ring carries a perturbation
            return Integrated(None, f"of {n_blades} blades would take too long")
        tried.append(index)
        motion, failure = integration(Solution.of(branch, index), blade_periods, height_m)
        if motion is None or not motion.stays:
            return Integrated(motion, failure)
        reached = float(motion.envelope_m[-1].max())
        seen.append((reached, abs(float(branch.amplitude_m[index]) / reached - 1.0)))
        return Integrated(replace(motion, started_m=reached), failure)

    reason = "switched off" if options.search == "off" else ""
    others = SteppedSweep(integration), RingStarts(integration, branches)
    affordable = min(PERIODS * n_blades, MOST_PERIODS / integration.cost)
    most = round(options.effort * SEARCH_COST[options.search] * affordable)
    found = worst_of(curve, options, None, None if reason else integrate, reason, *others, blade_periods=most)
    return found, max(seen, default=(0.0, float("nan")))[1]


def _with_unseen(worst: WorstMotion, curve: ResponseCurve, tried: list[int]) -> WorstMotion:
    """A worst motion, open where higher points were neither looked at nor passed by a motion that was followed."""
    low, high = (worst.followed_hz[0], worst.followed_hz[-1]) if worst.followed_hz else (np.inf, -np.inf)
    unseen = (curve.amplitude_m > worst.amplitude_m) & ((curve.frequency_hz < low) | (curve.frequency_hz > high))
    unseen[tried] = False
    if not unseen.any():
        return worst
    highest = height_said(curve.amplitude_m[unseen].max())
    said = f"{np.count_nonzero(unseen)} points of the branch, up to {highest}, were not looked at in time"
    return left_open(worst, Open("not searched", said))


def _said(worst: WorstMotion, stability: str) -> WorstMotion:
    """A worst motion of which is said what was searched of a mistuned ring."""
    searched = worst.searched.replace("; stability;", f"; {stability};").replace("mistuned blades", OTHERS)
    if stability == WHOLE:
        return replace(worst, searched=searched)
    return replace(
        worst,
        searched=searched.replace("unstable ", ""),
        unresolved=worst.unresolved.replace("unstable ", ""),
    )
