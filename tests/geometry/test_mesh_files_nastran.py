"""Nastran decks: fields, continuations, coordinate systems (against pyYeti), materials, sets."""

import numpy as np
import pytest
from mesh_file_support import VOLUMES, element_points, shape_of, straight_middles, volumes

from geometry import MeshFileError, read_mesh
from geometry.elements import ELEMENT_KINDS
from geometry.mesh_files.read import included_names

TET = "CTETRA  1       1       1       2       3       4\n"


def read(tmp_path, text):
    (tmp_path / "blade.bdf").write_text(text)
    return read_mesh(tmp_path / "blade.bdf")


SMALL = """\
GRID    1               0.      0.      0.
GRID    2               1.      0.      0.
GRID    3               0.      1.5     0.
GRID    4               .25     0.      2.5-1
"""
LARGE = """\
GRID*                  1                              0.              0.*
*                     0.
GRID*                  2                          1.0D+0              0.
*                     0.
GRID*   3                                             0.            1.5
*       0.
GRID*   4                               .25             0.              +A
*A      2.5D-1
"""
FREE = "GRID,1,,0.,0.,0.\nGRID,2,,1.,,\ngrid,3,,0.,1.5,0.\nGRID,4,,.25,0.,.25\n"
TABS = SMALL.replace("GRID    ", "GRID\t")


@pytest.mark.parametrize("points", [SMALL, LARGE, FREE, TABS])
def test_small_large_and_free_fields(tmp_path, points):
    mesh = read(tmp_path, "SOL 103\nCEND\nBEGIN BULK\n" + points + TET + "ENDDATA\nGRID,9,,x\n")
    np.testing.assert_array_equal(mesh.points, [[0, 0, 0], [1, 0, 0], [0, 1.5, 0], [0.25, 0, 0.25]])


SYSTEMS = """\
GRID,101,,1.,0.5,0.2
GRID,102,,1.5,1.5,0.1
GRID,103,,-.3,0.6,1.9
CORD2R,1,0,1.,2.,3.,1.5,2.,4.
,2.,2.,3.5
CORD2C,2,1,0.,.5,0.,0.2,.5,1.
,1.,.7,0.
CORD2S,3,2,1.,30.,.5,1.,40.,1.5
,2.,60.,.5
"""
BY_NODES = "CORD1R,4,101,102,103\nCORD1C,5,103,101,102\n"
BY_POINTS = """\
CORD2R,4,0,1.,.5,.2,1.5,1.5,.1
,-.3,.6,1.9
CORD2C,5,0,-.3,.6,1.9,1.,.5,.2
,1.5,1.5,.1
"""
NODES = [(k, 1 + k % 5, (0.7 + 0.1 * k, 20.0 * k, 13.0 * k + 5)) for k in range(1, 21)]


def test_coordinate_systems_are_those_of_pyyeti(tmp_path):
    from pyyeti import nastran

    text = SYSTEMS + BY_NODES + "".join(f"GRID,{k},{cp},{x},{y},{z}\n" for k, cp, (x, y, z) in NODES)
    text += "".join(f"CTETRA,{k},1,{a},{b},{c},{d}\n" for k, (a, b, c, d) in enumerate(tetrahedra(), 1))
    path = tmp_path / "systems.bdf"
    path.write_text(text.replace(BY_NODES, BY_POINTS))  # pyYeti has no CORD1R and CORD1C
    uset = nastran.bulk2uset(str(path))[0]
    basic = uset.loc[(slice(None), 1), "x":"z"]
    expected = dict(zip(basic.index.get_level_values("id"), basic.to_numpy(), strict=True))
    path.write_text(oriented(text, expected))
    mesh = read_mesh(path)
    assert len(mesh.points) == 20
    np.testing.assert_allclose(mesh.points, [expected[k] for k in mesh.node_labels], rtol=1e-12, atol=1e-12)


def tetrahedra():
    return [(4 * k + 1, 4 * k + 2, 4 * k + 3, 4 * k + 4) for k in range(5)]


