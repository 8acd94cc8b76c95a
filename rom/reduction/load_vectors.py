"""Loads and outputs as vectors on the mesh: their projection on the reduced coordinates and the static correction.

A force f on mesh displacements u = T q is the generalised force T^T f, an output o u is (T^T o)^T q. A force on the
interior bends the blade in a shape that a few fixed-interface modes do not have. Its static response with the
boundary dofs held, less the part that these modes have,

    a = K_ii^-1 f_i - sum over the modes of phi (phi^T f_i) / w^2,

is therefore kept as one more coordinate (MacNeal 1971; attachment modes of Craig and Chang 1977). The static response
to the loads, and that of the outputs to any load on the boundary or among them, is then that of the full model.

References
----------
R. H. MacNeal, A hybrid method of component mode synthesis, Computers & Structures 1 (1971) 581-601.
R. R. Craig, C.-J. Chang, On the use of attachment modes in substructure coupling for dynamic analysis,
18th Structures, Structural Dynamics and Materials Conference (1977), AIAA 77-405.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rom.errors import RomParameterError
from rom.finite_elements.full_model import node_dofs
from rom.linear_algebra.orthonormalisation import orthonormal_combinations
from rom.reduction.fixed_interface_modes import ModalBasis

if TYPE_CHECKING:
    from rom.reduction.boundary_dofs import BoundaryDofs

Vector = NDArray[Any]  # real or complex


@dataclass(frozen=True)
class LoadVectors:
    """Forces and outputs on the N dofs of a full model.

    Attributes
    ----------
    excitation : mapping of int to (N,) array
        Forces of 1 N of excitation by harmonic of the excitation, N, real or complex. Harmonic 1 takes the place of
        the force at the loaded node, which acts where it is not given.
    static : (N,) array or None
        Static force, N.
    outputs : mapping of str to (N,) array
        Output NAME = outputs[NAME] @ u of the mesh displacements u.

    Examples
    --------
    A force on all nodes of a small model, and its mean displacement along y:

    >>> from rom import LoadVectors
    >>> along_y = np.tile([0.0, 1.0, 0.0], 4)
    >>> loads = LoadVectors(excitation={1: along_y}, outputs={"mean": along_y / 4})
    >>> loads.size, loads.static is None
    (12, True)
    """

    excitation: Mapping[int, Vector] = field(default_factory=dict)
    static: NDArray[np.float64] | None = None
    outputs: Mapping[str, NDArray[np.float64]] = field(default_factory=dict)

    @property
    def size(self) -> int:
        """Number of dofs N of the vectors, 0 without any."""
        return next((len(vector) for _, vector in self.named()), 0)

    def named(self) -> Iterator[tuple[str, Vector]]:
        """All vectors with their names in a reduced model."""
        for h, vector in self.excitation.items():
            yield "force/excitation" if h == 1 else f"force/excitation_{h}", vector
        if self.static is not None:
            yield "force/static", self.static
        for name, vector in self.outputs.items():
            yield f"output/{name}", vector

    def columns(self) -> NDArray[np.float64]:
        """Real and imaginary parts of all vectors, where they are not zero, (N, k)."""
        parts = [part for _, vector in self.named() for part in (vector.real, vector.imag) if part.any()]
        return np.array(parts).reshape(len(parts), self.size).T

    def selection(self, given: dict[str, Any], projected: Callable[[Vector], Vector]) -> dict[str, Any]:
        """Forces and outputs of a reduced model, by argument of `ReducedModel`.

        Parameters
        ----------
        given : dict
            Those of the boundary dofs.
        projected : callable
            T^T f of a vector f.
        """
        values = dict(given)
        if 1 in self.excitation:
            values["force_excitation"] = projected(self.excitation[1])
        values["force_harmonics"] = {h: projected(vector) for h, vector in self.excitation.items() if h != 1}
        values["force_static"] = None if self.static is None else projected(self.static)
        values["outputs"] = given["outputs"] | {name: projected(row) for name, row in self.outputs.items()}
        return values


@dataclass(frozen=True)
class InteriorLoads:
    """Load vectors of a model that is partitioned at its boundary dofs."""

    vectors: LoadVectors  # the vectors on interior (3i) and boundary dofs (b), one behind the other
    # (3i, k), real and imaginary parts of their interior parts, where these are not zero
    columns: NDArray[np.float64]

    @classmethod
    def of(
        cls, loads: LoadVectors, boundary: BoundaryDofs, interior: NDArray[np.int64], n_dofs: int
    ) -> InteriorLoads:
        """Partition vectors on the mesh displacements. Raises RomParameterError for one of another length."""
        inner = node_dofs(interior).ravel()

        def partitioned(name: str, vector: Vector) -> Vector:
            if vector.shape != (n_dofs,) or not np.all(np.isfinite(vector)):
                raise RomParameterError("loads", name, vector.shape, f"must be {n_dofs} finite numbers, one a dof")
            on_variables = boundary.transform_force(vector)
            return np.concatenate([on_variables[inner], boundary.rotation @ on_variables[boundary.dofs]])

        found = {name: partitioned(name, vector) for name, vector in loads.named()}
        excitation = {h: found["force/excitation" if h == 1 else f"force/excitation_{h}"] for h in loads.excitation}
        outputs = {name: found[f"output/{name}"] for name in loads.outputs}
        vectors = LoadVectors(excitation, found.get("force/static"), outputs)
        columns = vectors.columns()[: len(inner)]
        return cls(vectors, columns[:, columns.any(axis=0)])

    def selection(
        self, given: dict[str, Any], constraint: NDArray[np.float64], shapes: NDArray[np.float64]
    ) -> dict[str, Any]:
        """Forces and outputs of a reduced model, by argument of `ReducedModel`; `given` those of the boundary dofs.

        constraint (3i, b), shapes (3i, m): the interior motion of the reduced coordinates.
        """

        def projected(vector: Vector) -> Vector:
            inner, held = vector[: len(shapes)], vector[len(shapes) :]
            return np.concatenate([constraint.T @ inner + held, shapes.T @ inner])

        return self.vectors.selection(given, projected)


def with_attachment_modes(
    modes: ModalBasis, columns: NDArray[np.float64], responses: NDArray[np.float64], mass: Any
) -> ModalBasis:
    """Fixed-interface modes and behind them combinations of the static responses to some forces.

    The added shapes are orthonormal to each other and to the modes in the mass, and orthogonal in the stiffness.
    Shapes: `columns` (3i, k), `responses` (3i, k), `mass` (3i, 3i).
    """
    if not columns.shape[1]:
        return modes
    rest, forces = responses, columns
    for _ in range(2):  # the rest may be small beside the part in the modes
        shares = modes.shapes.T @ (mass @ rest)
        rest = rest - modes.shapes @ shares
        forces = forces - mass @ (modes.shapes @ (modes.omega[:, None] ** 2 * shares))
    before = np.sum(responses * (mass @ responses), axis=0)
    chosen = orthonormal_combinations(rest.T @ (mass @ rest), before)
    rest, forces = rest @ chosen, forces @ chosen
    stiffness = rest.T @ forces
    squared, turn = np.linalg.eigh(0.5 * (stiffness + stiffness.T))
    return ModalBasis(
        np.concatenate([modes.omega, np.sqrt(np.maximum(squared, 0.0))]), np.hstack([modes.shapes, rest @ turn])
    )
