"""The full model on disk."""

import h5py
import numpy as np
import pytest
from rom_meshes import NODAL, box_sector

from rom import Material, ReductionOptions, assemble, reduce_sector
from rom.errors import FullModelFileError
from rom.files.full_model_file import load_full_model, save_full_model
from rom.finite_elements.rotation import stiffen_by_rotation

STEEL = Material(young_modulus=2.1e11, poisson_ratio=0.3, density=7800.0)


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    sector = box_sector(divisions=(4, 2, 4))
    full = stiffen_by_rotation(assemble(sector, STEEL), sector, STEEL, 3000.0)
    path = tmp_path_factory.mktemp("full") / "full.h5"
    save_full_model(path, full)
    return sector, full, path


def test_reads_back_what_was_written(saved):
    _, full, path = saved
    read = load_full_model(path)
    for name in ("positions", "vertex_node", "fixed", "centrifugal"):
        np.testing.assert_array_equal(getattr(read, name), getattr(full, name))
    assert (read.element, read.speed_rpm, read.n_dofs) == ("hex20", 3000.0, full.n_dofs)
    for name in ("stiffness", "mass"):
        mine, theirs = getattr(read, name), getattr(full, name)
        assert abs(mine - theirs).max() == 0.0
        np.testing.assert_array_equal(mine.indptr, theirs.indptr)
        np.testing.assert_array_equal(mine.indices, theirs.indices)


def test_a_model_of_the_elements_of_a_mesh_says_so(tmp_path):
    sector = box_sector(divisions=(2, 2, 2))
    save_full_model(tmp_path / "own.h5", assemble(sector, STEEL, None))
    assert load_full_model(tmp_path / "own.h5").element is None


def test_reduces_to_the_same_bits(saved):
    sector, full, path = saved
    first, second = (
        reduce_sector(model, sector, ReductionOptions(modes=6), NODAL).model
        for model in (full, load_full_model(path))
    )
    for name in ("mass", "stiffness", "basis", "force_centrifugal"):
        np.testing.assert_array_equal(getattr(first, name), getattr(second, name))


def test_same_model_same_file(saved, tmp_path):
    _, full, path = saved
    save_full_model(tmp_path / "again.h5", full)
    assert (tmp_path / "again.h5").read_bytes() == path.read_bytes()


def test_other_files_are_refused_in_one_line(saved, tmp_path):
    missing, text, foreign, torn = (tmp_path / name for name in ("missing.h5", "text.h5", "foreign.h5", "torn.h5"))
    text.write_text("not HDF5")
    with h5py.File(foreign, "w") as file:
        file["mass"] = np.eye(3)
    torn.write_bytes(saved[2].read_bytes()[:5000])
    for path in (missing, text, foreign, torn, tmp_path):
        with pytest.raises(FullModelFileError, match=path.name) as caught:
            load_full_model(path)
        assert "\n" not in str(caught.value)


def test_missing_parts_are_refused(saved, tmp_path):
    _, _, path = saved
    for part in ("centrifugal", "stiffness/data", "mass"):
        copy = tmp_path / "part.h5"
        copy.write_bytes(path.read_bytes())
        with h5py.File(copy, "r+") as file:
            del file[part]
        with pytest.raises(FullModelFileError, match=r"part\.h5: cannot be read as a full model"):
            load_full_model(copy)
