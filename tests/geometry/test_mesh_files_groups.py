"""Gmsh, VTK and MED: groups and fields become sets and surfaces with the areas of the solid they belong to."""

import sys

import meshlane
import numpy as np
import pytest
from mesh_file_support import VOLUMES, area, element_points, shape_of, straight_middles, volumes

from geometry import MeshFileError, read_mesh
from geometry.gmsh_start import start_gmsh

SIZES = (1.0, 2.0, 0.5)
FORMATS = [(2.2, 0), (2.2, 1), (4.0, 0), (4.1, 0), (4.1, 1)]


@pytest.fixture(scope="module")
def box(tmp_path_factory):
    """A box of gmsh in several formats: `left` and `bottom` share an edge; `inside` is the volume."""
    import gmsh

    folder = tmp_path_factory.mktemp("box")
    start_gmsh(gmsh)
    try:
        for order in (1, 2):
            gmsh.clear()
            gmsh.model.occ.addBox(0, 0, 0, *SIZES)
            gmsh.model.occ.synchronize()
            for name, surfaces in (("left", [1]), ("bottom", [3]), ("two", [1, 3])):
                gmsh.model.addPhysicalGroup(2, surfaces, name=name)
            gmsh.model.addPhysicalGroup(3, [1], name="inside")
            gmsh.model.addPhysicalGroup(1, [1], 17)
            gmsh.option.setNumber("Mesh.MeshSizeMax", 0.4)
            gmsh.model.mesh.generate(3)
            gmsh.model.mesh.setOrder(order)
            for version, binary in FORMATS:
                gmsh.option.setNumber("Mesh.MshFileVersion", version)
                gmsh.option.setNumber("Mesh.Binary", binary)
                gmsh.write(str(folder / f"{order}_{version}_{binary}.msh"))
            gmsh.option.setNumber("Mesh.SaveAll", 1)
            gmsh.write(str(folder / f"{order}_all.msh"))
            gmsh.option.setNumber("Mesh.SaveAll", 0)
            gmsh.write(str(folder / f"{order}.med"))
    finally:
        gmsh.finalize()
    return folder


def check(mesh, order):
    assert {block.kind for block in mesh.blocks} == {{1: "tet4", 2: "tet10"}[order]}
    assert sum(volumes(mesh)) == pytest.approx(np.prod(SIZES))
    assert straight_middles(mesh)
    assert area(mesh, "left") == pytest.approx(SIZES[1] * SIZES[2])
    assert area(mesh, "bottom") == pytest.approx(SIZES[0] * SIZES[2])
    assert set(mesh.surfaces["left"].nodes(mesh.blocks)) == set(mesh.node_sets["left"])
    np.testing.assert_array_equal(mesh.points[mesh.node_sets["left"], 0], 0.0)
    assert len(mesh.element_sets["inside"]) == mesh.n_elements


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize(("version", "binary"), FORMATS)
def test_gmsh(box, order, version, binary):
    mesh = read_mesh(box / f"{order}_{version}_{binary}.msh")
    check(mesh, order)
    assert area(mesh, "two") == pytest.approx((SIZES[0] + SIZES[1]) * SIZES[2])
    assert "curve_17" in mesh.node_sets  # a group without a name


@pytest.mark.parametrize("order", [1, 2])
def test_gmsh_with_all_entities_and_med(box, order):
    check(read_mesh(box / f"{order}_all.msh"), order)
    check(read_mesh(box / f"{order}.med"), order)


