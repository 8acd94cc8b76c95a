"""Sectors of bladed disks of 20-node bricks, and the whole wheel assembled of their turned copies."""

import numpy as np
from element_meshes import with_mid_sides
from rom_meshes import box, mesh_of_blocks
from scipy.sparse import coo_matrix, kron

from geometry import ContactFace, ElementBlock, SectorMesh
from rom.cyclic_sector.cyclic_faces import turn_about_axis

BORE, RIM, TIP, TOP = 0.1, 0.25, 0.38, 0.39  # m


def bladed_sector(n_sectors, held=True, slant=0.2, divisions=(4, 5, 2, 6)):
    """A disk from bore to rim, a blade over its middle third, and a shroud that fills the pitch; sets as in a file.

    The disk is the material "disk". The blade is slanted: waves towards +y and -y differ. Divisions: of disk and
    blade along the radius, axial, circumferential.
    """
    inner, outer, axial, around = divisions
    ends = (np.linspace(BORE, RIM, inner + 1), np.linspace(RIM, TIP, outer + 1), np.linspace(TIP, TOP, 2))
    radii = np.unique(np.concatenate(ends))
    share = np.linspace(0.0, 1.0, len(radii))
    points, bricks = box((axial, len(radii) - 1, around), (1.0, 1.0, 1.0))
    centre = points[bricks].mean(axis=1)
    layer, column = (np.floor(n * c).astype(int) for n, c in ((len(radii) - 1, centre[:, 1]), (around, centre[:, 2])))
    disk, shroud = layer < inner, layer >= inner + outer
    kept = disk | shroud | ((3 * column >= around) & (3 * column < 2 * around))
    used = np.unique(bricks[kept])
    place = np.full(len(points), -1)
    place[used] = np.arange(len(used))
    tables = [("hex20", place[bricks[kept & part]], name) for part, name in ((disk, "disk"), (~disk, ""))]
    flat, blocks = with_mid_sides(points[used], tables)
    radius, angle = np.interp(flat[:, 1], share, radii), 2.0 * np.pi / n_sectors * (flat[:, 2] - 0.5)
    axial = 0.03 * (0.5 - flat[:, 0])
    lean = slant * axial * np.clip((radius - RIM) / (TIP - RIM), 0.0, 1.0)
    positions = np.column_stack([axial, radius * np.sin(angle) + lean, radius * np.cos(angle)])
    ends = {}
    for name, end in (("right", 1.0), ("left", 0.0)):
        cut = np.flatnonzero(np.abs(flat[:, 2] - end) < 1e-9)
        cut = cut[np.lexsort(np.round(flat[cut, :2], 9).T)]
        ends[f"cyclic_{name}"], ends[f"contact_{name}"] = cut[radius[cut] < RIM + 1e-9], cut[radius[cut] > TIP - 1e-9]
    tip = int(np.argmin(np.abs(flat - [0.5, 1.0, 0.5]).sum(axis=1)))
    root = np.flatnonzero(radius < BORE + 1e-9) if held else np.zeros(0, dtype=int)
    return _sector(positions, blocks, ends | {"root": root, "tip": np.array([tip])}, n_sectors)


def solid_disk(n_sectors):
    """A free disk without a bore, with straight edges: wedges around the engine axis, bricks around them."""
    radii = np.array([0.0, 0.05, 0.12])
    points, bricks = box((1, 2, 2), (1.0, 1.0, 1.0))
    inner = points[bricks].mean(axis=1)[:, 1] < 0.5
    radius, angle = np.interp(points[:, 1], [0.0, 0.5, 1.0], radii), 2.0 * np.pi / n_sectors * (points[:, 2] - 0.5)
    corners = np.column_stack([0.04 * (0.5 - points[:, 0]), radius * np.sin(angle), radius * np.cos(angle)])
    _, first, place = np.unique(np.round(corners, 9) + 0.0, axis=0, return_index=True, return_inverse=True)
    # corners of a brick: (x0 r0 a0, x1 r0 a0, x1 r1 a0, x0 r1 a0, the same at a1); its inner edges fall together
    wedges = bricks[inner][:, [0, 3, 7, 1, 2, 6]]
    tables = [("wedge15", place[wedges], ""), ("hex20", place[bricks[~inner]], "")]
    positions, blocks = with_mid_sides(corners[first], tables)
    axis = np.flatnonzero(np.hypot(*positions[:, 1:].T) < 1e-9)
    angle = np.arctan2(positions[:, 1], positions[:, 2]) * n_sectors / np.pi
    ends = {
        f"cyclic_{name}": np.union1d(np.flatnonzero(np.abs(angle - end) < 1e-9), axis)
        for name, end in (("right", 1.0), ("left", -1.0))
    }
    return _sector(positions, blocks, ends | {"root": np.zeros(0, dtype=int), "tip": np.array([0])}, n_sectors)


