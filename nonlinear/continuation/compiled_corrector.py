"""The compiled corrector of small problems: its arrays, and which problems it takes."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from nonlinear.contact.parameters import ContactForces
from nonlinear.continuation.corrector import Corrected, NormalPlane
from nonlinear.continuation.metric import Tangent
from nonlinear.harmonic_balance.interference_path import InterferenceChange
from nonlinear.harmonic_balance.residual import HarmonicBalance
from nonlinear.options import SolverOptions
from rom import RelativeReceptance

if TYPE_CHECKING:
    from nonlinear.contact.event_driven import EventDrivenJenkins, NodeLaws, Scratch
    from nonlinear.continuation.bordered_kernels import Iterate, Path, Plane, Structure, Workspace

MOST_UNKNOWNS = 420  # above, LAPACK takes most of a step and the corrector in Python loses little


def compiled_corrector(balance: HarmonicBalance, options: SolverOptions) -> CompiledCorrector | None:
    """The compiled corrector of a balance; None for one that is not small, or of other equations or contacts."""
    from nonlinear.contact.event_driven import EventDrivenJenkins

    element = balance.element
    if type(balance) is not HarmonicBalance and balance.interference_path is None:
        return None  # a subclass has equations of its own
    if type(balance.receptance) is not RelativeReceptance:
        return None
    if type(element) is not EventDrivenJenkins or balance.frozen_static is not None:
        return None
    return CompiledCorrector(balance, element, options) if balance.size <= MOST_UNKNOWNS else None


@dataclass(frozen=True)
class CompiledCorrector:
    """`corrector.correct` compiled whole for one balance. Not for several threads at once: they share its scratch."""

    # the equations, without a frozen static displacement; over the frequency, or over the interference
    balance: HarmonicBalance
    element: EventDrivenJenkins  # the contact element of the balance
    options: SolverOptions  # tolerances

    def correct(self, plane: NormalPlane, offset: Tangent | None, refactorise: bool) -> Corrected | None:
        """The solution in the plane, see `corrector.correct`."""
        from nonlinear.continuation.corrector_kernels import FAILED, correct_in_plane

        metric, kernel_plane = plane.metric, self._plane(plane)
        at = self._iterate(plane, offset)
        work = self._work
        count = correct_in_plane(self._structure, self._laws, kernel_plane, at, work, self._scratch, refactorise)
        if count == FAILED:
            return None
        sign = int(work.sizes[1])
        tangent = metric.unit((at.tangent * metric.length, float(at.omega[1]) * metric.omega))
        signs = sign, sign * int(np.sign(at.omega[1]))
        contact = ContactForces(at.force, at.jacobian, at.state)
        return Corrected(at.unknown, float(at.omega[0]), contact, (tangent, *signs), count)

    def rate(self, plane: NormalPlane, change: InterferenceChange) -> Tangent:
        """Change of the solution (x, omega) in which the plane touches the curve, per unit of a parameter."""
        from nonlinear.continuation.corrector_kernels import rate_in_plane

        at, metric, of_parameter = self._iterate(plane, None), plane.metric, (change.shift, change.defect_rate)
        rate_in_plane(self._structure, self._laws, self._plane(plane), at, self._work, self._scratch, of_parameter)
        return at.tangent * metric.length, float(at.omega[1]) * metric.omega

    def _plane(self, plane: NormalPlane) -> Plane:
        """The plane as the kernels take it."""
        from nonlinear.continuation.bordered_kernels import Plane

        direction, direction_omega = plane.direction
        metric, options = plane.metric, self.options
        scales = (metric.length, metric.omega, plane.max_distance, options.tolerance, options.round_off)
        return Plane(plane.unknown, direction, float(plane.omega), float(direction_omega), *map(float, scales))

    def _iterate(self, plane: NormalPlane, offset: Tangent | None) -> Iterate:
        """The predicted point, or the one at `offset` from it."""
        from nonlinear.continuation.bordered_kernels import Iterate

        rows, n_contacts = 2 * self.balance.n_harmonics + 1, self.balance.n_contacts
        unknown, omega = plane.unknown.copy(), plane.omega
        if offset is not None:
            unknown, omega = unknown + offset[0], omega + offset[1]
        return Iterate(
            unknown=unknown,
            residual=np.empty(unknown.size),
            motion=unknown.reshape(rows, n_contacts, 3),
            omega=np.array([omega, 0.0]),
            force=np.empty((rows, n_contacts, 3)),
            jacobian=np.empty((n_contacts, 3, 3, rows, rows)),
            state=np.empty(n_contacts, np.int64),
            tangent=np.empty(unknown.size),
        )

    @cached_property
    def _laws(self) -> NodeLaws:
        """The contact laws; where the interference is the parameter, with loads of their own."""
        laws = self.element.laws
        return laws if self.balance.interference_path is None else laws._replace(offset=laws.offset.copy())

    @cached_property
    def _path(self) -> Path:
        """What takes the place of the frequency."""
        from nonlinear.continuation.bordered_kernels import Path

        path, load = self.balance.interference_path, self.element.laws.offset[:, 2].copy()
        if path is None:
            return Path(0.0, 0.0, load, np.zeros(load.size), np.zeros(self.balance.size))
        return Path(float(path.frequency), float(path.origin), load, path.change.shift, path.change.defect_rate)

    @cached_property
    def _scratch(self) -> Scratch:
        return self.element.scratch()

    @cached_property
    def _structure(self) -> Structure:
        from nonlinear.continuation.bordered_kernels import Structure

        balance, receptance = self.balance, self.balance.receptance
        return Structure(
            relative=np.ascontiguousarray(receptance.relative),
            adjoint=receptance.adjoint,
            modal_force=receptance.modal_force,
            stiffness=np.ascontiguousarray(receptance.waves.angular_frequency**2, dtype=float),
            damping=np.ascontiguousarray(receptance.waves.damping, dtype=float),
            odd=balance.odd,
            floor=balance.tiny + balance.static_resolution,
            defect=np.zeros(balance.size) if balance.defect is None else balance.defect,
            path=self._path,
        )

    @cached_property
    def _work(self) -> Workspace:
        from nonlinear.continuation.bordered_kernels import Workspace

        n_h, size = self.balance.n_harmonics + 1, self.balance.size
        displacements, modes = self._structure.relative.shape[1:]
        of_modes, of_nodes = (n_h, modes), (n_h, displacements)
        receptance = np.empty((n_h, displacements, displacements), complex)
        receptance[0] = self.balance.receptance.static_matrix
        return Workspace(
            denominators=np.empty(of_modes, complex),
            rates=np.empty(of_modes, complex),
            coordinates=np.empty(of_modes, complex),
            weighted_force=np.empty(of_modes, complex),
            contact_force=np.empty(of_nodes, complex),
            response=np.empty(of_nodes, complex),
            receptance=receptance,
            weighted=np.empty((displacements, modes), complex),
            by_row=np.empty((2 * n_h - 1, self.balance.n_contacts, 3, 3 * (2 * n_h - 1))),
            coupling=np.empty((size, size)),
            dR_domega=np.empty(size),
            tangent=np.empty(size),
            columns=np.empty(size, np.int64),
            active=np.empty(size, np.int64),
            passive=np.empty(size, np.int64),
            matrix=np.empty((size + 1) ** 2),
            pivots=np.empty(size + 1, np.int32),
            right=np.empty(size + 1),
            sizes=np.zeros(3, np.int64),
        )
