"""Reduced models from elsewhere with everything wrong that HDF5 lets one write: refused in one line, or read."""

import random
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from test_receptance import random_model

import pipeline.process.isolated_reading
from geometry.errors import SectorFileError
from pipeline.errors import InputError
from pipeline.process.isolated_reading import read_apart
from rom import (
    Material,
    ReducedModelError,
    assemble,
    modal_model,
    natural_frequencies,
    read_reduced_model,
    write_reduced_model,
)
from rom.errors import FullModelFileError
from rom.files.full_model_file import load_full_model, save_full_model
from rom.files.sector_file import load_sector, save_sector

DATASETS = (
    "mass",
    "stiffness",
    "contact/right",
    "contact/left",
    "contact/position",
    "contact/area",
    "force/excitation",
    "force/centrifugal",
    "force/static",
    "coriolis",
    "blade_stiffness",
    "output/tip",
    "basis",
)
REQUIRED = ("mass", "stiffness", "contact/right", "contact/position", "force/excitation", "output/tip")


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A model with all that one can have."""
    path = tmp_path_factory.mktemp("whole") / "rom.h5"
    write_reduced_model(path, random_model())
    with h5py.File(path, "r+") as file:
        n, contacts = file["mass"].shape[0], file["contact/position"].shape[0]
        for name, array in (
            ("contact/area", np.ones(contacts)),
            ("coriolis", np.zeros((n, n))),
            ("blade_stiffness", np.ones((n, n))),
            ("basis", np.ones((6, n))),
        ):
            if name not in file:
                file[name] = array
        for name in DATASETS:
            assert name in file
    return path


def put(file: h5py.File, name: str, **how: Any) -> None:
    del file[name]
    file.create_dataset(name, **how)


def changed(change: Callable[[np.ndarray], Any]) -> Callable[[h5py.File, str], None]:
    return lambda file, name: put(file, name, data=change(file[name][()]))


def shaped(**how: Any) -> Callable[[h5py.File, str], None]:
    return lambda file, name: put(file, name, shape=file[name].shape, **how)


def to_group(file: h5py.File, name: str) -> None:
    del file[name]
    file.create_group(name)


def to_nowhere(file: h5py.File, name: str) -> None:
    del file[name]
    file[name] = h5py.SoftLink("/nowhere")


def to_itself(file: h5py.File, name: str) -> None:
    del file[name]
    file[name] = h5py.SoftLink(f"/{name}")


def elsewhere(file: h5py.File, name: str) -> None:
    """The same data, by a link into another file."""
    shutil.copy(file.filename, f"{file.filename}.other")
    del file[name]
    file[name] = h5py.ExternalLink(f"{file.filename}.other", name)


def virtual(file: h5py.File, name: str) -> None:
    """The same data, as a view of another file."""
    shutil.copy(file.filename, f"{file.filename}.other")
    shape = file[name].shape
    layout = h5py.VirtualLayout(shape, "f8")
    layout[...] = h5py.VirtualSource(f"{file.filename}.other", name, shape)
    del file[name]
    file.create_virtual_dataset(name, layout)


def outside(file: h5py.File, name: str) -> None:
    """The bytes of another file as numbers."""
    shutil.copy(file.filename, f"{file.filename}.other")
    shape = file[name].shape
    put(file, name, shape=shape, dtype="f8", external=[(f"{file.filename}.other", 0, int(np.prod(shape)) * 8)])


def bomb(file: h5py.File, name: str) -> None:
    """A few kilobytes that unpack to gigabytes."""
    shape = tuple(side * 4000 for side in file[name].shape)
    put(file, name, shape=shape, dtype="f8", chunks=True, compression="gzip", fillvalue=1.0)


def huge_chunk(file: h5py.File, name: str) -> None:
    """A small array in a chunk of nearly four gigabytes."""
    shape = file[name].shape
    chunk = (4 * 10**8, *(1 for _ in shape[1:]))
    put(file, name, shape=shape, maxshape=(None,) * len(shape), dtype="f8", chunks=chunk, compression="gzip")


DAMAGES: dict[str, Callable[[h5py.File, str], None]] = {
    "infinite": changed(lambda a: a * np.where(a == a, np.inf, 0.0) if a.any() else a + np.inf),
    "not a number": changed(lambda a: a * np.nan),
    "enormous": changed(lambda a: np.full_like(a, 1e300)),
    "complex": changed(lambda a: a + 1j),
    "truth": changed(lambda a: a.astype(bool)),
    "text": shaped(dtype=h5py.string_dtype()),
    "bytes": changed(lambda a: a.astype("S8")),
    "lists of any length": shaped(dtype=h5py.vlen_dtype("f8")),
    "references": shaped(dtype=h5py.ref_dtype),
    "records": shaped(dtype=[("a", "f8"), ("b", "i4")]),
    "opaque": shaped(dtype="V16"),
    "no dimension": changed(lambda a: 1.0),
    "one more dimension": changed(lambda a: a[None]),
    "one column too many": changed(lambda a: np.concatenate([a, a[..., :1]], axis=-1)),
    "nothing": changed(lambda a: h5py.Empty("f8")),
    "group": to_group,
    "link to nowhere": to_nowhere,
    "link to itself": to_itself,
    "link into another file": elsewhere,
    "view of another file": virtual,
    "bytes of another file": outside,
    "bomb": bomb,
    "huge chunk": huge_chunk,
}
TAKEN = {("complex", "force/excitation")}


@pytest.mark.parametrize("damage", DAMAGES)
@pytest.mark.parametrize("name", DATASETS)
def test_a_damaged_dataset_is_named(whole: Path, tmp_path: Path, name: str, damage: str) -> None:
    path = tmp_path / "rom.h5"
    shutil.copy(whole, path)
    with h5py.File(path, "r+") as file:
        DAMAGES[damage](file, name)
    if (damage, name) in TAKEN:
        read_reduced_model(path)
        return
    with pytest.raises(ReducedModelError) as caught:
        read_reduced_model(path)
    message = str(caught.value)
    assert message.startswith(f"{path}: ")
    assert "\n" not in message
    assert len(message) < len(str(path)) + 300
    if damage != "one column too many":  # of a mass matrix it makes all the others too narrow
        assert name in message


@pytest.mark.parametrize("name", REQUIRED)
def test_missing_datasets_are_named(whole: Path, tmp_path: Path, name: str) -> None:
    path = tmp_path / "rom.h5"
    shutil.copy(whole, path)
    with h5py.File(path, "r+") as file:
        del file[name]
    with pytest.raises(ReducedModelError, match=f"{name}: missing"):
        read_reduced_model(path)


@pytest.mark.parametrize(
    ("attribute", "value", "words"),
    [
        ("n_blades", 0, "n_blades: 0, allowed: 1 to 10000"),
        ("n_blades", -1, "n_blades: -1, allowed: 1 to 10000"),
        ("n_blades", 10**9, "n_blades: 1000000000, allowed: 1 to 10000"),
        ("n_blades", 1e300, "allowed: 1 to 10000"),
        ("n_blades", 1.5, "n_blades: '1.5', allowed: a whole number"),
        ("n_blades", np.nan, "n_blades: 'nan', allowed: a whole number"),
        ("n_blades", np.inf, "n_blades: 'inf', allowed: a whole number"),
        ("n_blades", "many", "n_blades: 'many', allowed: a whole number"),
        ("n_blades", [9, 9], "allowed: a whole number"),
        ("n_blades", 9j, "allowed: a whole number"),
        ("n_blades", True, "allowed: a whole number"),
        ("n_blades", h5py.Empty("i8"), "allowed: a whole number"),
        ("format", "2", "attribute format: '2', allowed: '1'"),
        ("format", ["1", "1"], "attribute format: "),
        ("format", np.bytes_(b"\xff\xfe"), "attribute format: "),
        ("format", h5py.Empty("S1"), "attribute format: "),
    ],
)
def test_attributes_that_are_nonsense(whole: Path, tmp_path: Path, attribute: str, value: Any, words: str) -> None:
    path = tmp_path / "rom.h5"
    shutil.copy(whole, path)
    with h5py.File(path, "r+") as file:
        file.attrs[attribute] = value
    with pytest.raises(ReducedModelError) as caught:
        read_reduced_model(path)
    assert words in str(caught.value)


@pytest.mark.parametrize("value", [0.0, -1e-6])
def test_areas_are_above_zero(whole: Path, tmp_path: Path, value: float) -> None:
    path = tmp_path / "rom.h5"
    shutil.copy(whole, path)
    with h5py.File(path, "r+") as file:
        file["contact/area"][0] = value
    with pytest.raises(ReducedModelError, match="contact/area: holds values that are not above 0"):
        read_reduced_model(path)


def test_matrices_of_no_structure_are_named(whole: Path, tmp_path: Path) -> None:
    """Symmetric, but mass that pushes back, or a stiffness that lets go: known once the modes are looked for."""
    indefinite, floating, light = (tmp_path / f"{name}.h5" for name in ("indefinite", "floating", "light"))
    for path, name, value in ((indefinite, "mass", -1.0), (floating, "stiffness", 0.0), (light, "mass", 1e-90)):
        shutil.copy(whole, path)
        with h5py.File(path, "r+") as file:
            size = len(file[name])
            file[name][...] = file[name][()] * value if path == light else 0.0
            file[name][...] += np.diag(np.arange(size) == 3) * value if path != light else 0.0
    for path, words in (
        (indefinite, "mass: not positive"),
        (floating, "stiffness: 4 rigid motions"),
        (light, "mass: too small"),
    ):
        with pytest.raises(ReducedModelError, match=words):
            modal_model(read_reduced_model(path), damping_ratio=0.01)
    with pytest.raises(ReducedModelError, match="mass: not positive definite"):
        natural_frequencies(read_reduced_model(indefinite), 0.0)


@pytest.fixture(autouse=True)
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pipeline.process.isolated_reading, "PATIENCE", 3.0)


def copies(content: bytes, seed: int, number: int) -> list[bytes]:
    """Truncated at many lengths, and with bytes flipped at many places."""
    draw = random.Random(seed)
    cut = [content[: int(len(content) * k / 20)] for k in range(20)]
    flipped = []
    for _ in range(number):
        damaged = bytearray(content)
        for _ in range(draw.choice((1, 2, 8))):
            damaged[draw.randrange(len(damaged))] ^= 1 << draw.randrange(8)
        flipped.append(bytes(damaged))
    return cut + flipped


def test_truncated_and_flipped_models(whole: Path, tmp_path: Path) -> None:
    refused = _refused_of(
        copies(whole.read_bytes(), 1, 20), tmp_path / "rom.h5", read_reduced_model, ReducedModelError
    )
    assert refused >= 20  # cut files at least


def test_truncated_and_flipped_meshes_and_full_models(tmp_path: Path) -> None:
    from rom_meshes import box_sector

    sector = box_sector(divisions=(2, 1, 2))
    save_sector(tmp_path / "sector.h5", sector)
    save_full_model(tmp_path / "full.h5", assemble(sector, Material(2e11, 0.3, 7800.0), "hex8"))
    for name, read, own in (("sector", load_sector, SectorFileError), ("full", load_full_model, FullModelFileError)):
        content = (tmp_path / f"{name}.h5").read_bytes()
        assert _refused_of(copies(content, 2, 10), tmp_path / "damaged.h5", read, own) >= 20


def _refused_of(contents: list[bytes], path: Path, read: Callable[[Path], Any], own: type[Exception]) -> int:
    """How many are refused, each in one line that names the file; whatever else is raised fails the test.

    Read as the program reads them, in a process of their own: the HDF5 library never comes to an end with some.
    """

    def reading() -> None:
        read(path)

    messages = []
    for content in contents:
        path.write_bytes(content)
        try:
            read_apart(path, "a whole file", reading)
        except (own, InputError) as error:
            messages.append(str(error))
    assert all(message.startswith(f"{path}: ") and "\n" not in message for message in messages)
    return len(messages)
