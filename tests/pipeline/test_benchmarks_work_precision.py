"""Run time against error: every study on tiny settings, the tables and figures, and what is read off them."""

import functools
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from pipeline_support import small_scene, write_scene

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"
STUDIES = ("mesh", "modes", "harmonics", "integration", "continuation", "whole")
COARSE = (14.0, 12.0, 10.0)  # mm


@pytest.fixture(scope="module")
def wp() -> Any:
    """The modules of the studies by name."""
    import importlib

    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(BENCHMARKS))
        names = (*STUDIES, "study", "tables", "figure", "document", "stages", "curves")
        modules = {name: importlib.import_module(f"work_precision.{name}") for name in names}
        return SimpleNamespace(bench=importlib.import_module("bench"), **modules)


@pytest.fixture(scope="module")
def finished_study(wp: Any, tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Any]:
    """A study by its name, made once."""
    folder = tmp_path_factory.mktemp("work_precision")
    scene = write_scene(folder / "small.toml", small_scene(response__frequency=[150.0, 700.0]))
    makers = tiny(wp, scene, folder / "store")
    return functools.cache(lambda name: makers[name]())


def tiny(wp: Any, scene: Path, store: Path) -> dict[str, Callable[[], Any]]:
    """Every study on as little as shows that it works."""
    cases = [wp.curves.CurveCase(scene, 1e-5, "slip")]
    whole = wp.whole.WholeSettings(
        (("hex8", 9.0),), (2, 4), (1,), (1e-5, 1e-3), (), COARSE, reference_modes=4, reference_harmonics=(1, 2)
    )
    return {
        "mesh": lambda: wp.mesh.mesh_study(scene, wp.mesh.MeshSettings({"hex8": (12.0, 9.0)}, COARSE, 4, 4), store),
        "modes": lambda: wp.modes.modes_study(scene, wp.modes.ModesSettings((1, 6), (0.1,))),
        "harmonics": lambda: wp.harmonics.harmonics_study(
            cases, wp.harmonics.HarmonicsSettings((1, 3), (0.05,), (5, 7)), store
        ),
        "integration": lambda: wp.integration.integration_study(
            cases, wp.integration.IntegrationSettings(1, (32, 512)), store
        ),
        "continuation": lambda: wp.continuation.continuation_study(
            cases, wp.continuation.ContinuationSettings(1, (0.5, 0.1), (1e-2, 1e-9), (0.1, 0.05)), store
        ),
        "whole": lambda: wp.whole.whole_study(scene, whole, store),
    }


@pytest.mark.xdist_group("work_precision")
@pytest.mark.parametrize("name", STUDIES)
def test_a_study_becomes_a_table(wp: Any, finished_study: Callable[[str], Any], tmp_path: Path, name: str) -> None:
    study = finished_study(name)
    assert study.name == name
    quantities = [quantity.name for quantity in study.quantities]
    for row in study.rows:
        assert row.seconds > 0.0
        assert list(row.errors) == quantities
        assert all(error >= 0.0 for error in row.errors.values())
    assert all(0.0 <= quantity.uncertainty < 0.5 for quantity in study.quantities)
    wp.tables.write_csv(tmp_path / "s.csv", study)
    again = wp.tables.read_csv(tmp_path / "s.csv")
    assert wp.tables.markdown(again) == wp.tables.markdown(study)
    assert [row.errors for row in again.rows] == [dict(row.errors) for row in study.rows]


@pytest.mark.xdist_group("work_precision")
@pytest.mark.parametrize("name", ["harmonics", "whole"])
def test_a_study_becomes_a_figure(wp: Any, finished_study: Callable[[str], Any], tmp_path: Path, name: str) -> None:
    wp.figure.save_figure(finished_study(name), tmp_path)
    assert (tmp_path / f"{name}.png").stat().st_size > 10_000
    assert (tmp_path / f"{name}.svg").stat().st_size > 10_000


@pytest.mark.xdist_group("work_precision")
def test_what_is_refined_comes_nearer(wp: Any, finished_study: Callable[[str], Any]) -> None:
    few, many, _ = finished_study("modes").rows
    assert all(many.errors[name] < few.errors[name] for name in few.errors)
    coarse, fine, exact = finished_study("integration").rows
    peak = wp.curves.PEAK
    assert exact.errors[peak] < 1e-7 < fine.errors[peak] < coarse.errors[peak]
    loose, tight = finished_study("continuation").rows[2:]
    assert tight.errors[peak] < 1e-6
    assert tight.errors[peak] < loose.errors[peak]


