"""Abaqus and CalculiX input files: parts, instances, nested sets, surfaces, materials, included files."""

import numpy as np
import pytest
from mesh_file_support import area, volumes

from geometry import MeshFileError, read_mesh
from geometry.mesh_files.read import included_names

CUBE = """\
** two cubes on top of each other
*Node
 1, 0., 0., 0.
 2, 1., 0., 0.
 3, 1., 1., 0.
 4, 0., 1., 0.
 5, 0., 0., 1.
 6, 1., 0., 1.
 7, 1., 1., 1.
 8, 0., 1., 1.
 9, 0., 0., 2.
10, 1., 0., 2.
11, 1., 1., 2.
12, 0., 1., 2.
*Element, type=C3D8R, elset=lower
1, 1, 2, 3, 4, 5, 6, 7, 8
*Element, type=C3D8,
 elset=upper
2, 5, 6, 7, 8,
   9, 10, 11, 12
"""


def read(tmp_path, text, name="blade.inp"):
    (tmp_path / name).write_text(text)
    return read_mesh(tmp_path / name)


def test_sets_that_hold_sets_and_ranges(tmp_path):
    mesh = read(
        tmp_path,
        CUBE
        + "*NSET, NSET=bottom\n1, 2,\n3, 4\n*Nset, nset=Ring, generate\n5, 8\n9, 11, 2\n"
        + "*NSET, NSET=both\nBOTTOM, ring, 12\n*NSET, NSET=of_upper, ELSET=upper\n"
        + "*ELSET, ELSET=all\nlower, 2\n*NSET, NSET=both\n10\n",
    )
    assert {name: mesh.node_labels[rows].tolist() for name, rows in mesh.node_sets.items()} == {
        "bottom": [1, 2, 3, 4],
        "Ring": [5, 6, 7, 8, 9, 11],
        "both": [1, 2, 3, 4, 5, 6, 7, 8, 9, 11, 12, 10],
        "of_upper": [5, 6, 7, 8, 9, 10, 11, 12],
    }
    assert {name: len(rows) for name, rows in mesh.element_sets.items()} == {"lower": 1, "upper": 1, "all": 2}
    assert mesh.notes == ("elements C3D8R are taken as hex8 with full integration",)
    assert volumes(mesh) == pytest.approx([2.0])


def test_sets_sections_and_surfaces_that_name_sets_of_later_lines(tmp_path):
    mesh = read(
        tmp_path,
        CUBE
        + "*MATERIAL, NAME=Steel\n*ELASTIC\n2.1E5, 0.3\n*SOLID SECTION, ELSET=blade, MATERIAL=Steel\n,\n"
        + "*SURFACE, NAME=top\nlast, S2\n*ELSET, ELSET=blade\nlower, last\n*NSET, NSET=all, ELSET=blade\n"
        + "*ELSET, ELSET=last\n2\n",
    )
    assert [(block.material, len(block)) for block in mesh.blocks] == [("Steel", 2)]
    assert mesh.node_labels[mesh.surfaces["top"].nodes(mesh.blocks)].tolist() == [9, 10, 11, 12]
    assert len(mesh.node_sets["all"]) == 12


@pytest.mark.parametrize(
    "head",
    ["*NSET, NSET=root,", "*NSET,\n** which\nNSET=root,", "*NSET, NSET=root, GENERATE", "*NSET, NSET=root,\n gen,"],
)
def test_a_comma_at_the_end_of_a_keyword_line(tmp_path, head):
    """CalculiX ends the line there; parameters go on after it, data do not."""
    data = "1, 4\n5, 8" if "gen" in head.lower() else "1, 2, 3, 4\n5, 6, 7, 8"
    mesh = read(tmp_path, f"{CUBE}{head}\n{data}\n")
    assert mesh.node_labels[mesh.node_sets["root"]].tolist() == [1, 2, 3, 4, 5, 6, 7, 8]


