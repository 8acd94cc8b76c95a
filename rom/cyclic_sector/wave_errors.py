"""Error of the natural frequencies of a reduced disk sector, against the whole mesh at a few nodal diameters."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rom.cyclic.natural_frequencies import natural_frequencies
from rom.cyclic.reduced_model import ReducedModel
from rom.errors import RomParameterError
from rom.reduction.interface_motion import InterfaceMotion

RIGID = 1e-4  # of the highest frequency: below, a motion is rigid and has no relative error


@dataclass(frozen=True)
class WaveErrors:
    """Relative errors of natural frequencies at several nodal diameters.

    Attributes
    ----------
    nodal_diameters : tuple of int
        The k nodal diameters.
    sampled : tuple of bool
        Whether the motions of the cut faces were taken from this nodal diameter, among others.
    errors : (k, m) array
        Reduced over exact frequency of each mode, less 1; 0 for rigid motions.

    Examples
    --------
    >>> from rom import WaveErrors
    >>> found = WaveErrors((0, 1), (True, False), np.array([[1e-5, 2e-4], [3e-5, 1e-3]]))
    >>> found.largest, found.largest_unsampled
    (0.001, 0.001)
    """

    nodal_diameters: tuple[int, ...]
    sampled: tuple[bool, ...]
    errors: NDArray[np.float64]

    @property
    def largest(self) -> float:
        """Largest modulus of all errors."""
        return float(np.abs(self.errors).max(initial=0.0))

    @property
    def largest_unsampled(self) -> float | None:
        """Largest modulus at the nodal diameters that were not sampled; None where there are none."""
        if all(self.sampled):
            return None
        return float(np.abs(self.errors[~np.array(self.sampled)]).max(initial=0.0))


def wave_errors(model: ReducedModel, interface: InterfaceMotion | None, count: int = 10) -> WaveErrors:
    """Errors of the natural frequencies of a reduced disk sector with free contacts.

    `interface_motion` leaves the frequencies of the whole mesh at the nodal diameters that it sampled and at one that
    it did not, the one farthest from the others. The errors are those of the motions of the cut faces and of the
    fixed-interface modes together, without that of the mesh.

    Parameters
    ----------
    model : ReducedModel
        The reduced model.
    interface : InterfaceMotion
        Its cut faces: `interface` of the choice that `interface_motion` made.
    count : int
        Number of lowest frequencies that are compared, at most as many as were computed.

    Returns
    -------
    WaveErrors
        The errors.

    Raises
    ------
    RomParameterError
        No frequencies of the whole mesh are known.

    Examples
    --------
    >>> from geometry import BladeParameters, DiskParameters, MeshParameters, ShroudParameters, build_sector
    >>> from rom import Material, ReductionOptions, assemble, cyclic_faces, interface_motion
    >>> from rom import reduce_sector, wave_errors
    >>> blade, shroud = BladeParameters(40, 0.3, 0.1, 0.02, 0.008), ShroudParameters(45.0, 0.01, 0.04, 0.01)
    >>> sector = build_sector(blade, shroud, MeshParameters(size=0.02), DiskParameters(0.1, 0.03))
    >>> steel = Material(2e11, 0.3, 7800.0)
    >>> full = assemble(sector, {"": steel, "disk": steel}, element="hex8")
    >>> choice = interface_motion(full, sector, cyclic_faces(full, sector))
    >>> model = reduce_sector(full, sector, ReductionOptions(modes=60), choice).model
    >>> found = wave_errors(model, choice.interface, count=4)
    >>> found.nodal_diameters, found.largest < 1e-3
    ((0, 2, 8, 20, 4), True)
    """
    references = () if interface is None else interface.references
    if not references or model.n_blades is None:
        raise RomParameterError("disk", "nodal_diameters", len(references), "must be a sector of interface_motion")
    kept = min(count, *(len(reference.frequency_hz) for reference in references))
    errors = np.zeros((len(references), kept))
    for row, reference in zip(errors, references, strict=True):
        exact = reference.frequency_hz[:kept]
        phase = 2.0 * np.pi * reference.nodal_diameter / model.n_blades
        found = natural_frequencies(model, phase, count=kept)
        elastic = exact > RIGID * exact[-1]
        row[elastic] = found[elastic] / exact[elastic] - 1.0
    return WaveErrors(
        tuple(reference.nodal_diameter for reference in references),
        tuple(reference.sampled for reference in references),
        errors,
    )
