"""Linear elastic materials: isotropic, anisotropic, and over the temperature.

An anisotropic material is given in axes of its own, whose directions in the coordinates of the mesh are the rows of
`axes`. Over the temperature each value lies on straight lines between those given: Young's modulus and Poisson's
ratio of an isotropic material, the stiffnesses of an anisotropic one. The thermal strain integrates the expansion, or
takes it as the mean one from a temperature on.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rom.errors import RomParameterError, require_between
from rom.finite_elements.elastic_law import COLUMNS, ROWS, SIX, ElasticLaw

if TYPE_CHECKING:
    from rom.finite_elements.discretisation import DiscreteBlock

Array = NDArray[np.float64]
Number = TypeVar("Number", float, NDArray[np.float64])
PERPENDICULAR = 1e-6  # largest scalar product of two axes, of which each has length 1
KELVIN = 273.15  # that 0 degrees C are
POSITIVE = "must be a number above 0"


@dataclass(frozen=True)
class Material:
    """Linear elastic, isotropic material.

    Attributes
    ----------
    young_modulus : float
        Young's modulus, Pa.
    poisson_ratio : float
        Poisson's ratio.
    density : float
        Density, kg/m^3.
    expansion : float
        Coefficient of thermal expansion, 1/K.

    Raises
    ------
    RomParameterError
        No stable isotropic solid has these values, or Poisson's ratio is so near to 1/2 that displacement elements
        lock.

    Examples
    --------
    >>> from rom import Material
    >>> steel = Material(young_modulus=2.08e11, poisson_ratio=0.3, density=7800.0)
    >>> round(steel.lame[1] / 1e9, 6)  # shear modulus E / (2 + 2 nu), GPa
    80.0
    """

    young_modulus: float
    poisson_ratio: float
    density: float
    expansion: float = 0.0

    def __post_init__(self) -> None:
        require_between("material", "young_modulus", self.young_modulus, 0.0, math.inf, f"{POSITIVE} (Pa)")
        require_between(
            "material", "poisson_ratio", self.poisson_ratio, -1.0, 0.4999, "must lie between -1 and 0.4999"
        )
        _check_rest(self.density, np.array([self.expansion]))

    @property
    def lame(self) -> tuple[float, float]:
        """Lame's constants (lambda, mu) in Pa."""
        return lame_constants(self.young_modulus, self.poisson_ratio)

    @property
    def law(self) -> ElasticLaw:
        """The law of all elements of this material."""
        return ElasticLaw(self.density, *self.lame, expansion=self.expansion)


