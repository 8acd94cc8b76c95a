"""The mesh of one sector with its contact faces."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from geometry.elements import ELEMENT_KINDS, ElementBlock, ElementSides, IntArray
from geometry.errors import SectorFileError

FloatArray = NDArray[np.float64]
KINDS = ("neighbours", "inside", "ground")  # of contact interfaces


@dataclass(frozen=True)
class ContactFace:
    """The grid of contact nodes on one side of the shroud; node k = i_t1 + n_t1 i_t2.

    Attributes
    ----------
    nodes : (n_c,) array
        Rows of ``SectorMesh.points``.
    position : (n_c, 3) array
        Positions, m.
    frame : (n_c, 3, 3) array
        Contact frames, rows t1, t2, n.
    area : (n_c,) array
        Tributary areas, m^2.

    Examples
    --------
    The areas add up to contact length times thickness of the shroud, 1 cm^2:

    >>> from geometry import BladeParameters, MeshParameters, ShroudParameters, build_sector
    >>> blade, shroud = BladeParameters(40, 0.3, 0.1, 0.02, 0.008), ShroudParameters(45.0, 0.01, 0.04, 0.01)
    >>> face = build_sector(blade, shroud, MeshParameters(size=0.02, contact_grid=(3, 2))).right
    >>> face.frame.shape, round(1e4 * float(face.area.sum()), 6)
    ((6, 3, 3), 1.0)
    """

    nodes: IntArray
    position: FloatArray
    frame: FloatArray
    area: FloatArray


@dataclass(frozen=True)
class FacePair:
    """Two faces that touch each other, beside those of `SectorMesh.right` and `SectorMesh.left`.

    Attributes
    ----------
    right, left : ContactFace
        The face on the +y side, and its match on the -y side: node k of one lies opposite node k of the other. Inside
        a sector any two faces; against the ground, which does not move, `left` is `right` itself.
    face_right, face_left : (k,) array
        All mesh nodes of the two faces, rows of ``SectorMesh.points``.
    kind : {"neighbours", "inside", "ground"}
        What the right face touches: the left one of the next blade, that of the same sector, or the ground.

    Examples
    --------
    >>> from geometry import BladeParameters, MeshParameters, ShroudParameters, SnubberParameters, build_sector
    >>> blade, shroud = BladeParameters(40, 0.3, 0.1, 0.02, 0.008), ShroudParameters(45.0, 0.01, 0.04, 0.01)
    >>> snubber = SnubberParameters(radius=0.35, thickness=0.006, width=0.012)
    >>> mesh = MeshParameters(size=0.005, contact_grid=(3, 2))
    >>> pair = build_sector(blade, shroud, mesh, snubber=snubber).pairs["snubber"]
    >>> len(pair.right.nodes), len(pair.face_right) == len(pair.face_left)
    (6, True)
    """

    right: ContactFace
    left: ContactFace
    face_right: IntArray
    face_left: IntArray
    kind: str = "neighbours"


@dataclass(frozen=True)
class SectorMesh:
    """Mesh of a blade with its shroud: hexahedra where it was made here, elements of any kind from elsewhere.

    Attributes
    ----------
    points : (N, 3) array
        Nodes of the elements, m.
    blocks : tuple of ElementBlock
        Elements by kind and material, with positive Jacobians.
    node_sets : dict of str to (k,) array
        Rows of `points`: `root` (on the hub), `tip` (the node on the stacking axis on the outer surface of the
        shroud), `tip_surface` (that whole surface), `contact_right` and `contact_left` (the contact nodes, in the
        order of the faces), `face_right` and `face_left` (all mesh nodes of the faces); `snubber` and
        `platform` hold the nodes of these off the airfoil.
    right, left : ContactFace
        The face on the +y side, and its match on the -y side.
    n_blades : int
        Number of blades of the ring.
    surfaces : mapping of str to ElementSides
        Surfaces by name, of which pressures and contact faces are made; without `face_right` and `face_left` the
        sides between the nodes of these sets. A mesh made here has `pressure_side`, `suction_side` (towards +y),
        `leading_edge` (at -x) and `trailing_edge` of the airfoil.
    pairs : mapping of str to FacePair
        Further faces that touch each other, by name, in the order of their contact nodes. Patches of one interface,
        such as the flanks of a dovetail, are pairs with the names NAME/1, NAME/2, ..., one behind the other.
    main : str
        Name of the pair of `right` and `left`.
    kind : str
        Kind of this pair, as of `FacePair`.
    temperature : (N,) array or None
        Temperatures of the nodes that a mesh file gives, NaN where it gives none; None: none at all.

    Examples
    --------
    The top of the shroud is at hub radius plus length; both faces have the same contact nodes:

    >>> from geometry import BladeParameters, MeshParameters, ShroudParameters, build_sector
    >>> blade, shroud = BladeParameters(40, 0.3, 0.1, 0.02, 0.008), ShroudParameters(45.0, 0.01, 0.04, 0.01)
    >>> sector = build_sector(blade, shroud, MeshParameters(size=0.02, contact_grid=(3, 2)))
    >>> print(sector.points[sector.node_sets["tip"]].round(6), len(sector.right.nodes), len(sector.left.nodes))
    [[0.  0.  0.4]] 6 6
    """

    points: FloatArray
    blocks: tuple[ElementBlock, ...]
    node_sets: dict[str, IntArray]
    right: ContactFace
    left: ContactFace
    n_blades: int
    surfaces: Mapping[str, ElementSides] = field(default_factory=dict)
    pairs: Mapping[str, FacePair] = field(default_factory=dict)
    main: str = "shroud"
    kind: str = "neighbours"
    temperature: FloatArray | None = None

    @property
    def turn(self) -> float:
        """Angle about the engine axis from the left face to where the right one touches it, rad."""
        return 2.0 * np.pi / self.n_blades if self.kind == "neighbours" else 0.0

    @property
    def interfaces(self) -> dict[str, int]:
        """Numbers of contact nodes of the contact interfaces by name, that of `right` and `left` first."""
        found: dict[str, int] = {}
        for name, view in self.views.items():
            interface = interface_of(name)
            found[interface] = found.get(interface, 0) + len(view.right.nodes)
        return found

    @property
    def n_elements(self) -> int:
        """Number of elements."""
        return sum(len(block) for block in self.blocks)

    @property
    def hexahedra(self) -> IntArray:
        """Corners (E, 8) of the elements of a mesh that has hexahedra only."""
        return np.concatenate([block.nodes[:, :8] for block in self.blocks])

    @property
    def views(self) -> "dict[str, SectorMesh]":
        """The sector seen from each pair of faces by name, that of `right` and `left` first."""
        return {name: self.seen_from(name) for name in (self.main, *self.pairs)}

    def seen_from(self, name: str) -> "SectorMesh":
        """The sector with one pair of faces alone, in the place of `right` and `left` and of their node sets.

        Parameters
        ----------
        name : str
            Name of the pair.
        """
        if name == self.main:
            return replace(self, pairs={}) if self.pairs else self
        pair = self.pairs[name]
        sets = {"face_right": pair.face_right, "face_left": pair.face_left}
        sets |= {"contact_right": pair.right.nodes, "contact_left": pair.left.nodes}
        surfaces = {key: sides for key, sides in self.surfaces.items() if key not in sets}
        return replace(
            self,
            right=pair.right,
            left=pair.left,
            node_sets=self.node_sets | sets,
            surfaces=surfaces,
            pairs={},
            main=name,
            kind=pair.kind,
        )

    def with_only(self, interfaces: Collection[str]) -> "SectorMesh":
        """The sector with the pairs of some interfaces alone; as it is where it has none of these or all are.

        Parameters
        ----------
        interfaces : collection of str
            Names of interfaces.
        """
        names = [name for name in (self.main, *self.pairs) if interface_of(name) in interfaces]
        if not names or len(names) > len(self.pairs):
            return self
        return replace(self.seen_from(names[0]), pairs={name: self.pairs[name] for name in names[1:]})


def interface_of(pair: str) -> str:
    """Name of the contact interface that a pair of faces belongs to."""
    return pair.split("/")[0]


def check_sector(path: str | Path, sector: SectorMesh) -> None:
    """Check that the arrays of a sector read from a file are consistent."""
    points, count = sector.points, len(sector.points)
    shapes = points.ndim == 2 and points.shape[1] == 3 and len(sector.blocks) > 0
    pairs = [*sector.pairs.values()]
    sets = [nodes for pair in pairs for nodes in (pair.face_right, pair.face_left)]
    tables = [*(block.nodes for block in sector.blocks), *sector.node_sets.values(), *sets]
    for block in sector.blocks:
        if block.kind not in ELEMENT_KINDS:
            raise SectorFileError(f'{path}: not a sector: elements of the unknown kind "{block.kind}"')
        shapes &= block.nodes.ndim == 2 and block.nodes.shape[1] == block.topology.n_nodes
    faces = [(sector.right, sector.left), *((pair.right, pair.left) for pair in pairs)]
    for face in (face for both in faces for face in both):
        n = len(face.nodes)
        shapes &= face.position.shape == (n, 3) and face.frame.shape == (n, 3, 3) and face.area.shape == (n,)
        tables.append(face.nodes)
    if not shapes or any(len(right.nodes) != len(left.nodes) for right, left in faces):
        raise SectorFileError(f"{path}: not a sector: arrays of the wrong shape")
    for kind in (sector.kind, *(pair.kind for pair in pairs)):
        if kind not in KINDS:
            raise SectorFileError(f'{path}: not a sector: contact of the unknown kind "{kind}"')
    if not np.isfinite(points).all():
        raise SectorFileError(f"{path}: not a sector: a point is not finite")
    if any(table.size and (table.min() < 0 or table.max() >= count) for table in tables):
        raise SectorFileError(f"{path}: not a sector: a node number beyond the {count} points")
