"""Names of foreign files on screen, and numbers of CSV files as spreadsheets write them."""

from pathlib import Path

import numpy as np
import pytest
from mesh_decks import Body, write_deck
from pipeline_support import shroud, small_scene, write_scene

from pipeline.errors import InputError
from pipeline.scene.aero_section import AeroFamily
from pipeline.scene.loads_section import force_table

WEDGE = Body((100.0, 120.0), (-5.0, 5.0), (0.0, 20.0), (3, 2, 3))
ROWS = "x,y,z,fx,fy,fz\n0.5,0,0.25,1e-3,2,-3\n0.75,0,0,0,1.5,0\n"


@pytest.mark.parametrize("ending", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize("between", [",", ";", "\t"])
def test_tables_of_spreadsheets(tmp_path: Path, ending: str, between: str) -> None:
    text = ROWS if between == "," else ROWS.replace(",", between).replace(".", ",")
    (tmp_path / "f.csv").write_bytes(text.replace("\n", ending).encode())
    (tmp_path / "plain.csv").write_text(ROWS)
    found, plain = (force_table(str(tmp_path / name), None) for name in ("f.csv", "plain.csv"))
    np.testing.assert_array_equal(found.values, plain.values)
    np.testing.assert_array_equal(found.positions, plain.positions)


def test_decimal_commas_between_commas_are_named(tmp_path: Path) -> None:
    (tmp_path / "f.csv").write_text(ROWS.replace(".", ","))
    with pytest.raises(InputError, match=r"line 2: 8 values, allowed: 6.*decimal commas only with semicolons"):
        force_table(str(tmp_path / "f.csv"), None)


def test_control_characters_of_names_do_not_reach_the_terminal(tmp_path: Path) -> None:
    deck = write_deck(tmp_path / "b.inp", [WEDGE], {"root": lambda body, r, angle, z: r < 100.1})
    text = (
        deck.read_text()
        .replace("NAME=steel", "NAME=st\x1b[31meel")
        .replace("MATERIAL=steel", "MATERIAL=st\x1b[31meel")
    )
    deck.write_text(text + "*NSET, NSET=a\x1b]0;title\x07\n1, 2\n*NSET, NSET=a ]0;title \n3, 4\n")
    status, told, error = shroud("new", tmp_path / "n", "--mesh", deck)
    assert status == 0
    assert "a ]0;title (2 nodes)" in told
    assert "material st [31meel" in told
    told = told + error + (tmp_path / "n" / "scene.toml").read_text()
    assert all(c.isprintable() or c == "\n" for c in told)
    assert "shroud-" not in shroud("validate", tmp_path / "n" / "scene.toml")[2]


def test_messages_name_the_file_and_not_its_copy(tmp_path: Path) -> None:
    apart = Body((130.0, 140.0), (-5.0, 5.0), (0.0, 20.0), (1, 2, 3))
    deck = write_deck(tmp_path / "b.inp", [WEDGE, apart], {"root": lambda body, r, angle, z: r < 100.1})
    _, told, error = shroud("new", tmp_path / "n", "--mesh", deck, "--blades", "36", "--axis", "z")
    assert f"mesh.file = '{deck}': must be one connected body" in told + error


def test_a_face_with_a_partner_is_no_tip(tmp_path: Path) -> None:
    sets = {
        "root": lambda body, r, angle, z: r < 100.1,
        "Tip_R": lambda body, r, angle, z: (angle > 4.9) & (r > 110.0),
        "Tip_L": lambda body, r, angle, z: (angle < -4.9) & (r > 110.0),
    }
    _, told, _ = shroud("new", tmp_path / "n", "--mesh", write_deck(tmp_path / "b.inp", [WEDGE], sets))
    assert 'contact_right: "Tip_R"' in told
    assert "tip: " not in told


@pytest.mark.parametrize("other", [0.01, 0.02])
def test_both_ends_of_the_waves_are_one_where_they_agree(tmp_path: Path, other: float) -> None:
    family = AeroFamily(mode=1, nodal_diameter=(-1, 0, 1), real=(0.0, 0.1, 0.0), imaginary=(0.01, 0.0, other))
    assert len(family.with_each_wave_once(2).nodal_diameter) == (2 if other == 0.01 else 3)
    count = 36
    table = [(n, 0.0, other if n == -count // 2 else 0.01 * (abs(n) == count // 2)) for n in range(-18, 19)]
    columns = {
        name: list(column)
        for name, column in zip(("nodal_diameter", "real", "imaginary"), zip(*table, strict=True), strict=True)
    }
    scene = small_scene(blade__n_blades=count, aero={"family": [{"mode": 1, **columns}]})
    status, _, error = shroud("validate", write_scene(tmp_path / "s.toml", scene))
    assert (status == 0) == (other == 0.01)
    assert (other == 0.01) or "18 and -18 are one wave" in error
