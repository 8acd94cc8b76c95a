"""Reduced-order model of the blade: from mesh and material to the receptance of the relative contact displacement.

`finite_elements` assembles stiffness and mass, `reduction` condenses them by the Craig-Bampton method, `cyclic` holds
the reduced model and its modes, receptance and natural frequencies under cyclic symmetry, `linear_algebra` the sparse
factorisation and the eigenvalue solver, `stress` the stress on the mesh, `files` the HDF5 files. Docstrings cite the
paper by equation number.

A public name is imported from its file when it is first asked for: reading HDF5 needs neither SciPy nor scikit-fem.

References
----------
A. Gulisano, C. M. Firrone, S. Zucca, Forced response of shrouded blades with a coupled static/dynamic approach,
7th European Nonlinear Dynamics Conference (ENOC 2011), Rome, Italy, 2011.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rom.cyclic.aeroelastic_modes import aeroelastic_modes
    from rom.cyclic.contact_springs import SpringSupportedMotion, contact_springs, spring_stiffness
    from rom.cyclic.cyclic_symmetry import inter_blade_phase, relative_contact_motion, wave_coordinates
    from rom.cyclic.influence_coefficients import InfluenceCoefficients
    from rom.cyclic.modal_model import ModalModel, WaveModes
    from rom.cyclic.mode_families import ModeFamilies, blade_families, mode_names
    from rom.cyclic.mode_following import (
        FollowedModes,
        follow_modes,
        modal_assurance,
        modes_over_diameters,
        modes_over_speeds,
    )
    from rom.cyclic.natural_frequencies import (
        coupled_frequencies,
        gyroscopic_frequencies,
        linear_response,
        mode_shapes,
        natural_frequencies,
        natural_modes,
    )
    from rom.cyclic.pole_modes import PoleModes
    from rom.cyclic.receptance import RelativeReceptance, Support
    from rom.cyclic.reduced_model import (
        ContactInterface,
        ReducedModel,
        expand_to_mesh,
        interfaces_of,
        with_interfaces,
    )
    from rom.cyclic.resonance_crossings import (
        ResonanceCrossing,
        excited_nodal_diameter,
        resonance_crossings,
        signed_distance,
        speed_crossings,
        wave_direction,
    )
    from rom.cyclic.sector_modes import RingModes, SectorModes, modal_model
    from rom.cyclic.wave_superelement import WaveSuperelement, model_of_waves
    from rom.cyclic_sector.cyclic_faces import CyclicFaces, cyclic_faces
    from rom.cyclic_sector.cyclic_modes import CyclicModes, cyclic_modes, modes_by_nodal_diameter, static_motion
    from rom.cyclic_sector.interface_motion import InterfaceOptions, interface_motion
    from rom.cyclic_sector.part_stiffness import blade_stiffness, mode_families, strain_rows
    from rom.cyclic_sector.wave_reference import WaveErrors, wave_errors, wave_reference
    from rom.errors import (
        FactorisationError,
        FullModelFileError,
        MatrixFileError,
        ReducedModelError,
        RomParameterError,
    )
    from rom.files.full_model_file import load_full_model, save_full_model
    from rom.files.hdf5 import UNREADABLE, new_hdf5, opened, stored_array, why_unreadable
    from rom.files.reduced_model_file import read_reduced_model, write_reduced_model
    from rom.files.sector_file import load_sector, save_sector
    from rom.finite_elements.discretisation import element_warnings
    from rom.finite_elements.full_model import FullModel, assemble
    from rom.finite_elements.loads import nearest_vertices, nodal_force, pressure_force, thermal_force, traction_force
    from rom.finite_elements.material import Material
    from rom.finite_elements.rotation import centrifugal_displacement, stiffen_by_rotation
    from rom.finite_elements.strain_gauge import strain_row
    from rom.linear_algebra.blas_kernels import processor
    from rom.linear_algebra.factorisation import Factor, factorise
    from rom.linear_algebra.threads import one_blas_thread, one_blas_thread_in_children, require_memory
    from rom.matrix_files.labelled_matrix import DofLabels, LabelledMatrix
    from rom.matrix_files.matrix_choice import MatrixChoice
    from rom.matrix_files.matrix_file import read_matrix, write_matrices
    from rom.matrix_files.matrix_model import MatrixModel, model_from_matrices
    from rom.matrix_files.node_table import NodeTable, read_dofs, read_nodes
    from rom.matrix_files.superelement import model_from_superelement
    from rom.reduction.boundary_dofs import BoundaryChoice, LoadVectors, check_reducible
    from rom.reduction.contact_dofs import ContactNodes, contact_nodes
    from rom.reduction.craig_bampton import Reduction, ReductionOptions, reduce_sector
    from rom.reduction.floating_bodies import stuck_springs
    from rom.reduction.modal_forces import with_modal_forces
    from rom.reduction.mode_selection import reduce_to_tolerance, reduction_errors
    from rom.reduction.model_comparison import (
        LinearError,
        LinearOperation,
        LinearResponse,
        coriolis_error,
        linear_errors,
        linear_responses,
    )
    from rom.reduction.reference_model import FullReference, full_reference, held_frequencies, static_error
    from rom.reduction.rigid_body import RigidBody, platform_damper, with_damper, with_rigid_body
    from rom.stress.fatigue import FatigueLimits, StressCycle, stress_cycle
    from rom.stress.hot_spots import Surroundings, hot_spots, singular_vertices
    from rom.stress.mesh_motion import SolvedPoint
    from rom.stress.operating_stress import OperatingStress, nodal_stress, operating_stress
    from rom.stress.stress_recovery import NodalStress, von_mises
    from rom.units import angular_speed

__all__ = [
    "UNREADABLE",
    "BoundaryChoice",
    "ContactInterface",
    "ContactNodes",
    "CyclicFaces",
    "CyclicModes",
    "DofLabels",
    "Factor",
    "FactorisationError",
    "FatigueLimits",
    "FollowedModes",
    "FullModel",
    "FullModelFileError",
    "FullReference",
    "InfluenceCoefficients",
    "InterfaceOptions",
    "LabelledMatrix",
    "LinearError",
    "LinearOperation",
    "LinearResponse",
    "LoadVectors",
    "Material",
    "MatrixChoice",
    "MatrixFileError",
    "MatrixModel",
    "ModalModel",
    "ModeFamilies",
    "NodalStress",
    "NodeTable",
    "OperatingStress",
    "PoleModes",
    "ReducedModel",
    "ReducedModelError",
    "Reduction",
    "ReductionOptions",
    "RelativeReceptance",
    "ResonanceCrossing",
    "RigidBody",
    "RingModes",
    "RomParameterError",
    "SectorModes",
    "SolvedPoint",
    "SpringSupportedMotion",
    "StressCycle",
    "Support",
    "Surroundings",
    "WaveErrors",
    "WaveModes",
    "WaveSuperelement",
    "aeroelastic_modes",
    "angular_speed",
    "assemble",
    "blade_families",
    "blade_stiffness",
    "centrifugal_displacement",
    "check_reducible",
    "contact_nodes",
    "contact_springs",
    "coriolis_error",
    "coupled_frequencies",
    "cyclic_faces",
    "cyclic_modes",
    "element_warnings",
    "excited_nodal_diameter",
    "expand_to_mesh",
    "factorise",
    "follow_modes",
    "full_reference",
    "gyroscopic_frequencies",
    "held_frequencies",
    "hot_spots",
    "inter_blade_phase",
    "interface_motion",
    "interfaces_of",
    "linear_errors",
    "linear_response",
    "linear_responses",
    "load_full_model",
    "load_sector",
    "modal_assurance",
    "modal_model",
    "mode_families",
    "mode_names",
    "mode_shapes",
    "model_from_matrices",
    "model_from_superelement",
    "model_of_waves",
    "modes_by_nodal_diameter",
    "modes_over_diameters",
    "modes_over_speeds",
    "natural_frequencies",
    "natural_modes",
    "nearest_vertices",
    "new_hdf5",
    "nodal_force",
    "nodal_stress",
    "one_blas_thread",
    "one_blas_thread_in_children",
    "opened",
    "operating_stress",
    "platform_damper",
    "pressure_force",
    "processor",
    "read_dofs",
    "read_matrix",
    "read_nodes",
    "read_reduced_model",
    "reduce_sector",
    "reduce_to_tolerance",
    "reduction_errors",
    "relative_contact_motion",
    "require_memory",
    "resonance_crossings",
    "save_full_model",
    "save_sector",
    "signed_distance",
    "singular_vertices",
    "speed_crossings",
    "spring_stiffness",
    "static_error",
    "static_motion",
    "stiffen_by_rotation",
    "stored_array",
    "strain_row",
    "strain_rows",
    "stress_cycle",
    "stuck_springs",
    "thermal_force",
    "traction_force",
    "von_mises",
    "wave_coordinates",
    "wave_direction",
    "wave_errors",
    "wave_reference",
    "why_unreadable",
    "with_damper",
    "with_interfaces",
    "with_modal_forces",
    "with_rigid_body",
    "write_matrices",
    "write_reduced_model",
]

_PLACES = {
    "InfluenceCoefficients": "rom.cyclic.influence_coefficients",
    "aeroelastic_modes": "rom.cyclic.aeroelastic_modes",
    "wave_reference": "rom.cyclic_sector.wave_reference",
    "ResonanceCrossing": "rom.cyclic.resonance_crossings",
    "excited_nodal_diameter": "rom.cyclic.resonance_crossings",
    "resonance_crossings": "rom.cyclic.resonance_crossings",
    "signed_distance": "rom.cyclic.resonance_crossings",
    "speed_crossings": "rom.cyclic.resonance_crossings",
    "wave_direction": "rom.cyclic.resonance_crossings",
    "wave_coordinates": "rom.cyclic.cyclic_symmetry",
    "static_motion": "rom.cyclic_sector.cyclic_modes",
    "wave_errors": "rom.cyclic_sector.wave_reference",
    "WaveErrors": "rom.cyclic_sector.wave_reference",
    "interface_motion": "rom.cyclic_sector.interface_motion",
    "cyclic_modes": "rom.cyclic_sector.cyclic_modes",
    "cyclic_faces": "rom.cyclic_sector.cyclic_faces",
    "InterfaceOptions": "rom.cyclic_sector.interface_motion",
    "CyclicModes": "rom.cyclic_sector.cyclic_modes",
    "CyclicFaces": "rom.cyclic_sector.cyclic_faces",
    "BoundaryChoice": "rom.reduction.boundary_dofs",
    "DofLabels": "rom.matrix_files.labelled_matrix",
    "Factor": "rom.linear_algebra.factorisation",
    "FactorisationError": "rom.errors",
    "FatigueLimits": "rom.stress.fatigue",
    "FullModel": "rom.finite_elements.full_model",
    "FullModelFileError": "rom.errors",
    "FullReference": "rom.reduction.reference_model",
    "LabelledMatrix": "rom.matrix_files.labelled_matrix",
    "LinearError": "rom.reduction.model_comparison",
    "LinearOperation": "rom.reduction.model_comparison",
    "LinearResponse": "rom.reduction.model_comparison",
    "LoadVectors": "rom.reduction.boundary_dofs",
    "check_reducible": "rom.reduction.boundary_dofs",
    "nearest_vertices": "rom.finite_elements.loads",
    "nodal_force": "rom.finite_elements.loads",
    "strain_row": "rom.finite_elements.strain_gauge",
    "with_modal_forces": "rom.reduction.modal_forces",
    "Material": "rom.finite_elements.material",
    "MatrixChoice": "rom.matrix_files.matrix_choice",
    "MatrixFileError": "rom.errors",
    "MatrixModel": "rom.matrix_files.matrix_model",
    "ModalModel": "rom.cyclic.modal_model",
    "ModeFamilies": "rom.cyclic.mode_families",
    "NodalStress": "rom.stress.stress_recovery",
    "NodeTable": "rom.matrix_files.node_table",
    "OperatingStress": "rom.stress.operating_stress",
    "PoleModes": "rom.cyclic.pole_modes",
    "ContactInterface": "rom.cyclic.reduced_model",
    "ReducedModel": "rom.cyclic.reduced_model",
    "interfaces_of": "rom.cyclic.reduced_model",
    "with_interfaces": "rom.cyclic.reduced_model",
    "ReducedModelError": "rom.errors",
    "Reduction": "rom.reduction.craig_bampton",
    "ReductionOptions": "rom.reduction.craig_bampton",
    "RelativeReceptance": "rom.cyclic.receptance",
    "Support": "rom.cyclic.receptance",
    "RigidBody": "rom.reduction.rigid_body",
    "platform_damper": "rom.reduction.rigid_body",
    "with_damper": "rom.reduction.rigid_body",
    "with_rigid_body": "rom.reduction.rigid_body",
    "RingModes": "rom.cyclic.sector_modes",
    "SectorModes": "rom.cyclic.sector_modes",
    "WaveModes": "rom.cyclic.modal_model",
    "WaveSuperelement": "rom.cyclic.wave_superelement",
    "RomParameterError": "rom.errors",
    "SolvedPoint": "rom.stress.mesh_motion",
    "SpringSupportedMotion": "rom.cyclic.contact_springs",
    "StressCycle": "rom.stress.fatigue",
    "Surroundings": "rom.stress.hot_spots",
    "UNREADABLE": "rom.files.hdf5",
    "angular_speed": "rom.units",
    "assemble": "rom.finite_elements.full_model",
    "centrifugal_displacement": "rom.finite_elements.rotation",
    "ContactNodes": "rom.reduction.contact_dofs",
    "contact_nodes": "rom.reduction.contact_dofs",
    "stuck_springs": "rom.reduction.floating_bodies",
    "contact_springs": "rom.cyclic.contact_springs",
    "coriolis_error": "rom.reduction.model_comparison",
    "coupled_frequencies": "rom.cyclic.natural_frequencies",
    "element_warnings": "rom.finite_elements.discretisation",
    "expand_to_mesh": "rom.cyclic.reduced_model",
    "factorise": "rom.linear_algebra.factorisation",
    "full_reference": "rom.reduction.reference_model",
    "gyroscopic_frequencies": "rom.cyclic.natural_frequencies",
    "hot_spots": "rom.stress.hot_spots",
    "held_frequencies": "rom.reduction.reference_model",
    "inter_blade_phase": "rom.cyclic.cyclic_symmetry",
    "linear_errors": "rom.reduction.model_comparison",
    "linear_response": "rom.cyclic.natural_frequencies",
    "linear_responses": "rom.reduction.model_comparison",
    "load_full_model": "rom.files.full_model_file",
    "load_sector": "rom.files.sector_file",
    "modal_model": "rom.cyclic.sector_modes",
    "blade_stiffness": "rom.cyclic_sector.part_stiffness",
    "strain_rows": "rom.cyclic_sector.part_stiffness",
    "FollowedModes": "rom.cyclic.mode_following",
    "follow_modes": "rom.cyclic.mode_following",
    "modal_assurance": "rom.cyclic.mode_following",
    "modes_over_diameters": "rom.cyclic.mode_following",
    "modes_over_speeds": "rom.cyclic.mode_following",
    "natural_modes": "rom.cyclic.natural_frequencies",
    "blade_families": "rom.cyclic.mode_families",
    "mode_families": "rom.cyclic_sector.part_stiffness",
    "mode_names": "rom.cyclic.mode_families",
    "mode_shapes": "rom.cyclic.natural_frequencies",
    "model_from_matrices": "rom.matrix_files.matrix_model",
    "model_of_waves": "rom.cyclic.wave_superelement",
    "model_from_superelement": "rom.matrix_files.superelement",
    "modes_by_nodal_diameter": "rom.cyclic_sector.cyclic_modes",
    "natural_frequencies": "rom.cyclic.natural_frequencies",
    "new_hdf5": "rom.files.hdf5",
    "nodal_stress": "rom.stress.operating_stress",
    "one_blas_thread": "rom.linear_algebra.threads",
    "require_memory": "rom.linear_algebra.threads",
    "one_blas_thread_in_children": "rom.linear_algebra.threads",
    "opened": "rom.files.hdf5",
    "operating_stress": "rom.stress.operating_stress",
    "pressure_force": "rom.finite_elements.loads",
    "processor": "rom.linear_algebra.blas_kernels",
    "read_dofs": "rom.matrix_files.node_table",
    "read_matrix": "rom.matrix_files.matrix_file",
    "read_nodes": "rom.matrix_files.node_table",
    "read_reduced_model": "rom.files.reduced_model_file",
    "reduce_sector": "rom.reduction.craig_bampton",
    "reduce_to_tolerance": "rom.reduction.mode_selection",
    "reduction_errors": "rom.reduction.mode_selection",
    "relative_contact_motion": "rom.cyclic.cyclic_symmetry",
    "save_full_model": "rom.files.full_model_file",
    "save_sector": "rom.files.sector_file",
    "singular_vertices": "rom.stress.hot_spots",
    "spring_stiffness": "rom.cyclic.contact_springs",
    "static_error": "rom.reduction.reference_model",
    "stiffen_by_rotation": "rom.finite_elements.rotation",
    "stored_array": "rom.files.hdf5",
    "stress_cycle": "rom.stress.fatigue",
    "thermal_force": "rom.finite_elements.loads",
    "traction_force": "rom.finite_elements.loads",
    "von_mises": "rom.stress.stress_recovery",
    "why_unreadable": "rom.files.hdf5",
    "write_matrices": "rom.matrix_files.matrix_file",
    "write_reduced_model": "rom.files.reduced_model_file",
}


def __getattr__(name: str) -> Any:
    if name not in _PLACES:
        raise AttributeError(f"module 'rom' has no attribute {name!r}")
    return getattr(import_module(_PLACES[name]), name)


def __dir__() -> list[str]:
    return sorted([*globals(), *__all__])
