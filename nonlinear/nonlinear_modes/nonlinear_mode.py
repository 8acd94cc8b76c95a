"""Frequency and damping of a nonlinear mode over its amplitude, and the resonances of any excitation from them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nonlinear.contact.element_choice import contact_element
from nonlinear.contact.fourier import ComplexArray
from nonlinear.contact.parameters import Array, ContactParameters
from nonlinear.continuation.response_quantities import largest_amplitude
from nonlinear.harmonic_balance.initial_solution import static_displacement
from nonlinear.nonlinear_modes.extended_motion import ExtendedMotion
from nonlinear.nonlinear_modes.linear_start import first_state, linear_mode
from nonlinear.nonlinear_modes.mode_curve import ModeContinuation, MotionPoint
from nonlinear.options import SolverOptions
from rom import ModalModel, RelativeReceptance, one_blas_thread

SHARES = (1.0, 0.5, 0.25, 0.0)  # of the contact springs in the linear modes that a first motion is sought from


@dataclass(frozen=True)
class ModeResonance:
    """A resonance of one nonlinear mode under an excitation.

    Attributes
    ----------
    frequency_hz : float
        Frequency, Hz.
    amplitude_m : float
        Largest displacement of the output over a period, static part included, m.
    damping_ratio : float
        Damping ratio of the mode there.
    stable : bool
        Whether the resonant force grows with the amplitude; where it falls the resonance is unstable.

    Examples
    --------
    With the names of the example of `forced_response`:

    >>> from nonlinear import nonlinear_mode
    >>> mode = nonlinear_mode(modal, contact, 3, (0.1, 3.0), options)
    >>> resonance = mode.resonances(1.0)[0]
    >>> print(f"{resonance.amplitude_m:.2f} m, the peak of the curve {curve.peak.amplitude_m:.2f} m")
    1.38 m, the peak of the curve 1.38 m
    """

    frequency_hz: float
    amplitude_m: float
    damping_ratio: float
    stable: bool


@dataclass(frozen=True)
class NonlinearMode:
    """A nonlinear mode at P amplitudes.

    Attributes
    ----------
    amplitude_m : (P,) array
        Largest displacement of the output over a period, static part included, m.
    frequency_hz : (P,) array
        Frequency, Hz.
    damping_ratio : (P,) array
        Damping ratio: of the structure and of the contacts.
    modal_amplitude : (P,) array
        Norm a of the mass-normalised modal coordinates of harmonic 1, m sqrt(kg).
    force : (P,) array
        Amplitude of the excitation that has its resonance there, N.
    coordinates : (P, H+1, m) complex array
        Modal coordinates of the m modes of the structure.
    message : str
        Why the curve ends where it does.

    Examples
    --------
    With the names of the example of `forced_response`:

    >>> from nonlinear import nonlinear_mode
    >>> mode = nonlinear_mode(modal, contact, 3, (0.1, 3.0), options)
    >>> print(mode.message, bool(np.all(np.diff(mode.force) > 0.0)))
    the largest amplitude was reached True
    """

    amplitude_m: Array
    frequency_hz: Array
    damping_ratio: Array
    modal_amplitude: Array
    force: Array
    coordinates: ComplexArray
    message: str

    def resonances(self, force: float) -> tuple[ModeResonance, ...]:
        """Resonances under an excitation of some amplitude, the largest motion first.

        At resonance the excitation balances the damping, 2 zeta omega^2 a^2 = F abs(q^(1)^H phi^T f). More than one
        for a force: there are isolated branches.

        Parameters
        ----------
        force : float
            Amplitude of the excitation, N.
        """
        from scipy.interpolate import CubicSpline

        tables = np.column_stack([self.frequency_hz, np.log(self.amplitude_m), self.damping_ratio])
        place = np.arange(len(self.force))
        curve, excess = CubicSpline(place, tables), CubicSpline(place, np.log(self.force / force))
        found = []
        for at in excess.roots(extrapolate=False):
            frequency, log_amplitude, damping = (float(value) for value in curve(at))
            rising = bool(excess(at, 1) > 0.0)
            found.append(ModeResonance(frequency, float(np.exp(log_amplitude)), damping, rising))
        return tuple(sorted(found, key=lambda each: -each.amplitude_m))


@one_blas_thread()
def nonlinear_mode(
    modal: ModalModel,
    contact: ContactParameters,
    nodal_diameter: int,
    amplitudes_m: tuple[float, float],
    options: SolverOptions,
    *,
    number: int = 1,
) -> NonlinearMode:
    """A nonlinear mode of a travelling wave, from one amplitude of the output to another.

    Parameters
    ----------
    modal : rom.ModalModel
        Modes of the blade with free contacts, with their damping.
    contact : ContactParameters
        Parameters of the contact nodes.
    nodal_diameter : int
        Number of waves around the ring, as an engine order: its inter-blade phase angle is that of the mode.
    amplitudes_m : (float, float)
        Smallest and largest amplitude of the output's vibration, m.
    options : SolverOptions
        Harmonics (a number), contact integration and the output.
    number : int
        Number of the mode, from 1, in the order of frequency at the smallest amplitude.

    Returns
    -------
    NonlinearMode
        The mode at increasing arc length; it ends early, and says so, where the motion cannot be followed.

    Raises
    ------
    ArithmeticError
        No static equilibrium, or no motion of the smallest amplitude was found.
    OptionsError
        The number of harmonics is "auto".

    Examples
    --------
    With the names of the example of `forced_response`: stuck, the mass of 1 kg is on 1 + 3 N/m, at 2 / (2 pi) Hz.

    >>> from nonlinear import nonlinear_mode
    >>> mode = nonlinear_mode(modal, contact, 3, (0.1, 3.0), options)
    >>> print(mode.frequency_hz[[0, -1]].round(3), bool(mode.damping_ratio.max() > 0.1))
    [0.318 0.172] True
    """
    harmonics = tuple(range(options.fixed_harmonics + 1))
    receptance = RelativeReceptance(modal, modal.phase(nodal_diameter), harmonics, 0.0)
    static = static_displacement(receptance, contact, options)
    start, continuation = _first_motion(receptance, contact, static, options, (number, amplitudes_m[0]))
    points, message = [start], "no next motion was found"
    for point in continuation.points(start):
        points.append(point)
        if vibration(point, modal, options.output) > amplitudes_m[1]:
            message = "the largest amplitude was reached"
            break
        if vibration(point, modal, options.output) < amplitudes_m[0]:
            message = "the mode returns to the smallest amplitude"
            break
    return _assembled(points, modal, options.output, message)


def vibration(point: MotionPoint, modal: ModalModel, output: str) -> float:
    """Largest displacement of an output over a period without its mean, m."""
    values = point.linearised.coordinates @ modal.outputs[output]
    values[0] = 0.0
    return largest_amplitude(values).value


def _first_motion(
    receptance: RelativeReceptance,
    contact: ContactParameters,
    static: Array,
    options: SolverOptions,
    wanted: tuple[int, float],
) -> tuple[MotionPoint, ModeContinuation]:
    """The motion of the smallest amplitude, near a linear mode; `wanted`: number and amplitude (m) of the output."""
    number, amplitude = wanted
    element = contact_element(contact, options.fixed_harmonics, options)
    pressed = contact.normal_load(static[:, 2]) > 0.0
    holds = np.where(pressed.any(), pressed, True).astype(np.float64)  # without any load: as if all did, then less
    for share in SHARES:
        mode = linear_mode(receptance, contact, share * holds, number)
        level = np.log(amplitude / abs(receptance.modal.outputs[options.output] @ mode[2]))
        carrier, state = first_state(receptance, mode, static, level)
        continuation = ModeContinuation(ExtendedMotion(receptance, element, carrier), state.displacement.shape)
        found = continuation.solve_at_level(state)
        if found is not None:
            return found, continuation
    raise ArithmeticError(f"no motion of mode {number} with {amplitude:.3g} m was found")


def _assembled(points: list[MotionPoint], modal: ModalModel, output: str, message: str) -> NonlinearMode:
    """The mode of its points."""
    coordinates = np.array([point.linearised.coordinates for point in points])
    omega = np.array([point.state.omega for point in points])
    damping = np.array([point.state.damping for point in points])
    size = np.exp([point.state.level for point in points])
    work = np.abs(coordinates[:, 1].conj() @ modal.force)
    return NonlinearMode(
        amplitude_m=np.array([largest_amplitude(each @ modal.outputs[output]).value for each in coordinates]),
        frequency_hz=omega / (2.0 * np.pi),
        damping_ratio=damping,
        modal_amplitude=size,
        force=2.0 * damping * omega**2 * size**2 / work,
        coordinates=coordinates,
        message=message,
    )
