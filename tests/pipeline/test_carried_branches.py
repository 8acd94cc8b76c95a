"""Branches carried across a sweep: an isolated branch that is found at one value appears at all where it exists."""

import json
import runpy
import shutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from faults_support import entries
from pipeline_support import write_scene

import nonlinear.response_solver
import pipeline.stages.curve.carry_branches
from nonlinear import ContactParameters, Excitation, SolverOptions
from nonlinear.branches.detached_branches import BranchSearch, detached_branches
from nonlinear.contact.fourier import to_real
from nonlinear.response_solver import build_harmonic_balance
from pipeline import Results, read_results, read_scene, run_scene
from pipeline.results.tables import branch_remarks
from pipeline.scene.schema import Scene
from pipeline.stages.curve.carry_branches import longest_way, sweep_steps
from pipeline.stages.curve.curve_file import read_curve, write_curve
from pipeline.stages.curve.extend_curve import extend_curve
from rom import modal_model, write_reduced_model

LUMPED = runpy.run_path(str(Path(__file__).parents[1] / "nonlinear" / "lumped.py"))
FOUND_AT = -1.5  # the only interference at which the isolated branch is found directly
SWEPT = [-3.0, -2.5, -2.0, -1.5]  # it exists at all but the first one
SCENE: dict[str, Any] = {
    "name": "isola",
    "contact": {"normal_stiffness": 0.81, "tangential_stiffness": 0.6075, "friction": 0.05},
    "excitation": {"engine_order": 1, "force": 1.0},
    "response": {"frequency": [0.08, 1.0], "damping_ratio": 0.005, "stability": "folds", "search": "off"},
}


def sweep_of(interference: Sequence[float], **sweep: Sequence[Any]) -> dict[str, Any]:
    """The scene with a sweep."""
    return SCENE | {"sweep": {"contact.interference": list(interference), **sweep}}


@pytest.fixture(autouse=True, scope="module")
def found_at_one() -> Iterator[None]:
    """The search for isolated branches of a single curve, in this process, finds the one of FOUND_AT only."""

    def search(continuation: Any, *rest: Any) -> Any:
        here = float(continuation.contact.interference[0]), continuation.balance.receptance.force
        return detached_branches(continuation, *rest) if here == (FOUND_AT, 1.0) else BranchSearch([], 0)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(nonlinear.response_solver, "detached_branches", search)
        yield


