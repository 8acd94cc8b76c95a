"""The worst motion where a user reads it: screen, `shroud info`, summary, figures, report."""

import math
from dataclasses import fields, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest
from pipeline_support import small_scene, write_scene

from pipeline.figures.curve_line import mark_worst
from pipeline.figures.data import SweepPoint
from pipeline.figures.style import styled
from pipeline.report.page import _worst_cards
from pipeline.results.certainty import error_sentences, open_sentences, search_sentences
from pipeline.results.conclusion import (
    ShownCurve,
    conclusion_table,
    lowest_line,
    modes_line,
    open_lines,
    table_lines,
    technical_table,
)
from pipeline.results.outputs import curve_summary
from pipeline.results.overview import overview_lines, statistics
from pipeline.results.worst import height_mark, worst_cells
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
            worst_recurrence=2.5,
            worst_followed_hz=(430.0, 440.0, 445.5),
            worst_followed_m=(7e-6, 8e-6, 6e-6),
        ),
        replace(
            periodic(2e-6),
            worst_unresolved="motions up to 3 µm at 300 Hz were not seen to persist",
            worst_open_kinds=("effort",),
        ),
        facts_with(searched=SEARCHED.format("no time integration"), unresolved="1 unstable part"),
    ]
    return [CurveResult(member, None, None, found, "") for member, found in zip(members, facts, strict=True)]


def shown(curves: list[CurveResult], **more: Any) -> list[ShownCurve]:
    """The curves as the screen shows them."""
    return [
        ShownCurve(number, curve.member.parameters, curve.facts, curve.reason, "slipping", 1e-3, **more)
        for number, curve in enumerate(curves)
    ]


def facts_of(curves: list[CurveResult]) -> dict[int, CurveSummary]:
    return {number: curve.facts for number, curve in enumerate(curves) if curve.facts is not None}


def screen(curves: list[CurveResult], static: bool = False) -> list[str]:
    """The lines of the table at the end of a run, without those of its headings."""
    found = shown(curves)
    return table_lines(conclusion_table(found, range(len(found)), static), 120)[1:]


def test_an_end_of_the_range_is_marked_and_its_inner_peak_named(curves: list[CurveResult]) -> None:
    """85 nm at 600 Hz, where the range ended, stood in a report as the best value."""
    peaks = ({"frequency_hz": 300.0, "amplitude_m": 60e-9},)
    end = replace(periodic(85e-9), worst_frequency_hz=600.0, worst_at_end=True, worst_unresolved="600 Hz is an end")
    end = replace(end, peak_amplitude_m=85e-9, peak_frequency_hz=600.0, peak_at_end=True, peaks=peaks)
    assert worst_cells(end, 1e9) == ("600 (end)", ">= 85", "main")
    assert open_sentences({3: end})[0] == (
        "Curve 3: 0.085 µm at 600 Hz, an end of the frequency range, is no peak "
        "(the highest inside it: 0.06 µm at 300 Hz)."
    )
    assert "none inside it" in "".join(open_sentences({0: replace(end, peaks=())}))
    assert not any("no peak" in said for said in open_sentences(facts_of(curves)))
    assert height_mark(end) == " (end)"
    (line,) = screen([replace(curves[0], facts=end)])
    assert line.endswith("end of the range, no peak; may be higher")
    grows = replace(end, worst_unresolved="the contacts do not hold", worst_open_kinds=("effort", "grows"))
    for at_end in (True, False):  # nothing matters more
        (line,) = screen([replace(curves[0], facts=replace(grows, worst_at_end=at_end))])
        assert "FLUTTER, can grow without bound" in line
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


def test_every_mean_in_the_table_is_that_of_the_summary(curves: list[CurveResult]) -> None:
    """0 in the table, 3.9 um in summary.json, as a hundredth of the height was not worth saying."""
    facts = [replace(periodic(500e-6), mean_m=3.9e-6), replace(periodic(100e-6), mean_m=-20e-6), periodic(1e-6)]
    told = [replace(curve, facts=found) for curve, found in zip(curves, facts, strict=False)]
    table = conclusion_table(shown(told), range(3), static=True)
    assert columns_of(table)["mean [µm]"] == ["3.9", "20", "-"]