def test_no_script_is_run(tmp_path):
    """gmsh would take the first for a script, and the file of options beside the second for one."""
    (tmp_path / "script.msh").write_text(f'SystemCall "touch {tmp_path}/run";\n')
    with pytest.raises(MeshFileError, match=r"does not start with \$MeshFormat"):
        read_mesh(tmp_path / "script.msh")
    (tmp_path / "mesh.msh").write_text(
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n4\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n$EndNodes\n"
        "$Elements\n1\n1 4 2 1 1 1 2 3 4\n$EndElements\n"
    )
    (tmp_path / "mesh.msh.opt").write_text(f'SystemCall "touch {tmp_path}/run";\n')
    assert read_mesh(tmp_path / "mesh.msh").n_elements == 1
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize("version", [2.2, 4.1])
def test_an_element_in_two_groups(tmp_path, version):
    """Version 2.2 has it twice."""
    import gmsh

    start_gmsh(gmsh)
    try:
        gmsh.model.occ.addBox(0, 0, 0, *SIZES)
        gmsh.model.occ.synchronize()
        for dimension, name in ((3, "steel"), (3, "blade"), (2, "low"), (2, "left")):
            gmsh.model.addPhysicalGroup(dimension, [1], name=name)
        gmsh.model.mesh.generate(3)
        gmsh.option.setNumber("Mesh.MshFileVersion", version)
        gmsh.write(str(tmp_path / "a.msh"))
    finally:
        gmsh.finalize()
    mesh = read_mesh(tmp_path / "a.msh")
    assert sum(volumes(mesh)) == pytest.approx(np.prod(SIZES))
    assert {name: len(rows) for name, rows in mesh.element_sets.items()} == dict.fromkeys(
        ("steel", "blade"), mesh.n_elements
    )
    assert area(mesh, "low") == pytest.approx(SIZES[1] * SIZES[2])
    assert mesh.notes == ()


def test_orders_that_gmsh_would_mix_up(tmp_path):
    points = "".join(f"{k + 5} {x} {y} {z}\n" for k, (x, y, z) in enumerate(element_points("tet10").tolist()))
    corners = "1 5 0 0\n2 6 0 0\n3 5 1 0\n4 5 0 1\n"
    (tmp_path / "mixed.msh").write_text(
        f"$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n14\n{corners}{points}$EndNodes\n$Elements\n2\n"
        "1 4 2 1 1 1 2 3 4\n2 11 2 1 1 5 6 7 8 9 10 11 12 14 13\n$EndElements\n"
    )
    with pytest.raises(MeshFileError, match="linear and quadratic elements in one entity"):
        read_mesh(tmp_path / "mixed.msh")


def test_a_session_of_gmsh_goes_on(box):
    import gmsh

    start_gmsh(gmsh)
    try:
        gmsh.model.add("mine")
        gmsh.model.occ.addBox(0, 0, 0, 1, 1, 1)
        gmsh.model.occ.synchronize()
        read_mesh(box / "1_4.1_0.msh")
        assert gmsh.model.getCurrent() == "mine"
        assert len(gmsh.model.getEntities(3)) == 1
    finally:
        gmsh.finalize()


def test_fields_of_vtk_become_sets(tmp_path):
    points = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 1), (9, 9, 9)], dtype=float)
    cells = [("triangle", [[0, 1, 2]]), ("tetra", [[0, 1, 2, 3], [1, 2, 3, 4]])]
    mesh = meshlane.Mesh(
        points, cells,
        {"set_root": [0.0, 2.0, 1.0, 0, 0, 0], "part": [0, 1, 1, 7, 0, 0], "heat": np.ones(6)},
        {"set_face": [[1.0], [0.0, 0.0]], "material": [[5], [5, 6]]},
    )  # fmt: skip
    meshlane.vtu.write(str(tmp_path / "a.vtu"), mesh)
    found = read_mesh(tmp_path / "a.vtu")
    assert {name: rows.tolist() for name, rows in found.node_sets.items()} == {
        "root": [2, 1], "part_1": [1, 2], "part_7": [3], "face": [0, 1, 2], "material_5": [0, 1, 2],
    }  # fmt: skip
    assert {name: rows[:, 1].tolist() for name, rows in found.element_sets.items()} == {
        "material_5": [0], "material_6": [1],
    }  # fmt: skip
    assert area(found, "face") == pytest.approx(0.5)
    assert found.notes == ("1 node of no solid element left out",)


