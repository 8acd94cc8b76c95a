"""A scene whose knobs are turned: its views against a run of the scene as it stands, what is kept, what ends."""

import itertools
import os
import signal
import time
from collections.abc import Iterator
from contextlib import closing
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pipeline_support import WHOLE, ground_model, ground_scene, small_scene
from test_damper_in_a_scene import damped

from nonlinear import ResponseCurve
from nonlinear.contact.parameters import LIFT_OFF, STICK
from pipeline import InputError, run_scene
from pipeline.explore.computation import ComputationDied
from pipeline.explore.live import LiveScene
from pipeline.explore.models import build_model
from pipeline.explore.views import FIRST, LAST
from pipeline.figures.linear_limits import limit_of
from pipeline.stages.curve.curve_file import read_curve
from pipeline.stages.scene_to_solver import nonlinear_problem
from rom import read_reduced_model

pytestmark = pytest.mark.xdist_group("explore")  # one worker: one process behind the scene for all
STAGES = ["main branch", "truncation error", "detached branches", LAST]
SWEPT = "contact.interference"


@pytest.fixture(scope="module")
def live(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LiveScene]:
    """The small scene, opened."""
    tables = small_scene(**WHOLE | {"response__search": "quick"}, sweep={SWEPT: [-1e-3, 0.0, 1e-5, 1e-3]})
    scene = LiveScene.open(tables, tmp_path_factory.mktemp("explore"))
    yield scene
    scene.close()


def same(one: ResponseCurve, other: ResponseCurve) -> bool:
    """Whether two curves are the same to the bit, but for the time that they took."""
    for field in fields(one):
        if field.name == "seconds":
            continue
        a, b = getattr(one, field.name), getattr(other, field.name)
        if field.name == "detached":
            equal = len(a) == len(b) and all(same(x, y) for x, y in zip(a, b, strict=True))
        elif isinstance(a, np.ndarray):
            equal = np.array_equal(a, b, equal_nan=a.dtype.kind in "fc")
        else:
            equal = repr(a) == repr(b)
        if not equal:
            return False
    return True


def test_the_last_view_is_the_run_of_the_scene_as_it_stands(live: LiveScene, tmp_path: Path) -> None:
    turned = live.turned({"contact.friction": 0.25, SWEPT: 4e-6, "excitation.force": 0.7})
    views = list(turned.refined())
    assert [view.stage for view in views] == STAGES
    assert [view.is_last for view in views] == [False, False, False, True]
    scene = tmp_path / "as_it_stands.toml"
    scene.write_text(turned.scene_text(), encoding="utf-8")
    found = run_scene(scene, tmp_path / "out", until="respond")
    (file,) = (tmp_path / "out" / "store" / "curve").glob("*/curve.h5")
    assert same(views[-1].response, read_curve(file))
    assert views[-1].facts.worst_amplitude_m == found.summary["curves"][0]["worst_amplitude_m"]
    first = turned.curve()
    assert (first.stage, first.response.harmonics) == (FIRST, 1)
    assert first.facts.peak_amplitude_m == pytest.approx(views[-1].facts.peak_amplitude_m, rel=0.2)


def test_a_first_look_is_given_up_by_its_work_and_not_by_the_clock(
    live: LiveScene, monkeypatch: pytest.MonkeyPatch
) -> None:
    clock = itertools.count(0.0, 10.0)
    monkeypatch.setattr(time, "monotonic", lambda: next(clock))
    assert live.curve().response.termination.complete


def test_a_view_says_how_sure_it_is(live: LiveScene) -> None:
    first, *views = (view.certainty for view in (live.curve(), *live.refined()))
    assert "first look" in first
    assert "not known yet" in views[0]
    assert "truncation" not in views[0]
    assert "neglected harmonics change the peak" in views[1]
    assert views[-1].startswith("All that the scene asks for")
    assert "searched" in views[-1]
    assert all("\n" not in said for said in (first, *views))


