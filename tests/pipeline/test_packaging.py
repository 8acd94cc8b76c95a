"""The wheel: what is in it, and the program that comes out of it far from the sources; versions of the libraries."""

import os
import re
import shutil
import subprocess
import sys
import sysconfig
import tarfile
import tomllib
import zipfile
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

import pipeline

REPOSITORY = Path(__file__).parents[2]
ROOMS = ("geometry", "rom", "nonlinear", "pipeline")


def pip(*arguments: object, cwd: Path) -> None:
    """Run pip without a network."""
    asked = [sys.executable, "-m", "pip", "--disable-pip-version-check", "--no-input", *map(str, arguments)]
    done = subprocess.run(asked, cwd=cwd, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


@pytest.fixture(scope="module")
def sources(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy to build in: setuptools leaves things behind."""
    ignored = shutil.ignore_patterns(".venv", ".git", "out", "build", "dist", "*.egg-info", "*_cache", "__pycache__")
    return Path(shutil.copytree(REPOSITORY, tmp_path_factory.mktemp("sources") / "shroud", ignore=ignored))


@pytest.fixture(scope="module")
def wheel(sources: Path) -> Path:
    """The wheel, built by the setuptools that is installed."""
    pip("wheel", ".", "--no-deps", "--no-build-isolation", "--no-index", "--wheel-dir", sources / "dist", cwd=sources)
    (built,) = (sources / "dist").glob("*.whl")
    return built


def test_the_wheel_holds_the_four_packages_and_the_module_shroud(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        names = {name for name in archive.namelist() if ".dist-info/" not in name}
        said = archive.read(next(n for n in archive.namelist() if n.endswith("METADATA"))).decode()
    here = {
        path.relative_to(REPOSITORY).as_posix()
        for room in ROOMS
        for path in (REPOSITORY / room).rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }
    assert names == here | {"shroud.py"}
    assert wheel.stat().st_size < 2_000_000
    assert "Requires-Python: >=3.11" in said
    assert f"\nVersion: {pipeline.__version__}\n" in said
    assert "\nLicense-Expression: GPL-3.0-or-later\n" in said
    for extra in ("cholmod", "uff", "distributed", "tables", "docs", "dev"):
        assert f"Provides-Extra: {extra}" in said


def test_the_source_archive_holds_what_its_tests_need(sources: Path) -> None:
    code = "from setuptools import build_meta; print(build_meta.build_sdist('dist'))"
    done = subprocess.run([sys.executable, "-c", code], cwd=sources, capture_output=True, text=True, check=True)
    with tarfile.open(sources / "dist" / done.stdout.split()[-1]) as archive:
        names = {name.partition("/")[2] for name in archive.getnames()}
    wanted = {"Makefile", "README.md", "pyproject.toml", ".ci/run", "docs/conf.py", "scenes/dummy.toml"}
    wanted |= {"LICENSE", "CITATION.cff", "CHANGELOG.md", "requirements.lock", "shroud.py"}
    assert wanted <= names
    tests = {path.relative_to(REPOSITORY).as_posix() for path in (REPOSITORY / "tests").rglob("*.py")}
    assert tests <= names
    assert not [
        name for name in names if name.startswith((".venv", "out/", "dist/", "build/")) or "__pycache__" in name
    ]


@pytest.fixture(scope="module")
def installed(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the wheel installed into it."""
    folder = tmp_path_factory.mktemp("installed")
    pip("install", wheel, "--no-deps", "--no-index", "--target", folder, cwd=folder)
    return folder


def python(installed: Path, cwd: Path, code: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Python that sees the installed wheel and this environment's libraries, but not the sources."""
    environment = os.environ | {"PYTHONPATH": f"{installed}{os.pathsep}{sysconfig.get_paths()['purelib']}"}
    asked = [
        sys.executable,
        "-S",
        "-c",
        code,
        *arguments,
    ]  # -S: the environment's link to the sources is not followed
    return subprocess.run(asked, cwd=cwd, env=environment, capture_output=True, text=True, check=False)


def shroud(installed: Path, cwd: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """The installed program."""
    return python(installed, cwd, "from pipeline.cli import main; main()", *arguments)


def test_the_installed_program_works_far_from_the_sources(installed: Path, tmp_path: Path) -> None:
    places = "; ".join(f"import {room}; print({room}.__file__)" for room in ROOMS)
    found = python(installed, tmp_path, places).stdout.splitlines()
    assert [Path(line).parent for line in found] == [installed / room for room in ROOMS]
    module = python(installed, tmp_path, "import shroud; print(shroud.__file__, shroud.run_scene.__module__)")
    assert module.stdout.split() == [str(installed / "shroud.py"), "pipeline.python_interface"], module.stderr
    made = shroud(installed, tmp_path, "new", "mine")
    assert (made.returncode, made.stderr) == (0, "")
    scene = tmp_path / "mine" / "scene.toml"
    assert tomllib.loads(scene.read_text())["name"] == "mine"
    checked = shroud(installed, tmp_path, "validate", "mine/scene.toml")
    assert (checked.returncode, checked.stderr) == (0, "")
    assert checked.stdout.startswith("mine/scene.toml: valid, 8 curves")
    ran = shroud(installed, tmp_path, "run", "mine/scene.toml", "--until", "mesh")
    assert ran.returncode == 0, ran.stderr
    assert ran.stdout.endswith("results in out/mine\n")
    assert (tmp_path / "out" / "mine" / "summary.json").is_file()


def test_the_program_is_named_shroud(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        entry = archive.read(next(n for n in archive.namelist() if n.endswith("entry_points.txt"))).decode()
    assert entry.split() == ["[console_scripts]", "shroud", "=", "pipeline.cli:main"]


def allowed() -> list[Requirement]:
    """Everything that pyproject.toml asks for, with all extras."""
    project = tomllib.loads((REPOSITORY / "pyproject.toml").read_text())["project"]
    extras = [name for names in project["optional-dependencies"].values() for name in names]
    return [Requirement(name) for name in [*project["dependencies"], *extras]]


def test_every_library_has_a_lowest_version_and_one_below_which_it_must_stay() -> None:
    for entry in allowed():
        signs = {spec.operator for spec in entry.specifier}
        assert ">=" in signs, entry
        assert "<" in signs or entry.name in ("furo", "setuptools"), entry  # numbered by year; only builds


def test_the_lock_has_one_version_of_every_library_with_hashes_and_it_is_allowed() -> None:
    """What the libraries need themselves pip asks for: with hashes it installs nothing that is not in the lock."""
    lines = (REPOSITORY / "requirements.lock").read_text().replace("\\\n", "").splitlines()
    entries = [re.sub(r" ;.*?(?= --hash)", "", line).split() for line in lines if not line.startswith("#")]
    pinned = [entry.partition("==")[::2] for entry, *_ in entries]
    assert all(
        hashes and all(re.fullmatch(r"--hash=sha256:[0-9a-f]{64}", each) for each in hashes) for _, *hashes in entries
    )
    versions = dict(pinned)
    assert len(versions) == len(entries)
    for library in allowed():
        assert canonicalize_name(library.name) in versions, f"{library.name}: make lock"
        assert library.specifier.contains(versions[canonicalize_name(library.name)], prereleases=True), library


def test_version_and_licence_are_the_same_everywhere() -> None:
    citation = (REPOSITORY / "CITATION.cff").read_text()
    assert f"\nversion: {pipeline.__version__}\n" in citation
    assert "\nlicense: GPL-3.0-or-later\n" in citation
    released = re.search(r"^date-released: (.*)$", citation, flags=re.MULTILINE)
    assert released
    assert f"\n## {pipeline.__version__} - {released[1]}\n" in (REPOSITORY / "CHANGELOG.md").read_text()
    assert (REPOSITORY / "LICENSE").read_text().split()[:5] == ["GNU", "GENERAL", "PUBLIC", "LICENSE", "Version"]