@dataclass(frozen=True)
class AnisotropicMaterial:
    """Linear elastic material with a stiffness in axes of its own.

    Attributes
    ----------
    stiffness : (6, 6) array
        Stiffness in the order 11, 22, 33, 23, 31, 12 with the shear angles as strains, Pa (Voigt); see
        `from_constants` for that of a cubic crystal or an orthotropic material.
    density : float
        Density, kg/m^3.
    expansion : float or (3,) array
        Coefficients of thermal expansion along the axes, 1/K.
    axes : (3, 3) array
        Directions of the axes 1, 2, 3 in the coordinates of the mesh, one a row, of length 1.

    Raises
    ------
    RomParameterError
        The stiffness is not symmetric and positive definite, or the axes are not perpendicular and right-handed.

    Examples
    --------
    A nickel crystal is twice as stiff along <111> as along <100>:

    >>> from rom import AnisotropicMaterial
    >>> crystal = AnisotropicMaterial.from_constants([1.25e11] * 3, [0.39] * 3, [1.25e11] * 3, density=8600.0)
    >>> [round(crystal.modulus_along(d) / 1e9) for d in ([1, 0, 0], [1, 1, 0], [1, 1, 1])]
    [125, 225, 307]
    """

    stiffness: ArrayLike
    density: float
    expansion: ArrayLike = 0.0
    axes: ArrayLike = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))

    def __post_init__(self) -> None:
        stiffness, axes = np.array(self.stiffness, dtype=float), np.array(self.axes, dtype=float)
        expansion = np.broadcast_to(np.asarray(self.expansion, dtype=float), (3,)).copy()
        for name, value in (("stiffness", stiffness), ("axes", axes), ("expansion", expansion)):
            object.__setattr__(self, name, value)
        if stiffness.shape != (6, 6) or not np.allclose(stiffness, stiffness.T, rtol=1e-6, atol=0.0, equal_nan=False):
            raise RomParameterError("material", "stiffness", stiffness.tolist(), "must be 6 x 6 and symmetric (Pa)")
        lowest = float(np.linalg.eigvalsh(stiffness)[0])
        if not lowest > 0.0:
            allowed = (
                f"must be positive definite: some strain would cost no energy (smallest eigenvalue {lowest:.3g} Pa)"
            )
            raise RomParameterError("material", "stiffness", stiffness.tolist(), allowed)
        off = np.abs(axes @ axes.T - np.eye(3)).max() if axes.shape == (3, 3) else np.inf
        if not off <= PERPENDICULAR or np.linalg.det(axes) < 0.0:
            raise RomParameterError(
                "material", "axes", axes.tolist(), "must be three perpendicular directions of length 1, right-handed"
            )
        _check_rest(self.density, expansion)

    @classmethod
    def from_constants(
        cls,
        moduli: ArrayLike,
        ratios: ArrayLike,
        shear_moduli: ArrayLike,
        density: float,
        expansion: ArrayLike = 0.0,
        axes: ArrayLike = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)),
    ) -> AnisotropicMaterial:
        """An orthotropic material of its nine constants; a cubic crystal has three times each of E, nu and G.

        Parameters
        ----------
        moduli : (3,) array
            Young's moduli E1, E2, E3, Pa.
        ratios : (3,) array
            Poisson's ratios nu12, nu13, nu23: the contraction along the second axis under a stress along the first.
        shear_moduli : (3,) array
            Shear moduli G12, G13, G23, Pa.
        density, expansion, axes
            As the attributes.
        """
        e, (n12, n13, n23), g = (np.asarray(given, dtype=float) for given in (moduli, ratios, shear_moduli))
        if not (np.all(np.isfinite([*e, n12, n13, n23, *g])) and min(*e, *g) > 0.0):
            given = [*map(float, e), float(n12), float(n13), float(n23), *map(float, g)]
            raise RomParameterError("material", "engineering_constants", given, "must have moduli above 0 (Pa)")
        compliance = np.diag([*(1.0 / e), 1.0 / g[2], 1.0 / g[1], 1.0 / g[0]])
        for (i, j), ratio in zip(((0, 1), (0, 2), (1, 2)), (n12, n13, n23), strict=True):
            compliance[i, j] = compliance[j, i] = -ratio / e[i]
        if (
            not np.linalg.eigvalsh(compliance * np.sqrt(np.outer(1 / np.diag(compliance), 1 / np.diag(compliance))))[
                0
            ]
            > 0
        ):
            given = [float(n12), float(n13), float(n23)]
            allowed = "must be so small that the stiffness is positive definite: nu12^2 < E1/E2 and so on"
            raise RomParameterError("material", "poisson_ratio", given, allowed)
        inverse = np.linalg.inv(compliance)
        return cls(0.5 * (inverse + inverse.T), density, expansion, axes)

    @property
    def is_cubic(self) -> bool:
        """Whether the stiffness has the symmetry of a cubic crystal in its axes."""
        c = np.asarray(self.stiffness)
        cubic = np.zeros((6, 6))
        cubic[:3, :3] = c[0, 1]
        cubic[range(6), range(6)] = [*[c[0, 0]] * 3, *[c[3, 3]] * 3]
        return bool(np.abs(c - cubic).max() < 1e-6 * c[0, 0])

    @property
    def in_mesh(self) -> Array:
        """Stiffness (6, 6) in the axes of the mesh, Pa."""
        axes = np.asarray(self.axes)
        tensor = np.asarray(self.stiffness)[SIX[:, :, None, None], SIX]
        turned = np.einsum("ijkl,ia,jb,kc,ld->abcd", tensor, axes, axes, axes, axes, optimize=True)
        return np.asarray(turned[ROWS[:, None], COLUMNS[:, None], ROWS, COLUMNS])

    @property
    def expansion_in_mesh(self) -> Array:
        """Expansion tensor (3, 3) in the axes of the mesh, 1/K."""
        axes = np.asarray(self.axes)
        return np.asarray(axes.T @ (np.asarray(self.expansion)[:, None] * axes))

    @property
    def law(self) -> ElasticLaw:
        """The law of all elements of this material."""
        return ElasticLaw(self.density, stiffness=self.in_mesh, expansion=self.expansion_in_mesh)

    def modulus_along(self, direction: ArrayLike) -> float:
        """Young's modulus along a direction, Pa.

        Parameters
        ----------
        direction : (3,) array
            In the coordinates of the mesh, of any length.
        """
        unit = np.asarray(direction, dtype=float) / np.linalg.norm(direction)
        stress = np.outer(unit, unit)[ROWS, COLUMNS]
        return float(1.0 / (stress @ np.linalg.solve(self.in_mesh, stress)))


Elastic = Material | AnisotropicMaterial


def lame_constants(modulus: Number, ratio: Number) -> tuple[Number, Number]:
    """Lame's constants (lambda, mu), Pa, of Young's modulus, Pa, and Poisson's ratio."""
    return modulus * ratio / ((1 + ratio) * (1 - 2 * ratio)), modulus / (2 * (1 + ratio))


