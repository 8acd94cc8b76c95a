"""Hexahedra and wedges with repeated nodes: volume, mid-side nodes and sides of what they are."""

import numpy as np
import pytest
from mesh_file_support import area, element_points, straight_middles, volumes

from geometry import MeshFileError, read_mesh
from geometry.elements import ELEMENT_KINDS

TYPES = {"hex8": "C3D8", "hex20": "C3D20", "wedge6": "C3D6", "wedge15": "C3D15"}
# corners that fall together with others -> what is left; all pairs of opposite edges of a side, and tetrahedra
HEX_TO_WEDGE = [{3: 2, 7: 6}, {1: 0, 5: 4}, {4: 0, 5: 1}, {7: 4, 6: 5}, {1: 0, 2: 3}, {6: 2, 5: 1}]
HEX_TO_TET = [{3: 2, 5: 4, 6: 4, 7: 4}, {1: 0, 2: 0, 3: 0, 7: 6}]


def collapsed_element(tmp_path, kind, together):
    """One element of which corners fall together; mid-side nodes of collapsed edges are the corner."""
    topology = ELEMENT_KINDS[kind]
    points = element_points(kind)
    labels = np.arange(1, topology.n_nodes + 1)
    for gone, kept in together.items():
        labels[gone] = labels[kept]
        points[gone] = points[kept]
    if topology.quadratic:
        seen = {}
        for k, edge in enumerate(topology.edges, topology.corners):
            ends = frozenset(labels[list(edge)])
            labels[k] = next(iter(ends)) if len(ends) == 1 else seen.setdefault(ends, labels[k])
            points[k] = points[list(edge)].mean(axis=0)
    nodes = "".join(f"{k}, {x!r}, {y!r}, {z!r}\n" for k, (x, y, z) in enumerate(points.tolist(), 1))
    members = ", ".join(map(str, labels))
    surfaces = "".join(f"*SURFACE, NAME=s{k}\n7, S{k + 1}\n" for k in range(len(topology.sides)))
    path = tmp_path / "one.inp"
    path.write_text(f"*NODE\n{nodes}*ELEMENT, TYPE={TYPES[kind]}\n7, {members}\n{surfaces}")
    return path, labels, points


def side_area(corners):
    return sum(
        np.linalg.norm(np.cross(corners[k] - corners[0], corners[k + 1] - corners[0])) / 2
        for k in range(1, len(corners) - 1)
    )


@pytest.mark.parametrize(
    ("kind", "together", "expected"),
    [
        *((kind, case, "wedge") for kind in ("hex8", "hex20") for case in HEX_TO_WEDGE),
        *((kind, case, "tet") for kind in ("hex8", "hex20") for case in HEX_TO_TET),
        *((kind, case, "tet") for kind in ("wedge6", "wedge15") for case in ({4: 3, 5: 3}, {0: 2, 1: 2})),
    ],
)
def test_what_a_collapsed_element_is(tmp_path, kind, together, expected):
    path, labels, points = collapsed_element(tmp_path, kind, together)
    mesh = read_mesh(path)
    assert [block.kind[: len(expected)] for block in mesh.blocks] == [expected]
    assert mesh.blocks[0].topology.quadratic == ELEMENT_KINDS[kind].quadratic
    assert straight_middles(mesh)
    # volume: that of the hexahedron with the same corners, whose collapsed sides have no area
    topology = ELEMENT_KINDS[kind]
    volume = sum(
        points[side[0]] @ np.cross(points[side[k]], points[side[k + 1]]) / 6
        for side in topology.sides
        for k in range(1, len(side) - 1)
    )
    assert volumes(mesh) == pytest.approx([volume])
    assert volume > 0.1
    for number, side in enumerate(topology.sides):
        size = side_area(points[list(side)])
        if size > 1e-12:
            assert area(mesh, f"s{number}") == pytest.approx(size)
            corners = {labels[k] for k in side}
            surface = mesh.surfaces[f"s{number}"]
            assert corners <= set(mesh.node_labels[surface.nodes(mesh.blocks)])
        else:
            assert f"s{number}" not in mesh.surfaces
    assert "1 collapsed element (repeated nodes) is taken as a wedge or a tetrahedron" in mesh.notes


@pytest.mark.parametrize(
    ("kind", "together", "found"),
    [
        ("hex8", {5: 4, 6: 4, 7: 4}, "is a pyramid"),
        ("hex20", {5: 4, 6: 4, 7: 4}, "is a pyramid"),
        ("wedge6", {3: 0}, "is a pyramid"),
        ("hex8", {6: 0}, "is no wedge and no tetrahedron"),
        ("hex8", {1: 0, 2: 0, 3: 0, 4: 0, 5: 0}, "is no wedge and no tetrahedron"),
        ("hex8", {1: 0}, "is no wedge and no tetrahedron"),
    ],
)
def test_what_is_refused(tmp_path, kind, together, found):
    path, _, _ = collapsed_element(tmp_path, kind, together)
    with pytest.raises(MeshFileError, match=rf"element 7 \({kind} with repeated nodes\) {found} \(1 such element\)"):
        read_mesh(path)


def test_two_mid_side_nodes_on_one_edge(tmp_path):
    """A hexahedron collapsed to a wedge whose neighbouring edges keep different mid-side nodes is not conforming."""
    path, labels, _ = collapsed_element(tmp_path, "hex20", {3: 2, 7: 6})
    text = path.read_text()
    labels = labels.copy()
    labels[19] = 20  # the edge 3-7, which falls on 2-6
    line = next(line for line in text.splitlines() if line.startswith("7, ") and line.count(",") == 20)
    path.write_text(text.replace(line, "7, " + ", ".join(map(str, labels))))
    with pytest.raises(MeshFileError, match="has two mid-side nodes on one edge"):
        read_mesh(path)
