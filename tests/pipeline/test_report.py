"""The page of `shroud report`: complete, self-contained, and with the numbers of summary.json."""

import base64
import json
import re
import shutil
import subprocess
import sys
from dataclasses import fields, replace
from html.parser import HTMLParser
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import h5py
import numpy as np
import pytest
from pipeline_support import (
    WHOLE,
    changing_when_locked,
    drawing,
    shroud,
    small_scene,
    statuses,
    summary_of,
    write_scene,
)

import pipeline.stages.curve.respond
from geometry import ContactFace, ElementBlock, SectorMesh
from pipeline.bootstrap import TEST_PROGRAMS
from pipeline.report.report_source import ReportSource
from pipeline.report.viewer import outer_surface
from pipeline.scene.reading import read_scene
from pipeline.stages.curve.respond import CurveResult
from pipeline.stages.model.model_chain import BuiltModel
from pipeline.stages.request import StudyOutcome

TITLE = "A < B & C: $x^{$"  # markup to a browser, half a formula to matplotlib
SWEEP = {"contact.interference": [1e-5, 1e-3]}
VOID = {"meta", "link", "img", "input", "br", "rect", "line"}
SWATCH = re.compile(r'<span style="background: [^"]*"></span>')  # of a name in the legend of a chart
POINTER = """<script>(async () => {
const canvas = document.querySelector("#chart-response canvas"), box = canvas.getBoundingClientRect();
const tip = document.querySelector("#chart-response .tip");
for (let y = 20; y < canvas.clientHeight && tip.hidden; y += 20) {  // down the middle until a curve is met
  canvas.dispatchEvent(new PointerEvent("pointermove", { clientX: box.left + box.width / 2, clientY: box.top + y }));
  await new Promise((done) => requestAnimationFrame(done));
}})();</script>"""
CHROMIUM = next(filter(None, map(shutil.which, TEST_PROGRAMS["chromium"])), None)


class Page(HTMLParser):
    """Tags with their attributes, the text of every element with an id, and tags left open."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str]]] = []
        self.open: list[str] = []
        self.inside: dict[str, str] = {}
        self._ids: list[tuple[int, str]] = []
        self.text = text
        self.feed(text)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        values = {name: value or "" for name, value in attrs}
        self.tags.append((tag, values))
        if tag not in VOID:
            self.open.append(tag)
            if "id" in values:
                self._ids.append((len(self.open), values["id"]))
                self.inside[values["id"]] = ""

    def handle_endtag(self, tag: str) -> None:
        if tag not in VOID:
            while self._ids and self._ids[-1][0] >= len(self.open):
                self._ids.pop()
            assert self.open.pop() == tag

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, {name: value or "" for name, value in attrs}))

    def handle_data(self, data: str) -> None:
        for _, name in self._ids:
            self.inside[name] += data


@pytest.fixture(scope="module")
def reported(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run with all that is found out unasked, and its report; while it runs the scene file becomes another one."""
    out = tmp_path_factory.mktemp("reported") / "out"
    scene = write_scene(out.parent / "small.toml", small_scene(sweep=SWEEP, title=TITLE, **WHOLE))
    text = scene.read_text()
    with drawing(), changing_when_locked(lambda: scene.write_text("title = 'another'\n")):
        status, _, error = shroud("report", scene, "--out", out, "--quiet")
    assert (status, error) == (0, "")
    scene.write_text(text)
    return out


@pytest.fixture(scope="module")
def page(reported: Path) -> Page:
    return Page((reported / "report.html").read_text(encoding="utf-8"))


def test_the_page_stands_alone(page: Page) -> None:
    assert page.open == []
    ids = [values["id"] for _, values in page.tags if "id" in values]
    assert len(ids) == len(set(ids))
    images = [values for tag, values in page.tags if tag == "img"]
    assert len(images) >= 7
    assert all(values["src"].startswith("data:image/") and values["alt"] for values in images)
    for _, values in page.tags:
        for name in ("src", "href", "action", "data", "poster", "srcset", "xlink:href"):
            target = values.get(name, "#")
            assert target.startswith(("data:", "#"))
            assert not target.startswith("#") or target == "#" or target[1:] in ids
    outside = re.sub(r"base64,[A-Za-z0-9+/=]+", "", page.text)
    assert not re.search(r"https?://|@import|url\(|fetch\(|XMLHttpRequest", outside)
    assert {"response", "blade", "frequencies", "contact", "errors", "run"} <= set(ids)
    assert len(page.text) < 6_000_000


