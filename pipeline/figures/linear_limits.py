"""Linear limits of a sweep: the frequency response with free and with fully stuck shrouds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pipeline.figures.data import Array, PlottedCurve
from pipeline.results.resonances import modes_about, resonances_of_problem
from pipeline.stages.scene_to_solver import scene_modes, section_excitation

if TYPE_CHECKING:
    from nonlinear.contact.parameters import ContactParameters
    from nonlinear.options import Excitation
    from rom.cyclic.reduced_model import ReducedModel
    from rom.cyclic.sector_modes import RingModes

FINE, COARSE = (600, 121), (160, 41)  # evenly spaced frequencies, and frequencies around each resonance
_WIDTH = 0.04  # relative distance of the latter from it at most


@dataclass(frozen=True)
class Limit:
    """Amplitude of the vibration, m, over frequency, Hz, and the indices of the plotted curves with this limit.

    `resonance` (Hz, m): of the modes that the frequency range is about, as the run names them, the one that moves
    most; None where the force excites none.
    """

    kind: str
    frequency_hz: Array
    amplitude_m: Array
    curves: tuple[int, ...]
    resonance: tuple[float, float] | None = None

    @property
    def peak(self) -> tuple[float, float]:
        """Highest point: Hz, m."""
        top = int(np.argmax(self.amplitude_m))
        return float(self.frequency_hz[top]), float(self.amplitude_m[top])

    def times(self, factor: float) -> Limit:
        """The limit under so many times the force."""
        resonance = None if self.resonance is None else (self.resonance[0], self.resonance[1] * factor)
        return replace(self, amplitude_m=self.amplitude_m * factor, resonance=resonance)


def linear_limits(curves: Sequence[PlottedCurve]) -> list[Limit]:
    """The free limit of every distinct blade and load, with a disk of every phase, and the stuck one of all."""
    from rom.files.reduced_model_file import read_reduced_model

    models = {rom: read_reduced_model(rom, with_basis=False) for rom in {curve.rom for curve in curves}}
    limits = []
    for kind in ("free", "stuck"):
        groups: dict[object, list[int]] = {}
        for position, curve in enumerate(curves):
            groups.setdefault(_case(curve, kind), []).append(position)
        found = (_limit(kind, models[curves[at[0]].rom], curves, at) for at in groups.values())
        limits += [limit for limit in found if limit is not None]
    return limits


def count_limits(curves: Sequence[PlottedCurve]) -> int:
    """Number of different linear limits of a kind; no file is read."""
    return max(len({_case(curve, kind) for curve in curves}) for kind in ("free", "stuck"))


def _case(curve: PlottedCurve, kind: str) -> object:
    """The values that the linear response depends on: all but friction, interference and preload.

    With free shrouds the wave matters only where the sectors are joined at a disk.
    """
    scene = curve.scene
    response = scene.response
    case: tuple[object, ...] = (
        curve.rom,
        scene.excitation.force,
        response.damping_ratio,
        response.rayleigh,
        response.frequency,
        scene.load.coriolis,
    )
    if scene.excitation.harmonic:
        case = (*case, scene.excitation.harmonic)
    if kind == "free":
        return (*case, scene.excitation.engine_order) if curve.joined else case
    springs = [(each.contact.normal_stiffness, each.contact.tangential_stiffness) for each in curve.contacts]
    return *case, scene.excitation.engine_order, *springs


def _limit(kind: str, model: ReducedModel, curves: Sequence[PlottedCurve], at: list[int]) -> Limit | None:
    """The limit of some curves; no free one of a blade that contacts alone hold."""
    curve = curves[at[0]]
    modal = scene_modes(curve.scene, model)
    problem = modal, curve.contact_parameters, section_excitation(curve.scene.excitation)
    return limit_of(kind, model, problem, curve.scene.response.frequency, tuple(at))


def limit_of(
    kind: str,
    model: ReducedModel,
    problem: tuple[RingModes, ContactParameters, Excitation],
    frequency_hz: tuple[float, float],
    curves: tuple[int, ...] = (0,),
    counts: tuple[int, int] = FINE,
) -> Limit | None:
    """The limit of a problem with its resonance; no free one of a blade that contacts alone hold.

    `counts`: numbers of frequencies, as `FINE` and `COARSE`.
    """
    from rom.cyclic.receptance import RelativeReceptance

    (modal, _, wave), (low, high) = problem, frequency_hz
    own = RelativeReceptance(modal, modal.phase(wave.engine_order), (1,), wave.force, wave.factors)
    if kind == "free" and own.pushes_floating_bodies:
        return None
    frequency, amplitude = linear_limit(kind, model, problem, (low, high), counts)
    ways = modes_about(resonances_of_problem(model, problem, wave.engine_order), (low, high))
    top = max((way[kind] for way in ways if kind in way), key=lambda each: each.amplitude_m, default=None)
    resonance = None if top is None else (top.frequency_hz, top.amplitude_m)
    return Limit(kind, frequency, amplitude, curves, resonance)


def linear_limit(
    kind: str,
    model: ReducedModel,
    problem: tuple[RingModes, ContactParameters, Excitation],
    frequency_hz: tuple[float, float],
    counts: tuple[int, int] = FINE,
) -> tuple[Array, Array]:
    """Frequency, Hz, and amplitude, m, of the linear response with free or stuck contacts, (F,) each."""
    from rom.cyclic.natural_frequencies import gyroscopic_frequencies, linear_response, natural_frequencies
    from rom.cyclic.receptance import RelativeReceptance

    modal, contact, wave = problem
    stuck = kind == "stuck"
    springs: dict[str, Any] = {
        "normal": contact.normal_stiffness if stuck else 0.0,
        "tangential": contact.tangential_stiffness if stuck else 0.0,
    }
    phase = modal.phase(wave.engine_order)
    frequencies = gyroscopic_frequencies if modal.turns else natural_frequencies
    resonances = frequencies(model, phase, count=min(10, model.size), **springs)
    excited = RelativeReceptance(modal, phase, (1,), wave.force, wave.factors).excited_harmonics
    own = [frequencies(model, h * phase, count=min(10, model.size), **springs) / h for h in excited if h > 1]
    frequency = _grid(frequency_hz, np.concatenate([resonances, *own]), counts)
    given = {"phase": phase, "force": wave.force, "harmonic_factors": wave.factors, **springs}
    harmonics = [linear_response(modal, frequency, harmonic=h, **given) for h in excited]
    return frequency, _largest(harmonics, excited)


def _largest(harmonics: list[NDArray[np.complex128]], order: Sequence[int]) -> Array:
    """Largest displacement over a period, (F,), of harmonics (F,) of an output."""
    from nonlinear.contact.fourier import largest_lengths

    if tuple(order) == (1,):
        return np.abs(harmonics[0])
    rows = np.zeros((len(harmonics[0]), max(order) + 1, 1), dtype=complex)
    for h, values in zip(order, harmonics, strict=True):
        rows[:, h, 0] = values
    return largest_lengths(rows)


def _grid(limits: tuple[float, float], resonances: Array, counts: tuple[int, int]) -> Array:
    """Frequencies, Hz, dense around resonances, which are narrow for light damping."""
    (low, high), (even, around) = limits, counts
    near = np.linspace(-1.0, 1.0, around) ** 3 * _WIDTH
    grid = np.concatenate([np.linspace(low, high, even), *(f * (1.0 + near) for f in resonances)])
    return np.unique(grid[(grid >= low) & (grid <= high)])
