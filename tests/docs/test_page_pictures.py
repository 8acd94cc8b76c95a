"""The pictures of README and pages are of today's scenes, code and numbers: docs/images/made_from.json."""

import re
import shutil
from pathlib import Path

import pytest

from docs import make_pictures, picture_record
from docs.make_pictures import pictures
from docs.picture_record import fingerprint, read_record, stale
from pipeline import run_scene

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
CURVES = {4: 5e-6, 7: 400e-6}  # curves of the default scene, with slip and stuck
QUICK = 'tolerance = 0.01\nstability = "folds"\ntruncation = false\ndetached = false'


def test_no_picture_is_older_than_what_it_was_made_from() -> None:
    assert list(stale(pictures().values())) == [], "make pictures"


def test_every_picture_shown_is_recorded_and_every_one_recorded_is_shown() -> None:
    shown = {name for page in PAGES for name in re.findall(r"images/(\w+)\.png", page.read_text())}
    assert shown == set(pictures()) == {path.stem for path in picture_record.IMAGES.glob("*.png")}


def test_what_a_picture_is_made_from_exists() -> None:
    sources = {source for picture in pictures().values() for source in picture.sources}
    assert [source for source in sorted(sources) if not (ROOT / source).exists()] == []


def test_the_peaks_in_the_pictures_are_those_of_today(tmp_path: Path) -> None:
    """Two curves of the default scene; the half hour shows the same numbers.

    Where they differ: `python docs/make_pictures.py --all`, and the new numbers into docs/tutorials/half_hour.md.
    """
    text = (ROOT / "scenes" / "dummy.toml").read_text().replace("tolerance = 0.01", QUICK)
    text = re.sub(
        r'^"contact.interference" = \[.*\]', f'"contact.interference" = {[*CURVES.values()]}', text, flags=re.M
    )
    (tmp_path / "dummy.toml").write_text(text)
    recorded = read_record()["peaks"]["dummy"]
    half_hour = (ROOT / "docs" / "tutorials" / "half_hour.md").read_text()
    found = run_scene(tmp_path / "dummy.toml", tmp_path / "out", until="respond").curves
    for number, curve in zip(CURVES, found, strict=True):
        frequency, amplitude, *_ = recorded[number]
        assert curve.peak.frequency_hz == pytest.approx(frequency, rel=1e-3)
        assert curve.peak.amplitude_m == pytest.approx(amplitude, rel=1e-3)
        shown = next(line.split() for line in half_hour.splitlines() if line.startswith(f"{number}  "))
        assert float(shown[3]) == pytest.approx(frequency, rel=1e-3)
        assert 1e-6 * float(shown[2]) == pytest.approx(amplitude, rel=2e-3)


def test_what_makes_a_picture_old(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Another value of its scene, other code, another file; no comment."""
    for name in ("docs/images", "docs/drawings", "scenes"):
        shutil.copytree(ROOT / name, tmp_path / name)
    for name, value in (("ROOT", tmp_path), ("IMAGES", tmp_path / "docs" / "images")):
        monkeypatch.setattr(picture_record, name, value)
    monkeypatch.setattr(picture_record, "RECORD", tmp_path / "docs" / "images" / "made_from.json")
    chosen = [pictures()["blade"]]
    scene, code = tmp_path / "scenes" / "dummy.toml", tmp_path / "docs" / "drawings" / "blade.py"
    scene.write_text("# a comment\n" + scene.read_text())
    code.write_text("# a comment\n" + code.read_text())
    assert list(stale(chosen)) == []
    scene.write_text(scene.read_text().replace("chord = 0.036", "chord = 0.030"))
    code.write_text(code.read_text() + "\nMORE = 1\n")
    (tmp_path / "docs" / "images" / "blade.png").write_bytes(b"other")
    assert list(stale(chosen)) == [
        "blade: the file is not the one recorded",
        "blade: docs/drawings has changed since",
        "blade: scenes/dummy.toml has changed since",
    ]


def test_a_picture_of_a_table_follows_the_table(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    before = fingerprint("benchmarks/measured/whole.csv")
    text = (ROOT / "benchmarks" / "measured" / "whole.csv").read_text(encoding="utf-8")
    (tmp_path / "whole.csv").write_text(text.replace("hex20", "hex27", 1), encoding="utf-8")
    monkeypatch.setattr(picture_record, "ROOT", tmp_path)
    assert fingerprint("whole.csv") != before


def test_an_unknown_picture_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        make_pictures.main(["blad"])
    assert ended.value.code == 2
    assert "blad: no picture of this name; known: blade, " in capsys.readouterr().err
