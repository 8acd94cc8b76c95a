"""The stage `render`: mode shapes of every reduced model and operating deflection shapes."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from pipeline.render.drawing_process import Drawing, OperatingJob, RenderJob, draw_apart
from pipeline.results.publishing import Attempts, PicturesMissing, published, remove_outdated
from pipeline.scene.labels import member_label
from pipeline.scene.schema import Render, Scene
from pipeline.stages.cache_keys import model_keys, stiffness_inputs
from pipeline.stages.code_fingerprint import code_fingerprint
from pipeline.stages.curve.respond import CurveResult
from pipeline.stages.model.build_mesh import SECTOR
from pipeline.stages.model.model_chain import WITH_BASIS, BuiltModel
from pipeline.stages.model.scene_materials import own_findings
from pipeline.stages.model.sweep_models import Models
from pipeline.stages.request import Run
from pipeline.stages.scene_to_solver import contact_on_model
from pipeline.store.fingerprints import fingerprint

FRAMES = 24  # of an animation
MODES_DRAWER = "pipeline.render.mode_shapes"  # runs in a process of its own, as the next
OPERATING_DRAWER = "pipeline.render.operating_shapes"
SPRINGS = "pipeline.stages.scene_to_solver"  # computes the springs of a job


@dataclass
class RenderingAhead:
    """Mode shapes of the first model, drawn beside the curves by a process that gives way to those of the curves."""

    run: Run  # the run
    folder: Path  # where the pictures go until `render_stage` asks for them
    # the process, started while the model is built: it loads its libraries until there is something to draw
    waiting: Drawing | None = None

    def prepare(self) -> None:
        """Start the process where the first model is to be built, so that there will be something to draw."""
        request, scene = self.run.request, self.run.request.scene.first
        with suppress(Exception):  # `render_stage` tries again, and tells what is wrong
            if request.rom is None and not self.run.store.find(WITH_BASIS, model_keys(scene).reduce, thorough=False):
                self.waiting = Drawing(MODES_DRAWER, None, aside=True)

    def begin(self, models: Models) -> None:
        """Draw where the pictures are missing; `render_stage` waits for them."""
        with suppress(Exception):
            chosen = _models_to_draw(self.run, models)
            key = _key(*chosen[0])
            if self.run.store.find("render", key, thorough=False) is None:
                text = replace(_job(*chosen[0]), folder=str(self.folder)).to_json()
                if self.waiting is None:
                    _ahead[key] = Drawing(MODES_DRAWER, text, aside=True), self.folder
                else:
                    self.waiting.begin(text)
                    _ahead[key], self.waiting = (self.waiting, self.folder), None

    def end(self) -> None:
        """End the processes that nobody has waited for."""
        while _ahead:
            _ahead.popitem()[1][0].end()
        if self.waiting is not None:
            self.waiting.end()


@contextmanager
def rendering_ahead(run: Run) -> Iterator[RenderingAhead]:
    """A block beside which the mode shapes of the first model are drawn."""
    with run.store.temporary() as folder:
        ahead = RenderingAhead(run, folder)
        try:
            ahead.prepare()
            yield ahead
        finally:
            ahead.end()


_ahead: dict[str, tuple[Drawing, Path]] = {}  # processes that draw mode shapes, and their folders, by key


def render_stage(run: Run, models: Models, curves: Sequence[CurveResult]) -> list[Path]:
    """The renders of the run; those that are missing are drawn. `curves` is empty where no curve was solved."""
    files: list[Path] = []
    attempts = Attempts(run.request.out)
    for model, scene, prefix in _models_to_draw(run, models):
        files += attempts.result(f"{prefix}mode shapes", partial(_render, run, model, scene, prefix)) or []
    for number in operating_curves(run.request.scene.first.render, curves):
        built = models[curves[number].member.index]
        if built is not None:
            drawn = partial(_operate, run, built, curves[number], number)
            files += attempts.result(f"motion of curve {number}", drawn) or []
    remove_outdated(run.request.out / "renders", ["mode_*.png", "model_*_mode_*.png", "operating_*.*"], files)
    if attempts.problems:
        raise PicturesMissing(files, attempts.problems)
    return files


def _models_to_draw(run: Run, models: Models) -> list[tuple[BuiltModel, Scene, str]]:
    """Every model with the scene of its first member and the prefix of its pictures."""
    chosen: dict[str, tuple[BuiltModel, Scene]] = {}
    for member in run.request.scene.members:
        built = models[member.index]
        if built is not None:
            chosen.setdefault(built.key, (built, member.scene))
    return [
        (model, scene, f"model_{number}_" if len(chosen) > 1 else "")
        for number, (model, scene) in enumerate(chosen.values(), start=1)
    ]


def operating_curves(render: Render | None, curves: Sequence[CurveResult]) -> list[int]:
    """Numbers of the curves whose motion is drawn: those listed in the scene, or the highest and the lowest peak."""
    if render is None or render.operating is False:
        return []
    peaks = {
        number: curve.facts.peak_amplitude_m
        for number, curve in enumerate(curves)
        if curve.facts is not None and curve.facts.peak_index >= 0
    }
    if render.operating is True:
        ends = [max(peaks, key=peaks.__getitem__), min(peaks, key=peaks.__getitem__)] if peaks else []
        return sorted(set(ends))
    return sorted(set(render.operating) & set(peaks))


def _render(run: Run, model: BuiltModel, scene: Scene, prefix: str) -> list[Path]:
    key = _key(model, scene, prefix)
    doing, folder = "rendering mode shapes", run.request.out / "renders"

    def draw(into: Path) -> None:
        _draw(replace(_job(model, scene, prefix), folder=str(into)), key)

    return published(run, "render", key, doing, draw, folder)


def _key(model: BuiltModel, scene: Scene, prefix: str) -> str:
    """Key in the store of the mode shapes of a model. It needs no model: springs follow from it and the scene."""
    content = {
        **_common(model, scene, prefix),
        "sector": None,
        "rom": model.key,
        "code": code_fingerprint(MODES_DRAWER),
    }
    return fingerprint(content | {"stiffness": stiffness_inputs(scene), "springs": code_fingerprint(SPRINGS)})


def _operate(run: Run, model: BuiltModel, curve: CurveResult, number: int) -> list[Path]:
    """The still and the animation of one curve's motion at its peak."""
    scene = curve.member.scene
    render = scene.render or Render()
    assert model.mesh is not None
    assert curve.file is not None
    label = f", {member_label(curve.member)}" if curve.member.parameters else ""
    job = OperatingJob(
        sector=str(model.mesh.parent / SECTOR),
        rom=str(model.rom),
        curve=str(curve.file),
        folder="",
        name=f"operating_{number}",
        title=f"{scene.title or scene.name}{label}: motion at the peak",
        deformation=render.deformation * _length(model, scene),
        blades=render.blades,
        frames=FRAMES,
    )
    content = {**asdict(job), "sector": None, "rom": model.key, "curve": curve.file.parent.name}
    key = fingerprint(content | {"code": code_fingerprint(OPERATING_DRAWER)})
    doing, folder = f"rendering the motion at the peak of curve {number}", run.request.out / "renders"
    return published(run, "render", key, doing, lambda into: _draw_operating(replace(job, folder=str(into))), folder)