def test_a_cancelled_view_ends_at_once_and_the_next_one_comes(live: LiveScene) -> None:
    thorough = live.turned({"response.search": "thorough", "response.harmonics": 5})
    start = time.monotonic()
    stages = [view.stage for view in thorough.refined(lambda: time.monotonic() > start + 0.1)]
    assert stages != STAGES
    process = live.computation._process
    assert [view.stage for view in live.refined()] == STAGES
    assert live.computation._process is process  # it has heeded
    for view in live.refined():  # nobody waits for the others
        assert view.stage == STAGES[0]
        break
    assert [view.stage for view in live.refined()] == STAGES


def test_a_process_that_dies_is_told_and_replaced(live: LiveScene) -> None:
    assert live.computation._process is not None
    assert live.computation._process.pid is not None
    views = live.refined()
    next(views)
    os.kill(live.computation._process.pid, signal.SIGKILL)
    with pytest.raises(ComputationDied, match="has ended"):
        list(views)
    assert [view.stage for view in live.refined()] == STAGES


def test_what_a_knob_does_not_touch_is_kept(live: LiveScene, monkeypatch: pytest.MonkeyPatch) -> None:
    before = live.curve()
    monkeypatch.setattr("pipeline.explore.models.build_model", None)
    rubbing = live.turned({"contact.friction": 0.1}).curve()
    assert [a.amplitude_m is b.amplitude_m for a, b in zip(before.limits, rubbing.limits, strict=True)] == [False] * 2
    assert all(
        np.array_equal(a.amplitude_m, b.amplitude_m) for a, b in zip(before.limits, rubbing.limits, strict=True)
    )
    kept = len(live.models._limits)
    live.turned({"contact.friction": 0.2, "excitation.force": 3.0, SWEPT: 1e-6}).curve()
    assert len(live.models._limits) == kept
    live.turned({"contact.tangential_stiffness": 1e5}).curve()
    assert len(live.models._limits) == kept + 1  # the free one does not depend on springs
    assert live.values == {}
    assert live.turned({"contact.friction": 0.1}).values == {"contact.friction": 0.1}


def test_limits_are_those_of_the_figures(live: LiveScene) -> None:
    turned = live.turned({"excitation.force": 3.0})
    problem = nonlinear_problem(turned.scene, turned.loaded.model)[:3]
    for limit in turned.curve().limits:
        fine = limit_of(limit.kind, turned.loaded.model, problem, turned.scene.response.frequency)
        assert fine is not None
        assert limit.resonance is not None
        assert fine.resonance is not None
        assert limit.resonance == pytest.approx(fine.resonance, rel=1e-3)
        assert np.interp(limit.frequency_hz, fine.frequency_hz, fine.amplitude_m) == pytest.approx(
            limit.amplitude_m, rel=0.05
        )


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("contact.friction", -1.0),
        (SWEPT, 3.0),
        ("excitation.engine_order", 1.5),
        ("contact.none", 1),
        ("contact.friction", [0.1, 0.2]),
    ],
)
def test_a_bad_value_is_refused_in_one_line(live: LiveScene, key: str, value: Any) -> None:
    with pytest.raises(InputError) as refused:
        live.turned({key: value})
    said = str(refused.value)
    assert key.partition(".")[2] in said
    assert "\n" not in said
    assert "allowed: " in said or "unknown key" in said


def test_ranges_reach_from_faces_apart_to_faces_that_stick(live: LiveScene) -> None:
    knobs = {knob.key: knob for knob in live.knobs}
    for knob in knobs.values():
        if knob.kind != "choice":
            assert knob.low < knob.high
            assert knob.low <= knob.value <= knob.high
            ends = [live.turned({knob.key: knob.at(end)}) for end in (0.0, 0.5, 1.0)] if not knob.remeshes else []
            assert all(scene.is_ready for scene in ends)
    interference = knobs[SWEPT]
    apart, pressed = (live.turned({SWEPT: end}).curve().response for end in (interference.low, interference.high))
    nodes = apart.relative_displacement.shape[2]
    assert (apart.separating == nodes).all()
    assert (pressed.sticking == nodes).all()
    assert apart.static_contact is not None
    assert apart.static_contact.force_n == 0.0
    assert not knobs["contact.friction"].remeshes
    assert knobs["shroud.angle"].remeshes
    assert knobs["shroud.angle"].seconds > knobs["material.density"].seconds > 0.0
    assert knobs["excitation.engine_order"].high == live.scene.n_blades // 2  # type: ignore[operator]
    assert 0.0 <= knobs["contact.normal_stiffness"].position(2e5) <= 1.0


