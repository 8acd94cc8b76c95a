"""Tables of nodes and decks of CalculiX for tests with matrices of other programs."""

import os
import subprocess
from dataclasses import replace
from pathlib import Path

import calculix
import numpy as np

from geometry import BladeParameters, MeshParameters, ShroudParameters, build_sector


def stocky_sector(n_blades=40):
    """A short thick blade with coordinates that the 14 digits of a deck hold exactly."""
    blade = BladeParameters(n_blades, 0.3, 0.06, 0.024, 0.016)
    sector = build_sector(
        blade, ShroudParameters(45.0, 0.012, 0.03, 0.01), MeshParameters(size=0.015, contact_grid=(3, 2))
    )
    points = np.round(sector.points, 9)
    faces = {
        side: replace(getattr(sector, side), position=points[getattr(sector, side).nodes])
        for side in ("right", "left")
    }
    return replace(sector, points=points, **faces)


def write_nodes(path, points, sector, clamped, labels=None, faces=True):
    """nodes.csv of a sector whose vertices are the first points; `faces`: with the normals and areas of the faces."""
    labels = np.arange(1, len(points) + 1) if labels is None else labels
    sets = {
        "contact_right": sector.right.nodes,
        "contact_left": sector.left.nodes,
        "tip": sector.node_sets["tip"],
        "root": clamped,
    }
    normal = {int(node): frame[2] for node, frame in zip(sector.right.nodes, sector.right.frame, strict=True)}
    area = dict(zip(sector.right.nodes.tolist(), sector.right.area, strict=True))
    lines = ["node,x,y,z,sets" + ",area,nx,ny,nz" * faces]
    for k, point in enumerate(points):
        fields = [str(labels[k]), *(repr(float(value)) for value in point)]
        fields.append(" ".join(name for name, nodes in sets.items() if k in nodes))
        if faces:
            given = [area[k], *normal[k]] if k in area else []
            fields += [repr(float(value)) for value in given] or [""] * 4
        lines.append(",".join(fields))
    Path(path).write_text("\n".join(lines) + "\n")


def store_matrices(folder, mesh, material):
    """Have CalculiX write stiffness, mass and dofs of the clamped body: blade.sti, blade.mas, blade.dof."""
    text = calculix.deck(mesh, material, 1).replace("*FREQUENCY\n", "*FREQUENCY, SOLVER=MATRIXSTORAGE\n")
    (Path(folder) / "blade.inp").write_text(text)
    subprocess.run(
        [calculix.PROGRAM, "-i", "blade"],
        cwd=folder,
        env={**os.environ, "OMP_NUM_THREADS": "1"},
        capture_output=True,
        check=True,
    )