def test_what_is_left_out_is_said_with_what_it_does(tmp_path):
    mesh = read(
        tmp_path,
        CUBE
        + "*EQUATION\n2\n1, 1, 1., 2, 1, -1.\n3\n1, 2, 1., 2, 2, -1.,\n3, 2, 1.\n*MPC\nBEAM, 1, 2\nTIE, 3, 4\n"
        + "*RIGID BODY, NSET=upper, REF NODE=1\n*TIE, NAME=t\na, b\n*TIE, NAME=c, CYCLIC SYMMETRY\na, b\n"
        + "*ELEMENT, TYPE=MASS, ELSET=m\n5, 1\n*MASS, ELSET=m\n2.\n*ELEMENT, TYPE=SPRING1\n6, 1\n7, 2\n"
        + "*ELEMENT, TYPE=S4, ELSET=s\n8, 1, 2, 3, 4\n*SHELL SECTION, ELSET=s\n.1\n"
        + "*BOUNDARY\n1, 1, 3\n2, 1, 3\n*CLOADS, X=1\n*STEP\n*CLOAD\n1, 1, 5.\n"
        + "*END STEP\n",
    )
    assert set(mesh.warnings) == {
        "2 *EQUATION, 2 *MPC, 1 *RIGID BODY, 1 *TIE left out: nodes that they tie move freely here: "
        "the structure is softer than that of the file",
        "1 MASS, 1 *MASS left out: their mass is missing here: frequencies come out too high",
        "2 SPRING1 left out: their stiffness is missing here",
        "1 S4 left out: no solid elements that are read: their stiffness and mass are missing here",
    }
    assert {
        "2 *BOUNDARY left out: supports of the file: the scene says what is held",
        "1 *TIE left out: cyclic symmetry of the file: the scene names its cut faces",
        "1 *CLOADS left out: not known to the reader",
    } <= set(mesh.notes)


def test_a_range_of_a_thousand_million_labels_costs_nothing(tmp_path):
    mesh = read(tmp_path, CUBE + "*NSET, NSET=all, GENERATE\n1, 2000000000, 1\n")
    assert len(mesh.node_sets["all"]) == 12


def test_surfaces_by_sides_by_sets_and_free_ones(tmp_path):
    mesh = read(
        tmp_path,
        CUBE
        + "*ELSET, ELSET=all\n1, 2\n*SURFACE, NAME=front, TYPE=ELEMENT\nall, S3\n"
        + "*SURFACE, NAME=top\n2, S2\n*SURFACE, NAME=skin, TYPE=ELEMENT\nall,\n"
        + "*SURFACE, TYPE=NODE, NAME=feet\n1\n2\n",
    )
    assert area(mesh, "front") == pytest.approx(2.0)
    assert area(mesh, "skin") == pytest.approx(10.0)
    assert mesh.node_labels[mesh.surfaces["top"].nodes(mesh.blocks)].tolist() == [9, 10, 11, 12]
    assert mesh.node_labels[mesh.node_sets["feet"]].tolist() == [1, 2]


@pytest.mark.parametrize(
    ("kind", "line", "faces"),
    [
        ("C3D4", "1, 1, 2, 4, 5", [(1, 2, 4), (1, 2, 5), (2, 4, 5), (1, 4, 5)]),
        ("C3D6", "1, 1, 2, 4, 5, 6, 8", [(1, 2, 4), (5, 6, 8), (1, 2, 5, 6), (2, 4, 6, 8), (1, 4, 5, 8)]),
        (
            "C3D8",
            "1, 1, 2, 3, 4, 5, 6, 7, 8",
            [(1, 2, 3, 4), (5, 6, 7, 8), (1, 2, 5, 6), (2, 3, 6, 7), (3, 4, 7, 8), (1, 4, 5, 8)],
        ),
        # numbered the other way round
        ("C3D4", "1, 2, 1, 4, 5", [(1, 2, 4), (1, 2, 5), (1, 4, 5), (2, 4, 5)]),
        ("C3D6", "1, 5, 6, 8, 1, 2, 4", [(5, 6, 8), (1, 2, 4), (1, 2, 5, 6), (2, 4, 6, 8), (1, 4, 5, 8)]),
        (
            "C3D8",
            "1, 5, 6, 7, 8, 1, 2, 3, 4",
            [(5, 6, 7, 8), (1, 2, 3, 4), (1, 2, 5, 6), (2, 3, 6, 7), (3, 4, 7, 8), (1, 4, 5, 8)],
        ),
    ],
)
def test_sides_are_numbered_as_in_the_manual(tmp_path, kind, line, faces):
    nodes = CUBE.split("*Element")[0]
    surfaces = "".join(f"*SURFACE, NAME=f{k}\n1, S{k}\n" for k in range(1, len(faces) + 1))
    mesh = read(tmp_path, f"{nodes}*ELEMENT, TYPE={kind}\n{line}\n{surfaces}")
    found = [tuple(mesh.node_labels[mesh.surfaces[f"f{k + 1}"].nodes(mesh.blocks)]) for k in range(len(faces))]
    assert found == faces


