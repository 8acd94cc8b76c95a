"""Reduced-order model of the blade: from mesh and material to a receptance in cyclic relative coordinates."""

from rom.modal import ModalModel, modal_model
from rom.receptance import ReceptanceAt, RelativeReceptance, linear_response
from rom.reduced_model import ReducedModel, ReducedModelError
from rom.storage import read_reduced_model, write_reduced_model

__all__ = [
    "ModalModel",
    "ReceptanceAt",
    "ReducedModel",
    "ReducedModelError",
    "RelativeReceptance",
    "linear_response",
    "modal_model",
    "read_reduced_model",
    "write_reduced_model",
]
