"""Refusal of a blade and a shroud that do not fit together, with values that do."""

from collections.abc import Callable, Iterator
from itertools import islice

from geometry.edge_angle import AUTO, LARGEST_SLANT, fitted_planform
from geometry.errors import GeometryError
from geometry.fitting import airfoil_fits, misfit, without_notch
from geometry.neighbours import airfoils_touch
from geometry.parameters import LARGEST_STAGGER, BladeParameters, ShroudParameters
from geometry.remedies import ANY, Accepts, Search

MOST_WAYS = 3
Way = tuple[str, str, str]  # table, parameter, what works


def misfit_of(blade: BladeParameters, shroud: ShroudParameters) -> str | None:
    """Why a blade and its shroud do not fit together; None where they do."""
    if airfoils_touch(blade, shroud):
        return "neighbouring airfoils would touch"
    return misfit(fitted_planform(blade, shroud))


def check_fit(blade: BladeParameters, shroud: ShroudParameters, accepts: Accepts) -> None:
    """Check side profile and airfoil on the planform, and that neighbouring airfoils do not touch.

    Raises ``GeometryError`` for the first parameter of which ``accepts`` takes another value; it names that value
    and those of up to two other parameters.
    """
    reason = misfit_of(blade, shroud)
    if reason is None:
        return
    plan = fitted_planform(blade, shroud)
    ways: Callable[[Search], Iterator[Way]] = _profile_ways
    if airfoils_touch(blade, shroud):
        ways = _touching_ways
    elif not airfoil_fits(without_notch(plan)):
        platform = f"{plan.width:g} m x {plan.pitch:.6g} m"
        turned = f"turned by its stagger of {blade.tip_stagger:g} degrees"
        reason = f"the section, {turned}, must fit on the shroud of {platform}"
        ways = _section_ways
    found = [*islice(ways(Search(blade, shroud, accepts)), MOST_WAYS)]
    found = found or [*islice(ways(Search(blade, shroud, accepts, least=ANY)), 1)]
    found = found or [("blade", "chord", "no other value of one key fits: make chord and thickness smaller")]
    table, parameter, _ = found[0]
    value = getattr(blade if table == "blade" else shroud, parameter)
    raise GeometryError(table, parameter, value, f"{reason}; {', or '.join(text for _, _, text in found)}")


def _touching_ways(search: Search) -> Iterator[Way]:
    """Other values with which neighbouring airfoils are apart."""
    yield from _smaller_fillet(search, "blade", search.blade.fillet_radius)
    for name in ("thickness", "tip_thickness"):
        if getattr(search.blade, name) is not None:
            thickness = search.largest("blade", name, getattr(search.blade, name))
            if thickness is not None:
                yield "blade", name, f"a {name} of at most {thickness:.6g} fits"
    limits = (-LARGEST_STAGGER, LARGEST_STAGGER)
    yield from _nearest_angle(search, "blade", "root_stagger", limits, "root_stagger {:g} fits")
    yield from _fewer_blades(search)
    yield from _airfoil_ways(search)


def _profile_ways(search: Search) -> Iterator[Way]:
    """Other values where the airfoil would fit on a platform with straight sides."""
    yield from _smaller_fillet(search, "shroud", search.shroud.fillet_radius)
    yield from _nearest_angle(search, "shroud", "angle", (0.0, 180.0), "the nearest angle that fits is {:g}")
    length = search.largest("shroud", "contact_length", search.shroud.contact_length)
    if length is not None:
        yield "shroud", "contact_length", f"contact_length at most {length:.6g} fits at this angle"
    yield from _airfoil_ways(search)


def _section_ways(search: Search) -> Iterator[Way]:
    """Other values where the section is too large even for straight sides."""
    yield from _smaller_fillet(search, "shroud", search.shroud.fillet_radius)
    yield from _airfoil_ways(search)


def _airfoil_ways(search: Search) -> Iterator[Way]:
    """Other values of all parameters but those of the contact segment."""
    blade, shroud = search.blade, search.shroud
    chord = search.largest("blade", "chord", blade.chord)
    if chord is not None:
        yield "blade", "chord", f"a chord of at most {chord:.6g} fits"
    if shroud.edge_angle != AUTO:
        limits = (-LARGEST_SLANT, LARGEST_SLANT)
        yield from _nearest_angle(search, "shroud", "edge_angle", limits, "edge_angle {:g} fits")
    width = search.smallest("shroud", "axial_width", shroud.axial_width)
    if width is not None:
        yield "shroud", "axial_width", f"axial_width at least {width:.6g} fits"
    name = "thickness" if blade.tip_thickness is None else "tip_thickness"
    thickness = search.largest("blade", name, getattr(blade, name))
    if thickness is not None:
        yield "blade", name, f"a {name} of at most {thickness:.6g} fits"
    yield from _fewer_blades(search)
    limits = (-LARGEST_STAGGER, LARGEST_STAGGER)
    yield from _nearest_angle(search, "blade", "root_stagger", limits, "root_stagger {:g} fits")


def _smaller_fillet(search: Search, table: str, radius: float) -> Iterator[Way]:
    most = search.largest(table, "fillet_radius", radius) if radius > 0 else None
    if most is not None:
        yield table, "fillet_radius", f"a fillet_radius of at most {most:.6g} fits"


def _fewer_blades(search: Search) -> Iterator[Way]:
    count = search.fewer_blades()
    if count is not None:
        yield "blade", "n_blades", f"n_blades at most {count} fits"


def _nearest_angle(
    search: Search, table: str, parameter: str, limits: tuple[float, float], text: str
) -> Iterator[Way]:
    angle = search.nearest_angle(table, parameter, limits)
    if angle is not None:
        yield table, parameter, text.format(angle)
