"""The structure of a ring: blades that only their contacts join, or sectors that a disk joins."""

from nonlinear.time_integration.clamped_blades import BladeKernel, ClampedBlades
from nonlinear.time_integration.joined_sectors import JoinedSectors, SectorKernel
from nonlinear.time_integration.residual_flexibility import RetainedModes
from rom import ModalModel

RingStructure = ClampedBlades | JoinedSectors
Kernel = BladeKernel | SectorKernel


def ring_structure(modes: RetainedModes, n_blades: int) -> RingStructure:
    """The structure of q blades."""
    modal = modes.ring.modal
    return ClampedBlades(modal, modes, n_blades) if isinstance(modal, ModalModel) else JoinedSectors(modes, n_blades)
