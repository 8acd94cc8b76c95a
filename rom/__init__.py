"""Reduced-order model of the blade: from mesh and material to a receptance in cyclic relative coordinates."""

from rom.craig_bampton import ReductionOptions, reduce
from rom.errors import FactorisationError, FullModelFileError, RomParameterError
from rom.expansion import expand
from rom.factorisation import Factor, factorise
from rom.full_model import FullModel, assemble
from rom.full_model_file import load_full_model, save_full_model
from rom.material import Material
from rom.modal import ModalModel, modal_model
from rom.natural_frequencies import contact_motion, mode_shapes, natural_frequencies
from rom.receptance import RelativeReceptance, coupled_frequencies, linear_response
from rom.reduced_model import ReducedModel, ReducedModelError
from rom.rotation import centrifugal_displacement, spin
from rom.storage import read_reduced_model, write_reduced_model

__all__ = [
    "Factor",
    "FactorisationError",
    "FullModel",
    "FullModelFileError",
    "Material",
    "ModalModel",
    "ReducedModel",
    "ReducedModelError",
    "ReductionOptions",
    "RelativeReceptance",
    "RomParameterError",
    "assemble",
    "centrifugal_displacement",
    "contact_motion",
    "coupled_frequencies",
    "expand",
    "factorise",
    "linear_response",
    "load_full_model",
    "modal_model",
    "mode_shapes",
    "natural_frequencies",
    "read_reduced_model",
    "reduce",
    "save_full_model",
    "spin",
    "write_reduced_model",
]
