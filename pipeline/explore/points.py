"""A point of a response: motion over a period, loops and states of the contact nodes, shape of the blade in time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from pipeline.render.operating_shapes import OperatingShape, shape_at
from pipeline.report.viewer import Surface, outer_surface
from pipeline.stages.scene_to_solver import excitation, nonlinear_problem, scene_modes

if TYPE_CHECKING:
    from geometry.sector import SectorMesh
    from nonlinear.contact.element_choice import ContactCycle
    from nonlinear.response_curve import ResponseCurve
    from pipeline.explore.models import LoadedModel
    from pipeline.scene.schema import Scene
    from rom.cyclic.reduced_model import ReducedModel

Array = NDArray[np.float64]
SAMPLES = 360  # instants of a period


@dataclass(frozen=True)
class ContactNodes:
    """The contact nodes of one interface."""

    interface: str  # its name
    nodes: range  # their numbers among those of all interfaces
    place_m: Array  # (n, 2), place on the face along t1 and t2 from its middle


@dataclass(frozen=True)
class LivePoint:
    """A solved point of a response."""

    # `frequency_hz`, `amplitude_m`: frequency, and largest displacement of the output over a period
    frequency_hz: float
    amplitude_m: float
    stable: bool
    angle: Array  # (S,), theta = omega t, rad
    output_m: Array  # (S,), displacement of the output at these instants
    cycle: ContactCycle  # displacement, force and state of each contact node at these instants
    interference_m: Array  # (n_c,), v0 of each node: v = v0 + d_n
    dissipated_j: Array  # (n_c,), friction work of each node per cycle
    state: NDArray[np.int64]  # (n_c,), worst state of each node: STICK, SLIP or LIFT_OFF of `nonlinear`
    interfaces: tuple[ContactNodes, ...]

    def loop(self, node: int, component: int) -> tuple[Array, Array]:
        """The closed loop of a node along t1 (0), t2 (1) or n (2): displacement, m, v along n, and force, N."""
        x = self.cycle.displacement[:, node, component]
        x = x + self.interference_m[node] if component == 2 else x
        y = self.cycle.force[:, node, component]
        return np.append(x, x[0]), np.append(y, y[0])


@dataclass(frozen=True)
class LiveShape:
    """The motion of the surface of a blade at a point of a response."""

    points: Array  # (n, 3), of the surface at rest, m
    surface: Surface  # its triangles and edges, by rows of `points`
    motion: OperatingShape  # of these points; `motion.at(angle, blade)` is (n, 3), m
    n_blades: int
    kind: str  # of the sector


def point_of(scene: Scene, loaded: LoadedModel, curve: ResponseCurve, index: int) -> LivePoint:
    """A point of a curve or of a branch beside it; `scene`: of which the curve is."""
    from nonlinear.contact.element_choice import contact_cycle
    from nonlinear.contact_states import nodal_contact
    from rom.reduction.contact_dofs import ContactNodes as NodesOfModel

    problem = nonlinear_problem(scene, loaded.model)
    cycle = contact_cycle(curve.relative_displacement[index], problem[1], samples=SAMPLES)
    nodal = nodal_contact(problem, curve, index)
    turned = np.exp(1j * np.outer(cycle.angle, np.arange(curve.output.shape[1])))
    interfaces, first = [], 0
    for name, own in NodesOfModel.of(loaded.model).split().items():
        nodes = range(first, first + len(own.position))
        place = own.position - own.position.mean(axis=0)
        along = place[:, :2] if own.frame is None else np.einsum("kab,kb->ka", own.frame, place)[:, :2]
        interfaces.append(ContactNodes(name, nodes, along))
        first = nodes.stop
    return LivePoint(
        float(curve.frequency_hz[index]),
        float(curve.amplitude_m[index]),
        bool(curve.stable[index]),
        cycle.angle,
        np.real(turned @ curve.output[index]),
        cycle,
        problem[1].interference,
        nodal.dissipated_j,
        nodal.state,
        tuple(interfaces),
    )


def shape_of(scene: Scene, on_mesh: tuple[ReducedModel, SectorMesh], curve: ResponseCurve, index: int) -> LiveShape:
    """The motion of the blade's surface at a point of a curve."""
    model, sector = on_mesh
    surface = outer_surface(sector)
    wave = scene_modes(scene, model), excitation(scene)
    place = float(curve.frequency_hz[index]), float(curve.amplitude_m[index])
    whole = shape_at(model, wave, place, curve.contact_force[index], len(sector.points))
    own = OperatingShape(*place, whole.phase, whole.harmonics[:, surface.vertices])
    return LiveShape(sector.points[surface.vertices], surface, own, sector.n_blades, sector.kind)
