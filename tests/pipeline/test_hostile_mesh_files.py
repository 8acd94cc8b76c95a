"""Files from elsewhere that crash, hang, eat memory or lead elsewhere end the process that reads them at most."""

import ctypes
import os
import zlib
from base64 import b64encode
from pathlib import Path

import h5py
import numpy as np
import pytest
from mesh_file_scenes import scene_with_mesh
from pipeline_support import shroud, write_ground_model, write_scene
from scipy.io import savemat

import pipeline.process.isolated_reading
from pipeline.errors import InputError
from pipeline.process.isolated_reading import read_apart, read_given_model
from pipeline.scene.input_files import file_parts
from pipeline.stages.model.build_mesh import read_mesh_file
from rom import MatrixFileError, read_matrix

TET = "*NODE\n1, 0., 0., 0.\n2, 1., 0., 0.\n3, 0., 1., 0.\n4, 0., 0., 1.\n*ELEMENT, TYPE=C3D4\n1, 1, 2, 3, 4\n"


def one_line(path: Path, found: str) -> None:
    with pytest.raises(InputError, match=found) as caught:
        read_mesh_file(str(path))
    assert "\n" not in str(caught.value)
    assert str(path) in str(caught.value)


def test_a_mesh_comes_through(tmp_path: Path) -> None:
    path = tmp_path / "blade.inp"
    path.write_text(TET + "*NSET, NSET=root\n1, 2, 3\n")
    mesh = read_mesh_file(str(path))
    assert mesh.n_elements == 1
    assert mesh.node_sets["root"].tolist() == [0, 1, 2]


def test_what_is_wrong_comes_through(tmp_path: Path) -> None:
    path = tmp_path / "blade.inp"
    path.write_text(TET.replace("3, 4", "3, 9"))
    one_line(path, "names node 9, which is not defined")


def test_a_reader_that_crashes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path, home = tmp_path / "blade.inp", os.getpid()
    path.write_text(TET)

    def crash(path: str) -> None:
        if os.getpid() != home:
            ctypes.string_at(0)

    monkeypatch.setattr("geometry.mesh_files.read.read_mesh", crash)
    one_line(path, r"the reader of mesh files crashes on it \(SIGSEGV\)")