def test_no_design_is_best_under_its_mildest_condition(tmp_path: Path) -> None:
    """12 um of half a gram at half a newton were "lowest"; at 8 N that mass has 7909 um, and two grams 644."""
    heights = {(0.0005, 0.5): 12e-6, (0.0005, 8.0): 7909e-6, (0.002, 0.5): 40e-6, (0.002, 8.0): 644e-6}
    sweep = {"contact.preload": [5.0, 20.0], "excitation.force": [0.5, 8.0]}
    members = read_scene(write_scene(tmp_path / "s.toml", small_scene(sweep=sweep))).members
    found = [
        CurveResult(
            member, tmp_path / "rom.h5", tmp_path / "c.h5", replace(periodic(height), peak_amplitude_m=height), ""
        )
        for member, height in zip(members, heights.values(), strict=True)
    ]
    rows = screen(found)
    assert ["highest of the best design" in row for row in rows] == [False, False, False, True]
    assert "lowest" not in "".join(rows)
    line = lowest_line(shown(found))
    assert line.startswith(
        "best design: preload 20 N, at most 644 µm (1.6 times below the free blade), with force 8 N"
    )
    assert line.endswith("lowest of single curves: preload 5 N, force 0.5 N, 12 µm")
    told = statistics(table_of(found, list(sweep), tmp_path))
    assert (told["best"]["curve"], told["design"], told["lowest"]["curve"]) == (3, {"contact.preload": 20.0}, 0)
    assert told["keys"]["excitation.force"]["best"] is None
    said = " | ".join(overview_lines(table_of(found, list(sweep), tmp_path))[0])
    assert "highest of the best design: 644 µm" in said
    assert "lowest: 12 µm" in said
    points = [SweepPoint(c.member, c.facts) for c in found if c.facts is not None]
    assert ("best design, at most", "644 µm", "preload 20 N; at force 8 N, 440 Hz") in _worst_cards(points)
    missing = [found[0], found[1], found[2], replace(found[3], file=None, facts=None)]  # 20 N was not seen at 8 N
    assert lowest_line(shown(missing)).startswith("best design: preload 5 N, at most 7909 µm")
    alone = [
        replace(c, member=replace(c.member, parameters={"excitation.force": float(n)})) for n, c in enumerate(found)
    ]
    assert lowest_line(shown(alone)).startswith("highest over the conditions: force 1 N, 7909 µm")
    assert statistics(table_of(alone, ["excitation.force"], tmp_path))["best"] is None
    spread = [
        replace(c, member=replace(c.member, parameters={"contact.preload": n, "excitation.force": float(n)}))
        for n, c in enumerate(found)
    ]
    assert lowest_line(shown(spread)) == "best design: not known, no design was computed under all conditions"


def test_the_static_contact_is_said_where_loads_act(curves: list[CurveResult]) -> None:
    """100 um were closed at rest and open at 5000 rev/min, and nobody was told."""
    closed = replace(periodic(PEAK), static_force_n=12.34, static_open_share=0.0, static_lowest_m=1e-6)
    closed = replace(closed, static_highest_m=4e-6)
    opened = replace(closed, static_force_n=0.0, static_open_share=1.0, static_opened=True)
    opened = replace(opened, static_lowest_m=-33e-6, static_highest_m=-33e-6)
    two = [replace(c, facts=f) for c, f in zip(curves, (closed, opened), strict=False)]
    assert " %" not in "".join(screen(two))  # no static load
    assert ["0 %" in screen(two, static=True)[0], "100 %" in screen(two, static=True)[1]] == [True, True]
    columns = columns_of(technical_table(shown(two), static=True))
    assert columns["static normal force [N]"] == ["12.34", "0"]
    assert columns["static v [µm]"] == ["1 to 4", "-33"]
    row = curve_summary(two[1], Path())
    assert (row["static_force_n"], row["static_open_share"], row["static_opened"]) == (0.0, 1.0, True)


def columns_of(table: Any) -> dict[str, list[str]]:
    """The cells of a table by its headings."""
    found = {str(column.header).replace("\n", " "): list(column.cells) for column in table.columns}
    assert len({len(cells) for cells in found.values()}) == 1
    return found


