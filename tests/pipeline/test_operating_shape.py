"""The motion of the blade at a peak: against what the solver wrote of it, and as pictures."""

from pathlib import Path

import h5py
import numpy as np
import pytest
from PIL import Image
from pipeline_support import shroud, small_scene, statuses, summary_of, without_lines, write_scene

import pipeline.render.render_stage
from pipeline import read_results
from pipeline.render.operating_shapes import OperatingShape, operating_shape
from rom.files.sector_file import load_sector


def test_the_whole_blade_moves_as_the_solver_found_its_contacts_and_its_tip(tmp_path: Path) -> None:
    # rendered: the model keeps its basis
    changes = {
        "render": {"modes": [1]},
        "rom__contact_dofs": "nodal",
        "sweep": {"contact.interference": [1e-5, 1e-3]},
    }
    scene, copied = write_scene(tmp_path / "s.toml", small_scene(**changes)), tmp_path / "out"
    assert shroud("run", scene, "--out", copied, "--quiet", "--until", "respond")[0] == 0
    (mesh,) = (copied / "store" / "mesh").glob("*/sector.h5")
    sector = load_sector(mesh)
    rom = copied / summary_of(copied)["models"][0]["rom"]
    curves = sorted((copied / "store" / "curve").glob("*/curve.h5"))
    assert len(curves) == 2
    for path in curves:
        shape = operating_shape(path, rom, len(sector.points))
        assert shape is not None
        with h5py.File(path) as file:
            peak = file.attrs["peak_index"]
            output, relative = file["output"][peak], file["relative_displacement"][peak]
            assert shape.frequency_hz == file["frequency_hz"][peak]
        tip = shape.harmonics[:, sector.node_sets["tip"][0], 1]
        np.testing.assert_allclose(tip, output, atol=1e-9 * np.abs(output).max())
        for h, motion in enumerate(shape.harmonics):
            right = np.einsum("kab,kb->ka", sector.right.frame, motion[sector.right.nodes])
            left = np.einsum("kab,kb->ka", sector.left.frame, motion[sector.left.nodes])
            found = right - left * np.exp(1j * h * shape.phase)
            np.testing.assert_allclose(found, relative[h], atol=1e-8 * np.abs(relative).max())
    plotter = read_results(copied).show_mode(1, contact="stuck", show=False)
    frequency = summary_of(copied)["models"][0]["stuck_hz"]["36"][0]
    texts = [actor.GetText(2) for actor in plotter.actors.values() if hasattr(actor, "GetText")]
    plotter.close()
    assert texts == [f"mode 1 (1F), shrouds stuck, {frequency:.1f} Hz"]


def test_a_neighbour_does_the_same_a_little_earlier() -> None:
    random = np.random.default_rng(1)
    harmonics = random.normal(size=(3, 4, 3)) + 1j * random.normal(size=(3, 4, 3))
    shape = OperatingShape(100.0, 1.0, 0.7, harmonics)
    np.testing.assert_allclose(shape.at(0.3, blade=2), shape.at(0.3 + 2 * 0.7), rtol=1e-12)
    static = np.real(harmonics[0])
    mean = np.mean([shape.at(angle) for angle in 2 * np.pi * np.arange(8) / 8], axis=0)
    np.testing.assert_allclose(mean, static, atol=1e-12)
    largest, angle = shape.largest()
    assert np.linalg.norm(shape.at(angle), axis=1).max() == largest


def test_the_motion_at_a_peak_is_rendered_and_animated_once(copied: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pipeline.render.render_stage, "FRAMES", 3)
    sweep = {"contact.interference": [1e-5, 1e-3]}
    scene = write_scene(copied.parent / "s.toml", small_scene(render={"modes": [1], "operating": [1]}, sweep=sweep))
    for expected in ("ran", "reused"):
        status, _, error = shroud("run", scene, "--out", copied, "--quiet", "--until", "render")
        assert (status, error) == (0, "")
        assert statuses(copied)["render"] == expected
    assert statuses(copied)["respond"] == "reused"
    names = ["renders/mode_1.png", "renders/operating_1.gif", "renders/operating_1.png"]
    assert summary_of(copied)["pictures"] == names
    with Image.open(copied / names[1]) as animation:
        assert animation.n_frames == 3
        assert animation.info["loop"] == 0
    with Image.open(copied / names[2]) as still:
        assert len(np.unique(np.asarray(still).reshape(-1, 3), axis=0)) > 100


@pytest.mark.parametrize(("operating", "found"), [([2], "[2]"), ([0, 1, 7], "[0, 1, 7]")])
def test_curves_that_are_not_there_cannot_be_drawn(tmp_path: Path, operating: list[int], found: str) -> None:
    sweep = {"contact.interference": [1e-5, 1e-3]}
    scene = write_scene(tmp_path / "s.toml", small_scene(render={"operating": operating}, sweep=sweep))
    status, _, error = shroud("validate", scene)
    assert status == 2
    allowed = "true, false or a list of numbers of curves, 0 to 1"
    assert without_lines(error) == f"{scene}: render.operating: {found}, allowed: {allowed}\n"
