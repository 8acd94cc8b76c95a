"""The stage `stress`: fields on the mesh, hot spots and pictures of the curves with the highest and lowest motion."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Sequence
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pipeline.figures.data import curve_colours
from pipeline.figures.figure_stage import Look, look_of
from pipeline.process.workers import call_apart
from pipeline.render.drawing_process import draw_apart
from pipeline.results.publishing import Attempts, PicturesMissing, published, remove_outdated
from pipeline.scene.labels import member_label
from pipeline.scene.material_section import Fatigue, Stress
from pipeline.scene.schema import Scene
from pipeline.stages.cache_keys import model_keys
from pipeline.stages.code_fingerprint import code_fingerprint
from pipeline.stages.curve.respond import CurveResult
from pipeline.stages.model.build_full_model import FULL_MODEL
from pipeline.stages.model.build_mesh import SECTOR
from pipeline.stages.model.model_chain import LARGE, BuiltModel, ModelChain
from pipeline.stages.model.sweep_models import Models
from pipeline.stages.request import Run
from pipeline.stages.stage import Stage
from pipeline.store.content_store import Entry
from pipeline.store.fingerprints import file_sha256, fingerprint
from pipeline.stress.job import StressJob
from pipeline.stress.operating_stress import CYCLES, FACTS, make_operating_stress

if TYPE_CHECKING:
    from matplotlib.figure import Figure

STRESS_CODE = "pipeline.stress.operating_stress"
DRAWER = "pipeline.stress.field_pictures"  # runs in a process of its own
FIGURES = "pipeline.stress.haigh"
FOLDER = "stress"
HAIGH, MARGIN = "haigh", "margin"  # names of figures
_UNTIL = f" --until {Stage.STRESS.value}"


def stress_stage(run: Run, models: Models, curves: Sequence[CurveResult]) -> tuple[list[Path], list[dict[str, Any]]]:
    """Files of the stage, and the entries of `stress` in summary.json."""
    target = run.request.out / FOLDER
    files: list[Path] = []
    entries: list[dict[str, Any]] = []
    attempts = Attempts(target)
    for number in chosen_curves(run.request.scene.first.stress or Stress(), curves):
        model = models[curves[number].member.index]
        if model is None or model.mesh is None:
            continue
        made = attempts.result(f"curve {number}", partial(_computed, run, model, curves[number], number))
        if made is None:
            continue
        of_curve, entry, cycles = made
        drawn = attempts.result(f"picture of curve {number}", partial(_drawn, run, curves[number], number, entry))
        drawn = drawn or []
        if cycles.is_file() and entry["hot_spots"]:
            draw = partial(_haigh_drawn, run, curves[number], entry, cycles)
            drawn += attempts.result(f"{HAIGH}_{number}", draw) or []
        entry["pictures"] = [p.relative_to(run.request.out).as_posix() for p in drawn if p.suffix != ".csv"]
        files += [*of_curve, *drawn]
        entries.append(entry)
    files += attempts.result(MARGIN, partial(_margins_drawn, run, curves, entries)) or []
    remove_outdated(target, ["stress_*.*", f"{HAIGH}_*.*", f"{MARGIN}.*"], files)
    if attempts.problems:
        raise StressMissing(files, attempts.problems, entries)
    return files, entries


class StressMissing(PicturesMissing):
    """Some results of the stage are missing; `entries`: those of the others."""

    def __init__(self, files: list[Path], problems: list[str], entries: list[dict[str, Any]]) -> None:
        super().__init__(files, problems)
        self.entries = entries


def chosen_curves(stress: Stress, curves: Sequence[CurveResult]) -> list[int]:
    """Numbers of the curves whose stress is computed: those listed, or the highest and the lowest worst motion."""
    heights = {number: _height(curve) for number, curve in enumerate(curves)}
    heights = {number: height for number, height in heights.items() if math.isfinite(height)}
    if stress.curves is False or not heights:
        return []
    if stress.curves is True:
        return sorted({max(heights, key=heights.__getitem__), min(heights, key=heights.__getitem__)})
    return sorted(heights if stress.curves == "all" else set(stress.curves) & set(heights))


def _height(curve: CurveResult) -> float:
    """Worst motion of a curve, or its peak where that is not known, m; nan without one."""
    if curve.facts is None:
        return math.nan
    worst = curve.facts.worst_amplitude_m
    return worst if math.isfinite(worst) else curve.facts.peak_amplitude_m


def _computed(
    run: Run, model: BuiltModel, curve: CurveResult, number: int
) -> tuple[list[Path], dict[str, Any], Path]:
    """Fields of one curve in the output folder, its entry of the summary, and the file of its cycles in the store."""
    name = f"stress_{number}"
    entry = _stress_of(run, model, curve, curve.member.scene, name)
    run.log.note(Stage.STRESS, entry.ran, entry.seconds)
    target = run.request.out / FOLDER / f"{name}.vtu"
    copy_file(run, entry.file(f"{name}.vtu"), target)
    facts = json.loads(entry.file(FACTS).read_text(encoding="utf-8"))
    head = {"curve": number, "file": f"{FOLDER}/{target.name}", "pictures": []}
    return [target], head | facts, entry.folder / CYCLES


def _stress_of(run: Run, model: BuiltModel, curve: CurveResult, scene: Scene, name: str) -> Entry:
    """The fields and facts of a curve, found in the store or made."""
    assert curve.file is not None
    assert model.mesh is not None
    sector, solved = model.mesh.parent / SECTOR, curve.file
    key = fingerprint(
        {
            "curve": curve.file.parent.name,
            "rom": model.key,
            "name": name,
            "stress": (scene.stress or Stress()).model_dump(exclude={"curves"}),
            "fatigue": None if scene.fatigue is None else scene.fatigue.model_dump(),
            "code": code_fingerprint(STRESS_CODE),
        }
    )
    chain = ModelChain(
        run.store, run.log, run.reporter, True, {(Stage.ASSEMBLE, model_keys(scene).assemble)}, run.request.force
    )

    def build(folder: Path) -> None:
        full = chain.full_model(scene, model_keys(scene), chain.mesh(scene, model_keys(scene))).file(FULL_MODEL)
        if full.stat().st_size > LARGE:
            call_apart(make_operating_stress, folder, name, solved, model.rom, sector, full, scene)
        else:
            make_operating_stress(folder, name, solved, model.rom, sector, full, scene)

    entry = run.store.find(Stage.STRESS, key)
    if entry is None:
        with run.reporter.working(name.replace("_", " of curve ")):
            entry = run.store.get(Stage.STRESS, key, build)
    return entry


def worst_stress(run: Run, curve: CurveResult, fatigue: Fatigue | None) -> dict[str, Any]:
    """Largest stress amplitude and least margin at the worst motion of any curve, as `stress_stage` has them."""
    scene = curve.member.scene.model_copy(update={"stress": Stress(check=False), "fatigue": fatigue})
    model = ModelChain(run.store, run.log, run.reporter, True, force=run.request.force).reduced_model(
        scene, model_keys(scene)
    )
    entry = _stress_of(run, model, curve, scene, FOLDER)
    found: dict[str, Any] = json.loads(entry.file(FACTS).read_text(encoding="utf-8"))
    return found


def _look(run: Run) -> Look:
    """The look of the figures, in the formats of the scene: the page shows none of them as a vector."""
    return replace(look_of(run, options=_UNTIL), formats=run.request.scene.first.figures.formats)


def _haigh_drawn(run: Run, curve: CurveResult, entry: dict[str, Any], cycles: Path) -> list[Path]:
    """The Haigh diagram of one curve."""
    import numpy as np

    scene, look, name = curve.member.scene, _look(run), f"{HAIGH}_{entry['curve']}"
    title = f"{look.title}, {member_label(curve.member)}" if curve.member.parameters else look.title
    heading = f"{title}: {entry['frequency_hz']:.1f} Hz\n{look.fixed}"
    if entry["motion"] != "periodic":
        heading += f"\n{entry['notes'][0]}"
    known = {name: value for name, value in entry.items() if name != "pictures"}
    assert scene.fatigue is not None
    limits = scene.fatigue

    def draw() -> Figure:
        from pipeline.stress.haigh import haigh_figure

        return haigh_figure(entry, np.load(cycles), limits, heading)

    content = [known, limits.model_dump(), heading, file_sha256(cycles)]
    return _figure_published(run, look, name, content, draw)


def _margins_drawn(run: Run, curves: Sequence[CurveResult], entries: Sequence[dict[str, Any]]) -> list[Path]:
    """The margins over the swept value, where several curves have one."""
    look, members = _look(run), [curves[entry["curve"]].member for entry in entries]
    colours = curve_colours([curve.member for curve in curves])

    def draw() -> Figure | None:
        from pipeline.stress.haigh import margin_figure

        heading = f"{look.title}\n{look.fixed}"
        return margin_figure(entries, members, dict(enumerate(colours)), heading, unsure)

    known = [
        {name: value for name, value in entry.items() if name.startswith(("curve", "least_"))} for entry in entries
    ]
    facts = {number: curve.facts for number, curve in enumerate(curves) if curve.facts is not None}
    unsure = [e["curve"] for e in entries if e["motion"] != "periodic" or facts[e["curve"]].worst_unresolved]
    content = [known, [dict(member.parameters) for member in members], colours, unsure]
    several = sum(entry["least_margin"] is not None for entry in entries) > 1
    return _figure_published(run, look, MARGIN, content, draw) if several else []


def _figure_published(
    run: Run, look: Look, name: str, content: list[Any], draw: Callable[[], Figure | None]
) -> list[Path]:
    """The files of a figure in the output folder, drawn where they are missing."""

    def build(folder: Path) -> None:
        from pipeline.figures.style import save, styled

        with styled():
            figure = draw()
            if figure is not None:
                save(figure, folder, name, look.formats, look.redraw)

    key = fingerprint({"name": name, "look": look.key, "content": content, "code": code_fingerprint(FIGURES)})
    return published(run, Stage.STRESS, key, f"drawing {name}", build, run.request.out / FOLDER)


def copy_file(run: Run, source: Path, target: Path) -> None:
    """Copy a file of the store into the output folder, in one step; nothing is done where it is there."""
    import filecmp
    import shutil

    if target.is_file() and filecmp.cmp(source, target, shallow=False):
        return
    with run.store.replacing(target) as (path,):
        shutil.copyfile(source, path)


def _drawn(run: Run, curve: CurveResult, number: int, entry: dict[str, Any]) -> list[Path]:
    """The picture of the fields of one curve."""
    scene: Scene = curve.member.scene
    label = f", {member_label(curve.member)}" if curve.member.parameters else ""
    fields = run.request.out / entry["file"]
    job = StressJob(
        fields="",
        folder="",
        name=f"stress_{number}",
        title=f"{scene.title or scene.name}{label}: {entry['frequency_hz']:.1f} Hz",
        hot_spots=tuple(tuple(spot["position_m"]) for spot in entry["hot_spots"]),
        largest_amplitude=entry["largest_amplitude_pa"],
        largest_mean=entry["largest_mean_pa"],
        required=entry["required_margin"] or 0.0,
    )
    content = {**asdict(job), "fields": file_sha256(fields), "code": code_fingerprint(DRAWER)}

    def draw(into: Path) -> None:
        text = replace(job, fields=str(fields), folder=str(into)).to_json()
        draw_apart(DRAWER, text, [into / f"{job.name}.png"])

    return published(
        run,
        Stage.STRESS,
        fingerprint(content),
        f"drawing the stress of curve {number}",
        draw,
        run.request.out / FOLDER,
    )
