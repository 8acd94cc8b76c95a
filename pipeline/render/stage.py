"""The stage render: mode shapes of every reduced model of the scene, drawn once and kept in the store."""

from __future__ import annotations

import math
import subprocess
import sys
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from pipeline.contact_values import stiffness_by_node, used_contact
from pipeline.curve import face_area
from pipeline.errors import one_line
from pipeline.fingerprint import fingerprint
from pipeline.making import SECTOR
from pipeline.model_stage import Models
from pipeline.models import BuiltModel
from pipeline.publishing import publish, retire
from pipeline.render.job import RenderJob
from pipeline.request import Run
from pipeline.scene import Render, Scene

_REMEDY = "apt-get install -y libegl1 libgl1 libxrender1"


class RenderError(Exception):
    """The drawing process did not come back with its pictures."""


def render_stage(run: Run, models: Models) -> list[Path]:
    """Draw what is missing; returns the files in the output folder."""
    chosen: dict[str, tuple[BuiltModel, Scene]] = {}
    for member in run.request.scene.members:
        model = models[member.index]
        if model is not None:
            chosen.setdefault(model.key, (model, member.scene))
    files: list[Path] = []
    for number, (model, scene) in enumerate(chosen.values(), start=1):
        prefix = f"model_{number}_" if len(chosen) > 1 else ""
        files += _render(run, model, scene, prefix)
    retire(run.request.out / "renders", ["mode_*.png", "model_*_mode_*.png"], files)
    return files


def _render(run: Run, model: BuiltModel, scene: Scene, prefix: str) -> list[Path]:
    job = _job(model, scene, prefix)
    content = {**asdict(job), "sector": None, "rom": model.key, "code": run.versions.render}
    key = fingerprint(content)
    entry = run.store.find("render", key)
    if entry is None:
        with run.reporter.working("rendering mode shapes"):
            entry = run.store.get("render", key, lambda folder: _draw(replace(job, folder=str(folder))))
    run.log.note("render", entry.ran)
    return publish(run.store, entry.folder, run.request.out / "renders")


def _job(model: BuiltModel, scene: Scene, prefix: str) -> RenderJob:
    render = scene.render or Render()
    assert model.mesh is not None
    assert scene.blade is not None
    blades = scene.blade.n_blades
    return RenderJob(
        sector=str(model.mesh.parent / SECTOR),
        rom=str(model.rom),
        folder="",
        prefix=prefix,
        title=scene.title or scene.name,
        modes=render.modes,
        deformation=render.deformation * scene.blade.length,
        contact=render.contact,
        blades=render.blades,
        phase=2.0 * math.pi * (scene.excitation.engine_order % blades) / blades,
        **_springs(model, scene, render.contact),
    )


def _springs(model: BuiltModel, scene: Scene, contact: str) -> dict[str, Any]:
    """Springs of each contact node: none when free, normal ones when sliding, all when stuck."""
    none = (0.0,) * int(model.facts["n_contacts"])
    if contact == "free":
        return {"normal": none, "tangential": none}
    from rom import read_reduced_model

    values = used_contact(scene, face_area(read_reduced_model(model.rom, with_basis=False)))
    normal = tuple(stiffness_by_node(values["normal_stiffness"], len(none)).tolist())
    tangential = tuple(stiffness_by_node(values["tangential_stiffness"], len(none)).tolist())
    return {"normal": normal, "tangential": tangential if contact == "stuck" else none}


def _draw(job: RenderJob) -> None:
    """Draw in a process of its own: without a GL library VTK does not raise, it crashes.

    Raises
    ------
    RenderError : the process died or a picture is missing; the message says what usually mends it.
    """
    command = [sys.executable, "-m", "pipeline.render.draw", job.to_json()]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    missing = [mode for mode in job.modes if not (Path(job.folder) / f"{job.prefix}mode_{mode}.png").is_file()]
    if result.returncode < 0:
        raise RenderError(f"the drawing process crashed, most likely for want of a GL library: {_REMEDY}")
    if result.returncode > 0 or missing:
        said = one_line((result.stderr.strip().splitlines() or ["no picture"])[-1])
        raise RenderError(f"{said} (if a GL library is missing: {_REMEDY})")
