"""The worst motion where a user reads it: table, warning, notes, summary, figures."""

import math
from dataclasses import fields, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest
from pipeline_support import small_scene, write_scene

from pipeline.figures.curve_line import mark_worst
from pipeline.figures.style import styled
from pipeline.report.page import _worst_cards
from pipeline.results.outputs import curve_summary
from pipeline.results.overview import overview_lines, statistics
from pipeline.results.tables import curve_table, opened_warning
from pipeline.results.worst import height_mark, search_notes, worst_cells, worst_warning
from pipeline.scene.reading import read_scene
from pipeline.stages.curve.curve_summary import NO_WORST, CurveSummary
from pipeline.stages.curve.curve_table import table_of
from pipeline.stages.curve.respond import CurveResult

PEAK = 5.73e-6
SEARCHED = "searched: main branch and 1 detached branch; stability; harmonics 0 to 3; {}; not searched: mistuning"


def facts_with(**worst: Any) -> CurveSummary:
    """The summary of a curve with a peak of 5.73 um and this worst motion."""
    values: dict[str, Any] = {}
    for field in fields(CurveSummary):
        kind = str(field.type)
        values[field.name] = {"float": math.nan, "int": 0, "bool": True, "str": ""}.get(kind, ())
    values |= {
        "peak_amplitude_m": PEAK,
        "peak_frequency_hz": 445.6,
        "peak_at_end": False,
        "static_opened": False,
        **NO_WORST,
    }
    return CurveSummary(**values | {f"worst_{name}": value for name, value in worst.items()})


def periodic(amplitude: float, branch: int = 0, said: str = "time integration not needed") -> CurveSummary:
    return facts_with(
        amplitude_m=amplitude,
        frequency_hz=440.0,
        branch=branch,
        motion="periodic",
        searched=SEARCHED.format(said),
    )


@pytest.fixture
def curves(tmp_path: Path) -> list[CurveResult]:
    """As high as the peak; a detached branch far above it; an irregular motion; one that may be higher; none."""
    sweep = {"contact.interference": [1e-5, 2e-5, 3e-5, 4e-5, 5e-5]}
    members = read_scene(write_scene(tmp_path / "s.toml", small_scene(sweep=sweep))).members
    facts = [
        periodic(PEAK),
        periodic(104.3e-6, branch=1),
        replace(
            periodic(8e-6, said="time integration from 1 unstable solution"),
            worst_motion="irregular",
            worst_periods=840,
            worst_followed_hz=(430.0, 440.0, 445.5),
            worst_followed_m=(7e-6, 8e-6, 6e-6),
        ),
        replace(periodic(2e-6), worst_unresolved="not settled within 1000 periods at 300 Hz"),
        facts_with(searched=SEARCHED.format("no time integration"), unresolved="1 unstable part"),
    ]
    return [CurveResult(member, None, None, found, "") for member, found in zip(members, facts, strict=True)]


def test_an_end_of_the_range_is_marked_and_its_inner_peak_named(curves: list[CurveResult]) -> None:
    """85 nm at 600 Hz, where the range ended, stood in a report as the best value."""
    peaks = ({"frequency_hz": 300.0, "amplitude_m": 60e-9},)
    end = replace(periodic(85e-9), worst_frequency_hz=600.0, worst_at_end=True, worst_unresolved="600 Hz is an end")
    end = replace(end, peak_amplitude_m=85e-9, peak_frequency_hz=600.0, peak_at_end=True, peaks=peaks)
    assert worst_cells(end, 1e9) == ("600 (end)", ">= 85", "main")
    (said,) = (note for note in search_notes([replace(curves[0], facts=end)]) if "no peak" in note)
    assert said == (
        "curve 0: 85 nm at 600 Hz, an end of the frequency range, is no peak (the highest inside it: 60 nm at 300 Hz)"
    )
    assert "none inside it" in "".join(search_notes([replace(curves[0], facts=replace(end, peaks=()))]))
    assert not any("no peak" in note for note in search_notes(curves))
    assert height_mark(end) == " (end)"
    row = curve_summary(replace(curves[0], facts=end), Path())
    assert (row["peak_at_end"], row["worst_at_end"]) == (True, True)


def test_best_curve_and_best_value_are_no_end_of_the_range(curves: list[CurveResult], tmp_path: Path) -> None:
    """The lowest number is an end of the range: the highest of the others' lowest ones is best."""
    end = replace(periodic(1e-9), worst_at_end=True, worst_unresolved="an end", peaks=())
    facts = [periodic(5e-6), periodic(3e-6), end]
    listed = [replace(curve, facts=found) for curve, found in zip(curves, facts, strict=False)]
    table = table_of(listed, ["contact.interference"], tmp_path)
    found = statistics(table)
    assert (found["best"]["curve"], found["lower_bounds"]) == (1, 1)
    assert found["keys"]["contact.interference"]["best"]["value"] == 2e-5
    lines = overview_lines(table)[0]
    assert any("1 of them may be higher than found: quantiles are lower bounds" in line for line in lines)
    ends = statistics(table_of([replace(curve, facts=end) for curve in listed], ["contact.interference"], tmp_path))
    assert ends["best"] is None
    assert ends["keys"]["contact.interference"]["best"] is None
    assert ">= 1 nm" in "".join(overview_lines(table_of(listed[2:], ["contact.interference"], tmp_path))[0])


