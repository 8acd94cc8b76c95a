"""The same blade in CalculiX: input deck of a sector with 20-node bricks, its run, and the frequencies it prints.

The deck numbers its nodes, places the mid-edge ones and picks the clamped ones by itself, from the corners alone.
"""

import os
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

import numpy as np

PROGRAM = shutil.which("ccx")
# CalculiX reads this much of a field and drops the rest without a word.
FIELD_WIDTH = 20

# Ends of the mid-edge nodes 9 to 20 of a C3D20 among its corners: round the bottom, round the top, upwards.
_EDGES = ((0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7))
_PER_LINE = 10
_TABLE = "E I G E N V A L U E   O U T P U T"


@dataclass(frozen=True)
class QuadraticMesh:
    """20-node bricks: points (n, 3) [m], elements (E, 20) rows of points, clamped (c,) sorted rows of points."""

    points: np.ndarray
    elements: np.ndarray
    clamped: np.ndarray


def quadratic_mesh(sector):
    """A sector's hexahedra with one node in the middle of each edge; edges between root nodes are clamped."""
    # VTK and Abaqus number the corners of a hexahedron alike.
    corners = np.asarray(sector.hexahedra)
    ends = np.sort(corners[:, _EDGES], axis=-1)
    edges, place = np.unique(ends.reshape(-1, 2), axis=0, return_inverse=True)
    first = len(sector.points)
    middle = first + place.reshape(len(corners), len(_EDGES))
    root = np.asarray(sector.node_sets["root"])
    held = first + np.flatnonzero(np.isin(edges, root).all(axis=1))
    return QuadraticMesh(
        points=np.vstack([sector.points, sector.points[edges].mean(axis=1)]),
        elements=np.hstack([corners, middle]),
        clamped=np.concatenate([np.sort(root), held]),
    )


@dataclass(frozen=True)
class Rotation:
    """Steady rotation about the x axis, rad/s; the equilibrium is nonlinear (NLGEOM) or linear.

    With `coriolis` a second table has the frequencies with Coriolis forces, from as many modes as the first one.
    """

    omega: float
    nonlinear: bool = True
    coriolis: bool = False

    @property
    def load(self):
        """Lines of the centrifugal load."""
        return ["*DLOAD", f"BLADE, CENTRIF, {self.omega**2:.12e}, 0., 0., 0., 1., 0., 0."]


def deck(mesh, material, count, rotation=None):
    """Text of the input deck (SI units) that asks for `count` natural frequencies of the clamped body.

    With a rotation they are those of small vibrations about its static equilibrium.
    """
    nodes = [f"{k}, " + ", ".join(f"{x:.12e}" for x in point) for k, point in enumerate(mesh.points, 1)]
    elements = []
    for k, element in enumerate(mesh.elements + 1, 1):
        fields = [str(field) for field in (k, *element)]
        # A line that ends in a comma goes on in the next.
        elements += [", ".join(fields[:_PER_LINE]) + ",", ", ".join(fields[_PER_LINE:])]
    lines = [
        "*NODE, NSET=ALL",
        *nodes,
        "*ELEMENT, TYPE=C3D20, ELSET=BLADE",
        *elements,
        "*NSET, NSET=ROOT",
        *[f"{node}," for node in mesh.clamped + 1],
        "*BOUNDARY",
        "ROOT, 1, 3, 0.0",
        "*MATERIAL, NAME=SOLID",
        "*ELASTIC",
        f"{material.young_modulus:.12e}, {material.poisson_ratio:.12e}",
        "*DENSITY",
        f"{material.density:.12e}",
        "*SOLID SECTION, ELSET=BLADE, MATERIAL=SOLID",
        *([] if rotation is None else static_step(rotation)),
        "*STEP" if rotation is None else "*STEP, PERTURBATION",
        "*FREQUENCY, STORAGE=YES" if rotation is not None and rotation.coriolis else "*FREQUENCY",
        f"{count}",
        "*END STEP",
        *(_coriolis_step(rotation, count) if rotation is not None and rotation.coriolis else []),
    ]
    return "\n".join(lines) + "\n"


