"""Broken, careless and hostile mesh files: one line each, which names the file and what is wrong."""

import os

import numpy as np
import pytest
from mesh_file_support import element_points, every_kind
from mesh_writer import write_mesh

from geometry import MeshFileError, read_mesh

NODES = "*NODE\n1, 0., 0., 0.\n2, 1., 0., 0.\n3, 0., 1., 0.\n4, 0., 0., 1.\n5, 1., 1., 1.\n"
TET = "*ELEMENT, TYPE=C3D4, ELSET=all\n1, 1, 2, 3, 4\n"
GRID = "GRID,1,,0.,0.,0.\nGRID,2,,1.,0.,0.\nGRID,3,,0.,1.,0.\nGRID,4,,0.,0.,1.\n"
CTETRA = "CTETRA,1,1,1,2,3,4\n"
MSH = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n4\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n$EndNodes\n$Elements\n1\n"
QUADRATIC = "*NODE\n" + "".join(
    f"{k}, {x!r}, {y!r}, {z!r}\n" for k, (x, y, z) in enumerate(element_points("hex20").tolist(), 1)
)
ABAQUS = {
    "missing coordinate values": (NODES.replace("2, 1.,", "2, nan,") + TET, r"node 2 is at \(nan, 0, 0\)"),
    "decimal commas": (
        "*NODE\n1, 0, 0, 0\n2, 1,5, 0,0, 0,25\n" + TET,
        r"line 1, \*NODE: '2, 1,5, 0,0, 0,25': must be a label .* numbers have points, not commas",
    ),
    "infinite": (NODES.replace("2, 1.,", "2, 1e999,") + TET, r"node 2 is at \(inf, 0, 0\).*must be finite"),
    "words for numbers": (NODES.replace("2, 1.,", "2, one,") + TET, "line 1, \\*NODE: 'one' in the data"),
    "node twice": (NODES + "2, 1., 0., 0.5\n" + TET, "node 2 is defined twice at different places"),
    "element twice": (NODES + TET + "1, 2, 3, 4, 5\n", "element 1 is defined twice"),
    "the same element under another label": (
        NODES + TET + "2, 2, 3, 1, 4\n",
        "elements 1 and 2 .* have the same corners",
    ),
    "the same element in another table": (
        NODES + TET + "*ELEMENT, TYPE=C3D4\n2, 2, 3, 1, 4\n",
        "elements 1 and 2 .* have the same corners",
    ),
    "a path of Windows": (
        NODES + TET + "*INCLUDE, INPUT=C:\\m\\x.inc\n",
        "only files in its own folder can be included",
    ),
    "unknown node": (NODES + TET.replace("3, 4", "3, 44"), r"element 1 \(tet4\) names node 44"),
    "node label 0": (NODES.replace("1, 0.", "0, 0.") + TET, "node 0: must be a positive integer"),
    "negative label": (NODES.replace("5, 1.", "-5, 1.") + TET, "node -5: must be a positive integer"),
    "fractional label": (NODES.replace("5, 1.", "5.5, 1.") + TET, "node 5.5: must be a positive integer"),
    "absurd label": (NODES + TET.replace("3, 4", "3, 99999999999999999999"), "must be a positive integer"),
    "no elements": (NODES, "holds no solid elements"),
    "no nodes": (TET, "holds no nodes"),
    "shells only": (NODES + "*ELEMENT, TYPE=S4R\n1, 1, 2, 3, 4\n", "holds no solid elements .*S4R"),
    "nothing solid, of two kinds": (
        NODES + "*ELEMENT, TYPE=S4R\n1, 1, 2, 3, 4\n*ELEMENT, TYPE=MASS\n2, 1\n",
        "holds no solid elements .*1 MASS left out.*; 1 S4R left out",
    ),
    "pyramids": (NODES + "*ELEMENT, TYPE=C3D5\n1, 1, 2, 3, 4, 5\n", "TYPE=C3D5 are pyramids"),
    "nodes in a wrong order": (
        QUADRATIC + "*ELEMENT, TYPE=C3D8\n1, 5, 6, 7, 8, 1, 2, 4, 3\n",
        r"element 1 \(hex8\) is inside out at some of its corners \(its nodes are in a wrong order\)",
    ),
    "flat": (NODES + TET.replace("3, 4", "3, 6") + "*NODE\n6, 1., 1., 0.\n", "has no volume"),
    "too few nodes": (NODES + TET.replace(", 4\n", "\n"), r"element 1 \(C3D4\): must have 4 nodes"),
    "element without type": (NODES + TET.replace("TYPE=C3D4, ", ""), "TYPE= is missing"),
    "mid-side node 0": (
        QUADRATIC + "*ELEMENT, TYPE=C3D20\n7, " + ", ".join(map(str, [*range(1, 20), 0])),
        r"element 7 \(hex20\) lacks 1 of its 12 mid-side nodes",
    ),
    "mid-side node left empty": (
        QUADRATIC + "*ELEMENT, TYPE=C3D20\n7, " + ", ".join(map(str, [*range(1, 12), "", *range(13, 21)])),
        r"element 7 \(hex20\) lacks 1 of its 12 mid-side nodes",
    ),
    "mid-side nodes not written": (
        QUADRATIC + "*ELEMENT, TYPE=C3D20\n7, " + ", ".join(map(str, range(1, 9))) + "\n",
        r"element 7 \(C3D20\): must have 20 nodes",
    ),
    "a mid-side node twice": (
        QUADRATIC + "*ELEMENT, TYPE=C3D20\n7, " + ", ".join(map(str, [*range(1, 20), 19])),
        "its nodes must be distinct",
    ),
    "unknown set": (NODES + TET + "*NSET, NSET=a\nroot\n", "'root' is no node set of the file"),
    "set by itself": (
        NODES + TET + "*NSET, NSET=a\nb\n*NSET, NSET=b\na\n",
        r"line 11, \*NSET: set a is defined by itself",
    ),
    "unknown parameter": (
        NODES + TET + "*NSET, NSET=a, STEP=2\n1, 2\n",
        r"line 9, \*NSET: parameter STEP is not known",
    ),
    "unknown section": (NODES + TET + "*SOLID SECTION, ELSET=b, MATERIAL=m\n", "'b' is no element set"),
    "set without name": (NODES + TET + "*NSET\n1, 2\n", r"\*NSET: NSET= is missing"),
    "range backwards by 0": (NODES + TET + "*NSET, NSET=a, GENERATE\n1, 5, 0\n", "must be first, last and step"),
    "side of no such number": (NODES + TET + "*SURFACE, NAME=s\n1, S6\n", "must be S1 to S4"),
    "unknown part": (NODES + TET + "*INSTANCE, NAME=i, PART=p\n*END INSTANCE\n", "PART=p is not defined"),
    "material without numbers": (NODES + TET + "*MATERIAL, NAME=m\n*ELASTIC\n", "number of young modulus"),
    "generated nodes": (NODES + TET + "*NGEN, NSET=a\n1, 5, 1\n", "must be written out node by node"),
    "no keyword": ("some text\n", "holds no keyword"),
    "a million sets": (
        NODES + TET + "".join(f"*NSET, NSET=n{k}\n1\n" for k in range(20_001)),
        "holds 20001 sets: at most 20000 are read",
    ),
}
NASTRAN = {
    "unknown system": (GRID.replace("4,,", "4,9,") + CTETRA, "node 4 names coordinate system 9"),
    "system by itself": (GRID + "CORD2R,5,5,0.,0.,0.,0.,0.,1.\n,1.,0.,0.\nGRID,6,5,0.,0.,0.\n" + CTETRA, "by itself"),
    "system on a line": (
        GRID + "CORD2R,5,0,0.,0.,0.,0.,0.,1.\n,0.,0.,2.\nGRID,6,5,0.,0.,0.\n" + CTETRA,
        "are on a line",
    ),
    "words for numbers": (GRID.replace("GRID,3,,0.", "GRID,3,,zero") + CTETRA, "line 3, GRID: field 4 is 'zero'"),
    "words for labels": (GRID + CTETRA.replace("3,4", "3,d"), "line 5, CTETRA: field 7 is 'd'"),
    "pyramids": (GRID + "CPYRAM,1,1,1,2,3,4,5\n", "line 5, CPYRAM: is a pyramid"),
    "a field too many": (
        GRID + "CHEXA,1,1,1,2,3,4,5,6,7,8\n",
        "line 5, CHEXA: has more than 8 data fields in a line",
    ),
    "a node in the field of the continuation": (
        GRID + "SPC1,1,123,1,2,3,4,1,2,3\n" + CTETRA,
        "line 5, SPC1: has 3 in field",
    ),
    "a continuation of another card": (
        GRID + "CTETRA,1,1,1,2,3,4,,,+A\n+B,5\n",
        r"line 5, CTETRA: ends with \+A and goes on with \+B",
    ),
    "a continuation without a card": (",1,2\n" + GRID + CTETRA, "line 1: goes on with a card that has not begun"),
    "nothing to replicate": (GRID + CTETRA + "=(3)\n", r"line 6, =\(3\): must be = with increments"),
    "an increment of nothing": (GRID + "=,*1,*(2),==\n" + CTETRA, r"line 5, =: '\*\(2\)' after ''"),
    "superelement": (GRID + CTETRA + "BEGIN SUPER=1\n" + GRID, "line 6, BEGIN SUPER=1: superelements, modules"),
    "generated mesh": (GRID + "CGEN,CHEXA,1,1,2\n" + CTETRA, "line 5, CGEN: makes nodes or elements"),
    "some mid-side nodes": (
        GRID + "GRID,5,,.5,0.,0.\n" + CTETRA.replace("3,4", "3,4,5"),
        r"element 1 \(tet10\) lacks 5 of its 6 mid-side nodes",
    ),
    "bad set": ("SET 1 = 1, two\nBEGIN BULK\n" + GRID + CTETRA, "SET 1: 'TWO' must be a positive integer"),
    "too many nodes": (GRID + "CTETRA,1,1,1,2,3,4,5,6\n,7,8,9,10,11,12\n", "has more than 10 nodes"),
    "included password file": (GRID + "INCLUDE '/etc/passwd'\n" + CTETRA, "includes /etc/passwd: only files in its"),
    "an include without an end": (
        GRID + "INCLUDE 'a.inc\n" + CTETRA,
        'line 5: "INCLUDE \'a.inc" must name a file, quotes',
    ),
    "includes itself": (GRID + "INCLUDE 'blade.bdf'\n", "which includes itself"),
}
GMSH = {
    "unknown node": (MSH + "1 4 2 1 1 1 2 3 9\n$EndElements\n", "cannot be read|names node"),
    "pyramid": (
        MSH.replace("$Nodes\n4", "$Nodes\n5").replace("$EndNodes", "5 1 1 1\n$EndNodes")
        + "1 7 2 1 1 1 2 5 3 4\n$EndElements\n",
        "is a pyramid",
    ),
    "script": ('SystemCall "ls";\n', r"does not start with \$MeshFormat"),
    "truncated": (MSH[:90], "cannot be read|holds no"),
    "absurd count": (MSH.replace("$Elements\n1\n", "$Elements\n99999999999\n"), "cannot be read|holds no"),
}