@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="Linux tells how much memory a process has")
def test_a_small_file_of_much_memory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Compressed numbers of a VTK file: a few megabytes of zeros compress to nothing."""
    monkeypatch.setattr("pipeline.stages.model.build_mesh.MEMORY", 2**27)
    block = zlib.compress(bytes(2**23))
    blocks = 24
    header = np.array([blocks, 2**23, 0, *[len(block)] * blocks], dtype="<u4").tobytes()
    data = (b64encode(header) + b64encode(block * blocks)).decode()
    path = tmp_path / "bomb.vtu"
    path.write_text(
        '<VTKFile type="UnstructuredGrid" version="0.1" byte_order="LittleEndian" header_type="UInt32" '
        'compressor="vtkZLibDataCompressor"><UnstructuredGrid>'
        f'<Piece NumberOfPoints="{blocks * 2**23 // 24}" NumberOfCells="0"><Points>'
        f'<DataArray type="Float64" NumberOfComponents="3" format="binary">{data}</DataArray>'
        "</Points></Piece></UnstructuredGrid></VTKFile>"
    )
    one_line(path, "too large for the memory of this process|cannot be read")


@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="Linux tells how much memory a process has")
@pytest.mark.parametrize("name", ["K.mat", "model.h5"])
def test_compressed_numbers_of_much_memory(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """40 kB that unfold to 40 MB end at the limit; more is allowed by an environment variable."""
    monkeypatch.setattr(pipeline.process.isolated_reading, "MEMORY", 2**23)
    path, zeros = tmp_path / name, np.zeros((2200, 2200))
    if name == "K.mat":
        savemat(path, {"K": zeros}, do_compression=True)
    else:
        with h5py.File(write_ground_model(path), "r+") as file:
            del file["mass"]
            file.create_dataset("mass", data=zeros, compression="gzip", chunks=(220, 2200))

    def read() -> object:
        return read_apart(path, "a matrix", lambda: read_matrix(path)) if name == "K.mat" else read_given_model(path)

    with pytest.raises(InputError) as caught:
        read()
    assert f"{path}: cannot be read: the HDF5 library takes more than 0.01" in str(caught.value)
    assert str(caught.value).endswith("; SHROUD_READING_LIMITS=4 in the environment allows it more time and memory")
    monkeypatch.setenv("SHROUD_READING_LIMITS", "100")
    with pytest.raises((InputError, MatrixFileError), match=r"a matrix without entries|shape"):  # it has been read
        read()
    monkeypatch.setenv("SHROUD_READING_LIMITS", "much")
    with pytest.raises(InputError, match='SHROUD_READING_LIMITS: "much", allowed: a number above 0'):
        read()


@pytest.mark.parametrize("way", ["link", "virtual", "raw"])
def test_a_med_file_leads_nowhere_else(way: str, tmp_path: Path) -> None:
    """Neither by a link nor by a dataset whose numbers stand in another file."""
    meshlane = pytest.importorskip("meshlane")
    path, other = tmp_path / "blade.med", tmp_path / "other.h5"
    points = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    meshlane.Mesh(points, [("tetra", np.array([[0, 1, 2, 3]]))]).write(path)
    assert read_mesh_file(str(path)).n_elements == 1
    with h5py.File(other, "w") as file:
        file["COO"] = points.T.ravel()
    (tmp_path / "raw").write_bytes(points.T.tobytes())
    with h5py.File(path, "r+") as file:
        (step,) = file["ENS_MAA/mesh"].values()
        nodes, attributes = step["NOE"], dict(step["NOE/COO"].attrs)
        del nodes["COO"]
        if way == "link":
            nodes["COO"] = h5py.ExternalLink(str(other), "/COO")
        elif way == "virtual":
            layout = h5py.VirtualLayout(shape=(12,), dtype="f8")
            layout[:] = h5py.VirtualSource(str(other), "COO", shape=(12,))
            nodes.create_virtual_dataset("COO", layout).attrs.update(attributes)
        else:
            raw = [(str(tmp_path / "raw"), 0, h5py.h5f.UNLIMITED)]
            nodes.create_dataset("COO", (12,), "f8", external=raw).attrs.update(attributes)
    one_line(path, "a link into another file" if way == "link" else "its data are in other files")


@pytest.mark.parametrize("head", [" $MeshFormat", "\ufeff$MeshFormat", "\n$MeshFormat", "$MeshFormats"])
def test_a_script_of_gmsh_is_not_run(head: str, tmp_path: Path) -> None:
    """Whatever gmsh does not take for a mesh at its first byte it runs."""
    path, ran = tmp_path / "blade.msh", tmp_path / "ran"
    path.write_text(f'{head}\n2.2 0 8\n$EndMeshFormat\nSystemCall "touch {ran}";\n')
    (tmp_path / "blade.msh.opt").write_text(f'SystemCall "touch {ran}";\n')
    one_line(path, "does not start with")
    assert not ran.exists()


@pytest.mark.parametrize("target", ["/dev/zero", "/proc/kmsg", "pipe", "link"])
def test_an_included_device_is_not_opened(target: str, tmp_path: Path) -> None:
    """A device, a pipe, a link to a device, and what Linux calls a file but never ends."""
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "link").symlink_to("/dev/zero")
    (tmp_path / "blade.inp").write_text(f"*INCLUDE, INPUT={target}\n{TET}")
    status, _, error = shroud("validate", write_scene(tmp_path / "s.toml", scene_with_mesh("blade.inp")))
    assert (status, error.count("\n")) == (2, 1)
    assert f"includes {target if target.startswith('/') else tmp_path / target}: " in error
    (tmp_path / "blade.inp").unlink()
    (tmp_path / "blade.inp").symlink_to("/dev/zero")
    status, _, error = shroud("validate", tmp_path / "s.toml")
    assert (status, error.count("\n")) == (2, 1)
    assert 'blade.inp": not a file' in error


def test_blanks_in_a_keyword_line_end_the_search_for_included_files(tmp_path: Path) -> None:
    """250 blanks took 20 s, 500 sixteen times as long: in this process, when the scene is read."""
    path = tmp_path / "blade.inp"
    path.write_text(f'*INCLUDE,{" " * 50_000}"\n*INCLUDE, INPUT={" " * 50_000}nodes.inc\n')
    assert [part.name for part in file_parts(str(path))] == ["blade.inp", "nodes.inc"]


@pytest.mark.parametrize("suffix", ["vtu", "msh", "h5"])
def test_a_pipe_or_a_device_given_on_the_command_line_is_not_opened(suffix: str, tmp_path: Path) -> None:
    rom, pipe, link = write_ground_model(tmp_path / "rom.h5"), tmp_path / f"pipe.{suffix}", tmp_path / f"a.{suffix}"
    os.mkfifo(pipe)
    link.symlink_to("/dev/zero")
    for path in (pipe, link):
        for command in (
            ("export", rom, "--to", tmp_path / "x.vtu", "--mesh", path),
            ("info", path),
            ("new", tmp_path / "n", "--mesh", path),
        ):
            status, _, error = shroud(*command)
            assert (status, error.count("\n")) == (2, 1)
            assert str(path) in error
