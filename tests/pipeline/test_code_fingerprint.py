"""The key of a stage changes with every module that computes its result, and with no other."""

from __future__ import annotations

import ast
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from importlib.metadata import packages_distributions
from pathlib import Path

import pytest
from pipeline_support import (
    changing_when_locked,
    ground_scene,
    small_scene,
    write_ground_model,
    write_scene,
)

import pipeline.stages.cache_keys as keys
from pipeline.python_interface import run_scene
from pipeline.scene.reading import read_scene
from pipeline.stages import code_fingerprint
from pipeline.stages.code_fingerprint import CARRIERS, PACKAGES, REPOSITORY, SourceTree, imports, versions
from rom.linear_algebra import blas_kernels

ENTRIES = {
    "mesh": keys.MESH_CODE,
    "assemble": keys.FULL_MODEL_CODE,
    "reduce": keys.REDUCED_MODEL_CODE,
    "curve": keys.CURVE_CODE,
    "extension": keys.EXTENSION_CODE,
    "carried": keys.CARRIED_CODE,
    "frequencies": "pipeline.stages.model.natural_frequencies",
    "truncation": "pipeline.stages.model.modal_truncation",
    "figures": "pipeline.figures.figure_stage",
    "render": "pipeline.render.mode_shapes",
    "operating": "pipeline.render.operating_shapes",
    "verify": "pipeline.verify.compare",
}
PAGE = "pipeline.report.page"  # shows the results of all stages
DATA = [
    path.relative_to(REPOSITORY).as_posix()
    for package in PACKAGES
    for path in sorted((REPOSITORY / package).rglob("*"))
    if path.is_file() and path.suffix not in (".py", ".pyi", ".typed") and "__pycache__" not in path.parts
]
OTHERS = ("pipeline/scene/template/scene.toml", "pipeline/explore/templates/")
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


@contextmanager
def edited(*paths: Path) -> Iterator[None]:
    """The files with one more line within the block."""
    before = [path.read_bytes() for path in paths]
    for path, content in zip(paths, before, strict=True):
        path.write_bytes(content + b"\nEDITED = 1\n")
    try:
        yield
    finally:
        for path, content in zip(paths, before, strict=True):
            path.write_bytes(content)


def test_an_edit_of_any_module_that_a_stage_reaches_changes_its_key(copy: Path) -> None:
    """Each module for one of the stages that reach it; and modules that the same stages reach for all stages."""
    tree, stages = SourceTree(copy), [*ENTRIES.values(), PAGE]
    before = {stage: tree.fingerprint(stage) for stage in stages}
    reached = {stage: tree.reached(stage)[0] for stage in stages}
    groups: dict[frozenset[str], list[Path]] = {}
    for path in FILES:
        place = path.relative_to(REPOSITORY)
        module = ".".join((place.parent if path.name == "__init__.py" else place.with_suffix("")).parts)
        of = frozenset(stage for stage in stages if module in reached[stage])
        groups.setdefault(of, []).append(copy / place)
        if of:
            stage = min(of, key=lambda stage: len(reached[stage]))
            tree._texts.pop(module)  # read again; who imports whom is the same
            with edited(copy / place):
                assert tree.fingerprint(stage) != before[stage], (stage, module)
            tree._texts.pop(module)
    assert len(groups) > 10
    for of, paths in groups.items():
        tree._texts.clear()
        with edited(*paths):
            assert {stage for stage in stages if tree.fingerprint(stage) != before[stage]} == of


@pytest.mark.parametrize(
    ("module", "changed"),
    [
        ("pipeline/figures/style.py", {"figures"}),
        ("pipeline/scene/labels.py", {"carried", "figures", "operating"}),
        ("pipeline/scene/geometry_parameters.py", {"mesh", "verify"}),
        ("pipeline/stages/model/build_mesh.py", {"mesh"}),
        ("pipeline/stages/curve/curve_file.py", {"curve", "extension", "carried", "figures", "operating"}),
        ("pipeline/stages/model/natural_frequencies.py", {"frequencies"}),
        ("pipeline/stages/model/modal_truncation.py", {"truncation"}),
        ("rom/finite_elements/assembly.py", {"assemble", "reduce", "truncation", "verify"}),
        ("nonlinear/response_solver.py", {"curve", "extension", "carried"}),
        ("pipeline/verify/compare.py", {"verify"}),
        ("pipeline/report/rows.py", set()),
        ("pipeline/cli.py", set()),
        ("pipeline/store/content_store.py", set()),
        ("pipeline/process/progress.py", set()),
    ],
)
def test_an_edit_changes_the_keys_of_what_the_module_computes(copy: Path, module: str, changed: set[str]) -> None:
    before = prints(copy)
    with edited(copy / module):
        after = prints(copy)
    assert {kind for kind in ENTRIES if before[kind] != after[kind]} == changed


