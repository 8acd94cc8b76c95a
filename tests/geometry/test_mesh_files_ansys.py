"""Ansys archives: the examples of mapdl-archive against the cells that its own bridge to VTK makes of them."""

from contextlib import nullcontext
from pathlib import Path

import numpy as np
import pytest
from mesh_file_support import volumes

from geometry import MeshFileError, read_mesh

EXAMPLES = Path(pytest.importorskip("mapdl_archive").__file__).parent / "examples"
HEAD = "/PREP7\nET,1,186\nET,2,187\nET,3,185\nET,4,154\n"


@pytest.mark.parametrize("name", ["HexBeam", "TetBeam", "academic_rotor", "sector"])
def test_volumes_are_those_of_vtk(name):
    from mapdl_archive import Archive

    path = EXAMPLES / f"{name}.cdb"
    warped = 0.02 if name == "sector" else 1e-6  # its faces are not plane: the volume depends on their triangles
    mesh = read_mesh(path)
    grid = Archive(str(path), allowable_types=[45, 95, 185, 186, 92, 187]).grid
    assert mesh.n_elements == grid.n_cells
    assert sum(volumes(mesh)) == pytest.approx(grid.compute_cell_sizes().cell_data["Volume"].sum(), rel=warped)
    # cell by cell: what is a wedge there is one here
    kinds = {"tet4": 10, "tet10": 24, "wedge6": 13, "wedge15": 26, "hex8": 12, "hex20": 25}
    linear = {24: 10, 26: 13, 25: 12} if name == "TetBeam" else {}
    expected = {
        int(kind): int(count) for kind, count in zip(*np.unique(grid.celltypes, return_counts=True), strict=True)
    }
    assert {kinds[block.kind]: len(block) for block in mesh.blocks} == {
        linear.get(kind, kind): count for kind, count in expected.items()
    }


def test_components_and_material():
    mesh = read_mesh(EXAMPLES / "HexBeam.cdb")
    assert {name: len(rows) for name, rows in mesh.node_sets.items()} == {"NODE_SELECTION": 164, "NCOMP2": 98}
    assert {name: len(rows) for name, rows in mesh.element_sets.items()} == {"ECOMP1": 22, "ECOMP2": 22}
    assert mesh.materials == {"1": {"young_modulus": 7e10, "poisson_ratio": 0.35, "density": 2700.0}}


def archive(rows, nodes, materials="", node_format="(3i9,6e21.13e3)"):
    """An archive with the given elements: (label, type, nodes), and points."""
    solid, widths = ("3", "") if "1i9" in node_format else ("6", "SOLID"), (9, 9, 9)
    if "i7" in node_format:
        widths = (7, 9, 9)
    text = HEAD + f"NBLOCK,{solid[0]},{solid[1]},{len(nodes):9d},{len(nodes):9d}\n{node_format}\n"
    for k, point in enumerate(nodes, 1):
        head = (
            f"{k:9d}"
            if "1i9" in node_format
            else "".join(f"{x:{w}d}" for x, w in zip((k, 0, 0), widths, strict=True))
        )
        text += head + "".join(f"{x:21.13E}" for x in point) + "\n"
    text += f"N,R5.3,LOC,       -1,\nEBLOCK,19,SOLID,{len(rows):9d},{len(rows):9d}\n(19i9)\n"
    for label, kind, members in rows:
        head = [1, kind, 1, 1, 0, 0, 0, 0, len(members), 0, label, *members]
        text += "".join(f"{x:9d}" for x in head[:19]) + "\n"
        text += "".join(f"{x:9d}" for x in head[19:]) + ("\n" if len(head) > 19 else "")
    return text + f"{-1:9d}\n" + materials


PRISM = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 2), (1, 0, 2), (0, 1, 2)], dtype=float)


def test_prism_form_without_collapsed_mid_side_nodes(tmp_path):
    """SOLID186 with 0 for the mid-side nodes of the edges that are collapsed, and its prism form of the manual."""
    ends = [(0, 1), (1, 2), (2, 0), (3, 4), (4, 5), (5, 3), (0, 3), (1, 4), (2, 5)]
    points = [*PRISM, *((PRISM[a] + PRISM[b]) / 2 for a, b in ends)]
    manual = [1, 2, 3, 3, 4, 5, 6, 6, 7, 8, 3, 9, 10, 11, 6, 12, 13, 14, 15, 15]
    zeros = [*manual[:10], 0, *manual[11:14], 0, *manual[15:]]
    for members in (manual, zeros):
        (tmp_path / "prism.cdb").write_text(archive([(4, 1, members)], points))
        mesh = read_mesh(tmp_path / "prism.cdb")
        assert [block.kind for block in mesh.blocks] == ["wedge15"]
        assert volumes(mesh) == pytest.approx([1.0])


