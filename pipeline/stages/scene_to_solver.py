"""Sections of a scene as the objects of the packages `rom` and `nonlinear`: contact, excitation, options, modes.

Quantities of each contact node are formed by `ContactParameters.shared` alone; "punch" and fields over the face are
resolved by `resolved_contacts` alone.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from pipeline.scene.blade_section import DAMPER, INTERFACES
from pipeline.scene.contact_section import AS_FIELD, OF_INTERFACE, PER_NODE, FaceField
from pipeline.scene.dotted_keys import NO_INTERFACE
from pipeline.scene.fields import values_for

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from geometry.sector import SectorMesh
    from nonlinear.contact.parameters import ContactParameters
    from nonlinear.options import Excitation, SolverOptions
    from pipeline.scene.aero_section import AeroFamily
    from pipeline.scene.contact_section import Contact
    from pipeline.scene.loads_section import Excitation as ExcitationSection
    from pipeline.scene.loads_section import Load
    from pipeline.scene.response_section import Response
    from pipeline.scene.schema import Scene
    from rom.cyclic.influence_coefficients import InfluenceCoefficients
    from rom.cyclic.reduced_model import ReducedModel
    from rom.cyclic.sector_modes import RingModes
    from rom.reduction.contact_dofs import ContactNodes
    from rom.reduction.model_comparison import LinearOperation


PLATFORM = "platform"  # pair of faces under which a damper lies
ONE_WAY = 0.7  # cosine of the largest angle between a normal and the mean normal of one face
NO_CONTACT = {"normal_stiffness": 0.0, "tangential_stiffness": 0.0, "friction": 0.0, "preload": 0.0}

# what a contact that is to have no effect needs to be solved as one: N/m, m
OUT_OF_REACH = {
    "normal_stiffness": 1e-6,
    "tangential_stiffness": 1e-6,
    "friction": 1.0,
    "preload": 0.0,
    "interference": -1.0,
}


@dataclass(frozen=True)
class InterfaceContact:
    """Contact of one interface of a reduced model: its section, which holds numbers only, and its nodes."""

    name: str  # the interface
    contact: Contact  # its parameters
    nodes: int  # number of its nodes


def resolved_contacts(scene: Scene, nodes: ContactNodes) -> tuple[InterfaceContact, ...]:
    """The contact of each interface with numbers for "punch", and numbers node by node for fields over the face.

    Interfaces that are left out have no springs.
    """
    found = []
    chosen = scene.contact.interfaces or scene.interfaces or tuple(nodes.interfaces)
    for name, own in nodes.split().items():
        contact = scene.contact_of(name)
        if name == NO_INTERFACE:  # of a sector without contact faces
            contact = contact.model_copy(update=OUT_OF_REACH)
        elif name not in chosen:
            contact = contact.model_copy(update=NO_CONTACT)
        contact = _resolved(scene, contact, None if own.area is None else float(own.area.sum()))
        fields = {key: value for key in PER_NODE if isinstance(value := getattr(contact, key), FaceField)}
        if fields:
            contact = contact.model_copy(update=_on_nodes(fields, own))
        found.append(InterfaceContact(name, contact, len(own.position)))
    return tuple(found)


def _on_nodes(fields: Mapping[str, FaceField], nodes: ContactNodes) -> dict[str, tuple[float, ...]]:
    """Values of fields over the face, node by node: of stiffnesses and preloads the shares of the nodes."""
    import numpy as np

    from nonlinear.contact.parameters import ContactParameters
    from rom.errors import ReducedModelError

    if nodes.frame is None:
        raise ReducedModelError(f"contact/frame: missing, allowed with {min(fields)} as {AS_FIELD}: a model with it")
    normals = nodes.frame[:, 2]
    if (normals @ normals.mean(axis=0)).min() < ONE_WAY * np.linalg.norm(normals.mean(axis=0)):
        name, allowed = next(iter(nodes.interfaces)), "numbers, or lists node by node, where it has several faces"
        raise ReducedModelError(f"interface {name}: {min(fields)} as {AS_FIELD}, allowed: {allowed}")
    ones: dict[str, Any] = dict.fromkeys(PER_NODE, 1.0)
    unit = ContactParameters.shared(len(nodes.position), **ones, area=nodes.area)
    x = nodes.coordinates
    bulge = (x**2 @ nodes.shares)[:, None] - x**2  # of mean 0
    values = {name: f.mean + np.array(f.tilt) @ x + np.array(f.crown) @ bulge for name, f in fields.items()}
    return {name: tuple((value * getattr(unit, name)).tolist()) for name, value in values.items()}


def _resolved(scene: Scene, contact: Contact, face_area: float | None) -> Contact:
    """A section [contact] with "punch" replaced by numbers."""
    if not contact.uses_punch:
        return contact
    from nonlinear.contact.parameters import punch_stiffness

    assert scene.material is not None  # the checks see to both
    assert face_area is not None
    normal, tangential = punch_stiffness(scene.material.young_modulus, scene.material.poisson_ratio, face_area)
    computed = {"normal_stiffness": normal, "tangential_stiffness": tangential}
    return contact.model_copy(
        update={name: value for name, value in computed.items() if getattr(contact, name) == "punch"}
    )


def contact_parameters(
    contacts: Sequence[InterfaceContact], area: NDArray[np.float64] | None = None
) -> ContactParameters:
    """Parameters of all contact nodes, one interface after the other.

    `area` (n_c,) of the nodes, m^2, by which numbers for a whole face are shared; None: evenly.
    """
    from nonlinear.contact.parameters import ContactParameters

    parts, first = [], 0
    for each in contacts:
        values = each.contact.model_dump(include={*OF_INTERFACE})
        own = None if area is None else area[first : first + each.nodes]
        parts.append(ContactParameters.shared(each.nodes, **values, area=own))
        first += each.nodes
    return ContactParameters.joined(*parts)


def contact_on_model(scene: Scene, model: ReducedModel) -> ContactParameters:
    """Parameters of each contact node of a reduced model."""
    from rom.reduction.contact_dofs import ContactNodes

    return contact_parameters(resolved_contacts(scene, ContactNodes.of(model)), model.contact_area)


def touching(scene: Scene, model: ReducedModel) -> ReducedModel:
    """A reduced model without the rows of contact interfaces that the scene leaves out."""
    from rom.cyclic.reduced_model import interfaces_of, with_interfaces
    from rom.errors import ReducedModelError

    chosen = scene.contact.interfaces
    if chosen is None or set(chosen) == set(model.interfaces):
        return model
    if unknown := set(chosen) - set(model.interfaces):
        raise ReducedModelError(f"contact/interfaces: no {min(unknown)}, allowed: {', '.join(model.interfaces)}")
    return with_interfaces(model, *(each for each in interfaces_of(model) if each.name in chosen))


def touching_sector(scene: Scene, sector: SectorMesh) -> SectorMesh:
    """A sector without the pairs of faces that the scene leaves out, so that they are no boundary of its models."""
    chosen = scene.contact.interfaces
    if chosen is not None and scene.damper_touches:
        chosen = (*chosen, PLATFORM)
    return sector if chosen is None else sector.with_only(chosen)


def interface_facts(scene: Scene, model: ReducedModel, sector: SectorMesh | None = None) -> dict[str, Any]:
    """For `facts.json` of a model: numbers of nodes of all interfaces, also of faces of the sector that are left out
    of the model, and of those that touch in a scene.
    """
    faces = {} if sector is None else sector.interfaces
    if set(INTERFACES[DAMPER]) & set(model.interfaces):
        faces.pop(PLATFORM, None)
    return {"n_contacts": touching(scene, model).n_contacts, "interfaces": {**faces, **model.interfaces}}


STATES = ("free", "sliding", "stuck")


def springs_by_state(contact: ContactParameters) -> dict[str, dict[str, Any]]:
    """Contact springs of each state of the shrouds: none when free, normal ones when sliding, all when stuck."""
    normal: dict[str, Any] = {"normal": contact.normal_stiffness}
    return dict(zip(STATES, ({}, normal, {**normal, "tangential": contact.tangential_stiffness}), strict=True))


def excitation(scene: Scene) -> Excitation:
    """The travelling-wave excitation."""
    return section_excitation(scene.excitation)


def section_excitation(section: ExcitationSection) -> Excitation:
    """The travelling-wave excitation of a section [excitation]."""
    from nonlinear.options import Excitation, ExcitationHarmonic

    harmonics = tuple(ExcitationHarmonic(item.order, item.amplitude, item.phase) for item in section.harmonic)
    return Excitation(section.engine_order, section.force, harmonics)


def solver_options(scene: Scene) -> SolverOptions:
    """Frequency range, harmonics, integration and method of the forced response."""
    from nonlinear.options import SolverOptions

    same = values_for(SolverOptions, scene.contact) | values_for(SolverOptions, scene.response)
    return SolverOptions(
        frequency_hz=scene.response.frequency,
        harmonic_tolerance=same.pop("tolerance"),  # that of the solver is the residual of Newton's method
        outputs=tuple(output.name for output in scene.output),
        **same,
    )


def nonlinear_problem(
    scene: Scene, model: ReducedModel
) -> tuple[RingModes, ContactParameters, Excitation, SolverOptions]:
    """What `forced_response` solves for a scene on a reduced model."""
    options = replace(solver_options(scene), largest_motion=size_of_body(scene, model))
    return scene_modes(scene, model), contact_on_model(scene, model), excitation(scene), options


def size_of_body(scene: Scene, model: ReducedModel) -> float:
    """Distance of the farthest contact node from the origin, m, beyond which no motion is one of a body that is held.

    Infinite for a model from elsewhere, whose places may be numbers of masses.
    """
    import numpy as np

    if scene.blade is None and scene.mesh_file is None:
        return np.inf
    return float(np.linalg.norm(model.contact_position, axis=1).max()) or np.inf


def scene_modes(scene: Scene, model: ReducedModel) -> RingModes:
    """The modal model of a reduced model with the damping, the speed, Coriolis forces and the flow of a scene."""
    return damped_modes(model, scene.response, scene.load, scene.aero_families())


def frequencies_of(scene: Scene, model: ReducedModel) -> Callable[..., NDArray[np.float64]]:
    """`natural_frequencies`, with the Coriolis forces where they act in the response: one number everywhere."""
    from rom.cyclic.natural_frequencies import gyroscopic_frequencies, natural_frequencies

    return gyroscopic_frequencies if coriolis_acts(scene, model) else natural_frequencies


def coriolis_acts(scene: Scene, model: ReducedModel) -> bool:
    """Whether Coriolis forces act in the response."""
    return scene.load.coriolis and model.has_coriolis and scene.load.speed_rpm != 0.0


def damped_modes(
    model: ReducedModel, response: Response, load: Load, families: Sequence[AeroFamily] = ()
) -> RingModes:
    """The modal model of a reduced model with damping, speed and flow; `families` hold their coefficients.

    Coriolis forces act where the loads ask for them, at a speed other than 0, and the model has their matrix.
    """
    from rom.cyclic.sector_modes import modal_model

    return modal_model(
        model,
        damping_ratio=response.damping_ratio,
        rayleigh=response.rayleigh,
        speed_rpm=load.speed_rpm,
        influence=[influence_of(each, model.n_blades or 1, load.speed_rpm) for each in families],
        coriolis=load.coriolis and model.has_coriolis,
    )


def influence_of(family: AeroFamily, n_blades: int, speed_rpm: float) -> InfluenceCoefficients:
    """The coefficients of a mode family on a ring at a speed, linear between those of its table."""
    import numpy as np

    from rom.cyclic.influence_coefficients import InfluenceCoefficients

    (speeds, frequencies), rows = family.axes(), family.rows()
    places = sorted({n % n_blades for n in family.places}) if family.offset is None else sorted(set(family.places))
    by_place = {
        key: {n if family.offset else n % n_blades: value for n, value in row.items()} for key, row in rows.items()
    }
    values = np.array(
        [[[by_place[s, f][n] for n in places] for f in frequencies or (0.0,)] for s in speeds or (0.0,)]
    )
    below = min(max(int(np.searchsorted(speeds, speed_rpm)) - 1, 0), max(len(speeds) - 2, 0))
    table = values[below]
    if len(speeds) > 1:
        share = (speed_rpm - speeds[below]) / (speeds[below + 1] - speeds[below])
        table = table + share * (values[below + 1] - table)
    at = 2.0 * np.pi * np.array(frequencies) if frequencies else None
    table = table if frequencies else table[0]
    if family.offset is not None:
        return InfluenceCoefficients(family.mode, np.array(places), table, at)
    return InfluenceCoefficients.of_waves(family.mode, table, at)


def linear_operation(scene: Scene, sector: SectorMesh) -> LinearOperation:
    """Frequency range, travelling wave, damping and contact springs of a scene on the mesh of its blade."""
    from rom.cyclic.cyclic_symmetry import inter_blade_phase
    from rom.reduction.contact_dofs import contact_nodes

    phase = inter_blade_phase(scene.excitation.engine_order, sector.n_blades)
    nodes = contact_nodes(sector, scene.rom.contact_dofs)
    return _linear_operation(scene, contact_parameters(resolved_contacts(scene, nodes), nodes.area), phase)


def linear_operation_on_model(scene: Scene, model: ReducedModel) -> LinearOperation:
    """The same on a reduced model of the blade."""
    from rom.cyclic.cyclic_symmetry import inter_blade_phase

    phase = inter_blade_phase(scene.excitation.engine_order, model.n_blades)
    return _linear_operation(scene, contact_on_model(scene, model), phase)


def linear_operation_on_face(scene: Scene, face: ReducedModel) -> LinearOperation | None:
    """The same with the stiffness spread over the face of a model with a fine grid of contact nodes.

    None where the scene gives a stiffness node by node: what it is between the nodes is not known.
    """
    from rom.cyclic.cyclic_symmetry import inter_blade_phase
    from rom.reduction.contact_dofs import ContactNodes

    given = [scene.contact_of(name) for name in face.interfaces]
    if any(isinstance(getattr(each, name), tuple) for each in given for name in PER_NODE[:2]):
        return None
    contacts = resolved_contacts(scene, ContactNodes.of(face))
    smooth = {"friction": 0.0, "interference": 0.0, "preload": 0.0}  # not of this linear problem
    spread = [replace(each, contact=each.contact.model_copy(update=smooth)) for each in contacts]
    phase = inter_blade_phase(scene.excitation.engine_order, face.n_blades)
    return _linear_operation(scene, contact_parameters(spread, face.contact_area), phase)


def _linear_operation(scene: Scene, contact: ContactParameters, phase: float) -> LinearOperation:
    from rom.reduction.model_comparison import LinearOperation

    return LinearOperation(
        frequency_hz=scene.response.frequency,
        phase=phase,
        normal=contact.normal_stiffness,
        tangential=contact.tangential_stiffness,
        damping_ratio=scene.response.damping_ratio,
        rayleigh=scene.response.rayleigh,
    )
