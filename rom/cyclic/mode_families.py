"""Families of the modes of a bladed disk: motion of the airfoil by sections, strain energy of the disk.

Both are sums of squares of linear functions of the reduced coordinates: with these rows every mode of the reduced
model, at every nodal diameter, has its name without its shape on the mesh.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rom.cyclic.mode_names import FAMILIES, counted
from rom.cyclic.natural_frequencies import mode_shapes
from rom.cyclic.reduced_model import ReducedModel

DISK = "D"
MOSTLY = 0.5  # share of the strain energy from which a mode is one of the disk
_RIGID = 1e-6  # of the highest frequency asked for: a motion without strain


@dataclass(frozen=True)
class ModeFamilies:
    """Rows that tell the family of a mode from its reduced coordinates.

    Attributes
    ----------
    airfoil : (4 s, n) array
        Flap, edge, torsion and radial motion of s sections of the airfoil for unit coordinates, m.
    disk : (d, n) array
        Strain of the disk: the sum of squares is the disk's part of q^H K q, N/m.

    Examples
    --------
    Two masses of 1 kg, one of the airfoil in flap and one of the disk, on springs:

    >>> from rom import ModeFamilies, ReducedModel
    >>> along, one = np.zeros((3, 2)), np.ones(2)
    >>> model = ReducedModel(np.eye(2), np.diag([1e6, 4e6]), along, np.zeros((1, 3)), one, {"tip": one})
    >>> flap = np.array([[1.0, 0.0], [0.0, 0.0], [0.0, 0.0], [0.0, 0.0]])
    >>> hz, names, share = ModeFamilies(flap, np.array([[0.0, 2e3]])).modes(model, phase=0.0)
    >>> names, share.tolist()
    (['1F', '1D'], [0.0, 1.0])
    """

    airfoil: NDArray[np.float64]
    disk: NDArray[np.float64]

    def modes(
        self,
        model: ReducedModel,
        phase: float,
        *,
        normal: ArrayLike = 0.0,
        tangential: ArrayLike = 0.0,
        count: int = 10,
    ) -> tuple[NDArray[np.float64], list[str], NDArray[np.float64]]:
        """Lowest natural frequencies with the names of the modes and the share of the disk in their strain energy.

        Parameters
        ----------
        model : ReducedModel
            The reduced model.
        phase : float
            Inter-blade phase angle psi, rad.
        normal, tangential : float or (n_c,) array
            Contact springs, N/m, as in `natural_frequencies`.
        count : int
            Number of modes.

        Returns
        -------
        frequencies : (count,) array
            Natural frequencies in Hz, ascending.
        names : list of str
            1F, 1E, 1T, ... by the motion of the airfoil as in `mode_names`; 1D, 2D, ... where the disk has more than
            half of the strain energy; a motion without strain counts as one of the disk.
        share : (count,) array
            Share of the disk in the strain energy, 0 to 1.

        Raises
        ------
        ReducedModelError
            The mass is not positive definite.
        """
        rows = np.vstack([self.airfoil, self.disk])
        filled = np.zeros((3 * -(-len(rows) // 3), rows.shape[1]))  # a basis has three rows a node
        filled[: len(rows)] = rows
        springs: dict[str, Any] = {"normal": normal, "tangential": tangential}
        frequency, values = mode_shapes(replace(model, basis=filled), phase, count=count, **springs)
        squares = np.abs(values.reshape(len(frequency), -1)) ** 2
        last = len(self.airfoil)
        omega = 2.0 * np.pi * frequency
        elastic = omega > _RIGID * omega[-1]
        stored = squares[:, last : len(rows)].sum(axis=1)
        share = np.where(elastic, stored / np.where(elastic, omega, 1.0) ** 2, 1.0)
        family = squares[:, :last].reshape(len(frequency), len(FAMILIES), -1).sum(axis=2).argmax(axis=1)
        names = counted(
            DISK if part > MOSTLY else FAMILIES[number] for part, number in zip(share, family, strict=True)
        )
        return frequency, names, share
