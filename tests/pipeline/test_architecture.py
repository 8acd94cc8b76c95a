"""Rules of the code that a machine can hold: imports one way, small functions, nothing heavy at the start."""

import ast
import os
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from functools import cache
from pathlib import Path

import pytest
from pipeline_support import ground_scene, small_scene, write_ground_model, write_scene

pytestmark = pytest.mark.xdist_group("architecture")  # one worker: each file is parsed once

PROJECT = Path(__file__).parents[2]
PACKAGES = ("geometry", "rom", "nonlinear", "pipeline")
HEAVY = (
    "gmsh",
    "pyvista",
    "vtk",
    "matplotlib",
    "meshio",
    "meshlane",
    "mapdl_archive",
    "skfem",
    "numba",
    "rich",
    "jinja2",
    "PIL",
)
# Folders and top-level files of a package, lowest first: each imports only from those on earlier lines.
LAYERS = {
    "geometry": [
        {"errors", "gmsh_start", "hdf5_content"},
        {"elements", "units"},
        {"sector"},
        {"frames", "imported_mesh", "quality"},
        {"blade", "mesh_files"},
        {"own_mesh"},
        {"exchange", "subdivision"},
    ],
    "rom": [
        {"errors", "units"},
        {"linear_algebra"},
        {"finite_elements"},
        {"cyclic"},
        {"reduction"},
        {"cyclic_sector"},
        {"stress"},
        {"files"},
        {"matrix_files"},
    ],
    "nonlinear": [
        {"options"},
        {"contact"},
        {"response_curve"},
        {"problem"},
        {"harmonic_balance"},
        {"stability"},
        {"time_integration"},
        {"continuation"},
        {"nonlinear_modes"},
        {"branches"},
        {"harmonic_selection"},
        {"residual_tractions"},
        {"peak_errors", "mode_agreement"},
        {"worst_motion"},
        {"response_solver"},
        {"response_extension", "contact_states"},
        {"mistuned_ring"},
        {"peak_curves"},
        {"wear"},
    ],
    "pipeline": [
        {"bootstrap", "errors", "codec"},
        {"output_paths"},
        {"scene", "process"},
        {"store"},
        {"executor"},
        {"stages"},
        {"results"},
        {"studies"},
        {"figures", "render", "verify"},
        {"export", "stress"},
        {"report"},
        {"run"},
        {"study_reply"},
        {"check", "mode_diagrams", "new_scene", "optimise"},
        {"identify"},
        {"explore"},
        {"python_interface", "terminal"},
        {"command_usage"},
        {"cli"},
    ],
}
# A file of a study, pipeline/studies/NAME, with one of these names stands with the folder that it is a part of.
PARTS_OF_STUDIES = {"section": "scene", "checks": "scene", "figure": "figures", "report": "report"}
# Classes whose methods draw them: the figures are imported when such a method is called.
DRAWN_WHEN_CALLED = {"results.py", "curves.py"}
LONGEST_FILE, LONGEST_FUNCTION = 600, 70
MOST_PARAMETERS = 8
DEEPEST = 4
FILES = [path for package in PACKAGES for path in sorted((PROJECT / package).rglob("*.py"))]


@cache
def parsed(path: Path) -> ast.Module:
    """The code of a file; each is parsed once for all rules."""
    return ast.parse(path.read_text())


@cache
def imports(path: Path) -> tuple[tuple[str, str, bool], ...]:
    """(module, imported name or "", whether the import happens when the file is imported)."""
    return tuple(imports_below(parsed(path), True))


def imports_below(node: ast.AST, at_once: bool) -> Iterator[tuple[str, str, bool]]:
    """Imports in a statement; `at_once`: whether it is executed when the file is imported."""
    if isinstance(node, ast.Import):
        yield from ((alias.name, "", at_once) for alias in node.names)
    elif isinstance(node, ast.ImportFrom):
        module = "." * node.level + (node.module or "")
        yield from ((module, alias.name, at_once) for alias in node.names)
    later = isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
    later = later or (isinstance(node, ast.If) and "TYPE_CHECKING" in ast.dump(node.test))
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.stmt | ast.excepthandler | ast.match_case):
            yield from imports_below(child, at_once and not later)


