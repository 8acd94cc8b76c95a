"""Figures and renders: drawn from the right numbers, not empty, and without a display."""

import csv
import shlex
import shutil
import struct
import sys
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from pipeline_support import overlapping_texts, shroud, small_scene, statuses, summary_of, write_scene

import pipeline.figures.style
from pipeline import bootstrap
from pipeline.figures.curve_line import KINDS, stability_segments
from pipeline.figures.style import save, styled, subplots
from pipeline.render.drawing_process import RenderError, draw_apart
from pipeline.render.mode_shapes import at_largest
from pipeline.render.ring import drawn_length, turned, wheel
from pipeline.scene.labels import prefixed, value_label

pytestmark = pytest.mark.usefixtures("drawn_figures")


def size_of(path: Path) -> tuple[int, int]:
    """Width and height of a PNG file."""
    content = path.read_bytes()
    assert content[:8] == b"\x89PNG\r\n\x1a\n"
    return struct.unpack(">II", content[16:24])


def test_every_figure_is_there(finished: Path) -> None:
    pictures = summary_of(finished)["pictures"]
    names = ("hysteresis", "hysteresis_sweep", "nodal_diameters", "peaks", "response")
    assert sorted(pictures) == [f"figures/{name}.png" for name in names]
    for name in pictures:
        assert min(size_of(finished / name)) > 500