@pytest.fixture(scope="module")
def vtk_grid():
    """A grid of VTK, of voxels, with 3000 numbers in its points: several blocks of its compressors; and its cells."""
    from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray
    from vtkmodules.vtkCommonCore import vtkPoints
    from vtkmodules.vtkCommonDataModel import VTK_VOXEL, vtkCellArray, vtkUnstructuredGrid

    x = np.linspace(0.0, 1.0, 10) ** 1.3
    z, y, x = (values.ravel() for values in np.meshgrid(2 * x, x, x, indexing="ij"))
    first = np.arange(1000).reshape(10, 10, 10)[:9, :9, :9].ravel()
    cells = first[:, None] + [0, 1, 10, 11, 100, 101, 110, 111]
    grid, points, array = vtkUnstructuredGrid(), vtkPoints(), vtkCellArray()
    points.SetData(numpy_to_vtk(np.column_stack([x, y, z]), deep=True))
    ends = np.arange(0, cells.size + 1, 8)
    array.SetData(numpy_to_vtkIdTypeArray(ends, deep=True), numpy_to_vtkIdTypeArray(cells.ravel(), deep=True))
    grid.SetPoints(points)
    grid.SetCells(VTK_VOXEL, array)
    for data, name, values in (
        (grid.GetPointData(), "set_low", (z == 0.0).astype(np.int32)),
        (grid.GetCellData(), "part", np.arange(len(cells)) % 2),
    ):
        field = numpy_to_vtk(values, deep=True)
        field.SetName(name)
        data.AddArray(field)
    return grid, np.column_stack([x, y, z]), cells[:, [0, 1, 3, 2, 4, 5, 7, 6]]


@pytest.mark.parametrize(
    ("mode", "compressor"),
    [
        ("Ascii", "None"),
        *((mode, name) for mode in ("Binary", "Appended", "Encoded") for name in ("None", "ZLib", "LZ4")),
        ("Encoded", "LZMA"),  # written slowly
    ],
)
def test_files_that_vtk_writes(tmp_path, vtk_grid, mode, compressor):
    """Against the grid that was written; sizes of headers and byte orders go round with the others."""
    from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridWriter

    grid, points, cells = vtk_grid
    writer = vtkXMLUnstructuredGridWriter()
    writer.SetFileName(str(tmp_path / "a.vtu"))
    writer.SetInputData(grid)
    getattr(writer, f"SetDataModeTo{mode.replace('Encoded', 'Appended')}")()
    writer.SetEncodeAppendedData(mode == "Encoded")
    getattr(writer, f"SetCompressorTypeTo{compressor}")()
    wide = compressor in ("ZLib", "LZMA")
    getattr(writer, "SetHeaderTypeToUInt64" if wide else "SetHeaderTypeToUInt32")()
    getattr(writer, "SetByteOrderToBigEndian" if mode == "Binary" else "SetByteOrderToLittleEndian")()
    writer.SetBlockSize(4096)  # bytes
    assert writer.Write() == 1
    mesh = read_mesh(tmp_path / "a.vtu")
    np.testing.assert_allclose(mesh.points, points, rtol=1e-6 if mode == "Ascii" else 0)
    np.testing.assert_array_equal(mesh.blocks[0].nodes, cells)
    assert sum(volumes(mesh)) == pytest.approx(2.0)
    assert len(mesh.node_sets["low"]) == 100
    assert {name: len(rows) for name, rows in mesh.element_sets.items()} == {"part_0": 365, "part_1": 364}


@pytest.mark.parametrize(("code", "kind", "extra"), [(71, "tet10", 0), (72, "hex20", 7), (73, "wedge15", 3)])
@pytest.mark.parametrize("version", ["2.3", "1.0"])
def test_lagrange_cells(tmp_path, code, kind, extra, version):
    """Of order 2; before version 2.1 two edges of a hexahedron were exchanged, as VTK still reads them."""
    points = element_points(kind)
    order = np.arange(len(points) + extra)
    if code == 72 and version == "1.0":
        order[[18, 19]] = order[[19, 18]]
    points = np.vstack([points, points[:extra] + 0.1])[order]
    write_lagrange(tmp_path / "a.vtu", code, points, version)
    mesh = read_mesh(tmp_path / "a.vtu")
    assert [block.kind for block in mesh.blocks] == [kind]
    assert straight_middles(mesh)