def static_step(rotation):
    """The centrifugal load, which a later perturbation step keeps; the tolerances are far below the default ones."""
    return [
        "*STEP, NLGEOM" if rotation.nonlinear else "*STEP",
        "*STATIC",
        *(["*CONTROLS, PARAMETERS=FIELD", "1.e-9, 1.e-9, , , , , 1.e-9"] if rotation.nonlinear else []),
        *rotation.load,
        "*END STEP",
    ]


def _coriolis_step(rotation, count):
    return ["*STEP, PERTURBATION", "*COMPLEX FREQUENCY, CORIOLIS", f"{count}", *rotation.load, "*END STEP"]


def run(folder, text):
    """Frequencies (m,) [Hz] that the installed program finds for a deck, its files left in `folder`."""
    return frequencies(solve(folder, text))


def solve(folder, text):
    """Run the installed program on a deck, its files left in `folder`; the text of its tables."""
    (Path(folder) / "blade.inp").write_text(text)
    environment = {**os.environ, "OMP_NUM_THREADS": "1"}
    done = subprocess.run(
        [PROGRAM, "-i", "blade"], cwd=folder, env=environment, capture_output=True, text=True, check=False
    )
    result = Path(folder) / "blade.dat"
    if done.returncode != 0 or not result.exists():
        raise RuntimeError(f"ccx ended with {done.returncode}:\n{done.stdout[-2000:]}{done.stderr[-2000:]}")
    return result.read_text()


def frequencies(text):
    """Frequencies (m,) [Hz] in a result file: its first table, columns number, eigenvalue, rad/s, Hz, damping."""
    return _hertz_column(text[text.index(_TABLE) :], skipped=2)


def gyroscopic_frequencies(text):
    """Frequencies (m,) [Hz] with Coriolis forces: the last table, columns number, rad/s, Hz, damping."""
    return _hertz_column(text[text.rindex(_TABLE) :], skipped=1)


def _hertz_column(text, skipped):
    rows = []
    for line in text.splitlines()[1:]:
        fields = line.split()
        if rows and not fields:
            break
        if len(fields) == skipped + 3 and fields[0] == str(len(rows) + 1):
            rows.append(float(fields[skipped + 1]))
    return np.array(rows)


def static_deck(mesh, material, rotation=None, forces=None):
    """Text of an input deck for a linear static solution, with displacements and stresses in the .frd file.

    `forces` (n, 3) [N]: nodal forces.
    """
    text = deck(mesh, material, 1)
    head = text[: text.index("*STEP")]
    loads = [] if rotation is None else rotation.load
    if forces is not None:
        loads = [*loads, "*CLOAD"]
        for node, axis in np.argwhere(forces != 0.0):
            loads.append(f"{node + 1}, {axis + 1}, {forces[node, axis]:.12e}")
    return head + "\n".join(["*STEP", "*STATIC", *loads, "*NODE FILE", "U", "*EL FILE", "S", "*END STEP", ""])


def nodal_field(path, name):
    """Values (n, k) of a field in an .frd file, node by node."""
    rows, inside = [], False
    for line in Path(path).read_text().splitlines():
        if line.startswith(" -4"):
            inside = line.split()[1] == name
        elif inside and line.startswith(" -3"):
            break
        elif inside and line.startswith(" -1"):
            rows.append([float(line[start : start + 12]) for start in range(13, len(line.rstrip()), 12)])
    return np.array(rows)


def with_serendipity_extrapolation(recovery):
    """The recovery of our stresses with CalculiX's: the 20-node polynomials fitted to the 27 Gauss points."""
    from dataclasses import replace

    from skfem.quadrature import get_quadrature
    from skfem.refdom import RefHex

    from rom.finite_elements.reference_element import shape_functions

    values, _ = shape_functions("hex20", get_quadrature(RefHex, 5)[0])
    matrix = np.linalg.pinv(values)
    return replace(recovery, blocks=[replace(block, extrapolation=matrix) for block in recovery.blocks])
