"""Modes with Coriolis forces: each pole by itself, as what turns forward moves otherwise than what turns backward."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rom.cyclic.reduced_model import ComplexArray, ReducedModel
from rom.errors import ReducedModelError
from rom.units import angular_speed


@dataclass(frozen=True)
class PoleModes:
    """The 2 m poles of eta'' + D eta' + K eta = f in m modal coordinates, with D and K of any form.

    The receptance is the sum of shape_k dual_k / (abs(s_k)^2 - conj(s_k) s), whose terms have the poles s = s_k.
    """

    poles: ComplexArray  # (..., 2 m) poles s_k, rad/s
    shapes: ComplexArray  # (..., m, 2 m) modal coordinates of each
    # (..., 2 m, m) what each takes of modal forces; without Coriolis forces the conjugate transpose of `shapes`
    dual: ComplexArray

    @classmethod
    def of(cls, stiffness: NDArray[Any], damping: NDArray[Any]) -> PoleModes:
        """Solve the eigenproblem of one wave.

        `stiffness` (m, m): K, or its diagonal, (rad/s)^2, real or complex; the diagonal has a positive real part;
        `damping` (m, m): D, 1/s: damping, and the skew part of the Coriolis forces.
        """
        stiffness = np.diag(stiffness) if stiffness.ndim == 1 else stiffness
        size, frequency = len(damping), np.sqrt(np.abs(stiffness.diagonal()))
        system = np.zeros((2 * size, 2 * size), dtype=np.result_type(stiffness, damping))
        # in w eta and eta': skew but for damping and the flow, so that the eigenvectors are nearly orthogonal
        system[:size, size:] = np.diag(frequency)
        system[size:, :size] = -stiffness / frequency
        system[size:, size:] = -damping
        values, vectors = np.linalg.eig(system)
        poles = values + 0.0j
        shapes = vectors[:size] / frequency[:, None] + 0.0j
        dual = np.linalg.inv(vectors)[:, size:] * -poles.conj()[:, None]
        balance = np.sqrt(np.linalg.norm(dual, axis=1) / np.linalg.norm(shapes, axis=0))
        return cls(poles, shapes * balance, dual / balance[:, None])

    @property
    def conjugate(self) -> PoleModes:
        """Those of the complex conjugate matrices."""
        return PoleModes(self.poles.conj(), self.shapes.conj(), self.dual.conj())


def coriolis_forces(model: ReducedModel, shapes: NDArray[Any]) -> NDArray[Any]:
    """Coriolis forces of the velocities of mass-normalised shapes (n, m) at the speed, skew-Hermitian (m, m), 1/s."""
    if model.coriolis is None or model.speed_rpm is None:
        raise ReducedModelError("coriolis: missing, allowed: a model at a known speed with its Coriolis matrix")
    return np.asarray(angular_speed(model.speed_rpm) * (shapes.conj().T @ (model.coriolis @ shapes)))
