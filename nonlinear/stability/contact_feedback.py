"""Contact forces on a flexibility, and the delayed friction forces beside them, in the condensed problem."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nonlinear.stability.block_matrices import HarmonicBlocks, Matrix, NodeBlocks
from nonlinear.stability.cone_slider_memory import ConeSliderMemory
from nonlinear.stability.modal_condensation import CondensedModes
from nonlinear.stability.slider_memory import SliderMemory


@dataclass(frozen=True)
class ContactFeedback:
    """Contact forces f = K d at lambda = 0 on a flexibility, d = d_free + G f; `factors` are those of I - G K."""

    contact: NodeBlocks
    flexibility: HarmonicBlocks
    factors: tuple[Any, Any]

    @classmethod
    def closed(cls, contact: NodeBlocks, flexibility: HarmonicBlocks) -> "ContactFeedback":
        """The loop of K and G."""
        from scipy.linalg import lu_factor

        return cls(contact, flexibility, lu_factor(contact.loop(flexibility), overwrite_a=True, check_finite=False))

    def observed(self, rows: Matrix) -> Matrix:
        """Rows (k, n) of d as rows of d_free: rows (I - G K)^-1."""
        from scipy.linalg import lu_solve

        return np.asarray(lu_solve(self.factors, rows.T, trans=1, check_finite=False)).T

    def reaction(self, rows: Matrix) -> Matrix:
        """Rows (k, n) of f as rows of d_free: rows K (I - G K)^-1."""
        return self.observed(self.contact.after(rows))

    def total(self, rows: Matrix, reaction: Matrix) -> Matrix:
        """Rows (k, n) of all forces, and their `reaction`, as rows of forces from outside: rows (I - K G)^-1."""
        return rows + self.flexibility.after(reaction)


@dataclass(frozen=True)
class SliderPlaces:
    """Where the M stretches of a memory stand among the rows (S, nodes, 3) of the contact motions.

    node : (M,) among those that touch, n_nodes of them. to_real : (S, S) real coefficients from harmonic amplitudes;
    None where the rows are real coefficients themselves. first : number of rows of S that are left out.
    """

    memory: SliderMemory
    node: NDArray[np.int64]
    n_nodes: int
    to_real: Matrix | None
    first: int

    def _spread(self, values: Matrix, direction: NDArray[np.int64] | int, scale: Matrix | float = 1.0) -> Matrix:
        """(M, S) as (M, S, nodes, 3), in the rows of each node and direction."""
        count = self.node.size
        result = np.zeros((count, values.shape[1], self.n_nodes, 3), dtype=values.dtype)
        result[np.arange(count), :, self.node, direction] = values * scale
        return result[:, self.first :].reshape(count, -1)

    def origin(self) -> Matrix:
        """Q^T: the slider positions dw(theta_s) = Q^T d, (M, n)."""
        values: Matrix = self.memory.origin
        if self.to_real is not None:
            values = values @ self.to_real
        return self._spread(values, self.memory.direction) + self._spread(values, 2, self.memory.ratio[:, None])

    def forces(self, exponent: complex) -> tuple[Matrix, Matrix]:
        """P(lambda) and its derivative, (n, M): f = P dw(theta_s), see `SliderMemory.force`."""
        values = self.memory.force(exponent)
        if self.to_real is not None:
            values = values[0] @ np.linalg.inv(self.to_real).T, values[1] @ np.linalg.inv(self.to_real).T
        value, slope = (self._spread(item, self.memory.direction).T for item in values)
        return value, slope


@dataclass(frozen=True)
class DelayedFriction:
    """What M delayed forces P(lambda) Q^T d add to S in lambda z = (L + B S C) z, S = K (I - G K)^-1 without them.

    With V = Q^T (I - G K)^-1 G and Z = (I - V P)^-1 it is (I - K G)^-1 P Z Q^T (I - G K)^-1. The slope G' of the
    flexibility acts through S G' S, with the whole S.

    inlet : B (I - K G)^-1, (n_z, n). feedback : V, (M, n). origin : Q^T (I - G K)^-1 C, (M, n_z).
    late : B S G' (I - K G)^-1, (n_z, n). late_feedback : Q^T (I - G K)^-1 G' (I - K G)^-1, (M, n).
    late_origin : Q^T (I - G K)^-1 G' S C, (M, n_z).
    """

    places: SliderPlaces
    inlet: Matrix
    feedback: Matrix
    origin: Matrix
    late: Matrix
    late_feedback: Matrix
    late_origin: Matrix

    @classmethod
    def of(
        cls,
        places: SliderPlaces,
        loop: ContactFeedback,
        slope: HarmonicBlocks,
        outlet: Matrix,
        inlet: Matrix,
        late: Matrix,
    ) -> "DelayedFriction":
        """From the loop at lambda = 0, G', C, and two of the fields: `inlet` and `late`."""
        observed = loop.observed(places.origin())
        late_observed = slope.after(observed)
        reaction = loop.reaction(late_observed)
        feedback, late_feedback = loop.flexibility.after(observed), loop.total(late_observed, reaction)
        return cls(places, inlet, feedback, observed @ outlet, late, late_feedback, reaction @ outlet)

    def added(self, exponent: complex) -> tuple[Matrix, Matrix, Matrix]:
        """At lambda = `exponent` w: B S C beyond that without delay, its derivative, and B S G' S C beyond."""
        force, change = self.places.forces(exponent)
        closed = np.linalg.inv(np.eye(len(self.origin)) - self.feedback @ force)
        seen = closed @ self.origin
        inlet = self.inlet @ force
        back = inlet @ closed
        late = (self.late @ force) @ seen + back @ (self.late_origin + (self.late_feedback @ force) @ seen)
        return inlet @ seen, (self.inlet @ change + back @ (self.feedback @ change)) @ seen, late