def no_faults(rule: Callable[[Path], Iterator[str]], files: Sequence[Path] = FILES) -> None:
    """A rule holds in these files; those in which it does not are named, with what is wrong in each."""
    faults = [f"{path.relative_to(PROJECT).as_posix()}: {fault}" for path in files for fault in rule(path)]
    if faults:
        pytest.fail("\n".join(faults), pytrace=False)


def foreign_imports(path: Path) -> Iterator[str]:
    """Imports from a package that does not come before, of private names, or by the public face of a package."""
    package = path.relative_to(PROJECT).parts[0]
    for module, name, _ in imports(path):
        other, *inner = module.split(".")
        if not other:
            yield f"{module}: relative imports hide which folder is meant"
        if name.startswith("_") and name != "__version__":
            yield f"private name {name} of {module}"
        if other not in PACKAGES or other == package:
            continue
        if PACKAGES.index(other) >= PACKAGES.index(package):
            yield f"{package} must not import {other}"
        if not inner:
            yield f"{other}: import {name} from the module that defines it"


def test_packages_import_one_way_and_no_private_names() -> None:
    no_faults(foreign_imports)


def place_of(module: str) -> str:
    """The name in LAYERS of a module of a package: its folder or file."""
    _, place, _, part, *_ = [*module.split("."), "", "", ""]
    return PARTS_OF_STUDIES.get(part, place) if place == "studies" else place


def imports_from_above(path: Path) -> Iterator[str]:
    """Imports from folders of the same package that do not stand on an earlier line of LAYERS."""
    parts = path.relative_to(PROJECT).with_suffix("").parts
    package, own, inner = parts[0], place_of(".".join(parts)), parts[2:]
    layers = {name: layer for layer, names in enumerate(LAYERS[package]) for name in names}
    if own not in layers:
        if inner:  # else __init__, __main__
            yield f"{package}/{own} has no place in LAYERS"
        return
    for module, _, at_start in imports(path):
        if path.name in DRAWN_WHEN_CALLED and not at_start:
            continue
        other_package, other = module.partition(".")[0], place_of(module)
        if other_package != package or other in ("", own):
            continue
        if other not in layers:
            yield f"{module} has no place in LAYERS"
        elif layers[other] >= layers[own]:
            yield f"{package}/{own} must not import {package}/{other}"


def test_folders_import_one_way() -> None:
    no_faults(imports_from_above)


def test_every_folder_of_code_is_a_package() -> None:
    folders = {path.parent for path in FILES}
    assert [folder for folder in folders if not (folder / "__init__.py").is_file()] == []


def test_modules_of_tests_have_names_of_their_own() -> None:
    """The folders of tests are all on the path: of two modules with one name only the first is found."""
    names = [path.name for path in (PROJECT / "tests").rglob("*.py") if path.name != "conftest.py"]
    assert sorted({name for name in names if names.count(name) > 1}) == []


def input_and_output(path: Path) -> Iterator[str]:
    found = {module.split(".")[0] for module, _, _ in imports(path)}
    yield from sorted(found & {"h5py", "json", "tomllib", "subprocess", "multiprocessing"})


def test_geometry_does_no_general_input_and_output() -> None:
    no_faults(input_and_output, [path for path in FILES if "geometry" in path.parts])


def heavy_imports(path: Path) -> Iterator[str]:
    yield from sorted({module.split(".")[0] for module, _, at_start in imports(path) if at_start}.intersection(HEAVY))


def test_heavy_libraries_are_imported_where_they_are_used() -> None:
    no_faults(heavy_imports)


def runs_what_it_reads(path: Path) -> Iterator[str]:
    """Pickle, eval, exec, unsafe loaders or shells."""
    read = {"pickle", "cPickle", "dill", "cloudpickle", "joblib", "shelve", "marshal", "yaml"}
    yield from sorted(read & {module.partition(".")[0] for module, *_ in imports(path)})
    for node in ast.walk(parsed(path)):
        if isinstance(node, ast.Call):
            called = {getattr(node.func, "id", ""), *(keyword.arg for keyword in node.keywords)}
            for name in called & {"eval", "exec", "compile", "__import__", "allow_pickle", "shell"}:
                yield f"{name} in line {node.lineno}"


def test_nothing_that_is_read_is_run() -> None:
    no_faults(runs_what_it_reads)