def test_elements_that_are_no_solids_and_materials_that_are_not_isotropic(tmp_path):
    materials = "MP,EX,1,2.1E11\nMP,NUXY,1,0.3\nMPDATA,R5.0, 1,DENS,  1, 1, 7800.\nMP,EX,2,1E9\nMP,EY,2,2E9\n"
    rows = [(1, 3, [1, 2, 3, 3, 4, 5, 6, 6]), (2, 4, [1, 2, 3, 3])]
    component = "CMBLOCK,LID     ,ELEM,       1  ! users element component definition\n(8i10)\n         2\n"
    (tmp_path / "a.cdb").write_text(archive(rows, PRISM, materials + component))
    mesh = read_mesh(tmp_path / "a.cdb")
    assert len(mesh.surfaces["LID"]) == 1
    assert [block.kind for block in mesh.blocks] == ["wedge6"]
    assert mesh.materials["1"] == {"young_modulus": 2.1e11, "poisson_ratio": 0.3, "density": 7800.0}
    assert mesh.materials["2"] == {"young_modulus": 1e9, "young_modulus_2": 2e9, "poisson_ratio": 0.3}
    assert any("1 elements of type 154 left out" in note for note in mesh.notes)


@pytest.mark.parametrize(
    "node_format", ["(1i7,2i9,6e21.13)", "(3i9,6e21.13e3)", "(1i9,3e21.13e3)", "(3i9,3f21.13,3e21.13)"]
)
def test_formats_of_nodes(tmp_path, node_format):
    """Those of Workbench 19.3, of CDWRITE, of decks of Workbench without the key SOLID, and another of Fortran."""
    (tmp_path / "a.cdb").write_text(archive([(4, 3, [1, 2, 3, 3, 4, 5, 6, 6])], PRISM, node_format=node_format))
    mesh = read_mesh(tmp_path / "a.cdb")
    np.testing.assert_array_equal(mesh.points, PRISM)
    assert volumes(mesh) == pytest.approx([1.0])


ROW = "".join(f"{x:9d}" for x in (1, 1, 1, 1, 0, 0, 0, 0, 8, 0, 7, 1, 2, 3, 3, 4, 5, 6, 6))
WORKBENCH = f"""\
/com,***********  Elements for Body 1
et,1,SOLID185
*set,tid,2
EBLOCK,19,SOLID,,1
(19i9)
{ROW}
       -1
et,tid,154
et,3,170
type,3
eblock,10,,,2
(15i9)
       11        3        1        1        0        1        2        3
       12        3        1        1        0        1        2        3
       -1
CE,R5.0,DEFI,       1,       2,  0.00000000
CE,R5.0,1,UX  ,       2,UX  ,       1.0
RBE3,4,ALL,ALL
ETBLOCK,        1,        1
(2i9,19a9)
        9       21        0        0
       -1
EBLOCK,19,SOLID,       10,         2
(19i9)
        1        9        1        1        0        0        0        0        1        0        9        1
        1       99        1        1        0        0        0        0        2        0       10        1        2
       -1
D,       1,UX  ,  0.00000000    ,  0.00000000
EN,R5.5,ATTR,       -1
MP,EX,1,2.1e11
"""


@pytest.mark.parametrize("suffix", [".cdb", ".dat", ".inp"])
def test_a_deck_of_workbench_and_what_it_leaves_out(tmp_path, suffix):
    nodes = archive([], PRISM).split("EBLOCK")[0].replace(HEAD, "/PREP7\n")
    (tmp_path / f"ds{suffix}").write_text(nodes + WORKBENCH)
    mesh = read_mesh(tmp_path / f"ds{suffix}")
    assert [(block.kind, len(block)) for block in mesh.blocks] == [("wedge6", 1)]
    assert set(mesh.warnings) == {
        "1 CE, 1 RBE3 left out: nodes that they tie move freely here: the structure is softer than that of the file",
        "1 elements of type 21 left out: their mass is missing here: frequencies come out too high",
        "1 elements of type unknown left out: no solid elements that are read: "
        "their stiffness and mass are missing here",
    }
    assert {
        "2 elements of type 170 left out: contact of the file: the scene says what touches, "
        "and bonded parts are apart here",
        "1 D left out: supports of the file: the scene says what is held",
    } <= set(mesh.notes)