def test_too_few_harmonics_and_instability_are_said_beside_the_number(curves: list[CurveResult]) -> None:
    facts = replace(periodic(5e-6), worst_truncation_error=0.24)
    assert worst_cells(facts, 1e6)[1] == "5 (too few harmonics)"
    assert height_mark(facts) == " (too few harmonics: truncation error 24 %)"
    assert "too few harmonics: truncation error 24 %" in screen([replace(curves[0], facts=facts)])[0]
    beside = replace(facts, worst_truncation_error=0.01, worst_not_counted="detached branch 1, up to 1.2e-04 m")
    assert worst_cells(beside, 1e6)[1] == "5"
    unstable = replace(periodic(5e-6), worst_unstable=True, worst_unresolved="unstable against nodal diameter 7")
    assert (worst_cells(unstable, 1e6)[1], height_mark(unstable)) == ("5 (unstable)", " (unstable)")
    assert "Curve 1: the worst motion is not known: unstable against nodal diameter 7." in open_sentences(
        {1: unstable}
    )
    line = " ".join(screen([replace(curves[1], facts=unstable)]))
    assert "unstable: the blades leave this motion" in " ".join(line.split())
    assert ">=" not in line
    assert "Curve 0: not counted as worst motion: detached branch 1, up to 1.2e-04 m." in open_sentences({0: beside})
    lost = {0: replace(facts, truncation_branch="lost"), 1: replace(facts, truncation_branch="detached")}
    said = " ".join(error_sentences(lost, []))
    assert "Curve 0: the peak could not be followed" in said
    assert "Curve 1: with more harmonics the peak lies on a detached branch" in said


def test_the_screen_says_in_words_what_the_number_of_a_curve_is(curves: list[CurveResult]) -> None:
    lines = screen(curves)
    assert [line.split()[:3] for line in lines] == [
        ["0", "10", "5.73"],
        ["1", "20", "104.3"],
        ["2", "30", "8"],
        ["3", "40", ">="],
        ["4", "50", ">="],
    ]
    ends = (
        "slips    lowest",
        "detached branch 1; the response curve alone peaks at 5.73",
        "irregular; the response curve alone peaks at 5.73",
        "NOT SETTLED, may be higher; peak 5.73 is unstable",
        "may be higher",
    )
    for line, end in zip(lines, ends, strict=True):
        assert line.endswith(end)
    failed = replace(curves[0], facts=None, reason="the model could not be made")
    assert screen([curves[0], failed])[1].endswith("FAILED: the model could not be made")
    waiting = replace(failed, reason="not computed")
    assert screen([curves[0], waiting])[1].endswith(" not computed")
    assert lowest_line(shown([curves[0], waiting])).startswith("lowest so far: v0 = 10 µm, 5.73 µm (170 times")
    assert next(open_lines({}, shown([curves[0], waiting]), None)) == "not computed: curve 1"
    assert "lowest" not in screen(curves[:1])[0]


def test_the_lines_below_the_table(curves: list[CurveResult]) -> None:
    """The lowest of the curves that nothing was left open on, how far below the free blade, what to do next."""
    assert lowest_line(shown(curves)) == (
        "lowest: v0 = 10 µm, 5.73 µm (170 times below the free blade); end of the sweep, go further; "
        "perhaps lower, but not settled: curve 3"
    )
    assert lowest_line(shown([curves[1], curves[0], curves[2]])).endswith("go further")
    low, *others = shown([curves[1], curves[2], curves[0]])
    deepest = replace(others[1], parameters={"contact.interference": 4e-4}, contact="stuck")
    line = lowest_line([low, others[0], deepest])
    assert line.endswith("end of the sweep; the contact sticks, and going further changes nothing")
    assert lowest_line(shown(curves[3:4])).startswith("worst motion: at least 2 µm (500 times below the free blade)")
    assert lowest_line(shown(curves[3:])) == "lowest: not known, every curve may be higher"
    model = {"mesh": "m.vtu", "coriolis_error": 0.0}
    said = list(open_lines({"models": [model]}, shown(curves), "standard"))
    assert said == [
        'not settled: curves 3, 4 (response.search = "thorough" may settle them)',
        "not included: mistuning, mesh error (shroud verify)",
    ]
    studied = {"studies": {"mistuning": {}}, "models": [{"mesh": None, "coriolis_error": None}]}
    assert list(open_lines(studied, shown(curves[:1]), "standard")) == [
        "not included: Coriolis forces (their effect is not known, the reduced model has no dataset coriolis)"
    ]