def test_every_curve_is_there_with_the_numbers_of_the_summary(page: Page, reported: Path) -> None:
    summary = summary_of(reported)
    rows: dict[int, dict[str, str]] = {}
    for tag, values in page.tags:
        if tag == "tr" and "data-curve" in values:
            rows[int(values["data-curve"])] = {}
        if tag == "td" and "data-name" in values:
            rows[max(rows)][values["data-name"]] = values["data-value"]
    assert list(rows) == list(range(len(summary["curves"])))
    names = {
        "frequency": "peak_frequency_hz",
        "amplitude": "peak_amplitude_m",
        "worst_frequency": "worst_frequency_hz",
        "worst_amplitude": "worst_amplitude_m",
        "harmonics": "harmonics",
        "truncation": "truncation_error",
        "energy": "energy_error",
        "points": "points",
        "seconds": "seconds",
    }
    for number, curve in enumerate(summary["curves"]):
        for name, key in names.items():
            assert float(rows[number][name]) == curve[key]
        sampling = curve["sampling_error"], curve["sampling_frequency_error"]
        assert 0.0 < float(rows[number]["sampling"]) == max(sampling)
        assert f"v0 = {curve['parameters']['contact.interference'] * 1e6:.6g} µm" in page.inside["contact"]
    model = summary["models"][0]
    for value in [*model["free_hz"][:6], *model["stuck_hz"]["36"][:6]]:
        assert f'data-value="{value!r}"' in page.text
    assert str(model["dofs"]) in page.inside["blade"]


def source_of(tmp_path: Path, **changes: Any) -> ReportSource:
    """The source of a page without files; `changes` are values of the scene."""
    file = read_scene(write_scene(tmp_path / "small.toml", small_scene(**changes)))
    curve = CurveResult(file.members[0], None, Path("store/curve/one/curve.h5"), None, "range covered")
    case: Any = SimpleNamespace(label="case")
    errors: Any = 0.1
    return ReportSource(
        out=tmp_path,
        scene_file=Path("small.toml"),
        scene_text="text",
        swept=(),
        curves=[curve],
        models={0: BuiltModel("model", Path("rom.h5"), None, {})},
        model_rows=[{"dofs": 1}],
        campbell=[],
        pictures={"figures/response.svg": b"<svg/>"},
        stress=[{"curve": 0}],
        studies={"optimum": StudyOutcome("optimum", "key", None, (), "optimum.json", 1.0)},
        verified=[(case, errors)],
        costs={"mesh": 1.0},
        results={"mesh": 1},
        problems=[],
        results_key="results",
    )


def test_the_key_of_the_page_changes_with_all_that_it_shows(tmp_path: Path) -> None:
    source = source_of(tmp_path)
    (curve,), (case, _) = source.curves, source.verified[0]
    errors: Any = 0.2
    changes: dict[str, Any] = {
        "scene_file": Path("other.toml"),
        "scene_text": "other",
        "swept": ("contact.friction",),
        "curves": [replace(curve, reason="step too small")],
        "models": {0: BuiltModel("other", Path("rom.h5"), None, {})},
        "model_rows": [{"dofs": 2}],
        "campbell": [{"mode": 1}],
        "stress": [],
        "studies": {},
        "pictures": {"figures/response.svg": b"<svg></svg>"},
        "verified": [(case, errors)],
        "costs": {"mesh": 2.0},
        "results": {"mesh": 2},
        "problems": ["none"],
        "results_key": "other",
    }
    assert {"out"} | set(changes) == {field.name for field in fields(ReportSource)}
    others = [replace(source, **{name: value}) for name, value in changes.items()]
    others += [
        replace(source, curves=[replace(curve, file=Path("store/curve/two/curve.h5"))]),
        replace(source, curves=[replace(curve, file=None)]),
        replace(source, curves=[replace(curve, member=replace(curve.member, parameters={"contact.friction": 0.1}))]),
        replace(source, pictures={"figures/peaks.svg": b"<svg/>"}),
        source_of(tmp_path, title="another"),
        source_of(tmp_path, contact__friction=0.11),
    ]
    assert len({other.key() for other in (source, *others)}) == len(others) + 1
    assert source_of(tmp_path).key() == source.key()