def oriented(text, points):
    """Nodes of tetrahedra in the order of positive volume."""
    for k, (a, b, c, d) in enumerate(tetrahedra(), 1):
        if np.linalg.det(np.array([points[n] - points[a] for n in (b, c, d)])) < 0:
            text = text.replace(f"CTETRA,{k},1,{a},{b},", f"CTETRA,{k},1,{b},{a},")
    return text


@pytest.mark.parametrize(
    ("card", "kind", "order"),
    [  # order of the manual: round the bottom, upwards, round the top
        ("CTETRA", "tet10", [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)]),
        (
            "CPENTA",
            "wedge15",
            [(0, 1), (1, 2), (2, 0), (0, 3), (1, 4), (2, 5), (3, 4), (4, 5), (5, 3)],
        ),
        (
            "CHEXA",
            "hex20",
            [
                *((0, 1), (1, 2), (2, 3), (3, 0), (0, 4), (1, 5), (2, 6), (3, 7)),
                *((4, 5), (5, 6), (6, 7), (7, 4)),
            ],
        ),
    ],
)
def test_mid_side_nodes(tmp_path, card, kind, order):
    corners = element_points(kind)[: ELEMENT_KINDS[kind].corners]
    points = [*corners, *((corners[a] + corners[b]) / 2 for a, b in order)]
    text = "".join(f"GRID,{k},,{x!r},{y!r},{z!r}\n" for k, (x, y, z) in enumerate(np.array(points).tolist(), 1))
    fields = ["7", "3", *map(str, range(1, len(points) + 1))]
    lines = ["".join(f"{x:>8s}" for x in fields[k : k + 8]) for k in range(0, len(fields), 8)]
    mesh = read(tmp_path, text + f"{card:8s}" + "\n        ".join(lines) + "\n")
    assert [block.kind for block in mesh.blocks] == [kind]
    assert straight_middles(mesh)
    assert mesh.element_labels[0].tolist() == [7]


def test_materials_and_properties(tmp_path):
    mesh = read(
        tmp_path,
        SMALL + TET + "GRID,5,,1.,1.,1.\nCTETRA,2,6,2,3,4,5\nPSOLID,1,11\nPSOLID,6,12\n"
        "MAT1,11,2.1+11,,.3,7800.,1.2-5\nMAT1    12      2.6E11  1.E11           8000.\n",
    )
    assert {block.material: len(block) for block in mesh.blocks} == {"11": 1, "12": 1}
    assert mesh.materials["11"] == {
        "young_modulus": 2.1e11, "poisson_ratio": 0.3, "density": 7800.0, "expansion": 1.2e-5,
    }  # fmt: skip
    assert mesh.materials["12"]["poisson_ratio"] == pytest.approx(0.3)  # from E and G
    assert sorted(mesh.element_sets) == ["PSOLID_1", "PSOLID_6"]


STEEL = "PSOLID,1,1\nMAT1,1,3.+7,,.3,.283\n"


@pytest.mark.parametrize(
    ("head", "bulk", "density", "modulus"),
    [
        ("", "PARAM,WTMASS,.00259\n", 0.283 * 0.00259, 3e7),
        ("", "PARAM   WTMASS  .00259\n", 0.283 * 0.00259, 3e7),
        ("", "PARAM*  WTMASS                  2.59-3\n", 0.283 * 0.00259, 3e7),
        ("PARAM,WTMASS,.00259\nBEGIN BULK\n", "", 0.283 * 0.00259, 3e7),
        ("", "PARAM,WTMASS,.00259\nPARAM,CM1,2.\nPARAM,CK1,.5\n", 0.283 * 0.00518, 1.5e7),
        ("", "PARAM,WTMASS,1.\nPARAM,GRDPNT,0\n", 0.283, 3e7),
    ],
)
def test_parameters_that_scale_masses_and_stiffness_are_taken_and_said(tmp_path, head, bulk, density, modulus):
    mesh = read(tmp_path, head + SMALL + TET + STEEL + bulk)
    assert mesh.materials["1"]["density"] == pytest.approx(density, rel=1e-12)
    assert mesh.materials["1"]["young_modulus"] == pytest.approx(modulus, rel=1e-12)
    said = [line for line in mesh.material_notes.get("1", ()) if "multiplied by PARAM" in line]
    assert len(said) == (head + bulk).count("PARAM") - 2 * bulk.count("GRDPNT")