def write_lagrange(path, code, points, version="2.3"):
    numbers = " ".join(f"{x!r}" for x in points.ravel().tolist())
    arrays = {"connectivity": " ".join(map(str, range(len(points)))), "offsets": len(points), "types": code}
    cells = "".join(
        f'<DataArray type="Int64" Name="{name}" format="ascii">{text}</DataArray>' for name, text in arrays.items()
    )
    path.write_text(
        f'<VTKFile type="UnstructuredGrid" version="{version}"><UnstructuredGrid>'
        f'<Piece NumberOfPoints="{len(points)}" NumberOfCells="1"><Points>'
        f'<DataArray type="Float64" NumberOfComponents="3" format="ascii">{numbers}</DataArray></Points>'
        f"<Cells>{cells}</Cells></Piece></UnstructuredGrid></VTKFile>"
    )


@pytest.mark.parametrize(
    ("code", "count", "found"),
    [
        (72, 64, "cell 1 is a Lagrange hexahedron of 64 nodes: must be .* of order 1 or 2; write the file with such"),
        (79, 27, "cell 1 is a Bezier hexahedron of 27 nodes"),
        (42, 8, "cell 1 is a polyhedron"),
        (74, 14, "cell 1 is a pyramid"),
    ],
)
def test_cells_that_are_refused(tmp_path, code, count, found):
    write_lagrange(tmp_path / "a.vtu", code, np.random.default_rng(1).random((count, 3)))
    with pytest.raises(MeshFileError, match=found):
        read_mesh(tmp_path / "a.vtu")


@pytest.mark.parametrize(
    ("old", "new", "found"),
    [
        ("<VTKFile", "<!DOCTYPE a><VTKFile", "declares a document type"),
        ('version="2.3"', 'version="2.3" compressor="vtkZstd"', "is compressed by vtkZstd: must be uncompressed"),
        ('type="UnstructuredGrid"', 'type="PolyData"', "holds PolyData: an UnstructuredGrid of VTK is needed"),
        ('NumberOfPoints="10"', 'NumberOfPoints="1000000000000"', "damaged, says 1000000000000 points"),
        (">10<", ">11<", "damaged, the offsets of its cells"),
        (">0 1 2", ">0 1 99", "damaged, cells name points beyond 0 to 9"),
        ('format="ascii">0', 'format="binary">AAAA', "damaged"),
    ],
)  # fmt: skip
def test_damaged_grids(tmp_path, old, new, found):
    write_lagrange(tmp_path / "a.vtu", 71, element_points("tet10"))
    text = (tmp_path / "a.vtu").read_text()
    assert old in text
    (tmp_path / "a.vtu").write_text(text.replace(old, new, 1))
    with pytest.raises(MeshFileError, match=found):
        read_mesh(tmp_path / "a.vtu")


@pytest.mark.parametrize("cell", ["tetra", "wedge", "hexahedron", "tetra10", "wedge15", "hexahedron20"])
def test_vtk_cells_of_either_orientation(tmp_path, cell):
    """Programs differ in which triangle of a wedge comes first."""
    from geometry.mesh_files.file_mesh import KINDS

    kind = KINDS[cell]
    points = element_points(kind)
    mirrored = points * [1, 1, -1]
    for places in (points, mirrored):
        meshlane.vtu.write(str(tmp_path / "a.vtu"), meshlane.Mesh(places, [(cell, [list(range(len(points)))])]))
        mesh = read_mesh(tmp_path / "a.vtu")
        determinant = 1 + 0.3 * 0.1 * 0.2
        assert volumes(mesh) == pytest.approx([VOLUMES[shape_of(kind)] * determinant])
        assert straight_middles(mesh)