@pytest.mark.parametrize("suffix", [".cdb", ".dat", ".inp"])
def test_a_deck_of_commands_is_named_as_such(tmp_path, suffix):
    (tmp_path / f"a{suffix}").write_text("/PREP7\nET,1,186\n*DO,I,1,5\nN,I,I*0.1\n*ENDDO\nE,1,2,3,4\n")
    with pytest.raises(
        MeshFileError, match=r"holds 0 NBLOCK tables.* a deck of commands \(APDL\) must be run in Ansys"
    ):
        read_mesh(tmp_path / f"a{suffix}")


def test_materials_of_an_archive_as_ansys_takes_them(tmp_path):
    materials = (
        "/UNITS,MPA\nMP,EX,1,2.1E5\nMP,DENS,1,7.8E-9\n"  # neither PRXY nor NUXY: 0.3
        "MPTEMP,R5.0, 1, 1,  20.0\nMPTEMP,R5.0, 1, 2,  600.0\nMPDATA,R5.0, 1,EX  ,     2, 1,  2.0E+5\n"
        "MPDATA,R5.0, 1,EX  ,     2, 2,  1.6E+5\nMPDATA,R5.0, 1,PRXY,     2, 1,  0.25\n"
        "MP,EX,3,2E5\nMP,PRXY,3,0.3\nMP,GXY,3,1E5\n"  # 30 % stiffer in shear
        "MP,EX,4,2E5\nMP,PRXY,4,0.25\nMP,GXY,4,8E4\nMP,EY,4,2E5\nTB,BISO,4,1,2\nTB,ANEL,5,1\n"
    )
    (tmp_path / "a.cdb").write_text(archive([(1, 3, [1, 2, 3, 3, 4, 5, 6, 6])], PRISM, materials))
    mesh = read_mesh(tmp_path / "a.cdb")
    assert mesh.materials["1"] == {"young_modulus": 2.1e5, "density": 7.8e-9, "poisson_ratio": 0.3}
    assert "neither PRXY nor NUXY" in mesh.material_notes["1"][0]
    hot = [{"temperature": 600.0, "young_modulus": 1.6e5}]
    assert mesh.materials["2"] == {"young_modulus": 2e5, "poisson_ratio": 0.25, "temperature": 20.0, "at": hot}
    assert mesh.unread_materials == {"5": "TB,ANEL"}
    assert mesh.materials["3"] == {"young_modulus": 2e5, "poisson_ratio": 0.3, "shear_modulus": 1e5}
    assert mesh.materials["4"] == {"young_modulus": 2e5, "poisson_ratio": 0.25}
    assert mesh.units == ("mm",)
    (tmp_path / "a.cdb").write_text(archive([(1, 3, [1, 2, 3, 3, 4, 5, 6, 6])], PRISM, "MASCALE,2\n"))
    with pytest.raises(MeshFileError, match="scales the matrices"):
        read_mesh(tmp_path / "a.cdb")


ORTHOTROPIC = (
    "MP,EX,1,1E5\nMP,EY,1,2E5\nMP,EZ,1,4E5\nMP,NUXY,1,.2\nMP,NUXZ,1,.4\nMP,PRYZ,1,.3\nMP,GXY,1,5E4\nMP,DENS,1,8E-9\n"
    "TREF,22.\nMPTEMP,R5.0, 2, 1, 20., 500.\nMPDATA,R5.0, 2,ALPX,1, 1, 1E-5, 2E-5\nMPDATA,R5.0,2,ALPY,1,1,2E-5,3E-5\n"
    "LOCAL,R5.0,LOC,11,0,0.,0.,0.\nLOCAL,R5.0,ANG,11,0,90.,90.,0.\nLOCAL,R5.0,LOC,12,1,0.,0.,0.\n"
)


