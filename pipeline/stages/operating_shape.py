"""The operating deflection shape: how the whole blade moves at the peak of a curve, from the contact forces there."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class OperatingShape:
    """Periodic motion of the mesh vertices at one solved point.

    frequency_hz, amplitude_m: of the point; phase: inter-blade phase angle psi, rad; harmonics: coefficients
    (H+1, N, 3) complex, metres, harmonic 0 real-valued.
    """

    frequency_hz: float
    amplitude_m: float
    phase: float
    harmonics: NDArray[np.complex128]

    def at(self, angle: float, blade: int = 0) -> Array:
        """Displacement (N, 3), m, of blade j in its own axes at theta: Re sum_h u^(h) exp(i h (theta + j psi))."""
        order = np.arange(len(self.harmonics))
        turned = np.exp(1j * order * (angle + blade * self.phase))
        return np.real(np.tensordot(turned, self.harmonics, axes=1))

    def largest(self, samples: int = 96) -> tuple[float, float]:
        """Largest displacement of a vertex over a period, m, and the angle, rad, where it is reached."""
        angles = 2.0 * np.pi * np.arange(samples) / samples
        sizes = [float(np.linalg.norm(self.at(angle), axis=1).max()) for angle in angles]
        top = int(np.argmax(sizes))
        return sizes[top], float(angles[top])


def operating_shape(curve: Path, rom: Path, n_vertices: int) -> OperatingShape | None:
    """The motion of the first `n_vertices` mesh nodes at the peak of a stored curve; None where it has no peak.

    The modal coordinates follow from the excitation and the contact forces of the point (docs/method.md).

    Raises
    ------
    ReducedModelError : the reduced model was stored without its basis.
    """
    import h5py

    from rom import RelativeReceptance, expand_to_mesh, modal_model, read_reduced_model

    with h5py.File(curve, "r") as file:
        values: dict[str, Any] = dict(file.attrs)
        peak = int(values["peak_index"])
        if peak < 0:
            return None
        force = file["contact_force"][peak]
        frequency, amplitude = float(file["frequency_hz"][peak]), float(file["amplitude_m"][peak])
    model = read_reduced_model(rom)
    modal = modal_model(
        model,
        damping_ratio=values.get("response.damping_ratio"),
        rayleigh=values.get("response.rayleigh"),
        speed_rpm=float(values["load.speed_rpm"]),
    )
    phase = modal.phase(int(values["excitation.engine_order"]))
    receptance = RelativeReceptance(modal, phase, tuple(range(len(force))), float(values["excitation.force"]))
    coordinates, _ = receptance.modal_response(2.0 * np.pi * frequency, force.reshape(len(force), -1))
    vertices = expand_to_mesh(model, coordinates @ modal.shapes.T)[:, :n_vertices]
    return OperatingShape(frequency, amplitude, phase, vertices)
