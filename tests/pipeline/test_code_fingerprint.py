"""The key of a stage changes with every module that computes its result, and with no other."""

from __future__ import annotations

import ast
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from pipeline_support import small_scene, write_scene

import pipeline.stages.cache_keys as keys
from pipeline.scene.reading import read_scene
from pipeline.stages.code_fingerprint import CARRIERS, PACKAGES, REPOSITORY, SourceTree, imports

pytestmark = pytest.mark.xdist_group("fingerprint")  # one worker: what the module makes is made once

ENTRIES = {
    "mesh": keys.MESH_CODE,
    "assemble": keys.FULL_MODEL_CODE,
    "reduce": keys.REDUCED_MODEL_CODE,
    "curve": keys.CURVE_CODE,
    "frequencies": "pipeline.stages.natural_frequencies",
    "truncation": "pipeline.stages.modal_truncation",
    "figures": "pipeline.figures.figure_stage",
    "render": "pipeline.render.mode_shapes",
    "operating": "pipeline.render.operating_shapes",
    "verify": "pipeline.verify.compare",
}
PAGE = "pipeline.report.page"  # shows the results of all stages
FILES = [path for package in PACKAGES for path in sorted((REPOSITORY / package).rglob("*.py"))]


@pytest.fixture(scope="module")
def copy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The source of the packages, to be edited."""
    root = tmp_path_factory.mktemp("source")
    for package in PACKAGES:
        shutil.copytree(REPOSITORY / package, root / package, ignore=shutil.ignore_patterns("__pycache__"))
    return root


def prints(root: Path) -> dict[str, str]:
    """Fingerprint of every kind of result."""
    tree = SourceTree(root)
    return {kind: tree.fingerprint(module) for kind, module in ENTRIES.items()}


@pytest.mark.parametrize(
    ("module", "changed"),
    [
        ("pipeline/figures/style.py", {"figures"}),
        ("pipeline/scene/labels.py", {"figures", "operating"}),
        ("pipeline/scene/geometry_parameters.py", {"mesh", "verify"}),
        ("pipeline/stages/build_mesh.py", {"mesh"}),
        ("pipeline/stages/curve_file.py", {"curve", "figures", "operating"}),
        ("pipeline/stages/natural_frequencies.py", {"frequencies"}),
        ("pipeline/stages/modal_truncation.py", {"truncation"}),
        ("rom/finite_elements/assembly.py", {"assemble", "reduce", "truncation", "verify"}),
        ("nonlinear/response_solver.py", {"curve"}),
        ("pipeline/verify/other_mesh.py", {"verify"}),
        ("pipeline/report/rows.py", set()),
        ("pipeline/cli.py", set()),
        ("pipeline/store/content_store.py", set()),
        ("pipeline/process/progress.py", set()),
    ],
)
def test_an_edit_changes_the_keys_of_what_the_module_computes(copy: Path, module: str, changed: set[str]) -> None:
    before = prints(copy)
    path = copy / module
    text = path.read_text()
    path.write_text(text + "# edited\n")
    try:
        after = prints(copy)
    finally:
        path.write_text(text)
    assert {kind for kind in ENTRIES if before[kind] != after[kind]} == changed


@pytest.mark.parametrize(
    "module", ["report/rows", "report/viewer", "figures/style", "scene/labels", "results/tables"]
)
def test_an_edit_of_what_the_page_shows_changes_its_key(copy: Path, module: str) -> None:
    before = SourceTree(copy).fingerprint(PAGE)
    path = copy / f"pipeline/{module}.py"
    text = path.read_text()
    path.write_text(text + "# edited\n")
    try:
        assert SourceTree(copy).fingerprint(PAGE) != before
    finally:
        path.write_text(text)


RUN = """
import sys
from pathlib import Path
from pipeline.scene.schema import Scene
before = set(sys.modules)
from {module} import {maker} as make
scene = Scene.model_validate_json(Path("scene.json").read_text())
make({arguments})
print(*sorted(set(sys.modules) - before))
"""
MAKERS = {
    "mesh": ("make_mesh", "Path('.'), scene"),
    "assemble": ("make_full_model", "Path('.'), Path('sector.h5'), scene"),
    "reduce": ("make_reduced_model", "Path('.'), Path('sector.h5'), Path('full.h5'), scene"),
    "curve": ("solve_curve", "Path('.'), Path('rom.h5'), scene, {}"),
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where one process after another makes what the next one needs."""
    folder = tmp_path_factory.mktemp("made")
    scene = read_scene(write_scene(folder / "s.toml", small_scene(rom__modes="auto"))).first
    (folder / "scene.json").write_text(scene.model_dump_json())
    return folder


@pytest.mark.parametrize("kind", list(MAKERS))
def test_no_module_is_used_that_is_not_in_the_key(folder: Path, kind: str) -> None:
    """The modules that Python has really imported by the end, beside those that reading the source has found."""
    maker, arguments = MAKERS[kind]
    code = RUN.format(module=ENTRIES[kind], maker=maker, arguments=arguments)
    environment = {**os.environ, "PYTHONPATH": str(REPOSITORY)}
    said = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=folder, env=environment
    ).stdout
    used = {name for name in said.split() if name.partition(".")[0] in PACKAGES and not name.startswith(CARRIERS)}
    packages = {path.parent.relative_to(REPOSITORY).as_posix().replace("/", ".") for path in FILES}
    found, _ = SourceTree().reached(ENTRIES[kind])
    assert len(used) > 10
    assert used - packages <= found


def by_syntax_tree(text: str) -> Iterator[tuple[str, str]]:
    """What a source text imports when it runs, by `ast`."""
    tree = ast.parse(text)
    guarded = {
        id(inner)
        for node in ast.walk(tree)
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"
        for inner in ast.walk(node)
    }
    for node in ast.walk(tree):
        if id(node) in guarded:
            continue
        if isinstance(node, ast.Import):
            yield from ((alias.name, "") for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield from ((str(node.module), alias.name) for alias in node.names)


def test_imports_are_read_as_python_reads_them() -> None:
    for path in FILES:
        text = path.read_text()
        assert set(imports(text)) == set(by_syntax_tree(text)), path


def test_the_table_of_a_package_leads_to_the_module_that_defines_the_name() -> None:
    found, libraries = SourceTree().reached("pipeline.stages.build_full_model")
    assert "rom.finite_elements.full_model" in found
    assert "skfem" in libraries
    assert not any(name.startswith("nonlinear") for name in found)


def test_a_module_that_is_not_there_is_an_error() -> None:
    with pytest.raises(FileNotFoundError):
        SourceTree().fingerprint("pipeline.stages.gone")


def test_another_version_of_a_library_is_another_key(monkeypatch: pytest.MonkeyPatch) -> None:
    import pipeline.stages.code_fingerprint as code

    before = SourceTree().fingerprint(keys.MESH_CODE)
    monkeypatch.setattr(code, "_version", lambda library: "0" if library == "gmsh" else "1")
    one = SourceTree().fingerprint(keys.MESH_CODE)
    monkeypatch.setattr(code, "_version", lambda library: "1")
    assert len({before, one, SourceTree().fingerprint(keys.MESH_CODE)}) == 3
