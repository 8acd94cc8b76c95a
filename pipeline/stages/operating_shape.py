"""Operating deflection shape: the motion of the whole blade at the peak of a curve, from the contact forces there."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pipeline.scene.schema import Excitation, Load, Response
from pipeline.stages.curve_file import section_from_attributes
from pipeline.stages.scene_to_solver import damped_modes, section_excitation

Array = NDArray[np.float64]


@dataclass(frozen=True)
class OperatingShape:
    """Periodic motion of the mesh vertices at one solved point."""

    # `frequency_hz`, `amplitude_m`: of the point
    frequency_hz: float
    amplitude_m: float
    phase: float  # inter-blade phase angle psi, rad
    # (H+1, N, 3), Fourier coefficients u^(h) of the N vertices, m; harmonic 0 real-valued
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
    """Motion of the mesh vertices at the peak of a stored curve, from the excitation and the contact forces there."""
    import h5py

    from rom import RelativeReceptance, expand_to_mesh, read_reduced_model

    with h5py.File(curve, "r") as file:
        response = section_from_attributes(Response, file.attrs)
        load = section_from_attributes(Load, file.attrs)
        excitation = section_from_attributes(Excitation, file.attrs)
        peak = int(file.attrs["peak_index"])
        if peak < 0:
            return None
        force = file["contact_force"][peak]
        frequency, amplitude = float(file["frequency_hz"][peak]), float(file["amplitude_m"][peak])
    model = read_reduced_model(rom)
    modal = damped_modes(model, response, load)
    phase = modal.phase(excitation.engine_order)
    wave, harmonics = section_excitation(excitation), tuple(range(len(force)))
    receptance = RelativeReceptance(modal, phase, harmonics, wave.force, wave.factors)
    coordinates, _ = receptance.modal_response(2.0 * np.pi * frequency, force.reshape(len(force), -1))
    vertices = expand_to_mesh(model, receptance.reduced_coordinates(coordinates))[:, :n_vertices]
    return OperatingShape(frequency, amplitude, phase, vertices)