def test_materials_by_element_set(tmp_path):
    mesh = read(
        tmp_path,
        CUBE
        + "*MATERIAL, NAME=Steel\n*ELASTIC\n2.1E5, 0.3, 20.\n2.0D5, 0.3, 300.\n*DENSITY\n7.8e-9\n*EXPANSION\n1.2e-5\n"
        + "*MATERIAL, NAME=felt\n*ELASTIC, TYPE=ANISOTROPIC\n1, 2, 3\n"
        + "*SOLID SECTION, ELSET=upper, MATERIAL=STEEL\n,\n",
    )
    assert [(block.material, len(block)) for block in mesh.blocks] == [("", 1), ("Steel", 1)]
    assert mesh.materials["Steel"] == {
        "young_modulus": 2.1e5, "poisson_ratio": 0.3, "density": 7.8e-9, "expansion": 1.2e-5, "temperature": 20.0,
        "at": [{"temperature": 300.0, "young_modulus": 2e5, "poisson_ratio": 0.3}],
    }  # fmt: skip
    assert any("material felt is *ELASTIC, TYPE=ANISOTROPIC" in note for note in mesh.notes)


def test_materials_keep_what_they_have(tmp_path):
    mesh = read(
        tmp_path,
        CUBE + "*MATERIAL, NAME=a\n*ELASTIC\n7.E4\n*MATERIAL, NAME=b\n*ELASTIC\n2.1E5, .3\n*PLASTIC\n300., 0.\n"
        "*MATERIAL, NAME=c\n*ELASTIC, TYPE=ANISO\n1., 2., 3.\n*DENSITY\n8.E-9, 20.\n7.E-9, 900.\n"
        "*MATERIAL, NAME=d\n*HYPERELASTIC, NEO HOOKE\n1., 2.\n*DENSITY\n1.E-9\n",
    )  # fmt: skip
    assert mesh.materials["a"] == {"young_modulus": 7e4}
    hot = [{"temperature": 900.0, "density": 7e-9}]
    assert mesh.materials["c"] == {"density": 8e-9, "temperature": 20.0, "at": hot}
    assert mesh.unread_materials == {"c": "*ELASTIC, TYPE=ANISO", "d": "*HYPERELASTIC"}
    assert "*PLASTIC left out" in mesh.material_notes["b"][0]


CRYSTAL = (
    "*MATERIAL, NAME=crystal\n*ELASTIC, TYPE=ENGINEERING CONSTANTS\n1E5, 2E5, 3E5, .1, .2, .3, 4E4, 5E4\n6E4, 20.\n"
    "1E4, 2E4, 3E4, .1, .2, .3, 4E3, 5E3\n6E3, 800.\n*EXPANSION, TYPE=ORTHO, ZERO=10.\n1E-5, 2E-5, 3E-5, 20.\n"
    "2E-5, 2E-5, 3E-5, 800.\n*SOLID SECTION, ELSET=upper, MATERIAL=crystal, ORIENTATION=or\n,\n"
)


def test_an_orthotropic_material_over_the_temperature_in_an_orientation(tmp_path):
    mesh = read(tmp_path, CUBE + CRYSTAL + "*ORIENTATION, NAME=OR\n0., 3., 0., -1., 1., 0.\n1, 90.\n")
    found = mesh.materials["crystal"]
    assert found["axes"] == [pytest.approx([0, 1, 0]), pytest.approx([0, 0, 1])]  # turned about axis 1
    names = ("young_modulus", "young_modulus_2", "young_modulus_3", "poisson_ratio", "poisson_ratio_13")
    names += ("poisson_ratio_23", "shear_modulus", "shear_modulus_13", "shear_modulus_23")
    assert [found[name] for name in names] == [1e5, 2e5, 3e5, 0.1, 0.2, 0.3, 4e4, 5e4, 6e4]
    (hot,) = found["at"]
    assert (found["temperature"], found["mean_from"], hot["temperature"]) == (20.0, 10.0, 800.0)
    assert (hot["shear_modulus_23"], hot["expansion"], found["expansion_3"]) == (6e3, 2e-5, 3e-5)


