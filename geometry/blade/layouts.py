"""A planform divided into patches for gmsh: three layouts, for shallow, steep and all other side profiles.

A layout is that of the upper half, above the camber line and its continuation to the two axial edges of the platform.
The other half is the upper half of the planform rotated by 180 degrees; both have the same nodes on the line between
them. Names of points, from left (-x) to right:

    RB -- Q1 -- CB            CT -- Q2 -- RT      side profile: side edge, contact CB-CT, side edge
    F1 -- LT -- T1 .. T2 -- TT -- F2              upper flank of the airfoil between its corners
    E1 -- LE -- P1 .. P2 -- TE -- E2              camber line between the ends of the airfoil
"""

from dataclasses import dataclass, field
from math import ceil

import numpy as np

from geometry.blade.fitting import cut_beyond_airfoil
from geometry.blade.planform import Planform
from geometry.sector import FloatArray

GROWTH = 1.5  # ratio of neighbouring steps of a graded division: more saves few steps, less gains no accuracy
SLACK = 0.25  # relative excess of a step over the target size before it is divided
SPLINE_POINTS = 8


class MeshingError(RuntimeError):
    """A region that cannot be divided into patches, or that gmsh does not mesh with quadrilaterals alone."""


@dataclass(frozen=True)
class Curve:
    """A straight line between two named points, or a spline, with its node positions."""

    fractions: FloatArray  # (n,), node positions from 0 to 1 along the length, ends included; equal steps on a spline
    # (k, 2), inner points of a spline; none for a line
    through: FloatArray = field(default_factory=lambda: np.empty((0, 2)))


@dataclass(frozen=True)
class Patch:
    """A counterclockwise loop of points; meshed in rows with four ``corners``, unstructured without."""

    loop: tuple[str, ...]
    corners: tuple[str, ...] = ()
    airfoil: bool = False


@dataclass(frozen=True)
class Layout:
    """Points, curves and patches of half a planform. The contact segment is the curve from "CB" to "CT"."""

    name: str  # name of the layout
    points: dict[str, FloatArray]  # (2,), points by name
    curves: dict[tuple[str, str], Curve]  # curves by the names of their ends
    patches: tuple[Patch, ...]  # patches, which share curves
    cut: tuple[str, ...]  # path through the origin, along which the other half is joined
    flank: tuple[str, ...]  # path along the upper side of the airfoil, from leading to trailing edge

    @property
    def free(self) -> bool:
        """True where a patch is unstructured."""
        return any(not patch.corners for patch in self.patches)


def equal_steps(count: int) -> FloatArray:
    """Fractions of ``count`` equal steps."""
    return np.linspace(0.0, 1.0, count + 1)


def grid_fractions(count: int) -> FloatArray:
    """Centres of ``count`` equal parts of [0, 1]."""
    return (np.arange(count) + 0.5) / count


