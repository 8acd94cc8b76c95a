"""Validation of the parameters before anything is built."""

from dataclasses import replace
from functools import partial
from math import ceil, floor, isfinite, nan, pi
from numbers import Integral, Real

from geometry.edge_angle import AUTO, LARGEST_SLANT
from geometry.errors import GeometryError
from geometry.fit_check import check_fit, misfit_of
from geometry.parameters import (
    LARGEST_CAMBER,
    LARGEST_STAGGER,
    BladeParameters,
    DiskParameters,
    MeshParameters,
    ShroudParameters,
)
from geometry.planform import mid_radius
from geometry.remedies import rounded

SECTIONS = ("rectangle", "lens")
LARGEST_GRID = 100
LEAST_FILLET = 1e-3  # radius relative to the chord
LARGEST_GRADING = 100.0
LARGEST_MESH = 3_000_000  # elements
TRIAL_MESH = 20_000  # elements, of meshes that are only tried


def check_parameters(
    blade: BladeParameters, shroud: ShroudParameters, mesh: MeshParameters, disk: DiskParameters | None = None
) -> None:
    """Check that the parameters are in range and fit together.

    Parameters that fit take some milliseconds, without gmsh; to find the nearest values that would fit, and to mesh
    them, takes a second or two.

    Parameters
    ----------
    blade : BladeParameters
        The airfoil.
    shroud : ShroudParameters
        The shroud.
    mesh : MeshParameters
        The mesh density.
    disk : DiskParameters, optional
        The disk under the blade.

    Raises
    ------
    GeometryError
        The first parameter that is wrong, with the nearest value that would fit.

    Examples
    --------
    >>> from geometry import BladeParameters, MeshParameters, ShroudParameters, check_parameters
    >>> blade = BladeParameters(n_blades=40, hub_radius=0.3, length=0.1, chord=0.02, thickness=0.008)
    >>> shroud = ShroudParameters(angle=200.0, thickness=0.01, axial_width=0.04, contact_length=0.01)
    >>> check_parameters(blade, shroud, MeshParameters(size=0.01))
    Traceback (most recent call last):
    geometry.errors.GeometryError: shroud.angle = 200.0: must be above 0 and at most 180 degrees
    """
    _check_blade(blade)
    _check_shroud(shroud)
    _check_fillets(blade, shroud)
    _check_mesh(mesh)
    check_fit(blade, shroud, (partial(_accepts, mesh), partial(_accepts, None)), partial(_meshes, mesh))
    _check_size(blade, shroud, mesh)
    if disk is not None:
        from geometry.disk import check_disk

        check_disk(disk, blade, mesh)


def _accepts(mesh: MeshParameters | None, blade: BladeParameters, shroud: ShroudParameters) -> bool:
    """Whether a blade and its shroud are right, and right for a mesh."""
    try:
        _check_blade(blade)
        _check_shroud(shroud)
        _check_fillets(blade, shroud)
        if misfit_of(blade, shroud) is not None:
            return False
        if mesh is not None:
            _check_size(blade, shroud, mesh)
    except GeometryError:
        return False
    return True


def _meshes(mesh: MeshParameters, blade: BladeParameters, shroud: ShroudParameters) -> bool:
    """Whether gmsh makes a mesh of a blade and its shroud, of elements that are not much smaller than need be."""
    from geometry.layout import MeshingError
    from geometry.solid import swept_planform

    coarse = _smallest_size(blade, shroud) * (LARGEST_MESH / TRIAL_MESH) ** (1 / 3)
    try:
        swept_planform(blade, shroud, replace(mesh, size=max(mesh.size, coarse)))
    except MeshingError:
        return False
    return True


def _require(condition: bool, table: str, parameter: str, value: object, allowed: str) -> None:
    if not condition:
        raise GeometryError(table, parameter, value, allowed)


def _number(table: str, parameter: str, value: object, *, positive: bool = True) -> None:
    """Check for a finite real number, positive by default."""
    number = float(value) if isinstance(value, Real) and not isinstance(value, bool) else nan
    kind = "positive" if positive else "finite"
    good = isfinite(number) and (number > 0 or not positive)
    _require(good, table, parameter, value, f"must be a {kind} number")


