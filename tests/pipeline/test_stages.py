"""Which stages run, as summary.json tells it: only what is needed and only what has changed."""

import io
import json
import shutil
import tomllib
from dataclasses import replace
from itertools import cycle, pairwise
from pathlib import Path
from typing import Any

import h5py
import pytest
from PIL import Image
from pipeline_support import (
    WHOLE,
    ground_scene,
    shroud,
    small_scene,
    statuses,
    summary_of,
    write_ground_model,
    write_scene,
)

import pipeline.figures.style
import pipeline.render.render_stage
import pipeline.stress.stress_stage
from pipeline import InputError, run_scene
from pipeline.render.drawing_process import RenderJob
from pipeline.stages.stage import Stage
from rom import read_reduced_model
from rom.cyclic.natural_frequencies import mode_shapes
from rom.files.sector_file import load_sector

ALL = ("mesh", "assemble", "reduce", "respond", "study", "stresses", "render", "figures", "report")
NOT_ASKED = {"study": "skipped", "stresses": "skipped", "render": "skipped", "report": "skipped"}
SWEEP = {"contact.interference": [1e-5, 1e-3]}


def rerun(out: Path, *options: str, **changes: Any) -> dict[str, str]:
    """Run the changed scene into the folder; what became of each stage."""
    scene = write_scene(out.parent / "scene.toml", small_scene(**{"sweep": SWEEP, **changes}))
    status, _, error = shroud("run", scene, "--out", out, "--quiet", *options)
    assert (status, error) == (0, "")
    return statuses(out)


def expected(**status: str) -> dict[str, str]:
    """Every stage reused but stresses, render and report, which nobody asked for, and what is given."""
    return dict.fromkeys(ALL, "reused") | NOT_ASKED | status


def test_a_first_run_runs_what_the_scene_asks_for(finished: Path) -> None:
    assert statuses(finished) == dict.fromkeys(ALL, "ran") | NOT_ASKED
    assert all(stage["seconds"] >= 0.0 for stage in summary_of(finished)["stages"].values())


def test_nothing_runs_when_nothing_has_changed(copied: Path) -> None:
    before = {path: path.read_bytes() for path in copied.glob("response.*")}
    assert rerun(copied) == expected()
    assert {path: path.read_bytes() for path in copied.glob("response.csv")}.items() <= before.items()


def test_comments_order_and_notation_do_not_matter(copied: Path) -> None:
    scene = small_scene(sweep=SWEEP)
    turned = {section: dict(reversed(keys.items())) for section, keys in scene.items() if isinstance(keys, dict)}
    path = write_scene(copied.parent / "scene.toml", {"name": "small", "title": scene["title"], **turned})
    path.write_text("# a comment\n" + path.read_text().replace("0.036", "3.6e-2"))
    assert shroud("run", path, "--out", copied, "--quiet")[0] == 0
    assert statuses(copied) == expected()


def test_another_interference_keeps_mesh_and_reduced_model(copied: Path) -> None:
    assert rerun(copied, sweep={"contact.interference": [1e-5, 2e-5]}) == expected(respond="ran", figures="ran")
    respond = summary_of(copied)["stages"]["respond"]
    assert (respond["ran"], respond["reused"]) == (1, 1)


def test_another_material_keeps_the_mesh(copied: Path) -> None:
    found = rerun(copied, "--until", "reduce", material__density=8000.0)
    assert found == expected(assemble="ran", reduce="ran", respond="skipped", figures="skipped")


def test_another_number_of_modes_keeps_the_matrices(copied: Path) -> None:
    found = rerun(copied, "--until", "reduce", rom__modes=5)
    assert found == expected(reduce="ran", respond="skipped", figures="skipped")


def test_contact_dofs_on_patches_are_another_reduced_model_of_the_same_matrices(copied: Path) -> None:
    found = rerun(copied, sweep={"rom.contact_dofs": ["nodal", "patch"]})
    assert found == expected(reduce="ran", respond="ran", figures="ran")
    nodal, patch = summary_of(copied)["models"]
    assert nodal["reduced_dofs"] == patch["reduced_dofs"]
    for joint in ("free_hz", "stuck_hz"):
        first, second = ((model[joint] if joint == "free_hz" else model[joint]["36"])[0] for model in (nodal, patch))
        assert first == pytest.approx(second, rel=0.05)
        assert first != second


def test_a_basis_is_stored_where_something_is_expanded_with_it(copied: Path) -> None:
    """And a model with a basis is the same model: curves are kept, and it serves where none is needed."""

    def basis_of(out: Path) -> Any:
        return read_reduced_model(out / summary_of(out)["models"][0]["rom"]).basis

    assert basis_of(copied) is None
    assert rerun(copied, render={"modes": [1]}) == expected(reduce="ran", render="ran")
    assert basis_of(copied) is not None
    assert rerun(copied) == expected()
    assert basis_of(copied) is not None