def test_text_of_the_scene_is_shown_and_never_taken_for_markup(page: Page, reported: Path) -> None:
    assert TITLE in page.inside["run"]
    assert "<h1>A &lt; B &amp; C: $x^{$</h1>" in page.text
    for name in ("response", "peaks", "hysteresis", "hysteresis_sweep", "nodal_diameters"):
        assert "A &lt; B &amp; C: $x^{$" in (reported / "figures" / f"{name}.svg").read_text(encoding="utf-8")
    assert (reported.parent / "small.toml").read_text() == page.inside["run"][
        page.inside["run"].index('"name"') :
    ].rstrip("\n") + "\n"


def test_contact_work_is_that_of_the_solver(page: Page, reported: Path) -> None:
    said = re.findall(r"in total\s+([0-9.e+-]+) (\wJ|J)\.", page.inside["contact"])
    factors = {"J": 1.0, "mJ": 1e3, "µJ": 1e6, "nJ": 1e9}
    with h5py.File(reported / "response.h5") as file:
        for (number, unit), name in zip(said, sorted(file["curve"]), strict=True):
            curve = file[f"curve/{name}"]
            exact = curve["dissipated_j"][curve.attrs["peak_index"]]
            assert float(number) / factors[unit] == pytest.approx(exact, rel=0.02, abs=1e-15)  # 64 samples
    shares = [int(share) for share in re.findall(r"(?:stick|slip|separation) (\d+) %", page.inside["contact"])]
    assert all(99 <= sum(shares[k : k + 3]) <= 101 for k in range(0, 6, 3))


