"""What only the work itself finds out about its input: said like all the rest, and nothing is left behind."""

from pathlib import Path

import numpy as np
import pytest
from pipeline_support import (
    ground_model,
    ground_scene,
    shroud,
    small_scene,
    without_lines,
    write_ground_model,
    write_scene,
)

from geometry import GeometryError
from nonlinear.harmonic_selection.adaptive_harmonics import HARMONIC_NUMBERS, feasible_harmonic_numbers
from pipeline.scene.size_limits import AUTO_HARMONICS
from rom import ReducedModelError
from rom.cyclic.reduced_model import expand_to_mesh
from rom.errors import RomParameterError
from rom.linear_algebra.factorisation import factorise
from rom.reduction import fixed_interface_modes


def test_a_mesh_that_cannot_be_made_leaves_no_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def none(*_: object, **__: object) -> None:
        raise GeometryError("mesh", "size", 0.009, "gives no valid mesh")

    monkeypatch.setattr("geometry.blade.build.build_sector", none)
    path = write_scene(tmp_path / "s.toml", small_scene())
    out = tmp_path / "out"
    line = 1 + path.read_text().splitlines().index('"size" = 0.009')
    expected = (2, "", f"{path}:{line}: mesh.size: 0.009, allowed: gives no valid mesh\n")
    assert shroud("run", path, "--out", out, "--quiet") == expected
    assert not out.exists()
    out.mkdir()
    assert shroud("run", path, "--out", out, "--quiet") == expected
    assert out.is_dir()  # it was there before


def test_a_frequency_limit_above_all_modes_that_can_be_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    from scipy.sparse import diags_array, eye_array

    monkeypatch.setattr(fixed_interface_modes, "_MOST_MODES", 40)
    stiffness = diags_array((2.0 * np.pi * np.arange(1.0, 101.0)) ** 2).tocsr()  # 1 to 100 Hz
    mass, factor = eye_array(100).tocsr(), factorise(stiffness)
    angular = fixed_interface_modes.modes_up_to(mass, factor, 30.5).omega
    assert angular == pytest.approx(2.0 * np.pi * np.arange(1.0, 31.0))
    with pytest.raises(RomParameterError, match="a lower one: more than 40 modes lie below, up to 40 Hz"):
        fixed_interface_modes.modes_up_to(mass, factor, 1e15)


def test_automatic_harmonics_stop_before_the_balance_is_too_large() -> None:
    assert feasible_harmonic_numbers(9) == HARMONIC_NUMBERS
    assert max(feasible_harmonic_numbers(225)) == 5
    assert feasible_harmonic_numbers(10**6) == (1,)
    assert AUTO_HARMONICS in HARMONIC_NUMBERS


def test_a_basis_that_is_none_of_a_mesh() -> None:
    model = ground_model(basis=np.ones((7, 12)))
    with pytest.raises(ReducedModelError, match="basis: 7 rows, allowed: three for each node"):
        expand_to_mesh(model, np.ones(12))


def test_an_odd_title_is_drawn_as_it_stands(tmp_path: Path) -> None:
    """Two dollar signs are a formula to matplotlib, and what stands between them none."""
    scene = {**ground_scene(), "title": "$\\frac{$ 50 % {} <b> é 形"}
    path, rom_file = write_scene(tmp_path / "s.toml", scene), write_ground_model(tmp_path / "g.h5")
    assert shroud("respond", path, "--rom", rom_file, "--out", tmp_path / "out", "--quiet") == (0, "", "")
    assert (tmp_path / "out" / "figures" / "response.png").is_file()


@pytest.mark.parametrize("title", ["a\nb", "bell\x07", "\u202eright to left", "x" * 201])
def test_titles_of_more_than_a_line_are_refused(tmp_path: Path, title: str) -> None:
    path = write_scene(tmp_path / "s.toml", small_scene(title=title))
    status, _, error = shroud("validate", path)
    assert status == 2
    assert without_lines(error).startswith(f"{path}: title: ")
    assert error.endswith("allowed: one line of text, 200 characters at most\n")