@pytest.mark.parametrize(
    "path",
    # not what `shroud new` writes and `shroud explore` shows, nor the mark of packages with types
    [path for path in DATA if not path.startswith(OTHERS) and not path.endswith("py.typed")],
)
def test_an_edit_of_a_data_file_changes_the_key_of_the_page(copy: Path, path: str) -> None:
    before = SourceTree(copy).fingerprint(PAGE)
    with edited(copy / path):
        assert SourceTree(copy).fingerprint(PAGE) != before


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
# Taken by NumPy and numba where they are there, to read Fortran and settings.
WITHOUT_PART = {"charset-normalizer", "pyyaml"}
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
    settings = {**os.environ, "PYTHONPATH": str(REPOSITORY)}
    said = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=folder, env=settings
    ).stdout
    used = {name for name in said.split() if name.partition(".")[0] in PACKAGES and not name.startswith(CARRIERS)}
    packages = {path.parent.relative_to(REPOSITORY).as_posix().replace("/", ".") for path in FILES}
    found, libraries = SourceTree().reached(ENTRIES[kind])
    assert len(used) > 10
    assert used - packages <= found
    distributions = packages_distributions()
    loaded = {
        distribution.lower().replace("_", "-")
        for name in {name.partition(".")[0] for name in said.split()} - {*sys.stdlib_module_names, *PACKAGES}
        for distribution in distributions.get(name, [])
    }
    assert "numpy" in loaded
    assert loaded - WITHOUT_PART <= set(versions(libraries))


