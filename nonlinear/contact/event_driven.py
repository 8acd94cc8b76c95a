"""Event-driven contact element with two Jenkins elements per node: events located, intervals integrated exactly.

References
----------
B. D. Yang, M. L. Chu, C. H. Menq, Stick-slip-separation analysis and non-linear stiffness and damping
characterization of friction contacts having variable normal load, Journal of Sound and Vibration 210 (1998) 461-481.

E. P. Petrov, D. J. Ewins, Analytical formulation of friction interface elements for analysis of nonlinear
multi-harmonic vibrations of bladed disks, Journal of Turbomachinery 125 (2003) 364-371.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from nonlinear.contact.event_driven_cycle import SLIPS, STICKS, list_intervals
from nonlinear.contact.fourier_moments import integrate_basis, subtract_products
from nonlinear.contact.numba_cache import inner, lean
from nonlinear.contact.parameters import SLIP, Array, ContactForces, ContactParameters
from nonlinear.contact.return_map import Integers
from nonlinear.contact.trigonometric_roots import NOWHERE, PERIOD, cell_table

WHOLE_PERIOD = PERIOD - 1e-12  # intervals longer than this are the whole cycle


class NodeLaws(NamedTuple):
    """The parameters of all nodes as the kernels take them."""

    # (n_c, 3), u1 and u2 measured from where the sliders start and the unclipped load: offset + scale times (u1, u2,
    # d_n)
    scale: Array
    # (n_c, 3), u1 and u2 measured from where the sliders start and the unclipped load: offset + scale times (u1, u2,
    # d_n)
    offset: Array
    normal_stiffness: Array  # (n_c,), kn, kt, mu, mu / kt (0 where there is no tangential force) and N0
    tangential_stiffness: Array  # (n_c,), kn, kt, mu, mu / kt (0 where there is no tangential force) and N0
    friction: Array  # (n_c,), kn, kt, mu, mu / kt (0 where there is no tangential force) and N0
    mu_kt: Array  # (n_c,), kn, kt, mu, mu / kt (0 where there is no tangential force) and N0
    preload: Array  # (n_c,), kn, kt, mu, mu / kt (0 where there is no tangential force) and N0
    table: Array  # (2H+1, 3 cells), see `cell_table`


class Scratch(NamedTuple):
    """Memory of `evaluate_nodes`.

    `moments` is (5, 4H+1), `by_node` (n_c, 3, 3 cells) another view of `cells`, the others are those of
    `list_intervals`.
    """

    coefficients: Array
    by_node: Array
    cells: Array
    curves: Array
    bounds: Array
    intervals: Array
    spans: Integers
    moments: Array


@dataclass(frozen=True)
class EventDrivenJenkins:
    """Contact element without time samples (see `ContactElement`): exact forces and Jacobian for any motion.

    Taylor bounds in small cells of the period tell where N can change its sign and where the slider can meet its
    limits or leave them; elsewhere nothing happens, and no event can be missed. Stick, slip and contact intervals
    are then integrals of trigonometric polynomials. The Jacobian includes that the time of re-contact, where the
    slider restarts, moves.
    """

    parameters: ContactParameters
    n_harmonics: int

    @cached_property
    def laws(self) -> NodeLaws:
        """The parameters as the kernels take them."""
        p = self.parameters
        kn, kt = p.normal_stiffness, p.tangential_stiffness
        at_rest = np.zeros((1, p.n_contacts, 3))
        offset = p.from_slider_origin(at_rest)[0].copy()
        offset[:, 2] = p.load_coefficients(at_rest)[0]
        mu_kt = np.divide(p.friction, kt, out=np.zeros(p.n_contacts), where=kt > 0.0)
        scale = np.column_stack([np.ones((p.n_contacts, 2)), kn])
        kn, kt, mu, preload = (
            np.ascontiguousarray(values, dtype=float) for values in (kn, kt, p.friction, p.preload)
        )
        return NodeLaws(scale, offset, kn, kt, mu, mu_kt, preload, cell_table(self.n_harmonics))

    def scratch(self) -> Scratch:
        """Memory for `evaluate_nodes`."""
        size, n_contacts = 2 * self.n_harmonics + 1, self.parameters.n_contacts
        cells = 8 * self.n_harmonics
        values = np.empty((n_contacts, 3, 3, cells))
        return Scratch(
            coefficients=np.empty((n_contacts, 3, size)),
            by_node=values.reshape(n_contacts, 3, -1),
            cells=values,
            curves=np.empty((4, size)),
            bounds=np.empty((5, cells)),
            intervals=np.empty((n_contacts * 32 * (size + 1), 4)),
            spans=np.empty((n_contacts, 4, 2), np.int64),
            moments=np.zeros((5, 2 * size - 1)),
        )

    def evaluate(self, displacement: Array) -> ContactForces:
        """Forces and Jacobian for real coefficients `displacement` (2H+1, n_c, 3), metres."""
        size, n_contacts, _ = displacement.shape
        force, state = np.empty((size, n_contacts, 3)), np.empty(n_contacts, np.int64)
        jacobian = np.empty((n_contacts, 3, 3, size, size))
        motion = np.ascontiguousarray(displacement, dtype=float)
        evaluate_nodes(motion, self.laws, self.scratch(), force, jacobian, state)
        return ContactForces(force, jacobian, state)


@lean
def evaluate_nodes(
    displacement: Array, laws: NodeLaws, scratch: Scratch, force: Array, jacobian: Array, state: Integers
) -> None:
    """Write forces (2H+1, n_c, 3), Jacobian (n_c, 3, 3, 2H+1, 2H+1) and worst states of the nodes."""
    size, spans = displacement.shape[0], scratch.spans
    _write_coefficients(displacement, laws, scratch.coefficients, scratch.by_node)
    force[:], jacobian[:], spans[:] = 0.0, 0.0, 0
    intervals = scratch.intervals
    list_intervals(scratch.coefficients, scratch.cells, laws.mu_kt, scratch.curves, scratch.bounds, intervals, spans)
    law = (laws.normal_stiffness, laws.tangential_stiffness, laws.friction)
    for node in range(state.shape[0]):
        force[0, node, 2] = laws.preload[node]
    _integrate(scratch.coefficients, law, intervals, spans, scratch.moments, force, jacobian)
    for node in range(state.shape[0]):
        state[node] = spans[node, 3, 0]
        if laws.tangential_stiffness[node] > 0.0 and laws.friction[node] == 0.0 and state[node] < SLIP:
            # a slider that meets no resistance has no events, and slips whenever it moves
            for i in range(1, size):
                if displacement[i, node, 0] != 0.0 or displacement[i, node, 1] != 0.0:
                    state[node] = SLIP


@inner
def _write_coefficients(displacement: Array, laws: NodeLaws, coefficients: Array, cells: Array) -> None:
    """Write the coefficients of u1, u2 and the unclipped load, and their values in the cells, (n_c, 3, 3 cells)."""
    table = laws.table
    for node in range(coefficients.shape[0]):
        for direction in range(3):
            row, values = coefficients[node, direction], cells[node, direction]
            for i in range(row.shape[0]):
                row[i] = laws.scale[node, direction] * displacement[i, node, direction]
            row[0] += laws.offset[node, direction]
            for k in range(values.shape[0]):
                values[k] = 0.0
            for i in range(row.shape[0]):
                factor, shape = row[i], table[i]
                for k in range(values.shape[0]):
                    values[k] += factor * shape[k]


@inner
def _integrate(
    coefficients: Array,
    law: tuple[Array, Array, Array],
    intervals: Array,
    spans: Integers,
    work: Array,
    force: Array,
    jacobian: Array,
) -> None:
    """Add the Fourier coefficients of the reactions -(T1, T2, N) and their derivatives.

    `coefficients`, `intervals`, `spans`: see `list_intervals`; `law`: kn, kt and mu, (n_c,) each; `work` (5, 4H+1):
    scratch. Written: `force` (2H+1, n_c, 3), `jacobian` (n_c, 3, 3, 2H+1, 2H+1), worst states in `spans`.
    """
    normal_stiffness, tangential_stiffness, friction = law
    for node in range(spans.shape[0]):
        load, kn = coefficients[node, 2], normal_stiffness[node]
        for direction in range(3):
            motion, span = coefficients[node, direction], spans[node, direction]
            own, through = jacobian[node, direction, direction % 2], jacobian[node, direction, 2]
            kt, mu = (tangential_stiffness[node], friction[node]) if direction < 2 else (0.0, 1.0)  # N: as T in slip
            if span[1] > span[0]:
                slips = _add_intervals(intervals, span, kt, mu, work, own, through)
                _finish(own, through, kn, work, motion, load, force[:, node, direction])
                if slips and direction < 2 and spans[node, 3, 0] < SLIP:
                    spans[node, 3, 0] = SLIP


@inner
def _add_intervals(
    intervals: Array, span: Integers, kt: float, mu: float, work: Array, own: Array, through: Array
) -> bool:
    """Write the moments of stick and slip to work[2], work[3]; add memory to -T = own u + through N; does it slip?

    T = sign mu N in slip, T = kt (u - w) in stick. There w was set at the left end theta_s of the interval: by a slip
    that ended there, w = u(theta_s) - sign mu N(theta_s) / kt, or by re-contact, w = u(theta_s) with N(theta_s) = 0,
    hence dw = du(theta_s) - u'(theta_s) dN(theta_s) / N'(theta_s). Both are w = u - slip_sign mu N / kt (see
    `add_interval`).
    """
    moments = work[4]
    for m in range(moments.shape[0]):
        work[2, m], work[3, m] = 0.0, 0.0
    now, previous, slips = 0, -NOWHERE, False
    for k in range(span[0], span[1]):
        state, left, right, slip_sign = intervals[k, 0], intervals[k, 1], intervals[k, 2], intervals[k, 3]
        if left != previous:
            integrate_basis(left, 0.0, 0.0, work[now], work[now], moments, moments)
        now, previous = 1 - now, right
        row, factor = (3, slip_sign * mu) if state == SLIPS else (2, kt)
        # a whole period has no moments but its length: exactly, so that a large static load makes no vibration
        angle, here = left if right - left > WHOLE_PERIOD else right, work[1 - now]
        integrate_basis(angle, right - left, factor, here, work[now], moments, work[row])
        slips = slips or state == SLIPS
        if state == STICKS:
            _add_memory(kt, slip_sign * mu, moments, here, own, through)
    return slips


@inner
def _add_memory(kt: float, signed_mu: float, moments: Array, basis: Array, own: Array, through: Array) -> None:
    """Add kt w = kt u - slip_sign mu N at the angle where the `basis` is given, over an interval of stick."""
    size = own.shape[0]
    for i in range(size):
        weight = 2.0 * moments[i] if i > 0 else moments[0]
        held, pushed = weight * kt, weight * signed_mu
        for j in range(size):
            own[i, j] += held * basis[j]
            through[i, j] -= pushed * basis[j]


@inner
def _finish(own: Array, through: Array, kn: float, work: Array, motion: Array, load: Array, force: Array) -> None:
    """Add moments of stick and slip (work[2], work[3]) to -T = own u + through N; add its value to `force`."""
    size = motion.shape[0]
    subtract_products(own, work[2])
    subtract_products(through, work[3])
    for i in range(size):
        value = 0.0
        for j in range(size):
            value += own[i, j] * motion[j] + through[i, j] * load[j]
            through[i, j] *= kn
        force[i] += value
