"""Reduced-order model of the blade: from mesh and material to a receptance in cyclic relative coordinates.

A name is imported from its file when it is first asked for: reading HDF5 needs neither SciPy nor scikit-fem.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rom.cyclic.expansion import expand
    from rom.cyclic.modal_model import ModalModel, modal_model
    from rom.cyclic.natural_frequencies import contact_motion, mode_shapes, natural_frequencies
    from rom.cyclic.receptance import RelativeReceptance, coupled_frequencies, linear_response
    from rom.cyclic.reduced_model import ReducedModel, ReducedModelError, inter_blade_phase
    from rom.errors import FactorisationError, FullModelFileError, RomParameterError
    from rom.files.full_model_file import load_full_model, save_full_model
    from rom.files.hdf5_reading import UNREADABLE, opened, stored_array, why_unreadable
    from rom.files.hdf5_writing import new_hdf5
    from rom.files.reduced_model_file import read_reduced_model, write_reduced_model
    from rom.files.sector_file import load_sector, save_sector
    from rom.finite_elements.full_model import FullModel, assemble
    from rom.finite_elements.material import Material
    from rom.finite_elements.rotation import centrifugal_displacement, spin
    from rom.linear_algebra.factorisation import Factor, factorise
    from rom.reduction.craig_bampton import Reduction, ReductionOptions, reduce, reduce_sector
    from rom.reduction.mode_selection import reduce_to_tolerance, reduction_errors
    from rom.reduction.model_comparison import (
        LinearError,
        LinearOperation,
        LinearResponse,
        linear_errors,
        linear_responses,
    )
    from rom.reduction.reference_model import FullReference, full_reference, static_error

__all__ = [
    "UNREADABLE",
    "Factor",
    "FactorisationError",
    "FullModel",
    "FullModelFileError",
    "FullReference",
    "LinearError",
    "LinearOperation",
    "LinearResponse",
    "Material",
    "ModalModel",
    "ReducedModel",
    "ReducedModelError",
    "Reduction",
    "ReductionOptions",
    "RelativeReceptance",
    "RomParameterError",
    "assemble",
    "centrifugal_displacement",
    "contact_motion",
    "coupled_frequencies",
    "expand",
    "factorise",
    "full_reference",
    "inter_blade_phase",
    "linear_errors",
    "linear_response",
    "linear_responses",
    "load_full_model",
    "load_sector",
    "modal_model",
    "mode_shapes",
    "natural_frequencies",
    "new_hdf5",
    "opened",
    "read_reduced_model",
    "reduce",
    "reduce_sector",
    "reduce_to_tolerance",
    "reduction_errors",
    "save_full_model",
    "save_sector",
    "spin",
    "static_error",
    "stored_array",
    "why_unreadable",
    "write_reduced_model",
]

_PLACES = {
    "UNREADABLE": "rom.files.hdf5_reading",
    "Factor": "rom.linear_algebra.factorisation",
    "FactorisationError": "rom.errors",
    "FullModel": "rom.finite_elements.full_model",
    "FullModelFileError": "rom.errors",
    "FullReference": "rom.reduction.reference_model",
    "LinearResponse": "rom.reduction.model_comparison",
    "LinearError": "rom.reduction.model_comparison",
    "LinearOperation": "rom.reduction.model_comparison",
    "Material": "rom.finite_elements.material",
    "ModalModel": "rom.cyclic.modal_model",
    "ReducedModel": "rom.cyclic.reduced_model",
    "ReducedModelError": "rom.cyclic.reduced_model",
    "Reduction": "rom.reduction.craig_bampton",
    "ReductionOptions": "rom.reduction.craig_bampton",
    "RelativeReceptance": "rom.cyclic.receptance",
    "RomParameterError": "rom.errors",
    "assemble": "rom.finite_elements.full_model",
    "centrifugal_displacement": "rom.finite_elements.rotation",
    "contact_motion": "rom.cyclic.natural_frequencies",
    "coupled_frequencies": "rom.cyclic.receptance",
    "expand": "rom.cyclic.expansion",
    "factorise": "rom.linear_algebra.factorisation",
    "full_reference": "rom.reduction.reference_model",
    "inter_blade_phase": "rom.cyclic.reduced_model",
    "linear_responses": "rom.reduction.model_comparison",
    "linear_errors": "rom.reduction.model_comparison",
    "linear_response": "rom.cyclic.receptance",
    "load_full_model": "rom.files.full_model_file",
    "load_sector": "rom.files.sector_file",
    "modal_model": "rom.cyclic.modal_model",
    "mode_shapes": "rom.cyclic.natural_frequencies",
    "natural_frequencies": "rom.cyclic.natural_frequencies",
    "new_hdf5": "rom.files.hdf5_writing",
    "opened": "rom.files.hdf5_reading",
    "read_reduced_model": "rom.files.reduced_model_file",
    "reduce": "rom.reduction.craig_bampton",
    "reduce_to_tolerance": "rom.reduction.mode_selection",
    "reduce_sector": "rom.reduction.craig_bampton",
    "reduction_errors": "rom.reduction.mode_selection",
    "save_full_model": "rom.files.full_model_file",
    "save_sector": "rom.files.sector_file",
    "spin": "rom.finite_elements.rotation",
    "static_error": "rom.reduction.reference_model",
    "stored_array": "rom.files.hdf5_reading",
    "why_unreadable": "rom.files.hdf5_reading",
    "write_reduced_model": "rom.files.reduced_model_file",
}


def __getattr__(name: str) -> Any:
    if name not in _PLACES:
        raise AttributeError(f"module 'rom' has no attribute {name!r}")
    return getattr(import_module(_PLACES[name]), name)


def __dir__() -> list[str]:
    return sorted([*globals(), *__all__])