def test_parameters_that_contradict_each_other_are_refused(tmp_path):
    with pytest.raises(MeshFileError, match="WTMASS is given with several values"):
        read(tmp_path, SMALL + TET + STEEL + "PARAM,WTMASS,.00259\nPARAM,WTMASS,1.\n")


def test_materials_that_are_not_constant_and_isotropic(tmp_path):
    cards = "PSOLID,1,1\nMAT9,1,1.+5,5.+4\nMAT1,2,2.1+5,,.3\nMATT1,2,4\nMAT1,3,2.1+5,2.+5,.3\n"
    mesh = read(tmp_path, SMALL + TET + cards)
    assert mesh.unread_materials == {"1": "MAT9 that is not of an orthotropic solid"}
    assert "density" not in mesh.materials["2"]
    assert "table 4 of MATT1 is not a TABLEM1" in mesh.material_notes["2"][0]
    assert "G = 200000 is not E / (2 + 2 nu)" in mesh.material_notes["3"][0]


CUBIC = (  # c11 = 4, c12 = 1, c44 = 2, and E, nu of these
    "MAT9,1,4.,1.,1.,,,,4.,\n,1.,,,,4.,,,,\n,2.,,,2.,,2.,7.-9,1.-5,\n,2.-5,3.-5\n"
    "CORD2R,5,,0.,0.,0.,0.,0.,1.,\n,0.,1.,0.\nPARAM,CK1,10.\n"
)


def test_an_orthotropic_material_in_its_system(tmp_path):
    mesh = read(tmp_path, SMALL + TET + "PSOLID,1,1,5\n" + CUBIC)
    found = mesh.materials["1"]
    assert found["axes"] == [[0, 1, 0], [-1, 0, 0]]
    moduli = [found[name] for name in ("young_modulus", "young_modulus_3", "shear_modulus", "shear_modulus_23")]
    assert moduli == pytest.approx([36.0, 36.0, 20.0, 20.0])  # (c11 - c12) (c11 + 2 c12) / (c11 + c12), times CK1
    assert (found["poisson_ratio_23"], found["density"]) == pytest.approx((0.2, 7e-9))
    assert [found[name] for name in ("expansion", "expansion_2", "expansion_3")] == [1e-5, 2e-5, 3e-5]
    mesh = read(tmp_path, SMALL + TET + "PSOLID,1,1,-1\n" + CUBIC)
    assert mesh.unread_materials == {"1": "in coordinate system -1, which is not rectangular"}


def test_tables_over_the_temperature(tmp_path):
    tables = "MATT1,1,8,,,,9\nTABLEM1,8,,,,,,,,\n,20.,2.1+5,600.,1.6+5,ENDT\n"
    tables += "TABLEM1,9,,,,,,,,\n,0.,1.-5,300.,1.3-5,900.,1.5-5,ENDT\n"
    mesh = read(tmp_path, SMALL + TET + "PSOLID,1,1\nMAT1,1,2.+5,,.3,7.8-9,1.2-5,25.\n" + tables)
    assert mesh.materials["1"] == {
        "young_modulus": 2.1e5, "poisson_ratio": 0.3, "density": 7.8e-9, "expansion": 1e-5,
        "temperature": 0.0, "mean_from": 25.0,
        "at": [
            {"temperature": 20.0, "young_modulus": 2.1e5}, {"temperature": 300.0, "expansion": 1.3e-5},
            {"temperature": 600.0, "young_modulus": 1.6e5}, {"temperature": 900.0, "expansion": 1.5e-5},
        ],
    }  # fmt: skip
    with pytest.raises(MeshFileError, match="TABLEM1: must have pairs of a temperature and a value"):
        read(tmp_path, SMALL + TET + "MAT1,1,2.+5,,.3\n" + tables.replace(",600.,1.6+5", ""))


