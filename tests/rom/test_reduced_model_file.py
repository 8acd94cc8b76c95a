"""The file of a reduced model: what is written is read, and what is wrong is named."""

from dataclasses import replace

import h5py
import numpy as np
import pytest
from test_receptance import random_model

from rom import ReducedModelError, read_reduced_model, write_reduced_model

ARRAYS = (
    "mass",
    "stiffness",
    "contact_right",
    "contact_left",
    "contact_position",
    "contact_area",
    "contact_frame",
    "force_excitation",
    "force_centrifugal",
    "force_static",
    "coriolis",
    "blade_stiffness",
    "basis",
)


def test_the_bytes_do_not_depend_on_what_other_libraries_set(tmp_path, monkeypatch):
    """meshlane has HDF5 keep the order of creation in every file of the process, once it has written one itself."""
    write_reduced_model(tmp_path / "rom.h5", random_model())
    monkeypatch.setattr(h5py.get_config(), "track_order", True)
    write_reduced_model(tmp_path / "again.h5", random_model())
    assert h5py.get_config().track_order is True
    assert (tmp_path / "again.h5").read_bytes() == (tmp_path / "rom.h5").read_bytes()


@pytest.mark.parametrize("ground", [False, True])
def test_round_trip_is_exact(tmp_path, ground):
    skew = np.random.default_rng(8).normal(size=(10, 10))
    model = replace(random_model(ground=ground, complex_force=True), coriolis=None if ground else skew - skew.T)
    write_reduced_model(tmp_path / "rom.h5", model)
    again = read_reduced_model(tmp_path / "rom.h5")
    for name in ARRAYS:
        before, after = getattr(model, name), getattr(again, name)
        assert (before is None) == (after is None)
        if before is not None:
            assert np.array_equal(before, after)
            assert before.dtype == after.dtype
    assert again.n_blades == model.n_blades
    assert again.producer == model.producer
    assert {name: list(vector) for name, vector in again.outputs.items()} == {
        name: list(vector) for name, vector in model.outputs.items()
    }


@pytest.mark.parametrize("speed", [None, 0.0, 3000.5])
def test_the_speed_is_optional(tmp_path, speed):
    write_reduced_model(tmp_path / "rom.h5", replace(random_model(), speed_rpm=speed))
    with h5py.File(tmp_path / "rom.h5") as file:
        assert ("speed_rpm" in file.attrs) == (speed is not None)
    assert read_reduced_model(tmp_path / "rom.h5").speed_rpm == speed


def test_the_basis_is_read_only_where_it_is_wanted(tmp_path):
    model = replace(random_model(), basis=np.ones((7, 10)))
    write_reduced_model(tmp_path / "rom.h5", model)
    assert np.array_equal(read_reduced_model(tmp_path / "rom.h5").basis, model.basis)
    assert read_reduced_model(tmp_path / "rom.h5", with_basis=False).basis is None


def test_the_layout_is_the_documented_one(tmp_path):
    write_reduced_model(tmp_path / "rom.h5", random_model())
    with h5py.File(tmp_path / "rom.h5") as file:
        names = []
        file.visititems(lambda name, item: names.append(name) if isinstance(item, h5py.Dataset) else None)
        assert {"mass", "stiffness", "contact/right", "contact/left", "contact/position", "force/excitation"} <= set(
            names
        )
        assert {"force/centrifugal", "force/static", "output/tip", "output/root"} <= set(names)
        assert file.attrs["format"] == "1"
        assert file.attrs["n_blades"] == 9


def damage(path, name, change):
    with h5py.File(path, "r+") as file:
        if name in file.attrs:
            file.attrs[name] = change
            return
        value = None if change is None else change(file[name][()])
        del file[name]
        if value is not None:
            file[name] = value


@pytest.mark.parametrize(
    ("name", "change", "words"),
    [
        ("mass", None, "mass: missing"),
        ("mass", lambda a: a[:4], r"mass: shape"),
        ("mass", lambda a: a + np.triu(np.ones_like(a), 1), "mass: asymmetric"),
        ("mass", lambda a: a.astype("S5"), "mass: type"),
        ("mass", lambda a: 3.0, "mass: shape"),
        ("stiffness", lambda a: a * np.nan, "stiffness: holds values that are not finite"),
        ("stiffness", lambda a: a + 1j, "stiffness: type"),
        ("contact/right", lambda a: a[:5], "contact/right: shape"),
        ("contact/position", lambda a: a[:1], "contact/right: shape|contact/left: shape"),
        ("contact/position", lambda a: a[:, :2], "contact/position: shape"),
        ("contact/frame", lambda a: 2.0 * a, "contact/frame: off by 3, allowed: orthonormal rows t1, t2, n"),
        ("force/excitation", None, "force/excitation: missing"),
        ("force/static", lambda a: a[:3], "force/static: shape"),
        ("output/tip", None, "output/tip: missing"),
        ("output/root", lambda a: a[:2], "output/root: shape"),
        ("format", "7", "format: '7', allowed: '1'"),
        ("n_blades", 0, "n_blades: 0, allowed: 1 to 10000"),
        ("n_blades", 2.5, "n_blades.*whole number"),
        ("speed_rpm", "fast", "speed_rpm.*finite number"),
        ("speed_rpm", np.inf, "speed_rpm.*finite number"),
    ],
)
def test_what_is_wrong_is_named(tmp_path, name, change, words):
    path = tmp_path / "rom.h5"
    write_reduced_model(path, replace(random_model(), speed_rpm=0.0))
    damage(path, name, change)
    with pytest.raises(ReducedModelError, match=words) as caught:
        read_reduced_model(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_files_that_are_no_models_are_named(tmp_path):
    with pytest.raises(ReducedModelError, match="no such file"):
        read_reduced_model(tmp_path / "absent.h5")
    (tmp_path / "text.h5").write_text("not HDF5")
    with pytest.raises(ReducedModelError, match=r"text\.h5: not readable"):
        read_reduced_model(tmp_path / "text.h5")
    write_reduced_model(tmp_path / "cut.h5", random_model())
    (tmp_path / "cut.h5").write_bytes((tmp_path / "cut.h5").read_bytes()[:700])
    with pytest.raises(ReducedModelError, match=r"cut\.h5"):
        read_reduced_model(tmp_path / "cut.h5")
    with pytest.raises(ReducedModelError, match="no such file"):
        read_reduced_model(tmp_path)


def test_a_dataset_that_claims_what_nobody_wrote(tmp_path):
    """Ten kilobytes that would become gigabytes of zeros."""
    path = tmp_path / "huge.h5"
    write_reduced_model(path, random_model())
    with h5py.File(path, "r+") as file:
        del file["mass"]
        file.create_dataset("mass", shape=(19_000, 19_000), dtype="f8", chunks=True)
    assert path.stat().st_size < 10**6
    with pytest.raises(ReducedModelError, match=r"mass: claims 2\.89e\+09 bytes"):
        read_reduced_model(path)
