"""Mesh files that crash, hang or eat memory end the process that reads them, not the program."""

import ctypes
import os
import zlib
from base64 import b64encode
from pathlib import Path

import numpy as np
import pytest

import geometry
from pipeline.errors import InputError
from pipeline.stages.own_mesh import read_mesh_file

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

    monkeypatch.setattr(geometry, "read_mesh", crash)
    one_line(path, r"the reader of mesh files crashes on it \(SIGSEGV\)")


@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="Linux tells how much memory a process has")
def test_a_small_file_of_much_memory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Compressed numbers of a VTK file: a few megabytes of zeros compress to nothing."""
    monkeypatch.setattr("pipeline.stages.own_mesh.MEMORY", 2**27)
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