def contact_fractions(count: int, length: float, size: float, *, even: bool = False) -> FloatArray:
    """Node positions on [0, 1] that include the centres of ``count`` equal parts.

    The steps are at most ``size`` / ``length`` long and symmetric about 1/2; with ``even`` their number is even.
    """
    knots = np.concatenate([[0.0], grid_fractions(count), [1.0]])
    parts = [max(1, ceil(step * length / size - 1e-6)) for step in np.diff(knots)]
    if even and sum(parts) % 2:
        parts[count // 2] += 1  # an odd number of steps means an even number of centres, so this is the middle part
    pieces = [np.linspace(a, b, n, endpoint=False) for a, b, n in zip(knots[:-1], knots[1:], parts, strict=True)]
    fractions = np.concatenate([*pieces, [1.0]])
    return (fractions + (1 - fractions[::-1])) / 2


def graded_fractions(length: float, size: float, least: int = 1, grading: float = 1.0) -> FloatArray:
    """Node positions on [0, 1] with steps at most ``size`` / ``length`` and 1 / ``least`` long, finer at both ends.

    The steps at the ends are ``grading`` times shorter than the longest and grow by the factor ``GROWTH`` towards the
    middle; with a grading of 1 all are equal. They are symmetric about 1/2.
    """
    count = max(least, ceil(length / size - 1e-6))
    if grading == 1.0:
        return np.linspace(0.0, 1.0, count + 1)
    steps = [1.0 / (count * grading)]
    while sum(steps) < 0.5 - 1e-6:
        steps.append(min(GROWTH * steps[-1], 1.0 / count))
    half = np.concatenate([[0.0], np.cumsum(steps)]) / (2 * sum(steps))
    return np.concatenate([half[:-1], 1.0 - half[::-1]])


def half_layouts(plan: Planform, size: float, contact_nodes: int) -> list[Layout]:
    """Candidate layouts of the upper half, in the order of preference; some may give no valid mesh."""
    return [
        _fan_layout(plan, size, contact_nodes),
        _step_layout(plan, size, contact_nodes),
        _free_layout(plan, size, contact_nodes),
    ]


def _steps(length: float, size: float, least: int = 1) -> int:
    return max(least, ceil(length / size - SLACK))


def _even_steps(length: float, size: float) -> int:
    return 2 * _steps(length / 2, size)


def _distance(points: dict[str, FloatArray], a: str, b: str) -> float:
    return float(np.linalg.norm(points[a] - points[b]))


def _corners(plan: Planform) -> dict[str, FloatArray]:
    """Points of all layouts."""
    half = plan.section.half_length
    edge = float(plan.section.half_thickness(np.array(half)))
    ends = plan.place(np.array([[-half, 0.0], [half, 0.0], [half, edge], [-half, edge]]))
    points = dict(zip(("LE", "TE", "TT", "LT"), ends, strict=True))
    points |= dict(zip(("RB", "CB", "CT", "RT"), plan.right_profile(), strict=True))
    for side, path in (("2", cut_beyond_airfoil(plan)), ("1", cut_beyond_airfoil(plan.turned))):
        if path is None:
            raise MeshingError("no room to continue the camber line to the axial edges of the platform")
        sign = 1.0 if side == "2" else -1.0
        points["E" + side] = sign * path[-1]
        if len(path) == 3:
            points["M" + side] = sign * path[1]
    return points


def _flank(plan: Planform, start: float, end: float) -> FloatArray:
    """Inner points (k, 2) of the upper flank between two positions along it; none for a straight flank."""
    if plan.section.straight:
        return np.empty((0, 2))
    along = np.linspace(start, end, SPLINE_POINTS + 2)[1:-1]
    across = plan.section.half_thickness(along)
    return plan.place(np.stack([along, across], axis=-1))


def _camber_line(plan: Planform, start: float, end: float) -> FloatArray:
    """Inner points (k, 2) of the camber line between two positions along it; none for a straight one."""
    if not plan.section.camber:
        return np.empty((0, 2))
    along = np.linspace(start, end, SPLINE_POINTS + 2)[1:-1]
    return plan.place(np.stack([along, 0 * along], axis=-1))


def _beyond_ends(points: dict[str, FloatArray]) -> float:
    """Mean length of the cut between the ends of the airfoil and the axial edges, m; alike for both halves."""
    return (_distance(points, "TE", "E2") + _distance(points, "LE", "E1")) / 2


def _on_section(plan: Planform, along: float, *, flank: bool) -> FloatArray:
    across = plan.section.half_thickness(np.array(along)) if flank else 0.0
    return plan.place(np.array([along, float(across)]))


def _between(points: dict[str, FloatArray], a: str, b: str, fraction: float) -> FloatArray:
    return points[a] + fraction * (points[b] - points[a])


def _axial_edges(points: dict[str, FloatArray], rows: int, left_above: int, right_above: int) -> None:
    """Add F1 and F2, where the row of elements along the flank meets the axial edges.

    They lie half-way between a row as thick as half the airfoil and rows of equal thickness.
    """
    thickness = _distance(points, "TE", "TT")
    for f, e, top, above in (("F1", "E1", "RB", left_above), ("F2", "E2", "RT", right_above)):
        even = rows / (rows + above)
        constant = min(thickness / _distance(points, e, top), even)
        points[f] = _between(points, e, top, (even + constant) / 2)


def _fan_layout(plan: Planform, size: float, contact_nodes: int) -> Layout:
    """Shallow profiles: columns from the chord line to the side of the platform, the contact above mid chord."""
    points = _corners(plan)
    contact = contact_fractions(contact_nodes, plan.contact_length, size, even=True)
    n_k, half = len(contact) - 1, plan.section.half_length
    foot = min((plan.contact_half[0] + n_k / 2 * size) / 2, 0.75 * half)
    n_o = _steps(half - foot, size)
    points["P1"], points["P2"] = (_on_section(plan, x, flank=False) for x in (-foot, foot))
    points["T1"], points["T2"] = (_on_section(plan, x, flank=True) for x in (-foot, foot))
    n_e, n_h = (
        _steps(_beyond_ends(points), size),
        _steps(float(plan.section.half_thickness(np.array(0.0))), size),
    )
    n_v = _steps((_distance(points, "T1", "CB") + _distance(points, "T2", "CT")) / 2, size)
    _axial_edges(points, n_h, n_v, n_v)
    for q, a, b, end, edge in (("Q1", "CB", "RB", "LE", "E1"), ("Q2", "CT", "RT", "TE", "E2")):
        share = (half - foot) / (half - foot + _distance(points, end, edge))
        points[q] = _between(points, a, b, share)
    rows = [("E1", "LE", "P1", "P2", "TE", "E2"), ("F1", "LT", "T1", "T2", "TT", "F2")]
    rows.append(("RB", "Q1", "CB", "CT", "Q2", "RT"))
    columns = [n_e, n_o, n_k, n_o, n_e]
    curves = {(a, b): Curve(equal_steps(n)) for row in rows for a, b, n in zip(row, row[1:], columns, strict=False)}
    curves["CB", "CT"] = Curve(contact)
    for a, b, x, y in (("LT", "T1", -half, -foot), ("T1", "T2", -foot, foot), ("T2", "TT", foot, half)):
        curves[a, b] = Curve(curves[a, b].fractions, _flank(plan, x, y))
    for a, b, x, y in (("LE", "P1", -half, -foot), ("P1", "P2", -foot, foot), ("P2", "TE", foot, half)):
        curves[a, b] = Curve(curves[a, b].fractions, _camber_line(plan, x, y))
    curves |= {(a, b): Curve(equal_steps(n_h)) for a, b in zip(rows[0], rows[1], strict=True) if a[0] != "P"}
    curves |= {(a, b): Curve(equal_steps(n_v)) for a, b in zip(rows[1], rows[2], strict=True)}
    low, mid, high = rows
    patches = [
        Patch(low[1:5] + mid[4:0:-1], ("LE", "TE", "TT", "LT"), airfoil=True),
        *(_cell(low[k : k + 2] + mid[k : k + 2]) for k in (0, 4)),
        *(_cell(mid[k : k + 2] + high[k : k + 2]) for k in range(5)),
    ]
    return Layout("fan", points, curves, tuple(patches), cut=low, flank=mid[1:5])


def _cell(names: tuple[str, ...]) -> Patch:
    """Four-sided patch from its lower and upper corners, each pair from left to right."""
    a, b, c, d = names
    return Patch((a, b, d, c), (a, b, d, c))


def _step_layout(plan: Planform, size: float, contact_nodes: int) -> Layout:
    """Steep profiles: the contact is the left side of a block above the right part of the lower band."""
    points = _corners(plan)
    contact = contact_fractions(contact_nodes, plan.contact_length, size)
    length = 2 * plan.section.half_length
    n_k, n_c = len(contact) - 1, _even_steps(length, size)
    foot = int(np.clip(round(n_c / 2 - plan.contact_half[0] / length * n_c), 1, n_c - 1))
    n_e, n_h = (
        _steps(_beyond_ends(points), size),
        _steps(float(plan.section.half_thickness(np.array(0.0))), size),
    )
    at = (foot / n_c - 0.5) * length
    points["T1"] = _on_section(plan, at, flank=True)
    n_v = _steps((_distance(points, "LT", "RB") + 3 * _distance(points, "T1", "CB")) / 4, size)
    _axial_edges(points, n_h, n_v, n_v + n_k)
    left, right = length / 2 + at, length / 2 - at
    points["Q1"] = _between(points, "CB", "RB", left / (left + _distance(points, "LE", "E1")))
    points["Q2"] = _between(points, "CT", "RT", right / (right + _distance(points, "TE", "E2")))
    points["Q3"] = _between(points, "TT", "Q2", n_v / (n_v + n_k))
    points["G"] = _between(points, "F2", "RT", n_v / (n_v + n_k))
    curves = {}
    for count, names in [
        (n_e, "E1-LE F1-LT RB-Q1 TE-E2 TT-F2 Q3-G Q2-RT"),
        (foot, "LT-T1 Q1-CB"),
        (n_c, "LE-TE"),
        (n_c - foot, "T1-TT CB-Q3 CT-Q2"),
        (n_h, "E1-F1 LE-LT TE-TT E2-F2"),
        (n_v, "F1-RB LT-Q1 T1-CB TT-Q3 F2-G"),
        (n_k, "Q3-Q2 G-RT"),
    ]:
        for name in names.split():
            a, b = name.split("-")
            curves[a, b] = Curve(equal_steps(count))
    curves["CB", "CT"] = Curve(contact)
    half = plan.section.half_length
    curves["LT", "T1"] = Curve(curves["LT", "T1"].fractions, _flank(plan, -half, at))
    curves["T1", "TT"] = Curve(curves["T1", "TT"].fractions, _flank(plan, at, half))
    curves["LE", "TE"] = Curve(curves["LE", "TE"].fractions, _camber_line(plan, -half, half))
    cells = "E1 LE F1 LT,TE E2 TT F2,F1 LT RB Q1,LT T1 Q1 CB,T1 TT CB Q3,TT F2 Q3 G,CB Q3 CT Q2,Q3 G Q2 RT"
    patches = [
        Patch(("LE", "TE", "TT", "T1", "LT"), ("LE", "TE", "TT", "LT"), airfoil=True),
        *(_cell(tuple(cell.split())) for cell in cells.split(",")),
    ]
    cut = ("E1", "LE", "TE", "E2")
    return Layout("step", points, curves, tuple(patches), cut, flank=("LT", "T1", "TT"))


def _free_layout(plan: Planform, size: float, contact_nodes: int) -> Layout:
    """All other profiles: the airfoil in rows, the platform around it unstructured.

    Full-quad recombination needs an even number of steps on every curve.
    """
    points = _corners(plan)
    half = plan.section.half_length
    airfoil = ("LE", "TE", "TT", "LT")
    before, after = (tuple(name for name in names if name in points) for names in (("E1", "M1"), ("M2", "E2")))
    loop = ("TE", *after, "RT", "CT", "CB", "RB", *before, "LE")
    cut = (*before, "LE", "TE", *after)
    curves = {}
    for names in (airfoil, loop):
        for a, b in zip(names, names[1:] + names[:1] if names is airfoil else names[1:], strict=False):
            curves[a, b] = Curve(equal_steps(_even_steps(_distance(points, a, b), size)))
    steps = equal_steps(_even_steps(2 * half, size))
    curves["LE", "TE"] = Curve(steps, _camber_line(plan, -half, half))
    curves["TT", "LT"] = Curve(steps, _flank(plan, half, -half))
    fractions = contact_fractions(contact_nodes, plan.contact_length, size, even=True)
    del curves["CT", "CB"]
    curves["CB", "CT"] = Curve(fractions)
    patches = (Patch(airfoil, airfoil, airfoil=True), Patch((*loop, "LT", "TT")))
    return Layout("free", points, curves, patches, cut, flank=("LT", "TT"))