def _draw_operating(job: OperatingJob) -> None:
    pictures = [Path(job.folder) / f"{job.name}.{suffix}" for suffix in ("png", "gif")]
    draw_apart(OPERATING_DRAWER, job.to_json(), pictures)


def _job(model: BuiltModel, scene: Scene, prefix: str) -> RenderJob:
    """The mode shapes of a model, without a folder."""
    common = _common(model, scene, prefix)
    springs = _springs(model, scene, common["contact"]) | _stuck_springs(model, scene, common["contact"])
    return RenderJob(folder="", **common, **springs)


def _common(model: BuiltModel, scene: Scene, prefix: str) -> dict[str, Any]:
    """What a job says beside its folder and its springs."""
    from rom.cyclic.cyclic_symmetry import inter_blade_phase

    render = scene.render or Render()
    assert model.mesh is not None
    assert scene.n_blades is not None
    return {
        "sector": str(model.mesh.parent / SECTOR),
        "rom": str(model.rom),
        "prefix": prefix,
        "title": scene.title or scene.name,
        "modes": render.modes,
        "deformation": render.deformation * _length(model, scene),
        "contact": render.contact,
        "blades": render.blades,
        "phase": inter_blade_phase(scene.excitation.engine_order, scene.n_blades),
        "coriolis": scene.load.coriolis and scene.load.speed_rpm != 0.0,
    }


def _length(model: BuiltModel, scene: Scene) -> float:
    """Length of the blade, hub to tip, m."""
    if scene.blade is not None:
        return scene.blade.length
    assert model.mesh is not None
    found = own_findings(model.mesh.parent)
    length: float = found["tip_radius"] - found["hub_radius"]
    return length


def _stuck_springs(model: BuiltModel, scene: Scene, contact: str) -> dict[str, Any]:
    """Springs of stuck shrouds, whose modes stand beside those of free ones."""
    if contact != "free":
        return {}
    return {f"stuck_{name}": values for name, values in _springs(model, scene, "stuck").items()}


def _springs(model: BuiltModel, scene: Scene, contact: str) -> dict[str, Any]:
    """Springs of each contact node: none when free, normal ones when sliding, all when stuck."""
    none = (0.0,) * int(model.facts["n_contacts"])
    if contact == "free":
        return {"normal": none, "tangential": none}
    from rom.files.reduced_model_file import read_reduced_model

    springs = contact_on_model(scene, read_reduced_model(model.rom, with_basis=False))
    tangential = tuple(springs.tangential_stiffness.tolist())
    return {
        "normal": tuple(springs.normal_stiffness.tolist()),
        "tangential": tangential if contact == "stuck" else none,
    }


def _draw(job: RenderJob, key: str) -> None:
    """Draw the pictures of a job, or wait for the process that has begun to."""
    names = [f"{job.prefix}mode_{mode}.png" for mode in job.modes]
    folder = Path(job.folder)
    if key not in _ahead:
        draw_apart(MODES_DRAWER, job.to_json(), [folder / name for name in names])
        return
    drawing, place = _ahead.pop(key)
    drawing.finish([place / name for name in names])
    for name in names:
        os.replace(place / name, folder / name)