def _sector(positions, blocks, sets, n_sectors):
    mesh = mesh_of_blocks(positions, *blocks)
    faces = []
    for name in ("contact_right", "contact_left"):
        nodes = sets.setdefault(name, np.zeros(0, dtype=int))
        side = 1.0 if name.endswith("right") else -1.0
        c, s = np.cos(side * np.pi / n_sectors), np.sin(side * np.pi / n_sectors)
        frame = np.array([[1.0, 0.0, 0.0], [0.0, s, c], [0.0, c, -s]])
        faces.append(
            ContactFace(nodes, positions[nodes], np.tile(frame, (len(nodes), 1, 1)), np.full(len(nodes), 1e-6))
        )
    return SectorMesh(mesh.points, mesh.blocks, sets, *faces, n_sectors)


def whole_wheel(full, faces, sectors=None):
    """Stiffness and mass of the wheel without symmetry, its clamped dofs, and the expansion of waves.

    `sectors` are the full models of the sectors, where these differ. The expansion takes the displacements (N,) of a
    sector and a phase, and gives those of the wheel.
    """
    n, count = len(full.positions), faces.n_sectors
    shared = np.full(n, -1)  # the node of the next sector that a node of this one is
    shared[faces.right] = faces.left
    number = np.full((count, n), -1)
    own = np.setdiff1d(np.arange(n), np.concatenate([faces.right, faces.axis]))
    for j in range(count):
        number[j, own] = j * len(own) + np.arange(len(own))
        number[j, faces.axis] = count * len(own) + np.arange(len(faces.axis))
    for j in range(count):
        number[j, faces.right] = number[(j + 1) % count, shared[faces.right]]
    size = number.max() + 1
    stiffness = mass = 0
    turns = [np.linalg.matrix_power(faces.turn, j) for j in range(count)]
    for rows, turn, own in zip(number, turns, sectors or count * [full], strict=True):
        place = coo_matrix((np.ones(n), (np.arange(n), rows)), (n, size))
        here = kron(place, turn.T).tocsr()  # displacements of the sector in its own axes
        stiffness, mass = stiffness + here.T @ own.stiffness @ here, mass + here.T @ own.mass @ here

    def expanded(shape, phase):
        found = np.zeros((size, 3), complex)
        for j, (rows, turn) in enumerate(zip(number, turns, strict=True)):
            found[rows] = np.exp(1j * j * phase) * shape.reshape(-1, 3) @ turn.T
        return found.ravel()

    held = (3 * number[:, full.fixed[::3] // 3][..., None] + np.arange(3)).ravel()
    return stiffness.tocsc(), mass.tocsc(), np.unique(held), expanded


def annular_sector(n_sectors, radii, thickness, divisions, bore="free"):
    """A plain disk with curved edges of 20-node bricks; divisions along x, the radius and the angle."""
    points, bricks = box(divisions, (1.0, 1.0, 1.0))
    flat, blocks = with_mid_sides(points, [("hex20", bricks, "")])
    radius, angle = radii[0] + (radii[1] - radii[0]) * flat[:, 1], 2.0 * np.pi / n_sectors * (flat[:, 2] - 0.5)
    positions = np.column_stack([thickness * (0.5 - flat[:, 0]), radius * np.sin(angle), radius * np.cos(angle)])
    ends = {}
    for name, end in (("right", 1.0), ("left", 0.0)):
        ends[f"cyclic_{name}"] = np.flatnonzero(np.abs(flat[:, 2] - end) < 1e-9)
    ends["root"] = np.flatnonzero(flat[:, 1] < 1e-9) if bore == "clamped" else np.zeros(0, dtype=int)
    for name, around in (("tip", 0.5), ("contact_right", 0.75), ("contact_left", 0.25)):  # on the rim, not in contact
        ends[name] = np.argmin(np.abs(flat - [0.0, 1.0, around]).sum(axis=1), keepdims=True)
    return _sector(positions, blocks, ends, n_sectors)


def wheel_mesh(sector):
    """All sectors in one mesh without cut faces, clamped where they are; shrouds touch and are not joined."""
    count, n = sector.n_blades, len(sector.points)
    right, left = (sector.node_sets[f"cyclic_{name}"] for name in ("right", "left"))
    place = np.arange(count * n).reshape(count, n)
    for j in range(count):
        place[j, right] = (j + 1) % count * n + left
    kept, place = np.unique(place, return_inverse=True)
    place = place.reshape(count, n)
    turned = [sector.points @ turn_about_axis(2.0 * np.pi * j / count).T for j in range(count)]
    blocks = [
        ElementBlock(block.kind, np.vstack([rows[block.nodes] for rows in place]), block.material)
        for block in sector.blocks
    ]
    root = np.unique(place[:, sector.node_sets["root"]])
    return _sector(np.vstack(turned)[kept], blocks, {"root": root, "tip": place[0, sector.node_sets["tip"]]}, 1)
