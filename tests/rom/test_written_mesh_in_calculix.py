"""A curved body of three kinds of element and three materials, written for CalculiX, and read from the same deck."""

from dataclasses import replace

import calculix
import numpy as np
import pytest
from element_meshes import arched, mixed_brick
from mesh_writer import write_mesh
from rom_reference import lowest_hz

from geometry import read_mesh
from rom import Material
from rom.finite_elements.assembly import elastic_matrices
from rom.finite_elements.discretisation import discretise

COUNT = 6
MATERIALS = {
    "foot": Material(1.9e11, 0.29, 8200.0),
    "MATERIAL": Material(2.1e11, 0.3, 7800.0),
    "leaf": Material(1.14e11, 0.34, 4430.0),
}


@pytest.mark.skipif(calculix.PROGRAM is None, reason="CalculiX is not installed: no ccx on PATH")
def test_one_file_two_programs(tmp_path):
    mesh = mixed_brick(arched, ("foot", "", "leaf"))
    sets = {"root": np.flatnonzero(mesh.points[:, 0] < 1e-9)}
    properties = {
        name: {"young_modulus": m.young_modulus, "poisson_ratio": m.poisson_ratio, "density": m.density}
        for name, m in MATERIALS.items()
    }
    path = tmp_path / "arch.inp"
    write_mesh(path, replace(mesh, node_sets=sets), properties)
    text = path.read_text() + f"*BOUNDARY\nroot, 1, 3, 0.\n*STEP\n*FREQUENCY\n{COUNT}\n*END STEP\n"
    path.write_text(text)
    exact = calculix.run(tmp_path, text)

    found = read_mesh(path)
    assert {name: Material(**numbers) for name, numbers in found.materials.items()} == MATERIALS
    materials = {name: Material(**numbers) for name, numbers in found.materials.items()}
    body = replace(mesh, points=found.points, blocks=found.blocks)
    held = (3 * found.node_sets["root"][:, None] + np.arange(3)).ravel()
    hertz = lowest_hz(*elastic_matrices(discretise(body), materials), COUNT, held)
    np.testing.assert_allclose(hertz, exact, rtol=1e-6)