def _check_rest(density: float, expansion: Array) -> None:
    require_between("material", "density", density, 0.0, math.inf, f"{POSITIVE} (kg/m^3)")
    for value in expansion:
        require_between("material", "expansion", float(value), -1.0, 1.0, "must be a number between -1 and 1 (1/K)")


@dataclass(frozen=True)
class MaterialTable:
    """A material over the temperature.

    Attributes
    ----------
    temperature : (k,) array
        Temperatures, ascending.
    states : tuple of Material or of AnisotropicMaterial
        The material at each of them; between them its values lie on straight lines.
    mean_from : float or None
        The temperature from which the expansions are mean ones, as handbooks give them; None: those at the
        temperature itself, which are integrated.
    extended : bool
        Whether the values at the ends hold beyond them; else a temperature there is an error.

    Raises
    ------
    RomParameterError
        The temperatures do not ascend, or the states are of different kinds or axes.

    Examples
    --------
    >>> from rom import Material, MaterialTable
    >>> cold, hot = Material(2e11, 0.3, 7800.0, 1e-5), Material(1.6e11, 0.3, 7800.0, 1.4e-5)
    >>> alloy = MaterialTable((20.0, 620.0), (cold, hot))
    >>> round(alloy.at(320.0).young_modulus / 1e9), float(alloy.free_strain(620.0) - alloy.free_strain(20.0))
    (180, 0.0072)
    """

    temperature: ArrayLike
    states: tuple[Elastic, ...]
    mean_from: float | None = None
    extended: bool = False

    def __post_init__(self) -> None:
        grid = np.array(self.temperature, dtype=float)
        object.__setattr__(self, "temperature", grid)
        if grid.ndim != 1 or not len(grid) or not np.all(np.isfinite(grid)) or np.any(np.diff(grid) <= 0.0):
            raise RomParameterError("material", "temperature", grid.tolist(), "must ascend from row to row")
        first = self.states[0] if len(self.states) == len(grid) else None
        if first is None or any(type(state) is not type(first) for state in self.states):
            raise RomParameterError("material", "states", len(self.states), f"must be {len(grid)} of one kind")
        if isinstance(first, AnisotropicMaterial) and any(
            not np.array_equal(first.axes, state.axes)
            for state in self.states
            if isinstance(state, AnisotropicMaterial)
        ):
            raise RomParameterError("material", "axes", "several", "must be the same at all temperatures")

    @property
    def ends(self) -> tuple[float, float]:
        """Lowest and highest temperature of the table."""
        grid = np.asarray(self.temperature)
        return float(grid[0]), float(grid[-1])

    def _check(self, temperature: ArrayLike, name: str = "", table: str = "load") -> None:
        """Raise RomParameterError for a temperature that the table does not reach."""
        low, high = self.ends
        if self.extended or len(self.states) == 1:
            return
        for value in (float(np.min(temperature)), float(np.max(temperature))):
            if not low <= value <= high:
                allowed = (
                    f"must lie within the table{name and ' of ' + name}, {low:g} to {high:g}, or extended = true"
                )
                other = next((value + shift for shift in (-KELVIN, KELVIN) if low <= value + shift <= high), None)
                allowed += "" if other is None else f" ({other:g} would, is one in K and one in degrees C?)"
                raise RomParameterError(table, "temperature", value, allowed)

    def at(self, temperature: float) -> Elastic:
        """The material at a temperature, with the expansion there as given.

        Parameters
        ----------
        temperature : float
            In the unit of the table.
        """
        self._check(temperature, table="material")
        values = [self._between(row, temperature) for row in self._rows]
        if isinstance(self.states[0], Material):
            return Material(*map(float, values))
        return AnisotropicMaterial(values[0], float(values[1]), values[2], self.states[0].axes)

    @property
    def _rows(self) -> tuple[Array, ...]:
        """The values over the table, each (k, ...), in the order of the fields of the material."""
        if isinstance(self.states[0], Material):
            names: tuple[str, ...] = ("young_modulus", "poisson_ratio", "density", "expansion")
        else:
            names = ("stiffness", "density", "expansion")
        return tuple(np.array([getattr(state, name) for state in self.states]) for name in names)

    def _between(self, rows: Array, temperature: ArrayLike) -> Array:
        """Values (..., r) at temperatures (...) of rows (k, r)."""
        grid, at = np.asarray(self.temperature), np.asarray(temperature, dtype=float)
        if len(grid) == 1:
            return np.broadcast_to(rows[0], (*at.shape, *rows.shape[1:]))
        at = np.clip(at, grid[0], grid[-1])
        k = np.clip(np.searchsorted(grid, at, side="right") - 1, 0, len(grid) - 2)
        share = ((at - grid[k]) / (grid[k + 1] - grid[k])).reshape(at.shape + (1,) * (rows.ndim - 1))
        return np.asarray((1.0 - share) * rows[k] + share * rows[k + 1])

    def free_strain(self, temperature: ArrayLike) -> Array:
        """Thermal strain (...) or (..., 3) along the axes, from some temperature on: differences count.

        Where expansions are mean ones it is alpha(T) (T - T0), else the integral of alpha.

        Parameters
        ----------
        temperature : (...) array
            In the unit of the table.
        """
        grid, at, rows = np.asarray(self.temperature), np.asarray(temperature, dtype=float), self._rows[-1]
        within = at.reshape(at.shape + (1,) * (rows.ndim - 1))
        local = self._between(rows, at)
        if self.mean_from is not None:
            return np.asarray(local * (within - self.mean_from))
        steps = np.diff(grid).reshape(-1, *(1,) * (rows.ndim - 1))
        sums = np.concatenate(
            [np.zeros((1, *rows.shape[1:])), np.cumsum(0.5 * steps * (rows[1:] + rows[:-1]), axis=0)]
        )
        k = np.clip(np.searchsorted(grid, at, side="right") - 1, 0, len(grid) - 1)
        return np.asarray(sums[k] + 0.5 * (rows[k] + local) * (within - grid[k].reshape(within.shape)))

    def _law_at(self, temperature: ArrayLike, reference: float) -> ElasticLaw:
        """The law at temperatures (e, q), or at one, free of thermal stress at the reference."""
        at = np.asarray(temperature, dtype=float)
        values = [self._between(row, at) for row in self._rows]
        strain = self.free_strain(at) - self.free_strain(reference)
        first = self.states[0]
        if isinstance(first, Material):
            lame, shear = lame_constants(values[0], values[1])
            return ElasticLaw(values[2], lame, shear, strain=strain)
        axes = np.asarray(first.axes)
        turned = np.array([state.in_mesh for state in self.states if isinstance(state, AnisotropicMaterial)])
        tensor = np.einsum("...i,ia,ib->...ab", strain, axes, axes, optimize=True)
        return ElasticLaw(values[1], stiffness=self._between(turned, at), strain=tensor)