def test_orientations_that_are_not_there_or_turn(tmp_path):
    with pytest.raises(MeshFileError, match="NAME=or is not defined"):
        read(tmp_path, CUBE + CRYSTAL)
    with pytest.raises(MeshFileError, match="must have 9 constants, 8 in the first line"):
        read(tmp_path, CUBE + CRYSTAL.replace("6E4, 20.", ", 20."))
    mesh = read(tmp_path, CUBE + CRYSTAL + "*ORIENTATION, NAME=OR, SYSTEM=CYLINDRICAL\n0., 0., 0., 1., 0., 0.\n")
    assert mesh.unread_materials == {"crystal": "in *ORIENTATION or, which is not rectangular"}


@pytest.mark.parametrize(
    ("lines", "first", "second"),
    [
        ("1., , , , 1.\n", (1, 0, 0), (0, 1, 0)),  # fields that are left empty are 0
        ("1., 0., 0., 0., 1., 0.,\n, 90.\n", (1, 0, 0), (0, 0, 1)),  # about axis 1 where none is named
        ("1., 0., 0., 0., 1., 0.\n2, 90.\n", (0, 0, -1), (0, 1, 0)),
        ("1., 0., 0., 0., 1., 0.\n3, 90.\n", (0, 1, 0), (-1, 0, 0)),
        ("5., 0., 1., 0., 5., 1., 0., 0., 1.\n3\n", (1, 0, 0), (0, 1, 0)),
    ],
)
def test_points_and_turns_of_an_orientation(tmp_path, lines, first, second):
    mesh = read(tmp_path, CUBE + CRYSTAL + "*ORIENTATION, NAME=OR\n" + lines)
    np.testing.assert_allclose(mesh.materials["crystal"]["axes"], [first, second], atol=1e-12)


def test_orientations_that_are_no_axes_of_the_whole(tmp_path):
    with pytest.raises(MeshFileError, match="about axis 4: must be about axis 1, 2 or 3"):
        read(tmp_path, CUBE + CRYSTAL + "*ORIENTATION, NAME=OR\n1., 0., 0., 0., 1., 0.\n4, 90.\n")
    for kind, line in (("", "grain, 0."), (", DEFINITION=NODES", "1, 2, 3")):
        mesh = read(tmp_path, CUBE + CRYSTAL + f"*ORIENTATION, NAME=OR{kind}\n{line}\n")
        assert mesh.unread_materials == {"crystal": "in *ORIENTATION or, which is not rectangular"}


def test_orientations_of_one_name_in_several_parts_and_turned_instances(tmp_path):
    """Each part has its own `or`, and each instance turns it with it."""
    crystal, section = CRYSTAL.split("*SOLID")
    parts = "".join(
        f"*PART, NAME={name}\n{CUBE}*SOLID{section}*ORIENTATION, NAME=OR\n{axes}\n*END PART\n"
        for name, axes in (("x", "1., 0., 0., 0., 1., 0."), ("y", "0., 1., 0., 0., 0., 1."))
    )
    instances = "".join(
        f"*INSTANCE, NAME={part}{angle}, PART={part}\n0., 0., 0.\n0., 0., 0., 0., 0., 1., {angle}.\n*END INSTANCE\n"
        for part, angle in (("x", 0), ("x", 30), ("x", 90), ("y", 0), ("y", 180))
    )
    mesh = read(tmp_path, parts + f"*ASSEMBLY, NAME=A\n{instances}*END ASSEMBLY\n" + crystal)
    used = [block.material for block in mesh.blocks if block.material.startswith("crystal")]
    first = [mesh.materials[name]["axes"][0] for name in used]
    half = np.sqrt(0.75)
    np.testing.assert_allclose(first, [[1, 0, 0], [half, 0.5, 0], [0, 1, 0], [0, 1, 0], [0, -1, 0]], atol=1e-12)


