"""CalculiX decks of meshes with several kinds of elements and materials: frequencies, and static displacements.

Node and element numbers are those of the mesh plus one; everything else is written here from the corners alone.
"""

import os
import subprocess
from pathlib import Path

import numpy as np
from calculix import PROGRAM, frequencies, static_step

from rom import AnisotropicMaterial, MaterialTable

TYPES = {
    "tet4": "C3D4",
    "tet10": "C3D10",
    "wedge6": "C3D6",
    "wedge15": "C3D15",
    "hex8": "C3D8",
    "hex20": "C3D20",
}
# Corners of the faces P1, P2, ... of an element, by its number of corners.
_FACES = {
    4: ((0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0)),
    6: ((0, 1, 2), (3, 5, 4), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)),
    8: ((0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0)),
}
_PER_LINE = 10


def body(mesh, materials, clamped):
    """Lines of the mesh with its materials (by the names of the blocks) and clamped nodes."""
    lines = ["*NODE, NSET=ALL"]
    lines += [f"{k}, " + ", ".join(f"{x:.12e}" for x in point) for k, point in enumerate(mesh.points, 1)]
    for index, (block, first) in enumerate(zip(mesh.blocks, first_numbers(mesh), strict=True)):
        lines.append(f"*ELEMENT, TYPE={TYPES[block.kind]}, ELSET=BLOCK{index}")
        for number, nodes in enumerate(block.nodes + 1, first):
            fields = [str(field) for field in (number, *nodes)]
            rows = [fields[k : k + _PER_LINE] for k in range(0, len(fields), _PER_LINE)]
            lines += [", ".join(row) + ("," if row is not rows[-1] else "") for row in rows]
    for index, block in enumerate(mesh.blocks):
        lines += material_lines(materials[block.material], index)
    lines += ["*ELSET, ELSET=BLADE", *[f"BLOCK{index}," for index in range(len(mesh.blocks))]]
    if len(clamped):
        lines += ["*NSET, NSET=ROOT", *[f"{node + 1}," for node in clamped], "*BOUNDARY", "ROOT, 1, 3, 0.0"]
    return lines


def material_lines(material, index):
    """Lines of a material, its orientation and its section; expansions of a table are mean ones from 0."""
    table = isinstance(material, MaterialTable)
    states = material.states if table else [material]
    ends = [f", {at:.12e}" for at in material.temperature] if table else [""]
    lines, oriented = [f"*MATERIAL, NAME=SOLID{index}"], isinstance(states[0], AnisotropicMaterial)
    if oriented:  # D1111, D1122, D2222, D1133, D2233, D3333, D1212, D1313, / D2323
        at = [(0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2), (5, 5), (4, 4), (3, 3)]
        numbers = [[f"{state.stiffness[place]:.12e}" for place in at] for state in states]
        rows = [", ".join(row[:8]) + ",\n" + row[8] for row in numbers]
    else:
        rows = [f"{state.young_modulus:.12e}, {state.poisson_ratio:.12e}" for state in states]
    lines += ["*ELASTIC, TYPE=ORTHO" if oriented else "*ELASTIC", *map(str.__add__, rows, ends)]
    lines += ["*DENSITY", *(f"{state.density:.12e}{end}" for state, end in zip(states, ends, strict=True))]
    kind = ", TYPE=ORTHO" if oriented else ""
    lines.append(f"*EXPANSION, ZERO=0.{kind}")
    for state, end in zip(states, ends, strict=True):
        lines.append(", ".join(f"{value:.12e}" for value in np.atleast_1d(state.expansion)) + end)
    if oriented:
        along = ", ".join(f"{value:.12e}" for value in states[0].axes[:2].ravel())
        lines += [f"*ORIENTATION, NAME=AXES{index}", along]
    section = f"*SOLID SECTION, ELSET=BLOCK{index}, MATERIAL=SOLID{index}"
    return [*lines, section + (f", ORIENTATION=AXES{index}" if oriented else "")]


def first_numbers(mesh):
    """Number of the first element of each block."""
    return np.cumsum([1, *(len(block) for block in mesh.blocks[:-1])]).tolist()


def frequency_deck(mesh, materials, clamped, count, rotation=None, temperature=None):
    """Text of a deck for `count` natural frequencies, at rest or about the equilibrium of a rotation.

    `temperature` (n,): of the nodes; there is no thermal stress at it.
    """
    lines = body(mesh, materials, clamped)
    if temperature is not None:
        lines += ["*INITIAL CONDITIONS, TYPE=TEMPERATURE"]
        lines += [f"{k}, {value:.12e}" for k, value in enumerate(temperature, 1)]
    lines += ["*STEP"] if rotation is None else [*static_step(rotation), "*STEP, PERTURBATION"]
    lines += ["*FREQUENCY", f"{count}", "*END STEP"]
    return "\n".join(lines) + "\n"


def static_deck(mesh, materials, clamped, pressure=(), temperature=None):
    """Text of a deck for the displacements under pressures [(corners of a side, value)] and temperatures (n,)."""
    lines = body(mesh, materials, clamped)
    if temperature is not None:
        lines += ["*INITIAL CONDITIONS, TYPE=TEMPERATURE", "ALL, 0."]
    lines += ["*STEP", "*STATIC"]
    if temperature is not None:
        lines += ["*TEMPERATURE", *[f"{k}, {value:.12e}" for k, value in enumerate(temperature, 1)]]
    if len(pressure):
        lines += ["*DLOAD", *_pressure_lines(mesh, pressure)]
    lines += ["*NODE PRINT, NSET=ALL", "U", "*END STEP"]
    return "\n".join(lines) + "\n"


def _pressure_lines(mesh, pressure):
    wanted = {frozenset(int(node) for node in corners): value for corners, value in pressure}
    lines = []
    for block, first in zip(mesh.blocks, first_numbers(mesh), strict=True):
        for number, nodes in enumerate(block.nodes, first):
            for face, corners in enumerate(_FACES[block.topology.corners], 1):
                value = wanted.get(frozenset(nodes[list(corners)].tolist()))
                if value is not None:
                    lines.append(f"{number}, P{face}, {value:.12e}")
    assert len(lines) == len(wanted)
    return lines


def run(folder, text):
    """The text of the result file that the installed program writes for a deck."""
    (Path(folder) / "body.inp").write_text(text)
    environment = {**os.environ, "OMP_NUM_THREADS": "1"}
    done = subprocess.run(
        [PROGRAM, "-i", "body"], cwd=folder, env=environment, capture_output=True, text=True, check=False
    )
    result = Path(folder) / "body.dat"
    if done.returncode != 0 or not result.exists():
        raise RuntimeError(f"ccx ended with {done.returncode}:\n{done.stdout[-2000:]}{done.stderr[-2000:]}")
    return result.read_text()


def natural_frequencies(folder, mesh, materials, clamped, count, rotation=None, temperature=None):
    """Natural frequencies (count,) that CalculiX finds, Hz."""
    return frequencies(run(folder, frequency_deck(mesh, materials, clamped, count, rotation, temperature)))


def displacements(folder, text, n_nodes):
    """Displacements (n, 3) in the result file of a static deck."""
    found = np.full((n_nodes, 3), np.nan)
    for line in run(folder, text).splitlines():
        fields = line.split()
        if len(fields) == 4 and fields[0].isdigit():
            found[int(fields[0]) - 1] = [float(field) for field in fields[1:]]
    return found
