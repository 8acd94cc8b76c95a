"""As many processes as asked for; by default those of the cores, where there is work for them."""

import os
from pathlib import Path

import pytest
from pipeline_support import small_scene, write_scene

import pipeline.stages.curve.respond
from pipeline.scene.reading import read_scene
from pipeline.scene.schema import Scene
from pipeline.stages.curve.respond import longest_first, worker_count


@pytest.fixture(autouse=True)
def four_cores(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pipeline.stages.curve.respond, "_cores", lambda: 4)


def scene(folder: Path, harmonics: object) -> Scene:
    return read_scene(write_scene(folder / "s.toml", small_scene(response__harmonics=harmonics))).first


@pytest.mark.parametrize(("jobs", "curves", "expected"), [(1, 50, 1), (3, 50, 3), (8, 2, 2), (2, 0, 1)])
def test_as_many_as_asked_for_and_no_more_than_curves(tmp_path: Path, jobs: int, curves: int, expected: int) -> None:
    assert worker_count(jobs, [scene(tmp_path, 1)] * curves) == expected


def test_a_few_curves_with_one_harmonic_are_solved_here(tmp_path: Path) -> None:
    assert worker_count(None, [scene(tmp_path, 1)] * 11) == 1


def test_every_core_where_it_is_worth_it(tmp_path: Path) -> None:
    assert worker_count(None, [scene(tmp_path, 1)] * 1000) == 4
    assert worker_count(None, [scene(tmp_path, "auto")] * 12) == 4
    assert worker_count(None, [scene(tmp_path, 20)] * 3) == 3
    assert worker_count(None, [scene(tmp_path, 9)]) == 1


def test_what_takes_longest_begins_first(tmp_path: Path) -> None:
    values = [4e-4, -2e-5, 0.0, 1e-5]
    path = write_scene(tmp_path / "s.toml", small_scene(sweep={"contact.interference": values}))
    found = sorted((member.scene for member in read_scene(path).members), key=longest_first)
    assert [each.contact.interference for each in found] == [0.0, -2e-5, 1e-5, 4e-4]
    assert longest_first(scene(tmp_path, 9)) < longest_first(scene(tmp_path, 1))


def test_many_cores_do_not_take_all_memory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pipeline.stages.curve.respond, "_cores", lambda: 256)
    assert worker_count(None, [scene(tmp_path, 9)] * 1000) == 16
    assert worker_count(200, [scene(tmp_path, 9)] * 1000) == 200


def test_only_the_cores_that_this_process_may_use_count(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.undo()  # the four cores of the other tests
    monkeypatch.setattr(os, "cpu_count", lambda: 64)
    monkeypatch.setattr(os, "sched_getaffinity", lambda process: {3, 5, 7}, raising=False)
    assert worker_count(None, [scene(tmp_path, 9)] * 1000) == 3
    monkeypatch.delattr(os, "sched_getaffinity")  # as on systems without it
    monkeypatch.setattr(os, "cpu_count", lambda: 5)
    assert worker_count(None, [scene(tmp_path, 9)] * 1000) == 5