def test_pairs_of_a_table_that_are_skipped_or_left_empty(tmp_path):
    head = SMALL + TET + "PSOLID,1,1\nMAT1,1,2.+5,,.3\nMATT1,1,8\n"
    mesh = read(tmp_path, head + "TABLEM1,8,,,,,,,,\n,20.,2.1+5,SKIP,SKIP,300.,SKIP,,,\n,600.,1.6+5,ENDT\n")
    hot = [{"temperature": 600.0, "young_modulus": 1.6e5}]
    assert (mesh.materials["1"]["young_modulus"], mesh.materials["1"]["at"]) == (2.1e5, hot)
    mesh = read(tmp_path, head + "TABLEM1,8,LINEAR,LOG,,,,,,\n,20.,2.1+5,600.,1.6+5,ENDT\n")
    assert "at" not in mesh.materials["1"]
    assert "not a TABLEM1 with linear axes" in mesh.material_notes["1"][0]


@pytest.mark.parametrize(
    ("card", "places", "cold", "hot"),
    [
        ("MAT1,1,2.6+5,1.+5", "8", (2.6e5, 0.3), (2.1e5, 0.05)),  # G as it is
        ("MAT1,1,2.6+5,1.+5", "8,9", (2.6e5, 0.3), (2.1e5, 0.4)),
        ("MAT1,1,,1.+5,.3", ",9", (2.6e5, 0.3), (1.95e5, 0.3)),
    ],
)
def test_the_constant_left_out_follows_from_the_two_others_at_each_temperature(tmp_path, card, places, cold, hot):
    tables = "TABLEM1,8,,,,,,,,\n,20.,2.6+5,600.,2.1+5,ENDT\nTABLEM1,9,,,,,,,,\n,20.,1.+5,600.,.75+5,ENDT\n"
    mesh = read(tmp_path, SMALL + TET + f"PSOLID,1,1\n{card}\nMATT1,1,{places}\n{tables}")
    found = mesh.materials["1"]
    states = [found | row for row in ({}, *found["at"])]
    rows = [(state["young_modulus"], state["poisson_ratio"]) for state in states]
    assert rows == [pytest.approx(cold), pytest.approx(hot)]


def test_temperatures_of_nodes(tmp_path):
    mesh = read(tmp_path, SMALL + TET + STEEL + "TEMPD,7,20.\nTEMP,7,1,500.,2,600.\nTEMP,9,1,1.\n")
    assert mesh.temperature[:3].tolist() == [500.0, 600.0, 20.0]
    assert any("of load set 7 are taken, not of 9" in note for note in mesh.notes)
    assert read(tmp_path, SMALL + TET + STEEL).temperature is None


@pytest.mark.parametrize(
    ("line", "units"),
    [
        ("$*  UNITS: mm (milli-newton)\n", ("mm-kg-s",)),
        ("DTI,UNITS,1,KG,N,M,S\n", ("m",)),
        ("DTI     UNITS   1       MGG     N       MM      S\n", ("mm", "mm-g-ms")),
        ("PARAM,UNITSYS,MN-MM\n", ("mm-kg-s",)),
        ("DTI,SPECSEL,1,A\n", ()),
    ],
)
def test_units_that_a_deck_states(tmp_path, line, units):
    assert read(tmp_path, line + SMALL + TET).units == units