def test_the_modes_of_the_range_are_said_in_one_line() -> None:
    entry = {"engine_order": 6, "mode": 1, "name": "1F", "free_hz": [204.3, 204.3], "stuck_hz": [437.46, 437.46]}
    said = "mode 1 (1F): 204 Hz free, 437 Hz stuck; "
    assert modes_line([entry], (150, 600)) == f"{said}both inside the range 150 to 600 Hz"
    assert modes_line([entry], (150, 400)) == f"{said}437 Hz outside the range 150 to 400 Hz"
    other = {**entry, "engine_order": 7, "stuck_hz": [440.0, 450.2]}
    assert "204 Hz free, 437 to 450 Hz stuck; both" in modes_line([entry, other], (150, 600))
    assert modes_line([], (150, 600)) == ""


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


def test_the_table_of_info_has_the_main_branch_and_its_errors(curves: list[CurveResult]) -> None:
    columns = columns_of(technical_table(shown([*curves, replace(curves[0], facts=None)]), static=False))
    assert list(columns)[:5] == ["#", "v0 [µm]", "worst on branch", "main peak [Hz]", "main peak [µm]"]
    assert columns["worst on branch"] == ["main", "detached 1", "main*", "main", "-"]
    assert columns["main peak [µm]"] == ["5.73"] * 5


def test_sentences_say_what_was_searched_and_what_was_left_open(curves: list[CurveResult]) -> None:
    facts = facts_of(curves)
    searched = search_sentences(facts)
    for said in (
        "Searched on every curve: main branch and 1 detached branch; stability; harmonics 0 to 3.",
        "Curves 0, 1, 3: time integration not needed.",
        "Curve 2: time integration from 1 unstable solution.",
        "Curve 4: no time integration.",
        "Not searched: mistuning.",
    ):
        assert said in searched
    assert any("irregular motion is the largest displacement" in said for said in searched)
    assert open_sentences(facts) == [
        "Curve 2: the worst motion is irregular, seen for 840 periods, in 2.5 of 1000 within 5 % of its height.",
        "Curve 2: the worst motion, on no branch, was followed in frequency from 430 to 445.5 Hz.",
        "Curve 3: the worst motion may be higher: motions up to 3 µm at 300 Hz were not seen to persist.",
        "Curve 4: the worst motion may be higher: 1 unstable part.",
    ]
    assert "Curve 3: the peak of the response curve is unstable and does not persist." in error_sentences(facts, [])
    alone = search_sentences({0: facts[0]})
    assert not any(said.startswith("Curve") for said in alone)


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
        SimpleNamespace(
            facts=SimpleNamespace(peak_amplitude_m=PEAK, worst_frequency_hz=at_hz, worst_amplitude_m=height), label=""
        )
        for at_hz, height in ((445.6, PEAK), (440.0, 1e-4), (9.0, 2e-6))
    ]
    with styled():
        figure, axes = plt.subplots()
        mark_worst(axes, cast(Any, shown), ["C0", "C1", "C2"], 1e6)
        places = [(line.get_xdata()[0], line.get_ydata()[0]) for line in axes.get_lines() if len(line.get_xdata())]
        _, labels = axes.get_legend_handles_labels()
        plt.close(figure)
    assert places == [(440.0, pytest.approx(100.0)), (9.0, pytest.approx(2.0))]
    assert labels == ["worst motion"]


def test_tiles_of_the_report_do_not_praise_a_curve_whose_search_is_open() -> None:
    """The lowest worst motion is one that nothing may exceed; the highest one is a lower bound where any is open."""

    def plotted(height_m: float, is_open: bool) -> Any:
        label = f"curve of {1e6 * height_m:g} um"
        return SimpleNamespace(
            worst=(100.0, height_m),
            worst_open=is_open,
            label=label,
            parameters={"contact.interference": 1e-6},
            mark="",
        )

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