@dataclass(frozen=True)
class DelayedCone:
    """What sliders under the friction cone add to S in lambda z = (L + B S C) z: their Jacobian depends on lambda.

    memory : of the sliders. node : (M,) their nodes among those that touch. blade : L, B, C, G and G'.
    loop, reaction, late : at lambda = 0, with B S and B S G' S, (n_z, n). to_real, first : as in `SliderPlaces`.
    """

    memory: ConeSliderMemory
    node: NDArray[np.int64]
    blade: CondensedModes
    loop: ContactFeedback
    reaction: Matrix
    late: Matrix
    to_real: Matrix | None
    first: int

    def added(self, exponent: complex) -> tuple[Matrix, Matrix, Matrix]:
        """At lambda = `exponent` w: B S C beyond that at 0, its derivative, and B S G' S C beyond that at 0."""
        beyond, change = (self._blocks(values) for values in self.memory.jacobian(exponent))
        blade, loop, reaction, late = self.blade, self.loop, self.reaction, self.late
        if exponent != 0.0:
            loop = ContactFeedback.closed(NodeBlocks(loop.contact.values + beyond), blade.flexibility)
            reaction = loop.reaction(blade.inlet)
            late = loop.reaction(blade.slope.after(reaction))
        turned = loop.observed(NodeBlocks(change).after(loop.total(blade.inlet, reaction)))
        outlet = blade.outlet
        return (reaction - self.reaction) @ outlet, turned @ outlet, (late - self.late) @ outlet

    def _blocks(self, values: Matrix) -> Matrix:
        """(M, 2, 3, 2H+1, 2H+1) as values of `NodeBlocks`."""
        if self.to_real is not None:
            values = np.linalg.inv(self.to_real) @ values @ self.to_real
        result = np.zeros(self.loop.contact.values.shape, dtype=np.result_type(values, self.loop.contact.values))
        result[self.node, :, :2] = values.transpose(0, 3, 1, 4, 2)[:, self.first :, :, self.first :]
        return result
