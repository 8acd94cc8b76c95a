"""The whole ring in a flow, in time: which of several growing waves prevails, from a small disturbance of all.

The ring starts at its static equilibrium, with the linear motion of every wave added in a random phase, together so
small that no node slips, lifts off or touches. No excitation acts. From time to time the outputs of all blades tell
the amplitude of each wave: a transform over the blades parts the nodal diameters, one in time those that run forward
and backward (positive frequencies of nodal diameters n and -n).

References
----------
M. Krack, L. Panning-von Scheidt, J. Wallaschek, On the interaction of multiple traveling wave modes in the flutter
vibrations of friction-damped tuned bladed disks, Journal of Engineering for Gas Turbines and Power 139, 042501, 2017.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.fourier import ComplexArray
from nonlinear.contact.parameters import Array, ContactParameters
from nonlinear.harmonic_balance.initial_solution import static_displacement
from nonlinear.nonlinear_modes.nonlinear_mode import FirstMotion, first_motion
from nonlinear.options import Excitation, SolverOptions
from nonlinear.time_integration.ring import RetainedModes, Ring, RingState
from nonlinear.time_integration.ring_integrator import RingIntegrator
from nonlinear.time_integration.ring_motion import grows_without_bound
from rom.cyclic.sector_modes import RingModes
from rom.linear_algebra.threads import one_blas_thread

ANY = 1e-9  # m, amplitude of a disturbance where motions of no size are linear
LOOK = 8  # periods in which the waves are told apart
MOST_LOOKS = 200  # instants at which the waves are told
LATE = 0.25  # part of all periods over which nothing may change, at least
CALM = 1e-3  # change of every wave, over the largest motion, that is none
SLOW = (
    10.0  # growth of the fastest wave from rest (of the logarithm), in the least time over which nothing may change
)
RISING = 1.05  # growth of a small wave in that time, which may yet become large
UNSEEN = 1e-5  # of the largest wave, below which others do not count
BAND = 0.4, 1.9  # frequencies that count to the first harmonic, over that of the largest motion
ALONE = 0.9999  # share of the squares of one wave that is alone: the others have a hundredth of its amplitude

Ending = Literal["decays", "one wave", "several waves", "not settled", "grows for ever"]


@dataclass(frozen=True)
class RingInFlow:
    """A ring that starts from a small disturbance in a flow that feeds some waves, at T instants."""

    # "decays": no wave grows from rest; "one wave" or "several waves": nothing changes any more; "not settled" after
    # all periods; "grows for ever": contacts cannot hold what the flow feeds
    ending: Ending
    omega: float  # angular frequency of the fastest growing wave, rad/s, whose periods are counted
    periods: Array  # (T,) periods from the start
    nodal_diameter: NDArray[np.int64]  # (N_b,) nodal diameters n, ascending; above 0 backward waves
    amplitude_m: Array  # (T, N_b) amplitude of the first harmonic of the output in each wave, m
    # (T,) largest displacement of the output of any blade since the instant before, static part included, m
    largest_m: Array
    frequency_hz: Array  # (N_b,) frequency of each wave at the end, Hz; NaN where it has no part of the motion
    # state at the end; None where nothing was integrated
    final: RingState | None = field(default=None, repr=False, compare=False)

    @property
    def prevailing(self) -> int | None:
        """Nodal diameter of the largest wave at the end; None where the ring was not integrated."""
        return None if not self.periods.size else int(self.nodal_diameter[self.amplitude_m[-1].argmax()])

    @property
    def share(self) -> float:
        """Part of that wave in the sum of the squares of all amplitudes at the end; NaN without it."""
        if not self.periods.size:
            return float("nan")
        squares = self.amplitude_m[-1] ** 2
        return float(squares.max() / max(squares.sum(), 1e-300))


@one_blas_thread()
def ring_in_flow(
    modal: RingModes,
    contact: ContactParameters,
    options: SolverOptions,
    periods: int,
    *,
    number: int = 1,
    disturbance: float = 0.5,
    seed: int = 17,
    start: RingState | None = None,
    omega: float | None = None,
    progress: Callable[[int], None] | None = None,
) -> RingInFlow:
    """The motion of the ring without excitation, from a small disturbance, until it has settled or grows for ever.

    `omega`: whose periods are counted, rad/s; None: that of the fastest growing wave.
    """
    waves = _Waves.of(modal, contact, options, number)
    growing = waves.damping_ratio < 0.0
    leading = int(waves.damping_ratio.argmin())
    own = float(waves.omega[leading]) if omega is None else omega
    if start is None and (not growing.any() or np.any(growing & (waves.limit == np.inf))):
        return waves.not_integrated("grows for ever" if growing.any() else "decays", own)
    integrator = waves.integrator(own, int(waves.nodal_diameter[leading]))
    state = waves.disturbed(integrator, disturbance, seed) if start is None else start
    exponent = 2.0 * np.pi * abs(float(waves.damping_ratio[leading]))  # a period
    march = _March(integrator, state, periods, max(float(SLOW / max(exponent, 1e-300)), 4.0 * LOOK), progress)
    return march.result(march.go(), waves.nodal_diameter)


@dataclass(frozen=True)
class _Waves:
    """Small motions of all waves of a ring about its equilibrium, by ascending nodal diameter."""

    modal: RingModes
    contact: ContactParameters
    options: SolverOptions
    nodal_diameter: NDArray[np.int64]  # (N_b,)
    first: tuple[FirstMotion, ...]  # the search for the mode of each wave
    omega: Array  # (N_b,), rad/s
    damping_ratio: Array  # (N_b,)
    limit: Array  # (N_b,), modal amplitude at which motions cease to be linear
    shapes: tuple[ComplexArray, ...]  # (m,) each, modal coordinates

    @classmethod
    def of(cls, modal: RingModes, contact: ContactParameters, options: SolverOptions, number: int) -> _Waves:
        blades = modal.n_blades or 1
        diameters = np.arange(blades) - (blades - 1) // 2
        first = tuple(first_motion(modal, contact, int(n), options, number) for n in diameters)
        linear = [each.at_rest() for each in first]
        return cls(
            modal,
            contact,
            options,
            diameters,
            first,
            np.array([omega for omega, _, _ in linear]),
            np.array([damping for _, damping, _ in linear]),
            np.array([each.modal_limit(shape) for each, (_, _, shape) in zip(first, linear, strict=True)]),
            tuple(shape for _, _, shape in linear),
        )

    def integrator(self, omega: float, nodal_diameter: int) -> RingIntegrator:
        """Time integration of all blades without excitation."""
        ring = Ring(self.modal, self.contact, Excitation(nodal_diameter, 0.0), self.options.output)
        modes = RetainedModes.of(ring, omega)
        return RingIntegrator(ring, omega, self.nodal_diameter.size, modes.steps(omega), modes)

    def disturbed(self, integrator: RingIntegrator, disturbance: float, seed: int) -> RingState:
        """The equilibrium with the linear motion of all waves, each as far from its limit."""
        state = self._at_rest(integrator)
        blades, rng = self.nodal_diameter.size, np.random.default_rng(seed)
        coordinates, rates, force = (part.copy() for part in (state.coordinates, state.rates, state.force))
        sizes = self._sizes(disturbance) * np.exp(2j * np.pi * rng.random(blades)) / blades
        for place, (n, omega) in enumerate(zip(self.nodal_diameter, self.omega, strict=True)):
            first, shape, size = self.first[place], self.shapes[place], sizes[place]
            turn = size * np.exp(2j * np.pi * n * np.arange(blades) / blades)[:, None]
            modes = shape.size
            coordinates[:, :modes] += (turn * shape).real
            rates[:, :modes] += (turn * (1j * omega * shape)).real
            held = first.linear_forces(shape).ravel()
            force += (turn * held).real.reshape(force.shape)
        return replace(state, coordinates=coordinates, rates=rates, force=force)

    def _at_rest(self, integrator: RingIntegrator) -> RingState:
        """The equilibrium without friction forces, about which nodes stick up to the limit of linear motions.

        Friction that presses and untwist leave goes with the first vibration.
        """
        first, contact = self.first[0], replace(self.contact, tangential_stiffness=0.0 * self.contact.friction)
        static = static_displacement(first.receptance, contact, first.options)
        smooth = replace(integrator, ring=replace(integrator.ring, contact=contact))
        return smooth.on_wave(np.concatenate([static[None], np.zeros((2, *static.shape))]))

    def _sizes(self, disturbance: float) -> Array:
        """Modal amplitudes of the waves, (N_b,): no wave beyond its part, or that of the wave that grows fastest."""
        largest = float(self.limit[self.damping_ratio.argmin()])
        if not 0.0 < largest < np.inf:
            return np.full(self.limit.size, ANY / max(map(FirstMotion.output, self.first, self.shapes)))
        return disturbance * np.minimum(self.limit, largest)

    def not_integrated(self, ending: Ending, omega: float) -> RingInFlow:
        """A ring whose end is known from its small motions."""
        none, blades = np.empty(0), self.nodal_diameter.size
        return RingInFlow(
            ending, omega, none, self.nodal_diameter, np.empty((0, blades)), none, np.full(blades, np.nan)
        )


class _March:
    """A ring as it is integrated, and what was seen of it."""

    def __init__(
        self,
        integrator: RingIntegrator,
        state: RingState,
        periods: int,
        slow: float,
        progress: Callable[[int], None] | None,
    ) -> None:
        self.integrator, self.state, self.most, self.progress = integrator, state, periods, progress
        self.slow = slow  # periods, the least time over which nothing changes in a settled motion
        self.done = self.told = 0
        self.envelopes: list[Array] = []
        self.periods: list[float] = []
        self.amplitudes: list[Array] = []
        self.largest: list[float] = []
        self.frequency = np.empty(0)

    def go(self) -> Ending:
        """Integrate until the motion has settled, is lost or the periods are over."""
        between = max(LOOK, -(-self.most // MOST_LOOKS))
        while self.done + LOOK <= self.most:
            skipped = min(between, self.most - self.done) - LOOK
            if skipped > 0:
                self._integrate(skipped)
            self._look(self._integrate(LOOK))
            window = min(int(self.slow), len(self.envelope) // 2)
            if grows_without_bound(self.integrator, self.state, self.envelope, max(window, LOOK)):
                return "grows for ever"
            if self._settled():
                squares = self.amplitudes[-1] ** 2
                return "one wave" if squares.max() >= ALONE * squares.sum() else "several waves"
        return "not settled"

    @property
    def envelope(self) -> Array:
        """Largest displacement of each period and blade, (P, N_b), m."""
        return np.concatenate(self.envelopes)

    def result(self, ending: Ending, nodal_diameter: NDArray[np.int64]) -> RingInFlow:
        """What was seen."""
        blades = nodal_diameter.size
        return RingInFlow(
            ending=ending,
            omega=self.integrator.omega,
            periods=np.array(self.periods),
            nodal_diameter=nodal_diameter,
            amplitude_m=np.array(self.amplitudes).reshape(-1, blades),
            largest_m=np.array(self.largest),
            frequency_hz=self.frequency,
            final=self.state,
        )

    def _integrate(self, periods: int) -> Array:
        """Output (n, N_b) of the last periods, at most `LOOK`."""
        while periods > 0:
            record = self.integrator.march(self.state, min(periods, LOOK))
            self.state = record.final
            self.envelopes.append(record.envelope_m)
            self.done += len(record.envelope_m)
            periods -= len(record.envelope_m)
            if self.progress is not None:
                self.progress(self.done)
        return record.output_m.reshape(-1, self.integrator.n_blades)

    def _look(self, output: Array) -> None:
        """Tell the waves apart."""
        amplitude, frequency = waves_of(output, self.integrator.period / self.integrator.steps)
        self.periods.append(self.done - 0.5 * LOOK)
        self.amplitudes.append(amplitude)
        self.largest.append(float(self.envelope[self.told :].max()))
        self.frequency = np.where(amplitude > UNSEEN * amplitude.max(), frequency, np.nan)
        self.told = self.done

    def _settled(self) -> bool:
        """Whether nothing has changed for long, and no small wave rises."""
        times = np.array(self.periods)
        late = times >= times[-1] - max(self.slow, LATE * times[-1])
        if times[-1] < 2.0 * self.slow or np.count_nonzero(late) < 4:
            return False
        parts = np.array([part.mean(axis=0) for part in np.array_split(np.array(self.amplitudes)[late], 4)])
        size = parts[-1].max()
        rises = (np.diff(parts[1:], axis=0) > 0.0).all(axis=0) & (parts[-1] > RISING * parts[1])
        return bool(np.ptp(parts, axis=0).max() <= CALM * size and not np.any(rises & (parts[-1] > UNSEEN * size)))


def waves_of(output: Array, step: float) -> tuple[Array, Array]:
    """Amplitude, m, and frequency, Hz, of the first harmonic in each wave, by ascending nodal diameter.

    Shapes: `output` (n, N_b), at equal steps (s) of some whole periods.
    """
    samples, blades = output.shape
    window = 0.5 - 0.5 * np.cos(2.0 * np.pi * np.arange(samples) / samples)
    spectrum = np.fft.fft(window[:, None] * np.fft.fft(output, axis=1) / blades, axis=0)
    frequency = np.fft.fftfreq(samples, step)
    power = np.abs(spectrum) ** 2
    least = 2.5 / (samples * step)  # the static part, spread by the window, lies below
    leading = frequency[np.where(frequency > least, power.sum(axis=1), 0.0).argmax()]
    band = (frequency > max(BAND[0] * leading, least)) & (frequency < BAND[1] * leading)
    total = power[band].sum(axis=0)
    amplitude = 2.0 * np.sqrt(total / (samples * (window**2).sum()))
    centre = (power[band] * frequency[band, None]).sum(axis=0) / np.maximum(total, 1e-300)
    order = (np.arange(blades) - (blades - 1) // 2) % blades
    return amplitude[order], centre[order]