def test_a_point_is_that_of_the_curve(live: LiveScene) -> None:
    turned = live.turned({SWEPT: 2e-6})
    view = turned.curve()
    curve = view.response
    assert curve.peak is not None
    index = curve.peak.index
    point = turned.point(view, index)
    assert np.abs(point.output_m).max() == pytest.approx(curve.amplitude_m[index], rel=1e-3)
    assert point.dissipated_j.sum() == pytest.approx(curve.dissipated_j[index], rel=1e-6)
    assert (point.state == STICK).sum() == curve.sticking[index]
    x, y = point.loop(0, 0)
    assert x[0] == x[-1]
    assert y[0] == y[-1]
    area = sum(
        np.trapezoid(*reversed(point.loop(node, component)))
        for node in range(len(point.state))
        for component in (0, 1)
    )
    assert area == pytest.approx(curve.dissipated_j[index], rel=2e-2)
    assert [nodes.interface for nodes in point.interfaces] == ["shroud"]
    shape = turned.shape(view, index)
    assert shape is not None
    assert shape.motion.harmonics.shape == (2, *shape.points.shape)
    tip = np.abs(shape.motion.harmonics[1][:, 1]).max()
    assert tip == pytest.approx(np.abs(curve.output[index, 1]), rel=0.5)


def test_another_mesh_is_built_apart(live: LiveScene) -> None:
    turned = live.turned({"mesh.size": 0.011})
    assert not turned.is_ready
    assert list(turned.build(lambda: True)) == []
    assert not turned.is_ready
    assert any("meshing" in line for line in list(turned.build()))
    assert turned.is_ready
    assert turned.curve().response.points > 0


def test_the_optimum_is_searched_from_the_scene_as_it_stands(live: LiveScene) -> None:
    with closing(live.turned({"contact.friction": 0.3}).optimum([SWEPT])) as asked:  # which cancels it
        assert any(str(line).startswith("note: contact.interference from ") for line in asked)
    with pytest.raises(InputError, match=r"--over contact\.none: unknown key"):
        list(live.optimum(["contact.none"]))


def test_a_damper_in_memory_is_that_of_the_store(tmp_path: Path) -> None:
    with_damper = LiveScene.open(damped(), tmp_path)
    try:
        turned = with_damper.turned({"damper.mass": 0.02})
        own = turned.loaded.model
        built = build_model(tmp_path, None, turned.file, turned.member, turned.models.reporter)
        stored = read_reduced_model(built.rom, with_basis=False)
        for name in ("mass", "stiffness", "contact_right", "force_excitation", "force_centrifugal"):
            assert np.array_equal(getattr(own, name), getattr(stored, name))
        assert own.interfaces == stored.interfaces
        assert turned.curve().facts.peak_amplitude_m != with_damper.curve().facts.peak_amplitude_m
        assert not next(knob for knob in turned.knobs if knob.key == "damper.mass").remeshes
    finally:
        with_damper.close()


def test_a_model_from_elsewhere_has_knobs_too(tmp_path: Path) -> None:
    scene = LiveScene.open(ground_scene(), tmp_path, rom=ground_model())
    try:
        turned = scene.turned({"contact.preload": 1e-3})  # a list node by node, of which this is the mean
        assert turned.scene.contact.preload == pytest.approx([1e-3 * n / 3.8 * 3.0 for n in (1.6, 1.2, 1.0)])
        view = turned.curve()
        assert view.response.points > 0
        assert all(not knob.remeshes for knob in scene.knobs)
        assert turned.shape(view, 0) is None
        assert LIFT_OFF in turned.point(view, int(view.response.amplitude_m.argmax())).state
    finally:
        scene.close()