AnyMaterial = Material | AnisotropicMaterial | MaterialTable


@dataclass(frozen=True)
class HotMaterials:
    """Materials over the temperature with the temperature of a mesh.

    Attributes
    ----------
    materials : Material, AnisotropicMaterial, MaterialTable, or mapping of str to these
        The material, or the materials by the names that the blocks of the mesh have.
    temperature : float or (V,) array
        Temperature of all points of the mesh, or of each, in the unit of the tables.
    reference : float
        Temperature without thermal stress.

    Examples
    --------
    >>> from rom import HotMaterials, Material, MaterialTable
    >>> alloy = MaterialTable((20.0, 620.0), (Material(2e11, 0.3, 7800.0), Material(1.6e11, 0.3, 7800.0)))
    >>> blade = HotMaterials({"": alloy, "disk": Material(2.1e11, 0.3, 7850.0)}, temperature=470.0)
    >>> round(blade.materials[""].at(blade.temperature).young_modulus / 1e9)
    170
    """

    materials: AnyMaterial | Mapping[str, AnyMaterial]
    temperature: float | Array
    reference: float = 20.0


Materials = AnyMaterial | Mapping[str, AnyMaterial] | HotMaterials


def material_of(materials: Materials, name: str) -> AnyMaterial:
    """The material of the elements whose material has a name ("": of those without one); one material is that of all.

    Raises RomParameterError where the name is not among the materials.
    """
    if isinstance(materials, HotMaterials):
        return material_of(materials.materials, name)
    if not isinstance(materials, Mapping):
        return materials
    if name in materials:
        return materials[name]
    known = ", ".join(f'"{other}"' for other in materials) or "none"
    raise RomParameterError(
        "materials", "name", name, f"must be given, elements of the mesh have it (given: {known})"
    )


def law_of(materials: Materials, block: DiscreteBlock, part: slice) -> ElasticLaw:
    """The law of some elements of a block, that of a table at the temperatures of the quadrature points.

    Raises RomParameterError where a material is not given, a table has no temperature or does not reach it.
    """
    material = material_of(materials, block.material)
    if not isinstance(material, MaterialTable):
        return material.law
    if not isinstance(materials, HotMaterials):
        raise RomParameterError("material", "temperature", "none", "must be given: the material is a table over it")
    nodal, reference = materials.temperature, materials.reference
    material._check(reference, block.material)
    if isinstance(nodal, np.ndarray):
        vertices = nodal[block.vertices[part]]
        material._check(vertices, block.material)
        at = np.clip(vertices @ block.table.geometry.T, vertices.min(), vertices.max())
        return material._law_at(at, reference)
    material._check(nodal, block.material)
    return material._law_at(nodal, reference)