def refused(path, found):
    with pytest.raises(MeshFileError, match=found) as caught:
        read_mesh(path)
    line = str(caught.value)
    assert line.startswith(f"{path}: ")
    assert "\n" not in line
    assert len(line) < len(str(path)) + 250


@pytest.mark.parametrize("case", ABAQUS)
def test_abaqus(tmp_path, case):
    text, found = ABAQUS[case]
    (tmp_path / "blade.inp").write_text(text)
    refused(tmp_path / "blade.inp", found)


@pytest.mark.parametrize("case", NASTRAN)
def test_nastran(tmp_path, case):
    text, found = NASTRAN[case]
    (tmp_path / "blade.bdf").write_text(text)
    refused(tmp_path / "blade.bdf", found)


@pytest.mark.parametrize("case", GMSH)
def test_gmsh(tmp_path, case):
    text, found = GMSH[case]
    (tmp_path / "blade.msh").write_text(text)
    refused(tmp_path / "blade.msh", found)


ANSYS = {
    "500 nodes in a row": (
        ("         8         0        10", "       500         0        10"),
        "a row of the EBLOCK",
    ),
    "letters in a row": (("         8         0        10", "         8         0        1x"), "a row of the EBLOCK"),
    "a row less": (("EBLOCK,19,SOLID,        60,         6", "EBLOCK,19,SOLID,60,7"), "EBLOCK says 7 rows and has 6"),
    "a thousand million nodes": (("NBLOCK,6,SOLID,       191,        63", "NBLOCK,6,SOLID,9,999999999"), "has 63"),
    "wide fields": (("(3i9,6e25.16e3)", "(3i99999,6e25.16e3)"), "must be a format such as"),
    "no nodes": (("NBLOCK", "N_BLOCK"), "holds 0 NBLOCK tables: must hold one"),
    "unequal fields in a component": (("       173", "   1  7.3"), "must be a row of below"),
    "component of a million": (
        ("CMBLOCK,low     ,NODE,        18", "CMBLOCK,low,NODE,1000000"),
        "must be a row of low",
    ),
    "a command that makes elements": (
        ("CMBLOCK,low ", "EGEN,2,10,1\nCMBLOCK,low "),
        "EGEN: makes or changes nodes or el",
    ),
    "a solid key missing": (("EBLOCK,19,SOLID", "EBLOCK,19,"), "must be EBLOCK with the key SOLID"),
}


