"""Limit cycles of a self-excited wave: where the contacts dissipate in a cycle what the flow feeds into it.

A nonlinear mode has a damping ratio for every amplitude, that of the flow counted. Below 0 the wave grows, above 0 it
decays: a zero is a limit cycle of the ring without excitation, which attracts neighbouring amplitudes where the
damping rises with the amplitude, and parts those that decay to a smaller motion from those that grow where it falls.
Each cycle is solved for with the damping ratio 0 and the amplitude unknown.

References
----------
E. P. Petrov, Analysis of flutter-induced limit cycle oscillations in gas-turbine structures with friction, gap, and
other nonlinear contact interfaces, Journal of Turbomachinery 134, 061018, 2012.
M. Krack, L. Panning-von Scheidt, J. Wallaschek, On the interaction of multiple traveling wave modes in the flutter
vibrations of friction-damped tuned bladed disks, Journal of Engineering for Gas Turbines and Power 139, 042501, 2017.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np

from nonlinear.contact.element_choice import contact_element
from nonlinear.contact.fourier import ComplexArray, to_complex
from nonlinear.contact.parameters import ContactParameters
from nonlinear.continuation.response_quantities import friction_work, largest_amplitude
from nonlinear.nonlinear_modes.extended_motion import MotionState
from nonlinear.nonlinear_modes.mode_curve import STEPS, ModeContinuation, MotionPoint
from nonlinear.nonlinear_modes.nonlinear_mode import (
    FirstMotion,
    ModeMotions,
    NonlinearMode,
    first_motion,
    followed_mode,
    vibration_of,
)
from nonlinear.options import SolverOptions
from nonlinear.stability.floquet import FloquetAnalysis
from nonlinear.stability.ring_stability import LinearisedContact, RingStability, largest_nodal_diameter
from rom.cyclic.sector_modes import RingModes
from rom.linear_algebra.threads import one_blas_thread

ANY = 1e-9  # m, an amplitude of motions that are linear at any, or at none
BELOW, REACH = 0.5, 3000.0  # smallest and largest amplitude over that of the first slip, lift-off or touch
LONG_STEPS = replace(STEPS, largest=0.25)  # along the mode: each cycle is solved for
SAME = 1e-3  # change of ln a from a located cycle to the exact one
PERTURBED = 3  # least number of harmonics of perturbations, whose frequencies are those of other waves
NEUTRAL = 1e-8  # growth that is none, in units of omega
OWN_PHASE = 1e-4  # exponent of a shift of the cycle in time, which is 0, in units of omega


@dataclass(frozen=True)
class LimitCycle:
    """A periodic travelling wave without excitation."""

    frequency_hz: float
    amplitude_m: float  # largest displacement of the output over a period, static part included, m
    vibration_m: float  # the same without the static part, m
    # whether waves of this nodal diameter with another amplitude come to it; else it is a threshold between those
    # that decay and those that grow
    attracting: bool
    # largest real part of the Floquet exponents of perturbations of the other nodal diameters, and of the same one
    # but for its amplitude and phase, 1/s; NaN where there are none
    growth_rate: float
    # nodal diameter of that perturbation relative to the wave, 0 to N_b / 2; -1 where there is none
    growth_nodal_diameter: int
    # flow_j, damping_j, friction_j: work of the flow, and dissipated by the structure and by friction, J per cycle
    # and blade
    flow_j: float
    damping_j: float
    friction_j: float
    # (H+1, m) modal coordinates of the m modes of the structure
    coordinates: ComplexArray = field(repr=False, compare=False)

    @property
    def persists(self) -> bool:
        """Whether the ring stays on it: it attracts amplitudes, and no other perturbation grows."""
        return self.attracting and not self.growth_rate > 0.0


@dataclass(frozen=True)
class SelfExcitation:
    """What a wave does without excitation."""

    nodal_diameter: int  # n of any sign; above 0 a backward wave
    # frequency_hz, damping_ratio: those of small motions about the static equilibrium, Hz; below 0 they grow
    frequency_hz: float
    damping_ratio: float
    # amplitude of the output's vibration up to which motions are linear, m: there a node first slips, lifts off or
    # touches; inf where none does
    linear_limit_m: float
    mode: NonlinearMode | None  # the mode from half that amplitude on; None where motions of any amplitude are linear
    cycles: tuple[LimitCycle, ...]  # limit cycles, the smallest first

    @property
    def held(self) -> LimitCycle | None:
        """The cycle that growing small motions come to; None where they decay, or grow without limit."""
        if self.damping_ratio >= 0.0 or not self.cycles or not self.cycles[0].attracting:
            return None
        return self.cycles[0]

    @property
    def threshold(self) -> LimitCycle | None:
        """The largest cycle, where it repels: motions beyond it grow for ever; None where there is no such limit."""
        return self.cycles[-1] if self.cycles and not self.cycles[-1].attracting else None

    @property
    def outcome(self) -> str:
        """What a small disturbance leads to, and a large one."""
        if self.damping_ratio < 0.0 and self.held is None:
            return "grows for ever"
        said = ["is held" if self.damping_ratio < 0.0 else "decays"]
        if self.damping_ratio >= 0.0 and any(cycle.attracting for cycle in self.cycles):
            said.append("is held after a larger disturbance")
        return ", ".join([*said, *["grows for ever beyond a threshold"] * (self.threshold is not None)])


@one_blas_thread()
def self_excitation(
    modal: RingModes,
    contact: ContactParameters,
    nodal_diameter: int,
    options: SolverOptions,
    *,
    number: int = 1,
    reach: float = REACH,
) -> SelfExcitation:
    """The limit cycles of a wave in a flow that feeds it, and what happens below, between and above them.

    `nodal_diameter`: n of any sign; above 0 a backward wave, as that of an engine order; `options`: harmonics (a
    number), contact integration, the output, and whether stability in the ring is looked at.
    """
    first = first_motion(modal, contact, nodal_diameter, options, number)
    limit = first.linear_limit()
    first = replace(first, amplitude=BELOW * limit if 0.0 < limit < np.inf else ANY, steps=LONG_STEPS)
    if limit == np.inf:
        state = first.find()[0].state
        return SelfExcitation(nodal_diameter, state.omega / (2.0 * np.pi), state.damping, limit, None, ())
    mode = followed_mode(first, reach * first.amplitude / BELOW)
    frequency, damping = float(mode.frequency_hz[0]), float(mode.damping_ratio[0])
    stability = _CycleStability(first, options.stability == "ring")
    cycles = tuple(stability.cycle(point, mode.motions) for point in _zeros(mode))
    return SelfExcitation(nodal_diameter, frequency, damping, limit, mode, cycles)


def _zeros(mode: NonlinearMode) -> Iterator[MotionPoint]:
    """The motions with no damping, in the order of the curve."""
    continuation = mode.motions.continuation
    for number in range(int(mode.piece[-1]) + 1):
        states = [state for state, piece in zip(mode.motions.states, mode.piece, strict=True) if piece == number]
        for before, after in pairwise(_with_extremes(states, continuation)):
            if (before.damping < 0.0) == (after.damping < 0.0):
                continue
            found = continuation.between(before, after, lambda point: point.state.damping)
            if found is not None:
                exact = continuation.solve_at_damping(replace(found.state, damping=0.0))
                same = exact is not None and abs(exact.state.level - found.state.level) < SAME
                yield exact if exact is not None and same else found


def _with_extremes(states: list[MotionState], continuation: ModeContinuation) -> list[MotionState]:
    """The states with those between them where the damping, of one sign at three of them, comes nearest to zero."""
    found = states[:1]
    for before, at, after in zip(states, states[1:], states[2:], strict=False):
        found.append(at)
        near = abs(at.damping) < min(abs(before.damping), abs(after.damping))
        if near and min(before.damping * at.damping, at.damping * after.damping) > 0.0:
            extreme = continuation.between(
                before, after, lambda point: continuation.rate(point, lambda state, _: state.damping)
            )
            if extreme is not None and extreme.state.damping * at.damping < 0.0:
                found[-1] = extreme.state
    return found + states[1:][-1:]


@dataclass(frozen=True)
class _CycleStability:
    """Stability of the cycles of one wave; `first` has the structure and the contact."""

    first: FirstMotion
    in_ring: bool

    def cycle(self, point: MotionPoint, motions: ModeMotions) -> LimitCycle:
        """A cycle of its motion."""
        receptance, state = self.first.receptance, point.state
        # of the state itself: the linearised equations are those before the last step
        linearised = motions.continuation.motion.evaluate(state)
        rate, diameter = self._growth(state) if self.in_ring else (np.nan, -1)
        coordinates = linearised.coordinates
        order = np.asarray(receptance.harmonics, dtype=float)
        flow, damping = receptance.modes.works(coordinates, order, state.omega)
        nodes = (len(coordinates), -1, 3)
        force, motion = (
            to_complex(part.reshape(len(part), -1)).reshape(nodes)
            for part in (linearised.contact.force, state.displacement)
        )
        return LimitCycle(
            frequency_hz=state.omega / (2.0 * np.pi),
            amplitude_m=float(largest_amplitude(receptance.output(motions.output, coordinates)).value),
            vibration_m=vibration_of(coordinates, receptance, motions.output),
            attracting=self._attracts(point, motions),
            growth_rate=rate,
            growth_nodal_diameter=diameter,
            flow_j=float(flow),
            damping_j=float(damping),
            friction_j=float(friction_work(motion[None], force[None]).sum()),
            coordinates=coordinates,
        )

    def _attracts(self, point: MotionPoint, motions: ModeMotions) -> bool:
        """Whether the perturbation of the own amplitude decays.

        Its exponent is real, as are those of the phase and of sliders at rest, which are 0. Where there is no other
        one, the damping tells.
        """
        analysis, contact = self._linearised(point.state, 0)
        own, omega = analysis.exponents(*contact), point.state.omega
        real = own.real[(np.abs(own.imag) <= OWN_PHASE * omega) & (np.abs(own.real) > NEUTRAL * omega)]
        if real.size:
            return bool(real.max() < 0.0)
        return motions.continuation.rate(point, lambda at, _: at.damping) > 0.0

    def _growth(self, state: MotionState) -> tuple[float, int]:
        """Leading exponent of perturbations but for those of the own amplitude and phase, and its nodal diameter."""
        analysis, contact = self._linearised(state, PERTURBED)
        own, modal = analysis.exponents(*contact), self.first.receptance.modal
        own = own[np.abs(own.imag) > OWN_PHASE * state.omega]
        found = [(float(own.real.max()), 0)] if own.size else []
        if largest_nodal_diameter(modal) > 0 and modal.n_blades is not None:
            other = RingStability(analysis, modal.n_blades).leading(contact)
            found += [] if other is None else [(other.exponent.real, other.nodal_diameter)]
        return max(found, default=(np.nan, -1))

    def _linearised(self, state: MotionState, least: int) -> tuple[FloquetAnalysis, LinearisedContact]:
        """The perturbations of a cycle, with its own number of harmonics or the least one."""
        first, (rows, nodes, _) = self.first, state.displacement.shape
        harmonics = max((rows - 1) // 2, least)
        displacement = np.zeros((2 * harmonics + 1, nodes, 3))
        displacement[:rows] = state.displacement
        element = contact_element(first.contact, harmonics, first.options)
        contact = LinearisedContact(displacement, element.evaluate(displacement).jacobian, state.omega)
        receptance = replace(first.receptance, harmonics=tuple(range(harmonics + 1)))
        return FloquetAnalysis.of(receptance, first.contact), contact
