"""Linear limits of a sweep: the frequency response with free and with fully stuck shrouds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from pipeline.figures.data import Array, PlottedCurve
from pipeline.stages.scene_to_solver import damped_modes

if TYPE_CHECKING:
    from rom import ModalModel, ReducedModel

_EVEN = 600  # evenly spaced frequencies
_NEAR, _WIDTH = 121, 0.04  # frequencies around each resonance, and their relative distance from it at most


@dataclass(frozen=True)
class Limit:
    """Amplitude of harmonic 1, m, over frequency, Hz, and the indices of the plotted curves with this limit."""

    kind: str
    frequency_hz: Array
    amplitude_m: Array
    curves: tuple[int, ...]

    @property
    def peak(self) -> tuple[float, float]:
        """Highest point: Hz, m."""
        top = int(np.argmax(self.amplitude_m))
        return float(self.frequency_hz[top]), float(self.amplitude_m[top])


def linear_limits(curves: Sequence[PlottedCurve]) -> list[Limit]:
    """The free limit of every distinct blade and load, and the stuck limit of every distinct contact and phase."""
    from rom import read_reduced_model

    models = {rom: read_reduced_model(rom, with_basis=False) for rom in {curve.rom for curve in curves}}
    limits = []
    for kind in ("free", "stuck"):
        groups: dict[object, list[int]] = {}
        for position, curve in enumerate(curves):
            groups.setdefault(_case(curve, kind), []).append(position)
        limits += [_limit(kind, models[curves[at[0]].rom], curves, at) for at in groups.values()]
    return limits


def count_limits(curves: Sequence[PlottedCurve]) -> int:
    """Number of different linear limits of a kind; no file is read."""
    return max(len({_case(curve, kind) for curve in curves}) for kind in ("free", "stuck"))


def _case(curve: PlottedCurve, kind: str) -> object:
    """The values that the linear response depends on: all but friction, interference and preload."""
    scene, contact = curve.scene, curve.contact
    response = scene.response
    case = (curve.rom, scene.excitation.force, response.damping_ratio, response.rayleigh, response.frequency)
    if kind == "free":
        return case
    return *case, scene.excitation.engine_order, contact.normal_stiffness, contact.tangential_stiffness


def _limit(kind: str, model: ReducedModel, curves: Sequence[PlottedCurve], at: list[int]) -> Limit:
    from rom import linear_response, natural_frequencies

    curve = curves[at[0]]
    scene = curve.scene
    modal: ModalModel = damped_modes(model, scene.response, scene.load)
    contact = curve.contact_parameters(model.n_contacts)
    stuck = kind == "stuck"
    springs: dict[str, Any] = {
        "normal": contact.normal_stiffness if stuck else 0.0,
        "tangential": contact.tangential_stiffness if stuck else 0.0,
    }
    phase = modal.phase(scene.excitation.engine_order)
    resonances = natural_frequencies(model, phase, count=min(10, model.size), **springs)
    frequency = _grid(*scene.response.frequency, resonances)
    amplitude = np.abs(linear_response(modal, frequency, phase=phase, force=scene.excitation.force, **springs))
    return Limit(kind, frequency, amplitude, tuple(at))


def _grid(low: float, high: float, resonances: Array) -> Array:
    """Frequencies, Hz, dense around resonances, which are narrow for light damping."""
    near = np.linspace(-1.0, 1.0, _NEAR) ** 3 * _WIDTH
    grid = np.concatenate([np.linspace(low, high, _EVEN), *(f * (1.0 + near) for f in resonances)])
    return np.unique(grid[(grid >= low) & (grid <= high)])
