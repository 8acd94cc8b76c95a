"""The motion of the smallest amplitude of a nonlinear mode: a linear mode, or what becomes of one.

Where no node slips, lifts off or touches it is a linear mode, exactly. Elsewhere Newton's method starts from linear
modes with parts of the contact springs; if that does not converge, with one harmonic and then more; and last from the
free mode, while the contacts become as stiff as they are.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from nonlinear.contact.element_choice import contact_element
from nonlinear.contact.fourier import ComplexArray
from nonlinear.contact.parameters import Array, ContactParameters
from nonlinear.nonlinear_modes.extended_motion import ExtendedMotion, MotionState
from nonlinear.nonlinear_modes.linear_start import end_of_linear_motion, first_state, linear_mode
from nonlinear.nonlinear_modes.mode_curve import ModeContinuation, MotionPoint
from nonlinear.options import SolverOptions
from rom import RelativeReceptance

LINEAR_STEP = 0.4  # of ln a between points in the linear range
BEFORE_LIMIT, LARGER = 1.0 - 1e-9, 1.0 + 1e-6  # factors on the end of the linear range and on the largest amplitude
SHARES = (1.0, 0.5, 0.25, 0.0)  # of the contact springs in the linear modes that a first motion is sought from
FIRST_STIFFNESS, STIFFNESS_STEP, SMALLEST_STIFFNESS_STEP = 0.01, 2.0, 1.01  # of the contacts, in a homotopy to 1


@dataclass(frozen=True)
class FirstMotion:
    """The search for the first motion of a mode."""

    receptance: RelativeReceptance  # the structure, with harmonics 0 .. H
    contact: ContactParameters  # the contact
    static: Array  # (n_c, 3), static relative displacement, m
    options: SolverOptions  # contact integration and output
    number: int  # number of the mode, from 1
    amplitude: float  # amplitude of the output, m
    every_harmonic: bool = False  # whether damping is compensated in all harmonics, and not in harmonic 1 alone

    def find(self) -> tuple[MotionPoint, ModeContinuation]:
        """The motion, and the continuation that goes on from it."""
        harmonics = len(self.receptance.harmonics) - 1
        springs = list(self._springs())
        found = self._from_springs(springs, harmonics)
        if found is None and harmonics > 1:
            found = self._with_more(self._from_springs(springs, 1), harmonics)
        if found is None:
            found = self._with_more(self._stiffened(), harmonics)
        if found is None:
            raise ArithmeticError(f"no motion of mode {self.number} with {self.amplitude:.3g} m was found")
        return found

    def linear_levels(self, start: MotionState, largest: float) -> tuple[float, ...]:
        """Levels ln a, ascending, from above that of `start` to where its motion ceases to be linear.

        Empty where the start is not linear. The last is that of the first slip, lift-off or touch, or of the largest
        amplitude of the output, m.
        """
        holds = self._pressed()
        shape = linear_mode(self.receptance, self.contact, holds, self.number)[2]
        limit = self._linear_limit(shape)
        if not self.amplitude < limit * self._output(shape):
            return ()
        highest = np.log(min(limit * BEFORE_LIMIT, LARGER * largest / max(self._output(shape), 1e-300)))
        count = int(np.ceil((highest - start.level) / LINEAR_STEP))
        return tuple(float(level) for level in np.linspace(start.level, highest, count + 1)[1:])

    def _from_springs(self, springs: list[Array], harmonics: int) -> tuple[MotionPoint, ModeContinuation] | None:
        """From linear modes with some springs (n_c,) after others."""
        for holds in springs:
            state, continuation = self._guess(holds, harmonics)
            point = continuation.solve_at_level(state)
            if point is not None:
                return point, continuation
        return None

    def _stiffened(self) -> tuple[MotionPoint, ModeContinuation] | None:
        """With one harmonic, from the free mode, by a homotopy in the stiffness of the contacts."""
        state, continuation = self._guess(np.zeros(len(self.static)), 1)
        factor, step = FIRST_STIFFNESS, STIFFNESS_STEP
        while step > SMALLEST_STIFFNESS_STEP:
            now = self._continuation(softer(self.contact, min(factor, 1.0)), 1, continuation.motion.carrier)
            point = now.solve_at_level(state)
            if point is not None and factor >= 1.0:
                return point, now
            if point is None:
                factor, step = factor / step, float(np.sqrt(step))
            else:
                state = point.state
            factor *= step
        return None

    def _with_more(
        self, found: tuple[MotionPoint, ModeContinuation] | None, harmonics: int
    ) -> tuple[MotionPoint, ModeContinuation] | None:
        """The same motion with more harmonics, one after another."""
        while found is not None and len(found[1].motion.receptance.harmonics) - 1 < harmonics:
            point, before = found
            displacement = point.state.displacement
            more = np.concatenate([displacement, np.zeros((2, *displacement.shape[1:]))])
            now = self._continuation(self.contact, (len(more) - 1) // 2, before.motion.carrier)
            next_point = now.solve_at_level(replace(point.state, displacement=more))
            found = None if next_point is None else (next_point, now)
        return found

    def _guess(self, holds: Array, harmonics: int) -> tuple[MotionState, ModeContinuation]:
        """A linear mode at the amplitude, and the continuation for it."""
        receptance = replace(self.receptance, harmonics=tuple(range(harmonics + 1)))
        mode = linear_mode(receptance, self.contact, holds, self.number)
        level = np.log(self.amplitude / max(self._output(mode[2]), 1e-300))
        carrier, state = first_state(receptance, mode, self.static, level)
        return state, self._continuation(self.contact, harmonics, carrier)

    def _continuation(self, contact: ContactParameters, harmonics: int, carrier: int) -> ModeContinuation:
        receptance = replace(self.receptance, harmonics=tuple(range(harmonics + 1)))
        element = contact_element(contact, harmonics, self.options)
        motion = ExtendedMotion(receptance, element, carrier, self.every_harmonic)
        return ModeContinuation(motion, (2 * harmonics + 1, *self.static.shape))

    def _springs(self) -> Iterator[Array]:
        """Shares (n_c,) of the springs that hold in the linear modes to start from."""
        pressed = self._pressed()
        shape = linear_mode(self.receptance, self.contact, pressed, self.number)[2]
        if self.amplitude < self._linear_limit(shape) * self._output(shape):
            yield pressed
            return
        yield from (share * (pressed if pressed.any() else np.ones_like(pressed)) for share in SHARES)

    def _pressed(self) -> Array:
        """1 for the nodes that are in contact at rest, 0 for the others, (n_c,)."""
        return (self.contact.normal_load(self.static[:, 2]) > 0.0).astype(np.float64)

    def _linear_limit(self, shape: ComplexArray) -> float:
        """Modal amplitude at which the motion of a linear mode ceases to be linear."""
        motion = (self.receptance.relative[1] @ shape).reshape(-1, 3)
        return end_of_linear_motion(self.contact, self.static, motion)

    def _output(self, shape: ComplexArray) -> float:
        """Amplitude of the output in a mode of unit amplitude, m."""
        coordinates = np.zeros((len(self.receptance.harmonics), shape.size), dtype=complex)
        coordinates[1] = shape
        return float(abs(self.receptance.output(self.options.output, coordinates)[1]))


def softer(contact: ContactParameters, factor: float) -> ContactParameters:
    """Contacts with a part of their stiffness, and as much smaller a preload."""
    return replace(
        contact,
        normal_stiffness=factor * contact.normal_stiffness,
        tangential_stiffness=factor * contact.tangential_stiffness,
        preload=factor * contact.preload,
    )