def test_the_viewer_has_a_closed_surface_and_the_shapes_of_the_run(page: Page, reported: Path) -> None:
    data: dict[str, Any] = json.loads(page.inside["viewer-data"])
    (surface,) = data["surfaces"]
    points = decoded(surface["points"], "<f4").reshape(-1, 3).astype(float)
    triangles = decoded(surface["triangles"], "<u2").reshape(-1, 3).astype(int)
    directed = np.concatenate([triangles[:, [k, (k + 1) % 3]] for k in range(3)])
    assert {tuple(edge) for edge in directed} == {tuple(edge[::-1]) for edge in directed}
    corners = points[triangles]
    assert np.einsum("ij,ij->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) > 0.0
    names = [shape["name"].split(",")[0] for shape in data["shapes"]]
    assert names[0] == "mode 1 (1F)"  # a cantilever as thin as this bends first
    assert all(re.fullmatch(r"mode [123] \([1-3][FETR]\)", name) for name in names[:6])
    assert names[6:] == ["v0 = 10 µm", "v0 = 1000 µm"]
    tip = np.argmin(np.linalg.norm(points - [0.0, 0.0, points[:, 2].max()], axis=1))
    last = data["shapes"][-1]
    first = next(row for row in last["harmonics"] if row["order"] == 1)
    moved = [decoded(first[part], "<i2").reshape(-1, 3)[tip, 1] * first["step"] for part in ("re", "im")]
    with h5py.File(reported / "response.h5") as file:
        exact = file["curve/1/output"][file["curve/1"].attrs["peak_index"]][1]
    assert abs(complex(*moved) - exact) < 1e-3 * abs(exact)


def decoded(text: str, kind: str) -> Any:
    return np.frombuffer(base64.b64decode(text), dtype=kind)


def test_an_unchanged_report_is_not_made_again_and_a_run_makes_none(reported: Path) -> None:
    scene = reported.parent / "small.toml"
    before = (reported / "report.html").stat().st_mtime_ns
    assert shroud("run", scene, "--until", "report", "--out", reported, "--quiet")[0] == 0
    assert statuses(reported)["report"] == "reused"
    assert (reported / "report.html").stat().st_mtime_ns == before
    assert shroud("run", scene, "--out", reported, "--quiet")[0] == 0
    assert statuses(reported)["report"] == "skipped"
    (reported / "report.html").write_text("spoilt")
    status, said, _ = shroud("report", scene, "--out", reported)
    assert (status, statuses(reported)["report"]) == (0, "reused")
    assert said.rstrip().endswith(f"results in {reported}, report.html")
    assert summary_of(reported)["report"] == "report.html"
    assert (reported / "report.html").stat().st_size > 100_000


def test_errors_that_were_measured_are_told(reported: Path) -> None:
    scene, out = reported.parent / "small.toml", reported
    before = Page((out / "report.html").read_text(encoding="utf-8")).inside["errors"]
    assert before.count("not measured; run: shroud verify small.toml") == 2
    assert re.search(
        r"modal truncation error\s*(< )?[0-9.]+ % of a frequency, (< )?[0-9.]+ % of a receptance", before
    )
    assert re.search(r"mesh error\s*not measured", before)
    assert re.search(r"contact dofs\s*not measured", before)
    assert shroud("verify", scene, "--out", out, "--quiet")[0] == 0
    assert shroud("report", scene, "--out", out, "--quiet")[0] == 0
    assert statuses(out)["report"] == "ran"
    after = Page((out / "report.html").read_text(encoding="utf-8")).inside["errors"]
    assert "not measured" not in after
    assert re.search(r"mesh error\s*[0-9.]+ % of a frequency\s*large", after)
    assert re.search(r"contact dofs\s*(< )?[0-9.]+ % of a frequency\s*small", after)


@pytest.mark.skipif(CHROMIUM is None, reason="no chromium here")
def test_a_browser_opens_the_page_without_a_complaint(reported: Path, tmp_path: Path) -> None:
    assert CHROMIUM is not None
    options = ["--headless", "--no-sandbox", "--disable-dev-shm-usage", "--use-angle=swiftshader"]
    options += ["--enable-unsafe-swiftshader", "--enable-logging=stderr", "--v=0", "--virtual-time-budget=2000"]
    pointed = tmp_path / "pointed.html"
    pointed.write_text((reported / "report.html").read_text(encoding="utf-8").replace("</body>", f"{POINTER}</body>"))
    options += [f"--user-data-dir={tmp_path}", "--dump-dom", pointed.as_uri()]
    done = subprocess.run([CHROMIUM, *options], capture_output=True, text=True, timeout=120, check=True)
    assert "CONSOLE" not in done.stderr
    seen = Page(done.stdout)
    hidden = {
        values["id"]: "hidden" in values for _, values in seen.tags if values.get("id", "").startswith("viewer")
    }
    charts = {
        values["id"]: "hidden" in values for _, values in seen.tags if values.get("id", "").startswith("chart-")
    }
    assert not charts["chart-response"]  # the charts are drawn, with a name for each curve
    assert not charts["chart-peaks"]
    assert {"v0 = 10 µm", "v0 = 1000 µm"} <= {
        seen.text[m.end() : m.end() + 12].partition("<")[0] for m in SWATCH.finditer(seen.text)
    }
    assert hidden["viewer"] != hidden["viewer-still"]  # one of the two, whether there is WebGL or not
    if not hidden["viewer"]:
        assert seen.inside["viewer-said"].startswith("mode 1 (1F), shrouds free")


def test_a_fine_surface_is_thinned_out_with_its_corners_where_they_were() -> None:
    n = 12
    points = np.stack(np.meshgrid(*[np.linspace(0.0, 1.0, n + 1)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    number = np.arange((n + 1) ** 3).reshape((n + 1,) * 3)
    base = number[:-1, :-1, :-1].ravel()
    steps = [number[i, j, k] for i, j, k in ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0))]
    corners = [*steps, *(step + number[0, 0, 1] for step in steps)]
    hexahedra = base[:, None] + np.array(corners)
    face = ContactFace(np.array([0, 1]), points[:2], np.tile(np.eye(3), (2, 1, 1)), np.ones(2))
    cube = SectorMesh(points, (ElementBlock("hex8", hexahedra),), {}, face, face, 3)
    whole, thin = outer_surface(cube), outer_surface(cube, most=500)
    assert len(whole.triangles) == 12 * n**2
    assert 100 < len(thin.triangles) <= 500
    assert len(whole.edges) == 3 * 6 * n**2 - 6 * n**2
    for surface in (whole, thin):
        at = points[surface.vertices]
        seen = at[np.unique(surface.triangles)]
        for corner in np.array(np.meshgrid(*[[0.0, 1.0]] * 3)).T.reshape(-1, 3):
            assert np.any(np.all(seen == corner, axis=1))
        triangles = at[surface.triangles]
        volume = np.einsum("ij,ij->", triangles[:, 0], np.cross(triangles[:, 1], triangles[:, 2])) / 6.0
        assert volume == pytest.approx(1.0, abs=1e-12)
        assert np.array_equal(surface.vertices[surface.right], face.nodes)
        on_edges = np.sum((at[surface.sharp] == 0.0) | (at[surface.sharp] == 1.0), axis=2)
        assert np.all(on_edges >= 2)


def test_a_run_that_failed_in_parts_says_so_on_its_page(copied: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    crashing = copied.parent / "python"
    crashing.write_text("#!/bin/sh\nkill -SEGV $$\n")
    crashing.chmod(0o755)

    def fail(*_: Any, **__: Any) -> None:
        raise ArithmeticError("nothing <came> of it")

    monkeypatch.setattr(sys, "executable", str(crashing))  # the drawing process
    monkeypatch.setattr(pipeline.stages.curve.respond, "solve_curve", fail)
    changes: dict[str, Any] = {"render": {"modes": [1]}, "sweep": {"contact.interference": [1e-5, 2e-3]}}
    scene = write_scene(copied.parent / "s.toml", small_scene(**changes))
    status, _, error = shroud("report", scene, "--out", copied, "--quiet")
    assert status == 1
    assert "nothing <came> of it" in error
    page = Page((copied / "report.html").read_text(encoding="utf-8"))
    assert "the drawing process crashed (SIGSEGV)" in page.inside["problems"]
    assert "failed: nothing <came> of it" in page.inside["response"]
    assert [values["data-curve"] for tag, values in page.tags if "data-curve" in values] == ["0", "1"]


def test_a_picture_that_fails_takes_no_other_one_with_it(copied: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: Any, **__: Any) -> None:
        raise MemoryError

    scene = write_scene(copied.parent / "s.toml", small_scene(sweep=SWEEP, title="fails in parts"))
    with monkeypatch.context() as failing:
        failing.setattr("pipeline.figures.peaks.trend_figure", fail)
        failing.setattr("pipeline.report.page.loops_drawing", fail)
        failing.setattr("pipeline.report.page.ring_drawing", fail)
        status, _, error = shroud("report", scene, "--out", copied, "--quiet")
    assert status == 1
    told = [line.partition(": out of memory; fewer jobs")[0] for line in error.splitlines()]
    assert told == ["figures: peaks", "report: loops of curve 0", "report: loops of curve 1", "report: ring"]
    left = {path.stem for path in (copied / "figures").iterdir()}
    assert left == {"response", "hysteresis", "hysteresis_sweep", "nodal_diameters"}
    assert [f"{line}: out" for line in told] == [p.partition(" of memory")[0] for p in summary_of(copied)["problems"]]
    page = Page((copied / "report.html").read_text(encoding="utf-8"))
    assert "figures: peaks: out of memory" in page.inside["problems"]
    assert [values["data-curve"] for tag, values in page.tags if "data-curve" in values] == ["0", "1"]

    assert shroud("run", scene, "--out", copied, "--quiet") == (0, "", "")  # what failed is tried again
    assert (copied / "figures" / "peaks.png").is_file()