def test_the_static_contact_is_in_the_table_and_a_contact_that_rotation_opens_is_said(
    curves: list[CurveResult],
) -> None:
    """100 um were closed at rest and open at 5000 rev/min, and nobody was told."""
    closed = replace(periodic(PEAK), static_force_n=12.34, static_open_share=0.0, static_lowest_m=1e-6)
    closed = replace(closed, static_highest_m=4e-6)
    opened = replace(closed, static_force_n=0.0, static_open_share=1.0, static_opened=True)
    opened = replace(opened, static_lowest_m=-33e-6, static_highest_m=-33e-6)
    outcome: Any = SimpleNamespace(
        curves=[replace(c, facts=f) for c, f in zip(curves, (closed, opened), strict=False)]
    )
    assert "open" not in [column.header for column in curve_table(outcome).columns]  # no static load
    scene = curves[1].member.scene
    rotating = scene.model_copy(update={"load": scene.load.model_copy(update={"speed_rpm": 5000.0})})
    outcome.curves[1] = replace(outcome.curves[1], member=replace(curves[1].member, scene=rotating))
    table = curve_table(outcome)
    columns = {str(column.header).replace("\n", " "): list(column.cells) for column in table.columns}
    assert (columns["static force [N]"], columns["open"]) == (["12.34", "0"], ["0 %", "100 %"])
    assert columns["static v [µm]"] == ["1 to 4", "-33"]
    said = opened_warning(outcome)
    assert said.startswith("1 of 2 curves: nodes that are closed at rest are open before the blade vibrates")
    assert said.endswith("0 N on a face, 100 % of it open, v = -33 µm (below 0: gap)")
    assert opened_warning(cast(Any, SimpleNamespace(curves=outcome.curves[:1]))) == ""
    row = curve_summary(outcome.curves[1], Path())
    assert (row["static_force_n"], row["static_open_share"], row["static_opened"]) == (0.0, 1.0, True)


def test_too_few_harmonics_and_instability_are_said_beside_the_number(curves: list[CurveResult]) -> None:
    facts = replace(periodic(5e-6), worst_truncation_error=0.24)
    assert worst_cells(facts, 1e6)[1] == "5 (H too small)"
    assert height_mark(facts) == " (H too small: truncation error 24 %)"
    beside = replace(facts, worst_truncation_error=0.01, worst_not_counted="detached branch 1, up to 1.2e-04 m")
    assert worst_cells(beside, 1e6)[1] == "5"
    unstable = replace(periodic(5e-6), worst_unstable=True, worst_unresolved="unstable against nodal diameter 7")
    assert (worst_cells(unstable, 1e6)[1], height_mark(unstable)) == ("5 (unstable)", " (unstable)")
    notes = search_notes([replace(curves[0], facts=beside), replace(curves[1], facts=unstable)])
    assert "curve 1: the worst motion is not known: unstable against nodal diameter 7" in notes
    assert "curve 0: not counted as worst motion: detached branch 1, up to 1.2e-04 m" in notes


def test_a_warning_where_a_motion_is_higher_than_the_main_branch(curves: list[CurveResult]) -> None:
    assert worst_warning(curves[:1]) == ""
    alone = worst_warning(curves[1:2])
    for said in ("104.3 µm", "440 Hz", "detached branch 1", "5.73 µm", "18.2 times"):
        assert said in alone
    together = worst_warning(curves)
    assert together.startswith("2 of 5 curves: ")
    assert "on curve 1 104.3 µm" in together


def test_cells_tell_branch_bound_and_kind(curves: list[CurveResult]) -> None:
    cells = [worst_cells(curve.facts, 1e6) for curve in curves]
    assert cells == [
        ("440", "5.73", "main"),
        ("440", "104.3", "detached 1"),
        ("440", "8", "main*"),
        ("440", ">= 2", "main"),
        ("-", "unknown", "-"),
    ]
    assert worst_cells(None, 1.0) == ("-", "-", "-")