def by_syntax_tree(text: str) -> Iterator[tuple[str, str]]:
    """What a source text imports when it runs, by `ast`."""
    nodes: list[ast.AST] = [ast.parse(text)]
    while nodes:
        node = nodes.pop()
        if isinstance(node, ast.If) and getattr(node.test, "id", "") == "TYPE_CHECKING":
            continue
        nodes.extend(ast.iter_child_nodes(node))
        if isinstance(node, ast.Import):
            yield from ((alias.name, "") for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield from ((str(node.module), alias.name) for alias in node.names)
        elif isinstance(node, ast.Call) and "import_module" in (
            getattr(node.func, "id", ""),
            getattr(node.func, "attr", ""),
        ):
            yield from ((argument.value, "") for argument in node.args if isinstance(argument, ast.Constant))


def test_a_program_updated_while_a_run_waits_has_no_part_in_its_keys(
    copy: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The run has begun with the program as it was; the next one finds its results only as long as it is that."""
    scene, rom = write_scene(tmp_path / "g.toml", ground_scene()), write_ground_model(tmp_path / "g.h5")
    solver = copy / "nonlinear" / "response_solver.py"
    text = solver.read_bytes()
    monkeypatch.setattr(code_fingerprint, "SourceTree", partial(SourceTree, copy))

    def run() -> str:
        code_fingerprint._tree.cache_clear()
        code_fingerprint.code_fingerprint.cache_clear()
        found = run_scene(scene, tmp_path / "out", rom=rom, until="respond").summary["stages"]
        return str(found["respond"]["status"])

    try:
        with changing_when_locked(lambda: solver.write_bytes(text + b"EDITED = 1\n")):
            assert run() == "ran"
        assert run() == "ran"
        solver.write_bytes(text)
        assert run() == "reused"
    finally:
        solver.write_bytes(text)
        code_fingerprint._tree.cache_clear()
        code_fingerprint.code_fingerprint.cache_clear()


def test_imports_are_read_as_python_reads_them() -> None:
    for path in FILES:
        text = path.read_text()
        assert set(imports(text)) == set(by_syntax_tree(text)), path


def test_the_modules_behind_a_stage_are_those_that_it_imports() -> None:
    found, libraries = SourceTree().reached("pipeline.stages.model.build_full_model")
    assert "rom.finite_elements.full_model" in found
    assert "skfem" in libraries
    assert not any(name.startswith("nonlinear") for name in found)


def test_a_module_that_is_not_there_is_an_error() -> None:
    with pytest.raises(FileNotFoundError):
        SourceTree().fingerprint("pipeline.stages.gone")


def test_packages_only_hand_on_names() -> None:
    """So that an edit of a package that a stage's modules lie in has no part in the result."""
    reached = set().union(*(SourceTree().reached(module)[0] for module in ENTRIES.values()))
    for path in FILES:
        package = path.parent.relative_to(REPOSITORY).as_posix().replace("/", ".")
        if path.name != "__init__.py" or package in reached:
            continue
        for node in ast.parse(path.read_text()).body:
            names = {ast.unparse(target) for target in getattr(node, "targets", [getattr(node, "target", node)])}
            assert (
                isinstance(node, ast.Import | ast.ImportFrom | ast.Expr)
                or (isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING")
                or (isinstance(node, ast.FunctionDef) and node.name in ("__getattr__", "__dir__"))
                or names <= {"__all__", "_PLACES", "_STUB", "__version__"}
            ), f"{path}: line {node.lineno}"


def test_another_version_of_a_library_is_another_key(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of one that is imported, or that such a one needs; of others not."""
    real = code_fingerprint._installed

    def fingerprint(changed: str, module: str) -> str:
        monkeypatch.setattr(code_fingerprint, "_installed", lambda name: ("0", ()) if name == changed else real(name))
        return SourceTree().fingerprint(module)

    render = ENTRIES["render"]
    cases = {keys.MESH_CODE: "gmsh", keys.REDUCED_MODEL_CODE: "cvxopt", keys.CURVE_CODE: "llvmlite", render: "vtk"}
    for module, library in cases.items():
        assert fingerprint(library, module) != fingerprint("", module), library
        assert fingerprint("jsonschema", module) == fingerprint("", module)
    assert fingerprint("matplotlib", keys.CURVE_CODE) == fingerprint("", keys.CURVE_CODE)
    assert fingerprint("matplotlib", ENTRIES["figures"]) != fingerprint("", ENTRIES["figures"])


def test_a_library_that_is_not_installed_is_told_from_one_that_is() -> None:
    assert versions(["no-such-library"]) == {"no-such-library": "absent"}
    assert versions(["skfem"]).keys() >= {"scikit-fem", "numpy"}
    assert versions(["PIL"])["pillow"] != "absent"


CPU = "processor\t: 0\nvendor_id\t: any\nmodel\t\t: 1\nmicrocode\t: 7\nflags\t\t: fpu sse2 avx2 fma md_clear\n\n"


@pytest.mark.parametrize(
    ("old", "new", "other"),
    [
        ("avx2", "avx2 avx512f", True),
        ("model\t\t: 1", "model\t\t: 2", True),
        ("md_clear", "md_clear flush_l1d", False),  # an update of the system
        ("microcode\t: 7", "microcode\t: 8", False),
        ("sse2 avx2", "avx2 sse2", False),
        ("\n\n", "\n\nprocessor\t: 1\nmodel\t\t: 9\n\n", False),
    ],
)
def test_another_kind_of_processor_is_another_key(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, old: str, new: str, other: bool
) -> None:
    found, looked_up_again = [], code_fingerprint.machine.__wrapped__
    for text in (CPU, CPU.replace(old, new)):
        (tmp_path / "cpuinfo").write_text(text)
        monkeypatch.setattr(blas_kernels, "_PROCESSOR", tmp_path / "cpuinfo")
        monkeypatch.setattr(code_fingerprint, "machine", looked_up_again)
        found.append(SourceTree().fingerprint(keys.MESH_CODE))
    assert (found[0] != found[1]) == other


@pytest.mark.parametrize(
    ("name", "other"),
    [
        ("OPENBLAS_CORETYPE", True),
        ("NPY_DISABLE_CPU_FEATURES", True),
        ("NUMBA_CPU_NAME", True),
        ("NUMBA_CACHE_DIR", False),
        ("OPENBLAS_NUM_THREADS", False),
        ("HOME", False),
    ],
)
def test_settings_that_choose_other_kernels_are_in_the_key(
    monkeypatch: pytest.MonkeyPatch, name: str, other: bool
) -> None:
    monkeypatch.delenv(name, raising=False)
    before = code_fingerprint.machine.__wrapped__()
    monkeypatch.setenv(name, "/any")
    assert (code_fingerprint.machine.__wrapped__() != before) == other


def test_another_python_or_c_library_is_another_key(monkeypatch: pytest.MonkeyPatch) -> None:
    before = code_fingerprint.machine.__wrapped__()
    with monkeypatch.context() as patch:
        patch.setattr("platform.python_version", lambda: "3.99.0")
        assert code_fingerprint.machine.__wrapped__() != before
    with monkeypatch.context() as patch:
        patch.setattr(code_fingerprint, "_c_library", lambda: "musl 1")
        assert code_fingerprint.machine.__wrapped__() != before
