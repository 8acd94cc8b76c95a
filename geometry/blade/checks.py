"""Validation of the parameters before anything is built; what does not fit is refused with values that do."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from math import ceil, floor, isfinite, nan, pi
from numbers import Integral, Real

from geometry.blade.fitting import (
    AUTO,
    LARGEST_SLANT,
    airfoil_fits,
    airfoils_touch,
    fitted_planform,
    misfit,
    without_notch,
)
from geometry.blade.parameters import (
    LARGEST_CAMBER,
    LARGEST_STAGGER,
    BladeParameters,
    DiskParameters,
    MeshParameters,
    PlatformParameters,
    ShroudParameters,
    SnubberParameters,
)
from geometry.blade.planform import inner_radius, mid_radius
from geometry.blade.remedies import ANY, SENSIBLE, Accepts, Search, rounded
from geometry.errors import GeometryError

MOST_WAYS = 3
Way = tuple[str, str, str]  # table, parameter, what works
Ways = Callable[[Search], Iterator[Way]]
SECTIONS = ("rectangle", "lens")
LARGEST_GRID = 100
LEAST_FILLET = 1e-3  # radius relative to the chord
LARGEST_GRADING = 100.0
LARGEST_MESH = 3_000_000  # elements
TRIAL_MESH = 20_000  # elements, of meshes that are only tried


def broken_relation(blade: BladeParameters, shroud: ShroudParameters) -> tuple[str, str, str] | None:
    """Table and name of the first parameter beyond a limit set by others, and the reason; None where all hold."""
    pitch = 2 * pi * mid_radius(blade, shroud) / blade.n_blades
    span = blade.length - shroud.thickness
    fillets = blade.fillet_radius + shroud.fillet_radius
    larger_fillet = "blade" if blade.fillet_radius >= shroud.fillet_radius else "shroud"
    turned = f"the chord at the shroud, turned by {blade.tip_stagger:g} degrees, must stay within {LARGEST_STAGGER:g}"
    chord = f"must be less than the chord ({blade.chord:g} m)"
    relations = [
        (abs(blade.tip_stagger) <= LARGEST_STAGGER, "blade", "twist", turned),
        (blade.thickness < blade.chord, "blade", "thickness", chord),
        ((blade.tip_thickness or 0.0) < blade.chord, "blade", "tip_thickness", chord),
        (span > 0, "shroud", "thickness", f"must be less than the blade's length ({blade.length:g} m)"),
        (
            shroud.gap <= pitch / 2,
            "shroud",
            "gap",
            f"must be at most half the pitch at the shroud ({pitch / 2:.6g} m)",
        ),
        (
            fillets <= span / 2,
            larger_fillet,
            "fillet_radius",
            "the two fillets take up more than half of the airfoil",
        ),
    ]
    return next(((table, name, reason) for holds, table, name, reason in relations if not holds), None)


def misfit_of(blade: BladeParameters, shroud: ShroudParameters) -> str | None:
    """Why a blade and its shroud do not fit together; None where they do."""
    broken = broken_relation(blade, shroud)
    if broken is not None:
        return broken[2]
    if airfoils_touch(blade, shroud):
        return "neighbouring airfoils would touch"
    return misfit(fitted_planform(blade, shroud))


def check_fit(
    blade: BladeParameters, shroud: ShroudParameters, accepts: tuple[Accepts, ...], meshes: Accepts
) -> None:
    """Check limits that depend on other parameters, neighbouring airfoils, side profile and airfoil on the planform.

    Raises ``GeometryError`` for the first parameter of which ``accepts`` takes another value, the first of several
    that takes one; it names that value and those of up to two other parameters. Each of them ``meshes``.
    """
    reason = misfit_of(blade, shroud)
    if reason is None:
        return
    broken = broken_relation(blade, shroud)
    if blade.sections is not None and (broken is None or broken[0] == "blade"):
        raise GeometryError("blade", "sections", blade.sections.name, _sections_and_ways(blade, shroud, reason))
    if broken is not None:
        table, parameter, _ = broken
        search = Search(blade, shroud, accepts[0], meshes)
        found = _first_ways(search, accepts, lambda search: _own_way(search, table, parameter))
    else:
        reason, ways = _reason_and_ways(blade, shroud, reason)
        found = _first_ways(Search(blade, shroud, accepts[0], meshes), accepts, ways)
        table, parameter, _ = found[0] if found else ("blade", "chord", "")
    value = getattr(blade if table == "blade" else shroud, parameter)
    texts = [text for _, _, text in found] or ["no other value of one key alone fits"]
    raise GeometryError(table, parameter, value, f"{reason}; {', or '.join(texts)}")


def _sections_and_ways(blade: BladeParameters, shroud: ShroudParameters, reason: str) -> str:
    """What to say of sections of points that do not fit, and what may be changed."""
    if airfoils_touch(blade, shroud):
        return f"{reason}; fewer blades, or other sections"
    size = f"{blade.chord:.6g} m long, turned by {blade.tip_stagger:.4g} degrees"
    return f"{reason}; the section there is {size}: shroud.axial_width, angle, contact_length or edge_angle may help"


def _reason_and_ways(blade: BladeParameters, shroud: ShroudParameters, reason: str) -> tuple[str, Ways]:
    """What to say of a blade and a shroud that do not fit together, and what to try."""
    if airfoils_touch(blade, shroud):
        return reason, _touching_ways
    plan = fitted_planform(blade, shroud)
    if airfoil_fits(without_notch(plan)):
        return reason, _profile_ways
    turned = f"turned by its stagger of {blade.tip_stagger:g} degrees"
    platform = f"{plan.width:g} m x {plan.pitch:.6g} m"
    return f"the section, {turned}, must fit on the shroud of {platform}", _section_ways


def _first_ways(search: Search, accepts: tuple[Accepts, ...], ways: Ways) -> list[Way]:
    """Up to three other values, the sensible ones first, one for each parameter."""
    for accept in accepts:
        for least, most_ways in ((SENSIBLE, MOST_WAYS), (ANY, 1)):
            found: dict[tuple[str, str], Way] = {}
            for way in ways(replace(search, accepts=accept, least=least)):
                found.setdefault(way[:2], way)
                if len(found) == most_ways:
                    break
            if found:
                return [*found.values()]
    for accept in accepts:
        smaller = [*_smaller_section(replace(search, accepts=accept))]
        if smaller:
            return smaller
    return []


def _own_way(search: Search, table: str, parameter: str) -> Iterator[Way]:
    """Another value of one parameter."""
    if parameter == "twist":
        yield from _nearest_angle(search, table, parameter, (-LARGEST_STAGGER, LARGEST_STAGGER))
    else:
        yield from _at_most(search, table, parameter)


def _touching_ways(search: Search) -> Iterator[Way]:
    """Other values with which neighbouring airfoils are apart."""
    yield from _at_most(search, "blade", "fillet_radius")
    yield from _at_most(search, "blade", "thickness")
    yield from _at_most(search, "blade", "tip_thickness")
    yield from _nearest_angle(search, "blade", "root_stagger", (-LARGEST_STAGGER, LARGEST_STAGGER))
    yield from _fewer_blades(search)
    yield from _airfoil_ways(search)


def _profile_ways(search: Search) -> Iterator[Way]:
    """Other values where the airfoil would fit on a platform with straight sides."""
    yield from _at_most(search, "shroud", "fillet_radius")
    yield from _nearest_angle(search, "shroud", "angle", (0.0, 180.0), "the nearest angle that fits is {:g}")
    yield from _at_most(search, "shroud", "contact_length")
    yield from _airfoil_ways(search)


def _section_ways(search: Search) -> Iterator[Way]:
    """Other values where the section is too large even for straight sides."""
    yield from _at_most(search, "shroud", "fillet_radius")
    yield from _airfoil_ways(search)


def _airfoil_ways(search: Search) -> Iterator[Way]:
    """Other values of all parameters but those of the contact segment."""
    blade, shroud = search.blade, search.shroud
    yield from _at_most(search, "blade", "chord")
    if shroud.edge_angle != AUTO:
        yield from _nearest_angle(search, "shroud", "edge_angle", (-LARGEST_SLANT, LARGEST_SLANT))
    width = search.smallest("shroud", "axial_width", shroud.axial_width)
    if width is not None:
        yield "shroud", "axial_width", f"shroud.axial_width at least {width:.6g} fits"
    yield from _at_most(search, "blade", "thickness" if blade.tip_thickness is None else "tip_thickness")
    yield from _fewer_blades(search)
    yield from _nearest_angle(search, "blade", "root_stagger", (-LARGEST_STAGGER, LARGEST_STAGGER))
    if blade.camber:
        yield from _nearest_angle(search, "blade", "camber", (-LARGEST_CAMBER, LARGEST_CAMBER))


def _at_most(search: Search, table: str, parameter: str) -> Iterator[Way]:
    value = getattr(search.blade if table == "blade" else search.shroud, parameter)
    most = search.largest(table, parameter, value) if value else None
    if most is not None:
        yield table, parameter, f"{table}.{parameter} {_at_most_or(search, table, parameter, most)}{most:.6g} fits"


def _smaller_section(search: Search) -> Iterator[Way]:
    blade = search.smaller_section()
    if blade is not None:
        tip = "" if blade.tip_thickness is None else f" and blade.tip_thickness {blade.tip_thickness:g}"
        yield "blade", "chord", f"blade.chord {blade.chord:g} with blade.thickness {blade.thickness:g}{tip} fits"


def _fewer_blades(search: Search) -> Iterator[Way]:
    count = search.fewer_blades()
    if count is not None:
        yield "blade", "n_blades", f"blade.n_blades {_at_most_or(search, 'blade', 'n_blades', count)}{count} fits"


def _at_most_or(search: Search, table: str, parameter: str, value: float) -> str:
    """ "at most " where lower values fit too; a value alone may be the only one that does."""
    return "at most " if search.all_below(table, parameter, value) else ""


def _nearest_angle(
    search: Search, table: str, parameter: str, limits: tuple[float, float], text: str = ""
) -> Iterator[Way]:
    angle = search.nearest_angle(table, parameter, limits)
    if angle is not None:
        yield table, parameter, text.format(angle) or f"{table}.{parameter} {angle:g} fits"


def check_parameters(
    blade: BladeParameters,
    shroud: ShroudParameters | None,
    mesh: MeshParameters,
    disk: DiskParameters | None = None,
    *,
    snubber: SnubberParameters | None = None,
    platform: PlatformParameters | None = None,
) -> None:
    """Check that the parameters are in range and fit together.

    Parameters that fit take some milliseconds, without gmsh; to find the nearest values that would fit, and to mesh
    them, takes a second or two.
    """
    _check_blade(blade)
    if shroud is None:
        from geometry.blade.unshrouded import with_scaffold

        told = "must be given where there is neither a snubber nor a platform"
        _require(snubber is not None or platform is not None, "shroud", "angle", None, told)
        blade, shroud = with_scaffold(blade)
    _check_shroud(shroud)
    _check_fillets(blade, shroud)
    _check_mesh(mesh)
    if blade.sections is not None:
        _check_sections(blade, shroud)
    check_fit(blade, shroud, (partial(_accepts, mesh), partial(_accepts, None)), partial(_meshes, mesh))
    _check_size(blade, shroud, mesh)
    if disk is not None:
        from geometry.blade.disk import check_disk

        check_disk(disk, blade, mesh)
    if snubber is not None or platform is not None:
        from geometry.blade.wings import check_wings

        wings = {name: wing for name, wing in (("snubber", snubber), ("platform", platform)) if wing is not None}
        check_wings(blade, (blade.fillet_radius, shroud.fillet_radius), inner_radius(blade, shroud), wings)


def _check_sections(blade: BladeParameters, shroud: ShroudParameters) -> None:
    """Check that sections of points cover the airfoil, and that nothing else is asked of it than they give."""
    from geometry.blade.profiles import check_reach

    assert blade.sections is not None
    for table, radius in (("blade", blade.fillet_radius), ("shroud", shroud.fillet_radius)):
        told = "must be 0 with blade.sections: a fillet is in the sections, or left out"
        _require(radius == 0.0, table, "fillet_radius", radius, told)
    if shroud.thickness < blade.length:
        check_reach(blade.sections, blade.hub_radius, inner_radius(blade, shroud))


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
    from geometry.blade.layouts import MeshingError
    from geometry.blade.solid import swept_planform

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