def _integer(table: str, parameter: str, value: object, low: int, high: int) -> None:
    number = int(value) if isinstance(value, Integral) and not isinstance(value, bool) else low - 1
    _require(low <= number <= high, table, parameter, value, f"must be an integer from {low} to {high}")


def _check_blade(blade: BladeParameters) -> None:
    _integer("blade", "n_blades", blade.n_blades, 3, 10_000)
    for name in ("hub_radius", "length", "chord", "thickness"):
        _number("blade", name, getattr(blade, name))
    if blade.tip_thickness is not None:
        _number("blade", "tip_thickness", blade.tip_thickness)
    for name, limit in (("root_stagger", LARGEST_STAGGER), ("twist", LARGEST_STAGGER), ("camber", LARGEST_CAMBER)):
        _number("blade", name, getattr(blade, name), positive=False)
        within = f"must lie within -{limit:g} and {limit:g} degrees"
        _require(abs(getattr(blade, name)) <= limit, "blade", name, getattr(blade, name), within)
    _require(blade.section in SECTIONS, "blade", "section", blade.section, f"must be one of {', '.join(SECTIONS)}")


def _check_shroud(shroud: ShroudParameters) -> None:
    for name in ("thickness", "axial_width", "contact_length"):
        _number("shroud", name, getattr(shroud, name))
    for name in ("angle", "gap"):
        _number("shroud", name, getattr(shroud, name), positive=False)
    in_range = 0 < shroud.angle <= 180
    _require(in_range, "shroud", "angle", shroud.angle, "must be above 0 and at most 180 degrees")
    slanted = shroud.edge_angle != AUTO
    if slanted:
        _number("shroud", "edge_angle", shroud.edge_angle, positive=False)
    within = f'must be "auto" or lie within -{LARGEST_SLANT:g} and {LARGEST_SLANT:g} degrees'
    good = not slanted or abs(float(shroud.edge_angle)) <= LARGEST_SLANT
    _require(good, "shroud", "edge_angle", shroud.edge_angle, within)
    _require(shroud.gap >= 0, "shroud", "gap", shroud.gap, "must be 0 or more")


def _check_fillets(blade: BladeParameters, shroud: ShroudParameters) -> None:
    least = rounded(LEAST_FILLET * blade.chord, 3, ceil)
    for table, radius in (("blade", blade.fillet_radius), ("shroud", shroud.fillet_radius)):
        _number(table, "fillet_radius", radius, positive=False)
        allowed = f"must be 0 or at least a thousandth of the chord ({least:g} m)"
        _require(radius == 0 or radius >= least, table, "fillet_radius", radius, allowed)


def _check_mesh(mesh: MeshParameters) -> None:
    grid = mesh.contact_grid
    pair = isinstance(grid, tuple | list) and len(grid) == 2
    _require(pair, "mesh", "contact_grid", grid, "must be two integers: nodes along the contact and along its height")
    for count in grid:
        _integer("mesh", "contact_grid", count, 1, LARGEST_GRID)
    _number("mesh", "size", mesh.size)
    _number("mesh", "grading", mesh.grading)
    within = f"must be a number from 1 to {LARGEST_GRADING:g}"
    _require(1 <= mesh.grading <= LARGEST_GRADING, "mesh", "grading", mesh.grading, within)


def _check_size(blade: BladeParameters, shroud: ShroudParameters, mesh: MeshParameters) -> None:
    most = rounded(min(blade.length - shroud.thickness, shroud.axial_width) / 2, 6, floor)
    allowed = f"must be at most half the airfoil's length and half the axial width ({most:.6g} m)"
    _require(mesh.size <= most, "mesh", "size", mesh.size, allowed)
    least = rounded(_smallest_size(blade, shroud), 2, ceil)
    allowed = f"must be at least {least:.2g} m: a finer mesh has more than {LARGEST_MESH} elements"
    _require(mesh.size >= least, "mesh", "size", mesh.size, allowed)


def _smallest_size(blade: BladeParameters, shroud: ShroudParameters) -> float:
    """Edge length (m) of the cubes that fill the sector with ``LARGEST_MESH`` elements."""
    pitch = 2 * pi * mid_radius(blade, shroud) / blade.n_blades - shroud.gap
    platform = pitch * shroud.axial_width * shroud.thickness
    airfoil = blade.chord * blade.thickness * (blade.length - shroud.thickness)
    return float(((platform + airfoil) / LARGEST_MESH) ** (1 / 3))