def test_groups_of_med_written_by_meshlane(tmp_path):
    points = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 1)], dtype=float)
    mesh = meshlane.Mesh(
        points, [("tetra", [[0, 1, 2, 3], [1, 2, 3, 4]])],
        point_sets={"root": np.array([0, 2])}, cell_sets={"upper": [np.array([1])]},
    )  # fmt: skip
    meshlane.med.write(str(tmp_path / "a.med"), mesh)
    found = read_mesh(tmp_path / "a.med")
    assert found.node_sets["root"].tolist() == [0, 2]
    assert found.element_sets["upper"].tolist() == [[0, 1]]
    assert sum(volumes(found)) == pytest.approx(1 / 6 + 1 / 3)


def test_an_optional_library_that_is_missing(tmp_path, monkeypatch):
    from geometry.mesh_files import med

    (tmp_path / "a.med").write_text("HDF")
    monkeypatch.setattr(med, "find_spec", lambda name: None)
    with pytest.raises(MeshFileError, match=r"needs the package meshlane: pip install 'shroud\[meshes\]'"):
        read_mesh(tmp_path / "a.med")


def test_grids_without_meshlane(tmp_path, monkeypatch):
    """A grid that it has written is read where it cannot be imported, by itself or by a part of it."""
    points = element_points("tet10")
    meshlane.vtu.write(str(tmp_path / "a.vtu"), meshlane.Mesh(points, [("tetra10", [list(range(10))])]))
    for name in [name for name in sys.modules if name.partition(".")[0] in ("meshlane", "meshio")]:
        monkeypatch.setitem(sys.modules, name, None)
    assert read_mesh(tmp_path / "a.vtu").blocks[0].kind == "tet10"


def test_periodic_surfaces_of_gmsh_are_cut_faces(tmp_path):
    """Those that a rotation turns into each other, but for faces named as contact; translations are none."""
    import gmsh

    start_gmsh(gmsh)
    try:
        occ, mesher = gmsh.model.occ, gmsh.model.mesh
        occ.extrude([(2, occ.addRectangle(1, 0, 0, 2, 1))], 0, 0, 1)
        occ.revolve([(2, occ.addRectangle(5, 0, 0, 2, 1))], 0, 0, 0, 0, 1, 0, 0.5)
        occ.synchronize()
        faces = {tag: occ.getCenterOfMass(2, tag) for _, tag in gmsh.model.getEntities(2)}
        first = next(tag for tag, at in faces.items() if at[0] > 4.9 and abs(at[2]) < 1e-6)
        last = next(tag for tag, at in faces.items() if abs(at[2] / at[0] + np.tan(0.5)) < 1e-6)
        low, high = (next(tag for tag, at in faces.items() if at[0] < 4 and abs(at[2] - z) < 1e-6) for z in (0, 1))
        c, s = np.cos(0.5), np.sin(0.5)
        mesher.setPeriodic(2, [last], [first], [c, 0, s, 0, 0, 1, 0, 0, -s, 0, c, 0, 0, 0, 0, 1])
        mesher.setPeriodic(2, [high], [low], [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 1, 0, 0, 0, 1])
        gmsh.model.addPhysicalGroup(3, [1, 2], name="all")
        mesher.generate(3)
        gmsh.write(str(tmp_path / "a.msh"))
        gmsh.model.addPhysicalGroup(2, [first], name="shroud a")
        gmsh.model.addPhysicalGroup(2, [last], name="shroud b")
        gmsh.write(str(tmp_path / "b.msh"))
    finally:
        gmsh.finalize()
    mesh = read_mesh(tmp_path / "a.msh")
    assert set(mesh.node_sets) == {"cyclic_right", "cyclic_left"}
    angles = [np.arctan2(-mesh.points[rows, 2], mesh.points[rows, 0]) for rows in mesh.node_sets.values()]
    assert sorted(map(np.mean, angles)) == pytest.approx([0.0, 0.5])
    assert max(map(np.ptp, angles)) < 1e-6
    assert set(read_mesh(tmp_path / "b.msh").node_sets) == {"shroud a", "shroud b"}
