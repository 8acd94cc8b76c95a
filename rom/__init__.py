"""Reduced-order model of the blade: from mesh and material to a receptance in cyclic relative coordinates."""

from rom.craig_bampton import Reduction, ReductionOptions, reduce, reduction
from rom.errors import FactorisationError, FullModelFileError, RomParameterError
from rom.expansion import expand
from rom.factorisation import Factor, factorise
from rom.full_model import FullModel, assemble
from rom.full_model_file import load_full_model, save_full_model
from rom.full_reference import FullReference, full_reference, static_error
from rom.linear_answers import LinearAnswer, LinearError, LinearOperation, linear_answers, linear_errors
from rom.material import Material
from rom.modal import ModalModel, modal_model
from rom.mode_choice import reduce_within, reduction_errors
from rom.natural_frequencies import contact_motion, mode_shapes, natural_frequencies
from rom.receptance import RelativeReceptance, coupled_frequencies, linear_response
from rom.reduced_model import ReducedModel, ReducedModelError, inter_blade_phase
from rom.rotation import centrifugal_displacement, spin
from rom.storage import read_reduced_model, write_reduced_model

__all__ = [
    "Factor",
    "FactorisationError",
    "FullModel",
    "FullModelFileError",
    "FullReference",
    "LinearAnswer",
    "LinearError",
    "LinearOperation",
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
    "linear_answers",
    "linear_errors",
    "linear_response",
    "load_full_model",
    "modal_model",
    "mode_shapes",
    "natural_frequencies",
    "read_reduced_model",
    "reduce",
    "reduce_within",
    "reduction",
    "reduction_errors",
    "save_full_model",
    "spin",
    "static_error",
    "write_reduced_model",
]
