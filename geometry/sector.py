"""The mesh of one sector, with everything that a contact analysis asks of a geometry."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(frozen=True)
class ContactFace:
    """The grid of contact nodes on one side of the shroud, node k = i_t1 + n_t1 * i_t2.

    ``nodes`` (n_c,): rows of ``SectorMesh.points``; ``position`` (n_c, 3) m; ``frame`` (n_c, 3, 3): rows t1, t2, n;
    ``area`` (n_c,) m2: tributary area of each node.
    """

    nodes: IntArray
    position: FloatArray
    frame: FloatArray
    area: FloatArray


@dataclass(frozen=True)
class SectorMesh:
    """Hexahedral mesh of a blade with its shroud.

    ``points`` (N, 3) m; ``hexahedra`` (E, 8) in the node order of VTK and gmsh, every Jacobian positive;
    ``node_sets``: name -> (k,) rows of ``points``. Sets: ``root`` (on the hub), ``tip`` (the one node on the stacking
    axis on the shroud's outer surface), ``tip_surface`` (that whole surface), ``contact_right`` and ``contact_left``
    (the contact nodes, in the order of the faces), ``face_right`` and ``face_left`` (all mesh nodes of the faces).
    ``right``: the face on the +y side, ``left``: its match on the -y side; ``n_blades`` in the ring.
    """

    points: FloatArray
    hexahedra: IntArray
    node_sets: dict[str, IntArray]
    right: ContactFace
    left: ContactFace
    n_blades: int