@pytest.mark.parametrize("case", ANSYS)
def test_ansys(tmp_path, case):
    (old, new), found = ANSYS[case]
    path = tmp_path / "blade.cdb"
    write_mesh(path, every_kind())
    text = path.read_text()
    assert old in text
    head, middle, tail = text.rpartition(old) if "component" in case else text.partition(old)
    assert middle
    path.write_text(head + new + tail)
    refused(path, found)


@pytest.mark.parametrize("suffix", [".inp", ".bdf", ".cdb", ".msh", ".vtu", ".med"])
def test_no_file_no_text_no_content(tmp_path, suffix):
    path = tmp_path / f"blade{suffix}"
    refused(path, "no such file")
    path.symlink_to(tmp_path / "nowhere")
    refused(path, "no such file")
    path.unlink()
    path.write_bytes(b"")
    refused(path, "is empty")
    path.write_bytes(np.random.default_rng(1).bytes(5000))
    refused(path, "is a binary file|cannot be read|does not start with")
    path.unlink()
    path.mkdir()
    refused(path, "is not a file")
    path.rmdir()
    os.mkfifo(path)
    refused(path, "is not a file")


@pytest.mark.parametrize("suffix", [".cdb", ".vtu", ".inp", ".bdf"])
def test_the_end_is_missing(tmp_path, suffix):
    path = tmp_path / f"whole{suffix}"
    write_mesh(path, every_kind())
    whole = path.read_bytes()
    for part in (0.2, 0.5):
        path.write_bytes(whole[: int(part * len(whole))])
        with pytest.raises(MeshFileError, match=r"^[^\n]*$"):
            read_mesh(path)


def test_careless_but_clear(tmp_path):
    """What can only mean one thing is read, with a note."""
    text = NODES + "2, 1., 0., 0.\n" + TET + "*NSET, NSET=a\n1, 5, 77\n*NSET, NSET=b\n5\n*ELSET, ELSET=c\n9\n"
    (tmp_path / "blade.inp").write_text(text.replace("\n", "\r\n"))
    mesh = read_mesh(tmp_path / "blade.inp")
    assert mesh.notes == (
        "1 node defined twice at the same place",
        "1 node of no solid element left out",
        "node set a: 2 of 3 nodes are of no solid element",
        "node sets without a node of a solid element left out: b",
        "element sets without solid elements left out: c",
    )


def test_an_error_leaves_its_process(tmp_path):
    """Errors are sent between processes."""
    from multiprocessing import Pipe

    here, there = Pipe()
    there.send(MeshFileError(tmp_path / "a.inp", "line 1\nof two"))
    assert str(here.recv()) == f"{tmp_path / 'a.inp'}: line 1 of two"