def test_sets(tmp_path):
    case_control = (
        '$HMSET        1        1 "root"\n$HMSET        2        2 "tip elements"\n'
        "SET 1 = 1, 2,\n 3\nSET 2 = 1\nSET 3 = 1 THRU 4 EXCEPT 2,3\nSET 4 = ALL\nBEGIN BULK\n"
    )
    bulk = "SET1,5,1,THRU,1000000000\nSET3,6,GRID,2,4\nSET3,7,ELEM,1\nSPC1,8,123,2,3\nSPC1,8,123,4\n"
    mesh = read(tmp_path, case_control + SMALL + TET + bulk)
    assert {name: mesh.node_labels[rows].tolist() for name, rows in mesh.node_sets.items()} == {
        "root": [1, 2, 3],
        "SET_3": [1, 4],
        "SET_4": [1, 2, 3, 4],
        "SET_5": [1, 2, 3, 4],
        "SET_6": [2, 4],
        "SPC1_8": [2, 3, 4],
    }
    assert {"tip elements", "SET_7"} <= set(mesh.element_sets)


def test_what_is_left_out_is_said_with_what_it_does(tmp_path):
    mesh = read(
        tmp_path,
        SMALL + TET + "CTRIA3,5,2,1,2,3\nCBAR,6,3,1,2\nRBE2,7,1,123,2,3\nMPC,1,1,1,1.,2,1,-1.\nCELAS2,8,1.,1,1\n"
        "CONM2,9,1,,2.5\nSPC,1,4,123\nGRID,20,,9.,9.,9.,,123\nCROD,10,1,1,2\nPLOTEL,11,1,2\nFOO,1\nEIGRL,1\n",
    )  # fmt: skip
    assert mesh.n_elements == 1
    assert volumes(mesh) == pytest.approx([1.5 * 0.25 / 6])
    lost = "no solid elements that are read: their stiffness and mass are missing here"
    assert set(mesh.warnings) == {
        f"1 CBAR, 1 CROD left out: {lost}",
        "1 RBE2, 1 MPC left out: nodes that they tie move freely here: the structure is softer than that of the file",
        "1 CELAS2 left out: their stiffness is missing here",
        "1 CONM2 left out: their mass is missing here: frequencies come out too high",
    }
    assert {
        "1 SPC left out: supports of the file: the scene says what is held",
        "1 GRID with PS left out: supports of the file: the scene says what is held",
        "1 PLOTEL left out: no solid elements: without stiffness and mass",
        "1 FOO left out: not known to the reader",
    } <= set(mesh.notes)


@pytest.mark.parametrize(
    "text",
    [
        "GRID,1,,0.,0.,0.\n=,*(1),=,*(1.),==\n=(9)\nGRID,21,,0.,1.,0.\n=,*1,=,*1.,==\n=9\n"
        "GRID,41,,0.,0.,1.\n=,*(1),=,*(1.),==\n=(9)\nGRID,61,,0.,1.,1.\n=,*(1),=,*(1.),==\n=(9)\n"
        "CHEXA,1,1,1,2,22,21,41,42,+\n+,62,61\n=,*(1),=,*(1),*(1),*(1),*(1),*(1),*(1),+\n+,*(1),*(1)\n=(8)\n",
        "GRID    1               0.      0.      0.\n=       *(1)    =       *(1.)   ==\n=(9)\n"
        "GRID    21              0.      1.      0.\n=       *(1)    =       *(1.)   ==\n=(9)\n"
        "GRID    41              0.      0.      1.\n=       *(1)    =       *(1.)   ==\n=(9)\n"
        "GRID    61              0.      1.      1.\n=       *(1)    =       *(1.)   ==\n=(9)\n"
        "CHEXA   1       1       1       2       22      21      41      42      +A\n+A      62      61\n"
        "=       *(1)    =       *(1)    *(1)    *(1)    *(1)    *(1)    *(1)    *(1)\n*(1)    *(1)    *(1)\n=(8)\n",
    ],
)
def test_replicated_cards(tmp_path, text):
    """Ten cubes in a row from two lines of elements; free and fixed fields."""
    mesh = read(tmp_path, text)
    assert [(block.kind, len(block)) for block in mesh.blocks] == [("hex8", 10)]
    assert volumes(mesh) == pytest.approx([10.0])
    assert mesh.node_labels.tolist() == [*range(1, 12), *range(21, 32), *range(41, 52), *range(61, 72)]
    np.testing.assert_allclose(mesh.points[:11, 0], np.arange(11.0))
    assert mesh.element_labels[0].tolist() == list(range(1, 11))