def test_a_table_beside_each_figure_has_its_data_and_the_command_that_redraws_it(
    copied: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The points of the curves are those of response.csv; the command brings back what was deleted, in which no text
    lies on another."""
    folder = copied / "figures"
    tables = {path.stem: path.read_text(encoding="utf-8") for path in folder.glob("*.csv")}
    assert tables.keys() == {path.stem for path in folder.glob("*.png")}
    shown = list(csv.DictReader(tables["response"].splitlines()[1:]))
    names = {"0": "v0 = 10 µm", "1": "v0 = 1000 µm"}
    for row in csv.DictReader((copied / "response.csv").open(encoding="utf-8")):
        found = [each for each in shown if each["series"].split(",")[0] == names[row["curve"]]]
        away = [
            abs(float(each["excitation frequency [Hz]"]) / float(row["frequency_hz"]) - 1.0)
            + abs(float(each["largest displacement over a period [µm]"]) / 1e6 / float(row["amplitude_m"]) - 1.0)
            for each in found
        ]
        assert row["branch"] != "0" or min(away) < 1e-7
    scene = write_scene(copied.parent / "again.toml", small_scene(sweep={"contact.interference": [1e-5, 1e-3]}))
    for each in (
        folder,
        copied / "store" / "figures",
    ):  # else those of the folder that was copied stay, their command too
        shutil.rmtree(each)
    assert shroud("run", scene, "--out", copied, "--quiet")[0] == 0
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    first = before["peaks.csv"].decode().splitlines()[0]
    shutil.rmtree(folder)
    shutil.rmtree(copied / "store" / "figures")
    overlaps: dict[str, list[tuple[str, str]]] = {}

    def looking(figure: Any, into: Path, name: str, *given: Any) -> None:
        save(figure, into, name, *given)
        overlaps[name] = overlapping_texts(figure)

    monkeypatch.setattr(pipeline.figures.style, "save", looking)
    words = shlex.split(first.removeprefix("# redraw: "))
    assert words[0] == "shroud"
    assert shroud(*words[1:], "--quiet")[0] == 0
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before
    assert overlaps == {name: [] for name in tables}


def test_settings_of_the_user_have_no_part_in_a_figure(tmp_path: Path) -> None:
    """As a matplotlibrc sets them."""
    import matplotlib as mpl
    from matplotlib import pyplot as plt

    mine = {"lines.linestyle": ":", "axes.facecolor": "red", "font.family": "monospace", "figure.figsize": (2.0, 2.0)}
    for name, settings in (("plain", {}), ("mine", mine)):
        with mpl.rc_context(settings):
            with styled():
                figure, axes = plt.subplots()
                axes.plot([0.0, 1.0], [0.0, 1.0])
                axes.set_xlabel("x")
                save(figure, tmp_path, name, ("png", "svg"))
            assert mpl.rcParams["axes.facecolor"] == settings.get("axes.facecolor", "white")
    for suffix in ("png", "svg"):
        assert (tmp_path / f"plain.{suffix}").read_bytes() == (tmp_path / f"mine.{suffix}").read_bytes()


def test_a_picture_is_the_one_that_matplotlib_draws(tmp_path: Path) -> None:
    """The layout that is computed once, before the drawing, is that of `savefig`."""
    with styled():
        for name in ("once", "savefig"):
            figure, axes = subplots(2, 2, size=(5.0, 4.0))
            for number, place in enumerate(axes.flat):
                place.plot([0.0, 1.0], [0.0, 10.0**number], label=f"line {number}")
                place.set(xlabel="x", ylabel=f"y {number}", title="heading\nof two lines")
            figure.legend(loc="outside lower center")
            if name == "once":
                save(figure, tmp_path, name)
            else:
                figure.savefig(tmp_path / f"{name}.png", metadata={"Software": None})
    assert (tmp_path / "once.png").read_bytes() == (tmp_path / "savefig.png").read_bytes()


def test_the_response_figure_says_what_it_shows(copied: Path) -> None:
    changes: dict[str, Any] = {"figures": {"formats": ["svg"]}, "sweep": {"contact.interference": [1e-5, 1e-3]}}
    scene = write_scene(copied.parent / "s.toml", small_scene(**changes))
    assert shroud("run", scene, "--out", copied, "--quiet")[0] == 0
    assert all(name.endswith(".svg") for name in summary_of(copied)["pictures"])
    root = ElementTree.parse(copied / "figures" / "response.svg").getroot()
    said = " ".join(" ".join(element.itertext()) for element in root.iter("{http://www.w3.org/2000/svg}text"))
    for text in ("Small blade", "[Hz]", "µm]", "v0 = 10 µm", "v0 = 1000 µm", "linear, free", "linear, stuck"):
        assert text in said


def test_a_wheel_shows_its_nodal_diameters_and_no_blade_goes_through_its_neighbour() -> None:
    from geometry import BladeParameters, MeshParameters, ShroudParameters, build_sector

    blade, shroud = BladeParameters(16, 0.3, 0.1, 0.02, 0.008), ShroudParameters(45.0, 0.01, 0.04, 0.01)
    sector = build_sector(blade, shroud, MeshParameters(size=0.02, contact_grid=(2, 2)))
    pitch = 2.0 * np.pi / 16 * float(np.hypot(*sector.points[:, 1:].T).max())
    for diameter in range(9):
        phase = 2.0 * np.pi * diameter / 16
        drawn = drawn_length(sector, phase, 0.05)
        assert 0.0 < drawn <= 0.05
        assert 2.0 * abs(np.sin(0.5 * phase)) * drawn <= 0.3 * pitch
    shape = np.tile([0.0, 1.0, 0.0], (len(sector.points), 1))
    signed = wheel(sector, lambda number: shape * np.cos(2.0 * np.pi * 3 * (number + 0.1) / 16), 0.0)["signed"]
    each = signed.reshape(16, -1)[:, 0]
    assert np.sum(each * np.roll(each, 1) < 0.0) == 6  # three nodal diameters


def test_segments_share_their_ends_and_cover_everything() -> None:
    stable = np.array([True, True, False, False, True, False, True])
    found = stability_segments(stable)
    yes, no, other = KINDS
    assert found == [(0, 2, yes), (1, 5, no), (4, 5, yes), (4, 7, no), (6, 7, yes)]
    assert stability_segments(np.array([True] * 4)) == [(0, 4, yes)]
    assert stability_segments(np.array([False])) == [(0, 1, no)]
    # the nodal diameter counts where the motion is unstable
    found = stability_segments(stable, np.array([3, 0, 0, 2, 2, 5, 0]))
    assert found == [(0, 2, yes), (1, 4, no), (2, 5, other), (4, 5, yes), (4, 7, other), (6, 7, yes)]


@pytest.mark.parametrize(
    ("value", "expected"),
    [(0.0, (1.0, "m")), (2e-6, (1e6, "µm")), (0.5, (1e3, "mm")), (1.0, (1.0, "m")), (3e-12, (1e9, "nm"))],
)
def test_prefixes(value: float, expected: tuple[float, str]) -> None:
    factor, unit = prefixed(value, "m")
    assert unit == expected[1]
    assert factor == pytest.approx(expected[0])


def test_values_are_written_for_people() -> None:
    assert value_label("contact.interference", -3e-6) == "v0 = -3 µm"
    assert value_label("excitation.engine_order", 30) == "engine order 30"
    assert value_label("contact.interference", (1e-6,) * 9) == "v0 = [1 µm ... 1 µm]"


def test_shapes_are_shown_at_their_largest() -> None:
    shape = np.array([[1.0 + 1.0j, 0.0, 0.0], [0.0, 3.0j, 0.0]])
    found = at_largest(shape)
    np.testing.assert_allclose(found[1], [0.0, 1.0, 0.0], atol=1e-12)
    assert np.abs(found[0, 0]) == pytest.approx(np.sqrt(2.0) / 3.0)


def test_neighbours_stand_on_the_side_of_y() -> None:
    pitch = 2 * np.pi / 72
    np.testing.assert_allclose(
        turned(np.array([0.1, 0.0, 0.3]), pitch), [0.1, 0.3 * np.sin(pitch), 0.3 * np.cos(pitch)], rtol=1e-12
    )


def test_modes_are_rendered_once(copied: Path) -> None:
    changes: dict[str, Any] = {"render": {"modes": [1, 2], "contact": "stuck"}, "contact__interference": 1e-5}
    scene = write_scene(copied.parent / "s.toml", small_scene(**changes))
    for expected in ("ran", "reused"):
        status, _, error = shroud("run", scene, "--out", copied, "--quiet", "--until", "render")
        assert (status, error) == (0, "")
        assert statuses(copied)["render"] == expected
        assert statuses(copied)["respond"] == "skipped"
    assert summary_of(copied)["pictures"] == ["renders/mode_1.png", "renders/mode_2.png"]
    first, second = ((copied / name).read_bytes() for name in summary_of(copied)["pictures"])
    assert size_of(copied / "renders" / "mode_1.png") == (1900, 1050)
    assert len(first) > 20_000
    assert first != second


@pytest.mark.parametrize("missing", [False, True])
def test_a_crash_of_the_renderer_is_reported_with_the_remedy_where_a_library_is_missing(
    copied: Path, monkeypatch: pytest.MonkeyPatch, missing: bool
) -> None:
    monkeypatch.setattr(bootstrap, "_loads", lambda name: not (missing and ("EGL" in name or "Mesa" in name)))
    crashing = copied.parent / "python"
    crashing.write_text("#!/bin/sh\nkill -SEGV $$\n")
    crashing.chmod(0o755)
    monkeypatch.setattr(sys, "executable", str(crashing))
    scene = write_scene(copied.parent / "s.toml", small_scene(render={"modes": [1]}, contact__interference=1e-5))
    status, _, error = shroud("run", scene, "--out", copied, "--quiet")
    assert status == 1
    assert error.count("\n") == 1
    remedy = "; missing on this machine: apt-get install -y libegl1" if missing else ""
    assert error == f"render: mode shapes: the drawing process crashed (SIGSEGV){remedy}\n"
    assert summary_of(copied)["curves"][0]["complete"]


def test_an_error_in_drawing_gives_no_advice_on_libraries_that_are_there(tmp_path: Path) -> None:
    with pytest.raises(RenderError, match=r"No module named no_such_drawer$"):
        draw_apart("no_such_drawer", "{}", [tmp_path / "a.png"])


def test_pictures_of_an_earlier_scene_go_away(copied: Path) -> None:
    (copied / "figures" / "mine.png").write_bytes(b"")
    scene = write_scene(copied.parent / "s.toml", small_scene())
    assert shroud("run", scene, "--out", copied, "--quiet")[0] == 0
    left = {path.stem for path in (copied / "figures").iterdir()}
    assert left == {"response", "hysteresis", "nodal_diameters", "mine"}
