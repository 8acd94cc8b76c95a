"""A blade without shroud: meshed with a scaffold in the place of its shroud, of which only the airfoil is kept."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from geometry.blade.checks import misfit_of
from geometry.blade.parameters import BladeParameters, ShroudParameters
from geometry.blade.planform_mesh import PlanformMesh
from geometry.errors import GeometryError
from geometry.sector import ContactFace, FacePair, IntArray, SectorMesh

THICKNESS = 0.02  # of the scaffold, over the length of the blade
WIDTHS = (1.3, 1.6, 2.0, 1.15)  # of the scaffold along x, over the chord: tried in this order
CONTACT = 0.3  # length of its contact segments over its width


def with_scaffold(blade: BladeParameters) -> tuple[BladeParameters, ShroudParameters]:
    """The blade, as much longer as the scaffold is thick, and the scaffold.

    Raises GeometryError where the airfoil fits on none.
    """
    thickness = THICKNESS * blade.length
    longer = replace(blade, length=blade.length + thickness)
    for share in WIDTHS:
        width = share * blade.chord
        scaffold = ShroudParameters(180.0, thickness, width, CONTACT * width)
        reason = misfit_of(longer, scaffold)
        if reason is None:
            return longer, scaffold
    told = f"must be smaller, or the stagger, or the number of blades: at the tip {reason}"
    raise GeometryError("blade", "chord", blade.chord, told)


def without_scaffold(sector: SectorMesh, flat: PlanformMesh, elements: int) -> SectorMesh:
    """The sector without the first `elements`, those of the scaffold; its first further pair becomes the main one.

    The layer of the scaffold next to the airfoil has the first points, as many as the planform `flat`.
    """
    first, *others = sector.blocks
    kept = first.nodes[elements:]
    used = np.unique(kept)
    number = np.full(len(sector.points), -1)
    number[used] = np.arange(len(used))
    pairs = {name: _renumbered(pair, number) for name, pair in sector.pairs.items()}
    main = next(iter(pairs))
    pair = pairs.pop(main)
    foot = flat.foot  # at the end of the airfoil
    axis = foot[np.argmin(np.hypot(*flat.points[foot].T))]
    sets = {name: number[nodes] for name, nodes in sector.node_sets.items() if name not in ("tip", "tip_surface")}
    sets |= {"tip": number[[axis]], "tip_surface": number[foot]}
    sets |= {"contact_right": pair.right.nodes, "contact_left": pair.left.nodes}
    sets |= {"face_right": pair.face_right, "face_left": pair.face_left}
    surfaces = {name: replace(sides, element=sides.element - elements) for name, sides in sector.surfaces.items()}
    return replace(
        sector,
        points=sector.points[used],
        blocks=(replace(first, nodes=number[kept]), *others),
        node_sets=sets,
        surfaces=surfaces,
        right=pair.right,
        left=pair.left,
        pairs=pairs,
        main=main,
    )


def _renumbered(pair: FacePair, number: IntArray) -> FacePair:
    """A pair with other numbers of its nodes."""

    def face(one: ContactFace) -> ContactFace:
        return replace(one, nodes=number[one.nodes])

    return FacePair(face(pair.right), face(pair.left), number[pair.face_right], number[pair.face_left])