def test_the_table_has_the_worst_motion_first_and_the_main_branch_beside(curves: list[CurveResult]) -> None:
    outcome: Any = SimpleNamespace(curves=[*curves, replace(curves[0], facts=None)])
    table = curve_table(outcome)
    headings = [str(column.header).replace("\n", " ") for column in table.columns]
    assert headings[2:7] == ["worst [Hz]", "worst [µm]", "on branch", "main peak [Hz]", "main peak [µm]"]
    columns = {heading: list(column.cells) for heading, column in zip(headings, table.columns, strict=True)}
    assert columns["worst [µm]"][1] == "104.3"
    assert columns["main peak [µm]"][1] == "5.73"
    assert len({len(cells) for cells in columns.values()}) == 1


def test_notes_say_what_was_searched_and_what_was_left_open(curves: list[CurveResult]) -> None:
    said = "\n".join(search_notes(curves))
    for text in (
        "time integration not needed or time integration from 1 unstable solution or no time integration",
        "not searched: mistuning",
        "* quasi-periodic or irregular",
        "curve 2: the worst motion is irregular, seen for 840 periods",
        "curve 2: the worst motion, on no branch, was followed in frequency from 430 to 445.5 Hz",
        "curve 3: the peak of the main branch is unstable and does not persist",
        "curve 3: the worst motion may be higher: not settled within 1000 periods at 300 Hz",
        "curve 4: the worst motion may be higher: 1 unstable part",
        "response.blade_periods above 10000 lets time integration go on for longer",
    ):
        assert text in said
    assert said.count("searched: main branch and 1 detached branch") == 1
    assert "blade_periods" not in "\n".join(search_notes(curves[4:]))


def test_the_summary_has_the_numbers_or_null(curves: list[CurveResult], tmp_path: Path) -> None:
    found = [curve_summary(curve, tmp_path) for curve in curves]
    assert (found[1]["worst_amplitude_m"], found[1]["worst_branch"]) == (104.3e-6, 1)
    assert (found[2]["worst_motion"], found[2]["worst_periods"]) == ("irregular", 840)
    assert found[2]["worst_followed_hz"] == [430.0, 440.0, 445.5]
    assert found[4]["worst_amplitude_m"] is None
    assert found[4]["worst_motion"] is None
    assert found[4]["worst_unresolved"] == "1 unstable part"
    assert curve_summary(replace(curves[0], facts=None), tmp_path)["worst_searched"] is None


def test_a_worst_motion_is_read_back_as_it_was_written(curves: list[CurveResult]) -> None:
    facts = curves[1].facts
    assert facts is not None
    worst = facts.worst
    assert worst is not None
    assert (worst.amplitude_m, worst.branch, worst.motion) == (104.3e-6, 1, "periodic")
    assert replace(facts, **NO_WORST).worst is None


def test_the_response_figure_marks_worst_motions_that_are_no_peaks() -> None:
    from matplotlib import pyplot as plt

    shown = [
        SimpleNamespace(peak=(445.6, PEAK), worst=worst, label="")
        for worst in ((445.6, PEAK), (440.0, 1e-4), (9.0, 2e-6))
    ]
    with styled():
        figure, axes = plt.subplots()
        mark_worst(axes, cast(Any, shown), ["C0", "C1", "C2"], 1e6)
        places = [(line.get_xdata()[0], line.get_ydata()[0]) for line in axes.get_lines() if len(line.get_xdata())]
        _, labels = axes.get_legend_handles_labels()
        plt.close(figure)
    assert places == [(440.0, pytest.approx(100.0)), (9.0, pytest.approx(2.0))]
    assert labels == ["worst motion"]


def test_sentences_that_differ_in_numbers_only_give_their_range(curves: list[CurveResult]) -> None:
    def searched(text: str) -> CurveResult:
        return replace(curves[0], facts=replace(curves[0].facts, worst_searched=text))

    said = search_notes([searched(f"searched: main branch; harmonics 0 to {most}") for most in (1, 9, 7)])
    assert said[0].endswith("searched: main branch; harmonics 0 to 1...9")


def test_tiles_of_the_report_do_not_praise_a_curve_whose_search_is_open() -> None:
    """The lowest worst motion is one that nothing may exceed; the highest one is a lower bound where any is open."""

    def plotted(height_m: float, is_open: bool) -> Any:
        label = f"curve of {1e6 * height_m:g} um"
        return SimpleNamespace(worst=(100.0, height_m), worst_open=is_open, label=label, parameters={"a": 1}, mark="")

    known, other, unsure = plotted(5e-6, False), plotted(9e-6, False), plotted(1e-6, True)
    tiles = _worst_cards([known, other])
    assert [title for title, _, _ in tiles] == [
        "highest worst motion",
        "lowest worst motion",
        "highest over lowest worst motion",
    ]
    highest, lowest = _worst_cards([known, other, unsure])
    assert highest[1].startswith(">= 9")
    assert lowest[1].startswith("5")
    assert "2 of 3 curves" in lowest[2]
    ((title, value, _),) = _worst_cards([unsure])
    assert (title, value[:2]) == ("worst motion", ">=")