@pytest.fixture(scope="module")
def swept(found_at_one: None, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A finished run over SWEPT: scene.toml, rom.h5 and the output folder `out`."""
    folder = tmp_path_factory.mktemp("swept")
    write_reduced_model(folder / "rom.h5", LUMPED["lumped_blade"](2))
    assert respond(folder, sweep_of(SWEPT)).complete
    return folder


def respond(folder: Path, scene: Mapping[str, Any], out: str = "out", **options: Any) -> Results:
    """Run a scene on the model of a folder."""
    path = write_scene(folder / "scene.toml", scene)
    return run_scene(path, folder / out, rom=folder / "rom.h5", until="respond", **options)


def branches(results: Results) -> dict[float, list[dict[str, Any]]]:
    """Detached branches by interference."""
    curves = results.summary["curves"]
    return {curve["parameters"]["contact.interference"]: curve["detached"] for curve in curves}


def stored(results: Results) -> dict[float, Path]:
    """The file of the curve of each interference with all its branches, in the store."""
    files = [*results.folder.glob("store/curve/*/curve.h5"), *results.folder.glob("store/extension/*/curve.h5")]
    most: dict[float, Path] = {}
    for file in files:
        with h5py.File(file) as source:
            value, number = float(source.attrs["contact.interference"]), len(source.get("branch", ()))
        if value not in most or number > len(read_curve(most[value]).detached):
            most[value] = file
    return most


@contextmanager
def extending(instead: Callable[..., None] = extend_curve) -> Iterator[list[float]]:
    """The interferences of the curves that are extended in this process within the block; `instead` does it."""
    seen: list[float] = []

    def noted(folder: Path, rom: Path, scene: Scene, *rest: Any) -> None:
        seen.append(float(scene.contact.interference))  # type: ignore[arg-type]
        instead(folder, rom, scene, *rest)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pipeline.stages.curve.carry_branches, "extend_curve", noted)
        yield seen


@pytest.fixture
def again(swept: Path, tmp_path: Path) -> Path:
    """A copy of the finished run."""
    return Path(shutil.copytree(swept, tmp_path / "again"))


def test_a_branch_found_at_one_value_appears_where_it_exists(swept: Path) -> None:
    """And where it is born: an isola that shrinks to a point has a width that goes as the root of the distance."""
    found = branches(read_results(swept / "out"))
    assert {value: len(items) for value, items in found.items()} == {-3.0: 0, -2.5: 1, -2.0: 1, -1.5: 1}
    assert [found[value][0]["origin"].split()[-3:] for value in (-2.5, -2.0)] == [
        ["=", "-2e+06", "µm"],
        ["=", "-1.5e+06", "µm"],
    ]
    widths = {value: found[value][0]["to_hz"] - found[value][0]["from_hz"] for value in (-2.5, -2.0)}
    slope = (widths[-2.0] ** 2 - widths[-2.5] ** 2) / 0.5
    (end,) = found[-2.5][0]["born_between"]
    assert (end["parameter"], end["missing"]) == ("contact.interference", -3.0)
    assert end["exists"] == pytest.approx(-2.5 - widths[-2.5] ** 2 / slope, abs=0.01)
    assert [found[value][0]["born_between"] for value in (-2.0, -1.5)] == [[], []]


def test_a_reader_of_the_table_learns_where_a_branch_comes_from_and_where_it_ends(swept: Path) -> None:
    found = branches(read_results(swept / "out"))
    end = found[-2.5][0]["born_between"][0]["exists"]
    text = f", carried from v0 = -2e+06 µm, ends between v0 = {end * 1e6:.6g} µm and -3e+06 µm"
    assert branch_remarks(found[-2.5][0]) == text
    assert branch_remarks(found[-1.5][0]) == ""
    carried = [curve["carried_from"] for curve in read_results(swept / "out").summary["curves"]]
    assert [len(labels) for labels in carried] == [1, 2, 2, 1]


def test_a_carried_branch_solves_the_equations_of_its_own_member(swept: Path) -> None:
    modal = modal_model(LUMPED["lumped_blade"](2), damping_ratio=0.005)
    options = SolverOptions((0.08, 1.0), harmonics=1)
    for value in (-2.5, -2.0):
        contact = ContactParameters.shared(
            2, normal_stiffness=0.81, tangential_stiffness=0.6075, friction=0.05, interference=value
        )
        balance = build_harmonic_balance(modal, contact, Excitation(1, 1.0), options)
        (branch,) = read_curve(stored(read_results(swept / "out"))[value]).detached
        assert branch.termination.complete
        for frequency, coefficients in zip(branch.frequency_hz, branch.relative_displacement, strict=True):
            unknown = balance.unknown(to_real(coefficients))
            error = balance.relative_error(balance.evaluate(unknown, 2 * np.pi * frequency).residual, unknown)
            assert error < 1e-10


def test_files_hold_the_carried_branches_and_the_same_main_branch(swept: Path) -> None:
    rows = (swept / "out" / "response.csv").read_text().splitlines()
    with h5py.File(swept / "out" / "response.h5") as file:
        for index, value in enumerate(SWEPT):
            group, mine = file[f"curve/{index}"], [row.split(",") for row in rows[1:] if row.startswith(f"{index},")]
            (solved,) = (
                path
                for path in (swept / "out" / "store" / "curve").glob("*/curve.h5")
                if h5py.File(path).attrs["contact.interference"] == value
            )
            with h5py.File(solved) as alone:
                for name in set(alone) - {"branch"}:
                    np.testing.assert_array_equal(group[name][()], alone[name][()])
            number = len(group.get("branch", ()))
            assert number == (value != -3.0)
            assert sum(row[-1] == "1" for row in mine) == (group["branch/1/arc"].size if number else 0)
        born = json.loads(file["curve/1/branch/1"].attrs["born_between"])
    assert born == branches(read_results(swept / "out"))[-2.5][0]["born_between"]


def test_a_stored_curve_is_read_back_whole(swept: Path, tmp_path: Path) -> None:
    for value, path in stored(read_results(swept / "out")).items():
        write_curve(tmp_path / "copy.h5", read_curve(path), {})
        with h5py.File(path) as first, h5py.File(tmp_path / "copy.h5") as second:
            names: list[str] = []
            first.visit(names.append)
            assert any("branch/1" in name for name in names) == (value != -3.0)
            for name in ["/", *names]:
                if isinstance(first[name], h5py.Dataset):
                    np.testing.assert_array_equal(first[name][()], second[name][()])
                for key, expected in first[name].attrs.items():
                    if "." not in key and key != "added":  # parameters
                        np.testing.assert_equal(second[name].attrs[key], expected)


def test_nothing_is_computed_or_read_twice(again: Path) -> None:
    before = branches(read_results(again / "out"))
    # an extended curve needs no look at the one that it was made of
    (again / "out" / "store" / "curve" / key_of(again, -2.0) / "curve.h5").write_bytes(b"")
    with extending() as seen:
        found = respond(again, sweep_of(SWEPT))
    assert seen == []
    assert found.summary["stages"]["respond"]["status"] == "reused"
    assert branches(found) == before


def key_of(folder: Path, value: float) -> str:
    """Key of the curve of an interference as it was solved."""
    for path in (folder / "out" / "store" / "curve").glob("*/curve.h5"):
        with h5py.File(path) as source:
            if source.attrs["contact.interference"] == value:
                return path.parent.name
    raise KeyError(value)


def test_the_branches_depend_neither_on_the_order_of_the_sweep_nor_on_the_processes(again: Path) -> None:
    some = [-2.0, -1.5]
    expected = branches(respond(again, sweep_of(some)))
    assert [len(expected[value]) for value in some] == [1, 1]
    for kind in ("extension", "carried"):
        shutil.rmtree(again / "out" / "store" / kind)
    with extending() as here:
        assert branches(respond(again, sweep_of(some[::-1]), jobs=2)) == expected
    assert set(here) <= {-1.5}  # what is left for a second round; the others in worker processes


def test_a_further_member_touches_its_neighbours_only(again: Path) -> None:
    with extending() as seen:
        found = branches(respond(again, sweep_of([*SWEPT, -1.0])))
    assert set(seen) == {-1.0, -1.5}
    assert {value: len(items) for value, items in found.items()} == {-3.0: 0, -2.5: 1, -2.0: 1, -1.5: 1, -1.0: 1}


def test_branches_are_carried_across_two_parameters(again: Path) -> None:
    """Force and interference scaled together scale the response: 0.8 N at -2 m is 0.8 times 1 N at -2.5 m."""
    (expected,) = branches(read_results(again / "out"))[-2.5]
    found = respond(again, sweep_of([-2.0, -1.5], **{"excitation.force": [1.0, 0.8]}))
    by_place = {tuple(curve["parameters"].values()): curve["detached"] for curve in found.summary["curves"]}
    assert [len(items) for items in by_place.values()] == [1, 1, 1, 1]
    (scaled,) = by_place[-2.0, 0.8]
    assert scaled["peak_amplitude_m"] == pytest.approx(0.8 * expected["peak_amplitude_m"], rel=1e-4)
    for end in ("from_hz", "to_hz"):
        assert scaled[end] == pytest.approx(expected[end], rel=1e-6)


def test_a_curve_that_cannot_be_extended_stays_as_it_is(again: Path) -> None:
    expected = branches(read_results(again / "out"))
    for kind in ("extension", "carried"):
        shutil.rmtree(again / "out" / "store" / kind)

    def failing(folder: Path, rom: Path, scene: Scene, *rest: Any) -> None:
        if scene.contact.interference == -2.0:
            raise ArithmeticError("no luck")
        extend_curve(folder, rom, scene, *rest)

    with extending(failing):
        found = respond(again, sweep_of(SWEPT))
    assert not found.complete
    assert [line for line in found.problems if "no luck" in line] == ["branches of v0 = -2e+06 µm: no luck"]
    assert [curve.complete for curve in found.curves] == [True] * 4
    assert len(branches(found)[-1.5]) == 1
    assert branches(found)[-2.0] == []
    with extending() as seen:
        assert branches(respond(again, sweep_of(SWEPT))) == expected
    assert -2.0 in seen


def test_an_interrupted_run_goes_on_where_it_was(again: Path) -> None:
    expected = branches(read_results(again / "out"))
    for kind in ("extension", "carried"):
        shutil.rmtree(again / "out" / "store" / kind)

    def interrupted(folder: Path, rom: Path, scene: Scene, *rest: Any) -> None:
        if scene.contact.interference == -2.0:
            raise KeyboardInterrupt
        extend_curve(folder, rom, scene, *rest)

    with extending(interrupted) as first, pytest.raises(KeyboardInterrupt):
        respond(again, sweep_of(SWEPT))
    assert first[-1] == -2.0
    with extending() as second:
        assert branches(respond(again, sweep_of(SWEPT))) == expected
    assert set(second) >= {-2.0, *SWEPT} - set(first[:-1])
    assert not set(second[: 5 - len(first)]) & set(first[:-1])  # the first round is not repeated
    assert entries(again / "out", "tmp") == []


def test_rounds_that_find_ever_more_come_to_an_end(again: Path) -> None:
    """And that is said."""
    for kind in ("extension", "carried"):
        shutil.rmtree(again / "out" / "store" / kind)

    def endless(folder: Path, rom: Path, scene: Scene, base: Path, *rest: Any) -> None:
        shutil.copy(base, folder / "curve.h5")
        (folder / "extension.json").write_text('{"added": 1, "lost": []}')

    with extending(endless) as seen:
        found = respond(again, sweep_of(SWEPT))
    assert len(seen) == 4 * 6  # three steps there and three back
    assert found.problems == ("branches: still new ones after 6 rounds across the sweep, where it was ended",)


def test_no_search_no_carrying(swept: Path, tmp_path: Path) -> None:
    """Nor with a single curve."""
    single = SCENE | {"contact": SCENE["contact"] | {"interference": -2.0}}
    none = sweep_of(SWEPT[:2]) | {"response": SCENE["response"] | {"detached": False}}
    shutil.copy(swept / "rom.h5", tmp_path)
    for scene, out in ((single, "single"), (none, "none")):
        with extending() as seen:
            respond(tmp_path, scene, out)
        assert seen == []
        assert not (tmp_path / out / "store" / "extension").exists()
        assert not (tmp_path / out / "store" / "carried").exists()


def steps(tmp_path: Path, **sweep: list[Any]) -> tuple[list[tuple[str, Any, Any]], int]:
    """The steps of a sweep as (parameter, lower value, higher value), and the longest way."""
    lists = {key.replace("__", "."): values for key, values in sweep.items()}
    file = read_scene(write_scene(tmp_path / "s.toml", SCENE | {"sweep": lists}), given_model=True)
    found = sweep_steps(file.members)
    return [(step.parameter, step.value(0), step.value(1)) for step in found], longest_way(found)


def test_neighbours_differ_by_one_step_of_one_parameter(tmp_path: Path) -> None:
    v0, force, law = "contact.interference", "excitation.force", "contact.law"
    found, way = steps(tmp_path, contact__interference=[1.0, -1.0, 0.0])
    assert (found, way) == ([(v0, -1.0, 0.0), (v0, 0.0, 1.0)], 2)
    found, way = steps(tmp_path, contact__interference=[1.0, 0.0], excitation__force=[1.0, 3.0, 2.0])
    assert sorted(found) == [(v0, 0.0, 1.0)] * 3 + [(force, 1.0, 2.0)] * 2 + [(force, 2.0, 3.0)] * 2
    assert way == 3
    found, _ = steps(tmp_path, contact__law=["cone", "two_sliders"], contact__interference=[0.0, 1.0])
    assert found == [(v0, 0.0, 1.0)] * 2
    assert law not in [parameter for parameter, *_ in found]
    assert steps(tmp_path, excitation__engine_order=[0, 1, 2]) == ([], 0)
    found, _ = steps(tmp_path, response__harmonics=["auto", 7, 3])
    assert found == [("response.harmonics", 3, 7), ("response.harmonics", 7, "auto")]
    found, _ = steps(tmp_path, contact__interference=[[0.0, 2.0], 1.0, [0.0, 1.0]])
    assert found == [(v0, [0.0, 1.0], [0.0, 2.0])]
    assert steps(tmp_path, contact__normal_stiffness=[1.0, "punch"])[0] == []
