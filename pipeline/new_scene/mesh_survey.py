"""What is in a mesh file, and what a scene would have to say about it: unit, axis, number of blades, sets by role."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pipeline.scene.material_section import CONSTANTS
from pipeline.stages.model.scene_materials import propose_unit

if TYPE_CHECKING:
    from geometry.imported_mesh import ImportedMesh
    from geometry.own_mesh.ring import SectorRing
    from geometry.own_mesh.sector_choice import InterfaceChoice

Array = NDArray[np.float64]
# words of set names by role, the surest first; a name is taken apart at everything that is no letter
_WORDS = {
    "root": ("root", "fixed", "fix", "clamped", "clamp", "hub", "encastre", "spc", "dovetail", "base", "bottom"),
    "tip": ("tip", "load", "output", "probe"),
}
_PAIRS = (
    ("right", "left"),
    ("plus", "minus"),
    ("pos", "neg"),
    ("high", "low"),
    ("ps", "ss"),
    ("pressure", "suction"),
    ("next", "prev"),
    ("r", "l"),
)
_CONTACT = ("contact", "shroud", "face", "cont")
_AXES = ("x", "y", "z")
_OFF_AXIS = 0.02  # of the distance of two faces: largest difference of their radii and axial places
_ASKEW = 0.2  # the same where no other axis fits
_GAP = 0.05  # largest gap between two faces, over the size of one
_LARGEST_PITCH = 2.5  # rad, of rings of three blades or more
MOST_SETS = 12  # that are listed


@dataclass(frozen=True)
class Guess:
    """What a scene says about a mesh file, as far as it can be told from the file."""

    # `unit`, `axis`: as in [mesh]
    unit: str
    axis: str
    n_blades: int | None  # number of blades; None where no pair of faces tells
    sets: Mapping[str, str]  # names of sets by role
    why: tuple[str, ...]  # what each of these was told from, one line each
    axis_point: tuple[float, float, float] = (0.0, 0.0, 0.0)  # A point of the axis, in the unit of the file
    # numbers of materials, in SI units, that are in other units in the file
    numbers: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    interfaces: Mapping[str, InterfaceChoice] = field(default_factory=dict)  # contacts between several bodies


def survey(mesh: ImportedMesh) -> list[str]:
    """Elements, nodes, size, sets, surfaces and materials of a mesh file, a line for each."""
    kinds: dict[str, int] = {}
    for block in mesh.blocks:
        kinds[block.kind] = kinds.get(block.kind, 0) + len(block)
    low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
    sizes = ", ".join(f"{axis} {a:.6g} to {b:.6g}" for axis, a, b in zip(_AXES, low, high, strict=True))
    lines = [
        f"elements: {', '.join(f'{count} {kind}' for kind, count in kinds.items())}; {len(mesh.points)} nodes",
        f"size: {sizes}",
        _listed("node sets", {name: f"{len(nodes)} nodes" for name, nodes in mesh.node_sets.items()}),
        _listed("surfaces", {name: f"{len(sides)} element faces" for name, sides in mesh.surfaces.items()}),
        _listed("element sets", {name: f"{len(rows)}" for name, rows in mesh.element_sets.items()}),
        _listed("materials", {name: _numbers(values) for name, values in mesh.materials.items()}),
    ]
    known = np.empty(0) if mesh.temperature is None else mesh.temperature[np.isfinite(mesh.temperature)]
    if len(known):
        lines.append(f"temperatures: of {len(known)} nodes, {known.min():g} to {known.max():g}")
    return [*lines, *(f"warning: {line}" for line in mesh.warnings), *(f"note: {note}" for note in mesh.notes)]


def guess(mesh: ImportedMesh, unit: str | None = None, axis: str | None = None, n_blades: int | None = None) -> Guess:
    """What to say about a mesh; what is given is taken as it is."""
    told = _of_one_body(mesh, unit, axis, n_blades)
    if told.n_blades is None:
        return told
    from geometry.own_mesh.interfaces import found_interfaces
    from geometry.own_mesh.sector_choice import SectorChoice

    roles = {role: name for role, name in told.sets.items() if not role.startswith("contact")}
    found = found_interfaces(mesh, SectorChoice(told.n_blades, "m", told.axis, told.axis_point, roles))
    taken = {name for each in found.values() for name in (each.right, each.left)}
    sets = {role: name for role, name in told.sets.items() if name not in taken}
    if {"contact_right", "contact_left"} & (told.sets.keys() - sets.keys()):  # of a pair that is an interface
        sets = {role: name for role, name in sets.items() if not role.startswith("contact")}
    places = {"inside": "lie on each other", "neighbours": "are a pitch apart"}
    pairs = [set(pair) for pair in mesh.contacts]
    why = [
        f'interface {name}: "{e.right}" and "{e.left}" '
        f"{'are in contact in the file' if {e.right, e.left} in pairs else places[e.kind]}"
        for name, e in found.items()
    ]
    why = [line for line in told.why if line.split(":")[0] not in told.sets.keys() - sets.keys()] + why
    return replace(told, sets=sets, why=tuple(why), interfaces=found)


def _of_one_body(mesh: ImportedMesh, unit: str | None, axis: str | None, n_blades: int | None) -> Guess:
    """What to say about a mesh but for contacts between its bodies."""
    used = {block.material for block in mesh.blocks}
    materials = {name: numbers for name, numbers in mesh.materials.items() if name in used}
    proposal = propose_unit(float(np.abs(mesh.points).max()), materials, mesh.units)
    numbers = proposal.numbers if unit is None else {}
    found_unit, why_unit = proposal.unit, proposal.why
    sets = dict(_roles([*mesh.surfaces, *mesh.node_sets]))
    held = mesh.root and sets.get("root", "").lower() != "root"
    sets |= {"root": mesh.root} if held else {}
    why = [f"unit {unit}: given" if unit else f"unit {found_unit}: {why_unit}"]
    why += [] if unit else [f"material {name}: {text}" for name, text in proposal.stated.items()]
    why += [
        f'{role}: "{name}", {"the nodes that the file holds" if held and role == "root" else "by its name"}'
        for role, name in sets.items()
    ]
    best = None
    kind = next((kind for kind in ("cyclic", "contact") if {f"{kind}_right", f"{kind}_left"} <= sets.keys()), "")
    right, left = f"{kind}_right", f"{kind}_left"
    faces = "contact faces" if kind == "contact" else "cut faces"
    if kind:
        best = _axis_between(_centre(mesh, sets[right]), _centre(mesh, sets[left]), axis)
        moved = _ring_elsewhere(mesh, sets[right], sets[left], axis)
        if moved is not None and (
            best is None or best[2] > _OFF_AXIS or _far_apart(mesh, sets[right], best[1], moved)
        ):
            place = ", ".join(f"{value:.6g}" for value in moved.axis_point)
            told = f"axis {moved.axis} through ({place}), {moved.n_blades} blades"
            why.append(f"{told}: about this axis the {faces} are {360.0 / moved.n_blades:.6g} degrees apart")
            blades = n_blades or moved.n_blades
            return Guess(unit or found_unit, moved.axis, blades, sets, tuple(why), moved.axis_point, numbers)
    if best is None or best[2] > _ASKEW:
        from geometry.own_mesh.ring import fitting_ring

        ring = fitting_ring(mesh, axis)
        if ring is None:
            told = f"the {faces} are not at one radius" if kind else "not known without a pair of contact faces"
            why.append(
                f"axis, number of blades: {told}; mesh.axis_point names an axis that is not through the origin"
            )
            return Guess(unit or found_unit, axis or "x", n_blades, sets, tuple(why), numbers=numbers)
        what = "1 pair of surfaces is" if ring.pairs == 1 else f"{ring.pairs} pairs of surfaces are"
        why.append(f"axis {ring.axis}, {ring.n_blades} blades: {what} {360.0 / ring.n_blades:.6g} degrees apart")
        return Guess(unit or found_unit, ring.axis, n_blades or ring.n_blades, sets, tuple(why), numbers=numbers)
    direction, pitch, mismatch = best
    if pitch < 0.0:  # the axis points the other way, or the names are swapped: the scene keeps the axis
        sets[right], sets[left] = sets[left], sets[right]
        why.append(f"{faces} swapped: right is the one that leads in rotation about {direction}")
    number = round(2.0 * math.pi / abs(pitch))
    degrees = math.degrees(abs(pitch))
    why.append(
        f"axis {direction}: radius and axial place of the two {faces} agree to {mismatch:.2g} of their distance"
    )
    why.append(f"{number} blades: the {faces} are {degrees:.6g} degrees apart, a pitch is {360.0 / number:.6g}")
    return Guess(unit or found_unit, direction, n_blades or max(number, 3), sets, tuple(why), numbers=numbers)


def set_nodes(mesh: ImportedMesh, name: str) -> NDArray[np.int64]:
    """Rows of the points of a node set or surface."""
    if name in mesh.surfaces:
        return mesh.surfaces[name].nodes(mesh.blocks)
    return mesh.node_sets[name]


def _roles(names: list[str]) -> Iterator[tuple[str, str]]:
    """Sets by role, by the words of their names: the role, the name."""
    words = {name: set(re.findall(r"[a-z]+", name.lower())) for name in dict.fromkeys(names)}
    by_lower = {name.lower(): name for name in words}
    pairs = [
        (one, other)
        for right, left in _PAIRS
        for one, other in itertools.permutations(words, 2)
        if right in words[one] and words[other] == words[one] - {right} | {left}
    ]
    sided = {name for pair in pairs for name in pair}  # a face and its partner are in contact or cut
    for role in ("root", "tip"):
        exact = by_lower.get(role)
        # CalculiX users write NFIX for a node set, SFIX for a surface
        found = [
            name
            for word in _WORDS[role]
            for name in words
            if {word, f"n{word}", f"s{word}"} & words[name] and name not in sided
        ]
        if exact or found:
            yield role, exact or found[0]
    from geometry.own_mesh.matching_faces import named_cuts

    cuts = named_cuts(words)
    if len(cuts) == 1 or (cuts and "right" in words[cuts[0][0]]):
        yield from zip(("cyclic_right", "cyclic_left"), cuts[0], strict=True)
    taken = {name for pair in cuts for name in pair}
    # high and low alone are the edges of a sector, whichever they are: geometry tells
    pairs = [p for p in pairs if p[0] not in taken and ("high" not in words[p[0]] or words[p[0]] & set(_CONTACT))]
    pairs.sort(key=lambda pair: not words[pair[0]] & set(_CONTACT))
    if pairs:
        yield from zip(("contact_right", "contact_left"), pairs[0], strict=True)


def _far_apart(mesh: ImportedMesh, right: str, angle: float, ring: SectorRing) -> bool:
    """Whether faces at an `angle`, rad, about the origin would leave a gap in a ring that fits them."""
    nodes = mesh.points[set_nodes(mesh, right)]
    gap = abs(2.0 * math.pi / ring.n_blades - abs(angle)) * float(np.linalg.norm(nodes.mean(axis=0)))
    return gap > _GAP * float(np.linalg.norm(np.ptp(nodes, axis=0)))


def _ring_elsewhere(mesh: ImportedMesh, right: str, left: str, axis: str | None) -> SectorRing | None:
    """The ring about an axis that need not pass through the origin of the file; None where there is none."""
    from geometry.errors import ParameterError
    from geometry.own_mesh.ring import ring_of_faces

    try:
        return ring_of_faces(mesh, right, left, axis)
    except ParameterError:  # sets that are no faces
        return None


def _centre(mesh: ImportedMesh, name: str) -> Array:
    return np.asarray(mesh.points[set_nodes(mesh, name)].mean(axis=0))


def _axis_between(right: Array, left: Array, given: str | None) -> tuple[str, float, float] | None:
    """The axis through the origin about which one point turns into the other, the angle, the mismatch; None: none."""
    distance = float(np.linalg.norm(right - left)) or 1.0
    found = []
    for name in _AXES if given is None else (given,):
        sign, k = (-1.0 if name.startswith("-") else 1.0), _AXES.index(name[-1])
        a, b = np.eye(3)[(k + 1) % 3], np.eye(3)[(k + 2) % 3]
        polar = [(float(np.hypot(p @ a, p @ b)), float(np.arctan2(p @ b, p @ a))) for p in (right, left)]
        mismatch = abs(polar[0][0] - polar[1][0]) + abs(right[k] - left[k])
        # from the left face to the right one; the next blade stands on the +y side, seen along the axis with z up
        angle = math.remainder(sign * (polar[1][1] - polar[0][1]), 2.0 * math.pi)
        if 0.0 < abs(angle) < _LARGEST_PITCH:
            found.append((round(mismatch / distance, 3), abs(angle), name, angle))
    if not found:
        return None
    mismatch, _, name, angle = min(found)
    return name, angle, mismatch


def _numbers(values: Mapping[str, Any]) -> str:
    """Constants, and whether there are others at further temperatures and axes."""
    symbols = {"young_modulus": "E", "poisson_ratio": "nu", "density": "rho", "expansion": "alpha"}
    said = [f"{symbols.get(key, key)} {values[key]:.6g}" for key in CONSTANTS if key in values]
    said += ["over the temperature"] * ("at" in values) + ["with axes"] * ("axes" in values)
    return ", ".join(said) or "no numbers"


def _listed(what: str, items: Mapping[str, str]) -> str:
    """`node sets: root (12 nodes), ...`; the first few of many."""
    shown = [f"{name} ({text})" for name, text in items.items()]
    more = [f"and {len(shown) - MOST_SETS} more"] * (len(shown) > MOST_SETS)
    return f"{what}: {', '.join(shown[:MOST_SETS] + more) or 'none'}"