def test_an_orthotropic_material_in_a_local_system(tmp_path):
    """Angles about z, then x: local x along y, local y along z; minor ratios are nu_xy = PRXY EY / EX."""
    rows = archive([(1, 3, [1, 2, 3, 3, 4, 5, 6, 6])], PRISM, ORTHOTROPIC)
    head = next(line for line in rows.splitlines() if line.split()[:2] == ["1", "3"])
    for system, said in ((11, {}), (12, {"1": "in coordinate system 12, which is not rectangular"})):
        fields = head.split()
        fields[4] = str(system)
        width = len(head) // len(fields)
        (tmp_path / "a.cdb").write_text(rows.replace(head, "".join(field.rjust(width) for field in fields)))
        mesh = read_mesh(tmp_path / "a.cdb")
        assert mesh.unread_materials == said
        found = mesh.materials["1"]
        if not said:
            np.testing.assert_allclose(found["axes"], [[0, 1, 0], [0, 0, 1]], atol=1e-12)
    ratios = [found[f"poisson_ratio{which}"] for which in ("", "_13", "_23")]
    assert ratios == pytest.approx([0.1, 0.1, 0.3])
    assert (found["temperature"], found["mean_from"]) == (20.0, 22.0)
    assert found["at"] == [{"temperature": 500.0, "expansion": 2e-5, "expansion_2": 3e-5}]


def test_a_material_of_commands_with_empty_fields_in_a_system_with_its_angles(tmp_path):
    orthotropic = (
        "MPTEMP,,,,\nMPTEMP,1,20.,300.,600.\nMPDATA,EX,1,1,3E5,,1E5\nMPDATA,GXY,1,,5E4,4E4\nMPDATA,GXY,1,3,3E4\n"
        "MP,PRXY,1,.3\nMP,DENS,1,8E-9\nLOCAL,11,0,0.,0.,1.,,,30.\n"
    )
    rows = archive([(1, 3, [1, 2, 3, 3, 4, 5, 6, 6])], PRISM, orthotropic)
    head = next(line for line in rows.splitlines() if line.split()[:2] == ["1", "3"])
    fields, width = head.split(), len(head) // len(head.split())
    fields[4] = "11"
    (tmp_path / "a.cdb").write_text(rows.replace(head, "".join(field.rjust(width) for field in fields)))
    found = read_mesh(tmp_path / "a.cdb").materials["1"]
    half = np.sqrt(0.75)  # about y, from z towards x
    np.testing.assert_allclose(found["axes"], [[half, 0, -0.5], [0, 1, 0]], atol=1e-12)
    assert found["at"] == [
        {"temperature": 300.0, "shear_modulus": 4e4},
        {"temperature": 600.0, "young_modulus": 1e5, "shear_modulus": 3e4},
    ]
    (tmp_path / "a.cdb").write_text(rows.replace("MPDATA,GXY,1,3", "MPDATA,GXY,1,4"))
    with pytest.raises(MeshFileError, match="place 4 has no temperature, must be given by MPTEMP before"):
        read_mesh(tmp_path / "a.cdb")
    for line in ("LOCAL", "MPTEMP,x,1.", "MPDATA,EX,1,x,1.", "LOCAL,x,0", "LOCAL,R5.0,ANG,11,0,x"):
        (tmp_path / "a.cdb").write_text(archive([(1, 3, [1, 2, 3, 3, 4, 5, 6, 6])], PRISM, line + "\n"))
        with pytest.raises(MeshFileError, match="must be a number") if "x" in line else nullcontext():
            read_mesh(tmp_path / "a.cdb")


def test_temperatures_of_nodes(tmp_path):
    heat = "BF,       2,TEMP,  600.\nBF,3,FLUE,1.\nBFUNIF,TEMP,20.\n"
    (tmp_path / "a.cdb").write_text(archive([(1, 3, [1, 2, 3, 3, 4, 5, 6, 6])], PRISM, heat))
    assert read_mesh(tmp_path / "a.cdb").temperature.tolist() == [20.0, 600.0, 20.0, 20.0, 20.0, 20.0]


def test_a_pyramid_is_refused(tmp_path):
    (tmp_path / "p.cdb").write_text(archive([(7, 3, [1, 2, 5, 4, 3, 3, 3, 3])], PRISM))
    with pytest.raises(MeshFileError, match=r"element 7 \(hex8 with repeated nodes\) is a pyramid"):
        read_mesh(tmp_path / "p.cdb")
