"""Hand-made meshes for the tests of the reduced model: nothing here comes from the geometry package's mesher."""

import numpy as np

from geometry import ContactFace, ElementBlock, ImportedMesh, SectorMesh
from rom import BoundaryChoice

NODAL = BoundaryChoice(contact_dofs="nodal")  # the only contact dofs of meshes without node sets of whole faces

_CORNERS = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))


def box(divisions, lengths, origin=(0.0, 0.0, 0.0)):
    """Points (V, 3) and hexahedra (E, 8), VTK order, of a brick cut into divisions along x, y, z."""
    axes = [o + np.linspace(0.0, size, n + 1) for n, size, o in zip(divisions, lengths, origin, strict=True)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    index = np.arange(len(points)).reshape([n + 1 for n in divisions])
    nx, ny, nz = divisions
    corners = [index[i : i + nx, j : j + ny, k : k + nz].ravel() for i, j, k in _CORNERS]
    return points, np.stack(corners, axis=1)


def distorted_box(divisions, lengths, amount=0.2, seed=1):
    """A brick whose inner vertices are moved at random by up to `amount` of an element."""
    points, hexahedra = box(divisions, lengths)
    step = np.array(lengths) / divisions
    inner = np.all((points > 1e-9) & (points < np.array(lengths) - 1e-9), axis=1)
    shift = np.random.default_rng(seed).uniform(-amount, amount, points.shape) * step
    return points + shift * inner[:, None], hexahedra


def annulus(divisions, inner, outer, thickness, angle=2 * np.pi):
    """A ring about the x axis, or a part of `angle` of it centred on z; divisions along r, the angle and x."""
    flat, hexahedra = box(divisions, (outer - inner, angle, thickness), (inner, -angle / 2, -thickness / 2))
    if angle == 2 * np.pi:
        index = np.arange(len(flat)).reshape([n + 1 for n in divisions])
        index[:, -1] = index[:, 0]
        used, renumbered = np.unique(index, return_inverse=True)
        flat, hexahedra = flat[used], renumbered.ravel()[hexahedra]
    radius, turn, axial = flat.T
    # (r, angle, x) is a left-handed triad here: exchange the layers of each element.
    hexahedra = hexahedra[:, [4, 5, 6, 7, 0, 1, 2, 3]]
    return np.column_stack([axial, radius * np.sin(turn), radius * np.cos(turn)]), hexahedra


def mesh_of(points, nodes, kind="hex8", material=""):
    """A mesh of one block."""
    return mesh_of_blocks(points, ElementBlock(kind, nodes, material))


def mesh_of_blocks(points, *blocks):
    """A mesh as from a file."""
    labels = tuple(np.arange(1, len(block) + 1) for block in blocks)
    return ImportedMesh("mesh.inp", points, np.arange(1, len(points) + 1), blocks, labels)


def turned_back(frame, n_blades):
    """Rows of the left contact frame: the right ones turned back by one pitch about x."""
    pitch = 2 * np.pi / n_blades
    forward = np.array([[1, 0, 0], [0, np.cos(pitch), np.sin(pitch)], [0, -np.sin(pitch), np.cos(pitch)]])
    return frame @ forward


def sector_of(points, hexahedra, root, tip, right, left, frame, n_blades):
    """SectorMesh with one right frame (3, 3) for all contact nodes."""
    faces = [
        ContactFace(nodes, points[nodes], np.repeat(rows[None], len(nodes), axis=0), np.full(len(nodes), 1e-6))
        for nodes, rows in ((right, frame), (left, turned_back(frame, n_blades)))
    ]
    sets = {"root": root, "tip": np.array([tip]), "contact_right": right, "contact_left": left}
    return SectorMesh(points, (ElementBlock("hex8", hexahedra),), sets, faces[0], faces[1], n_blades)


def box_sector(divisions=(4, 4, 8), lengths=(0.03, 0.02, 0.1), hub_radius=0.3, n_blades=40, angle=45.0):
    """A prismatic blade clamped at the hub, contact nodes near the top of its +y and -y faces, an oblique frame."""
    lx, ly, lz = lengths
    points, hexahedra = box(divisions, lengths, (-lx / 2, -ly / 2, hub_radius))
    top, turn = hub_radius + lz, np.radians(angle)
    frame = np.array([[np.cos(turn), np.sin(turn), 0.0], [0.0, 0.0, 1.0], [-np.sin(turn), np.cos(turn), 0.0]])
    high = (np.abs(points[:, 0]) < lx / 2 - 1e-9) & (points[:, 2] > top - 2.5 * lz / divisions[2])
    right, left = (np.flatnonzero(high & (np.abs(points[:, 1] - y) < 1e-9)) for y in (ly / 2, -ly / 2))
    tip = int(np.argmin(np.sum((points - [0.0, 0.0, top]) ** 2, axis=1)))
    root = np.flatnonzero(points[:, 2] < hub_radius + 1e-9)
    return sector_of(points, hexahedra, root, tip, right, left, frame, n_blades)


def ring_sector(divisions, inner, outer, thickness, n_sectors):
    """One of n_sectors parts of an annulus clamped at its bore; all other nodes of its two faces are in contact."""
    pitch = 2 * np.pi / n_sectors
    points, hexahedra = annulus(divisions, inner, outer, thickness, pitch)
    turn, radius = np.arctan2(points[:, 1], points[:, 2]), np.hypot(points[:, 1], points[:, 2])
    held = radius < inner + 1e-9
    right, left = (np.flatnonzero(~held & (np.abs(turn - side) < 1e-9)) for side in (pitch / 2, -pitch / 2))
    tip = int(np.argmax(radius - np.abs(turn)))
    frame = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]])
    return sector_of(points, hexahedra, np.flatnonzero(held), tip, right, left, frame, n_sectors)


def patch_block(divisions=(6, 2, 6), lengths=(0.012, 0.01, 0.012), grid=(3, 3), hub_radius=0.3, n_blades=40):
    """A brick clamped below whose whole +y and -y sides are contact faces, with the grid's centres for contact nodes.

    Along x and z the divisions must be even multiples of the grid.
    """
    points, hexahedra = box(divisions, lengths, (-lengths[0] / 2, -lengths[1] / 2, hub_radius))
    steps = [n // (2 * count) for n, count in zip((divisions[0], divisions[2]), grid, strict=True)]
    index = np.arange(len(points)).reshape([n + 1 for n in divisions])
    chosen = [np.arange(step, n, 2 * step) for step, n in zip(steps, (divisions[0], divisions[2]), strict=True)]
    right, left = (
        index[np.ix_(chosen[0], [side], chosen[1])].reshape(len(chosen[0]), -1).T.ravel() for side in (-1, 0)
    )
    frame = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]])
    tip = int(index[divisions[0] // 2, divisions[1] // 2, -1])
    sector = sector_of(points, hexahedra, index[:, :, 0].ravel(), tip, right, left, frame, n_blades)
    sector.node_sets.update(face_right=index[:, -1].ravel(), face_left=index[:, 0].ravel())
    return sector
