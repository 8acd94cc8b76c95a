"""A sector written to a file and read back is the same sector, and a file that is none is refused."""

import signal
from dataclasses import replace

import h5py
import numpy as np
import pytest
from geometry_support import FIGURE, SLENDER, figure_shroud, sector, slender_shroud, volume

from geometry.errors import SectorFileError
from geometry.exchange import export_sector, import_sector
from rom.files.hdf5 import new_hdf5
from rom.files.sector_file import load_sector, save_sector

WRITE_READ = {
    ".h5": (save_sector, load_sector),
    ".msh": (export_sector, import_sector),
    ".vtu": (export_sector, import_sector),
}


def assert_identical(one, other):
    assert one.n_blades == other.n_blades
    assert one.node_sets.keys() == other.node_sets.keys()
    pairs = [(one.points, other.points), (one.hexahedra, other.hexahedra)]
    pairs += [(nodes, other.node_sets[name]) for name, nodes in one.node_sets.items()]
    for a, b in ((one.right, other.right), (one.left, other.left)):
        pairs += [(getattr(a, field), getattr(b, field)) for field in ("nodes", "position", "frame", "area")]
    for a, b in pairs:
        assert a.dtype == b.dtype
        np.testing.assert_array_equal(a, b)


@pytest.mark.parametrize("suffix", WRITE_READ)
@pytest.mark.parametrize("case", ["slender", "figure", "one"])
def test_round_trip_is_exact(tmp_path, suffix, case):
    mesh = {
        "slender": lambda: sector(SLENDER, slender_shroud(120.0, gap=1e-4), 0.005, (5, 2)),
        "figure": lambda: sector(FIGURE, figure_shroud(70.0)),
        "one": lambda: sector(replace(SLENDER, section="lens"), slender_shroud(180.0), 0.008, (1, 1)),
    }[case]()
    write, read = WRITE_READ[suffix]
    path = tmp_path / f"sector{suffix}"
    write(path, mesh)
    assert_identical(mesh, read(path))
    write(str(path), read(str(path)))  # again over itself, with a string as path
    assert_identical(mesh, read(path))


@pytest.mark.parametrize("suffix", WRITE_READ)
def test_files_are_the_same_bytes_each_time(tmp_path, suffix):
    mesh = sector(FIGURE, figure_shroud(70.0))
    write, _ = WRITE_READ[suffix]
    for name in ("a", "b"):
        write(tmp_path / f"{name}{suffix}", mesh)
    assert (tmp_path / f"a{suffix}").read_bytes() == (tmp_path / f"b{suffix}").read_bytes()


def test_gmsh_reads_the_msh_file(tmp_path):
    import gmsh

    from geometry.gmsh_start import start_gmsh

    mesh = sector(SLENDER, slender_shroud(70.0))
    export_sector(tmp_path / "sector.msh", mesh)
    start_gmsh(gmsh)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.open(str(tmp_path / "sector.msh"))
        types, tags, _ = gmsh.model.mesh.getElements(3)
        assert list(types) == [5]  # 8-node hexahedra
        assert len(tags[0]) == len(mesh.hexahedra)
        # gmsh's own measures, independent of ours
        assert min(gmsh.model.mesh.getElementQualities(tags[0], "minDetJac")) > 0
        assert sum(gmsh.model.mesh.getElementQualities(tags[0], "volume")) == pytest.approx(volume(mesh), rel=1e-9)
    finally:
        gmsh.finalize()


def test_vtk_reads_the_vtu_file(tmp_path):
    pyvista = pytest.importorskip("pyvista")
    mesh = sector(SLENDER, slender_shroud(70.0))
    export_sector(tmp_path / "sector.vtu", mesh)
    grid = pyvista.read(tmp_path / "sector.vtu")
    assert grid.n_cells == len(mesh.hexahedra)
    assert grid.volume == pytest.approx(volume(mesh), rel=5e-3)  # VTK splits hexahedra into tetrahedra
    np.testing.assert_array_equal(grid.point_data["right_n"][mesh.right.nodes], mesh.right.frame[:, 2])


@pytest.mark.parametrize("content", ["missing", "empty", "text", "truncated", "other"])
@pytest.mark.parametrize("suffix", WRITE_READ)
def test_what_is_no_sector_is_refused(tmp_path, suffix, content):
    write, read = WRITE_READ[suffix]
    path = tmp_path / f"bad{suffix}"
    if content == "empty":
        path.write_bytes(b"")
    elif content == "text":
        path.write_text("hello\n" * 10)
    elif content == "truncated":
        write(path, sector(FIGURE, figure_shroud(70.0)))
        path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    elif content == "other":
        _write_something_else(path)
    with pytest.raises(SectorFileError) as caught:
        read(path)
    message = str(caught.value)
    assert str(path) in message
    assert "\n" not in message


def _write_something_else(path):
    """A valid file of its kind that holds no sector."""
    if path.suffix == ".h5":
        import h5py

        with h5py.File(path, "w") as file:
            file.attrs["format"] = "1"
            file["points"] = np.zeros((3, 3))
    else:
        import meshio

        cube = np.array(
            [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)], float
        )
        meshio.write(path, meshio.Mesh(cube, [("hexahedron", [range(8)])]))


@pytest.mark.parametrize("fault", ["node beyond", "wrong shape", "not finite", "integers for reals"])
def test_inconsistent_arrays_are_refused(tmp_path, fault):
    import h5py

    path = tmp_path / "sector.h5"
    save_sector(path, sector(FIGURE, figure_shroud(70.0)))
    with h5py.File(path, "r+") as file:
        if fault == "node beyond":
            file["node_sets/root"][0] = 10**9
        elif fault == "wrong shape":
            del file["right/area"]
            file["right/area"] = np.ones(4)
        elif fault == "not finite":
            file["points"][3, 1] = np.nan
        else:
            del file["points"]
            file["points"] = np.zeros((10, 3), dtype=int)
    with pytest.raises(SectorFileError, match=r"sector\.h5"):
        load_sector(path)


def test_unknown_suffix_is_refused(tmp_path):
    mesh = sector(FIGURE, figure_shroud(70.0))
    with pytest.raises(SectorFileError, match=r"\.msh, \.vtu"):
        export_sector(tmp_path / "sector.stl", mesh)
    with pytest.raises(SectorFileError, match=r"\.msh, \.vtu"):
        import_sector(tmp_path / "sector")
    assert list(tmp_path.iterdir()) == []


def test_a_signal_waits_until_an_hdf5_file_is_whole(tmp_path):
    """HDF5 calls Python back for every write: an exception there would be lost, or tear the file."""

    def stop(number, frame):
        raise InterruptedError(number)

    def write():
        with new_hdf5(tmp_path / "x.h5") as file:
            file["a"] = np.arange(10)
            signal.raise_signal(signal.SIGTERM)
            file["b"] = np.arange(20)

    before = signal.signal(signal.SIGTERM, stop)
    try:
        with pytest.raises(InterruptedError):
            write()
        assert signal.getsignal(signal.SIGTERM) is stop
    finally:
        signal.signal(signal.SIGTERM, before)
    with h5py.File(tmp_path / "x.h5", "r") as file:
        assert [len(file[name]) for name in ("a", "b")] == [10, 20]
