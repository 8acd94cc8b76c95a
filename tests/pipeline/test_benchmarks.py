"""Every benchmark on its smallest case: it ends well, and its table has the promised columns and finite numbers."""

import csv
import importlib
import json
import math
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from pipeline_support import WHOLE, overlapping_texts, small_scene, write_scene

from pipeline import styled

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"
NAMES = ("mesh", "assembly", "ordering", "factorisation", "constraint modes", "fixed-interface modes", "projection")
PHASES = tuple(f"{name} s" for name in NAMES)
PARAMETERS = (
    *("seed", "index", "angle_deg", "order_ratio", "normal_stiffness_n_per_m", "interference_m_per_n"),
    *("friction", "harmonics"),
)
HERTZ = tuple(f"{springs}_{k}_hz" for springs in ("free", "scene", "punch", "rigid") for k in (1, 2, 3))
SMOKE = {  # script, its table, arguments, rows, columns that hold finite numbers
    "family": ("family", "--interferences -0.00001 0.00001 --repeats 1", 2, ("points", "seconds", "least seconds")),
    "reduction": ("reduction", "--sizes 12 9 --modes 5", 2, ("dofs", "reduced", *PHASES, "total s", "memory_gb")),
    "own_mesh": (
        "own_mesh",
        "--sizes 18 --modes 5",
        2,
        ("dofs", "reduced", "read s", "sector s", *PHASES[1:], "total s", "memory_gb"),
    ),
    "parallel": (
        "parallel",
        "--curves 2 --jobs 1 2",
        2,
        ("processes", "seconds a curve", "speed-up", "complete"),
    ),
    "scaling": (
        "scaling",
        "--grids 1 2 --harmonics 1 2",
        4,
        ("contact nodes", "harmonics", "reduced dofs", "model s", "points", "ms a point", "memory GB"),
    ),
    "mesh_error grading": (
        "grading",
        "--sizes 15 9 --gradings 1 4 --reference 9",
        4,
        ("size_mm", "grading", "dofs", "seconds", "first", "rms", "largest", "tip"),
    ),
    "mesh_error compliance": (
        "compliance",
        "--sizes 12 6 --grid 3 2",
        6,
        ("size_mm", "dofs", "n_contacts", "local_normal", "whole_normal", "local_tangential", *HERTZ),
    ),
    "optimum": (
        "optimum",
        "--values 3 --low 0.00001 --high 0.00003",
        1,
        ("optimum", "amplitude_m", "solved_there_m", "sure_largest", "seconds", "sweep_seconds", "ratio"),
    ),
    "peers_linear": ("linear", "--sizes 12", None, ("mm", "dofs", "seconds", "times slower", "off")),
    "truncation": (
        "truncation",
        "--cases 1 --seed 6",
        1,
        (*PARAMETERS, "height", "estimate", "truth_height", "error"),
    ),
}


# measured in this process; `reduction` has one of its own for each row, as all have otherwise
MEASURED_HERE = ("own_mesh", "parallel", "scaling", "mesh_error compliance")


def measured_here(benchmark: Any, script: str, *arguments: Any) -> Any:
    """In the place of `in_a_process`, without the start of a process; what goes in and out is JSON all the same."""
    given = json.loads(json.dumps(arguments, default=str))
    return json.loads(json.dumps(benchmark(script).measure(*given)))


