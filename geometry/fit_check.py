"""Refusal of a blade and a shroud that do not fit together, with values that do."""

from collections.abc import Callable, Iterator
from dataclasses import replace

from geometry.edge_angle import AUTO, LARGEST_SLANT, fitted_planform
from geometry.errors import GeometryError
from geometry.fitting import airfoil_fits, misfit, without_notch
from geometry.neighbours import airfoils_touch
from geometry.parameters import LARGEST_CAMBER, LARGEST_STAGGER, BladeParameters, ShroudParameters
from geometry.relations import broken_relation
from geometry.remedies import ANY, SENSIBLE, Accepts, Search

MOST_WAYS = 3
Way = tuple[str, str, str]  # table, parameter, what works
Ways = Callable[[Search], Iterator[Way]]


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
