"""Contact motions and flexibility of a blade without a disk, for any phase shift from blade to blade.

With the motions R and L of its right and left face and the flexibilities F of its modes, a wave with the phase alpha
from blade to blade has the flexibility of contacts

    (R - e^(i alpha) L) F (R - e^(i alpha) L)^H = R F R^T + L F L^T - e^(i alpha) L F R^T - e^(-i alpha) R F L^T.

The first two terms, the local flexibility of both faces, are the mean of all waves. The others are small for the
higher modes: what moves one face there hardly moves the other.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from nonlinear.contact.parameters import Array, ContactParameters
from nonlinear.stability.modal_condensation import poles_and_residues
from nonlinear.stability.perturbation_pencils import PerturbationPencils
from nonlinear.stability.shared_motions import SharedMotions, WeightedModes, contact_weights, unweighted
from rom import ModalModel

NEGLIGIBLE_MOTION = 0.02  # singular value of phi_m / omega_m times the square root of the contact stiffness
NEGLIGIBLE_ACROSS = 0.005  # of the flexibility from one face to the other, times the contact stiffness


@dataclass(frozen=True)
class FaceFlexibility(SharedMotions):
    """Contact motion under contact forces in any wave of a ring of blades."""

    angular_frequency: Array  # (q,), of the lowest modes
    damping: Array  # (q,), of the lowest modes
    right: Array  # (p, q), motions of the faces by these modes, in y
    left: Array  # (p, q), motions of the faces by these modes, in y
    stiffening: Array  # (q,), what contact springs add at most to the squares of the natural frequencies, (rad/s)^2
    across: Array  # (4, p, p), terms of R F L^T of the other modes, in y

    @classmethod
    def of(cls, modal: ModalModel, contact: ContactParameters, highest: float) -> "FaceFlexibility":
        """The flexibility of a blade."""
        assert modal.left is not None
        weight, frequency = contact_weights(contact), modal.angular_frequency
        low = frequency <= highest
        faces = [weight[:, None] * face for face in (modal.right, modal.left)]
        (low_r, high_r), (low_l, high_l) = (
            [WeightedModes(frequency[some], modal.damping[some], face[:, some]) for some in (low, ~low)]
            for face in faces
        )
        static = np.concatenate([low_r.motion, low_l.motion], axis=1) / np.tile(low_r.frequency, 2)
        across = high_r.term(0, high_l)
        scale = (NEGLIGIBLE_MOTION / NEGLIGIBLE_ACROSS) ** 2
        squared = static @ static.T + scale * (across @ across.T + across.T @ across)
        sizes, vectors = np.linalg.eigh(squared)
        vectors = vectors[:, sizes > NEGLIGIBLE_MOTION**2]
        return cls(
            *unweighted(high_r.terms() + high_l.terms(), vectors, weight),
            low_r.frequency,
            low_r.damping,
            vectors.T @ low_r.motion,
            vectors.T @ low_l.motion,
            np.sum((np.abs(low_r.motion) + np.abs(low_l.motion)) ** 2, axis=0),
            high_r.in_motions(vectors).terms(high_l.in_motions(vectors)),
        )

    @cached_property
    def rise(self) -> Array:
        """How far contacts raise the natural frequencies at most, (q,) rad/s."""
        return np.asarray(np.sqrt(self.angular_frequency**2 + self.stiffening) - self.angular_frequency)

    def pencils(self, phases: Array, harmonics: Array) -> PerturbationPencils:
        """The eigenvalue problems of several perturbations.

        Shapes: `phases` (K, S), `harmonics` (S,).
        """
        ahead = np.exp(1j * phases)[:, :, None, None]
        shape = *phases.shape, 1, 1
        poles, residues = (
            np.broadcast_to(part, (len(phases), *part.shape))
            for part in poles_and_residues(self.angular_frequency, self.damping, harmonics)
        )
        across = self.across
        return PerturbationPencils(
            harmonics,
            poles,
            residues,
            self.right - ahead * self.left,
            np.broadcast_to(self.rise, (*shape[:3], self.rise.size)),
            np.broadcast_to(self.stiffening, (*shape[:3], self.rise.size)),
            -ahead[..., None] * across.transpose(0, 2, 1) - ahead.conj()[..., None] * across,
        )