def test_another_angle_builds_everything(copied: Path) -> None:
    found = rerun(copied, "--until", "reduce", shroud__angle=80.0)
    assert found == expected(mesh="ran", assemble="ran", reduce="ran", respond="skipped", figures="skipped")


def test_another_damping_or_title_keeps_what_it_can(copied: Path) -> None:
    assert rerun(copied, title="Another") == expected(figures="ran")
    assert rerun(copied, response__damping_ratio=0.02) == expected(respond="ran", figures="ran")


def test_what_was_computed_before_is_found_again(copied: Path) -> None:
    """The response is written again once, not each time."""
    assert rerun(copied, "--until", "respond", contact__friction=0.3)["respond"] == "ran"
    assert rerun(copied) == expected()
    written = (copied / "response.h5").stat().st_mtime_ns
    assert rerun(copied) == expected()
    assert (copied / "response.h5").stat().st_mtime_ns == written


def test_a_longer_search_goes_on_from_a_shorter_one(copied: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The curve is not solved again, and the search gets what the shorter one has found."""
    rerun(copied, "--until", "respond", "--jobs", "1", **WHOLE)
    before, given = summary_of(copied)["curves"], []

    def worst(problem: Any, curve: Any, standard: Any = None) -> Any:
        given.append(problem[3].search)
        return replace(standard, amplitude_m=1.0)

    thorough = WHOLE | {"response__search": "thorough"}
    monkeypatch.setattr("nonlinear.worst_motion.worst_motion.find_worst_motion", worst)
    monkeypatch.setattr("nonlinear.response_solver.forced_response", None)
    assert rerun(copied, "--until", "respond", "--jobs", "1", **thorough)["respond"] == "ran"
    after = summary_of(copied)["curves"]
    assert given == ["thorough"] * len(before)
    assert [curve["peak_amplitude_m"] for curve in after] == [curve["peak_amplitude_m"] for curve in before]
    assert [curve["worst_amplitude_m"] for curve in after] == [1.0] * len(before)
    with h5py.File(copied / "response.h5") as file:
        assert file["curve/0"].attrs["response.search"] == "thorough"


@pytest.mark.parametrize(
    ("stage", "needs"),
    [
        ("mesh", ("mesh",)),
        ("assemble", ("mesh", "assemble")),
        ("reduce", ("mesh", "assemble", "reduce")),
        ("respond", ("mesh", "assemble", "reduce", "respond")),
        ("figures", ("mesh", "assemble", "reduce", "respond", "figures")),
    ],
)
def test_until_runs_what_the_stage_needs(copied: Path, stage: str, needs: tuple[str, ...]) -> None:
    found = rerun(copied, "--until", stage)
    assert found == {name: "reused" if name in needs else "skipped" for name in ALL}


SHIPPED = sorted(path.stem for path in (Path(__file__).parents[2] / "scenes").glob("*.toml"))
# the blade of dummy under other conditions; blades from sections, which take long to mesh (test_machines)
SHIPPED = [name for name in SHIPPED if not name.startswith(("figure", "e3_", "test_cell"))]
ORDERS = (  # pictures from nothing, then the other way round: on a model that was stored without a basis
    ("render", "mesh", "stresses", "assemble", "figures", "study", "render", "respond", "report", "reduce"),
    ("assemble", "respond", "study", "render", "reduce", "stresses", "mesh", "render"),
    ("stresses", "report"),
)
CASES = [  # with a disk the same steps take three times as long; the mesh of root.toml is as fine as its file
    pytest.param(name, ORDERS[2] if name == "root" else order, marks=[pytest.mark.long] if name == "disk" else [])
    for name, order in zip(SHIPPED, cycle(ORDERS[:2]), strict=False)
]


def coarse(name: str) -> dict[str, Any]:
    """A shipped scene on a coarse mesh, with one short curve and the study that needs no curves of its own."""
    scene = tomllib.loads((Path(__file__).parents[2] / "scenes" / f"{name}.toml").read_text())
    low = scene["response"]["frequency"][0]
    quick = {"detached": False, "truncation": False, "search": "off"}
    scene["response"] |= {"harmonics": 1, "frequency": [low, 1.02 * low], "stability": "folds", **quick}
    scene["response"].pop("tolerance", None)
    sweep = {key: values[-1] for key, values in scene.get("sweep", {}).items()}
    scene["sweep"] = {key: [each[:4] if isinstance(each, list) else each] for key, each in sweep.items()}
    for study in ("map", "optimum", "uncertainty", "flutter", "wear"):
        scene.pop(study, None)
    mesh = {"size": 0.012, "element": "hex8", "contact_grid": [2, 2]}
    if "file" in (given := scene.get("mesh", {})):
        mesh = given | {"file": str(Path(__file__).parents[2] / "scenes" / given["file"])}
    return scene | {"mesh": mesh, "rom": {"modes": 4}}


@pytest.fixture
def plain_pictures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pictures of one pixel: what they show is computed as far as the model must allow it, but not drawn."""

    pixel = io.BytesIO()
    Image.new("RGB", (1, 1)).save(pixel, format="png")
    kinds = {"png": pixel.getvalue(), "svg": b'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 1 1"/>'}

    def draw(module: str, text: str, pictures: list[Path]) -> None:
        if module == pipeline.render.render_stage.MODES_DRAWER:
            job = RenderJob.from_json(text)
            springs = {"normal": job.normal, "tangential": job.tangential}
            _, shapes = mode_shapes(read_reduced_model(job.rom), job.phase, count=max(job.modes), **springs)
            assert shapes.shape == (max(job.modes), len(load_sector(job.sector).points), 3)
        for picture in pictures:
            picture.write_bytes(kinds["png"])

    monkeypatch.setattr(pipeline.figures.style, "drawn", lambda _, form: kinds[form])
    monkeypatch.setattr(pipeline.render.render_stage, "draw_apart", draw)
    monkeypatch.setattr(pipeline.stress.stress_stage, "draw_apart", draw)
    for begins in ("prepare", "begin"):
        monkeypatch.setattr(pipeline.render.render_stage.RenderingAhead, begins, lambda *_: None)


@pytest.mark.usefixtures("plain_pictures")
@pytest.mark.parametrize(("name", "order"), CASES)
def test_every_stage_of_every_shipped_scene_works_by_its_name_alone(
    tmp_path: Path, name: str, order: tuple[str, ...]
) -> None:
    """With or without a section of its own: three modes are drawn, stress is computed at the highest motion."""
    scene = write_scene(tmp_path / "s.toml", coarse(name))
    asked, out = tomllib.loads(scene.read_text()), tmp_path / "out"
    for stage in order:
        status, _, error = shroud("run", scene, "--out", out, "--until", stage)
        assert status == 0, f"{stage}: {error}"
        nothing = stage == "study" and "backbone" not in asked
        assert (statuses(out)[stage] == "skipped") == nothing
        assert error.count("note: study: the scene asks for none") == nothing
        summary = summary_of(out)
        assert summary["complete"]
        pictures = {
            "render": "renders/mode_3.png",
            "stresses": "stress/stress_0.png",
            "figures": "figures/response.png",
        }
        if stage in pictures:
            assert pictures[stage] in summary["pictures"]
            assert (out / pictures[stage]).is_file()
    assert (out / "report.html").is_file() == ("report" in order)


def test_a_stage_that_the_model_does_not_allow_is_refused(tmp_path: Path) -> None:
    rom, scene = write_ground_model(tmp_path / "rom.h5"), write_scene(tmp_path / "g.toml", ground_scene())
    for stage in ("render", "stresses"):
        with pytest.raises(InputError, match=f"{stage}: asked for beside .*rom.h5, allowed: a scene with a mesh"):
            run_scene(scene, tmp_path / "out", rom=rom, until=stage, quiet=True)
    free = coarse("disk")
    free["disk"]["bore"] = "free"
    status, _, error = shroud(
        "run", write_scene(tmp_path / "f.toml", free), "--out", tmp_path / "f", "--until", "stresses"
    )
    assert (status, error.count("\n")) == (2, 1)
    assert error.endswith('stresses: asked for with disk.bore = "free", allowed: disk.bore = "clamped"\n')


def test_recompute_makes_everything_again_and_force_nothing(copied: Path) -> None:
    assert rerun(copied, "--recompute") == dict.fromkeys(ALL, "ran") | NOT_ASKED
    assert "ran" not in rerun(copied, "--force").values()  # which only takes values far beyond the usual


def test_members_of_a_sweep_share_what_they_have_in_common(copied: Path) -> None:
    sweep = {"shroud.angle": [70.0, 80.0], "contact.friction": [0.3, 0.4]}
    rerun(copied, "--until", "respond", sweep=sweep, contact__interference=1e-5)
    summary = summary_of(copied)
    counts = {name: (stage["ran"], stage["reused"]) for name, stage in summary["stages"].items()}
    assert counts["mesh"] == counts["assemble"] == counts["reduce"] == (1, 1)
    assert counts["respond"] == (3, 1)
    assert len({curve["rom"] for curve in summary["curves"]}) == len(summary["models"]) == 2


def test_a_changed_source_makes_its_stage_and_what_follows_again(
    copied: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import pipeline.stages.cache_keys

    real = pipeline.stages.cache_keys.code_fingerprint

    def edited(*modules: str) -> str:
        return real(*modules) + ("edited" if modules == (pipeline.stages.cache_keys.CURVE_CODE,) else "")

    monkeypatch.setattr(pipeline.stages.cache_keys, "code_fingerprint", edited)
    assert rerun(copied) == expected(respond="ran", figures="ran")


DAMAGES = ("truncated", "altered", "gone", "added", "no list", "empty list")
DAMAGED = [("figures", "altered"), *((kind, damage) for kind in ("mesh", "reduce", "curve") for damage in DAMAGES)]


@pytest.mark.parametrize(("kind", "damage"), DAMAGED)
def test_damaged_results_are_noticed_and_made_again(copied: Path, kind: str, damage: str) -> None:
    before = json.loads((copied / "summary.json").read_text())["curves"]
    entry = sorted((copied / "store" / kind).iterdir())[0]
    file = max((path for path in entry.iterdir() if path.name != "entry.json"), key=lambda path: path.stat().st_size)
    content = file.read_bytes()
    if damage == "truncated":
        file.write_bytes(content[: len(content) // 2])
    elif damage == "altered":
        file.write_bytes(content[:-20] + bytes(255 - b for b in content[-20:]))
    elif damage == "gone":
        file.unlink()
    elif damage == "added":
        (entry / "more").touch()
    else:
        (entry / "entry.json").write_text("" if damage == "empty list" else "[]")
    found = rerun(copied)
    assert found[{"curve": "respond"}.get(kind, kind)] == "ran"
    after = json.loads((copied / "summary.json").read_text())["curves"]
    assert [c["peak_amplitude_m"] for c in after] == pytest.approx([c["peak_amplitude_m"] for c in before], rel=1e-9)


def test_exchanged_results_are_noticed_and_made_again(copied: Path) -> None:
    before = summary_of(copied)["curves"]
    one, other = sorted((copied / "store" / "curve").iterdir())
    one.rename(copied / "aside")
    other.rename(one)
    (copied / "aside").rename(other)
    assert rerun(copied) == expected(respond="ran")
    assert [curve["peak_amplitude_m"] for curve in summary_of(copied)["curves"]] == [
        curve["peak_amplitude_m"] for curve in before
    ]


def test_a_damaged_full_model_is_made_again_when_it_is_needed(copied: Path) -> None:
    entry = next((copied / "store" / "assemble").iterdir())
    (entry / "full.h5").write_bytes(b"not HDF5")
    assert rerun(copied)["assemble"] == "skipped"
    assert rerun(copied, "--until", "reduce", rom__modes=5)["assemble"] == "ran"


def test_lost_outputs_come_back_without_solving(copied: Path) -> None:
    for path in ("response.h5", "response.csv", "summary.json", "figures"):
        target = copied / path
        shutil.rmtree(target) if target.is_dir() else target.unlink()
    assert rerun(copied) == expected()
    assert all((copied / path).exists() for path in ("response.h5", "response.csv", "figures/response.png"))


def test_make_has_a_target_for_every_stage() -> None:
    lines = (Path(__file__).parents[2] / "Makefile").read_text().splitlines()
    (rule,) = [line for line, recipe in pairwise(lines) if recipe.endswith("--until $@")]
    assert rule == f"{' '.join(Stage)}: setup"
    (phony,) = [line for line in lines if line.startswith(".PHONY:")]
    assert set(Stage) <= set(phony.split())


def test_a_stage_comes_after_what_it_needs() -> None:
    stages = list(Stage)
    for stage in stages:
        assert stage.with_needs <= set(stages[: stages.index(stage) + 1])
        assert stage.results


@pytest.mark.parametrize("springs", [{"contact__tangential_stiffness": 0.0}, {"contact__normal_stiffness": 0.0}])
def test_faces_without_springs_of_one_kind_have_their_frequencies(tmp_path: Path, springs: dict[str, Any]) -> None:
    """Their stuck limit is that of the springs that they have."""
    path = write_scene(tmp_path / "s.toml", small_scene(**springs))
    status, _, error = shroud("run", path, "--out", tmp_path / "out", "--until", "respond", "--quiet")
    assert status == 0
    assert "problem" not in error
    summary = summary_of(tmp_path / "out")
    assert summary["problems"] == []
    assert summary["models"][0]["stuck_hz"]
