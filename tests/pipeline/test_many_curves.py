"""Results of many curves: opened without their points, as tables and labelled arrays, and said in a few lines."""

import csv
import json
import pickle
import sys
from dataclasses import replace
from io import StringIO
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from pipeline_support import ground_scene, shroud, write_ground_model, write_scene
from rich.console import Console

from nonlinear import BifurcationKind
from pipeline import InputError, Results, read_results
from pipeline.results.outputs import write_results
from pipeline.results.overview import abbreviated, key_table, overview_lines, quantile_table, statistics
from pipeline.results.run_folder import PointReader, provenance
from pipeline.scene.reading import Member, SceneFile, read_scene
from pipeline.scene.sweep import grid_values
from pipeline.stages.curve.curve_table import TABLE, CurveTable, table_of
from pipeline.stages.curve.respond import CurveJob, CurveResult, result_from_file
from pipeline.store.content_store import Store
from pipeline.terminal import print_outcome

FRICTION, GAP, PRELOAD, FORM = "contact.friction", "contact.interference", "contact.preload", "damper.form"
SWEEP = {FRICTION: [0.1, 0.2, 0.4], GAP: [0.0, 0.1]}
MANY = 50


@pytest.fixture(scope="module")
def ran(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of six curves."""
    folder = tmp_path_factory.mktemp("ran")
    scene = write_scene(folder / "s.toml", ground_scene(preload=0.0) | {"sweep": SWEEP})
    rom = write_ground_model(folder / "g.h5")
    assert shroud("respond", scene, "--rom", rom, "--out", folder / "out", "--quiet")[0] == 0
    return folder


@pytest.fixture(scope="module")
def file(ran: Path) -> SceneFile:
    return read_scene(ran / "s.toml", given_model=True)


def copies(ran: Path, file: SceneFile, parameters: list[dict[str, Any]]) -> list[CurveResult]:
    """One stored curve under many swept values, as high as its number."""
    path = sorted((ran / "out" / "store" / "curve").glob("*/curve.h5"))[0]
    first = result_from_file(CurveJob(file.members[0], "key", ran / "g.h5"), path)
    assert first.facts is not None
    found = []
    for number, values in enumerate(parameters):
        facts = replace(first.facts, peak_amplitude_m=1e-6 * number, worst_amplitude_m=2e-6 * number)
        found.append(replace(first, member=Member(number, file.first, values), facts=facts, rom=None))
    return found


def written(out: Path, file: SceneFile, curves: list[CurveResult]) -> Results:
    """Publish curves as a run does, without the curves in summary.json, and read them."""
    table = table_of(curves, tuple(curves[0].member.parameters), out)
    summary = {"complete": True, "problems": [], "curves": None, "table_hash": table.fingerprint()}
    write_results(Store(out / "store"), out, curves, table, summary, provenance(file))
    return read_results(out)


@pytest.fixture(scope="module")
def many(ran: Path, file: SceneFile, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Many curves, without a list of them in summary.json."""
    folder = tmp_path_factory.mktemp("many")
    written(folder, file, copies(ran, file, [{FRICTION: 1e-3 * n} for n in range(MANY)]))
    return folder


def test_many_curves_are_opened_without_their_points(many: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    results = read_results(many)
    touched: list[int] = []
    curve = PointReader.curve
    monkeypatch.setattr(PointReader, "curve", lambda self, n: touched.append(n) or curve(self, n))
    frame = results.to_dataframe()
    assert len(results.curves) == len(frame) == MANY
    assert list(frame["worst_amplitude_m"]) == [2e-6 * n for n in range(MANY)]
    assert [c.peak.amplitude_m for c in results.curves if c.peak] == [1e-6 * n for n in range(MANY)]
    assert touched == []
    assert results.curves[MANY - 1].frequency_hz.size == frame["points"].iloc[-1]
    assert touched == [MANY - 1]


def test_writing_holds_one_curve_at_a_time(ran: Path, file: SceneFile, tmp_path: Path) -> None:
    """Time and memory grow as the number of curves: each file is opened twice, for both formats, and closed again."""
    curves = copies(ran, file, [{FRICTION: 1e-3 * n} for n in range(30)])
    opened: list[str] = []
    before = h5py.File.__init__

    def counted(self: h5py.File, name: Any, *args: Any, **kwargs: Any) -> None:
        opened.append(str(name))
        before(self, name, *args, **kwargs)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(h5py.File, "__init__", counted)
        written(tmp_path, file, curves)
    assert opened.count(str(curves[0].file)) == 2 * len(curves)


def test_a_table_holds_what_the_groups_hold(ran: Path) -> None:
    with h5py.File(ran / "out" / "response.h5") as stored:
        table = stored[TABLE]
        for number in range(6):
            attributes = stored[f"curve/{number}"].attrs
            for name in ("peak_amplitude_m", "worst_frequency_hz", "points", "complete", "harmonics"):
                assert table[name][number] == attributes[name]
            assert table["reason"].asstr()[number] == attributes["reason"]
            assert table[f"parameters/{FRICTION}"][number] == attributes[FRICTION]


def test_tables_hold_every_curve_and_every_point(ran: Path) -> None:
    results = read_results(ran / "out")
    frame, points = results.to_dataframe(), results.to_dataframe(points=True)
    with (ran / "out" / "curves.csv").open() as text:
        rows = list(csv.DictReader(text))
    assert list(rows[0]) == list(frame)
    assert list(frame)[:3] == ["curve", FRICTION, f"{GAP}_m"]
    for name in ("curve", FRICTION, f"{GAP}_m", "peak_amplitude_m", "points"):
        np.testing.assert_array_equal([float(row[name]) for row in rows], frame[name])
    with (ran / "out" / "response.csv").open() as text:
        lines = list(csv.DictReader(text))
    assert list(lines[0]) == list(points)
    assert len(lines) == len(points) == frame["points"].sum() + sum(b.frequency_hz.size for b in branches(results))
    for name in ("curve", GAP + "_m", "amplitude_m", "growth_rate_per_s", "branch"):
        np.testing.assert_array_equal([float(line[name]) for line in lines], points[name])


def branches(results: Results) -> list[Any]:
    return [branch for curve in results.curves for branch in curve.detached]


def test_a_grid_is_labelled_by_its_keys(ran: Path) -> None:
    results = read_results(ran / "out")
    found = results.to_xarray()
    assert dict(found.sizes) == {FRICTION: 3, GAP: 2}
    assert found[GAP].attrs["units"] == found["peak_amplitude_m"].attrs["units"] == "m"
    assert "units" not in found[FRICTION].attrs
    for curve in results.curves:
        at = found.sel(curve.parameters)
        assert curve.peak is not None
        assert float(at["peak_amplitude_m"]) == curve.peak.amplitude_m
        assert int(at["curve"]) == curve.number


def test_points_are_labelled_by_their_curve(ran: Path, file: SceneFile, tmp_path: Path) -> None:
    parameters = [{FRICTION: 0.1, GAP: [0.0, 1.0]}, {FRICTION: 0.2, GAP: 1e-6}, {FRICTION: 0.4, GAP: 0}]
    results = written(tmp_path, file, copies(ran, file, parameters))
    found = results.to_xarray()
    assert dict(found.sizes) == {"curve": 3}
    assert found[FRICTION].dims == ("curve",)
    assert [curve.parameters for curve in results.curves] == parameters
    assert list(results.to_dataframe()[f"{GAP}_m"]) == ["[0.0, 1.0]", 1e-6, 0]


@pytest.mark.parametrize(
    ("parameters", "expected"),
    [
        ({"a": [1, 1, 2, 2], "b": [3, 4, 3, 4]}, {"a": [1, 2], "b": [3, 4]}),
        ({"a": [2, 1, 1, 2], "b": [3, 3, 4, 4]}, {"a": [2, 1], "b": [3, 4]}),
        ({"a": [1, 1, 2, 2], "b": [3, 4, 3, 3]}, None),
        ({"a": [1, 2, 2], "b": [3, 4, 3]}, None),
        ({"a": [1, 2, 2]}, None),
        ({}, None),
    ],
)
def test_what_is_a_grid(parameters: dict[str, list[Any]], expected: dict[str, list[Any]] | None) -> None:
    assert grid_values(parameters) == expected


def test_results_are_one_line(many: Path) -> None:
    results = read_results(many)
    for each in (results, results.curves, results.curves[3], results.curves[3].datasets):
        assert "\n" not in repr(each)
        assert len(repr(each)) < 400
    assert f"{MANY} curves over friction coefficient" in repr(results)
    page = results._repr_html_()
    assert page.count("<tr>") == 11
    assert f"and {MANY - 10} more" in page


def test_results_go_to_other_processes(ran: Path) -> None:
    results = read_results(ran / "out")
    np.testing.assert_array_equal(results.curves[1].amplitude_m, results.curves[1].datasets["amplitude_m"])
    for each in (results, results.curves[1]):
        other = pickle.loads(pickle.dumps(each))
        curve = other.curves[1] if isinstance(each, Results) else other
        np.testing.assert_array_equal(curve.amplitude_m, results.curves[1].amplitude_m)


def test_points_stay_those_of_the_summary_when_a_run_replaces_the_file(ran: Path, tmp_path: Path) -> None:
    for name in ("summary.json", "response.h5"):
        (tmp_path / name).write_bytes((ran / "out" / name).read_bytes())
    results = read_results(tmp_path)
    (tmp_path / "new").write_bytes(b"another run")
    (tmp_path / "new").replace(tmp_path / "response.h5")
    np.testing.assert_array_equal(results.curves[2].amplitude_m, read_results(ran / "out").curves[2].amplitude_m)


def test_curves_carry_their_bifurcations(ran: Path, file: SceneFile, tmp_path: Path) -> None:
    (curve,) = copies(ran, file, [{FRICTION: 0.1}])
    assert curve.facts is not None
    fold = {"kind": "fold", "frequency_hz": 0.2, "amplitude_m": 1e-3, "index": 3, "nodal_diameter": 0}
    results = written(tmp_path, file, [replace(curve, facts=replace(curve.facts, bifurcations=(fold,)))])
    (found,) = results.curves[0].bifurcations
    assert (found.kind, found.frequency_hz, found.index) == (BifurcationKind.FOLD, 0.2, 3)
    assert results.to_dataframe()["bifurcations"].tolist() == [1]


def test_a_missing_package_is_named(ran: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    results = read_results(ran / "out")
    for name, ask in (("pandas", results.to_dataframe), ("xarray", results.to_xarray)):
        monkeypatch.setitem(sys.modules, name, None)
        with pytest.raises(InputError, match=rf"the package {name} is missing: pip install 'shroud\[tables\]'"):
            ask()


def test_statistics_of_known_heights(ran: Path, file: SceneFile, tmp_path: Path) -> None:
    parameters = [{PRELOAD: 0.1 * (n % 10), FORM: "wedge" if n < 50 else "cylinder"} for n in range(101)]
    found = statistics(table(ran, file, parameters, tmp_path))
    assert (found["curves"], found["best"]["curve"], found["worst"]["curve"]) == (101, 0, 100)
    assert found["quantiles"]["worst_amplitude_m"] == pytest.approx([2e-4 * q for q in found["levels"]])
    assert found["keys"][FORM]["best"] == {"value": "wedge", "median_m": pytest.approx(49e-6), "highest_m": 98e-6}
    assert found["keys"][PRELOAD]["worst"]["value"] == 0.0
    assert found["keys"][PRELOAD]["best"]["value"] == 0.1
    json.dumps(found, allow_nan=False)


def test_ranges_in_place_of_many_values(ran: Path, file: SceneFile, tmp_path: Path) -> None:
    found = statistics(table(ran, file, [{PRELOAD: 0.01 * n} for n in range(100)], tmp_path))["keys"][PRELOAD]
    assert found["best"]["value"] == pytest.approx([0.0, 0.19])
    assert found["worst"]["value"] == pytest.approx([0.8, 0.99])
    assert found["best"]["highest_m"] == pytest.approx(38e-6)


def table(ran: Path, file: SceneFile, parameters: list[dict[str, Any]], out: Path) -> CurveTable:
    return table_of(copies(ran, file, parameters), tuple(parameters[0]), out)


def test_many_curves_are_a_few_lines(
    ran: Path, file: SceneFile, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from pipeline.stages.request import Request, RunOutcome

    curves = copies(ran, file, [{FRICTION: 1e-3 * n} for n in range(500)])
    outcome = RunOutcome(curves=curves, table=table_of(curves, (FRICTION,), tmp_path))
    print_outcome(Request(file, tmp_path), outcome, quiet=False, as_json=False)
    said = capsys.readouterr().out
    assert len(said.splitlines()) < 50
    for text in ("500 curves, 500 complete", "highest: 998 µm", "curve 499 (friction coefficient 0.499)", "95 %"):
        assert text in said


def test_eight_curves_are_fifteen_lines_with_the_numbers_of_the_summary(
    ran: Path, file: SceneFile, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from pipeline.results.outputs import curve_summary
    from pipeline.stages.request import Request, RunOutcome

    curves = copies(ran, file, [{GAP: 1e-5 * (n - 2)} for n in range(8)])
    subject = {"title": "Ground", "n_blades": None, "engine_order": 0, "nodal_diameter": None, "force_n": 0.5}
    subject |= {"at_tip": True, "speed_rpm": 0.0, "shroud_angle": 70.0, "friction": 0.4, "frequency_hz": [0.1, 0.3]}
    linear = {"engine_order": 0, "mode": 1, "name": "1F", "free_hz": [0.11, 0.11], "stuck_hz": [0.2, 0.25]}
    outcome = RunOutcome(curves=curves, summary={"subject": subject, "linear": [linear], "models": []})
    print_outcome(Request(file, tmp_path), outcome, quiet=False, as_json=False)
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) <= 15
    assert max(map(len, lines)) <= 120 + len(str(tmp_path))
    assert lines[0] == "Ground: EO 0, 0.5 N at the tip, 0 rev/min, shroud 70°, friction 0.4"
    assert lines[1] == "mode 1 (1F): 0.11 Hz free, 0.2 to 0.25 Hz stuck; both inside the range 0.1 to 0.3 Hz"
    assert "worst [µm]" in lines[2]
    for number, (curve, line) in enumerate(zip(curves, lines[3:11], strict=True)):
        values = curve_summary(curve, tmp_path)
        cells = line.replace(">= ", "").split()
        assert cells[:2] == [str(number), f"{10 * (number - 2)}"]
        assert float(cells[2]) == pytest.approx(1e6 * values["worst_amplitude_m"], rel=1e-3)
        assert float(cells[3]) == pytest.approx(values["worst_frequency_hz"], rel=1e-3)


def test_info_on_many_curves(ran: Path, file: SceneFile, tmp_path: Path) -> None:
    written(tmp_path, file, copies(ran, file, [{FRICTION: 1e-3 * n} for n in range(100)]))
    status, said, _ = shroud("info", tmp_path / "response.h5")
    assert status == 0
    assert "highest: 198 µm at" in said
    assert "... 100 curves: --json, or curves.csv beside the file" in said
    assert len(said.splitlines()) < 60
    found = json.loads(shroud("info", tmp_path / "response.h5", "--json")[1])
    assert [curve["parameters"][FRICTION] for curve in found["curves"]] == [1e-3 * n for n in range(100)]


def test_info_and_export_of_a_folder_that_does_not_list_its_curves(many: Path, tmp_path: Path) -> None:
    status, said, error = shroud("info", many)
    assert (status, error) == (0, "")
    assert said.startswith(f"{many}: run, complete; reduced models: 0; curves: {MANY}\n")
    assert json.loads(shroud("info", many, "--json")[1])["kind"] == "run"
    assert shroud("export", many, "--to", tmp_path / "r.mat", "--quiet") == (0, "", "")


def test_a_run_without_curves_has_no_results_to_compare(tmp_path: Path) -> None:
    (tmp_path / "summary.json").write_text('{"complete": true, "problems": [], "curves": [], "response": null}')
    results = read_results(tmp_path)
    assert len(results.curves) == len(results.to_dataframe()) == len(results.to_xarray()) == 0
    assert results._repr_html_() == f"<b>{tmp_path}</b>: 0 curves"


def test_tables_keep_their_units(ran: Path, file: SceneFile, tmp_path: Path) -> None:
    lines, found = overview_lines(table(ran, file, [{GAP: 1e-6 * n} for n in range(60)], tmp_path))
    console = Console(width=150, file=(text := StringIO()))
    console.print(quantile_table(found), key_table(found))
    assert "worst motion [µm]" in text.getvalue()
    assert "0 to 11 µm" in text.getvalue()
    assert lines[1].startswith("lowest: 0 ")


def test_notes_on_single_curves_are_few() -> None:
    notes = ["all", *(f"Curve {n}: detached" for n in range(1000)), "end"]
    found = abbreviated(notes)
    assert found[:2] == ["all", "Curve 0: detached"]
    assert (len(found), found[-2]) == (43, "end")
    assert found[-1].startswith("960 more lines")
    assert abbreviated(notes[:5]) == notes[:5]


def test_results_say_where_they_come_from(ran: Path) -> None:
    summary = json.loads((ran / "out" / "summary.json").read_text())
    origin = summary["provenance"]
    assert origin["scene"] == (ran / "s.toml").read_text()
    assert origin["scene_file"] == "s.toml"
    assert origin["program"].startswith("shroud ")
    assert origin["host"]
    with h5py.File(ran / "out" / "response.h5") as stored:
        attributes = dict(stored.attrs)
    assert {name: attributes[name] for name in origin if name != "date"} == {
        k: v for k, v in origin.items() if k != "date"
    }
    assert attributes["date"] <= origin["date"]