def test_rows_of_a_table_in_any_order(tmp_path):
    mesh = read(tmp_path, CUBE + "*MATERIAL, NAME=m\n*ELASTIC\n1E5, .3, 600.\n2E5, .2, 20.\n")
    hot = {"temperature": 600.0, "young_modulus": 1e5, "poisson_ratio": 0.3}
    assert mesh.materials["m"] == {"young_modulus": 2e5, "poisson_ratio": 0.2, "temperature": 20.0, "at": [hot]}
    with pytest.raises(MeshFileError, match="must have each temperature once"):
        read(tmp_path, CUBE + "*MATERIAL, NAME=m\n*ELASTIC\n1E5, .3, 20.\n2E5, .2, 20.\n")


def test_scaled_masses_are_refused(tmp_path):
    with pytest.raises(MeshFileError, match="MASS ADJUST: changes the masses"):
        read(tmp_path, CUBE + "*MASS ADJUST\nall, 2.\n")


def test_instances_are_moved_and_turned(tmp_path):
    text = (
        "*PART, NAME=cube\n" + CUBE + "*NSET, NSET=feet\n1, 2\n*END PART\n*ASSEMBLY, NAME=A\n"
        "*INSTANCE, NAME=one, PART=cube\n*END INSTANCE\n"
        "*INSTANCE, NAME=two, PART=cube\n10., 0., 0.\n10., 0., 0., 10., 0., 1., 90.\n*END INSTANCE\n"
        "*NSET, NSET=tops, INSTANCE=one\n9\n*NSET, NSET=tops, INSTANCE=two\n9, 10\n"
        "*NSET, NSET=mixed\none.feet, two.3\n"
        "*END ASSEMBLY\n"
    )
    mesh = read(tmp_path, text)
    assert len(mesh.points) == 24
    assert volumes(mesh) == pytest.approx([4.0])
    # x' = 10 - y, y' = x: moved by 10 along x, then turned about the line x = 10 by 90 degrees
    np.testing.assert_allclose(mesh.points[mesh.node_sets["two.feet"]], [[10, 0, 0], [10, 1, 0]], atol=1e-12)
    np.testing.assert_allclose(mesh.points[mesh.node_sets["tops"]], [[0, 0, 2], [10, 0, 2], [10, 1, 2]], atol=1e-12)
    np.testing.assert_allclose(mesh.points[mesh.node_sets["mixed"]], [[0, 0, 0], [1, 0, 0], [9, 1, 0]], atol=1e-12)


def test_included_files_of_the_folder(tmp_path):
    head, tail = CUBE.split("*Element", 1)
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "nodes.inc").write_text(head)
    mesh = read(tmp_path, "*INCLUDE, INPUT=parts/nodes.inc\n*Element" + tail)
    assert mesh.n_elements == 2


def test_nodes_from_a_file_of_their_own(tmp_path):
    (tmp_path / "n.inc").write_text("".join(CUBE.splitlines(keepends=True)[2:14]))
    mesh = read(tmp_path, "*NODE, NSET=all, INPUT=n.inc\n*Element" + CUBE.split("*Element", 1)[1])
    assert (mesh.n_elements, len(mesh.node_sets["all"])) == (2, 12)
    assert included_names(tmp_path / "blade.inp", ".inp") == ("n.inc",)


def test_files_of_included_files_stand_beside_them_or_beside_the_main_one(tmp_path):
    head, tail = CUBE.split("*Element", 1)
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "all.inc").write_text("*INCLUDE, INPUT=parts/nodes.inc\n*INCLUDE, INPUT=elements.inc\n")
    (tmp_path / "parts" / "nodes.inc").write_text(head)
    (tmp_path / "parts" / "elements.inc").write_text("*Element" + tail)
    assert read(tmp_path, "*INCLUDE, INPUT=parts/all.inc\n").n_elements == 2


def test_a_file_of_the_folder_above_names_where_to_start(tmp_path):
    (tmp_path / "job").mkdir()
    (tmp_path / "nodes.inc").write_text(CUBE.split("*Element")[0])
    with pytest.raises(MeshFileError, match=rf"or give a file in {tmp_path} that includes job/blade.inp"):
        read(tmp_path / "job", "*INCLUDE, INPUT=..\\nodes.inc\n*Element" + CUBE.split("*Element", 1)[1])
    mesh = read(tmp_path, "*INCLUDE, INPUT=job/blade.inp\n", "start.inp")
    assert mesh.n_elements == 2


