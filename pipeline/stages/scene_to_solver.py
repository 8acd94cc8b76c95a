"""Sections of a scene as the objects of the packages `rom` and `nonlinear`: contact, excitation, options, modes.

Quantities of each contact node are formed by `ContactParameters.shared` alone; "punch" is resolved by
`resolved_contact` alone.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from geometry import SectorMesh
    from nonlinear import ContactParameters, Excitation, SolverOptions
    from pipeline.scene.schema import Contact, Load, Response, Scene
    from pipeline.scene.schema import Excitation as ExcitationSection
    from rom import LinearOperation, ReducedModel, RingModes


def resolved_contact(scene: Scene, face_area: float | None) -> Contact:
    """The section [contact] with "punch" replaced by numbers."""
    contact = scene.contact
    if not contact.uses_punch:
        return contact
    from nonlinear import punch_stiffness

    assert scene.material is not None  # the checks see to both
    assert face_area is not None
    normal, tangential = punch_stiffness(scene.material.young_modulus, scene.material.poisson_ratio, face_area)
    computed = {"normal_stiffness": normal, "tangential_stiffness": tangential}
    return contact.model_copy(
        update={name: value for name, value in computed.items() if getattr(contact, name) == "punch"}
    )


def contact_parameters(contact: Contact, n_contacts: int, area: NDArray[np.float64] | None) -> ContactParameters:
    """Parameters of each of the contact nodes, from a section [contact] that holds numbers only.

    `area` (n_c,) of the nodes, m^2, by which numbers for the whole face are shared; None: evenly.
    """
    from nonlinear import ContactParameters

    values = contact.model_dump(exclude={"integration", "samples"})
    return ContactParameters.shared(n_contacts, **values, area=area)


def contact_on_model(scene: Scene, model: ReducedModel) -> ContactParameters:
    """Parameters of each contact node of a reduced model."""
    return contact_parameters(resolved_contact(scene, face_area(model)), model.n_contacts, model.contact_area)


STATES = ("free", "sliding", "stuck")


def springs_by_state(contact: ContactParameters) -> dict[str, dict[str, Any]]:
    """Contact springs of each state of the shrouds: none when free, normal ones when sliding, all when stuck."""
    normal: dict[str, Any] = {"normal": contact.normal_stiffness}
    return dict(zip(STATES, ({}, normal, {**normal, "tangential": contact.tangential_stiffness}), strict=True))


def face_area(model: ReducedModel) -> float | None:
    """Area of the contact face, m^2; None where the model does not know it."""
    return None if model.contact_area is None else float(model.contact_area.sum())


def excitation(scene: Scene) -> Excitation:
    """The travelling-wave excitation."""
    return section_excitation(scene.excitation)


def section_excitation(section: ExcitationSection) -> Excitation:
    """The travelling-wave excitation of a section [excitation]."""
    from nonlinear import Excitation, ExcitationHarmonic

    harmonics = tuple(ExcitationHarmonic(item.order, item.amplitude, item.phase) for item in section.harmonic)
    return Excitation(section.engine_order, section.force, harmonics)


def solver_options(scene: Scene) -> SolverOptions:
    """Frequency range, harmonics, integration and method of the forced response."""
    from nonlinear import SolverOptions

    response, contact = scene.response, scene.contact
    return SolverOptions(
        frequency_hz=response.frequency,
        harmonics=response.harmonics,
        harmonic_tolerance=response.tolerance,
        samples=contact.samples,
        integration=contact.integration,
        method=response.method,
        stability=response.stability,
        detached=response.detached,
        truncation=response.truncation,
        residual_tractions=response.residual_tractions,
        search=response.search,
        outputs=tuple(output.name for output in scene.output),
    )


def nonlinear_problem(
    scene: Scene, model: ReducedModel
) -> tuple[RingModes, ContactParameters, Excitation, SolverOptions]:
    """What `forced_response` solves for a scene on a reduced model."""
    modal = damped_modes(model, scene.response, scene.load)
    return modal, contact_on_model(scene, model), excitation(scene), solver_options(scene)


def damped_modes(model: ReducedModel, response: Response, load: Load) -> RingModes:
    """The modal model of a reduced model with the damping and the speed of a scene."""
    from rom import modal_model

    return modal_model(
        model, damping_ratio=response.damping_ratio, rayleigh=response.rayleigh, speed_rpm=load.speed_rpm
    )


def linear_operation(scene: Scene, sector: SectorMesh) -> LinearOperation:
    """Frequency range, travelling wave, damping and contact springs of a scene on the mesh of its blade."""
    from rom import contact_areas, inter_blade_phase

    phase = inter_blade_phase(scene.excitation.engine_order, sector.n_blades)
    area = contact_areas(sector, scene.rom.contact_dofs)
    contact = resolved_contact(scene, float(area.sum()))
    return _linear_operation(scene, contact_parameters(contact, len(area), area), phase)


def linear_operation_on_model(scene: Scene, model: ReducedModel) -> LinearOperation:
    """The same on a reduced model of the blade."""
    from rom import inter_blade_phase

    phase = inter_blade_phase(scene.excitation.engine_order, model.n_blades)
    return _linear_operation(scene, contact_on_model(scene, model), phase)


def linear_operation_on_face(scene: Scene, face: ReducedModel) -> LinearOperation | None:
    """The same with the stiffness spread over the face of a model with a fine grid of contact nodes.

    None where the scene gives a stiffness node by node: what it is between the nodes is not known.
    """
    from nonlinear import ContactParameters
    from rom import inter_blade_phase

    contact = resolved_contact(scene, face_area(face))
    normal, tangential = contact.normal_stiffness, contact.tangential_stiffness
    if isinstance(normal, tuple) or isinstance(tangential, tuple):
        return None
    spread = ContactParameters.shared(
        face.n_contacts,
        normal_stiffness=float(normal),
        tangential_stiffness=float(tangential),
        friction=0.0,
        area=face.contact_area,
    )
    return _linear_operation(scene, spread, inter_blade_phase(scene.excitation.engine_order, face.n_blades))


def _linear_operation(scene: Scene, contact: ContactParameters, phase: float) -> LinearOperation:
    from rom import LinearOperation

    return LinearOperation(
        frequency_hz=scene.response.frequency,
        phase=phase,
        normal=contact.normal_stiffness,
        tangential=contact.tangential_stiffness,
        damping_ratio=scene.response.damping_ratio,
        rayleigh=scene.response.rayleigh,
    )
