"""The reduced model of one blade: what the reduction makes and what the forced response starts from."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
SYMMETRY_TOLERANCE = 1e-8
MOST_BLADES = 10_000
LARGEST_NUMBER = 1e100  # beyond it squares and products of what a model holds overflow


class ReducedModelError(ValueError):
    """A reduced model that is inconsistent; the message names the quantity, what it is and what is allowed."""


@dataclass(frozen=True)
class ReducedModel:
    """Mass, stiffness, contact, force and output vectors in the reduced coordinates q (n of them), SI units.

    Attributes
    ----------
    mass, stiffness : (n, n) symmetric.
    contact_right : (3 n_c, n); displacement of the right contact nodes = contact_right @ q, rows (t1, t2, n)
        of node 1, then of node 2, and so on.
    contact_left : (3 n_c, n) or None; the same for the left nodes. None: contact against ground.
    contact_position : (n_c, 3) of the right nodes, metres.
    contact_area : (n_c,) tributary areas, square metres, or None.
    force_excitation : (n,) real or complex, generalised force of 1 N of excitation.
    force_centrifugal : (n,) or None, generalised static force at 1 rad/s; it grows with the speed squared.
    force_static : (n,) or None, any other static force, N.
    outputs : name -> (n,); displacement NAME = outputs[NAME] @ q. "tip" is the default output.
    basis : (N, n) or None, reduced to mesh displacements.
    n_blades : number of blades of the ring, None for a single structure (inter-blade phase angle 0).
    producer : free text that says who made the model.

    Raises
    ------
    ReducedModelError : a shape, a value or a symmetry is wrong.
    """

    mass: Array
    stiffness: Array
    contact_right: Array
    contact_position: Array
    force_excitation: Array | ComplexArray
    outputs: Mapping[str, Array]
    contact_left: Array | None = None
    contact_area: Array | None = None
    force_centrifugal: Array | None = None
    force_static: Array | None = None
    basis: Array | None = None
    n_blades: int | None = None
    producer: str = field(default="shroud")

    def __post_init__(self) -> None:
        """Check shapes, finiteness and symmetry."""
        n = self.mass.shape[0]
        if n < 1:
            raise ReducedModelError(f"mass: shape {self.mass.shape}, allowed: one coordinate or more")
        n_contacts = self.contact_position.shape[0]
        shapes: dict[str, tuple[object, tuple[int, ...]]] = {
            "mass": (self.mass, (n, n)),
            "stiffness": (self.stiffness, (n, n)),
            "contact/position": (self.contact_position, (n_contacts, 3)),
            "contact/right": (self.contact_right, (3 * n_contacts, n)),
            "contact/left": (self.contact_left, (3 * n_contacts, n)),
            "contact/area": (self.contact_area, (n_contacts,)),
            "force/excitation": (self.force_excitation, (n,)),
            "force/centrifugal": (self.force_centrifugal, (n,)),
            "force/static": (self.force_static, (n,)),
            **{f"output/{name}": (vector, (n,)) for name, vector in self.outputs.items()},
        }
        for name, (array, shape) in shapes.items():
            if array is not None:
                _check_array(name, np.asarray(array), shape)
        _check_symmetric("mass", self.mass)
        _check_symmetric("stiffness", self.stiffness)
        if "tip" not in self.outputs:
            raise ReducedModelError("output/tip: missing; it is the default output")
        if self.basis is not None:
            if self.basis.ndim != 2 or self.basis.shape[1] != n:
                raise ReducedModelError(f"basis: shape {self.basis.shape}, allowed: (any, {n})")
            _check_array("basis", self.basis, self.basis.shape)
        if self.contact_area is not None and not np.all(self.contact_area > 0.0):
            raise ReducedModelError("contact/area: holds values that are not above 0, allowed: areas in m^2")
        if self.n_blades is not None and not 1 <= self.n_blades <= MOST_BLADES:
            raise ReducedModelError(f"n_blades: {self.n_blades}, allowed: 1 to {MOST_BLADES}")

    @property
    def n_contacts(self) -> int:
        """Number of contact nodes on a face."""
        return self.contact_position.shape[0]

    @property
    def size(self) -> int:
        """Number of reduced coordinates."""
        return self.mass.shape[0]

    def phase(self, engine_order: int) -> float:
        """Inter-blade phase angle psi = 2 pi EO / N_b, rad, in one turn, of `engine_order` EO; 0 without a ring."""
        return inter_blade_phase(engine_order, self.n_blades)


def inter_blade_phase(engine_order: int, n_blades: int | None) -> float:
    """Psi = 2 pi EO / N_b, rad, in one turn, of `engine_order` EO in a ring of `n_blades`; 0 without one (None)."""
    return 0.0 if n_blades is None else 2.0 * np.pi * (engine_order % n_blades) / n_blades


def _check_array(name: str, array: NDArray[np.generic], shape: tuple[int, ...]) -> None:
    if array.shape != shape:
        raise ReducedModelError(f"{name}: shape {array.shape}, allowed: {shape}")
    if not np.all(np.isfinite(array)):
        raise ReducedModelError(f"{name}: holds values that are not finite, allowed: finite numbers")
    if np.max(np.abs(array), initial=0.0) > LARGEST_NUMBER:
        raise ReducedModelError(f"{name}: holds values beyond {LARGEST_NUMBER:g}, allowed: numbers in SI units")


def _check_symmetric(name: str, matrix: Array) -> None:
    asymmetry = float(np.max(np.abs(matrix - matrix.T), initial=0.0))
    scale = float(np.max(np.abs(matrix), initial=0.0))
    if asymmetry > SYMMETRY_TOLERANCE * scale:
        relative = asymmetry / scale
        raise ReducedModelError(
            f"{name}: asymmetric by {relative:.2g} of its largest entry, allowed: {SYMMETRY_TOLERANCE:g}"
        )