@pytest.mark.parametrize("name", ["../outside.inc", "/etc/passwd", "link.inc", "blade.inp"])
def test_files_elsewhere_are_not_included(tmp_path, name):
    folder = tmp_path / "in"
    folder.mkdir()
    (tmp_path / "outside.inc").write_text(CUBE)
    (folder / "link.inc").symlink_to("/etc/passwd")
    with pytest.raises(MeshFileError, match=r"^[^\n]*blade.inp: includes [^\n]*$"):
        read(folder, CUBE + f"*INCLUDE, INPUT={name}\n")


def test_plane_elements_on_solids_are_surfaces(tmp_path):
    """As gmsh writes its physical surfaces; one with a thickness is structure too."""
    mesh = read(
        tmp_path,
        CUBE + "*ELEMENT, TYPE=CPS4, ELSET=Surface1\n11, 1, 2, 3, 4\n12, 9, 10, 11, 12\n"
        "*ELEMENT, TYPE=S3, ELSET=coat\n13, 1, 2, 6\n14, 1, 6, 5\n*ELEMENT, TYPE=M3D4, ELSET=film\n15, 1, 4, 8, 5\n"
        "*MEMBRANE SECTION, ELSET=film\n.1\n"
        "*ELSET, ELSET=both\nSurface1\n*SURFACE, NAME=top\n12, SPOS\n*SURFACE, NAME=low\nSurface1, SNEG\n",
    )
    assert {name: area(mesh, name) for name in ("Surface1", "both", "top", "low", "film")} == pytest.approx(
        {"Surface1": 2.0, "both": 2.0, "top": 1.0, "low": 2.0, "film": 1.0}
    )
    assert set(mesh.element_sets) == {"lower", "upper"}
    lost = "left out: no solid elements that are read: their stiffness and mass are missing here"
    assert mesh.warnings == (f"2 S3, 1 M3D4 {lost}",)
    assert "2 CPS4 on sides of solid elements: their sets are surfaces" in mesh.notes


def test_what_a_deck_says_of_its_faces(tmp_path):
    """Nodes held in all directions, the pairs of contact, several cyclic ties of which one is the other way round."""
    wide = CUBE.replace(" 0., 0., ", " 0., 10., ").replace(" 1., 0., ", " 1., 10., ").replace(", 1., ", ", 11., ")
    wide = "".join(wide.partition("*Element")[1:])
    nodes = "*NODE\n" + "".join(
        f"{4 * k + n}, {x}, {10 + y}, {k}\n"
        for k in range(3)
        for n, x, y in ((1, -1, 0), (2, 1, 0), (3, 1, 1), (4, -1, 1))
    )
    mesh = read(
        tmp_path,
        nodes + wide + "*NSET, NSET=foot\n1, 2, 5, 6, 9, 10\n*NSET, NSET=other\n3, 4\n"
        "*SURFACE, NAME=R1\nlower, S4\n*SURFACE, NAME=L1\nlower, S6\n"
        "*SURFACE, NAME=R2\nupper, S4\n*SURFACE, NAME=L2\nupper, S6\n"
        "*TIE, NAME=a, CYCLIC SYMMETRY\nR1, L1\n*TIE, NAME=b, CYCLIC SYMMETRY\nL2, R2\n"
        "*CONTACT PAIR, INTERACTION=i\nR1, L2\n*CONTACT PAIR, INTERACTION=i, TIED\nR2, L1\n"
        "*STEP\n*BOUNDARY\nfoot, 1, 2\nfoot, 3\nother, 1, 2\nother, 3, 3, .5\nnowhere, 1, 3\n*END STEP\n",
    )
    assert (mesh.root, mesh.contacts) == ("foot", (("R1", "L2"),))
    ends = {mesh.points[mesh.surfaces[name].nodes(mesh.blocks), 0].mean() for name in ("cyclic_right", "R1", "R2")}
    assert len(mesh.surfaces["cyclic_left"]) == len(mesh.surfaces["cyclic_right"]) == 2
    assert len(ends) == 1 or -mesh.points[mesh.surfaces["cyclic_left"].nodes(mesh.blocks), 0].mean() in ends
