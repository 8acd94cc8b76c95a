"""Scenes with [model]: matrices of another program from files to the response, without a mesh of ours."""

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pipeline_support import shroud, write_scene
from scipy.io import mmwrite

from rom import (
    BoundaryChoice,
    Material,
    ReductionOptions,
    assemble,
    reduce_sector,
    write_reduced_model,
)

sys.path.append(str(Path(__file__).parents[1] / "rom"))
import calculix
from matrix_tables import stocky_sector, store_matrices, write_nodes

pytestmark = pytest.mark.xdist_group("matrices")
STEEL = Material(2e11, 0.3, 7800.0)
NODAL = BoundaryChoice(contact_dofs="nodal")
MODES = 8


def matrix_scene(**model: Any) -> dict[str, Any]:
    return {
        "name": "matrices",
        "model": {"stiffness": "K.mtx", "mass": "M.mtx", "nodes": "nodes.csv", "n_blades": 40, **model},
        "rom": {"modes": MODES},
        "contact": {
            "normal_stiffness": 2e7,
            "tangential_stiffness": 1.5e7,
            "friction": 0.3,
            "interference": 2e-8,
        },
        "excitation": {"engine_order": 8, "force": 10.0},
        "response": {
            "frequency": [1700.0, 2600.0],
            "damping_ratio": 0.01,
            "stability": "folds",
            "detached": False,
            "truncation": False,
        },
    }


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Stiffness and mass of a blade with clamped nodes among the rows, its nodes, and its own reduced model."""
    place = tmp_path_factory.mktemp("matrices")
    sector = stocky_sector()
    full = assemble(sector, STEEL, "hex8")
    mmwrite(place / "K.mtx", full.stiffness, symmetry="symmetric", precision=17)
    mmwrite(place / "M.mtx", full.mass, symmetry="symmetric", precision=17)
    write_nodes(place / "nodes.csv", sector.points, sector, sector.node_sets["root"])
    write_reduced_model(place / "own.h5", reduce_sector(full, sector, ReductionOptions(MODES), NODAL).model)
    return place


@pytest.fixture(scope="module")
def ran(folder: Path) -> Path:
    """Output folder of the scene."""
    scene = write_scene(folder / "s.toml", matrix_scene())
    status, _, error = shroud("run", scene, "--out", folder / "out", "--quiet")
    assert (status, error) == (0, "")
    return folder / "out"


def curve(out: Path) -> np.ndarray:
    """Frequency and amplitude of the points of the only curve."""
    table = np.genfromtxt(out / "response.csv", delimiter=",", names=True)
    return np.column_stack([table["frequency_hz"], table["amplitude_m"]])


def test_response_is_that_of_the_assembled_model(folder: Path, ran: Path) -> None:
    scene = matrix_scene()
    scene.pop("model")
    given = write_scene(folder / "given.toml", scene)
    status, _, error = shroud("respond", given, "--rom", folder / "own.h5", "--out", folder / "own", "--quiet")
    assert (status, error) == (0, "")
    ours, theirs = curve(folder / "own"), curve(ran)
    assert ours.shape == theirs.shape
    assert np.allclose(theirs, ours, rtol=1e-9)


@pytest.mark.skipif(calculix.PROGRAM is None, reason="CalculiX is not installed: no ccx on PATH")
def test_response_from_the_matrices_of_calculix_is_that_of_our_elements(tmp_path: Path) -> None:
    """The whole chain without our elements, friction and partial lift-off included: 1e-8 of the peak."""
    sector = stocky_sector()
    mesh = calculix.quadratic_mesh(sector)
    store_matrices(tmp_path, mesh, STEEL)
    write_nodes(tmp_path / "nodes.csv", mesh.points, sector, mesh.clamped)
    scene = matrix_scene(stiffness="blade.sti", mass="blade.mas")
    status, _, error = shroud("run", write_scene(tmp_path / "s.toml", scene), "--out", tmp_path / "out", "--quiet")
    assert (status, error) == (0, "")
    own = reduce_sector(assemble(sector, STEEL, "hex20"), sector, ReductionOptions(MODES), NODAL).model
    write_reduced_model(tmp_path / "own.h5", own)
    scene.pop("model")
    given = write_scene(tmp_path / "given.toml", scene)
    shroud("respond", given, "--rom", tmp_path / "own.h5", "--out", tmp_path / "own", "--quiet")
    ours, theirs = curve(tmp_path / "own"), curve(tmp_path / "out")
    assert ours.shape == theirs.shape
    assert len(ours) > 20
    assert np.abs(theirs - ours).max(axis=0) == pytest.approx(0.0, abs=1e-8 * 2600.0)
    assert np.abs(theirs[:, 1] - ours[:, 1]).max() < 1e-8 * ours[:, 1].max()