@pytest.fixture(scope="module")
def benchmark() -> Iterator[Any]:
    """Imports a module of the benchmarks by its name."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(BENCHMARKS))
        yield importlib.import_module


@pytest.mark.parametrize("name", SMOKE)
@pytest.mark.long
def test_the_smallest_case(benchmark: Any, tmp_path: Path, name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    script, *first = name.split()
    if name in MEASURED_HERE:
        monkeypatch.setattr(benchmark(script), "in_a_process", partial(measured_here, benchmark))
    table, arguments, count, columns = SMOKE[name]
    element = "hex20" if name in ("mesh_error grading", "peers_linear") else "hex8"
    scene = write_scene(
        tmp_path / "small.toml", small_scene(mesh__element=element, **(WHOLE if name == "truncation" else {}))
    )
    out = tmp_path / "bench" / table
    assert not benchmark(script).main([*first, *arguments.split(), "--scene", str(scene), "--out", str(out)])
    with (out / f"{table}.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == count or (count is None and len(rows) >= 2)
    for row in rows:
        assert all(math.isfinite(float(row[column])) for column in columns)
    if name == "peers_linear":  # the programs agree
        assert all(float(row["off"]) < 1e-6 for row in rows)
    if name == "optimum":  # the envelope is the worst motion of the sweep, and its lowest value no higher
        (row,) = rows
        assert float(row["sure_largest"]) < 0.01
        assert float(row["amplitude_m"]) == pytest.approx(float(row["solved_there_m"]), rel=1e-3)
        assert float(row["amplitude_m"]) <= 1.001 * float(row["lowest_amplitude_m"])
    if name == "mesh_error compliance":
        for row in rows:
            assert 0.0 < float(row["local_normal"]) < float(row["whole_normal"])
            hertz = [float(row[f"{springs}_1_hz"]) for springs in ("free", "scene", "punch", "rigid")]
            assert hertz == sorted(hertz)
    if name == "mesh_error grading":
        assert float(rows[3]["largest"]) == float(rows[3]["tip"]) == 0.0  # the reference itself


@pytest.fixture(scope="module")
def studies(benchmark: Any, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """Every study of `make bench` with tiny settings, as read back from its CSV file."""
    out = tmp_path_factory.mktemp("bench")
    bench, curves, mesh, modes, whole = (
        benchmark(name)
        for name in ("bench", *(f"work_precision.{part}" for part in ("curve_studies", "mesh", "modes", "whole")))
    )
    coarse = (14.0, 12.0, 10.0)  # mm
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(bench, "SCENE", write_scene(out / "s.toml", small_scene(response__frequency=[150.0, 700.0])))
        patch.setattr(bench, "LIFT_OFF", [curves.CurveCase(bench.SCENE, 1e-5, "slip")])
        plans = {
            "harmonics": curves.harmonics_plan((1, 3), (0.05,), 5, 7),
            "integration": curves.integration_plan(1, (32, 512)),
            "continuation": curves.continuation_plan(1, (0.5, 0.1), (1e-2, 1e-9), 0.1, 0.05),
        }
        patch.setattr(bench, "PLANS", plans)
        patch.setattr(mesh, "DEFAULT", mesh.MeshSettings({"hex8": (12.0, 9.0)}, (), coarse, 4, 4))
        patch.setattr(modes, "DEFAULT", modes.ModesSettings((1, 6), (0.1,)))
        tiny = whole.WholeSettings((("hex8", 9.0),), (2, 4), (1,), (1e-5, 1e-3), (), coarse, 4, (1, 2))
        patch.setattr(whole, "DEFAULT", tiny)
        assert bench.main(["--out", str(out)]) == 0
        patch.setattr(bench, "ROOT", out)
        (out / "docs" / "developers").mkdir(parents=True)
        assert bench.main(["--docs", "--out", str(out)]) == 0
    document = (out / "docs" / "developers" / "performance.md").read_text()
    study = benchmark("work_precision.study")
    found = {name: study.read_csv(out / f"{name}.csv") for name in bench.STUDIES}
    for name, made in found.items():
        assert (out / f"{name}.png").stat().st_size > 10_000
        assert (study.markdown(made) if name == "whole" else f"benchmarks/measured/{name}.csv") in document
        assert study.read_csv(out / "benchmarks" / "measured" / f"{name}.csv") == made
    return found


@pytest.mark.xdist_group("work_precision")
@pytest.mark.long
def test_a_study_has_finite_errors_and_an_uncertainty(studies: dict[str, Any]) -> None:
    for study in studies.values():
        assert all(0.0 <= uncertainty < 0.5 for uncertainty in study.uncertainty.values())
        for row in study.rows:
            assert row.seconds > 0.0
            assert list(row.errors) == list(study.uncertainty)
            assert all(0.0 <= error < math.inf for error in row.errors.values())


@pytest.mark.xdist_group("work_precision")
@pytest.mark.long
def test_refinement_reduces_the_error(studies: dict[str, Any]) -> None:
    few, many, _ = studies["modes"].rows
    assert all(many.errors[name] < few.errors[name] for name in few.errors)
    peak = "peak amplitude"
    coarse, fine, exact = (row.errors[peak] for row in studies["integration"].rows)
    assert exact < 1e-7 < fine < coarse
    loose, tight = (row.errors[peak] for row in studies["continuation"].rows[2:])
    assert tight < min(loose, 1e-6)


@pytest.mark.parametrize(
    "name",
    ["whole", *(pytest.param(n, marks=pytest.mark.long) for n in ("modes", "mesh", "harmonics", "integration"))],
)
def test_no_label_of_a_measured_figure_lies_on_another(benchmark: Any, name: str) -> None:
    study = benchmark("work_precision.study").read_csv(BENCHMARKS / "measured" / f"{name}.csv")
    with styled():
        assert overlapping_texts(benchmark("work_precision.figure").work_precision_figure(study)) == []


def test_front_and_fastest_setting(benchmark: Any) -> None:
    study = benchmark("work_precision.study")
    points = [(1.0, 0.1), (2.0, 0.2), (3.0, 0.04), (4.0, 0.009), (5.0, 0.009), (6.0, math.inf)]
    rows = tuple(study.Measured("line", f"{i}", s, {"peak": error}) for i, (s, error) in enumerate(points))
    made = study.Study("made_up", "", "", "", {"peak": 1e-4}, rows)
    assert [row.setting for row in study.pareto_front(rows, "peak")] == ["0", "2", "3"]
    best = [study.fastest_within(made, "peak", tolerance) for tolerance in (0.05, 0.01, 0.001)]
    assert [row.setting if row else None for row in best] == ["2", "3", None]
    unsure = study.Study("made_up", "", "", "", {"peak": 0.02}, rows)
    assert study.fastest_within(unsure, "peak", 0.01) is None


def test_an_extrapolation_finds_the_limit_and_its_uncertainty(benchmark: Any) -> None:
    extrapolated = benchmark("work_precision.mesh").extrapolated
    sizes = (4.0, 3.0, 2.0)
    limit, uncertainty = extrapolated(sizes, [10.0 + 0.1 * size**2 for size in sizes], 2.0)
    assert limit == pytest.approx(10.0, rel=1e-12)
    assert uncertainty < 1e-12
    assert extrapolated(sizes, [11.6, 10.8, 10.4], 2.0)[1] > 1e-3


def test_the_error_of_a_drawn_curve(benchmark: Any) -> None:
    def curve(corners: list[tuple[float, float]]) -> Any:
        frequency, amplitude = np.array(corners, dtype=float).T
        return SimpleNamespace(frequency_hz=frequency, amplitude_m=amplitude)

    polygon_error = benchmark("work_precision.curve_studies").polygon_error
    reference = curve([(100.0, 0.0), (150.0, 2.0), (200.0, 0.0)])
    assert polygon_error(reference, reference) == 0.0
    assert polygon_error(curve([(100.0, 0.0), (200.0, 0.0)]), reference) == pytest.approx(1.0)


def test_a_power_law_is_fitted_over_the_larger_half_and_says_where_a_limit_is_reached(
    benchmark: Any, tmp_path: Path
) -> None:
    scaling = benchmark("scaling")
    assert scaling.power_law([1.0, 2.0, 4.0], [3.0, 12.0, 48.0]) == pytest.approx((3.0, 2.0))
    assert scaling.power_law([1, 10, 100, 1000], [5.0, 5.0, 5.0, 50.0])[1] == pytest.approx(0.5)
    by_nodes = [
        {"contact nodes": n, "model s": n, "ms a point": 0.06 * n**2, "memory GB": 0.1 * n} for n in (1, 10, 100)
    ]
    by_harmonics = [{"contact nodes": 9, "harmonics": h, "ms a point": 6.0 * h} for h in (1, 10)]
    reached = [line[5] for line in scaling.limits(by_nodes, by_harmonics, tmp_path)]
    assert reached == ["600 contact nodes", "240 contact nodes", "100 contact nodes", "100 harmonics"]


def test_conclusions_of_a_designer(benchmark: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The optimum is no worse than the best of the values swept, and both persist as high as the full search says."""
    conclusions = benchmark("design_conclusions")
    scene = write_scene(tmp_path / "small.toml", small_scene())
    blade = conclusions.Blade("small", scene, {}, (1e-5, 2e-5, 3e-5))
    monkeypatch.setattr(conclusions, "BLADES", {"small": blade})
    monkeypatch.setattr(conclusions, "PAGE", tmp_path / "page.md")
    conclusions.PAGE.write_text("# Page\n\n<!-- bench: design_conclusions -->\n<!-- end -->\n")
    out = tmp_path / "bench" / "conclusions"
    assert not conclusions.main(["--docs", "--out", str(out)])
    sweep, optimum = conclusions.read_rows(out / "design_conclusions.csv")
    assert sweep["interference_m"] in blade.swept
    assert optimum["persists_m"] == pytest.approx(optimum["promised_m"], rel=1e-3)
    assert optimum["persists_m"] <= 1.001 * sweep["persists_m"]
    assert conclusions.table([sweep, optimum]) in conclusions.PAGE.read_text()


def test_a_block_of_the_document_is_replaced_and_the_rest_stays(benchmark: Any) -> None:
    with_block = benchmark("document").with_block
    document = (BENCHMARKS.parent / "docs" / "developers" / "performance.md").read_text()
    changed = with_block(document, "run_times", "new\n")
    before, _, rest = changed.partition("<!-- bench: run_times -->\n")
    assert rest.startswith("new\n<!-- end -->\n")
    assert document.startswith(before)
    assert document.endswith(rest.partition("<!-- end -->\n")[2])
    assert with_block("Text.\n", "more", "new\n") == "Text.\n\n<!-- bench: more -->\nnew\n<!-- end -->\n"