def large(path: Path) -> Iterator[str]:
    """What is too long, nested too deep or has too many parameters."""
    lines = len(path.read_text().splitlines())
    if lines >= LONGEST_FILE:
        yield f"{lines} lines"
    for node in ast.walk(parsed(path)):
        if isinstance(node, ast.FunctionDef):
            assert node.end_lineno is not None
            if node.end_lineno - node.lineno >= LONGEST_FUNCTION:
                yield f"{node.name}: {node.end_lineno - node.lineno} lines"
            count = len(node.args.posonlyargs) + len(node.args.args)
            if count > MOST_PARAMETERS:
                yield f"{node.name}: {count} parameters"
            if depth(node) > DEEPEST:
                yield f"{node.name}: nested {depth(node)} deep"


def test_files_and_functions_stay_small() -> None:
    no_faults(large)


def depth(node: ast.AST) -> int:
    """How many loops, branches and blocks stand one within the other; `elif` counts as its `if`."""
    own = isinstance(node, ast.For | ast.While | ast.If | ast.With | ast.Try)
    inner = 0
    for child in ast.iter_child_nodes(node):
        if not isinstance(child, ast.stmt | ast.excepthandler | ast.match_case):
            continue
        chained = isinstance(node, ast.If) and isinstance(child, ast.If) and node.orelse == [child]
        inner = max(inner, depth(child) - chained)
    return own + inner


def modules_after(*arguments: object, cwd: Path) -> set[str]:
    """Top-level modules that a command has imported by its end, in a process of its own."""
    code = (
        "import sys\nfrom pipeline.cli import command\n"
        f"status = command({[str(a) for a in arguments]!r})\n"
        "print('STATUS', status, file=sys.stderr)\n"
        "print(*{name.partition('.')[0] for name in sys.modules}, sep='\\n', file=sys.stderr)"
    )
    environment = {**os.environ, "PYTHONPATH": str(PROJECT)}
    result = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=cwd, env=environment
    )
    head, _, rest = result.stderr.partition("STATUS 0\n")
    assert head == "", result.stderr
    return set(rest.split())


def test_help_imports_next_to_nothing(tmp_path: Path) -> None:
    found = modules_after("--help", cwd=tmp_path)
    assert not found.intersection([*HEAVY, "numpy", "scipy", "h5py", "pydantic"])


def test_validate_needs_no_solver_and_no_mesher(tmp_path: Path) -> None:
    scene = write_scene(tmp_path / "s.toml", small_scene())
    found = modules_after("validate", scene, cwd=tmp_path)
    assert not found.intersection([*HEAVY, "scipy", "h5py"])


def test_a_given_model_needs_no_mesher_and_no_renderer(tmp_path: Path) -> None:
    scene, rom = write_scene(tmp_path / "s.toml", ground_scene()), write_ground_model(tmp_path / "g.h5")
    found = modules_after("respond", scene, "--rom", rom, "--out", tmp_path / "out", "--quiet", cwd=tmp_path)
    assert not found.intersection(("gmsh", "pyvista", "vtk", "skfem", "meshio", "rich"))
    again = modules_after("respond", scene, "--rom", rom, "--out", tmp_path / "out", "--quiet", cwd=tmp_path)
    assert not again.intersection(("matplotlib", "gmsh", "pyvista", "numba"))


def test_a_run_without_a_render_imports_no_renderer(tmp_path: Path) -> None:
    scene = write_scene(tmp_path / "s.toml", small_scene())
    found = modules_after("run", scene, "--out", tmp_path / "out", "--until", "respond", "--quiet", cwd=tmp_path)
    assert "gmsh" in found
    assert not found.intersection(("pyvista", "vtk", "matplotlib"))
    again = modules_after("run", scene, "--out", tmp_path / "out", "--until", "respond", "--quiet", cwd=tmp_path)
    assert not again.intersection(("gmsh", "skfem", "scipy", "numba", "meshio"))


def test_groups_of_tests_stay_on_one_worker(request: pytest.FixtureRequest) -> None:
    """What a module makes for its tests is made once: pytest-xdist tells its groups by the names of the tests."""
    if request.config.getoption("dist", "no") == "loadgroup":
        assert request.node.nodeid.endswith("@architecture")