def test_elements_numbered_the_other_way_round(tmp_path):
    """Nastran takes both; sides and mid-side nodes are those of the file."""
    kinds = {"CTETRA": ("tet4", [0, 2, 1, 3]), "CPENTA": ("wedge6", [0, 2, 1, 3, 5, 4]),
             "CHEXA": ("hex8", [0, 3, 2, 1, 4, 7, 6, 5])}  # fmt: skip
    text = ""
    for number, (card, (kind, order)) in enumerate(kinds.items(), 1):
        for k, (x, y, z) in enumerate(element_points(kind).tolist(), 10 * number):
            text += f"GRID,{k},,{x + 5 * number!r},{y!r},{z!r}\n"
        nodes = [str(10 * number + k) for k in order]
        text += (
            f"{card},{number},1,{','.join(nodes[:6])}" + (f",+\n+,{','.join(nodes[6:])}" if nodes[6:] else "") + "\n"
        )
    mesh = read(tmp_path, text)
    determinant = 1 + 0.3 * 0.1 * 0.2
    assert volumes(mesh) == pytest.approx([VOLUMES[shape_of(block.kind)] * determinant for block in mesh.blocks])
    assert "3 elements numbered the other way round, inside out: turned round" in mesh.notes


def test_included_files_over_lines_and_as_windows_writes_them(tmp_path):
    (tmp_path / "parts" / "low").mkdir(parents=True)
    (tmp_path / "parts" / "low" / "grid.inc").write_text(SMALL)
    for name in ("'parts/\n  low/\n  grid.inc'", "'parts\\low\\grid.inc'", '"parts/low/grid.inc"'):
        mesh = read(tmp_path, f"CEND\nBEGIN BULK\nINCLUDE {name}\n{TET}ENDDATA\n")
        assert len(mesh.points) == 4
        assert included_names(tmp_path / "blade.bdf", ".bdf") == ("parts/low/grid.inc",)


def test_sets_of_the_plotter_and_of_frequencies(tmp_path):
    mesh = read(
        tmp_path,
        "SET 3 = 1 THRU 4 BY 2\nSET 4 = 100., 2.+2\nOUTPUT(PLOT)\n  SET 1 = ALL EXCEPT PLOTEL\n"
        "BEGIN BULK\n" + SMALL + TET,
    )  # fmt: skip
    assert {name: mesh.node_labels[rows].tolist() for name, rows in mesh.node_sets.items()} == {"SET_3": [1, 3]}
    assert "SET 4 left out: holds frequencies or times, not labels" in mesh.notes


def test_plane_elements_supports_and_cyclic_joints(tmp_path):
    """Faces by their property, named by HyperMesh or not; nodes held in all directions by SPC, SPC1 and GRID."""
    mesh = read(
        tmp_path,
        '$HMNAME PROP                   7"shroud right" 4\n' + SMALL.replace("2.5-1\n", "2.5-1           123\n") + TET
        + "CTRIA3,5,7,1,2,3\nCTRIA3,6,8,1,2,4\nPSHELL,8,1,.1\nSPC,1,1,12\nSPC1,1,3,1\nSPC1,1,123,2,THRU,3\n"
        "CYJOIN,1,C,1,2,3\nCYJOIN,2,C,1,THRU,3\n",
    )  # fmt: skip
    assert {name: len(mesh.surfaces[name]) for name in mesh.surfaces} == {"shroud right": 1, "PSHELL_8": 1}
    assert any("1 CTRIA3 left out" in line for line in mesh.warnings)
    assert mesh.root == "SPC"
    assert mesh.node_labels[mesh.node_sets["SPC"]].tolist() == [1, 2, 3, 4]
    assert mesh.node_labels[mesh.node_sets["cyclic_left"]].tolist() == [1, 2, 3]
    assert len(mesh.node_sets["cyclic_right"]) == 3
