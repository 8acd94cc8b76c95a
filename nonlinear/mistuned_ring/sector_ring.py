"""Receptance of a ring of sectors joined at a disk, whose blades differ.

A force on one sector moves all of them, through the disk. In the wave l of a ring of N sectors, each in the time of
its own blade, the sectors have the phase h psi + 2 pi l / N from one to the next and modes of their own. With the
discrete Fourier transform over the sectors, x_j = N^(-1/2) sum_l exp(2 pi i j l / N) x_l,

    eta_l = (F_l + B_l^H f_l) / D_l,    D_l = omega_l^2 + i h omega c_l - (h omega)^2,    d_l = B_l eta_l,

where F_l is there in the wave 0 alone. The stiffness by which blade j differs acts like more contact nodes, with
linear springs: B_l holds the rows Q^T S of `strain_directions` below those of the contact motion.

In the bordered systems of a large ring the modes near the frequency carry the motion far around the ring: their
modal coordinates z are unknowns of their own, beside the border. What the other modes move further than the
neighbouring pairs is left out, as is what they make of the small forces -k s of the strains s = Q^T S q, in which k
is the stiffness by which the blades differ. With the relative displacements d the rest is block-tridiagonal and
cyclic,

    [ I - G_near df/dd   -B                   c ] [ d ]
    [ -D^-1 B^H df/dd     I + D^-1 S^H k S    0 ] [ z ],    s = S z + S_near df/dd d.
    [ t                   0                   e ] [ y ]

Its factors, also those of a state nearby, precondition GMRES [1]_ on the whole system, so that the solution is that
of the whole system.

References
----------
.. [1] Y. Saad, M. H. Schultz, GMRES: a generalized minimal residual algorithm for solving nonsymmetric linear
   systems, SIAM J. Sci. Stat. Comput. 7 (1986) 856-869.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.fourier import ComplexArray
from nonlinear.contact.parameters import Array
from nonlinear.harmonic_balance.condensed_factors import DenseFactors
from nonlinear.harmonic_balance.residual import BorderedFactors
from nonlinear.mistuned_ring.cyclic_blocks import CyclicBlockFactors, CyclicBlocks
from nonlinear.mistuned_ring.mistuned_structure import RingStructure, RingSystem, by_pair, from_pairs, real_product
from rom.cyclic.modal_model import WaveModes
from rom.cyclic.receptance import RelativeReceptance

SMALLEST_ITERATIVE = 400  # unknowns of a ring from which GMRES is faster than a dense factorisation
NEAR = 1.2  # ratio of frequencies up to which a mode carries motion far around the ring
SOLVED, ENOUGH = 1e-9, 1e-7  # relative residual asked for, and one that will do
ITERATIONS = 80
PATIENCE = 25  # iterations with the factors of another state


class WaveChoice(NamedTuple):
    """Some modes of the waves of one harmonic."""

    wave: NDArray[np.intp]  # (w,) number l
    mode: NDArray[np.intp]  # (w,) number of the mode


@dataclass(frozen=True)
class SectorRing(RingStructure):
    """The structure of a ring of sectors joined at a disk."""

    tuned: RelativeReceptance  # the tuned sector with its phase psi, harmonics and excitation
    n_sectors: int  # number N of sectors: that of the ring, or 1 where all move alike
    # (t, n), rows of the strains that mistuning needs, for unit reduced coordinates; t a multiple of three, or 0
    strain: Array

    @property
    def n_blades(self) -> int:
        """Number N of sectors."""
        return self.n_sectors

    @property
    def n_nodes(self) -> int:
        """Number of nodes of a pair, those of the strain counted."""
        return self.tuned.modal.n_contacts + len(self.strain) // 3

    @property
    def neighbours_only(self) -> bool:
        """Whether a force moves its own pair and the neighbouring ones alone."""
        return self.n_blades <= 3

    @cached_property
    def _harmonics(self) -> Array:
        return np.asarray(self.tuned.harmonics, dtype=float)

    @cached_property
    def _phases(self) -> Array:
        """Phases of the waves, (n_h, N), rad."""
        own = 2.0 * np.pi * np.arange(self.n_blades) / self.n_blades
        return self._harmonics[:, None] * self.tuned.phase + own

    @cached_property
    def modes(self) -> WaveModes:
        """Modes of all waves of all harmonics, n_h N rows, their strains below their relative contact motion.

        Rigid motions have no static response but on a support.
        """
        modal, support = self.tuned.modal, self.tuned.support
        waves = modal.waves(self._phases.ravel(), self._moving)
        frequency, relative = waves.angular_frequency.copy(), waves.relative
        strain = np.zeros((len(relative), len(self.strain), relative.shape[2]), complex)
        for row, phase in enumerate(self._phases.ravel().tolist()):
            own = modal.at_phase(phase)
            if len(self.strain):
                strain[row, :, : own.shapes.shape[1]] = self.strain @ own.shapes
            if support is not None and not self._moving[row]:
                frequency[row, : own.floating] = np.sqrt(support.stiffness)
        return replace(waves, angular_frequency=frequency, relative=np.concatenate([relative, strain], axis=1))

    @cached_property
    def waves(self) -> WaveModes:
        """What the sums are over: `modes`, or with Coriolis forces the poles, in harmonic 0 still the modes."""
        return self.tuned.modal.in_motion(self.modes, self._phases.ravel(), self._moving)

    @cached_property
    def _moving(self) -> list[bool]:
        """In which of the waves of all harmonics the ring vibrates."""
        return [bool(h) for h in self._harmonics for _ in range(self.n_blades)]

    @cached_property
    def motion(self) -> ComplexArray:
        """B_l: relative contact motion and strain of the modes, (n_h, N, 3 n_nodes, m)."""
        return self._by_harmonic(self.waves.relative)

    @cached_property
    def adjoint(self) -> ComplexArray:
        """B_l^H, (n_h, N, m, 3 n_nodes); with Coriolis forces what the poles take of forces at the nodes."""
        return self._by_harmonic(self.waves.adjoint)

    def _by_harmonic(self, values: NDArray[Any]) -> NDArray[Any]:
        """Values (n_h, N, ...) of those of all waves, (n_h N, ...)."""
        return values.reshape(*self._phases.shape, *values.shape[1:])

    @cached_property
    def modal_force(self) -> ComplexArray:
        """Modal forces of the waves, (n_h, N, m): the wave 0 holds those of the tuned sector."""
        own, size = self.tuned.modal_force, self.modes.angular_frequency.shape[1]
        found = np.zeros((*self._phases.shape, size), complex)
        found[:, 0, : own.shape[1]] = np.sqrt(self.n_blades) * own[:, :size]
        return self._by_harmonic(self.waves.pushed(found.reshape(-1, size)))

    def denominators(self, omega: float) -> tuple[ComplexArray, ComplexArray]:
        """D_l and its derivative in omega, (n_h, N, m)."""
        h, waves = self._harmonics[:, None, None], self.waves
        rate, squares = 1j * h * self._by_harmonic(waves.total_damping), waves.inertia * h**2
        value = rate * omega + (self._by_harmonic(waves.total_stiffness) - squares * omega**2)
        return np.asarray(value, complex), np.asarray(rate - 2.0 * squares * omega, complex)

    def pushed(self, force: ComplexArray) -> ComplexArray:
        """B_l^H f: modal forces of the waves, (n_h, N, m), of forces at the nodes (n_h, N, 3 n_nodes)."""
        found: ComplexArray = (self.adjoint @ np.fft.fft(force, axis=1, norm="ortho")[..., None])[..., 0]
        return found

    def relative(self, coordinates: ComplexArray) -> ComplexArray:
        """Relative displacements and strains of the pairs, (n_h, N, 3 n_nodes), of modal coordinates (n_h, N, m)."""
        found: ComplexArray = np.fft.ifft((self.motion @ coordinates[..., None])[..., 0], axis=1, norm="ortho")
        return found

    def output(self, name: str, coordinates: ComplexArray) -> ComplexArray:
        """An output of all blades, each in its own time, (N, n_h), of modal coordinates (n_h, N, m)."""
        rows = self._output_rows(name)
        return np.fft.ifft((rows * coordinates).sum(axis=-1), axis=1, norm="ortho").T

    def _output_rows(self, name: str) -> ComplexArray:
        if name not in self._outputs:
            rows = self.tuned.modal.wave_outputs(name, self._phases.ravel())
            rows = np.broadcast_to(rows, (self._phases.size, rows.shape[-1]))  # of a blade the same in all waves
            self._outputs[name] = self._by_harmonic(self.waves.rows(rows).astype(complex))
        return self._outputs[name]

    @cached_property
    def _outputs(self) -> dict[str, ComplexArray]:
        return {}

    @property
    def floating_motions(self) -> ComplexArray:
        """Motions of the nodes by bodies that contacts alone hold, in the waves of harmonic 0, (N, 3 n_nodes, r)."""
        return self.motion[0, :, :, : self.tuned.floating]

    @cached_property
    def factors(self) -> dict[int, NearFactors]:
        """The last factors of a bordered Jacobian by its size, for the states that follow."""
        return {}

    def near_flexibility(
        self, omega: float, chosen: list[WaveChoice], size: int
    ) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
        """Flexibility of a pair, under forces on the pair before it, on itself and on the pair after it.

        Shapes: returns `before, own, after` (n_h, 3 n_nodes, size).
        """
        weight = 1.0 / self.denominators(omega)[0]
        for row, (wave, mode) in zip(weight, chosen, strict=True):
            row[wave, mode] = 0.0
        every = (self.motion * weight[:, :, None]) @ self.adjoint[..., :size]
        count = self.n_blades
        turn = np.exp(2j * np.pi * np.multiply.outer((1, 0, -1), np.arange(count)) / count) / count
        before, own, after = np.einsum("pl,hlab->phab", turn, every)
        nothing = np.zeros_like(own)
        return before if count > 1 else nothing, own, after if count > 2 else nothing

    def flexibility(self, omega: float) -> ComplexArray:
        """Flexibility of a pair under forces on the pairs 0, 1, 2, ... before it.

        Shapes: returns (N, n_h, 3 n_nodes, 3 n_nodes).
        """
        every = (self.motion / self.denominators(omega)[0][:, :, None]) @ self.adjoint
        return np.fft.ifft(every, axis=1).transpose(1, 0, 2, 3)

    def coupling(self, omega: float, change: ComplexArray) -> tuple[Array, NDArray[np.intp]]:
        """G df/dx, (n, n), of changes of forces (see `pair_force_change`), and the indices of its columns: all."""
        count, n_rows, pair_dofs = self.n_blades, 2 * len(self.tuned.harmonics) - 1, 3 * self.n_nodes
        size = n_rows * pair_dofs
        found = np.empty((count, size, count, size))
        pairs = np.arange(count)
        for distance, block in enumerate(self.flexibility(omega)):
            before = (pairs - distance) % count
            found[pairs, :, before] = real_product(np.broadcast_to(block, (count, *block.shape)), change[before])
        indices = np.arange(count * size)
        place = indices.reshape(n_rows, count, -1).transpose(1, 0, 2).reshape(-1)
        whole = np.empty((indices.size, indices.size))
        whole[np.ix_(place, place)] = found.reshape(whole.shape)
        return whole, indices

    def factorise(self, system: RingSystem) -> BorderedFactors:
        """Factors of a bordered Jacobian: dense of a small ring, else solved by GMRES."""
        if system.column.size < SMALLEST_ITERATIVE:
            coupling = self.coupling(system.omega, system.change)
            return DenseFactors.of(coupling, system.column, system.row, system.corner)
        return SectorFactors(self, system)


def wave_turns(count: int, wave: NDArray[np.intp]) -> ComplexArray:
    """N^(-1/2) exp(2 pi i j l / N) of the sectors j in some waves l, (N, w)."""
    found: ComplexArray = np.exp(2j * np.pi * np.outer(np.arange(count), wave) / count) / np.sqrt(count)
    return found


@dataclass(frozen=True)
class NearFactors:
    """Factors of what is near to a bordered Jacobian, for displacements d, strains s, modal coordinates z and y."""

    factors: CyclicBlockFactors  # factors for d, and for (y, z) as border; s is eliminated
    # (N, rows t, w), strains of (y, z), and the transpose of the coefficients of s in the rows of (y, z)
    strain: Array
    # (N, rows t, w), strains of (y, z), and the transpose of the coefficients of s in the rows of (y, z)
    strain_row: Array
    change: ComplexArray  # (N, H+1, n_c, 3, 3 rows), df/dd, see `pair_force_change`
    # (H+1, t, 3 n_c), strains of a blade under forces on the pair before it, its own pair and the pair after it, m/N
    flexibility: tuple[ComplexArray, ComplexArray, ComplexArray]

    @classmethod
    def of(cls, ring: SectorRing, system: RingSystem) -> NearFactors:
        """Factorise."""
        count, rows, contacts = ring.n_blades, system.n_rows, ring.tuned.modal.n_contacts
        change, own = system.change, system.change[:, :, :contacts]
        chosen = [_far_reaching(ring, h, system.omega) for h in range((rows + 1) // 2)]
        near = ring.near_flexibility(system.omega, chosen, 3 * contacts)
        motion = _real_columns(ring, chosen, rows)
        force = _real_rows(ring, change, chosen, system.omega)
        beside, below = (by_pair(each, rows, count).reshape(count, rows, -1) for each in (system.column, system.row))
        strain = _with_border(motion, -beside, slice(3 * contacts, None))
        strain_row = _with_border(-force, below, slice(3 * contacts, None))
        end = np.eye(strain.shape[2])
        end[0, 0] = system.corner
        factors = CyclicBlockFactors.of(
            _near_blocks([each[:, : 3 * contacts] for each in near], own),
            _with_border(-motion, beside, slice(3 * contacts)),
            _with_border(-force, below, slice(3 * contacts)),
            end + np.einsum("kbw,kbv->wv", strain_row, strain),
        )
        before, middle, after = (each[:, 3 * contacts :] for each in near)
        return cls(factors, strain, strain_row, own, (before, middle, after))

    def solve(self, vector: Array) -> Array:
        """Solution (d, s, y) for a right-hand side in the order of the unknowns, (n + 1,)."""
        count, rows = len(self.strain), self.change.shape[-1] // 3
        contacts = 3 * self.change.shape[2]
        right = by_pair(vector[:-1], rows, count).reshape(count, rows, -1)
        strain = right[:, :, contacts:].reshape(self.strain.shape[:2])
        last = -np.einsum("kbw,kb->w", self.strain_row, strain)
        last[0] += vector[-1]
        displacement, border = self.factors.eliminated(right[:, :, :contacts].reshape(count, -1), last)
        displacement = displacement.reshape(count, rows, contacts)
        strain = (strain + self.strain @ border).reshape(right[:, :, contacts:].shape)
        found = np.concatenate([displacement, strain + self._strain_of(displacement)], axis=2)
        return np.append(from_pairs(found.reshape(count, -1), rows), border[0])

    def _strain_of(self, displacement: Array) -> Array:
        """Strains by the contact forces of displacements (N, rows, 3 n_c), (N, rows, t)."""
        count, rows, contacts = displacement.shape
        by_node = (
            displacement.reshape(count, rows, -1, 3).transpose(0, 2, 1, 3).reshape(count, 1, contacts // 3, -1, 1)
        )
        force = (self.change @ by_node).reshape(count, -1, contacts, 1)
        before, own, after = self.flexibility
        strain = own @ force + before @ np.roll(force, 1, axis=0) + after @ np.roll(force, -1, axis=0)
        real = np.empty((count, rows, strain.shape[2]))
        real[:, 0] = strain[:, 0, :, 0].real
        real[:, 1::2], real[:, 2::2] = strain[:, 1:, :, 0].real, strain[:, 1:, :, 0].imag
        return real


@dataclass(frozen=True)
class SectorFactors:
    """A bordered Jacobian of a ring, solved by GMRES."""

    ring: SectorRing  # keeps the last factors
    system: RingSystem

    @cached_property
    def near(self) -> NearFactors:
        """Factors of what is near to it; the ring keeps them for the states that follow."""
        found = NearFactors.of(self.ring, self.system)
        self.ring.factors[self.system.column.size] = found
        return found

    @property
    def sign(self) -> int:
        """Sign of the determinant of the system that is near to it."""
        return self.near.factors.sign

    def solve(self, right: Array, last: float) -> tuple[Array, float]:
        """Solution (x (n,), y) for the right-hand side (b (n,), b_e); NaN for a singular system."""
        whole = np.append(right, last)
        before = self.ring.factors.get(right.size)
        found = None if before is None else self._solved(whole, before, PATIENCE, 10.0 * SOLVED)
        if found is None:
            found = self._solved(whole, self.near, ITERATIONS, ENOUGH)
        if found is None:
            return np.full(right.shape, np.nan), np.nan
        return found[:-1], float(found[-1])

    def _solved(self, whole: Array, near: NearFactors, iterations: int, enough: float) -> Array | None:
        """The solution (n + 1,) with these factors; None where so many iterations leave a larger residual."""
        from scipy.sparse.linalg import LinearOperator, gmres

        def times(vector: Array) -> Array:
            return self._times(near.solve(vector))

        operator = LinearOperator((whole.size, whole.size), matvec=times, dtype=np.float64)
        with np.errstate(all="ignore"):
            if not np.isfinite(near.solve(whole)).all():
                return None
            found = near.solve(gmres(operator, whole, rtol=SOLVED, restart=iterations, maxiter=1)[0])
            left = np.linalg.norm(whole - self._times(found))
        return found if left <= enough * np.linalg.norm(whole) else None

    def _times(self, vector: Array) -> Array:
        x, y = vector[:-1], vector[-1]
        system = self.system
        return np.append(system.times(x) + y * system.column, system.row @ x + system.corner * y)


def _near_blocks(flexibility: list[ComplexArray], change: ComplexArray) -> CyclicBlocks:
    """I - G_near df/dd of the contact nodes of each pair."""
    before, own, after = (np.broadcast_to(each, (len(change), *each.shape)) for each in flexibility)
    blocks = -real_product(own, change)
    blocks[:, np.arange(blocks.shape[1]), np.arange(blocks.shape[1])] += 1.0
    return CyclicBlocks(
        -real_product(before, np.roll(change, 1, axis=0)), blocks, -real_product(after, np.roll(change, -1, axis=0))
    )


def _with_border(values: Array, first: Array, dofs: slice) -> Array:
    """A column (N, rows, 3 n_nodes) and values (N, rows, 3 n_nodes, w - 1) beside it, of some dofs, (N, b, w)."""
    whole = np.concatenate([first[:, :, dofs, None], values[:, :, dofs]], axis=3)
    return whole.reshape(len(whole), math.prod(whole.shape[1:3]), whole.shape[3])


def _far_reaching(ring: SectorRing, row: int, omega: float) -> WaveChoice:
    """The modes of one harmonic that are near its frequency; none in harmonic 0, and in small rings."""
    none: NDArray[np.intp] = np.zeros(0, dtype=np.intp)
    at = ring.tuned.harmonics[row] * omega
    if at == 0.0 or ring.neighbours_only:
        return WaveChoice(none, none)
    waves = ring.waves
    near = (waves.angular_frequency > at / NEAR) & (waves.angular_frequency < NEAR * at)
    if waves.turning is not None:
        near &= waves.turning.poles.imag > 0.0
    return WaveChoice(*np.nonzero(near.reshape(len(ring.tuned.harmonics), ring.n_blades, -1)[row]))


def _real_columns(ring: SectorRing, chosen: list[WaveChoice], rows: int) -> Array:
    """Motions of the nodes for unit Re z and Im z of the chosen modes, (N, rows, 3 n_nodes, w)."""
    parts = [np.zeros((ring.n_blades, rows, 3 * ring.n_nodes, 0))]
    for h, (wave, mode) in enumerate(chosen):
        moved = wave_turns(ring.n_blades, wave)[:, None, :] * ring.motion[h, wave, :, mode].T
        part = np.zeros((*moved.shape[:1], rows, moved.shape[1], 2 * wave.size))
        if wave.size:
            part[:, 2 * h - 1] = np.concatenate([moved.real, -moved.imag], axis=2)
            part[:, 2 * h] = np.concatenate([moved.imag, moved.real], axis=2)
        parts.append(part)
    return np.concatenate(parts, axis=3)


def _real_rows(ring: SectorRing, change: ComplexArray, chosen: list[WaveChoice], omega: float) -> Array:
    """Re z and Im z of the chosen modes for unit motions of the nodes, (N, rows, 3 n_nodes, w)."""
    count, nodes = ring.n_blades, ring.n_nodes
    rows, denominators = change.shape[-1] // 3, ring.denominators(omega)[0]
    parts = [np.zeros((count, rows, 3 * nodes, 0))]
    for h, (wave, mode) in enumerate(chosen):
        shapes = ring.adjoint[h, wave, mode] / denominators[h, wave, mode][:, None]
        by_node = shapes.reshape(wave.size, nodes, 3).transpose(1, 0, 2)
        pushed = (by_node @ change[:, h]).reshape(count, nodes, wave.size, rows, 3)
        pushed = wave_turns(count, wave).conj()[:, None, :, None, None] * pushed
        both = np.concatenate([pushed.real, pushed.imag], axis=2)
        parts.append(both.transpose(0, 3, 1, 4, 2).reshape(count, rows, 3 * nodes, 2 * wave.size))
    return np.concatenate(parts, axis=3)