def study_of(wp: Any, *points: tuple[float, float], uncertainty: float = 1e-4) -> Any:
    """A made-up study of one quantity: (seconds, error) of each setting."""
    rows = tuple(wp.study.Measured("line", f"{i}", s, {"peak": e}, {"dofs": i}) for i, (s, e) in enumerate(points))
    return wp.study.Study(
        "made_up", "Made up", "a", "r", (wp.study.Quantity("peak", uncertainty),), rows, {"date": "d"}
    )


def test_front_and_cheapest(wp: Any) -> None:
    study = study_of(wp, (1.0, 0.1), (2.0, 0.2), (3.0, 0.04), (4.0, 0.009), (5.0, 0.009), (6.0, float("inf")))
    front = wp.study.pareto_front(study.rows, "peak")
    assert [row.setting for row in front] == ["0", "2", "3"]
    (quantity,) = study.quantities
    best = {tolerance: wp.study.cheapest(study.rows, quantity, tolerance) for tolerance in (0.05, 0.01, 0.001)}
    assert [row.setting if row else None for row in best.values()] == ["2", "3", None]
    unsure = wp.study.Quantity("peak", 0.02)
    assert wp.study.cheapest(study.rows, unsure, 0.01) is None


def test_an_extrapolation_finds_the_limit_and_says_how_sure(wp: Any) -> None:
    sizes = (4.0, 3.0, 2.0)
    limit, unsure = wp.stages.extrapolated(sizes, [10.0 + 0.1 * size**2 for size in sizes], 2.0)
    assert limit == pytest.approx(10.0, rel=1e-12)
    assert unsure < 1e-12
    _, of_uneven = wp.stages.extrapolated(sizes, [11.6, 10.8, 10.4], 2.0)
    assert of_uneven > 1e-3


def test_the_error_of_a_drawn_curve(wp: Any) -> None:
    import numpy as np

    def curve(corners: list[tuple[float, float]]) -> Any:
        frequency, amplitude = np.array(corners, dtype=float).T
        return SimpleNamespace(frequency_hz=frequency, amplitude_m=amplitude)

    reference = curve([(100.0, 0.0), (150.0, 2.0), (200.0, 0.0)])
    assert wp.continuation.drawn_error(reference, reference) == 0.0
    assert wp.continuation.drawn_error(curve([(100.0, 0.0), (200.0, 0.0)]), reference) == pytest.approx(1.0)


def test_the_document_keeps_what_people_wrote(wp: Any, tmp_path: Path) -> None:
    tables, docs = tmp_path / "tables", tmp_path / "docs"
    tables.mkdir()
    docs.mkdir()
    study = study_of(wp, (1.0, 0.1), (2.0, 0.01))
    wp.tables.write_csv(tables / "made_up.csv", study)
    wp.document.update_document(docs, tables, ["made_up", "never_measured"])
    file = docs / "performance.md"
    first = file.read_text()
    assert "| line | 1 | 1 | 2 | 1 % |" in first
    assert "never_measured" not in first
    assert 1_000 < (docs / "images" / "bench_made_up.png").stat().st_size < 150_000
    file.write_text(first.replace("<!-- bench", "By hand.\n\n<!-- bench"))
    wp.tables.write_csv(tables / "made_up.csv", study_of(wp, (1.0, 0.5)))
    wp.document.update_document(docs, tables, ["made_up"])
    second = file.read_text()
    assert "By hand." in second
    assert "| line | 0 | 0 | 1 | 50 % |" in second
    assert "| line | 1 | 1 | 2 | 1 % |" not in second


def test_a_table_is_made_again_from_what_was_measured(
    wp: Any, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    study = study_of(wp, (1.0, 0.1), (2.0, 0.01))
    wp.tables.write_csv(tmp_path / "modes.csv", study)
    assert wp.bench.main(["--draw", "--only", "modes", "--out", str(tmp_path)]) == 0
    assert (tmp_path / "made_up.md").read_text() in capsys.readouterr().out


def test_every_study_can_be_asked_for(wp: Any) -> None:
    assert tuple(wp.bench.STUDIES) == STUDIES
    with pytest.raises(SystemExit):
        wp.bench.main(["--only", "mush"])
